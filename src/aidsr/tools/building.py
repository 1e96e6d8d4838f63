"""The tools that make robots and scenes: validate, edit, fix, assemble, look, read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from aidsr.core.artifacts import ActuatorGroup, Placement, Robot, Scene, ValidationReport
from aidsr.core.errors import AidsrError, ReplyError, UserError
from aidsr.core.formatting import format_number
from aidsr.fixes.engine import fix as fix_mjcf
from aidsr.mjcf.size_limits import SizeLimits
from aidsr.render.pictures import picture
from aidsr.render.view import View
from aidsr.sim.assembly import assemble as assemble_scene
from aidsr.sim.standing import stand as stand_on_ground
from aidsr.tasks import Level, Task
from aidsr.tasks.targets import targets_and_mounts, targets_of
from aidsr.teams.llm.patch import apply_patch
from aidsr.teams.llm.replies import MAX_CHARACTERS, check_groups, check_part
from aidsr.tools.motions import scene_facts
from aidsr.tools.playing import film_script
from aidsr.tools.scene import MeasuredScene
from aidsr.tools.tool import MOST_LINES, Result
from aidsr.tools.workspace import RobotTest, Workspace, is_own
from aidsr.validation import validate as validate_mjcf
from aidsr.validation.validator import Mount

_GENERATORS = ("replicate", "composite", "flexcomp", "attach")
"""Elements of MJCF that make bodies, sites or actuators whose names are not in the document."""
_MOST_OF_A_NAME = SizeLimits().name_characters
RobotName = Annotated[
    str, Field(max_length=_MOST_OF_A_NAME, description='Name of a robot that was validated, such as "robot_2".')
]
SceneName = Annotated[
    str, Field(max_length=_MOST_OF_A_NAME, description='Name of a scene that was assembled, such as "scene_1".')
]
Subject = Annotated[
    str, Field(max_length=_MOST_OF_A_NAME, description='A robot or a scene, such as "robot_2" or "scene_1".')
]
TaskName = Annotated[
    str, Field(max_length=_MOST_OF_A_NAME, description="Name of a task; leave it out where the work is for one job.")
]


def validate(
    workspace: Workspace,
    mjcf: Annotated[
        str, Field(max_length=SizeLimits().characters, description="The whole MJCF document of the robot alone.")
    ],
    functional_part: Annotated[
        str, Field(max_length=_MOST_OF_A_NAME, description="Body or site of the robot that does the work.")
    ] = "",
    actuator_groups: Annotated[
        tuple[ActuatorGroup, ...], Field(description="Actuators that act together as one action.")
    ] = (),
    mount: Annotated[Mount, Field(description="How its root is held; what the job or the MJCF says unless given.")] = (
        "auto"
    ),
    realizable: Annotated[bool, Field(description="Also reject what could not be built.")] = False,
    task: TaskName = "",
) -> Result:
    """Keep a robot under a name, drive every actuator, and say what is wrong with its physics and scope."""
    if "<" not in mjcf:  # loaders treat such a text as a path; a client must not make the server read files
        raise UserError(f"not an MJCF document: {mjcf[:80]!r}; give the text of one, not its path")
    robot = Robot(mjcf=mjcf, functional_part=functional_part, actuator_groups=actuator_groups)
    return _kept(workspace, robot, (), RobotTest(task=task, mount=mount, realizable=realizable))


def edit(
    workspace: Workspace,
    robot: RobotName,
    patch: Annotated[
        str,
        Field(
            max_length=MAX_CHARACTERS,
            description="A <patch> of operations that select elements by XPath: <set sel=\"//joint[@name='bend_1']\" "
            'stiffness="0.4"/>, <add sel="//body[@name=\'foot\']">…</add>, <replace sel="…">…</replace>, '
            '<remove sel="…"/>. Empty where only functional_part or actuator_groups change.',
        ),
    ] = "",
    functional_part: Annotated[
        str, Field(max_length=_MOST_OF_A_NAME, description="Another functional part; as before unless given.")
    ] = "",
    actuator_groups: Annotated[
        tuple[ActuatorGroup, ...] | None, Field(description="Other groups; as before unless given.")
    ] = None,
) -> Result:
    """Change a robot by a patch, keep the result under a new name, and validate it."""
    before = workspace.robot(robot)
    groups = before.actuator_groups if actuator_groups is None else actuator_groups
    part = functional_part or before.functional_part
    if patch.strip():
        try:
            mjcf = apply_patch(before.mjcf, patch if "<patch" in patch else f"<patch>{patch}</patch>")
        except ReplyError as error:
            raise UserError(str(error)) from None
    elif (part, groups) == (before.functional_part, before.actuator_groups):
        raise UserError("nothing would change: give a patch, another functional_part or other actuator_groups")
    else:
        mjcf = before.mjcf
    changed = Robot(mjcf=mjcf, functional_part=part, actuator_groups=groups)
    return _kept(workspace, changed, (f"changed from {robot}",), workspace.test_of_robot(robot))


def fix(workspace: Workspace, robot: RobotName) -> Result:
    """Let code cure what it can of a robot's faults, keep the result under a new name, and validate it."""
    before = workspace.robot(robot)
    test = workspace.test_of_robot(robot)
    faults = _tested(workspace, before.mjcf, test).faults
    kept = {before.functional_part, *(name for group in before.actuator_groups for name in group.actuators)} - {""}
    brief = workspace.brief(test.task)
    fixed = fix_mjcf(before.mjcf, faults, kept_names=kept, keep=brief.keep if brief else ())
    if not fixed.total:
        none = f"nothing of {robot} can be fixed by code: {', '.join(fixed.unfixed) or 'it has no fault'}"
        return Result(text="; ".join([none, *fixed.notes]))
    cured = before.model_copy(update={"mjcf": fixed.mjcf})
    return _kept(workspace, cured, (f"fixed from {robot}", *fixed.notes), test)


