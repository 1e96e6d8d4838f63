"""The page on memories tells what its rows say."""

from pathlib import Path

import pytest
from benchmarks.memory import searched, tried
from benchmarks.rows import read_rows

PAGE = tried.RESULTS.with_name("README.md").read_text(encoding="utf-8")


def test_the_page_has_the_table_of_its_rows() -> None:
    rows = read_rows(tried.RESULTS, tried.Row)
    assert len(rows) == 18
    assert tried.table(rows) in PAGE


def test_the_page_has_the_table_of_generations_and_searches() -> None:
    rows = searched.Rows(searched.RESULTS).kept
    assert {row.arm for row in rows} == {*searched.ARMS, "evolution"}
    assert searched.table(rows) in PAGE


def test_fewer_scenes_than_in_an_earlier_run_are_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows, task = searched.Rows(tmp_path / "rows.jsonl"), "reaching/button_pushing"
    for number, progress in enumerate((0.1, 0.3, 0.9), 1):
        rows.add(searched.Row(arm="rules", task=task, number=number, name="a", progress=progress))
    monkeypatch.setattr(searched, "_tried", lambda *_args, **_options: 0.2)
    searched.search(rows, "rules", task, 2)
    assert [row.again for row in rows.of("rules", task)] == [None, 0.2, None]
