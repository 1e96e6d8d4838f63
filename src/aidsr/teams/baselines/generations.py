"""How a search went, generation by generation: kept in the run's folder, so that it can be watched and goes on."""

from __future__ import annotations

from collections.abc import Sequence

from aidsr.core.artifacts import Artifact
from aidsr.runs import Run
from aidsr.runs.files import JsonFile, replace_file

__all__ = ["Generation", "read_search", "search_in_words", "write_search"]

_FILE = "search.json"
"""Rewritten with each generation."""


class Generation(Artifact):
    """Robots that a search tried at once, and what they were worth."""

    concept: int
    """Number of the concept that is searched for."""
    generation: int
    """0 is the rules' own robot, alone."""
    of: int
    """The last one."""
    worths: tuple[float, ...]


class _Search(Artifact):
    generations: tuple[Generation, ...]


def read_search(run: Run) -> tuple[Generation, ...]:
    """Return the generations of a run's search so far, none where nothing was searched."""
    found = JsonFile(run.path / _FILE, _Search).read()
    return found.generations if found else ()


def write_search(run: Run, generations: Sequence[Generation]) -> None:
    """Keep the generations of a run's search."""
    content = _Search(generations=tuple(generations)).model_dump_json(indent=2)
    replace_file(run.path / _FILE, content.encode() + b"\n")


def search_in_words(generations: Sequence[Generation]) -> str:
    """Return how far the search for the newest concept is, nothing before its first robot is measured."""
    if not generations:
        return ""
    last = generations[-1]
    mine = [each for each in generations if each.concept == last.concept]
    best, first = max(max(each.worths) for each in mine), mine[0].worths[0]
    return f"generation {last.generation} of {last.of}, worth {best:.2f} ({first:.2f} at first)"
