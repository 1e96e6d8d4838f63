"""Studies on the home page: counted from their folders, their report shut in."""

import time
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from made import made_run

from aidsr.apps.web.routes import routes
from aidsr.apps.web.site import Site
from aidsr.apps.web.studies import Studies, StudyView
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import UserError
from aidsr.studies.budget import set_budget
from aidsr.studies.study import Arm, Study, StudyPlan, create_study


def made_study(path: Path) -> Study:
    arm = Arm(name="builtin", config=RunConfig(concepts=3))
    study = create_study(path, StudyPlan(tasks=("reaching/button_pushing",), arms=(arm,), runs=2, seeds=1))
    made_run(study.home(next(study.cells)))
    return study


def read(studies: Studies) -> tuple[StudyView, ...]:
    deadline = time.monotonic() + 60.0
    while not (views := studies.views()):
        assert time.monotonic() < deadline, "the studies were never read"
        time.sleep(0.01)
    return views


def test_a_study_is_counted_beside_the_runs_and_elsewhere(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    study = made_study(runs / "first")
    job = '{"time": "", "job": "train builtin/x/1 design 1 seed 0", "attempt": %d, "error": "no memory"}\n'
    (study.path / "failures.jsonl").write_text("".join(job % attempt for attempt in (1, 2, 3)))
    elsewhere = tmp_path / "second"
    elsewhere.mkdir()
    (elsewhere / "study.toml").write_text("tasks = 3")
    first, second = read(Studies(runs, [elsewhere]))
    assert (first.name, first.runs, first.runs_done, first.failed, first.complaint) == ("first", 2, 1, 1, "")
    assert first.usage.cost_usd == pytest.approx(0.75)
    assert first.jobs_left > 0
    assert first.core_hours_left > 0
    assert "is not a study plan" in second.complaint


def test_what_is_left_of_the_limits_of_a_study_is_shown(tmp_path: Path) -> None:
    limited, free = made_study(tmp_path / "first"), made_study(tmp_path / "second")
    set_budget(limited, Budget(cost_usd=20, tokens=1_000_000))
    first, second = read(Studies(tmp_path))
    paid, used = first.usage.cost_usd, first.usage.input_tokens + first.usage.output_tokens
    assert paid > 0 < used
    assert first.left == (f"${20 - paid:.2f} left of $20.00", f"{1_000_000 - used:,} tokens left of 1,000,000")
    assert second.left == ()
    set_budget(free, Budget(cost_usd=0.5))
    assert next(view.left for view in read(Studies(tmp_path)) if view.name == "second") == ("$0.00 left of $0.50",)


def test_a_report_is_shown_where_it_can_do_no_harm(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    study = made_study(runs / "first")
    with pytest.raises(UserError, match="aidsr report"):
        Studies(runs).report("1")
    (study.path / "report.html").write_text("<script>alert(1)</script>")
    application = FastAPI()
    application.include_router(routes(Site.at(runs)))
    visitor = TestClient(application)
    answer = visitor.get("/studies/1/report")
    assert answer.text == "<script>alert(1)</script>"
    assert answer.headers["content-security-policy"].startswith("sandbox; default-src 'none'")
    assert visitor.get("/studies/2/report").status_code == 404
    assert visitor.get("/studies/../report").status_code == 404
