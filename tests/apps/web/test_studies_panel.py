"""Studies on the home page: counted from their folders, their report shut in."""

import time
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from made import made_run

from aidsr.apps.cli.plan_options import PlanOptions
from aidsr.apps.web.routes import routes
from aidsr.apps.web.site import Site
from aidsr.apps.web.studies import Studies, StudyView
from aidsr.apps.web.study_form import FRESH, asked
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import UserError
from aidsr.studies.budget import set_budget
from aidsr.studies.study import Arm, Study, StudyPlan, create_study


def made_study(path: Path) -> Study:
    arm = Arm(name="builtin", config=RunConfig(concepts=3))
    study = create_study(
        path, StudyPlan(tasks=("reaching/button_pushing",), arms=(arm,), runs=2, seeds=1, protocol="best")
    )
    made_run(study.home(next(study.cells)))
    return study


def studies_in(runs: Path, *more: Path) -> Studies:
    return Site.at(runs, more).studies


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
    first, second = read(studies_in(runs, elsewhere))
    assert (first.name, first.runs, first.runs_done, first.failed, first.complaint) == ("first", 2, 1, 1, "")
    assert first.usage.cost_usd == pytest.approx(0.75)
    assert first.jobs_left > 0
    assert first.core_hours_left > 0
    assert "is not a study plan" in second.complaint


def test_an_unreadable_study_at_work_is_listed_without_a_share(tmp_path: Path) -> None:
    fcntl = pytest.importorskip("fcntl")
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "study.toml").write_text("tasks = 3")
    site = Site.at(tmp_path)
    site.processes.folder.mkdir(parents=True)
    with (site.processes.folder / f"{site.studies.process('broken')}.log").open("wb") as log:
        fcntl.flock(log, fcntl.LOCK_EX)
        assert [view.at_work for view in read(site.studies)] == [True]
        (activity,) = site.activities.current()
    assert (activity.kind, activity.share) == ("study", None)


def test_studies_of_the_same_name_have_keys_of_their_own(tmp_path: Path) -> None:
    runs, more = tmp_path / "runs", [tmp_path / "one" / "first", tmp_path / "other" / "first"]
    for path in (runs / "2", runs / "first", *more):
        path.mkdir(parents=True)
        (path / "study.toml").write_text("tasks = 3")
    studies = studies_in(runs, *more)
    assert [view.key for view in read(studies)] == ["2", "first", "first-2", "first-3"]
    assert [studies.folder(key) for key in ("2", "first", "first-2", "first-3")] == [runs / "2", runs / "first", *more]


def test_a_folder_is_never_hidden_by_the_key_of_another(tmp_path: Path) -> None:
    runs, far = tmp_path / "runs", [tmp_path / "one" / "first", tmp_path / "other" / "first-2"]
    for path in (runs / "first", *far):
        path.mkdir(parents=True)
        (path / "study.toml").write_text("tasks = 3")
    studies = studies_in(runs, *far)
    assert studies.folder("first-2") == far[1], "its own name"
    assert studies.folder("first-3") == far[0]


def test_what_is_left_of_the_limits_of_a_study_is_shown(tmp_path: Path) -> None:
    limited, free = made_study(tmp_path / "first"), made_study(tmp_path / "second")
    set_budget(limited, Budget(cost_usd=20, tokens=1_000_000))
    first, second = read(studies_in(tmp_path))
    paid, used = first.usage.cost_usd, first.usage.input_tokens + first.usage.output_tokens
    assert paid > 0 < used
    assert first.left == (
        f"${20 - paid:.2f} of $20.00 remaining",
        f"{1_000_000 - used:,} of 1,000,000 tokens remaining",
    )
    assert second.left == ()
    set_budget(free, Budget(cost_usd=0.5))
    assert next(view.left for view in read(studies_in(tmp_path)) if view.name == "second") == (
        "$0.00 of $0.50 remaining",
    )


