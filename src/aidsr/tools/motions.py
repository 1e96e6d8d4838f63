"""Facts about a scene before a script is played, and conversion of a script to controls for pictures."""

from __future__ import annotations

from aidsr.core.artifacts import Artifact
from aidsr.core.formatting import format_check
from aidsr.sandbox.isolated import isolated
from aidsr.tools.scene import MeasuredScene


class Controls(Artifact):
    """Controls of all actuators of a scene over time."""

    rows: tuple[tuple[float, ...], ...]
    """Controls in each frame (n_frames, nu)."""
    per_s: float
    """Frames per second."""


@isolated
def scene_facts(scene: MeasuredScene) -> tuple[str, ...]:
    """Return lines on what makes every policy of a scene invalid, and on what a script may command.

    The robot's distance from its mount at the start is always included; the functional part only if it makes up too
    much of the robot.

    Raises:
        UserError: Nothing can be commanded, or the scene does not belong to its task.
        MjcfError: The scene cannot be loaded.
    """
    from aidsr.learn.episodes.policy_checks import scene_checks
    from aidsr.sim.structure import read_structure
    from aidsr.tools.commands import commands_in_words

    loaded = scene.load()
    length_mm = 1000 * read_structure(loaded.model).characteristic_length_m
    checks = {check.name: check for check in scene_checks(loaded)}
    start, part = checks["starts_at_mount"], checks["functional_part_is_a_part"]
    high = checks.get("starts_low")  # of lanes only
    if start.measured is None:
        where = f"no policy is valid: {start.message}"
    else:
        told = "" if start.passed else "too far for a valid policy: "
        where = (
            f"{told}{start.message}: {start.measured * length_mm:.0f} mm (valid: at most {start.limit:g} of its "
            f"length, {start.limit * length_mm:.0f} mm)"
        )
    return (
        where,
        *([f"no policy is valid: {high.message}: {format_check(high)}"] if high and not high.passed else []),
        *([] if part.passed else [f"no policy is valid: {part.message}: {format_check(part)}; name a smaller part"]),
        *commands_in_words(loaded),
    )


@isolated
def controls(scene: MeasuredScene, script: str, seconds: float) -> Controls:
    """Return the controls of a scene under a script; actuators that the environment itself drives stay at 0.

    Raises:
        UserError: The script cannot be parsed or names an unknown group, or the scene does not belong to its task.
        MjcfError: The scene cannot be loaded.
    """
    import numpy as np

    from aidsr.learn.openloop.script import script_policy

    loaded = scene.load()
    policy = script_policy(loaded, script)
    steps = max(1, round(seconds / loaded.task.control_dt_s))
    actions = np.array([policy.at(step * loaded.task.control_dt_s) for step in range(steps)])
    rows = np.zeros((steps, loaded.model.nu))
    rows[:, list(loaded.actions.actuators)] = loaded.actions.ctrl(actions)
    return Controls(rows=tuple(tuple(row) for row in rows.tolist()), per_s=1.0 / loaded.task.control_dt_s)
