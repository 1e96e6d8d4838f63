"""Alternate between fixing and validating a robot until it is stable or no fix changes it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from pathlib import Path

from aidsr.core.arguments import as_names
from aidsr.core.artifacts import Fault, Robot, Scene, ValidationReport
from aidsr.fixes import FixResult, fix
from aidsr.mjcf.read import text_of
from aidsr.validation.validator import Mount, validate

ROUNDS = 8
"""Most rounds of fixes. Our choice: robots of the validator's own benchmark that can be cured need at most 4."""


class StableFix(FixResult):
    """An MJCF text after its fixes, with the report on it; `unfixed` has the codes of the remaining errors."""

    report: ValidationReport


def fix_until_stable(
    mjcf: str | Path | Robot | Scene,
    *,
    rounds: int = ROUNDS,
    also: str | Collection[str] = (),
    mount: Mount = "auto",
    needs_contact: bool = False,
    environment: str = "",
    realizable: bool = False,
) -> StableFix:
    """Fix the faults that validation finds, validate again, and so on; return the best version.

    Fixes that are not safe are applied too: check the notes for changes that you did not intend. The best version has
    the fewest errors. A version with an error that the original robot did not have is never returned, unless the
    original could not be simulated, so that its errors are unknown.

        fixed = aidsr.fix_until_stable("robot.xml")
        print(fixed.report.stable, fixed.notes)

    Args:
        mjcf: MJCF text, the path of a file (which is not changed), or a robot or a scene.
        rounds: Most rounds of fixes; each round includes a validation.
        also: Code or codes of faults to fix even if they are only warnings.
        mount: How the root is held; this and all arguments below are those of `aidsr.validate`.
        needs_contact: Whether the task can only be done by touching something.
        environment: MJCF of the environment the robot is meant for.
        realizable: Whether parts that cannot be built count as errors.

    Raises:
        TypeError: `mjcf` is none of these.
        UserError: The file cannot be read.
        MjcfError: The file is too large.
    """

    def validated(text: str) -> ValidationReport:
        return validate(text, mount=mount, needs_contact=needs_contact, environment=environment, realizable=realizable)

    wanted = set(as_names(also))
    text = text_of(mjcf)
    best = first = StableFix(mjcf=text, report=validated(text))
    now = first
    for _ in range(rounds):
        answer = fix(now.mjcf, [each for each in now.report.faults if each.severity == "error" or each.code in wanted])
        if answer.mjcf == now.mjcf:
            break
        now = StableFix(
            mjcf=answer.mjcf,
            notes=(*now.notes, *answer.notes),
            counts=dict(Counter(now.counts) + Counter(answer.counts)),
            report=validated(answer.mjcf),
        )
        if not _harms(first.report, now.report) and _left(now, wanted) <= _left(best, wanted):
            best = now
    return best.model_copy(update={"unfixed": tuple(dict.fromkeys(each.code for each in best.report.errors))})


def _harms(before: ValidationReport, after: ValidationReport) -> bool:
    """Return whether a version has an error that the original did not have; False if that could not be simulated."""
    if any(fault.layer == "load" for fault in before.errors):
        return False
    return not _codes(after.errors) <= _codes(before.errors)


def _left(version: StableFix, wanted: Collection[str]) -> tuple[int, int, int]:
    """Return the numbers of load errors, of all errors, and of faults with a code in `wanted`, for comparison."""
    report = version.report
    unloaded = sum(fault.layer == "load" for fault in report.errors)
    return unloaded, len(report.errors), sum(fault.code in wanted for fault in report.faults)


def _codes(faults: Collection[Fault]) -> set[str]:
    return {fault.code for fault in faults}
