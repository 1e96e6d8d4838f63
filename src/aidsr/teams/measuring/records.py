"""Records of tool calls: their arguments and results."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from aidsr.core.artifacts import Artifact
from aidsr.core.calls import Png, ToolCall
from aidsr.runs.files import JsonFile
from aidsr.tools.probing import MEAN_PROGRESS

TOOLS_FOLDER, WORK_FOLDER = "tools", "work"
"""Subfolders of an iteration's folder: for the recorded calls, and for the robots and scenes that they made."""
FREE = ("propose", "keep", "finish", "read")
"""Tools whose calls are not counted and are allowed when no calls are left."""
MEASURES = ("measure", "play", "probe", "train", "sweep")
"""Tools that measure a robot or a scene."""
_MADE = re.compile(r"((?:robot|scene)_\d+):")
_SKIPPED = re.compile(r"((?:robot|scene)_\d+) does not exist: this call made nothing\Z")


class ToolRecord(Artifact):
    """One tool call and its result."""

    name: str
    arguments: str
    """JSON text of the arguments, as the model wrote it."""
    text: str
    pictures: tuple[Png, ...] = ()
    outcome: Literal["done", "failed", "refused"]
    """Whether the call was carried out, failed for the reason in `text`, or was refused without an attempt."""
    seconds: float
    """Duration of the call [s]."""
    figures: dict[str, float] = Field(default_factory=dict)
    """Figures by name, by which code decides between scenes."""

    @property
    def counts(self) -> bool:
        """Whether the call counts towards the number of calls that a session may make."""
        return self.outcome != "refused" and self.name not in FREE

    @property
    def made(self) -> str:
        """Name of the robot or scene that the call made; "" if it made none."""
        found = _MADE.match(self.text) if self.outcome == "done" else None
        return found[1] if found else ""

    @property
    def named(self) -> str:
        """Name that the call used up, by making a robot or a scene or by failing to; "" if it used up none."""
        found = _SKIPPED.search(self.text)
        return self.made or (found[1] if found else "")

    @property
    def headline(self) -> str:
        """First line of the result, which summarizes it."""
        return self.text.partition("\n")[0]

    @property
    def subject(self) -> str:
        """Name of the robot or scene that the call was about; only for a call that was carried out."""
        return str(self.values.get("scene") or self.values.get("subject") or self.values.get("robot") or "")

    @property
    def progress(self) -> float | None:
        """Progress of the scene that was played, probed or trained; None if the result has no progress."""
        return self.figures.get(MEAN_PROGRESS, self.figures.get("progress"))

    @property
    def values(self) -> dict[str, Any]:
        """The arguments by name."""
        found: dict[str, Any] = json.loads(self.arguments or "{}")
        return found


@dataclass(frozen=True)
class Exchange:
    """A reply with tool calls, and the result of each call."""

    said: str
    """Text of the reply beside the calls."""
    calls: tuple[ToolCall, ...]
    results: tuple[ToolRecord, ...]
    """Results in the order of the calls."""


def recorded_calls(folder: Path) -> list[ToolRecord]:
    """Return the recorded calls in the folder of an iteration, in their order.

    Raises:
        UserError: The file of a record is damaged.
    """
    paths = sorted((folder / TOOLS_FOLDER).glob("[0-9]*_*.json"))
    return [record for path in paths if (record := JsonFile(path, ToolRecord).read())]
