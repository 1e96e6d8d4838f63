"""`validate`: the validator's public function. Loads no simulator: a child process does the work."""

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
"""How the root of a robot is held while the robot is tested alone."""

VALIDATION_LIMITS = Limits(wall_s=1200.0, cpu_s=300.0)
"""Limits of a child process that runs the tests. A body of eighty muscles takes a minute of processor time. Our choice:
a body that takes more than the limit could not be trained. The limit on wall time only ends processes that hang, so
that the verdict is the same on a busy machine."""

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
    """Drive a robot in simulation and report what is physically wrong with it.

    A robot alone is tested on its mount or on a plane, see `mount`. A model in which names begin with "robot/" is a
    scene; it is tested unchanged, and only the robot's parts are examined. A bad design gives a report with faults,
    never an exception.

        report = aidsr.validate("robot.xml")
        print(report.stable, report.account())

    Args:
        mjcf: MJCF text, the path of a file, or a robot or a scene. A string that ends with .xml is a path.
        mount: "fixed" welds the root to the world, "free" lets the robot stand on a plane, "auto" follows the model:
            free with a free joint at the root, else fixed.
        needs_contact: Whether the task can only be done by touching something.
        environment: MJCF of the environment the robot is meant for. Its `<option>` and, for a fixed robot, the
            direction of gravity at its mount are used in the test of the robot alone.
        realizable: Whether parts that cannot be built count as errors; otherwise they are warnings.
        select: Code or codes of the only rules to apply; none for all. Faults of the document are always reported.
        ignore: Code or codes of rules not to apply; their faults are not reported and do not explain other faults.

    Raises:
        TypeError: `mjcf` is none of these.
        UserError: The file cannot be read, `mount` is none of the three values, a code in `select` or `ignore` does not
            exist, or `ignore` has the code of a fault of the document.
    """
    if mount not in get_args(Mount):
        raise UserError(f"mount must be one of {', '.join(get_args(Mount))}: {mount!r}")
    try:
        text = text_of(mjcf)
        return examine(text, mount, needs_contact, environment, realizable, as_names(select), as_names(ignore))
    except (IsolationError, MjcfError) as error:
        return failed_report(error)


@isolated(limits=VALIDATION_LIMITS)
def examine(
    text: str,
    mount: Mount,
    needs_contact: bool,
    environment: str,
    realizable: bool,
    select: tuple[str, ...],
    ignore: tuple[str, ...],
) -> ValidationReport:
    """Return the report on an MJCF text, computed in an isolated process; the arguments are those of `validate`."""
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
