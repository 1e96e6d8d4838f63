"""The record of a search, generation by generation, in the run's folder; an interrupted search resumes from it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import AliasChoices, Field

from aidsr.core.artifacts import Artifact
from aidsr.runs import Run
from aidsr.runs.files import JsonFile, replace_file

_FILE = "search.json"
"""File of the record; rewritten with each generation."""


class Generation(Artifact):
    """Results of the robots that a search tried in one generation."""

    concept: int
    """Number of the concept."""
    generation: int
    """Number of the generation; 0 has only the robot of the rules."""
    of: int
    """Number of the last generation."""
    values: Annotated[
        tuple[float, ...], Field(validation_alias=AliasChoices("values", "worths"), serialization_alias="worths")
    ]
    """Values of the objective, one for each robot; "worths" in the file."""


class _Search(Artifact):
    generations: tuple[Generation, ...]


def read_search(run: Run) -> tuple[Generation, ...]:
    """Return the generations of a run's search so far; empty without a search."""
    found = JsonFile(run.path / _FILE, _Search).read()
    return found.generations if found else ()


def write_search(run: Run, generations: Sequence[Generation]) -> None:
    """Write the generations of a run's search."""
    content = _Search(generations=tuple(generations)).model_dump_json(indent=2, by_alias=True)
    replace_file(run.path / _FILE, content.encode() + b"\n")


def format_search(generations: Sequence[Generation]) -> str:
    """Return the progress of the search for the newest concept in words; empty before its first robot is measured."""
    if not generations:
        return ""
    last = generations[-1]
    own = [each for each in generations if each.concept == last.concept]
    best, first = max(max(each.values) for each in own), own[0].values[0]
    return f"generation {last.generation} of {last.of}, worth {best:.2f} ({first:.2f} at first)"
