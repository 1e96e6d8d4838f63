"""Calls of tools as they are kept: what was asked, and what it brought."""

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
"""Of the recorded calls, and of what they made, in the folder of an iteration."""
FREE = ("propose", "keep", "finish", "read")
"""Tools that may be called when no calls are left, and are not counted."""
_MADE = re.compile(r"((?:robot|scene)_\d+):")


class ToolRecord(Artifact):
    """One call of a tool and what it brought."""

    name: str
    arguments: str
    """As the model wrote them."""
    text: str
    pictures: tuple[Png, ...] = ()
    outcome: Literal["done", "failed", "refused"]
    """Whether it was carried out, could not be, as the text says, or was refused without being tried."""
    seconds: float
    """It took."""
    figures: dict[str, float] = Field(default_factory=dict)
    """What decides between scenes, by name."""

    @property
    def counts(self) -> bool:
        """Whether it counts as one of the calls that a session may make."""
        return self.outcome != "refused" and self.name not in FREE

    @property
    def made(self) -> str:
        """Name of the robot or scene that it made, "" where it made none."""
        found = _MADE.match(self.text) if self.outcome == "done" else None
        return found[1] if found else ""

    @property
    def headline(self) -> str:
        """What it found, in a line: the first one of a result says it."""
        return self.text.partition("\n")[0]

    @property
    def subject(self) -> str:
        """Name of the robot or scene that it was about; of one that was carried out."""
        return str(self.values.get("scene") or self.values.get("subject") or self.values.get("robot") or "")

    @property
    def progress(self) -> float | None:
        """How far the scene came that was played, probed or trained; None where it says nothing of that."""
        return self.figures.get(MEAN_PROGRESS, self.figures.get("progress"))

    @property
    def values(self) -> dict[str, Any]:
        """The arguments by name."""
        found: dict[str, Any] = json.loads(self.arguments or "{}")
        return found


@dataclass(frozen=True)
class Exchange:
    """A reply that called tools, and what each call brought."""

    said: str
    """The text beside the calls."""
    calls: tuple[ToolCall, ...]
    results: tuple[ToolRecord, ...]
    """In the order of the calls."""


def recorded_calls(folder: Path) -> list[ToolRecord]:
    """Return the calls on record in the folder of an iteration, in their order.

    Raises:
        UserError: A file of one is damaged.
    """
    paths = sorted((folder / TOOLS_FOLDER).glob("[0-9]*_*.json"))
    return [record for path in paths if (record := JsonFile(path, ToolRecord).read())]
