"""The page of films is renewed task by task."""

import importlib.util
import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from aidsr.tasks import BENCHMARK_VERSION, TASKS_IN_SAMPLE, TASKS_OUT_OF_SAMPLE

PATH = Path(__file__).parents[2] / "benchmarks" / "builtin" / "films.py"
DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def films(tmp_path, monkeypatch):
    """The script, with a copy of the page and a study of one design that pulls and none else."""
    spec = importlib.util.spec_from_file_location("films", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (tmp_path / "policies.md").write_bytes((DOCS / "policies.md").read_bytes())
    card = SimpleNamespace(what="arm, new", how_well="failed")
    plan = SimpleNamespace(steps=7_000, benchmark_version=1)
    best = {"manipulation/drawer_opening": (0.0, card, plan)}
    monkeypatch.setattr(module, "DOCS", tmp_path)
    monkeypatch.setattr(
        module, "open_study", lambda _path: SimpleNamespace(plan=SimpleNamespace(tasks=TASKS_IN_SAMPLE))
    )
    monkeypatch.setattr(module, "_best", lambda _study, task: best.get(task))
    monkeypatch.setattr(module, "_draw", lambda _card, picture: picture.write_bytes(b"drawn"))
    return module


def renewed(films, monkeypatch, *words: str) -> list[str]:
    """The lines of the page that change."""
    before = (DOCS / "policies.md").read_text("utf-8").splitlines()
    monkeypatch.setattr("sys.argv", ["films.py", "study", *words])
    films.main()
    after = (films.DOCS / "policies.md").read_text("utf-8").splitlines()
    return [new for old, new in zip(before, after, strict=True) if old != new]


def test_only_the_film_that_is_asked_for_is_renewed(films, monkeypatch):
    title, superseded, told = renewed(films, monkeypatch, "--tasks", "manipulation/drawer_opening")
    assert title == "# What good policies do, versions 1 and 3 of the benchmark"
    assert superseded.startswith("**Superseded**: pictures and captions of versions 1 and 3 show")
    assert told == "arm, new, trained for at most 7,000 control steps in version 1 of the benchmark: failed."
    assert [path.name for path in films.DOCS.rglob("*.jpg")] == ["drawer_opening.jpg"]


def test_tasks_without_a_motion_keep_what_was_said_of_them(films, monkeypatch):
    assert renewed(films, monkeypatch, "--tasks", "locomotion/gap", "locomotion/stairs") == []


def test_a_page_of_todays_policies_does_not_call_itself_superseded(films, monkeypatch):
    page = films.DOCS / "policies.md"
    page.write_text(page.read_text("utf-8").replace(" in version 3 of", f" in version {BENCHMARK_VERSION} of"), "utf-8")
    monkeypatch.setattr("sys.argv", ["films.py"])
    films.main()
    told = page.read_text("utf-8")
    assert told.startswith("# What good policies do\n")
    assert "Superseded" not in told


def test_the_page_tells_todays_results_beside_each_picture(films, monkeypatch):
    monkeypatch.setattr("sys.argv", ["films.py"])
    films.main()
    now = (films.DOCS / "policies.md").read_text("utf-8")
    assert (DOCS / "policies.md").read_text("utf-8") == now, "renew it: python benchmarks/builtin/films.py"


def test_todays_result_is_that_of_the_best_design(films, monkeypatch, tmp_path):
    fields = ("task", "family", "design", "valid", "successful", "success_share", "benchmark_version")
    rows = [
        ("locomotion/gap", "ring", 1, True, False, 0.1, 4),
        ("locomotion/gap", "worm", 2, True, True, 0.6, BENCHMARK_VERSION),
        ("locomotion/gap", "worm", 3, True, True, 0.9, 3),
        ("locomotion/stairs", "ring", 1, False, False, 0.0, 4),
        ("reaching/pipe_inserting", "tentacle", 1, True, True, 1.0, 6),
    ]
    table = tmp_path / "results.jsonl"
    table.write_text("".join(json.dumps(dict(zip(fields, row, strict=True))) + "\n" for row in rows))
    monkeypatch.setattr(films, "TODAY", table)
    today = f"Today, version {BENCHMARK_VERSION}: "
    assert films._today("locomotion/gap") == f"{today}worm, design 2, the best of 2: successful, 60 % of episodes won."
    assert films._today("locomotion/stairs") == f"{today}ring, design 1: not valid, 0 % of episodes won."
    assert films._today("locomotion/tunnel") == f"{today}not measured yet."
    assert films._today("reaching/pipe_inserting") == f"{today}not measured yet.", "its task has changed since"


def test_every_task_has_a_film_on_the_page_or_is_named_as_missing(films):
    page = (DOCS / "policies.md").read_text("utf-8")
    captions = films._CAPTION.findall(page)
    assert tuple(task for task, _ in captions) == TASKS_IN_SAMPLE
    for task in TASKS_IN_SAMPLE:
        assert f"![{task}](images/policies/{task.rpartition('/')[2]}.jpg)" in page
    for task in TASKS_OUT_OF_SAMPLE:
        assert task.rpartition("/")[2] in page.partition("\n## ")[0]
