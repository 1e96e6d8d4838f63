"""The report of exports counts what can be built, and says of the rest why not."""

import json
from pathlib import Path

import pytest
from benchmarks.fabrication.run import MADE, account, exported_with, main, settings_of

from aidsr.core.provenance import commit
from aidsr.fabrication.schema import MARK


def row(name: str, verdict: str, errors: list[str], success: tuple[float | None, float | None]) -> dict[str, object]:
    numbers = {"moving_mass_ratio": 1.0, "reach_ratio": 0.95, "cost_usd": 100.0, "success": success, "episodes": 100}
    named = {"design": name, "task": "reaching/button_pushing", "family": "arm", "material": "petg"}
    return {**named, "verdict": verdict, "errors": errors, "warnings": ["thin_wall"], **numbers}


def test_the_share_has_an_interval_and_the_rest_its_reasons() -> None:
    rows = [
        row("a", "buildable", [], (0.9, 0.85)),
        row("b", "buildable with changes", [], (None, None)),
        row("c", "not buildable", ["hinge_strain", "hinge_strain", "part_open"], (None, None)),
        {"design": "d", "task": "own", "family": "arm", "verdict": "not exported", "errors": ["why"], "warnings": []},
    ]
    text = account(rows, "python run.py")
    assert "2 of 4 can be built, with or without changes (95 % interval 15% to 85%)" in text
    assert "hinge_strain 1" in text
    assert "90% → 85%" in text
    assert "share of 100 held-out episodes" in text
    assert f"commit {commit()}" in text
    mixed = account([rows[0], rows[1] | {"episodes": 20}], "python run.py")
    assert "share of 20 or 100 held-out episodes" in mixed
    assert text.count("\n| ") == 5


def test_an_export_with_other_settings_is_made_again(tmp_path: Path) -> None:
    asked = settings_of("fdm", None, policy=False)
    assert asked["commit"] == commit()
    assert not exported_with(tmp_path, asked)
    (tmp_path / MARK).write_text("{}")
    assert not exported_with(tmp_path, asked), "nothing tells how it was made"
    (tmp_path / MADE).write_text(json.dumps({"settings": asked, "took_s": 1.0}))
    assert exported_with(tmp_path, asked)
    for change in ({"printer": "sla"}, {"material": "petg"}, {"policy": True}, {"commit": "earlier"}):
        assert not exported_with(tmp_path, asked | change)


def test_a_folder_without_designs_is_no_table_of_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["run.py", str(tmp_path), "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit, match="approved designs were expected"):
        main()
    assert not (tmp_path / "out").exists()
