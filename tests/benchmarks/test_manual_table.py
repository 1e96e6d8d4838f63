"""Transcripts of designs answered by hand are kept for every run."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from benchmarks.manual.table import keep_transcripts


def run_of(task: str, desk: Path, text: str) -> Any:
    desk.mkdir()
    (desk / "0001.reply.md").write_text(text)
    record = SimpleNamespace(task=f"reaching/{task}", config=SimpleNamespace(model=f"manual:{desk}"))
    return SimpleNamespace(asked=lambda: record)


def test_two_runs_of_a_task_are_both_kept_and_earlier_ones_of_it_go(tmp_path: Path) -> None:
    runs = [run_of(task, tmp_path / f"desk{n}", str(n)) for n, task in enumerate(("button", "button", "gap"))]
    home = tmp_path / "transcripts"
    for name in ("button", "button-2", "button-3", "stairs"):
        (home / name).mkdir(parents=True)
        (home / name / "0009.reply.md").write_text("old")
    keep_transcripts(runs, home)
    assert {str(path.relative_to(home)): path.read_text() for path in home.rglob("*.md")} == {
        "button/0001.reply.md": "0",
        "button-2/0001.reply.md": "1",
        "gap/0001.reply.md": "2",
        "stairs/0009.reply.md": "old",
    }
