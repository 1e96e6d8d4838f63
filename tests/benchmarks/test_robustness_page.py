"""The page on robustness is made of what was measured, and has a cell for each policy and perturbation."""

import importlib.util
import sys
from pathlib import Path

from aidsr.learn.episodes.perturbation import KINDS

HOME = Path(__file__).parents[2] / "benchmarks" / "robustness"


def test_the_published_page_is_that_of_the_published_measurements():
    spec = importlib.util.spec_from_file_location("robustness_measure", HOME / "measure.py")
    program = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = program
    spec.loader.exec_module(program)
    rows = program.read(HOME / "results.jsonl")
    page = program.page(rows)
    assert page == (HOME / "results.md").read_text(encoding="utf-8")
    cells = [line.count(" of 50 ") for line in page.splitlines() if line.startswith("|")]
    assert sum(cells) == len(rows) * (1 + len(KINDS))
