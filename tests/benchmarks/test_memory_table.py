"""The page on memories tells what its rows say."""

from benchmarks.memory.tried import RESULTS, read_rows, table


def test_the_page_has_the_table_of_its_rows() -> None:
    rows = read_rows(RESULTS)
    assert len(rows) == 18
    assert table(rows) in RESULTS.with_name("README.md").read_text(encoding="utf-8")
