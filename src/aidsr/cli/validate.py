"""`aidsr validate`."""

from __future__ import annotations

import sys
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

if TYPE_CHECKING:
    from aidsr.artifacts import ValidationReport
    from aidsr.validation.fidelity import FidelityReport

__all__ = ["validate"]


def validate(
    file: Annotated[str, Parameter(allow_leading_hyphen=True)],
    /,
    *,
    json: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    mount: Literal["auto", "fixed", "free"] = "auto",
    needs_contact: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    fidelity: Annotated[bool, Parameter(negative="", show_default=False)] = False,
) -> int:
    """Say what is physically wrong with a robot or a scene.

    The model is loaded by strict rules, every actuator is driven in simulation, and all faults are told at once. Exit
    code 0 means stable, 1 means faults, 2 a mistake in the command.

        aidsr validate robot.xml

        aidsr validate robot.xml --json > report.json

        cat robot.xml | aidsr validate - --mount free

    Parameters
    ----------
    file
        MJCF of a robot or a scene; "-" reads standard input.
    json
        Print the whole report as JSON instead of a plain account.
    mount
        How a robot alone is held: "fixed" to the world, "free" on a plane, or as its freejoint says.
    needs_contact
        Whether the robot's job can only be done by touching something.
    fidelity
        Also say how far the simulation can be trusted: each limb against exact elastic rods, twice the segments and
        half the time step.
    """
    from aidsr.errors import UserError
    from aidsr.sim.isolation import prepare

    prepare()  # the worker starts while the rest is imported
    from aidsr.validation import validate as examine

    if file.startswith("--"):
        raise UserError(f"a file was expected, and {file} is no option of this command; see aidsr validate --help")
    text = sys.stdin.read() if file == "-" else Path(file)
    report = examine(text, mount=mount, needs_contact=needs_contact)
    trust = _fidelity(text, report) if fidelity else None
    sys.stdout.write((_as_json(report, trust) if json else _told(report, trust)).rstrip() + "\n")
    return 0 if report.stable else 1


def _fidelity(text: str | Path, report: ValidationReport) -> FidelityReport | None:
    """Return how far the simulation of a model can be trusted; None for one that cannot be loaded."""
    from aidsr.validation.fidelity import fidelity

    return None if any(fault.layer == "load" for fault in report.errors) else fidelity(text)


def _as_json(report: ValidationReport, trust: FidelityReport | None) -> str:
    if trust is None:
        return report.model_dump_json(indent=2)
    return dumps(report.model_dump(mode="json") | {"fidelity": trust.model_dump(mode="json")}, indent=2)


def _told(report: ValidationReport, trust: FidelityReport | None) -> str:
    """Return the account, with the verdict in its first line."""
    fidelity = "" if trust is None else f"\n\n{trust.account()}"
    if not report.faults:
        return report.account() + fidelity
    verdict = "stable, with warnings" if report.stable else "not stable"
    return f"{verdict}\n{report.account()}{fidelity}"
