"""The film of a probe's best motion."""

from __future__ import annotations

from aidsr.core.artifacts import Placement, Robot
from aidsr.examples import examples
from aidsr.learn.openloop import probe
from aidsr.learn.openloop.film import film
from aidsr.render.pictures import filmstrip
from aidsr.render.view import View
from aidsr.sim.assembly import assemble
from aidsr.tasks import goal_task, parse_goal
from scenes import small_arm


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
