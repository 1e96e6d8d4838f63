"""`aidsr export`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from aidsr.apps.cli.flag import Flag
from aidsr.core.formatting import counted, format_fault

if TYPE_CHECKING:
    from rich.console import Console

    from aidsr.loop.export import Exported


def export(
    design: Path,
    /,
    *,
    printer: Literal["fdm", "sla"] = "fdm",
    material: str | None = None,
    out: Path | None = None,
    policy: Flag = False,
    step: Flag = False,
) -> int:
    """Turn an approved design into parts to print, buy and assemble, and list what cannot be built.

    Exit code 0: buildable, without changes or with the printed changes. 1: not buildable, for the printed reasons. 2: a
    mistake in the command. The folder is written with exit codes 0 and 1.

        aidsr export runs/2026-01-31_1002_button_pushing_7f3a/designs/1

        aidsr export robot.xml --printer sla --out workshop

    Parameters
    ----------
    design
        Folder of an approved design, or MJCF of a robot.
    printer
        Type of 3D printer: "fdm" prints filament, "sla" prints resin.
    material
        Material of the printed limbs, for example tpu95a or petg; default: the printer's first material that works.
    out
        Output folder; default: export/ in the design's folder, or NAME_export beside the file. An earlier export in it
        is replaced, except a drive.py that you have changed.
    policy
        Also run the design's last trained policy on the robot as built, for as many episodes as its evaluation
        (minutes); requires the extra "rl".
    step
        Also write each part as a STEP file with flat facets; requires the extra "cad".
    """
    from aidsr import api
    from aidsr.apps.cli.terminal import make_console
    from aidsr.core.errors import with_source

    with with_source(design):
        exported = api.export(design, out or "", printer=printer, material=material, policy=policy, step=step)
    _print_export(make_console(), exported)
    return 1 if exported.verdict.verdict == "not buildable" else 0


def _print_export(console: Console, exported: Exported) -> None:
    """Print the verdict, its reasons, the changes, the parts and costs, and the path of the sheet."""
    verdict, made = exported.verdict, exported.made

    def line(text: str, style: str = "") -> None:
        console.print(text, style=style, markup=False, soft_wrap=True)

    line(
        f"{verdict.verdict}: {verdict.answer}",
        "bold " + {"buildable": "green", "not buildable": "red"}.get(verdict.verdict, "yellow"),
    )
    for fault in verdict.reasons:
        names = ", ".join(fault.names[:3]) + (" …" if len(fault.names) > 3 else "")
        line(f"  {fault.severity} {fault.code}{' at ' * bool(names)}{names}: {format_fault(fault)}")
    for change in verdict.changes:
        line(f"  difference in {change.what}: simulated {change.simulated}; built {change.built}")
    printed = sum(len(part.used_for) for part in made.parts)
    line(f"  {counted(printed, 'part')} of {counted(len(made.parts), 'kind')}, limbs of {made.material.label}")
    moving = f"{verdict.moving_built_g:g} g (simulated {verdict.moving_simulated_g:g} g)"
    line(f"  mass of the pieces that move {moving}")
    motors = sorted({winch.fit.motor.name for winch in made.winches if winch.fit is not None})
    unknown = f", without {', '.join(verdict.unpriced)}" if verdict.unpriced else ""
    named = f" ({'; '.join(motors)})" if motors else ""
    winches = f"{counted(len(made.winches), 'winch')}{named}" if made.winches else "no winches"
    line(f"  {winches}; about {verdict.cost_usd:.0f} USD{unknown}")
    if verdict.retest is not None:
        built_mm, designed_mm = 1000 * verdict.retest.reach_m, 1000 * verdict.retest.designed_reach_m
        moved = f"largest displacement {built_mm:.0f} mm (designed {designed_mm:.0f} mm)"
        line(f"  simulated as built: {verdict.retest.motion}, {moved}")
        if verdict.retest.success_share is not None:
            line(f"  trained policy on the robot as built: {verdict.retest.success_share:.0%} of its episodes succeed")
    if exported.drive_kept:
        line("  drive.py: yours is kept, because it differs from the one of an export; delete it to get a new one")
    use = "why it cannot be built" if verdict.verdict == "not buildable" else "instructions for building the robot"
    line(f"{exported.folder}/sheet.html: {use}")
