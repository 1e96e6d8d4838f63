"""Descriptions of what a script may command in a scene: actuators of the robot and of the environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from aidsr.core.formatting import format_number
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.script_policy import BlockStart
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.environment_summary import command_in_words
from aidsr.tasks.feature_numbers import features_in_words
from aidsr.tools.measured import format_value

_MOST_STARTS = 8
"""Number of starts of blocks that are listed. Our choice: readable."""


def commands_in_words(scene: TaskScene) -> list[str]:
    """Return lines on what a script may command in a scene, what it may not, and what its blocks may depend on."""
    model, actions = scene.model, scene.actions
    robots = [group.name for group in actions.groups if _is_robots(group.actuators[0])]
    lines = [f"a script commands, -1 to 1 over the control range: {', '.join(map(_plain, robots))}"]
    ours = [name for group in actions.groups for name in group.actuators if not _is_robots(name)]
    if ours:
        told = "; ".join(command_in_words(model, model.actuator(name).id) for name in ours)
        lines.append(f"and of the environment: {told}")
    features = scene.task.features
    observed = [f"observed, for the conditions of blocks: {features_in_words(features)}"] * bool(features)
    return [*lines, *_driven_by_the_job(scene), *observed]


def unnamed_in_words(scene: TaskScene, unnamed: Mapping[str, Sequence[str]]) -> list[str]:
    """Return lines on the actions of groups that a script does not name, and on actuators that no script may command.

    Args:
        scene: Scene in which the script is played.
        unnamed: Names of the groups that the script, or each of its blocks, does not name, with or without "robot/".
    """
    lines = []
    for where, names in unnamed.items():
        told = [
            f"{_plain(group.name)} at {format_number(rest)}"
            + ("" if _is_robots(group.actuators[0]) else f" ({_of_environment(scene, group.actuators[0])})")
            for group, rest in zip(scene.actions.groups, scene.actions.rest + 0.0, strict=True)
            if _plain(group.name) in map(_plain, names)
        ]
        lines += [f"not named in {where}, at the action whose command is nearest to 0: {', '.join(told)}"] * bool(told)
    return [*lines, *_driven_by_the_job(scene)]


def blocks_in_words(starts: Sequence[BlockStart]) -> list[str]:
    """Return lines on which blocks of a script were played from when, and what was observed at their start."""
    lines = []
    for start in starts[:_MOST_STARTS]:
        values = ", ".join(f"f{number} {format_value(value)}" for number, value in enumerate(start.features, 1))
        lines.append(f"{start.title} from {format_number(round(start.time_s, 6))} s, where {values}")
    more = len(starts) - _MOST_STARTS
    return [*lines, *([f"and {more} more blocks"] if more > 0 else [])]


def _driven_by_the_job(scene: TaskScene) -> list[str]:
    model = scene.model
    left = [i for i in range(model.nactuator) if i not in scene.actions.actuators]
    told = "; ".join(command_in_words(model, i) for i in left if not _is_robots(model.actuator(i).name))
    return [f"of the environment, driven by the job and by no script: {told}"] * bool(told)


def _of_environment(scene: TaskScene, actuator: str) -> str:
    words = command_in_words(scene.model, scene.model.actuator(actuator).id).partition(": ")[2]
    return f"of the environment: {words}" if words else "of the environment"


def _is_robots(name: str) -> bool:
    return name.startswith(ROBOT_PREFIX)


def _plain(name: str) -> str:
    return name.removeprefix(ROBOT_PREFIX)
