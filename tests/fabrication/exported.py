"""An arm, a three-finger gripper and a crawler of the built-in team, made into parts once for all tests; and a ring."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from aidsr.core.artifacts import ValidationReport
from aidsr.fabrication.build import RobotBuild, build_robot
from aidsr.fabrication.printers import printer_named
from aidsr.tasks import load_task
from aidsr.teams.rules.families import BUILT_IN as FAMILIES
from aidsr.teams.rules.job import read_job
from aidsr.validation import validate

ROBOTS = ("arm", "gripper", "crawler")
_JOBS = {
    "arm": ("button_pushing", "arm"),
    "gripper": ("simple_grasping", "gripper"),
    "crawler": ("flat_ground", "crawler"),
    "ring": ("flat_ground", "ring"),
    "tentacle": ("button_pushing", "tentacle"),
    "worm": ("flat_ground", "worm"),
}


@cache
def mjcf(robot: str) -> str:
    task, name = _JOBS[robot]
    family = FAMILIES[name]
    parameters = family.size(read_job(load_task(task).brief()), np.random.default_rng(0), family.variants[0])
    if robot == "gripper":
        parameters = parameters.model_copy(update={"fingers": 3, "opposed": False})
    return family.write(parameters).mjcf


@cache
def report(robot: str) -> ValidationReport:
    found = validate(mjcf(robot))
    assert found.stable, found.account()
    return found


@cache
def made(robot: str, material: str | None = None, printer: str = "fdm") -> RobotBuild:
    return build_robot(mjcf(robot), [report(robot)], printer_named(printer), material=material)


@dataclass(frozen=True)
class Mesh:
    """What a reader of another make found in a file."""

    unit: str
    triangles: int
    manifold: bool
    size_mm: tuple[float, ...]
