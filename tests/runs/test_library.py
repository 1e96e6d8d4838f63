"""Finding runs by name, throwing them away and taking them back; who is at work; trainings and comparisons."""

import json
import os
from pathlib import Path

import pytest

from aidsr.core.artifacts import Concept, Fault, Placement, ValidationReport
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.runs import EventLog, Library, Run, RunRecord
from aidsr.runs.compare import Attempted, compare
from aidsr.runs.events import Started, at_work
from aidsr.runs.library import fingerprint
from aidsr.runs.trainings import Inspection, Training, learning_in_words, read_curve, trainings_of


def written(folder: Path, name: str, started: str = "2026-01-31T10:00:00+00:00") -> Run:
    run = Run(folder / name)
    run.path.mkdir(parents=True)
    run.record.write(RunRecord(objective="press", config=RunConfig(), started=started, versions={}))
    return run


def test_runs_come_newest_first_by_what_they_say_themselves(tmp_path: Path) -> None:
    written(tmp_path, "b_old", "2025-01-01T00:00:00+00:00")
    written(tmp_path, "a_new", "2026-05-01T00:00:00+02:00")
    (tmp_path / "no_run").mkdir()
    (tmp_path / "damaged").mkdir()
    (tmp_path / "damaged" / "run.json").write_text("{")
    os.utime(tmp_path / "damaged" / "run.json", (0, 0))
    assert [run.path.name for run in Library(tmp_path).runs()] == ["a_new", "b_old", "damaged"]
    assert Library(tmp_path / "nowhere").runs() == ()


@pytest.mark.parametrize(
    "name",
    [
        "..",
        ".",
        "",
        "../outside",
        "a/b",
        "/etc",
        ".trash",
        "x\0y",
        "nowhere",
        "link",
        "a\\b",
        " mine",
        "mine ",
        "mine\n",
    ],
)
def test_only_runs_directly_in_the_folder_have_names(tmp_path: Path, name: str) -> None:
    home, outside = tmp_path / "home", tmp_path / "outside"
    written(home, "mine")
    written(tmp_path, "outside")
    (home / "link").symlink_to(outside)
    with pytest.raises(UserError, match="is not a run under"):
        Library(home).run(name)


@pytest.mark.parametrize("name", ["Greifer Versuch 1", "Größe (neu)", "захват", "夹爪_2", "2026-01-31_1002_press_7f3a"])
def test_a_person_may_call_a_run_what_they_like(tmp_path: Path, name: str) -> None:
    run, library = written(tmp_path, name), Library(tmp_path)
    assert library.runs() == (run,)
    assert library.run(name) == run


def test_what_was_thrown_away_can_be_taken_back(tmp_path: Path) -> None:
    library = Library(tmp_path)
    written(tmp_path, "mine")
    library.trash("mine")
    assert library.runs() == ()
    library.restore("mine")
    assert [run.path.name for run in library.runs()] == ["mine"]
    with pytest.raises(UserError, match="is not a run under"):
        library.restore("mine")


def test_a_run_at_work_is_not_thrown_away(tmp_path: Path) -> None:
    run = written(tmp_path, "mine")
    assert at_work(run.events) is False
    with EventLog(run.events) as log:
        log.write(Started())
        assert at_work(run.events) is True
        with pytest.raises(UserError, match="stop it first"):
            Library(tmp_path).trash("mine")
    assert at_work(run.events) is False


def test_the_fingerprint_changes_with_what_happens(tmp_path: Path) -> None:
    run = written(tmp_path, "mine")
    marks = [fingerprint(run)]
    with EventLog(run.events) as log:
        log.write(Started())
    marks.append(fingerprint(run))
    run.design(1).iteration(1).path.mkdir(parents=True)
    marks.append(fingerprint(run))
    folder = run.design(1).path / "training" / "001"
    folder.mkdir(parents=True)
    (folder / "curve.csv").write_text("steps\n")
    marks.append(fingerprint(run))
    assert len(set(marks)) == 4
    assert fingerprint(run) == marks[-1]


