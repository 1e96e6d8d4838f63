"""Export of a design or a robot for the workshop: divide it into parts, test it again as built, and write a package."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from aidsr.core.artifacts import Placement, Robot, ValidationReport
from aidsr.core.config import VERDICT_EPISODES
from aidsr.core.errors import UserError
from aidsr.core.extras import require_extra
from aidsr.core.plain_tree import require_plain_tree
from aidsr.fabrication.as_built import as_built
from aidsr.fabrication.build import RobotBuild, build_robot
from aidsr.fabrication.force_response import responses
from aidsr.fabrication.package import has_own_drive, write_package
from aidsr.fabrication.printers import printer_named
from aidsr.fabrication.schema import MARK, Retest, Verdict
from aidsr.fabrication.verdict import retest_of
from aidsr.mjcf.read import open_mjcf
from aidsr.runs import DesignFolder
from aidsr.runs.status import newest
from aidsr.runs.trainings import Training, trainings_of
from aidsr.sim.scaling import resize_robot
from aidsr.validation import validate

if TYPE_CHECKING:
    from aidsr.validation.validator import Mount


@dataclass(frozen=True)
class Exported:
    """An export on disk.

    Attributes:
        folder: The export folder.
        verdict: The verdict in it.
        made: The robot's parts.
        drive_kept: Whether the folder had a drive.py that its user has changed; the export has kept it.
    """

    folder: Path
    verdict: Verdict
    made: RobotBuild
    drive_kept: bool = False


@dataclass(frozen=True)
class _Subject:
    """What is exported, and what is known about it.

    Attributes:
        title: Title for the sheet.
        mjcf: MJCF of the robot alone, at its final size.
        reports: Validation reports of the robot that already exist.
        environment: MJCF of the environment it was designed for; empty for a robot from a file.
        mount: How the robot is mounted while it is tested.
        design: Folder of the design, if the robot comes from a run.
    """

    title: str
    mjcf: str
    reports: tuple[ValidationReport, ...]
    environment: str
    mount: Mount
    design: DesignFolder | None


def export(
    subject: Path,
    folder: Path | None = None,
    *,
    printer: str = "fdm",
    material: str | None = None,
    policy: bool = False,
    cad: bool = False,
) -> Exported:
    """Export an approved design, or the MJCF of a robot.

    Args:
        subject: Folder of an approved design, or an MJCF file.
        folder: Output folder; by default "export" in the design's folder, or NAME_export beside the file.
        printer: Name of a printer.
        material: Name of a material; None tries all materials of the printer.
        policy: Whether to test the design's last trained policy with the robot as built.
        cad: Whether to write the parts as STEP too; needs the extra "cad".

    Raises:
        UserError: There is nothing to export, or the folder holds something else.
        MjcfError: The robot cannot be loaded.
    """
    if cad:
        require_extra("cad", "writing STEP")
    if policy:
        require_extra("rl", "trying a policy")
    given = _read(subject)
    learnt = _last_training(given.design) if policy else None
    target = folder or (subject / "export" if subject.is_dir() else subject.with_name(f"{subject.stem}_export"))
    if target.exists() and (not target.is_dir() or (any(target.iterdir()) and not (target / MARK).exists())):
        raise UserError(f"{target} exists and is not an earlier export; give another output folder, or empty this one")
    designed = validate(given.mjcf, mount=given.mount, environment=given.environment, realizable=True)
    reports = (*given.reports, designed)
    made = build_robot(given.mjcf, reports, printer_named(printer), material=material)
    built = as_built(made, given.mjcf)
    tried = validate(built, mount=given.mount, environment=given.environment, realizable=True)
    retest = retest_of(designed, tried)
    if given.design is not None and learnt is not None:
        retest = _with_policy(retest, given.design, given.environment, built, learnt)
    measured, drive_kept = responses(given.mjcf), has_own_drive(target)
    verdict = write_package(
        target, made, title=given.title, built_mjcf=built, responses=measured, retest=retest, cad=cad
    )
    return Exported(target, verdict, made, drive_kept)


def _read(subject: Path) -> _Subject:
    """Return the subject of the export at a path."""
    if not subject.is_dir():
        return _Subject(subject.stem, open_mjcf(subject), (), "", "auto", None)
    design = DesignFolder(subject.resolve())
    require_plain_tree(design.path)
    design.require_whole()
    robot = design.final_robot.read()
    if robot is None:
        raise UserError(
            f"{subject} is not an approved design: final_robot.xml not found; give the folder of an approved design, "
            "for example runs/…/designs/1, or the MJCF of a robot"
        )
    brief = design.run.brief()
    kept = design.leading_to()
    placement = newest(it.placement.read() for it in kept) or Placement(mount="world", base="fixed")
    mjcf, found = robot.decode(), [newest(it.scene_report.read() for it in kept)]
    if placement.scale == 1.0:
        found.append(newest(it.robot_report.read() for it in kept))
    else:  # the robot's own report is for another size
        mjcf = resize_robot(mjcf, placement.scale)
    concept = newest(it.concept.read() for it in kept)
    title = f"{concept.name if concept else 'robot'} for {brief.task or 'an objective in words'}"
    return _Subject(
        title=title,
        mjcf=mjcf,
        reports=tuple(report for report in found if report),
        environment=brief.environment,
        mount=placement.base,
        design=design,
    )


def _last_training(design: DesignFolder | None) -> Training:
    """Return the design's last finished training."""
    finished = [one for one in trainings_of(design) if one.result.path.exists()] if design else []
    if not finished:
        raise UserError("no trained policy found; train the design first with aidsr train")
    return finished[-1]


def _with_policy(retest: Retest, design: DesignFolder, environment: str, built: str, learnt: Training) -> Retest:
    """Return the retest with the success share of a trained policy with the robot as built."""
    from aidsr.learn.rl.isolated_learning import run_policy

    robot = newest(it.robot.read() for it in design.leading_to())
    placement = newest(it.placement.read() for it in design.leading_to())
    assert robot is not None, "only what is approved is trained"
    assert placement is not None, "only a robot that was placed in a scene is approved"
    changed = Robot(mjcf=built, functional_part=robot.functional_part, actuator_groups=robot.actuator_groups)
    as_it_is = placement.model_copy(update={"scale": 1.0})
    before = learnt.evaluation.read()
    count = len(before.episodes) if before else VERDICT_EPISODES
    shares = {
        "success_share": run_policy(learnt.path, changed, environment, as_it_is, count),
        "designed_success_share": before.success_share if before else None,
    }
    return retest.model_copy(update=shares)
