"""The table of teams compared: what counts as a failure, and what stands beside a success."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pytest
from benchmarks.teams.run import Asked, Floor, Row, Validated, publish, row_of, table

import aidsr
from aidsr.api import find_scene
from aidsr.core.calls import CallRecord, Question, Usage
from aidsr.runs import Run
from scenes import small_arm


def row(design: int, **facts) -> Row:
    known = {
        "task": "locomotion/incline",
        "arm": "four-roles",
        "run": "run",
        "design": design,
        "concept": f"Worm {design}",
        "outcome": "approved",
        "first_stable": True,
        "iterations": 1,
        "calls": 3,
        "tokens": 20_000,
        "latency_s": 600.0,
        "most_steps": 60_000,
    }
    return Row(**(known | facts))


WON = row(1, valid=True, successful=True, success_share=0.9, progress=0.98, scene_sha256="a", kept_perturbed=0.95)


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|\n").split("|")]


def titled(page: str, title: str) -> dict[str, str]:
    """The first row of the table whose head begins like this."""
    lines = page.splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith(f"| {title} |"))
    return dict(zip(cells(lines[head]), cells(lines[head + 2]), strict=True))


def test_a_design_that_was_not_approved_counts_as_a_failure_and_its_tokens_count() -> None:
    arm = titled(table([WON, row(2, outcome="invalid")]), "arm")
    assert arm["approved"].startswith("1 of 2 ")
    assert arm["successful"].startswith("1 of 2 ")
    assert arm["tokens a successful design"] == "40,000"


@pytest.mark.parametrize(
    ("facts", "told"), [({}, ""), ({"script": "both: 1"}, "script"), ({"motion": True}, "of the probe")]
)
def test_what_a_policy_began_with_is_told(facts: dict[str, object], told: str) -> None:
    assert titled(table([row(1, **facts)]), "task | arm")["motion"] == told


def test_the_budget_of_each_training_is_told() -> None:
    assert titled(table([row(1, steps=30_000)]), "task | arm")["steps"] == "60,000"
    assert titled(table([row(1, steps=250_000, most_steps=300_000)]), "task | arm")["steps"] == "300,000"
    assert titled(table([row(1, outcome="invalid")]), "task | arm")["steps"] == ""


def test_an_arm_without_a_success_has_no_tokens_a_success() -> None:
    assert titled(table([row(1)]), "arm")["tokens a successful design"] == "none succeeded"


def test_valid_designs_that_win_too_little_to_be_tested_are_counted() -> None:
    arm = titled(table([WON, row(2, valid=True, success_share=0.15), row(3, success_share=0.0)]), "arm")
    assert (arm["valid"][:6], arm["untested"]) == ("2 of 3", "1")


def test_designs_of_one_task_are_resampled_together() -> None:
    """With three designs a task that agree, six tasks say as much as six designs, not as eighteen."""
    tasks = ("incline", "gap", "stairs", "tunnel", "obstacles", "flat_ground")
    rows = [
        WON.model_copy(update={"task": f"locomotion/{task}", "design": design, "successful": at < 3})
        for at, task in enumerate(tasks)
        for design in (1, 2, 3)
    ]
    page = table(rows)
    assert titled(page, "arm")["the same, tasks resampled"] == "17% to 83%"
    assert titled(page, "arm")["successful"] == "9 of 18 (29% to 71%)"
    assert titled(table(rows[:15]), "arm")["the same, tasks resampled"] == ""


def test_first_trainings_of_a_whole_arm_have_a_line_of_their_own() -> None:
    failed = WON.model_copy(update={"successful": False, "benchmark_version": 4})
    line = "| four-roles, first training | 1 | 1 | "
    assert line in table([WON], first=[failed])
    assert line not in table([WON, row(2)], first=[failed])


def test_designs_that_today_s_validator_refuses_are_counted() -> None:
    verdicts = [Validated(arm="four-roles", task="gap", design=n, stable=n == 1, commit="c0ffee") for n in (1, 2)]
    page = table([WON, row(2)], verdicts=verdicts)
    assert titled(page, "arm")["stable today"] == "1 of 2"
    assert "by the validator of commit c0ffee" in page


def test_the_floor_is_the_most_that_an_untrained_policy_wins_in_the_same_scene() -> None:
    floor = Floor(scene_sha256="a", wins={"idle": 0, "constant": 3, "random 25 Hz": 1}, episodes=20, commit="c")
    assert titled(table([WON], [floor]), "task | arm")["floor"] == "15%"
    assert titled(table([WON], [floor.model_copy(update={"scene_sha256": "b"})]), "task | arm")["floor"] == ""
    assert titled(table([WON]), "task | arm")["perturbed, kept"] == "95%"


def test_a_success_of_before_a_task_changed_does_not_count() -> None:
    old = row(1, task="manipulation/drawer_opening", successful=True, benchmark_version=4)
    page = table([old, old.model_copy(update={"benchmark_version": 5, "design": 2})])
    assert "| 1 of 2 (" in page
    assert "| manipulation/drawer_opening (version 4) |" in page


HEADER = {"functional_part": "tip", "actuator_groups": [{"name": "both", "actuators": ["pull_left", "pull_right"]}]}


@dataclass
class Writes:
    """A model that writes one robot, whatever it is asked."""

    mjcf: str
    name: str = "writes"

    def ask(self, question: Question) -> CallRecord:
        reply = f"```json\n{json.dumps(HEADER)}\n```\n```xml\n{self.mjcf}\n```"
        return CallRecord(
            question=question, model=self.name, reply=reply, finish="stop", usage=Usage(calls=1), started="2026-01-01"
        )


@pytest.mark.parametrize(("mjcf", "stable"), [(small_arm(), True), (small_arm(damping=0), False)])
def test_a_robot_that_was_taken_as_written_is_validated_before_it_is_trained(
    mjcf: str, stable: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class TrainedError(Exception):
        pass

    def train(*_given: object, **_options: object) -> None:
        raise TrainedError

    monkeypatch.setattr("benchmarks.teams.run.train", train)
    run = aidsr.design(task="button_pushing", model=Writes(mjcf), method="direct", concepts=1, runs=tmp_path)
    if stable:
        with pytest.raises(TrainedError):
            row_of(run, run.design(1), Asked(steps=100, perturbed=False))
    else:
        found = row_of(run, run.design(1), Asked(steps=100, perturbed=False))
        assert (found.outcome, found.first_stable, found.valid) == ("not stable", False, False)


def test_a_published_design_keeps_what_moves_together(tmp_path: Path) -> None:
    run = aidsr.design(task="button_pushing", model=Writes(small_arm()), method="direct", concepts=1, runs=tmp_path)
    publish(run, tmp_path / "published")
    made, published = (find_scene(each.design(1)) for each in (run, Run(tmp_path / "published")))
    assert published.groups == made.groups
    assert published.groups
