"""The page of films is renewed task by task."""

import importlib.util
from pathlib import Path
from types import SimpleNamespace

import pytest

from aidsr.tasks import TASKS_IN_SAMPLE

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
    told = "arm, new, trained for at most 7,000 control steps in version 1 of the benchmark: failed."
    assert renewed(films, monkeypatch, "--tasks", "manipulation/drawer_opening") == [told]
    assert [path.name for path in films.DOCS.rglob("*.jpg")] == ["drawer_opening.jpg"]


def test_tasks_without_a_motion_keep_what_was_said_of_them(films, monkeypatch):
    assert renewed(films, monkeypatch, "--tasks", "locomotion/gap", "locomotion/stairs") == []


def test_every_task_has_a_film_on_the_page(films):
    said = dict(films._SECTION.findall((DOCS / "policies.md").read_text("utf-8")))
    assert tuple(said) == TASKS_IN_SAMPLE
    for task, text in said.items():
        assert f"![{task}](images/policies/{task.rpartition('/')[2]}.jpg)" in text
