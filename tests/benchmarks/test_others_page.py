"""The page of other people's robots names the commits that validated its rows, and is what its rows say."""

import json
from pathlib import Path

from benchmarks.validator import others

HOME = Path(others.__file__).parent
ROWS = [json.loads(line) for line in (HOME / "others.jsonl").read_text().splitlines()]


def test_the_page_names_every_commit_that_validated_a_row() -> None:
    newer = {**ROWS[1], "validated_by": "c0ffee1234567890"}
    assert "Validated by b22aa79, c0ffee1; a row that is there is kept." in others.markdown([ROWS[0], newer])


def test_the_published_page_is_of_its_rows(tmp_path: Path) -> None:
    others.write_page({row["path"]: row for row in ROWS}, tmp_path)
    assert (tmp_path / "others.md").read_text() == (HOME / "others.md").read_text()
