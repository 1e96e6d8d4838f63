"""Small, complete environments with goals: templates, examples for users, and a test set for the built-in rules.

Each example has two files: `NAME.xml`, the environment without a robot, and `NAME.toml`, its goal. `examples.toml`
holds the title and the objective of each.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

_FILES = files("aidsr.examples")


@dataclass(frozen=True)
class Example:
    """An environment, an objective, and the goal that measures success."""

    name: str
    title: str
    objective: str
    environment: str
    """MJCF text."""
    goal: str
    """TOML text."""
    like: str = ""
    """Name of the template in `aidsr new --like`; empty if the example is not a template."""


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
    """Return the templates of `aidsr new` by kind of job: "touch", "grasp", "carry", "turn", "crawl"."""
    return {example.like: example for example in examples().values() if example.like}
