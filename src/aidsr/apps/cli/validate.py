"""`aidsr validate`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from aidsr.apps.cli.flag import Flag
from aidsr.apps.cli.input_files import require_files

if TYPE_CHECKING:
    from aidsr.apps.cli.checking import Check
    from aidsr.validation.json_report import FileReport


_Codes = Annotated[str, Parameter(show_default=False)]
_Path = Annotated[Path | None, Parameter(show_default=False)]


def validate(
    *files: Annotated[str, Parameter(allow_leading_hyphen=True)],
    json: Flag = False,
    realizable: Flag = False,
    mount: Literal["auto", "fixed", "free"] = "auto",
    needs_contact: Flag = False,
    select: _Codes = "",
    ignore: _Codes = "",
    fidelity: Flag = False,
    repair: _Path = None,
    report: _Path = None,
    scope: Flag = False,
    force: Flag = False,
    schema: Flag = False,
) -> int:
    """Find physical faults of robots or scenes, and check whether they are tendon-driven continuum robots.

    Loads the model with strict rules, drives every actuator in simulation, and reports all faults together. There are
    two verdicts: sound, if the physics holds, and in scope, if cables and a soft body do the work and a policy can
    observe and command the robot. Exit code 0: sound (with --scope: sound and in scope). 1: not. 2: a mistake in the
    command. For several files, the highest code is returned.

        aidsr validate robot.xml

        aidsr validate robot.xml --report robot.html

        aidsr validate robots/*.xml --realizable --scope

        aidsr validate robot.xml --ignore gravity_collapse,thin_wall

        cat robot.xml | aidsr validate - --mount free --json

    Parameters
    ----------
    files
        MJCF files of robots or scenes; "-" reads standard input.
    json
        Print the complete report as JSON: an object for one file, a list of objects for several.
    realizable
        Report what would prevent building as an error (guides, densities, walls, motor loads), and name suitable
        motors. Only `aidsr export` checks everything, including hinges and cable routes.
    mount
        How a robot without a scene is held: "fixed" to the world, "free" on a plane, or "auto": free if its root has a
        free joint, otherwise fixed.
    needs_contact
        The robot's task is only possible with contact: report a robot that cannot touch anything.
    select
        Apply only the rules with these codes, separated by commas; `aidsr rules` lists the codes.
    ignore
        Do not apply the rules with these codes.
    fidelity
        Also measure how accurate the simulation is: compares each limb with exact elastic rods, with twice the segments
        and with half the time step.
    repair
        Fix unambiguous mistakes, write the fixed text to this file, and validate it.
    report
        Also write the report as a self-contained HTML page.
    scope
        Also exit with code 1 if a robot is out of scope.
    force
        Allow --repair and --report to overwrite existing files. A page that this command wrote is always overwritten.
    schema
        Print the schema of the JSON report, and exit.
    """
    from aidsr.apps.cli.terminal import write_document
    from aidsr.core.errors import UserError
    from aidsr.sandbox.pool import warm_up

    if schema:
        from aidsr.validation.json_report import schema_text

        write_document(schema_text())
        return 0
    warm_up()  # the worker process starts during the remaining imports
    from aidsr.apps.cli.checking import Check, refuse_to_overwrite

    require_files(files, "validate")
    for option, path in (("--repair", repair), ("--report", report)):
        if path is not None and len(files) > 1:
            raise UserError(f"{option} writes one file, but {len(files)} are given; give one at a time")
        if path is not None and not force:
            refuse_to_overwrite(path, option=option)
    if repair is not None and report is not None and repair.resolve() == report.resolve():
        raise UserError(f"--repair and --report name the same file: {repair}; give two different files")
    check = Check(mount, needs_contact, realizable, fidelity, repair, report, _codes(select), _codes(ignore))
    return _print_reports(check, files, as_json=json, scope=scope)


def _codes(text: str) -> tuple[str, ...]:
    return tuple(code.strip() for code in text.split(",") if code.strip())


def _print_reports(check: Check, files: tuple[str, ...], *, as_json: bool, scope: bool) -> int:
    """Validate the files, print the reports, and return the exit code."""
    from aidsr.apps.cli.terminal import write, write_document
    from aidsr.apps.cli.verdicts import format_verdict

    reports: list[FileReport] = []
    code = 0
    for file in files:
        report = check.run(file)
        reports.append(report)
        code = max(code, 0 if report.sound and (report.in_scope or not scope) else 1)
        if not as_json:
            text = format_verdict(report, repaired=check.repair, named=len(files) > 1, motors=check.realizable)
            write(text + "\n" * (1 + (len(files) > 1)))
    if as_json:
        texts = [report.model_dump_json(indent=2) for report in reports]
        write_document((texts[0] if len(files) == 1 else "[" + ",\n".join(texts) + "]") + "\n")
    return code
