"""The beam formulas hold in MuJoCo: statics, frequency, damping, stability, cables, soft constraints."""

import math

import mujoco
import numpy as np
import pytest

from aidsr.sim import beam

EI_N_M2, LENGTH_M, MASS_KG = 0.04, 0.3, 0.1


def largest_undamped_stiffness(segment_mass_kg: float, segment_length_m: float, timestep_s: float) -> float:
    """Largest joint stiffness an undamped uniform chain can have [N m/rad]: dt omega_max = 2.

    Source: omega_max^2 = 78.6 k / (m l^2) for links of rods (docs/physics.md); semi-implicit Euler.
    """
    return (2.0 / timestep_s) ** 2 * segment_mass_kg * segment_length_m**2 / 78.6


def tendon_moment_arm(offset_m: float, joint_angle_rad: float, guide_distance_m: float) -> float:
    """Moment arm of a straight cable span at a bent joint [m]. Source: plane geometry between two guides."""
    half = joint_angle_rad / 2.0
    return offset_m * math.cos(half) + guide_distance_m * math.sin(half)


def contact_depth(force_n: float, mass_kg: float, time_constant_s: float) -> float:
    """Depth to which a body is pressed into a contact [m], with MuJoCo's default impedance of 0.95.

    Source: MuJoCo manual, Computation, soft constraints at rest.
    """
    return force_n * time_constant_s**2 * 0.05 / mass_kg


def limit_stiffness(inertia_kg_m2: float, time_constant_s: float) -> float:
    """Stiffness of a joint limit [N m/rad]. Source: as `contact_depth`."""
    return inertia_kg_m2 / (0.05 * time_constant_s**2)


def cantilever(count: int, *, stiffness: float | None = None, damping_time_s: float = 0.0, option: str = "") -> str:
    """A horizontal chain of `count` segments with joints in their middles."""
    segment = LENGTH_M / count
    k = beam.joint_stiffness(EI_N_M2, segment) if stiffness is None else stiffness
    c = beam.joint_damping(k, damping_time_s)
    text, closing = "", ""
    for number in range(count):
        link = segment if number < count - 1 else segment / 2
        mass = MASS_KG * link / LENGTH_M
        text += (
            f'<body pos="{segment / 2 if number == 0 else segment} 0 0">'
            f'<joint axis="0 1 0" stiffness="{k}" damping="{c}"/>'
            f'<geom type="cylinder" size="0.0005" fromto="0 0 0 {link} 0 0" mass="{mass}" contype="0" conaffinity="0"/>'
        )
        closing += "</body>"
    option = option or '<option gravity="0 0 0" integrator="implicitfast" timestep="0.002"/>'
    return f'<mujoco>{option}<worldbody>{text}<site name="tip" pos="{segment / 2} 0 0"/>{closing}</worldbody></mujoco>'


def at_rest(mjcf: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def mass_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    columns = np.zeros((model.nv, model.nv))
    for dof in range(model.nv):
        mujoco.mj_mulM(model, data, columns[dof], np.eye(model.nv)[dof])
    return columns


@pytest.mark.parametrize("count", [5, 10, 20])
def test_joints_in_the_middles_bend_like_a_rod(count: int) -> None:
    model, data = at_rest(cantilever(count))
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, jacobian, None, model.site("tip").id)
    compliance = float(jacobian[2] @ (jacobian[2] / model.jnt_stiffness))
    error = compliance / (LENGTH_M**3 / (3 * EI_N_M2)) - 1
    assert error == pytest.approx(-1 / (4 * count**2), rel=0.01)


def test_first_frequency() -> None:
    model, data = at_rest(cantilever(10))
    eigenvalues = np.linalg.eigvals(np.linalg.solve(mass_matrix(model, data), np.diag(model.jnt_stiffness)))
    simulated = math.sqrt(min(eigenvalues.real))
    assert simulated / beam.first_bending_frequency(EI_N_M2, MASS_KG / LENGTH_M, LENGTH_M) == pytest.approx(
        1, abs=0.005
    )


@pytest.mark.parametrize("ratio", [0.05, 0.2])
def test_asked_damping_ratio_is_had(ratio: float) -> None:
    frequency = beam.first_bending_frequency(EI_N_M2, MASS_KG / LENGTH_M, LENGTH_M)
    model, data = at_rest(cantilever(10, damping_time_s=beam.stiffness_damping_time(ratio, frequency)))
    inverse = np.linalg.inv(mass_matrix(model, data))
    upper = np.hstack([np.zeros((10, 10)), np.eye(10)])
    lower = np.hstack([-inverse @ np.diag(model.jnt_stiffness), -inverse @ np.diag(model.dof_damping)])
    slowest = min(np.linalg.eigvals(np.vstack([upper, lower])), key=abs)
    assert -slowest.real / abs(slowest) == pytest.approx(ratio, rel=0.01)


