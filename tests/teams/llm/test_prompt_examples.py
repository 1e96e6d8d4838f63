"""What the prompts teach must be true: every robot they show passes the validator without a warning."""

from __future__ import annotations

import pytest

import aidsr
from aidsr.teams.llm.prompts import render
from aidsr.teams.llm.replies import fenced_blocks

EXAMPLES = [
    pytest.param(block.text, id=f"{role}-{number}")
    for role in ("designer", "coder", "integrator", "judge")
    for number, block in enumerate(fenced_blocks(render(role)), 1)
    if "<mujoco" in block.text
]


def test_the_coder_is_shown_a_robot() -> None:
    assert EXAMPLES


@pytest.mark.parametrize("mjcf", EXAMPLES)
def test_a_robot_shown_in_a_prompt_is_stable(mjcf: str) -> None:
    report = aidsr.validate(mjcf, mount="fixed", needs_contact=True)
    assert report.account() == "stable: no faults found"


@pytest.mark.parametrize("mjcf", EXAMPLES)
def test_it_is_also_worth_building(mjcf: str) -> None:
    report = aidsr.validate(mjcf, mount="fixed", realizable=True)
    assert report.account() == "stable: no faults found"
