"""Facts about a scene before a script is played."""

from __future__ import annotations

from aidsr.core.formatting import format_check
from aidsr.sandbox.isolated import isolated
from aidsr.tools.scene import MeasuredScene


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
