"""Rules for inertia and resistance from nowhere: of no shape of a body, or of a free joint."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.extent import bounding_box_m
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage

OUTSIDE_SHARE = 0.05
"""Largest allowed distance of a body's centre of mass from the bounding box of its geoms / diagonal of this box. Our
choice: shapes of a simulation are simpler than what they stand for."""
NEGLIGIBLE_SHARE = 1e-3
"""Mass / mass of the robot up to which the place of a body's mass does not matter, and moment of inertia / (mass of the
robot x L^2) up to which its inertia does not. Our choice."""

_SMALLEST_SHARE = 1e-3
"""Diagonal / L that a body without any extent counts with."""


def _find_implausible_inertias(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find moving bodies whose mass lies outside of them, and bodies that turn harder than all their mass at the rim.

    Inertias that MuJoCo computes from geoms always pass: the moment of inertia about the centre of mass is at most
    that about the middle of the box, and there no mass is farther away than half the diagonal.
    """
    model, structure = robot.model, robot.structure
    small = NEGLIGIBLE_SHARE * structure.mass_kg * robot.length_m**2
    outside: dict[str, tuple[float, float]] = {}
    turning: dict[str, tuple[float, float]] = {}
    for body in structure.moving:
        low, high = bounding_box_m(model, robot.drawn, _shaped(model, structure.bodies, body))
        diagonal_m = max(float(np.linalg.norm(high - low)), _SMALLEST_SHARE * robot.length_m)
        centre, mass_kg = robot.drawn.xipos[body], float(model.body_mass[body])
        away_m = float(np.linalg.norm(np.maximum(0.0, np.maximum(low - centre, centre - high))))
        if mass_kg > NEGLIGIBLE_SHARE * structure.mass_kg and away_m > OUTSIDE_SHARE * diagonal_m:
            outside[robot.body(body)] = away_m / diagonal_m, diagonal_m
        most = mass_kg * (diagonal_m / 2) ** 2 + small
        if (inertia := float(model.body_inertia[body].max())) > most > 0:
            turning[robot.body(body)] = inertia / most, most
    if outside:
        share, whole = max(outside.values())
        yield IMPLAUSIBLE_INERTIA.fault(
            "the centre of mass lies outside of the body's shapes",
            names=tuple(outside),
            measured=share,
            limit=OUTSIDE_SHARE,
            unit="of the diagonal of its shapes",
            whole=whole,
            whole_unit="m",
        )
    elif turning:
        share, whole = max(turning.values())
        yield IMPLAUSIBLE_INERTIA.fault(
            "the moment of inertia is greater than with all the mass at the farthest corner of the body's shapes",
            names=tuple(turning),
            measured=share,
            limit=1.0,
            whole=whole,
            whole_unit="kg m2",
        )


def _shaped(model: mujoco.MjModel, bodies: tuple[int, ...], body: int) -> list[int]:
    """Return the bodies whose geoms stand for a body: its rigid part, or for a part without geoms its neighbours'."""
    part = _part(model, bodies, body)
    if any(model.body_geomnum[one] for one in part):
        return part
    before = int(model.body_parentid[int(model.body_weldid[body])])
    near = _part(model, bodies, before) if before in bodies else []
    for one in bodies:
        if int(model.body_parentid[one]) in part and one not in part:
            near += _part(model, bodies, one)
    return near if any(model.body_geomnum[one] for one in near) else list(bodies)


def _part(model: mujoco.MjModel, bodies: tuple[int, ...], body: int) -> list[int]:
    """Return the bodies that are one rigid part with a body."""
    return [one for one in bodies if model.body_weldid[one] == model.body_weldid[body]]


IMPLAUSIBLE_INERTIA = Rule(
    code="implausible_inertia",
    stage=Stage.RANGES,
    finds="The mass of a moving body lies outside of its shapes, or it turns harder than such a body can.",
    why="An inertia that belongs to no shape keeps a robot upright, or shifts its centre of mass to where nothing of "
    "it is.",
    limit=f"distance of the centre of mass from the box around the body's geoms / diagonal of this box: at most "
    f"{OUTSIDE_SHARE:g}; largest moment of inertia / (mass x (half the diagonal)^2 + {NEGLIGIBLE_SHARE:g} x mass of "
    "the robot x L^2): at most 1. A body without geoms has the box around its neighbours",
    check=_find_implausible_inertias,
    unit="of the greatest such a body can have",
    cure="Leave <inertial> out, so that mass and inertia follow from the geoms.",
    example=Example(
        (
            (
                '<geom name="g6"/>',
                '<geom name="g6"/><inertial pos="0 0 0.0125" mass="0.01" diaginertia="1e-3 1e-3 1e-6"/>',
            ),
        )
    ),
)


def _find_resisting_free_joints(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find free joints with a spring, damping, friction or armature."""
    model = robot.model
    found: dict[str, list[str]] = {}
    for root in robot.structure.free_roots:
        joint = int(model.body_jntadr[root])
        dofs = slice(int(model.jnt_dofadr[joint]), int(model.jnt_dofadr[joint]) + 6)
        values = {
            "stiffness": (model.jnt_stiffness[joint], model.jnt_stiffnesspoly[joint]),
            "damping": (model.dof_damping[dofs], model.dof_dampingpoly[dofs]),
            "frictionloss": (model.dof_frictionloss[dofs],),
            "armature": (model.dof_armature[dofs],),
        }
        if has := [name for name, given in values.items() if any(np.any(one) for one in given)]:
            found[robot.joint(joint)] = has
    if found:
        words = ", ".join(dict.fromkeys(word for has in found.values() for word in has))
        yield FREE_JOINT_RESISTS.fault(f"a free joint with {words}", names=tuple(found), measured=len(found), limit=0)


FREE_JOINT_RESISTS = Rule(
    code="free_joint_resists",
    stage=Stage.RANGES,
    finds="A free joint has a spring, damping, friction or armature.",
    why="These act between the robot and the world, where nothing is: they keep it upright or hold it in the air.",
    limit="free joints with stiffness, damping, frictionloss or armature: 0",
    check=_find_resisting_free_joints,
    unit="free joints",
    cure='Write <freejoint/>, which takes no defaults, instead of <joint type="free"/>.',
    example=Example(
        (('<body name="base">', '<body name="base" pos="0 0 0.0215">\n      <joint type="free" damping="5"/>'),),
        {"mount": "free"},
    ),
)
