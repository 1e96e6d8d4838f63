"""Rules for actuators that can have no effect because of their gear, gain or tendon path in the compiled model."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.actuator_force import gear_of
from aidsr.sim.extent import half_width_m
from aidsr.sim.poses import bent_pose
from aidsr.sim.structure import Tendon
from aidsr.sim.tendon_effects import length_gradient_entries
from aidsr.validation.consequences import NO_MOTION
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.thresholds import FEW_CABLES

_SIMPLE_GAINS = (int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE))
_SLIDE, _FREE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_FREE)
MOMENT_SHARE = 0.05
"""Smallest moment arm / distance between tendon and joint; with less, the tendon runs along the axis. Our choice."""
_BENT_RAD = 0.02
"""Bend of each joint at which moment arms are read: in a straight limb, the length of a tendon through the axes is at
an extreme."""
_FRONT = "".join(f'      <site site="front{index}"/>\n' for index in range(7))


def _find_zero_gear(robot: RobotUnderTest) -> Iterator[Fault]:
    model = robot.model
    dead = [
        actuator
        for actuator in robot.structure.actuators
        if not gear_of(model, actuator).any()
        or (
            int(model.actuator_gaintype[actuator]) in _SIMPLE_GAINS
            and not model.actuator_gainprm[actuator].any()
            and not model.actuator_biasprm[actuator].any()
        )
    ]
    if dead:
        yield ZERO_GEAR.fault(
            names=tuple(robot.actuator(actuator) for actuator in dead),
            measured=0,
            message="gear or gain is zero, so no command has a force",
        )


ZERO_GEAR = Rule(
    code="zero_gear",
    stage=Stage.WIRING,
    finds="The gear of an actuator is zero, or its gain and bias are.",
    why="No command of it has a force, and MuJoCo does not say so.",
    limit="gear, and gain or bias: not all 0",
    check=_find_zero_gear,
    unit="N per unit of ctrl",
    cure='Give the motor gear="-1" (positive commands then pull the tendon), or the servo a kp above 0.',
    explains=NO_MOTION,
    example=Example((('tendon="front" gear="-1"', 'tendon="front" gear="0"'),)),
)


def _find_tendon_one_body(robot: RobotUnderTest) -> Iterator[Fault]:
    stuck = [tendon for tendon in robot.structure.tendons if tendon.spatial and tendon.spans < 2 and tendon.actuators]
    if stuck:
        yield TENDON_ONE_BODY.fault(
            names=tuple(robot.tendon(tendon.id) for tendon in stuck),
            measured=1,
            limit=2,
            message="all sites of the tendon are on one rigid part, so its length never changes",
            likely_cause="its sites sit in one <body> instead of one site in each segment",
        )


TENDON_ONE_BODY = Rule(
    code="tendon_one_body",
    stage=Stage.WIRING,
    finds="All sites of a driven tendon are on one rigid part.",
    why="The length of such a tendon never changes, so pulling it bends nothing.",
    limit="parts that move against each other, spanned by a driven tendon: at least 2",
    check=_find_tendon_one_body,
    unit="moving parts spanned",
    cure="Put one routing site into each segment's <body> and list them from base to tip.",
    explains=NO_MOTION,
    example=Example(
        (
            ('<site name="front4" pos="0.009 0 0.0125"/>', ""),
            (
                '<site name="front3" pos="0.009 0 0.0125"/>',
                '<site name="front3" pos="0.009 0 0.0125"/>\n            <site name="front4" pos="0.009 0 0.02"/>',
            ),
            (_FRONT, '      <site site="front3"/>\n      <site site="front4"/>\n'),
        )
    ),
)


def _find_tendon_no_moment(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find driven tendons that have a moment arm about none of the joints they pass.

    Source: moment arm = change of length per radian, dL/dq, divided by the distance between tendon and joint.
    """
    driven = [t for t in robot.structure.tendons if t.spatial and t.spans > 1 and t.actuators]
    if not driven:
        return
    bent = bent_pose(robot.model, robot.structure, _BENT_RAD)
    widths_m = _half_widths_m(robot)
    shares = {tendon.id: _moment_share(robot, bent, tendon, widths_m) for tendon in driven}
    useless = [tendon for tendon in driven if shares[tendon.id][0] < MOMENT_SHARE]
    if useless:
        largest, reach_m = max(shares[tendon.id] for tendon in useless)
        yield TENDON_NO_MOMENT.fault(
            severity="error" if len(useless) > FEW_CABLES * len(driven) else "warning",
            names=tuple(robot.tendon(tendon.id) for tendon in useless),
            measured=largest,
            limit=MOMENT_SHARE,
            whole=reach_m,
            whole_unit="m",
            message="pulling the tendon turns no joint; its largest moment arm",
            likely_cause="it runs through the joint axes, or along the axis the joints turn about",
        )


def _half_widths_m(robot: RobotUnderTest) -> dict[int, float]:
    """Return the half width [m] of the thickest geom of every body with geoms, by body id."""
    widths_m: dict[int, float] = {}
    for geom in robot.structure.geoms:
        body = int(robot.model.geom_bodyid[geom])
        widths_m[body] = max(widths_m.get(body, 0.0), half_width_m(robot.model, geom))
    return widths_m


def _moment_share(
    robot: RobotUnderTest, bent: mujoco.MjData, tendon: Tendon, widths_m: dict[int, float]
) -> tuple[float, float]:
    """Return a tendon's largest ratio of moment arm and possible distance from the joint, and that distance [m].

    The possible distance is the larger of the distance from the joint to the tendon's nearest site and the half width
    of the joint's body. (1, 0) if the tendon moves a slide joint.
    """
    model = robot.model
    dofs, slopes = length_gradient_entries(model, bent, tendon.id)
    arms, joints = np.abs(slopes), model.dof_jntid[dofs]
    if (arms[model.jnt_type[joints] == _SLIDE] > 0).any():
        return 1.0, 0.0
    turned = np.isin(joints, robot.structure.joints) & (model.jnt_type[joints] != _FREE)
    arms, joints = arms[turned], joints[turned]
    apart = bent.xanchor[joints][:, None] - bent.site_xpos[list(tendon.sites)]
    widths = [widths_m.get(body, 0.0) for body in model.jnt_bodyid[joints].tolist()]
    reach_m = np.maximum(np.sqrt(np.einsum("jsi,jsi->js", apart, apart).min(axis=1)), widths)
    found = [(arm / reach, reach) for arm, reach in zip(arms.tolist(), reach_m.tolist(), strict=True) if reach > 0]
    return max(found, default=(0.0, 0.0))


TENDON_NO_MOMENT = Rule(
    code="tendon_no_moment",
    stage=Stage.WIRING,
    finds="A driven tendon has no lever about any joint that it passes.",
    why="A cable through the joint axes, or along them, turns nothing however hard it is pulled.",
    limit=f"moment arm / distance from the joint, at the best joint: at least {MOMENT_SHARE:g}; a warning for at most "
    f"{100 * FEW_CABLES:g} % of the cables",
    check=_find_tendon_no_moment,
    unit="of its distance from the joints",
    cure="Offset its sites from the backbone, at right angles to the joint axes it shall turn.",
    explains=NO_MOTION,
    example=Example((('pos="0.009 0 ', 'pos="0 0.009 '),)),
)
