"""`validate`: the validator as users call it. Loads no simulator: a child process does the work."""

from __future__ import annotations

from collections.abc import Collection
from importlib.metadata import version
from pathlib import Path
from typing import Literal, get_args

from aidsr import __version__
from aidsr.core.arguments import as_names
from aidsr.core.artifacts import Fault, Robot, Scene, ValidationReport
from aidsr.core.errors import IsolationError, MjcfError, UserError
from aidsr.mjcf.read import text_of
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits

Mount = Literal["auto", "fixed", "free"]
"""How a robot alone stands while it is tested."""

_LIMITS = Limits(wall_s=1200.0, cpu_s=300.0)
"""A body of eighty muscles takes a minute of processor time. Our choice: more could not be trained. The clock only ends
what does not compute at all, so that the verdict is the same on a busy machine."""

_CURES = {
    "time": "Use fewer bodies, fewer contacts, or a larger time step.",
    "memory": "Use fewer bodies and smaller meshes, height fields and <size> entries.",
    "overflow": "Use metres, kilograms and seconds, and no number far from those of a robot.",
    "crash": "Simplify the model until it loads; this is likely a fault of MuJoCo, not only of the model.",
}


def validate(
    mjcf: str | Path | Robot | Scene,
    *,
    mount: Mount = "auto",
    needs_contact: bool = False,
    environment: str = "",
    realizable: bool = False,
    select: str | Collection[str] = (),
    ignore: str | Collection[str] = (),
) -> ValidationReport:
    """Drive a robot in simulation and say what is physically wrong with it.

    A robot alone is tested where it would stand; a model in which names begin with "robot/" is a scene and is tested as
    it is, looking at the robot's parts. A bad design is a report with faults, never an exception.

        report = aidsr.validate("robot.xml")
        print(report.stable, report.account())

    Args:
        mjcf: MJCF text, the path of a file, or a robot or a scene. A string that ends with .xml is a path.
        mount: "fixed" welds the root to the world, "free" lets it stand on a plane, "auto" does what the model says:
            free with a free joint at the root, else fixed.
        needs_contact: Whether the task can only be done by touching something.
        environment: MJCF of the environment the robot is meant for: its `<option>` and, for a fixed robot, the
            direction of gravity at its mount hold in the test of the robot alone.
        realizable: Whether parts that could not be built make the robot unstable; otherwise they are only reported.
        select: Code or codes of the only rules to apply; none for all. Faults of the document are always looked for.
        ignore: Code or codes of rules not to apply: their faults are neither reported nor explain others.

    Raises:
        TypeError: `mjcf` is none of these.
        UserError: The file cannot be read, `mount` is none of the three, or there is no rule of a code.
    """
    if mount not in get_args(Mount):
        raise UserError(f"mount must be one of {', '.join(get_args(Mount))}: {mount!r}")
    try:
        text = text_of(mjcf)
        return examine(text, mount, needs_contact, environment, realizable, as_names(select), as_names(ignore))
    except (IsolationError, MjcfError) as error:
        return failed_report(error)


@isolated(limits=_LIMITS)
def examine(
    text: str,
    mount: Mount,
    needs_contact: bool,
    environment: str,
    realizable: bool,
    select: tuple[str, ...],
    ignore: tuple[str, ...],
) -> ValidationReport:
    """Return the report on an MJCF text, made in an isolated process; the arguments are those of `validate`."""
    from aidsr.validation.engine import examine_text

    return examine_text(text, mount, needs_contact, environment, realizable, select=select, ignore=ignore).report


def failed_report(error: IsolationError | MjcfError) -> ValidationReport:
    """Return the report on a document that could not be tested."""
    if isinstance(error, MjcfError):
        faults = error.faults
    else:
        cure = _CURES.get(error.kind, "")
        faults = (Fault(code="load_error", layer="load", severity="error", message=str(error), cure=cure),)
    versions = {"aidsr": __version__, "mujoco": version("mujoco")}
    return ValidationReport(stable=False, faults=faults, versions=versions)