def test_a_training_is_read_while_it_goes_on(tmp_path: Path) -> None:
    design = written(tmp_path, "mine").design(1)
    assert trainings_of(design) == ()
    folder = design.path / "training" / "001"
    folder.mkdir(parents=True)
    (folder / "config.json").write_text('{"task": "reaching/button_pushing", "steps": 100}')
    (folder / "curve.csv").write_text(
        "steps,wall_s,episodes,success_share,progress,reward,diverged,steps_per_s\n"
        "50,1.5,0,nan,nan,nan,0,33.0\n100,3.0,4,0.25,0.5,2.0,0,33.0\n150,"
    )
    (training,) = trainings_of(design)
    assert [row.steps for row in read_curve(training)] == [50, 100]
    assert read_curve(training)[0].success_share is None
    assert read_curve(training)[1].success_share == 0.25
    assert read_curve(training) == read_curve(training)  # a page draws anew what has changed
    assert training.evaluation.read() is None
    training.inspect(Inspection(plausible=False, text="it slides"))
    training.inspect(Inspection(plausible=True))
    assert training.inspection.read() == Inspection(plausible=True)


def test_a_training_is_told_in_a_few_points(tmp_path: Path) -> None:
    training = Training(tmp_path)
    assert learning_in_words(training) == [], "not finished"
    rows = [f"{steps},{steps / 10},9,{steps / 20_000},{steps / 10_000},1.0,0,10.0" for steps in range(100, 10_001, 100)]
    head = "steps,wall_s,episodes,success_share,progress,reward,diverged,steps_per_s"
    (tmp_path / "curve.csv").write_text("\n".join([head, "50,5,0,nan,nan,nan,0,10.0", *rows]) + "\n")
    ended = {"steps": 10_000, "wall_s": 1000.0, "episodes": 1234, "diverged_episodes": 3, "stopped": "budget"}
    (tmp_path / "training.json").write_text(json.dumps(ended))
    took, curve = learning_in_words(training)
    assert took == (
        "trained for 16.7 minutes and 10,000 control steps, until all steps were used; "
        "1,234 episodes, 3 of them diverged"
    )
    points = curve.partition("): ")[2].split("; ")
    assert len(points) == 8
    assert (points[0], points[-1]) == ("100: 0%, 0.01", "10,000: 50%, 1.00")
    (tmp_path / "curve.csv").write_text(f"{head}\n50,5,0,nan,nan,nan,0,10.0\n")
    assert learning_in_words(training)[1].startswith("no episode ended")


@pytest.mark.parametrize("content", ["time,value\n1,2\n", "steps,wall_s\n1,2\n", "steps\nmany\n", b"\xff\xfe\n"])
def test_a_curve_that_is_none_of_ours_is_named(tmp_path: Path, content: str | bytes) -> None:
    (tmp_path / "curve.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(UserError, match=r"cannot read the learning curve .*curve\.csv"):
        read_curve(Training(tmp_path))


def fault(code: str, measured: float) -> Fault:
    return Fault(
        code=code, layer="simulate", severity="error", measured=measured, limit=1.0, unit="mm", message="measured"
    )


def test_a_comparison_says_what_changed_and_what_it_brought() -> None:
    concept = Concept(
        name="Arm", interpretation="", morphology="", actuation="", functional_part="", family="arm",
        parameters={"length_m": 0.3},
    )  # fmt: skip
    before = Attempted(
        number=1,
        concept=concept,
        robot="<a/>\n<b/>\n-- of a comment -->",
        placement=Placement(mount="mount", base="fixed"),
        report=ValidationReport(stable=False, faults=(fault("chatter", 9.0), fault("underdamped", 3.0))),
        judged=None,
    )
    after = before.model_copy(
        update={
            "concept": concept.model_copy(update={"parameters": {"length_m": 0.25}}),
            "robot": "<a/>\n<c/>\n<d/>\n++ of a comment -->",
            "placement": Placement(mount="mount", base="fixed", scale=0.8),
            "report": ValidationReport(stable=False, faults=(fault("chatter", 2.0), fault("sinks", 3.0))),
        }
    )
    told = compare(before, after)
    assert told.changed == (
        "length_m: 0.3 → 0.25",
        "the robot's MJCF: 3 lines added, 2 removed",
        "scale: 1 → 0.8",
    )
    assert told.better == ("underdamped is gone (1 place)", "chatter: 9 → 2 mm (at most 1)")
    assert told.worse == ("sinks is new (1 place)",)
    stable = after.model_copy(update={"report": ValidationReport(stable=True), "judged": True})
    assert compare(after.model_copy(update={"judged": False}), stable).better == (
        "it is stable now",
        "chatter is gone (1 place)",
        "sinks is gone (1 place)",
        "the Judge passes it now",
    )
