"""Leaving a part of the method out is another object in its place; the loop and the files stay the same."""

from __future__ import annotations

from dataclasses import replace

import pytest

import scripted
from aidsr.core.artifacts import MountSummary
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.loop.ablations import ablate
from aidsr.loop.run import create_run
from aidsr.loop.runner import run_designs
from aidsr.runs import read_status
from scripted import Script, Scripted


def grow(tmp_path, script: Script, method: str):
    team = Scripted([script])
    mount = MountSummary(name="ok", position_m=(0, 0, 1), z_axis=(0, 0, -1), x_axis=(1, 0, 0), moved_by=())
    asked = scripted.brief()
    asked = asked.model_copy(update={"summary": asked.summary.model_copy(update={"mounts": (mount,)})})
    run = create_run(asked, RunConfig(concepts=1, iterations=1), runs=tmp_path)
    parts = ablate(scripted.parts(team), method)
    return read_status(run_designs(run, parts)).designs[0], [role for role, _, _ in team.asked]


@pytest.mark.parametrize(
    ("method", "script", "approved", "asked"),
    [
        ("full", Script(verdicts=["coder", "coder"]), False, {"designer", "coder", "integrator", "judge"}),
        ("no_judge", Script(verdicts=["coder"]), True, {"designer", "coder", "integrator"}),
        ("no_judge", Script(robots=["chatter", "chatter"]), False, {"designer", "coder"}),
        ("no_integrator", Script(), True, {"designer", "coder", "judge"}),
        ("no_judge_or_integrator", Script(verdicts=["coder"]), True, {"designer", "coder"}),
        ("no_validation", Script(robots=["chatter"]), True, {"designer", "coder", "integrator", "judge"}),
        ("no_feedback", Script(robots=["chatter"], verdicts=["coder"]), True, {"designer", "coder", "integrator"}),
        ("direct", Script(robots=["chatter"], verdicts=["coder"]), True, {"designer", "coder"}),
    ],
)
def test_what_is_left_out_is_not_asked(tmp_path, method, script, approved, asked) -> None:
    design, roles = grow(tmp_path, script, method)
    assert (design.outcome.outcome == "approved") is approved
    assert set(roles) == asked


def test_the_full_method_is_the_parts_themselves() -> None:
    parts = scripted.parts(Scripted())
    assert ablate(parts, "full") is parts
    others = ablate(parts, "no_validation")
    assert others == replace(parts, validate=others.validate)


def test_rules_cannot_be_prompted(tmp_path) -> None:
    with pytest.raises(UserError, match="cannot be prompted directly"):
        create_run(scripted.brief(), RunConfig(method="direct"), runs=tmp_path)