def fastest_after_a_kick(mjcf: str) -> float:
    model, data = at_rest(mjcf)
    data.qpos[:] = 0.02 * np.where(np.random.default_rng(0).random(model.nv) < 0.5, -1, 1)
    fastest = 0.0
    for _ in range(1000):
        mujoco.mj_step(model, data)
        fastest = max(fastest, float(np.abs(data.qvel).max()))
        if fastest > 1e4:
            return math.inf
    return fastest


@pytest.mark.parametrize(("share", "stable"), [(0.95, True), (1.05, False)])
def test_largest_undamped_stiffness(share: float, stable: bool) -> None:
    limit = largest_undamped_stiffness(MASS_KG / 10, LENGTH_M / 10, 0.002)
    assert math.isfinite(fastest_after_a_kick(cantilever(10, stiffness=share * limit))) is stable


def test_half_a_time_step_of_damping_is_stable_at_any_stiffness() -> None:
    stiffness = 1000 * largest_undamped_stiffness(MASS_KG / 10, LENGTH_M / 10, 0.002)
    least = 0.002 / 2  # beta = c / k; source: linear stability of semi-implicit Euler, damping integrated implicitly
    assert fastest_after_a_kick(cantilever(10, stiffness=stiffness)) == math.inf
    assert math.isfinite(fastest_after_a_kick(cantilever(10, stiffness=stiffness, damping_time_s=1.05 * least)))


@pytest.mark.parametrize("angle", [-0.3, 0.0, 0.2, 0.5])
def test_moment_arm_of_a_straight_span(angle: float) -> None:
    model, data = at_rest(
        '<mujoco><compiler angle="radian"/><worldbody><site name="a" pos="0.018 0 -0.008"/>'
        '<body><joint name="bend" axis="0 1 0"/><geom size="0.001"/><site name="b" pos="0.018 0 0.008"/></body>'
        '</worldbody><tendon><spatial><site site="a"/><site site="b"/></spatial></tendon></mujoco>'
    )
    # Bending towards the cable is a positive turn about y, which brings +z to +x.
    data.qpos[0] = angle - 1e-5
    mujoco.mj_forward(model, data)
    before = float(data.ten_length[0])
    data.qpos[0] = angle + 1e-5
    mujoco.mj_forward(model, data)
    arm = (before - float(data.ten_length[0])) / 2e-5
    assert arm == pytest.approx(tendon_moment_arm(0.018, angle, 0.008), rel=1e-4)


def test_cable_bends_a_section_by_its_moment() -> None:
    assert beam.cable_bending(20.0, 0.012, 0.18, 0.03) == pytest.approx(20 * 0.012 * 0.18 / 0.03)


@pytest.mark.parametrize("time_constant_s", [0.02, 0.004])
def test_depth_of_a_soft_contact(time_constant_s: float) -> None:
    model, data = at_rest(
        f'<mujoco><option timestep="0.001" gravity="0 0 0"/><default><geom solref="{time_constant_s} 1"/></default>'
        '<worldbody><geom type="plane" size="1 1 1"/>'
        '<body pos="0 0 0.05"><joint type="slide" axis="0 0 1"/><geom size="0.05" mass="0.01"/>'
        "</body></worldbody></mujoco>"
    )
    data.qfrc_applied[0] = -20.0
    for _ in range(2000):
        mujoco.mj_step(model, data)
    assert -float(data.qpos[0]) == pytest.approx(contact_depth(20.0, 0.01, time_constant_s), rel=0.02)


def test_stiffness_of_a_joint_limit() -> None:
    model, data = at_rest(
        '<mujoco><compiler angle="radian"/><option timestep="0.001" gravity="0 0 0"/><worldbody><body>'
        '<joint axis="0 1 0" range="-1 0" limited="true"/>'
        '<inertial pos="0 0 0" mass="0.003" diaginertia="1e-6 1e-6 1e-6"/>'
        "</body></worldbody></mujoco>"
    )
    data.qfrc_applied[0] = 0.005
    for _ in range(2000):
        mujoco.mj_step(model, data)
    assert 0.005 / float(data.qpos[0]) == pytest.approx(limit_stiffness(1e-6, 0.02), rel=0.03)


def test_solref_is_the_stiffest_that_is_not_clamped() -> None:
    assert beam.solref(0.002) == (0.004, 1.0)


def test_rods() -> None:
    stiffness = beam.rod_stiffness(200e9, 0.0012)
    assert stiffness == pytest.approx(200e9 * math.pi / 64 * 0.0012**4)
    assert beam.rod_diameter(stiffness, 200e9) == pytest.approx(0.0012)


def test_tip_force_range() -> None:
    low, high = beam.tip_force_range(25.0, 0.0125, 0.36)
    assert (low, high) == (pytest.approx(1.04, abs=0.01), pytest.approx(1.74, abs=0.01))
