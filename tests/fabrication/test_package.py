"""The folder: whole, readable, honest about what differs, and never written over something else."""

import json
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import mujoco
import pytest
from exported import made, mjcf, report
from fingers import finger

from aidsr.apps.cli.export import _print_export
from aidsr.apps.cli.terminal import make_console
from aidsr.core.artifacts import Outcome, Placement, ValidationReport
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.fabrication.as_built import as_built
from aidsr.fabrication.build import build_robot
from aidsr.fabrication.changes import changes_of
from aidsr.fabrication.force_response import responses
from aidsr.fabrication.package import write_package
from aidsr.fabrication.printers import printer_named
from aidsr.fabrication.schema import Retest, Verdict
from aidsr.fabrication.verdict import judge, retest_of
from aidsr.loop.export import Exported, export
from aidsr.runs import RunRecord, new_run
from aidsr.tasks import load_task
from aidsr.validation import validate


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory):
    home = tmp_path_factory.mktemp("export")
    measured = responses(mjcf("gripper"))
    write_package(home, made("gripper", "tpu95a"), title="a <gripper>", responses=measured)
    return home


def test_the_folder_holds_everything_a_builder_needs(folder) -> None:
    listed = json.loads((folder / "parts.json").read_text())
    for part in listed:
        assert (folder / "parts" / f"{part['file']}.3mf").stat().st_size > 500
        assert (folder / "parts" / f"{part['file']}.stl").stat().st_size > 500
        if part["what"] == "spool":
            assert re.fullmatch(r"spool, .+, spool radius [\d.]+ mm", part["title"])
        assert not re.search(r"_|\d(mm|x\d)| x\d", part["title"]), "as one would write it, without the copies"
    cables = json.loads((folder / "cables.json").read_text())
    assert len(cables) == 6
    assert all(cable["torque_share"] <= 1 and cable["cut_mm"] > cable["in_robot_mm"] for cable in cables)
    sheet = (folder / "sheet.html").read_text()
    assert "a &lt;gripper&gt;" in sheet
    assert "http" not in sheet.replace("http://www.w3.org", "")
    for word in ("Calibrate", "Cut the cables", "Exploded view", *(cable["cable"] for cable in cables)):
        assert word in sheet


def test_the_drive_program_runs_as_it_is(folder) -> None:
    done = subprocess.run([sys.executable, folder / "drive.py"], capture_output=True, text=True, check=True)
    actuators = json.loads((folder / "control.json").read_text())["actuators"]
    cables = json.loads((folder / "cables.json").read_text())
    assert done.stdout.count("motor ") == len(actuators) ** 2
    for actuator in actuators:
        assert actuator["spool_angle_rad"] == sorted(actuator["spool_angle_rad"])
        assert 0 < actuator["torque_n_m"][-1] <= actuator["largest_torque_n_m"] * 1.01
        stroke_mm = next(one["stroke_mm"] for one in cables if one["actuator"] == actuator["name"])
        assert actuator["largest_angle_rad"] * actuator["spool_radius_mm"] == pytest.approx(stroke_mm, rel=0.01)
        assert actuator["spool_angle_rad"][-1] <= actuator["largest_angle_rad"]


def test_the_command_prints_the_changes_that_it_promises(folder, capsys) -> None:
    verdict = Verdict.model_validate_json((folder / "verdict.json").read_text())
    assert len(verdict.changes) > 3
    _print_export(make_console(), Exported(folder, verdict, made("gripper", "tpu95a")))
    printed = capsys.readouterr().out
    for change in verdict.changes:
        assert f"  difference in {change.what}: simulated {change.simulated}; built {change.built}" in printed


@pytest.mark.parametrize(("robot", "material"), [("arm", "petg"), ("gripper", "tpu95a"), ("crawler", "tpu95a")])
def test_the_robot_as_built_has_the_masses_and_springs_of_its_parts(robot: str, material: str) -> None:
    whole = made(robot, material)
    before, after = (mujoco.MjModel.from_xml_string(text) for text in (mjcf(robot), as_built(whole, mjcf(robot))))
    built = sum(part.weight.mass_kg * len(part.used_for) for part in whole.robot_parts)
    assert after.body_mass.sum() == pytest.approx(built, rel=0.02)
    assert after.nv == before.nv
    assert after.jnt_stiffness == pytest.approx(before.jnt_stiffness, rel=0.05)
    assert {change.what for change in changes_of(whole)} >= {"winches", "guides", "skin at the joints"}


def test_a_ring_closed_by_a_weld_is_stable_as_built_and_reaches_as_far() -> None:
    built = as_built(made("ring", "tpu95a"), mjcf("ring"))
    retest = retest_of(report("ring"), validate(built))
    assert retest.stable, retest.faults
    assert retest.same_reach


