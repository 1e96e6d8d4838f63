"""The film of a probe's best motion."""

from __future__ import annotations

import pytest

from aidsr.core.artifacts import ActuatorGroup, Placement, Robot
from aidsr.core.errors import UserError
from aidsr.examples import examples
from aidsr.learn.openloop import probe
from aidsr.learn.openloop.film import film
from aidsr.render.pictures import filmstrip
from aidsr.render.view import View
from aidsr.sim.assembly import assemble
from aidsr.tasks import goal_task, parse_goal
from scenes import QuickPushing, small_arm, small_scene


def test_the_motion_tells_how_the_actuators_were_grouped() -> None:
    """A motion with one action for each actuator is played as such, and not as one action for all of them."""
    task, together = QuickPushing(), (ActuatorGroup(name="both", actuators=("pull_left", "pull_right")),)
    report = probe(small_scene(), task, groups=together, grouping="off", candidates=16, variations=1, threads=1)
    assert film(small_scene(), task, report.best, groups=together) == film(small_scene(), task, report.best)
    with pytest.raises(UserError, match="belong to another robot"):
        film(
            small_scene(),
            task,
            report.best.model_copy(update={"motion": report.best.motion.model_copy(update={"groups": ()})}),
        )


def test_a_strip_is_drawn_from_where_target_and_mount_are_seen() -> None:
    duct = examples()["duct"]
    task = goal_task(parse_goal(duct.goal), duct.environment)
    arm = Robot(mjcf=small_arm(), functional_part="tip")
    mjcf = assemble(arm, duct.environment, Placement(mount="mount", base="fixed"), task.sensors).mjcf
    report = probe(mjcf, task, candidates=16, variations=1, max_steps=16, threads=1)
    played = film(mjcf, task, report.best)
    assert played.shown == ("sensor", "mount")
    few = played.model_copy(update={"qpos": played.qpos[:2]})
    drawn = few.strip(2)
    motion = {"qpos": few.qpos, "frames_per_s": few.frames_per_s, "count": 2}
    assert drawn == filmstrip(few.mjcf, view=View(shown=few.shown), **motion)
    assert drawn != filmstrip(few.mjcf, **motion)
