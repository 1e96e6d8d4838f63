"""Conversion of actions, -1 to 1, to controls of actuators, some of which act together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import ActuatorGroup
from aidsr.core.errors import UserError
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.structure import Structure, name_of, names_of, read_structure
from aidsr.tasks.readings import FloatArray
from aidsr.tasks.task import Task

Grouping = Literal["auto", "off"]
"""Whether actuators share one action: "auto" groups those that belong together, "off" gives each its own action."""

GroupsFrom = Literal["design", "symmetry", "none"]
"""Origin of the groups of actuators."""


class Playback(Protocol):
    """A motion in n parallel episodes, with what it has to remember of each."""

    def at(self, time_s: FloatArray, observation: NDArray[np.floating]) -> FloatArray:
        """Return the actions of the present control step, (n, k), -1 to 1.

        Args:
            time_s: Time since the beginning of each episode, (n,) [s]; an episode begins anew where it is 0.
            observation: Present observations, (n, n_observations).
        """
        ...


class BaseMotion(Protocol):
    """A motion that a policy corrects."""

    def playback(self, n: int) -> Playback:
        """Return the motion in n parallel episodes."""
        ...


_ACTUATOR = mujoco.mjtObj.mjOBJ_ACTUATOR


@dataclass(frozen=True)
class ActionMap:
    """Mapping of an action with k numbers to m actuators."""

    groups: tuple[ActuatorGroup, ...]
    """One group for each number of an action, in order: the robot's groups first, then the base that the policy
    drives."""
    groups_from: GroupsFrom
    actuators: tuple[int, ...]
    """Ids of the m driven actuators."""
    follows: tuple[int, ...]
    """Index of the number of the action that drives each actuator, m of them."""
    low: FloatArray
    """Control at an action of -1, (m,)."""
    high: FloatArray
    """Control at an action of 1, (m,)."""
    hold_steps: int = 1
    """Control steps for which an action is held before the next one takes effect."""
    base: BaseMotion | None = None
    """Motion that the policy's actions correct; None where the actions are used alone."""
    correction: float = 1.0
    """Change of that motion for a policy's action of 1."""

    @property
    def size(self) -> int:
        """Number of values in an action."""
        return len(self.groups)

    @property
    def rest(self) -> FloatArray:
        """Action whose controls are nearest to 0, with which an episode begins, (k,)."""
        mine = np.clip(-(self.high + self.low) / (self.high - self.low), -1.0, 1.0)
        follows = np.array(self.follows)
        return np.array([mine[follows == k].mean() for k in range(self.size)])

    def corrected(self, base: FloatArray, action: FloatArray) -> FloatArray:
        """Return the action of the base motion corrected by the action of a policy, (n, k) each, -1 to 1."""
        return np.clip(base + self.correction * action, -1.0, 1.0)

    def ctrl(self, action: FloatArray) -> FloatArray:
        """Return the controls of the driven actuators, (n, k) -> (n, m)."""
        mine = np.clip(action, -1.0, 1.0)[:, list(self.follows)]
        return self.low + (mine + 1.0) / 2.0 * (self.high - self.low)


def map_actions(
    model: mujoco.MjModel, task: Task, declared: Sequence[ActuatorGroup] = (), grouping: Grouping = "auto"
) -> ActionMap:
    """Return the mapping of actions to the actuators of a scene.

    Args:
        model: The compiled scene.
        task: Task of the scene; it names the actuators of a base that the policy drives as well.
        declared: Groups that the robot's author declares, with or without the prefix "robot/".
        grouping: "auto" uses the declared groups. Without any, if the robot is fixed to a mount, limbs of the same
            build act together, as symmetric fingers do in the paper. The limbs of a free robot must differ to walk, so
            nothing is grouped by symmetry there. "off" gives each actuator its own action.

    Raises:
        UserError: The groups do not fit the scene, or an actuator has no control range.
    """
    structure = read_structure(model)
    if not structure.actuators:
        raise UserError("the robot has no actuators: there is nothing to learn")
    groups, groups_from = _robot_groups(model, structure, declared, grouping)
    groups += [(name, (int(model.actuator(name).id),)) for name in task.policy_actuators]
    return _action_map(model, groups, groups_from)


