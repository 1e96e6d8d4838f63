"""What the overview page of a run says."""

import re
from pathlib import Path
from typing import Any

import pytest

from aidsr.core.artifacts import Brief, Concept, Critique, EnvironmentSummary, Placement
from aidsr.core.config import RunConfig
from aidsr.runs import EventLog, Run, RunRecord, write_summary
from aidsr.runs.events import Waiting
from aidsr.runs.folders import new_run
from aidsr.teams.providers import is_offline

SUMMARY = EnvironmentSummary(
    gravity_m_s2=(0, 0, -9.81), timestep_s=0.002, mounts=(), bodies=(), sites=(), sensors=(), actuators=()
)
CONCEPT = Concept(name="arm", interpretation="i", morphology="m", actuation="a", functional_part="tip", family="arm")


def run_in(place: Path, **settings: Any) -> Run:
    config = RunConfig(**settings)
    record = RunRecord(objective="Reach it", config=config, started="2026-01-31T10:02:59+01:00", versions={})
    return new_run(place, record, Brief(objective="Reach it", environment="<mujoco />", summary=SUMMARY))


def test_the_command_to_view_a_design_can_be_pasted(tmp_path: Path) -> None:
    run = run_in(tmp_path / "my runs")
    assert f"aidsr view &#39;{run.path}/designs/1&#39;" in write_summary(run).read_text()


def test_the_mount_is_said_once(tmp_path: Path) -> None:
    run = run_in(tmp_path)
    for number, reason in ((1, "It is fixed to mount. It points at the place of work."), (2, "It is fixed to mount.")):
        iteration = run.design(number).iteration(1)
        iteration.concept.write(CONCEPT)
        iteration.placement.write(Placement(mount="mount", base="fixed", reason=reason))
    page = re.sub(r"\s+", " ", write_summary(run).read_text())
    assert "It is fixed to" not in page
    assert "<dd>fixed at mount <br>It points at the place of work.</dd>" in re.sub(r" +", " ", page)
    assert "<dd>fixed at mount ." in page or "<dd>fixed at mount." in page


def test_an_earlier_iteration_that_waits_is_the_one_shown_and_decided_on(tmp_path: Path) -> None:
    run = run_in(tmp_path)
    design = run.design(1)
    for number in (1, 2):
        iteration = design.iteration(number)
        iteration.concept.write(CONCEPT.model_copy(update={"name": f"arm {number}"}))
        iteration.preview.write(b"png")
        iteration.critique.write(Critique(passed=True))
    with EventLog(design.events) as log:
        log.write(Waiting(iteration=1))
    page = write_summary(run).read_text()
    assert "<code>designs/1/01/decision.json</code>" in page
    assert '<a href="designs/1/01/preview.png">' in page
    assert '<a href="designs/1/01/critique.json">critique</a>' in page
    assert "<h3>1. arm 1</h3>" in page
    assert "designs/1/02/" not in page


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({}, "Designed by the built-in rules, with seed 0."),
        ({"model": "search"}, "Designed by the model search, with seed 0. This is not a language model"),
        ({"model": "openai:m"}, "language model openai:m in the roles of Designer, Coder, Scene Integrator and Judge."),
        ({"model": "openai:m", "method": "no_judge"}, "in the roles of Designer, Coder and Scene Integrator."),
        ({"model": "openai:m", "team": "measuring"}, "language model openai:m, which measured its bodies with tools."),
        ({"model": "openai:m", "method": "direct"}, "language model openai:m, asked directly for each robot."),
    ],
)
def test_the_page_says_who_designed(tmp_path: Path, settings: dict[str, Any], said: str) -> None:
    run = run_in(tmp_path, **settings)
    page = write_summary(run, offline=is_offline(run.asked().config.model)).read_text()
    assert said in re.sub(r"\s+", " ", re.sub(r"</?strong>", "", page))
    assert ("All prompts and replies" in page) == (settings.get("model") == "openai:m")
