"""The assembly sheet: one HTML file with everything needed to assemble the robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from aidsr.core.formatting import format_fault
from aidsr.core.html import html_template
from aidsr.fabrication.bill_of_materials import Item
from aidsr.fabrication.build import PrintedPart, RobotBuild
from aidsr.fabrication.illustrations import exploded, routing, winch_picture
from aidsr.fabrication.schema import Verdict


def sheet(build: RobotBuild, verdict: Verdict, items: tuple[Item, ...], control: dict[str, Any], title: str) -> str:
    """Return the sheet as self-contained HTML."""
    return html_template(Path(__file__).with_name("sheet.html.j2"), finding=format_fault).render(
        title=title,
        build=build,
        verdict=verdict,
        items=items,
        total_usd=sum(item.cost_usd or 0.0 for item in items),
        parts=[(chr(65 + n % 26), part) for n, part in enumerate(build.robot_parts)],
        bench=[part for part in build.parts if part.what != "robot"],
        cut=any(piece.cut for piece in build.shaping.pieces),
        settings=_settings,
        cables=_cables(build),
        hinges=_hinges(build),
        control=control["actuators"],
        exploded=exploded(build),
        routing=routing(build),
        winch=winch_picture(build),
    )


def _settings(part: PrintedPart) -> str:
    """Return the print settings of a part, in words."""
    words = [part.material.label, f"infill {100 * part.weight.infill:.0f} %"]
    if part.full is not None and part.weight.infill < 1:
        words.append(f"100 % inside {part.name}_full.stl (load it as a modifier)")
    volume = part.lying.support_mm3 / 1000
    if volume >= 0.5:
        words.append(f"support, up to {volume:.0f} cm³ of room under overhangs")
    return ", ".join(words)


def _cables(build: RobotBuild) -> list[dict[str, Any]]:
    rows = []
    for winch in build.winches:
        cable = build.anatomy.cables[winch.cable]
        parts = list(dict.fromkeys(build.anatomy.parts[guide.part].name for guide in cable.guides))
        rows.append({"winch": winch, "cable": cable, "first": parts[0], "last": parts[-1], "passes": len(parts)})
    return rows


def _hinges(build: RobotBuild) -> list[dict[str, Any]]:
    """Return one row for each kind of hinge, with the names of its joints."""
    rows: dict[tuple[Any, ...], dict[str, Any]] = {}
    for index, hinge in build.hinges.hinges.items():
        gap, name = build.skeleton.gaps[index], build.anatomy.joints[index].names[0]
        sizes = (
            hinge.thickness_mm,
            hinge.width_mm,
            hinge.free_mm,
            gap.length_mm,
            hinge.stiffness_n_m_rad,
            hinge.strain,
        )
        likeness = (hinge.kind, *(round(size, 2) for size in sizes))
        rows.setdefault(likeness, {"names": [], "hinge": hinge, "gap": gap})["names"].append(name)
    return list(rows.values())
