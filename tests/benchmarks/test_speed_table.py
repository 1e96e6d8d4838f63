"""The table of speeds compares what was measured under the same conditions, and says what is a bound."""

import importlib
import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "benchmarks" / "rl"


@pytest.fixture
def program(monkeypatch):
    pytest.importorskip("stable_baselines3")
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module("speed")


def run(program, ours_s, theirs_s, there=(True, True), patience=8.5):
    ours, theirs = (
        program.Way(wall_s=wall_s, steps=1000, there=ended, curve=((1.0, 0.1), (wall_s, 0.8)))
        for wall_s, ended in zip((ours_s, theirs_s), there, strict=True)
    )
    return program.Run(
        body="arm",
        seed=0,
        conditions=program.conditions_now(300_000, patience),
        load=0.5,
        speeds={"physics": 600.0, "batched": 590.0, "subproc": 400.0},
        ours=ours,
        theirs=theirs,
    )


@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        ((True, True), (True, True), "3.0 x"),
        ((True, False), (True, True), "at least 3.0 x"),
        ((False, True), (True, True), "1.5 x"),
        ((False, True), (False, True), "none: in most runs our recipe does not get there"),
    ],
)
def test_the_ratio_is_a_bound_where_the_defaults_were_stopped(program, first, second, said):
    runs = [run(program, 300.0, 900.0, first), run(program, 100.0, 800.0, second), run(program, 90.0, 135.0)]
    assert program.ratio_of(runs) == said


def test_what_was_measured_is_kept_under_the_same_conditions_only(program, tmp_path):
    raw = tmp_path / "some.jsonl"
    found = run(program, 100.0, 800.0)
    assert program.kept(raw, found.conditions) == []
    raw.write_text(found.model_dump_json() + "\n")
    assert program.kept(raw, found.conditions) == [found]
    with pytest.raises(SystemExit, match="other conditions"):
        program.kept(raw, run(program, 1.0, 2.0, patience=3.0).conditions)


def test_a_recipe_that_lacks_a_field_of_today_is_another_one(program, tmp_path):
    raw = tmp_path / "some.jsonl"
    found = run(program, 100.0, 800.0)
    line = json.loads(found.model_dump_json())
    del line["conditions"]["recipe"]["settling"]
    raw.write_text(json.dumps(line) + "\n")
    with pytest.raises(SystemExit, match="other conditions"):
        program.kept(raw, found.conditions)


def test_the_defaults_are_told_by_the_point_at_which_they_got_there(program):
    watch = importlib.import_module("learning")._Until(success=0.5, most_s=1e6)
    for won in [False] * 60 + [True] * 60:
        watch.locals = {"infos": [{"episode": {}, "is_success": won}]}
        goes_on = watch._on_step()
        if not goes_on:
            break
    assert watch.there
    assert [share for _, share in watch.curve] == [0.4, 0.5]  # when there were 100, and when it got there


def test_the_published_table_is_that_of_its_runs(program):
    runs = [program.Run.model_validate_json(line) for line in (FOLDER / "results.jsonl").read_text().splitlines()]
    text = (FOLDER / "results.md").read_text()
    for body in program.BODIES:
        own = [each for each in runs if each.body == body.name]
        assert f"{len(own)} of 5 runs are done" in text
        assert not own or f"**{program.ratio_of(own)}**" in text
