"""Environments with goals, complete and small: to start from, to look at, and to measure the rules by.

Each is `NAME.xml`, the environment without a robot, and `NAME.toml`, its goal; `examples.toml` says what is to be done.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

_FILES = files("aidsr.examples")


@dataclass(frozen=True)
class Example:
    """An environment with what is to be done in it."""

    name: str
    title: str
    objective: str
    environment: str
    """MJCF."""
    goal: str
    """TOML."""
    like: str = ""
    """Its name as a template of `aidsr new`; empty where it is none."""


@cache
def examples() -> dict[str, Example]:
    """Return all examples by name."""
    index = tomllib.loads((_FILES / "examples.toml").read_text(encoding="utf-8"))
    return {
        name: Example(
            name=name,
            environment=(_FILES / f"{name}.xml").read_text(encoding="utf-8"),
            goal=(_FILES / f"{name}.toml").read_text(encoding="utf-8"),
            **about,
        )
        for name, about in index.items()
    }


def templates() -> dict[str, Example]:
    """Return the examples that others are made from, by the kind of job: "reach", "grasp", "carry", "turn", "crawl"."""
    return {example.like: example for example in examples().values() if example.like}
