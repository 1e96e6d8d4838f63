"""Descriptions of what a script may command in a scene: actuators of the robot and of the environment."""

from __future__ import annotations

from collections.abc import Sequence

from aidsr.core.formatting import format_number
from aidsr.learn.episodes.scene import TaskScene
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.environment_summary import command_in_words


def commands_in_words(scene: TaskScene) -> list[str]:
    """Return lines on which actuators a script may command in a scene, and which of the environment it may not."""
    model, actions = scene.model, scene.actions
    robots = [group.name for group in actions.groups if _is_robots(group.actuators[0])]
    lines = [f"a script commands, -1 to 1 over the control range: {', '.join(map(_plain, robots))}"]
    ours = [name for group in actions.groups for name in group.actuators if not _is_robots(name)]
    if ours:
        told = "; ".join(command_in_words(model, model.actuator(name).id) for name in ours)
        lines.append(f"and of the environment: {told}")
    return [*lines, *_driven_by_the_job(scene)]


def unnamed_in_words(scene: TaskScene, unnamed: Sequence[str]) -> list[str]:
    """Return lines on the actions of groups that a script does not name, and on actuators that no script may command.

    Args:
        scene: Scene in which the script is played.
        unnamed: Names of the groups that the script does not name, with or without "robot/".
    """
    told = [
        f"{_plain(group.name)} at {format_number(rest)}"
        + ("" if _is_robots(group.actuators[0]) else f" ({_of_environment(scene, group.actuators[0])})")
        for group, rest in zip(scene.actions.groups, scene.actions.rest + 0.0, strict=True)
        if _plain(group.name) in map(_plain, unnamed)
    ]
    lines = [f"not named in the script, at the action whose command is nearest to 0: {', '.join(told)}"] * bool(told)
    return [*lines, *_driven_by_the_job(scene)]


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