def assemble(
    workspace: Workspace,
    robot: RobotName,
    placement: Annotated[Placement, Field(description="Where and how the robot is placed.")],
    stand: Annotated[
        bool,
        Field(description="Raise or lower a free robot until it stands on what is below."),
    ] = True,
    task: TaskName = "",
    level: Annotated[Level, Field(description="How hard the task is.")] = "standard",
) -> Result:
    """Place a robot in the environment of the job, keep the scene under a name, and validate it there.

    A robot that starts farther from its mount than half of its length makes no valid policy.
    """
    name, at, found = workspace.task_of(task, level)
    made = place(workspace, workspace.robot(robot), placement, found, stand=stand)
    report = validate_mjcf(made.scene.mjcf, needs_contact=made.needs_contact)
    kept = workspace.add_scene(robot, made.scene, name, at, stable=report.stable, stand=stand)
    head = f"{kept}: {_verdict(report)}; {robot} in {name or 'the environment'}, file {kept}/scene.xml"
    return Result(
        text="\n".join([head, *_faults(report), *made.notes, *made.scene.notes, *_scene_facts(workspace.subject(kept))])
    )


def _scene_facts(scene: MeasuredScene) -> tuple[str, ...]:
    """Return lines on the robot's start and on what a script may command in a scene, or why no script can be played."""
    if not scene.has_job:
        return ()
    try:
        return scene_facts(scene)
    except AidsrError as error:
        return (f"no script can be played in it: {error}",)


@dataclass(frozen=True)
class Placed:
    """Result of placing a robot in an environment."""

    scene: Scene
    notes: tuple[str, ...]
    """Note on how a free robot was raised or lowered onto the ground."""
    needs_contact: bool
    """Whether the job can only be done by contact."""


def place(workspace: Workspace, robot: Robot, placement: Placement, task: Task | None, *, stand: bool = True) -> Placed:
    """Place a robot in the environment of a task, or of the workspace's job where `task` is None.

    Args:
        workspace: The workspace.
        robot: The robot.
        placement: Placement of the robot.
        task: The task.
        stand: Whether to raise or lower a free robot until it stands.

    Raises:
        MjcfError: Robot and environment cannot be assembled into one model.
        IsolationError: Assembly exceeded a limit.
    """
    if task is not None:
        environment, sensors, needs_contact = task.environment, task.sensors, task.needs_contact
    else:
        assert workspace.job is not None, "without a task there is a job"
        brief = workspace.job.brief
        environment, sensors, needs_contact = brief.environment, (), brief.needs_contact
    notes: tuple[str, ...] = ()
    if placement.base == "free" and stand:
        standing = stand_on_ground(robot, environment, placement, sensors)
        placement, notes = standing.placement, (standing.note,)
    return Placed(assemble_scene(robot, environment, placement, sensors), notes, needs_contact)


