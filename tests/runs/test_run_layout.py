"""The layout others rely on: said in one place, repeated in the docs, and true of the folders."""

from pathlib import Path

from aidsr.runs import LAYOUT, layout_text

DOCS = Path(__file__).parents[2] / "docs"


def test_the_docs_repeat_the_layout_word_for_word() -> None:
    assert f"```text\n{layout_text()}\n```" in (DOCS / "runs.md").read_text()


def test_each_file_is_said_once() -> None:
    patterns = [pattern for pattern, _ in LAYOUT]
    assert len(set(patterns)) == len(patterns)
