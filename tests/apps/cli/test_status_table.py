"""The table of a run's designs fits every terminal."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from aidsr.apps.cli.reporting import _print_designs
from aidsr.core.artifacts import Outcome
from aidsr.core.calls import Usage
from aidsr.runs import DesignStatus

USAGE = Usage(calls=9, input_tokens=24_310, output_tokens=12_844, tokens_estimated=True, cost_usd=None)


def design(number: int, concept: str) -> DesignStatus:
    return DesignStatus(
        number=number,
        concept=concept,
        family="arm",
        state="finished",
        iteration=3,
        stands_at=3,
        mechanical_repairs=2,
        round=1,
        doing="",
        stable=None,
        judged=None,
        faults=(),
        outcome=Outcome(outcome="out_of_budget", reason="no tokens left"),
        stopped=None,
        usage=USAGE,
        latency_s=750.0,
    )


def printed(width: int) -> list[str]:
    file = io.StringIO()
    designs = (design(1, "Four-cable trunk with a tapered tip"), design(2, "Antagonistic two-section arm"))
    _print_designs(Console(file=file, width=width, highlight=False), designs)
    return file.getvalue().splitlines()


@pytest.mark.parametrize("width", [40, 60, 80, 100, 140])
def test_nothing_is_cut_at_any_width(width: int) -> None:
    lines = printed(width)
    text = " ".join(" ".join(lines).split())
    assert max(map(len, lines)) <= width
    for whole in ("design", "iterations", "out_of_budget", "estimated", "unknown", "12 min", "cost"):
        assert whole in text


def test_a_wide_terminal_gets_a_table() -> None:
    header, first, *_ = printed(140)
    assert header.split() == ["design", "concept", "state", "iterations", "fixes", "tokens", "cost", "time"]
    assert first.startswith("1 ")


@pytest.mark.parametrize("width", [60, 80, 100, 140])
def test_a_concept_is_on_one_line(width: int) -> None:
    assert any("Four-cable trunk with a tapered tip" in line for line in printed(width))


def test_a_free_run_takes_two_lines_a_design_at_80_columns() -> None:
    file = io.StringIO()
    free = design(1, "Two-section arm with a hook, 256 mm").model_copy(update={"usage": Usage()})
    _print_designs(Console(file=file, width=80, highlight=False), (free,))
    assert [line.rstrip() for line in file.getvalue().splitlines()] == [
        "design 1: Two-section arm with a hook, 256 mm: out_of_budget",
        "  iterations: 3; fixes: 2; tokens: none; cost: $0; time: 12 min 30 s",
    ]
