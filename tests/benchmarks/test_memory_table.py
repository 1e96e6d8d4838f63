"""The page on memories tells what its rows say."""

from benchmarks.memory import searched, tried

PAGE = tried.RESULTS.with_name("README.md").read_text(encoding="utf-8")


def test_the_page_has_the_table_of_its_rows() -> None:
    rows = tried.read_rows(tried.RESULTS)
    assert len(rows) == 18
    assert tried.table(rows) in PAGE


def test_the_page_has_the_table_of_generations_and_searches() -> None:
    rows = searched.Rows(searched.RESULTS).kept
    assert {row.arm for row in rows} == {*searched.ARMS, "evolution"}
    assert searched.table(rows) in PAGE
