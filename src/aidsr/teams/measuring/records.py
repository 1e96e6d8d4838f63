"""Calls of tools as they are kept: what was asked, and what it brought."""

from __future__ import annotations

import json
from typing import Any, Literal

from pydantic import Field

from aidsr.core.artifacts import Artifact
from aidsr.core.calls import Png

FREE = ("propose", "keep", "finish", "read")
"""Tools that may be called when no calls are left, and are not counted."""


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
    def values(self) -> dict[str, Any]:
        """The arguments by name."""
        found: dict[str, Any] = json.loads(self.arguments or "{}")
        return found