def recorded_actions(model: mujoco.MjModel, groups: Sequence[ActuatorGroup], groups_from: GroupsFrom) -> ActionMap:
    """Return the mapping of actions that a training has recorded.

    Args:
        model: The compiled scene, the same or one with the same actuators.
        groups: Recorded groups, one for each number of an action.
        groups_from: Recorded origin of the groups.

    Raises:
        UserError: The scene lacks an actuator, or one has no control range.
    """
    ids = {name_of(model, _ACTUATOR, i): i for i in range(model.nactuator)}
    lacking = [name for group in groups for name in group.actuators if name not in ids]
    if lacking:
        raise UserError(
            f"the scene has no actuator {', '.join(lacking)}, which the policy drives; it has {', '.join(ids)}. "
            "Train a policy for this scene"
        )
    found = [(group.name, tuple(ids[name] for name in group.actuators)) for group in groups]
    return _action_map(model, found, groups_from)


_Groups = list[tuple[str, tuple[int, ...]]]


def _action_map(model: mujoco.MjModel, groups: _Groups, groups_from: GroupsFrom) -> ActionMap:
    actuators = [member for _, members in groups for member in members]
    unlimited = [i for i in actuators if not model.actuator_ctrllimited[i]]
    if unlimited:
        names = ", ".join(names_of(model, _ACTUATOR, tuple(unlimited)))
        raise UserError(f"actuators without ctrlrange: {names}; give each a range for the policy to drive")
    return ActionMap(
        groups=tuple(ActuatorGroup(name=name, actuators=names_of(model, _ACTUATOR, m)) for name, m in groups),
        groups_from=groups_from,
        actuators=tuple(actuators),
        follows=tuple(k for k, (_, members) in enumerate(groups) for _ in members),
        low=model.actuator_ctrlrange[actuators, 0].copy(),
        high=model.actuator_ctrlrange[actuators, 1].copy(),
    )


def _robot_groups(
    model: mujoco.MjModel, structure: Structure, declared: Sequence[ActuatorGroup], grouping: Grouping
) -> tuple[_Groups, GroupsFrom]:
    """Return names and actuator ids of the groups, which cover all actuators of the robot, and their origin."""
    found: _Groups = []
    groups_from: GroupsFrom = "none"
    if grouping == "auto" and declared:
        found, groups_from = _declared_groups(model, structure, declared), "design"
    elif grouping == "auto" and not structure.free_roots and structure.symmetric_groups:
        found = [(f"{name_of(model, _ACTUATOR, ids[0])} and alike", ids) for ids in structure.symmetric_groups]
        groups_from = "symmetry"
    grouped = {member for _, members in found for member in members}
    single: _Groups = [(name_of(model, _ACTUATOR, i), (i,)) for i in structure.actuators if i not in grouped]
    return sorted(found + single, key=lambda group: group[1][0]), groups_from


def _declared_groups(model: mujoco.MjModel, structure: Structure, declared: Sequence[ActuatorGroup]) -> _Groups:
    """Return the declared groups as actuator ids.

    Raises:
        UserError: A member is not an actuator of the robot, or belongs to two groups.
    """
    ids = {name_of(model, _ACTUATOR, i): i for i in structure.actuators}
    groups: _Groups = []
    taken: set[int] = set()
    for group in declared:
        members = []
        for name in group.actuators:
            index = ids.get(name, ids.get(ROBOT_PREFIX + name))
            if index is None or index in taken:
                problem = "it is in another group" if index is not None else f"the robot has {', '.join(ids)}"
                raise UserError(
                    f'actuator group "{group.name}" cannot have "{name}": {problem}. '
                    "Correct the group, or train without groups"
                )
            taken.add(index)
            members.append(index)
        groups.append((group.name, tuple(members)))
    return groups