def look(
    workspace: Workspace,
    subject: Subject,
    script: Annotated[str, Field(description="Show five moments of this motion script, of a scene only.")] = "",
    seconds: Annotated[float, Field(gt=0, le=60, description="How long the script is played, in s.")] = 6.0,
    azimuth_deg: Annotated[
        float | None, Field(description="Azimuth of the camera, in deg; chosen unless given.")
    ] = None,
    elevation_deg: Annotated[
        float | None,
        Field(description="Elevation of the camera, in deg: 0 level, -90 straight down; chosen unless given."),
    ] = None,
) -> Result:
    """Draw a robot or a scene as it is at the start, or a strip of moments of a script."""
    view = View(azimuth_deg=azimuth_deg, elevation_deg=elevation_deg, shown=_shown(workspace, subject))
    if not script:
        start = [*unstable(workspace, subject), f"{subject} at the start"]
        return Result(text="\n".join(start), pictures=(picture(workspace.mjcf(subject), view=view),))
    played = film_script(workspace.subject(subject), script, seconds=seconds)
    moments = f"{subject}: five moments of {played.duration_s:g} s of development variation 0, from left to right"
    return Result(text="\n".join([*unstable(workspace, subject), moments]), pictures=(played.strip(5, view),))


def unstable(workspace: Workspace, subject: str) -> list[str]:
    """Return a warning for a scene that is not stable, nothing for other subjects."""
    if not subject.startswith("scene") or workspace.record(subject).stable:
        return []
    return [f"{subject} is not stable, as assemble said: what is seen here may not be what a sound body does"]


def _shown(workspace: Workspace, subject: str) -> tuple[str, ...]:
    """Return the names of targets and mounts that must be visible in a picture of an own task or a scene."""
    if is_own(subject):
        _, _, task = workspace.task_of(subject, "standard")
        assert task is not None, "an own task is one"
        return targets_and_mounts(task)
    if not subject.startswith("scene"):
        return ()
    measured = workspace.subject(subject)
    targets = targets_of(measured.success_task()) if measured.has_job else ()
    return (*targets, workspace.placement(subject).mount)


def read(
    workspace: Workspace,
    name: Annotated[
        str,
        Field(
            max_length=_MOST_OF_A_NAME,
            description="A file that a result named, or a robot or a scene, whose MJCF is shown.",
        ),
    ],
    first_line: Annotated[int, Field(ge=1, description="The first line shown.")] = 1,
    lines: Annotated[int, Field(ge=1, le=400, description="How many.")] = MOST_LINES,
) -> Result:
    """Show lines of a file that a result named, or of the MJCF of a robot or a scene."""
    text = workspace.file(name) if name.startswith("file_") else workspace.mjcf(name)
    every = text.splitlines()
    shown = every[first_line - 1 : first_line - 1 + lines]
    last = first_line - 1 + len(shown)
    return Result(text="\n".join([f"{name}, lines {first_line} to {last} of {len(every)}:", *shown]))


def _kept(workspace: Workspace, robot: Robot, notes: tuple[str, ...], test: RobotTest) -> Result:
    """Validate a robot, store it in the workspace, and return the verdict."""
    _check_names(robot)
    report = _tested(workspace, robot.mjcf, test)
    name = workspace.add_robot(robot, test)
    measured = report.measurements
    lines = ["; ".join([f"{name}: {_verdict(report)}", *notes]), *_faults(report)]
    if "characteristic_length_m" in measured:
        lines.append(
            f"length {format_number(1000 * measured['characteristic_length_m'])} mm, moving mass "
            f"{format_number(measured['moving_mass_kg'])} kg, {measured['actuators']} actuators, "
            f"{measured['degrees_of_freedom']} degrees of freedom"
        )
    return Result(text="\n".join(lines))


def _tested(workspace: Workspace, mjcf: str, test: RobotTest) -> ValidationReport:
    """Validate a robot alone, for its task or for the job."""
    brief = workspace.brief(test.task)
    return validate_mjcf(
        mjcf,
        mount=test.mount_for(brief),
        needs_contact=bool(brief and brief.needs_contact),
        environment=brief.environment if brief else "",
        realizable=test.realizable,
    )


def _check_names(robot: Robot) -> None:
    """Check that the names given beside a document are in it, unless MuJoCo generates names for it.

    Raises:
        UserError: A name is not in it, or an actuator is in two groups.
    """
    if any(f"<{tag}" in robot.mjcf for tag in _GENERATORS):
        return
    try:
        check_groups(robot.mjcf, robot.actuator_groups)
        if robot.functional_part:
            check_part(robot.mjcf, robot.functional_part)
    except ReplyError as error:
        raise UserError(str(error)) from None


def _verdict(report: ValidationReport) -> str:
    """Return the verdict of a report in words: stable, out of scope, or bad physics."""
    if report.stable:
        return "stable"
    return "not stable, " + ("sound but out of scope" if report.sound else "its physics does not hold")


def _faults(report: ValidationReport) -> list[str]:
    """Return a list with the text of all faults, empty without faults."""
    return [report.account()] if report.faults else []
