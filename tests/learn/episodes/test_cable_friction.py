"""Friction of cables: the capstan equation, in poses where it can be written down."""

import math
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from mujoco.batch import Batch

from aidsr.learn.episodes.cable_friction import REFRESH_S, CableFriction
from aidsr.sim.structure import read_structure
from scenes import small_arm

PULL_N, STIFFNESS_N_M = 10.0, 500.0
COEFFICIENTS = np.array([0.0, 0.1, 0.3])

SLIDER = """
<body name="slider" pos="{end[0]} 0 {end[1]}">
  <joint name="slide" type="slide" axis="0 0 1" stiffness="500" damping="20"/>
  <geom type="sphere" size="0.01" mass="0.1"/><site name="end"/>
</body>"""

GUIDED = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody><body name="base"><geom name="base" size="0.01"/>{sites}{drum}</body>{slider}</worldbody>
  <tendon><spatial name="cable">{path}</spatial></tendon>
  <actuator><general name="pull" tendon="cable" ctrlrange="0 20" gainprm="-1"/></actuator>
</mujoco>"""


def settled(mjcf: str, seconds: float, pull_n: float = PULL_N) -> tuple[mujoco.MjModel, Batch]:
    """Three simulations, one for each coefficient, that have pulled for some time."""
    model = mujoco.MjModel.from_xml_string(mjcf)
    batch = Batch(model, nsim=len(COEFFICIENTS), nthread=1)
    friction = CableFriction(batch, read_structure(model))
    batch.bind("ctrl")[:, 0] = pull_n
    batch.forward()
    for _ in range(round(seconds / model.opt.timestep)):
        friction.apply(np.arange(batch.nsim), COEFFICIENTS)
        batch.rollout(1)
    friction.apply(np.arange(batch.nsim), COEFFICIENTS)
    return model, batch


def pull_at_the_end(mjcf: str) -> np.ndarray:
    _, batch = settled(mjcf, 0.6)
    return -batch.bind("qpos")[:, 0] * STIFFNESS_N_M


def polyline(turns: int, turn: float) -> list[tuple[float, float]]:
    """Points from section to section, each turned by an angle."""
    points = [(0.0, 0.0)]
    for k in range(turns + 1):
        x, z = points[-1]
        points.append((x + 0.05 * math.cos(k * turn), z + 0.05 * math.sin(k * turn)))
    return points


@pytest.mark.parametrize("turns", [1, 3, 9])
def test_a_cable_around_fixed_guides_loses_what_the_capstan_equation_says(turns):
    points = polyline(turns, math.pi / 2 / turns)
    sites = "".join(f'<site name="g{k}" pos="{x} 0 {z}"/>' for k, (x, z) in enumerate(points[:-1]))
    path = "".join(f'<site site="g{k}"/>' for k in range(len(points) - 1)) + '<site site="end"/>'
    mjcf = GUIDED.format(sites=sites, drum="", slider=SLIDER.format(end=points[-1]), path=path)
    expected = PULL_N * np.exp(-COEFFICIENTS * math.pi / 2)
    assert pull_at_the_end(mjcf) == pytest.approx(expected, rel=1e-3)


def test_a_cable_around_a_drum_loses_what_the_capstan_equation_says():
    """Along x over a drum of 20 mm and up along z: a quarter turn."""
    drum = '<geom name="drum" type="cylinder" size="0.02 0.02" euler="90 0 0" pos="0 0 0.02" contype="0"/>'
    sites = '<site name="g0" pos="-0.1 0 0"/><site name="below" pos="0.03 0 -0.01"/>'
    path = '<site site="g0"/><geom geom="drum" sidesite="below"/><site site="end"/>'
    mjcf = GUIDED.format(sites=sites, drum=drum, slider=SLIDER.format(end=(0.02, 0.15)), path=path)
    expected = PULL_N * np.exp(-COEFFICIENTS * math.pi / 2)
    assert pull_at_the_end(mjcf) == pytest.approx(expected, rel=1e-3)


def section_lengths(model: mujoco.MjModel, qpos: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    sites = [data.site(f"left{i}").xpos.copy() for i in range(5)]
    return np.array([np.linalg.norm(b - a) for a, b in pairwise(sites)])


def turns_at_guides(model: mujoco.MjModel, qpos: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    steps = np.diff([data.site(f"left{i}").xpos.copy() for i in range(5)], axis=0)
    along = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    return np.arccos(np.clip(np.sum(along[1:] * along[:-1], axis=1), -1.0, 1.0))


def test_a_limb_rests_where_its_springs_balance_the_sections_of_its_cable():
    """The torque of a joint is the sum of tension x change of length over the sections, tensions falling outwards."""
    weightless = small_arm(tension=20.0).replace("<worldbody>", '<option gravity="0 0 0"/><worldbody>')
    model, batch = settled(weightless, 3.0, pull_n=3.0)
    for mu, qpos in zip(COEFFICIENTS, batch.bind("qpos").copy(), strict=True):
        wrapped = np.concatenate([[0.0], np.cumsum(turns_at_guides(model, qpos))])
        tension = 3.0 * np.exp(-mu * wrapped)
        for joint in range(4):
            ahead, behind = qpos.copy(), qpos.copy()
            ahead[joint] += 1e-5
            behind[joint] -= 1e-5
            change = (section_lengths(model, ahead) - section_lengths(model, behind)) / 2e-5
            assert model.jnt_stiffness[joint] * qpos[joint] == pytest.approx(-tension @ change, rel=2e-3)
    bends = np.abs(batch.bind("qpos")).sum(axis=1)
    assert 0.7 < bends[0] < 1.5
    assert bends[2] < 0.95 * bends[0]


def test_friction_moves_no_free_robot():
    """The forces of a cable are inside the robot: together they push and turn nothing."""
    free = small_arm().replace('<body name="base">', '<body name="base"><freejoint/>')
    _, batch = settled(free.replace("<worldbody>", '<option gravity="0 0 0"/><worldbody>'), 0.5)
    forces = batch.bind("qfrc_applied")
    assert np.abs(forces[2, 6:]).max() > 1e-3
    assert np.allclose(forces[:, :6], 0.0, atol=1e-12)
    assert np.all(forces[0] == 0.0)


def swung(timestep_s: float, refresh_s: float, coefficient: float) -> np.ndarray:
    """Where the tip of a light limb is every 4 ms while its cables pull by turns, (n, 3) [m]."""
    model = mujoco.MjModel.from_xml_string(small_arm(damping=0.002))
    model.opt.timestep, model.opt.integrator = timestep_s, int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
    batch = Batch(model, nsim=1, nthread=1)
    friction = CableFriction(batch, read_structure(model))
    batch.forward()
    tips = []
    for step in range(round(0.4 / refresh_s)):
        batch.bind("ctrl")[0] = [4.0, 0.0] if (step * refresh_s) % 0.24 < 0.12 else [0.0, 4.0]
        friction.apply(np.array([0]), np.array([coefficient]))
        tips.append(batch.rollout(round(refresh_s / timestep_s), record=("sensordata",))["sensordata"][0])
    return np.concatenate(tips)[:: round(REFRESH_S / timestep_s)]


def test_forces_are_refreshed_often_enough():
    exact = swung(0.0005, 0.0005, 0.3)

    def error(timestep_s: float, refresh_s: float, coefficient: float) -> float:
        apart = swung(timestep_s, refresh_s, coefficient) - exact
        return float(np.linalg.norm(apart, axis=1).mean())

    without, late = error(0.0005, 0.0005, 0.0), error(0.0005, 0.04, 0.3)
    assert error(0.0005, REFRESH_S, 0.3) < 0.2 * without
    assert late > 0.5 * without  # once in a control step would be as good as no friction
