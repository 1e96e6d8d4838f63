"""A scene for training and evaluation: text, compiled model, task, and mapping of actions."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import mujoco
import numpy as np
from lxml import etree

from aidsr.core.artifacts import ActuatorGroup
from aidsr.core.errors import MjcfError, UserError
from aidsr.learn.episodes.actions import ActionMap, BaseMotion, Grouping, GroupsFrom, map_actions, recorded_actions
from aidsr.mjcf.compile import compile_mjcf
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.mjcf.read import is_mjcf_text, open_mjcf, parse_document
from aidsr.sim.assembly import add_sensors
from aidsr.sim.same_environment import find_environment_change
from aidsr.sim.task_sensors import check_task_sensors
from aidsr.tasks import Level, Task, load_task
from aidsr.tasks.readings import FloatArray, Reader


@dataclass(frozen=True, eq=False)
class TaskScene:
    """A robot in the environment of a task, ready for simulation.

    The safe loader checks the text again; then it is compiled and stepped in this process. `aidsr.probe`, `aidsr.train`
    and `aidsr.evaluate` create a scene in a child process with limits.
    """

    mjcf: str
    task: Task
    model: mujoco.MjModel
    actions: ActionMap

    @classmethod
    def of(
        cls,
        scene: str | Path,
        task: str | Task,
        *,
        level: Level = "standard",
        groups: Sequence[ActuatorGroup] = (),
        grouping: Grouping = "auto",
    ) -> Self:
        """Return a scene for a task.

        Args:
            scene: MJCF of the scene, or the path of a file that holds it.
            task: A task or its name.
            level: Level of a task given by name.
            groups: Actuators that act together, as the robot's author declares.
            grouping: See `map_actions`.

        Raises:
            UserError: There is no such file or task, or the scene does not belong to this task at this level.
            MjcfError: The scene cannot be loaded, or one of its sensors has the name of a task sensor and measures
                something else.
        """
        task = load_task(task, level) if isinstance(task, str) else task
        mjcf = _with_sensors(read_mjcf_text(scene), task)
        model = compile_mjcf(mjcf)
        check_task_sensors(model, task.sensors)
        _check_environment(model, task)
        _check_outline(model, task)
        return cls(mjcf, task, model, map_actions(model, task, groups, grouping))

    def with_actions(self, groups: Sequence[ActuatorGroup], groups_from: GroupsFrom) -> Self:
        """Return the scene with the mapping of actions that a training has recorded.

        Raises:
            UserError: The scene lacks an actuator.
        """
        return replace(self, actions=recorded_actions(self.model, groups, groups_from))

    def with_hold(self, hold_steps: int) -> Self:
        """Return the scene with actions that are held for several control steps."""
        return replace(self, actions=replace(self.actions, hold_steps=hold_steps))

    def with_base(self, base: BaseMotion | None, correction: float = 1.0) -> Self:
        """Return the scene with actions that correct a motion, see `ActionMap.corrected`; None removes it."""
        return replace(self, actions=replace(self.actions, base=base, correction=correction))

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the scene's text; it identifies the scene that a policy was trained on."""
        return hashlib.sha256(self.mjcf.encode()).hexdigest()


def _check_outline(model: mujoco.MjModel, task: Task) -> None:
    """Refuse a robot without a solid surface where the task measures that surface.

    Raises:
        UserError: The robot has none.
    """
    if task.needs_outline and not Reader.of(task, model).geoms:
        raise UserError(
            f"the robot has no solid shape, and {task.name} measures where its surface is; give it geoms whose contype "
            "or conaffinity is not 0"
        )


def read_mjcf_text(scene: str | Path) -> str:
    """Return MJCF text that is given directly or as the path of a file.

    Raises:
        UserError: There is no such file.
        MjcfError: The text is too large.
    """
    if is_mjcf_text(scene) or (isinstance(scene, str) and not scene.strip()):
        return scene
    return open_mjcf(Path(scene))


def _with_sensors(mjcf: str, task: Task) -> str:
    """Return the MJCF of a scene, with the task's sensors added where they are missing.

    Raises:
        UserError: The scene does not belong to this task at this level, or contains no robot.
        MjcfError: The scene cannot be loaded.
    """
    try:
        root = parse_document(mjcf).root
    except MjcfError:
        return mjcf  # the loader reports every fault
    names = {element.get("name") for element in root.iter(etree.Element)}
    missing = [name for name in task.required_names if name not in names]
    if missing:
        raise UserError(
            f"not a scene of {task.name}: {', '.join(missing)} missing. Use the final.xml of a design for this task, "
            "or assemble the robot into the task's environment"
        )
    if not any(name.startswith(ROBOT_PREFIX) for name in names if name):
        raise UserError(
            f'the scene holds no robot: no name in it begins with "{ROBOT_PREFIX}". Give the final.xml of a design, or '
            "design a robot for this environment with aidsr design --environment"
        )
    _check_edits(root, task)
    sensors = {
        element.get("name") for section in root.iter("sensor") for element in section.iterchildren(etree.Element)
    }
    return mjcf if all(sensor.name in sensors for sensor in task.sensors) else add_sensors(mjcf, task.sensors)


def _check_edits(root: etree._Element, task: Task) -> None:
    """Refuse a scene whose environment has other values than the task's level, because it would be another task.

    Raises:
        UserError: A value differs.
    """
    for place, attributes in task.edits.items():
        element, _, name = place.partition("/")
        for node in (node for node in root.iter(element) if node.get("name") == name):
            for attribute, value in attributes.items():
                written = node.get(attribute)  # MuJoCo leaves out defaults
                if written is not None and not _same_numbers(written, np.atleast_1d(value)):
                    numbers = " ".join(f"{number:g}" for number in np.atleast_1d(value))
                    raise UserError(
                        f"not a scene of {task.name} at level {task.level}: {element} {name} has {attribute} "
                        f"{written}, not {numbers}. Name the level it was made for, or design for this one"
                    )


def _check_environment(model: mujoco.MjModel, task: Task) -> None:
    """Refuse a scene whose environment differs from the task's: the change could make the task easier.

    Raises:
        UserError: Something differs.
    """
    change = find_environment_change(model, _compiled(task.environment))
    if change:
        raise UserError(
            f"not a scene of {task.name}: {change}. Assemble the robot into the task's own environment, and leave that "
            "as it is"
        )


@functools.lru_cache(maxsize=32)
def _compiled(environment: str) -> mujoco.MjModel:
    return compile_mjcf(environment)


def _same_numbers(written: str, wanted: FloatArray) -> bool:
    present = np.array([float(number) for number in written.split()])
    return present.shape == wanted.shape and np.allclose(present, wanted, rtol=1e-4, atol=1e-6)
