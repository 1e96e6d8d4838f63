"""The table of speeds compares what was measured under the same conditions, and says what is a bound."""

import importlib
import json
import statistics
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "benchmarks" / "rl"


@pytest.fixture
def program(monkeypatch):
    pytest.importorskip("stable_baselines3")
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module("speed_page")


@pytest.fixture
def records(program):
    return importlib.import_module("records")


def run(records, ours_s, theirs_s, there=(True, True), patience=8.5):
    ours, theirs = (
        records.Way(wall_s=wall_s, steps=1000, there=ended, curve=((1.0, 0.1), (wall_s, 0.8)))
        for wall_s, ended in zip((ours_s, theirs_s), there, strict=True)
    )
    conditions = records.learning_conditions_now(300_000, patience)
    return records.Run(body="arm", seed=0, conditions=conditions, load=0.5, ours=ours, theirs=theirs)


@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        ((True, True), (True, True), "3.0 x"),
        ((True, False), (True, True), "at least 3.0 x"),
        ((False, True), (True, True), "1.5 x"),
        ((False, True), (False, True), "none: in most runs our recipe does not get there"),
    ],
)
def test_the_ratio_is_a_bound_where_the_defaults_were_stopped(program, records, first, second, said):
    runs = [run(records, 300.0, 900.0, first), run(records, 100.0, 800.0, second), run(records, 90.0, 135.0)]
    assert program.ratio_of(runs) == said


def test_stepping_is_compared_within_each_round(program, records):
    rounds = (
        {"physics": 1000.0, "batched": 900.0, "subproc": 450.0},
        {"physics": 200.0, "batched": 190.0, "subproc": 38.0},  # the machine was busy
        {"physics": 1100.0, "batched": 1100.0, "subproc": 500.0},
    )
    conditions = records.learning_conditions_now(300_000, 8.5)
    counts = {"simulations": 32, "processes": 8}
    stepping = records.Stepping(body="arm", conditions=conditions.machine, load=0.5, **counts, rounds=rounds)
    text = program.page([], [stepping], 5, conditions, "mine")
    assert "| batched, 32 simulations | 900 (190 to 1,100) | 95% |" in text
    assert "Batched against SubprocVecEnv: **2.2 x**" in text
    assert "--patience 8.5 --out mine`" in text
    assert "mine-curves.png" not in text, "nothing was trained, so no curves are drawn"


def test_a_stopped_measurement_goes_on_and_the_page_is_always_written(records, tmp_path, monkeypatch):
    speed, done = importlib.import_module("speed"), []

    def measured(kind, result):
        return lambda body, *_rest: done.append((kind, body.name)) or result

    way = run(records, 100.0, 800.0).ours
    monkeypatch.setattr(speed, "HOME", tmp_path)
    for name, result in {"made": "scene.xml", "speeds": ({"physics": 3.0, "batched": 2.0, "subproc": 1.0},)}.items():
        monkeypatch.setattr(speed, name, measured(name, result))
    for name in ("ours", "theirs"):
        monkeypatch.setattr(speed, name, measured(name, way))

    def asked(*words: str) -> list[str]:
        done.clear()
        monkeypatch.setattr("sys.argv", ["speed.py", "--out", "mine", *words])
        speed.main()
        return [f"{kind} {name}" for kind, name in done if kind != "made"]

    assert asked("--runs", "1", "--body", "arm", "--stepping") == ["speeds arm"]
    assert asked("--runs", "1", "--body", "arm") == ["ours arm", "theirs arm"]
    assert asked("--runs", "1") == ["speeds crawler", "ours crawler", "theirs crawler"]
    names = {"mine.md", "mine.jsonl", "mine-stepping.jsonl", "mine-curves.png"}
    assert {path.name for path in tmp_path.iterdir()} == names
    (tmp_path / "mine.md").unlink()
    assert asked("--runs", "1") == []
    assert "1 of 1 trainings are done" in (tmp_path / "mine.md").read_text()


