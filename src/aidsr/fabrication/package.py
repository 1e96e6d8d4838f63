"""Writing of the export folder, with all files needed to build the robot."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from aidsr.fabrication.bill_of_materials import bill
from aidsr.fabrication.build import RobotBuild
from aidsr.fabrication.control import DRIVE, control_map
from aidsr.fabrication.files import stl, three_mf
from aidsr.fabrication.force_response import Response
from aidsr.fabrication.schema import MARK, PartEntry, Retest, Verdict
from aidsr.fabrication.sheet import sheet
from aidsr.fabrication.step import step
from aidsr.fabrication.verdict import judge

_DRIVE = "drive.py"


def write_package(
    folder: Path,
    build: RobotBuild,
    *,
    title: str,
    built_mjcf: str | None = None,
    responses: tuple[Response, ...] = (),
    retest: Retest | None = None,
    cad: bool = False,
) -> Verdict:
    """Write parts, list of parts, control map, sheet and verdict into a folder, and return the verdict.

    All files are first written to a temporary folder beside it, so that an interrupted export leaves the folder
    unchanged.

    Args:
        folder: Export folder, created if missing; files of an earlier export in it are replaced, except a drive.py that
            its user has changed.
        build: The robot.
        title: Title of the sheet.
        built_mjcf: MJCF of the robot as built; None writes no as_built.xml.
        responses: Static response to each actuator, for the control map.
        retest: Test results of the robot as built; None where it was not tested.
        cad: Whether to write STEP files too.
    """
    home = folder.resolve()
    unfinished = home.with_name(f".{home.name}.unfinished")
    _remove(unfinished)
    try:
        _write_parts(unfinished / "parts", build, cad=cad)
        items = bill(build)
        verdict = judge(build, tuple((item.what, item.cost_usd) for item in items), retest)
        control = control_map(build, responses)
        texts = {
            "sheet.html": sheet(build, verdict, items, control, title),
            "control.json": json.dumps(control, indent=2),
            _DRIVE: DRIVE,
            "parts.json": json.dumps(_part_list(build), indent=2),
            "bill.json": json.dumps([item.model_dump(mode="json") for item in items], indent=2),
            "cables.json": json.dumps(_cable_list(build), indent=2),
            MARK: verdict.model_dump_json(indent=2),
        }
        if built_mjcf is not None:
            texts["as_built.xml"] = built_mjcf
        for name, text in texts.items():
            (unfinished / name).write_text(text.rstrip() + "\n", encoding="utf-8")
        _put(unfinished, home)
    finally:
        _remove(unfinished)
    return verdict


def has_own_drive(folder: Path) -> bool:
    """Whether a folder has a drive.py with changes by its user, such as a calibration; an export keeps it."""
    drive = folder / _DRIVE
    return drive.exists() and drive.read_text(encoding="utf-8", errors="replace").strip() != DRIVE.strip()


def _write_parts(folder: Path, build: RobotBuild, *, cad: bool) -> None:
    folder.mkdir(parents=True)
    for part in build.parts:
        (folder / f"{part.name}.3mf").write_bytes(three_mf(part.lying.surface, part.name))
        (folder / f"{part.name}.stl").write_bytes(stl(part.lying.surface, part.name))
        if cad:
            (folder / f"{part.name}.step").write_bytes(step(part.lying.surface))
        if part.full is not None:
            (folder / f"{part.name}_full.stl").write_bytes(stl(part.full, part.name))


def _put(finished: Path, home: Path) -> None:
    """Move the finished export into its folder, the marker file last.

    Other files in the folder stay, and so does a drive.py that its user has changed.
    """
    if not home.exists():
        finished.rename(home)
        return
    if has_own_drive(home):
        (finished / _DRIVE).unlink()
    _remove(home / "parts")
    for path in sorted(finished.iterdir(), key=lambda path: path.name == MARK):
        path.replace(home / path.name)


def _remove(folder: Path) -> None:
    if folder.exists():
        shutil.rmtree(folder)


def _part_list(build: RobotBuild) -> list[dict[str, object]]:
    entries = (
        PartEntry(
            file=part.name,
            title=part.title,
            what=part.what,
            copies=len(part.used_for),
            used_for=part.used_for,
            material=part.material.name,
            infill=part.weight.infill,
            mass_g=round(1000 * part.weight.printed_kg, 2),
            simulated_g=round(1000 * part.weight.simulated_kg, 2) if part.what == "robot" else None,
            size_mm=tuple(round(side, 2) for side in part.lying.size_mm),
            support_cm3=round(part.lying.support_mm3 / 1000, 2),
            thinnest_wall_mm=round(part.lying.wall_mm, 2),
            watertight=part.lying.watertight,
            fits_bed=part.lying.fits,
        )
        for part in build.parts
    )
    return [entry.model_dump(mode="json") for entry in entries]


def _cable_list(build: RobotBuild) -> list[dict[str, object]]:
    return [
        {
            "cable": build.anatomy.cables[winch.cable].tendon,
            "actuator": build.anatomy.cables[winch.cable].actuator,
            "line": winch.line.label if winch.line else None,
            "in_robot_mm": round(winch.inside_mm, 1),
            "stroke_mm": round(1000 * winch.demand.stroke_m, 1),
            "cut_mm": winch.cut_mm,
            "tension_n": winch.demand.tension_n,
            "at_winch_n": round(winch.demand.at_winch_n, 2),
            "speed_m_s": winch.demand.speed_m_s,
            "motor": winch.fit.motor.name if winch.fit else None,
            "motor_speed_m_s": round(winch.fit.speed_m_s, 4) if winch.fit else None,
            "torque_share": round(winch.fit.torque_share, 3) if winch.fit else None,
            "spool_radius_mm": 1000 * winch.fit.spool_radius_m if winch.fit else None,
            "guides": [guide.site for guide in build.anatomy.cables[winch.cable].guides],
        }
        for winch in build.winches
    ]
