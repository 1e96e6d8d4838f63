"""The table of teams compared: what counts as a failure, and what stands beside a success."""

from __future__ import annotations

from benchmarks.teams.run import Floor, Row, table


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
    """The first row of the table whose first column has this title."""
    lines = page.splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith(f"| {title} |"))
    return dict(zip(cells(lines[head]), cells(lines[head + 2]), strict=True))


def test_a_design_that_was_not_approved_counts_as_a_failure_and_its_tokens_count() -> None:
    arm = titled(table([WON, row(2, outcome="invalid")]), "arm")
    assert arm["approved"].startswith("1 of 2 ")
    assert arm["successful"].startswith("1 of 2 ")
    assert arm["tokens a successful design"] == "40,000"


def test_an_arm_without_a_success_has_no_tokens_a_success() -> None:
    assert titled(table([row(1)]), "arm")["tokens a successful design"] == "none succeeded"


def test_the_floor_is_the_most_that_an_untrained_policy_wins_in_the_same_scene() -> None:
    floor = Floor(scene_sha256="a", wins={"idle": 0, "constant": 3, "random 25 Hz": 1}, episodes=20, commit="c")
    assert titled(table([WON], [floor]), "task")["floor"] == "15%"
    assert titled(table([WON], [floor.model_copy(update={"scene_sha256": "b"})]), "task")["floor"] == ""
    assert titled(table([WON]), "task")["perturbed, kept"] == "95%"
