"""The table of speeds compares what was measured under the same conditions, and says what is a bound."""

import importlib
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "benchmarks" / "rl"


@pytest.fixture
def program(monkeypatch):
    pytest.importorskip("stable_baselines3")
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module("speed")


def run(program, ours_s, theirs_s, there=(True, True), **conditions):
    ours, theirs = (
        program.Way(wall_s=wall_s, steps=1000, there=ended, curve=((1.0, 0.1), (wall_s, 0.8)))
        for wall_s, ended in zip((ours_s, theirs_s), there, strict=True)
    )
    return program.Run(
        body="arm",
        seed=0,
        conditions=program.Conditions(**{"most_steps": 300_000, "patience": 8.5} | conditions),
        speeds={"physics": 600.0, "batched": 590.0, "subproc": 400.0},
        ours=ours,
        theirs=theirs,
    )


@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        ((True, True), (True, True), "8.0 x"),
        ((True, False), (True, True), "at least 8.0 x"),
        ((False, True), (True, True), "8.0 x"),
        ((False, True), (False, True), "none: in half of the runs or more our recipe does not get there"),
    ],
)
def test_the_ratio_is_a_bound_where_the_defaults_were_stopped(program, first, second, said):
    runs = [run(program, 300.0, 900.0, first), run(program, 100.0, 800.0, second), run(program, 90.0, 100.0)]
    assert program.ratio_of(runs) == said


def test_what_was_measured_is_kept_under_the_same_conditions_only(program, tmp_path):
    raw = tmp_path / "some.jsonl"
    found = run(program, 100.0, 800.0)
    assert program.kept(raw, found.conditions) == []
    raw.write_text(found.model_dump_json() + "\n")
    assert program.kept(raw, found.conditions) == [found]
    with pytest.raises(SystemExit, match="other conditions"):
        program.kept(raw, run(program, 1.0, 2.0, patience=3.0).conditions)
