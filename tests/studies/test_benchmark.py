"""Studies from Python: run, resumed, read as records, compared; mistakes are one sentence."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

import aidsr
from aidsr.core.config import Budget
from aidsr.core.errors import UserError
from aidsr.runs.origin import MARK, ForeignFolderError
from aidsr.studies.records import COLUMNS
from aidsr.studies.runner import Progress
from aidsr.studies.submission import submit

TASK = "reaching/button_pushing"
PLAN = {"tasks": "button_pushing", "designs": 1, "concepts": 1, "seeds": 0, "probe": False}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> aidsr.Study:
    seen: list[Progress] = []
    found = aidsr.benchmark(str(tmp_path_factory.mktemp("studies") / "first"), **PLAN, jobs=1, listen=seen.append)
    assert (seen[-1].done, seen[-1].running, seen[-1].failed) == (2, (), ())
    return found


def test_a_study_is_run_and_has_its_report(study: aidsr.Study) -> None:
    assert study.plan.tasks == (TASK,)
    assert (study.path / "report.html").exists()
    assert aidsr.open_study(str(study.path)) == study


def test_it_is_resumed_by_the_same_call_or_by_its_folder_alone(study: aidsr.Study) -> None:
    for asked in (PLAN, {"resume": True}):
        seen: list[Progress] = []
        assert aidsr.benchmark(study.path, **asked, budget=Budget(tokens=1000), listen=seen.append) == study
        assert [each.done for each in seen] == [0], "nothing is done twice"
    assert '"tokens": 1000' in (study.path / "budget.json").read_text()


def test_its_designs_are_records_with_the_columns_of_the_report(study: aidsr.Study, tmp_path: Path) -> None:
    (record,) = aidsr.outcomes(study)
    expected = {"arm": "builtin", "task": TASK, "run": 1, "design": 1, "outcome": "approved", "stable": True}
    assert expected.items() <= record.items()
    assert (record["episodes_share"], record["complete"], record["valid"]) == (None, True, False)
    with (study.path / "report.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert tuple(row) == tuple(record) == COLUMNS
    written = {name: "" if value is None else str(value) for name, value in record.items()}
    assert row == written
    assert aidsr.outcomes(str(study.path)) == [record]
    submit(study, tmp_path / "sent.json")
    assert aidsr.outcomes(tmp_path / "sent.json") == [record]


def test_two_studies_are_compared(study: aidsr.Study, tmp_path: Path) -> None:
    found = aidsr.compare(study, str(study.path))
    assert [each.what for each in found.differences] == ["approved", "stable", "iterations"]
    assert all(each.value == 0 and not each.real for each in found.differences)
    assert found.notes == ()
    begun = aidsr.Study(tmp_path / "begun", study.plan)
    nothing = aidsr.compare(study, begun)
    assert nothing.differences == ()
    assert nothing.notes[0].startswith("The studies have no finished design in common")


def test_a_study_from_elsewhere_is_trusted_before_it_sends_anything(study: aidsr.Study, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(study.path, tmp_path / "theirs"))
    (copy / MARK).unlink()
    aidsr.benchmark(copy, resume=True)  # the rules send nothing
    plan = (copy / "study.toml").read_text()
    (copy / "study.toml").write_text(plan.replace('model = "builtin"', 'model = "a-model@http://127.0.0.1:1"'))
    with pytest.raises(ForeignFolderError, match="was not made here"):
        aidsr.benchmark(copy, resume=True)


def asking(**asked: object) -> Callable[[Path], object]:
    return lambda folder: aidsr.benchmark(folder / "s", **{**PLAN, **asked})


MISTAKES: list[tuple[Callable[[Path], object], type[Exception], str]] = [
    (asking(tasks="buton_pushing"), UserError, 'unknown task "buton_pushing"; did you mean'),
    (asking(tasks=5), TypeError, "tasks must be a name or a list of names, not 5"),
    (asking(tasks=["gap", 5]), TypeError, "tasks must be a name or a list of names, not 5"),
    (asking(tasks=[]), UserError, '"tasks": at least 1 entry required, found ()'),
    (asking(model="gpt-99"), UserError, '"gpt-99" is not a model name'),
    (asking(method="ful"), UserError, "no such method: ful; did you mean full?"),
    (asking(method=["human"]), UserError, '"human" continues the designs of "full"'),
    (asking(baseline="references"), UserError, "no such baseline: references; did you mean reference?"),
    (asking(baseline="search", search_robots=20), UserError, "invalid search_robots: 20; it must be a multiple of 8"),
    (asking(level="easy"), UserError, "\"level\": expected 'standard' or 'hard', found 'easy'"),
    (asking(protocol="sac"), UserError, "\"protocol\": expected 'best' or 'paper', found 'sac'"),
    (asking(designs=4, concepts=3), UserError, "4 designs per task is not a multiple of 3 concepts per run"),
    (asking(designs=30, concepts=30), UserError, "invalid concepts: 30; it must be less than or equal to 20"),
    (asking(designs=0), UserError, "designs must be at least 1: 0"),
    (asking(seeds="one"), TypeError, "seeds must be a whole number, not 'one'"),
    (asking(jobs=0), UserError, "jobs must be at least 1: 0"),
    (asking(jobs=1000), UserError, "jobs must be at most 512: 1000"),
    (asking(feedback=5), TypeError, "feedback must be the path of a TOML file, not 5"),
    (asking(budget=Budget(tokens_per_design=5)), UserError, "the limits of a study are for all its runs together"),
    (asking(resume=True), UserError, "resume cannot be combined with tasks, designs, concepts, seeds, probe: the plan"),
    (lambda folder: aidsr.benchmark(folder / "s", resume=True), UserError, "{folder}/s is not a study folder"),
    (lambda _folder: aidsr.benchmark(5), TypeError, "study must be the path of a folder, not 5"),
    (lambda _folder: aidsr.open_study(5), TypeError, "a study must be given as the path of its folder, not 5"),
    (lambda folder: aidsr.outcomes(folder), UserError, "{folder} is not a study folder: study.toml not found"),
    (lambda _folder: aidsr.outcomes(5), TypeError, "study must be a study, its folder, or a file written by aidsr su"),
    (lambda folder: aidsr.compare(folder, folder), UserError, "{folder} is not a study folder"),
]


@pytest.mark.parametrize(("mistake", "kind", "sentence"), MISTAKES)
def test_a_mistake_is_one_sentence_and_leaves_nothing(
    mistake: Callable[[Path], object], kind: type[Exception], sentence: str, tmp_path: Path
) -> None:
    with pytest.raises(kind) as caught:
        mistake(tmp_path)
    assert str(caught.value).startswith(sentence.replace("{folder}", str(tmp_path)))
    assert list(tmp_path.iterdir()) == []