def test_what_was_measured_is_kept_under_the_same_conditions_only(records, tmp_path):
    raw = tmp_path / "some.jsonl"
    found = run(records, 100.0, 800.0)
    assert records.kept(raw, records.Run, found.conditions) == []
    records.keep(raw, [found])
    assert records.kept(raw, records.Run, found.conditions) == [found]
    with pytest.raises(SystemExit, match="other conditions"):
        records.kept(raw, records.Run, run(records, 1.0, 2.0, patience=3.0).conditions)


def test_a_recipe_that_lacks_a_field_of_today_is_another_one(records, tmp_path):
    raw = tmp_path / "some.jsonl"
    found = run(records, 100.0, 800.0)
    line = json.loads(found.model_dump_json())
    del line["conditions"]["recipe"]["settling"]
    raw.write_text(json.dumps(line) + "\n")
    with pytest.raises(SystemExit, match="other conditions"):
        records.kept(raw, records.Run, found.conditions)


def test_the_defaults_are_told_by_the_point_at_which_they_got_there(records):
    watch = importlib.import_module("learning")._Until(success=0.5, most_s=1e6)
    for won in [False] * 60 + [True] * 60:
        watch.locals = {"infos": [{"episode": {}, "is_success": won}]}
        goes_on = watch._on_step()
        if not goes_on:
            break
    assert watch.there
    assert [share for _, share in watch.curve] == [0.4, 0.5]  # when there were 100, and when it got there


def test_the_published_table_is_that_of_its_records(program, records):
    kinds = {"results.jsonl": records.Run, "results-stepping.jsonl": records.Stepping}
    runs, steppings = (
        [kind.model_validate_json(line) for line in (FOLDER / name).read_text().splitlines()]
        for name, kind in kinds.items()
    )
    (conditions,) = {one.conditions.model_dump_json(): one.conditions for one in runs}.values()
    assert all(one.conditions == conditions.machine for one in steppings)
    assert (FOLDER / "results.md").read_text() == program.page(runs, steppings, 5, conditions, "results")


def test_the_docs_tell_the_measured_speeds():
    learned = [json.loads(line) for line in (FOLDER / "results.jsonl").read_text().splitlines()]
    stepped = [json.loads(line) for line in (FOLDER / "results-stepping.jsonl").read_text().splitlines()]
    told = " ".join((FOLDER.parents[1] / "docs" / "learning.md").read_text().split())

    def range_of(values, form):
        return f"{min(values):{form}} to {max(values):{form}}"

    for body, aim in (("crawler", "50 % of won episodes"), ("arm", "80 % of pressed buttons")):
        runs = [run for run in learned if run["body"] == body]
        wall = range_of([run["ours"]["wall_s"] for run in runs], ".0f")
        steps = range_of([run["ours"]["steps"] for run in runs], ",")
        assert f"{aim} in {wall} s and {steps}" in told
        assert len(runs) == 5
        most = max(share for run in runs for _, share in run["theirs"]["curve"])
        assert f"{most * 100:.0f} % of the {body}'s" in told
    assert not any(run["theirs"]["there"] for run in learned)
    assert f"with {range_of([run['theirs']['steps'] for run in learned], ',')} steps" in told
    rates = [[run[who]["steps"] / run[who]["wall_s"] for run in learned] for who in ("ours", "theirs")]
    faster = range_of([ours / theirs for ours, theirs in zip(*rates, strict=True)], ".1f")
    assert f"whole trainings make {faster} times as many steps a second" in told
    ratios = {
        (row["body"], by): statistics.median(each["batched"] / each[by] for each in row["rounds"])
        for row in stepped
        for by in ("subproc", "physics")
    }
    assert f"{ratios['arm', 'subproc']:.1f} (arm) and {ratios['crawler', 'subproc']:.1f} times (crawler)" in told
    assert (
        f"at {100 * ratios['arm', 'physics']:.0f} and {100 * ratios['crawler', 'physics']:.0f} % of the speed" in told
    )
