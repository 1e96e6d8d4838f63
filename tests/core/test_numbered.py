from __future__ import annotations

from pathlib import Path

import pytest

from aidsr.core.numbered import is_number, numbered_in
from aidsr.runs import Run
from aidsr.runs.folders import DesignFolder
from aidsr.runs.trainings import trainings_of

NAMES = ["1", "002", "10", "²", "1²", "٣", "1" * 200, "x", "-1"]


@pytest.mark.parametrize("name", NAMES)
def test_a_number_is_plain_digits(name: str) -> None:
    assert is_number(name) == (name in ("1", "002", "10"))


def test_folders_of_other_names_are_left_out(tmp_path: Path) -> None:
    """`str.isdigit` takes "²" for a number, and `int` does not."""
    for home in (tmp_path / "designs", tmp_path / "training"):
        for name in NAMES:
            (home / name).mkdir(parents=True)
            (home / name / "config.json").touch()
    assert [path.name for path in numbered_in(tmp_path / "designs")] == ["1", "002", "10"]
    assert [design.number for design in Run(tmp_path).designs] == [1, 2, 10]
    assert [each.path.name for each in trainings_of(DesignFolder(tmp_path))] == ["1", "002", "10"]
