"""`aidsr export` as a person types it."""

from pathlib import Path

import pytest

from aidsr.apps.cli import main
from aidsr.fabrication.schema import Verdict
from fabrication.fingers import finger


def test_the_changes_that_building_asks_for_are_printed(tmp_path: Path, capsys) -> None:
    (tmp_path / "finger.xml").write_text(finger())
    with pytest.raises(SystemExit) as ended:
        main(["export", str(tmp_path / "finger.xml"), "--out", str(tmp_path / "parts")])
    verdict = Verdict.model_validate_json((tmp_path / "parts" / "verdict.json").read_text())
    printed = capsys.readouterr().out
    assert ended.value.code == 0
    assert verdict.verdict == "buildable with changes"
    assert verdict.changes
    for change in verdict.changes:
        assert f"difference in {change.what}: simulated {change.simulated}; built {change.built}" in printed
    assert verdict.unpriced
    assert f"USD, without {', '.join(verdict.unpriced)}" in printed
    assert verdict.retest is not None
    assert f"largest displacement {1000 * verdict.retest.reach_m:.0f} mm (designed" in printed


def test_a_robot_that_cannot_be_loaded_is_a_mistake_and_leaves_no_folder(tmp_path: Path, capsys) -> None:
    (tmp_path / "finger.xml").write_text(finger().replace("<joint", '<joint stifness="1"', 1))
    with pytest.raises(SystemExit) as ended:
        main(["export", str(tmp_path / "finger.xml"), "--out", str(tmp_path / "parts")])
    assert ended.value.code == 2
    assert "stifness" in capsys.readouterr().err
    assert not (tmp_path / "parts").exists()
