"""Jobs for the built-in team: the benchmark's briefs, and environments of nobody's package."""

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np

from aidsr.core.artifacts import Brief, Concept, Placement, Robot
from aidsr.sim.assembly import assemble
from aidsr.sim.environment_summary import summarize_environment
from aidsr.tasks import load_task
from aidsr.teams.rules.families import BUILT_IN as FAMILIES
from aidsr.teams.rules.families import variants_for
from aidsr.teams.rules.job import read_job
from aidsr.teams.rules.job_kinds import JOB_KINDS

IDEAS = {kind: variants_for(kind, FAMILIES) for kind in JOB_KINDS}
"""Variants of each family, by kind of job."""

KINDS = {"button_pushing": "reach", "simple_grasping": "grasp", "flat_ground": "crawl", "drawer_opening": "pull"}
OTHER_KINDS = {
    "surface_adapting": "conform",
    "pipe_inserting": "insert",
    "tunnel": "squeeze",
    "force_controlled_brushing": "brush",
}

LAMP = """<mujoco model="lamp"><option timestep="0.002" integrator="implicitfast"/><worldbody>
<site name="mount_wall" pos="0 0 0.5" euler="0 90 0"/><geom name="floor" type="plane" size="1 1 0.1"/>
<body name="switch" pos="0.2 0.08 0.5">
<joint name="switch_turn" axis="0 1 0" range="-20 20" stiffness="0.05" damping="0.01"/>
<geom name="switch" type="capsule" size="0.006" fromto="0 0 0 0 0 0.05" mass="0.02"/></body>
</worldbody></mujoco>"""

MARBLE = """<mujoco model="marble"><option timestep="0.002" integrator="implicitfast"/><worldbody>
<site name="mount" pos="0 0 0.3" euler="180 0 0"/><geom name="floor" type="plane" size="1 1 0.1"/>
<body name="marble" pos="0.02 0 0.02"><freejoint/><geom name="marble" type="sphere" size="0.02" mass="0.03"/></body>
</worldbody></mujoco>"""

DESERT = """<mujoco model="desert"><option timestep="0.002" integrator="implicitfast"/><worldbody>
<geom name="sand" type="plane" size="2 2 0.1"/></worldbody></mujoco>"""


@cache
def brief(task: str) -> Brief:
    return load_task(task).brief()


@cache
def free_brief(objective: str, environment: str, robot: str = "") -> Brief:
    summary = summarize_environment(environment)
    return Brief(objective=objective, environment=environment, summary=summary, starting_robot=robot)


def concept(task: str, family: str, variant: str, seed: int = 0) -> Concept:
    job, made = read_job(brief(task)), FAMILIES[family]
    return made.concept(made.size(job, np.random.default_rng(seed), variant), job)


def scene(task: str, robot: Robot, placement: Placement) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(
        assemble(robot, brief(task).environment, placement, load_task(task).sensors).mjcf
    )
