"""The page on trials counts as it says, and its scenes stand in two halves."""

import pytest
from benchmarks.trial import report, run
from benchmarks.trial.scenes import half_of, name_of

from aidsr.tasks import TASKS


def row(scene: str, kind: run.Kind, progress: float, **changes: object) -> run.Row:
    values = {
        "scene": scene,
        "task": "grasping/simple_grasping",
        "half": "aside",
        "author": "built-in rules",
        "kind": kind,
        "success": 0.0,
        "progress": progress,
        "processor_s": 1.0,
        "scene_sha256": "0",
        "commit": "c",
        "processor": "p",
    }
    return run.Row.model_validate({**values, **changes})


def tried(scene: str, *searches: float, script: tuple[float, ...] = (), won: int = 0) -> run.Row:
    succeeded = [1.0] * won + [0.0] * (len(searches) + len(script) - won)
    details = {"searches": searches, "script": script, "succeeded": succeeded}
    return row(scene, "trial", sum(searches) / len(searches), details=details)


@pytest.mark.parametrize(
    ("trial", "back"),
    [
        (tried("a", 0.71, 0.9), False),
        (tried("a", 0.71, 0.3, 0.8), False),
        (tried("a", 0.71, 0.3, 0.2, script=(0.6,)), True),
        (tried("a", 0.3, 0.2, script=(0.75,)), False),
        (tried("a", 0.3, 0.2, won=2), False),
    ],
)
def test_a_scene_goes_back_by_the_decisive_stage(trial, back) -> None:
    assert report.sent_back(trial) is back


def test_shares_and_ranking_are_of_the_half_they_stand_under() -> None:
    rows = [
        tried("good", 0.9, 0.95),
        row("good", "earlier", 0.5, sent_back=True),
        tried("bad", 0.2, 0.1, script=(0.3,)),
        row("bad", "earlier", 0.6),
        tried("untrained", 0.9, 0.9),
        row("untrained", "earlier", 0.9),
    ]
    page = report.page_of(rows, {"good": (0.9, 0.95), "bad": (0.0, 0.3)})
    assert "2 scenes, at least 40 wanted" in page
    fails, succeeds, rank = (line for line in page.splitlines() if line.startswith(("| sent back", "| rank")))
    assert fails.split(" | ")[1:5] == ["none", "none", "0% of 1 (0% to 79%)", "100% of 1 (21% to 100%)"]
    assert succeeds.split(" | ")[3:5] == ["100% of 1 (21% to 100%)", "0% of 1 (0% to 79%)"]
    assert rank.split(" | ")[3:5] == ["-1.00 (2)", "1.00 (2)"]
    assert "| good | built-in rules | 90% (0.95) | sent back, 0.50 | passed, 0.90, 0.95 | 1, 1 |" in page


def short(scene: str, success: float, *, valid: bool = True) -> run.Row:
    back = success < 0.3 or not valid
    return row(scene, "short", success, success=success, sent_back=back, details={"valid": (float(valid),)})


def test_a_short_training_sends_back_what_neither_it_nor_a_motion_wins() -> None:
    assert report._solved(tried("a", 0.9, 0.9, won=2))
    assert not report._solved(tried("a", 0.9, 0.9, won=1)), "one of two is no majority"
    assert not report._solved(None)
    rows = [
        short("ring", 0.1),
        short("jaws", 0.1),
        tried("jaws", 0.9, 0.9, won=2),
        short("four-roles-laws/gap-1", 0.9, valid=False),
        short("four-roles-laws/gap-2", 0.9),
        short("four-roles/gap-3", 0.9),
    ]
    succeeds = {"ring": False, "jaws": False, "four-roles-laws/gap-1": True, "four-roles-laws/gap-2": True}
    page = report.short_page(rows, succeeds)
    fail, succeed = (line for line in page.splitlines() if line.startswith("| sent back"))
    assert fail.split(" | ")[1:] == ["50% of 2 (9% to 91%)", "none", "none |"]
    assert succeed.split(" | ")[1:] == ["none", "none", "50% of 2 (9% to 91%) |"]
    assert "| jaws | fails | yes | 10%, valid | passed |" in page
    assert "| four-roles-laws/gap-1 | succeeds |  | 90%, not valid | sent back |" in page
    assert "four-roles/gap-3" not in page, "its whole training is not known"


def test_ranks_share_ties() -> None:
    assert report.ranking([1, 2, 2, 3], [0.1, 0.5, 0.5, 0.9]) == pytest.approx(1.0)
    assert report.ranking([1, 2, 3, 4], [4, 3, 2, 1]) == pytest.approx(-1.0)


def test_each_task_has_a_built_in_design_in_either_half() -> None:
    assert all({half_of(task, 0), half_of(task, 1)} == {"decide", "aside"} for task in TASKS)
    assert name_of("reaching/button_pushing", 1) == "button_pushing-1"


def test_a_row_is_of_its_scene_as_it_is_today() -> None:
    class Scene:
        name = "a"

    assert run.is_of(tried("a", 0.5, 0.5), Scene, "trial", "0")
    assert not run.is_of(tried("a", 0.5, 0.5), Scene, "trial", "1")
    assert not run.is_of(tried("a", 0.5, 0.5), Scene, "earlier", "0")