def test_a_robot_that_moves_otherwise_when_built_is_not_buildable() -> None:
    whole = made("gripper", "tpu95a")
    same = retest_of(report("gripper"), report("gripper"))
    assert same.same_reach
    verdict = judge(whole, (), same)
    assert verdict.verdict == "buildable with changes"
    assert "mass_changed" not in {fault.code for fault in verdict.reasons}
    shorter = Retest(
        stable=True, reach_m=0.8 * same.designed_reach_m, designed_reach_m=same.designed_reach_m, faults=()
    )
    verdict = judge(whole, (), shorter)
    assert verdict.verdict == "not buildable"
    assert verdict.reasons[0].code == "reach_changed"


def test_the_as_built_model_keeps_its_tendons(folder) -> None:
    text = as_built(made("gripper", "tpu95a"), mjcf("gripper"))
    assert len(ElementTree.fromstring(text).findall("tendon/spatial")) == 6


def test_a_robot_from_a_file_is_exported_and_the_export_replaced(tmp_path) -> None:
    robot = tmp_path / "gripper.xml"
    robot.write_text(mjcf("gripper"))
    exported = export(robot)
    assert exported.folder == tmp_path / "gripper_export"
    assert exported.verdict.retest is not None
    assert exported.verdict.retest.stable
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("keep")
    with pytest.raises(UserError, match="is not an earlier export"):
        export(robot, tmp_path / "mine")


def test_a_design_is_made_tried_and_compared_at_the_size_it_was_approved_with(tmp_path, monkeypatch) -> None:
    record = RunRecord(
        objective="grasp", task="", level="", config=RunConfig(), started="2026-01-31T10:02:00+00:00", versions={}
    )
    design = new_run(tmp_path, record, load_task("simple_grasping").brief()).design(1)
    design.final_robot.write(finger().encode())
    for number, scale in ((1, 1.5), (2, 2.0)):
        design.iteration(number).placement.write(Placement(mount="mount", base="fixed", scale=scale))
    asked = {"pull_flex": {"tension_n": 400.0, "speed_m_s": 0.1, "stroke_m": 0.1}}
    design.iteration(1).robot_report.write(ValidationReport(stable=True, measurements={"motors": asked}))
    design.outcome.write(Outcome(outcome="approved", reason="It came farther than the next.", iteration=1))
    monkeypatch.chdir(design.path)
    exported = export(Path())
    assert exported.folder.resolve() == design.path / "export"
    retest, alone = exported.verdict.retest, validate(finger())
    assert exported.verdict.verdict == "buildable with changes", exported.verdict.reasons
    assert retest.designed_reach_m == pytest.approx(1.5 * retest_of(alone, alone).reach_m, rel=0.1)
    assert retest.same_reach
    tensions = [winch.demand.tension_n for winch in exported.made.winches]
    assert tensions == pytest.approx([10.0 * 1.5**2] * 2, rel=0.01), "not of the robot before it was scaled"


def test_an_export_that_is_stopped_leaves_the_folder_as_it_was(tmp_path) -> None:
    whole, home = build_robot(finger(), [validate(finger())], printer_named("fdm")), tmp_path / "finger" / "export"

    def stopped() -> None:
        with pytest.raises(AttributeError):
            write_package(home, whole, title="stopped", responses=(None,))

    stopped()
    assert list(tmp_path.rglob("*")) == [home.parent]
    write_package(home, whole, title="first")
    (home / "notes.txt").write_text("keep")
    (home / "parts" / "old.stl").write_text("of an earlier export")
    before = {path: path.read_bytes() for path in home.rglob("*") if path.is_file()}
    stopped()
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before
    write_package(home, whole, title="second")
    after = {path.relative_to(home): path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert "second" in (home / "sheet.html").read_text()
    assert set(after) == {path.relative_to(home) for path in before} - {Path("parts/old.stl")}


def test_a_program_that_its_user_has_changed_stays(tmp_path, capsys) -> None:
    robot, drive = tmp_path / "finger.xml", tmp_path / "finger_export" / "drive.py"
    robot.write_text(finger())
    first = export(robot)
    written = drive.read_text()
    assert not first.drive_kept
    assert not export(robot).drive_kept
    drive.write_text(written.replace(": 0.0 for one in MAP", ": 0.3 for one in MAP"))
    changed = drive.read_text()
    assert changed != written
    (drive.parent / "control.json").write_text("{}")
    again = export(robot)
    assert drive.read_text() == changed
    assert "actuators" in json.loads((drive.parent / "control.json").read_text())
    assert again.drive_kept
    _print_export(make_console(), again)
    assert "drive.py: yours is kept" in capsys.readouterr().out


def test_a_folder_without_a_robot_is_refused(tmp_path) -> None:
    with pytest.raises(UserError, match="final_robot"):
        export(tmp_path)