def test_a_report_is_shown_where_it_can_do_no_harm(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    study = made_study(runs / "first")
    with pytest.raises(UserError, match="aidsr report"):
        studies_in(runs).report("first")
    (study.path / "report.html").write_text("<script>alert(1)</script>")
    application = FastAPI()
    application.include_router(routes(Site.at(runs)))
    visitor = TestClient(application)
    answer = visitor.get("/studies/first/report")
    assert answer.text == "<script>alert(1)</script>"
    assert answer.headers["content-security-policy"].startswith("sandbox; default-src 'none'")
    assert visitor.get("/studies/second/report").status_code == 404
    assert visitor.get("/studies/../report").status_code == 404


def test_a_report_that_is_a_link_is_refused(tmp_path: Path) -> None:
    runs, elsewhere = tmp_path / "runs", tmp_path / "private.html"
    study = made_study(runs / "first")
    elsewhere.write_text("a secret")
    (study.path / "report.html").symlink_to(elsewhere)
    with pytest.raises(UserError, match=r"holds a link: report\.html"):
        studies_in(runs).report("first")
    application = FastAPI()
    application.include_router(routes(Site.at(runs)))
    assert TestClient(application).get("/studies/first/report").status_code == 404


def test_a_run_of_a_study_behind_a_link_is_refused(tmp_path: Path) -> None:
    study = made_study(tmp_path / "first")
    (begun, _) = Site.at(tmp_path).studies.view("first").cells
    arm, moved = study.path / "runs" / "builtin", tmp_path / "moved"
    arm.rename(moved)
    arm.symlink_to(moved)
    (study.path / "touched").write_text("")  # what a process has checked, it checks again after a change
    with pytest.raises(UserError, match="holds a link: runs/builtin"):
        Site.at(tmp_path).run(begun.name)


def test_the_runs_of_a_study_have_names_of_their_own(tmp_path: Path) -> None:
    made_study(tmp_path / "first")
    site = Site.at(tmp_path)
    begun, not_begun = site.studies.view("first").cells
    assert (begun.state, begun.designs, begun.approved) == ("finished", 3, 3)
    assert (not_begun.state, not_begun.name) == (None, "")
    run = site.run(begun.name)
    assert run.name == begun.name == "first~builtin~reaching.button_pushing~1"
    assert site.view(run).title == "button pushing"
    assert site.way_to(run.name)[-1] == ("first", "/study/first")
    with pytest.raises(UserError, match="not a run of a study"):
        site.run("first~builtin~reaching.button_pushing~2")


@pytest.mark.parametrize(
    "name", ["first~..~..~..", "first~builtin~x~.", "~a~b~c", "first~a~b", "none~a~b~1", "a~" * 50]
)
def test_a_name_that_is_no_run_of_a_study_is_refused(tmp_path: Path, name: str) -> None:
    made_study(tmp_path / "first")
    with pytest.raises(UserError):
        Site.at(tmp_path).run(name)


def test_a_run_of_a_study_is_not_deleted(tmp_path: Path) -> None:
    made_study(tmp_path / "first")
    site = Site.at(tmp_path)
    (begun, _) = site.studies.view("first").cells
    with pytest.raises(UserError, match="is not a run under"):
        site.trash(begun.name)
    assert site.run(begun.name).path.exists()


def test_a_form_becomes_the_plan_that_the_command_line_makes(tmp_path: Path) -> None:
    site = Site.at(tmp_path)
    form = {**FRESH, "name": "mine", "tasks": ["locomotion/gap"], "methods": ["full", "no_judge"], "cost_usd": 2.0}
    found = asked(site, form)
    options = PlanOptions(tasks=["gap"], method=["full", "no_judge"], designs=3)
    assert found.study.plan == options.plan()
    assert found.budget == Budget(cost_usd=2.0)
    assert not (tmp_path / "mine").exists()


@pytest.mark.parametrize("protocol", ["best", "paper"])
def test_a_form_says_by_which_protocol_policies_are_trained(tmp_path: Path, protocol: str) -> None:
    form = {**FRESH, "name": "mine", "tasks": ["locomotion/gap"], "protocol": protocol}
    assert asked(Site.at(tmp_path), form).study.plan.protocol == protocol
    form["methods"] = ["full", "from_probe"]
    if protocol == "paper":
        arms = asked(Site.at(tmp_path), form).study.plan.arms
        assert [arm.from_probe for arm in arms] == [False, True]
    else:
        with pytest.raises(UserError, match='protocol "paper"'):
            asked(Site.at(tmp_path), form)


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        ({"name": ""}, "has no name"),
        ({"name": "../out"}, "cannot be used as a folder name"),
        ({"name": "first"}, "already exists"),
        ({"designs": None}, "Designs per task and arm must be a whole number of at least 1"),
        ({"designs": 0}, "Designs per task and arm must be a whole number of at least 1"),
        ({"seeds": 2.7}, "Policies per design must be a whole number of at least 0"),
        ({"designs": 4}, "not a multiple of 3 concepts per run; use 3 or 6 designs"),
        ({"models": []}, "no model is selected"),
        ({"tokens": 0}, "Maximum tokens must be a whole number above 0"),
    ],
)
def test_what_a_form_lacks_is_said(tmp_path: Path, changed: dict[str, object], complaint: str) -> None:
    made_study(tmp_path / "first")
    with pytest.raises(UserError, match=complaint):
        asked(Site.at(tmp_path), {**FRESH, "name": "mine", **changed})
