"""Scaling is similarity: the larger robot does the same, slower, and nothing about its material has changed."""

import mujoco
import numpy as np
import pytest

from aidsr.core.errors import MjcfError
from aidsr.sim.scaling import change_units, resize_robot, scale_robot
from aidsr.sim.unit_scaling import Units

ROBOT = """
<mujoco>
  <compiler angle="degree"/>
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/>
  <default>
    <joint stiffness="0.05" damping="0.002" armature="1e-5" frictionloss="1e-4" solreflimit="0.004 1"/>
    <geom density="1200" solref="0.004 1"/>
    <tendon width="0.001" damping="0.1"/>
    <default class="tip"><geom mass="0.004"/><joint range="-20 20" springref="5"/></default>
    <default class="shell"><geom shellinertia="true" density="2"/></default>
  </default>
  <worldbody>
    <geom name="wall" type="box" size="0.01 0.1 0.1" pos="0.075 0 0.1"/>
    <body name="base">
      <inertial pos="0 0 0.01" mass="0.05" diaginertia="1e-5 1e-5 1e-5"/>
      <site name="s0" pos="0.012 0 0.01"/>
      <body name="a" pos="0 0 0.02"><joint name="a"/><joint name="a2" axis="0 1 0" stiffness="0.04 0.01 0.02"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.05" size="0.006"/><site name="s1" pos="0.012 0 0.025"/>
        <body name="b" pos="0 0 0.05"><joint name="b" axis="0 1 0" damping="0.001 0.0005 0"/>
          <geom type="box" size="0.006 0.006 0.025" pos="0 0 0.025" class="shell"/>
          <geom name="pulley" type="cylinder" size="0.006 0.01" zaxis="0 1 0" mass="0" contype="0" conaffinity="0"/>
          <site name="side" pos="0.02 0 0"/><site name="s2" pos="0.012 0 0.03"/>
          <body name="c" pos="0 0 0.05" childclass="tip"><joint name="c" axis="0 1 0"/>
            <geom type="capsule" fromto="0 0 0 0 0 0.04" size="0.005"/><site name="s3" pos="0.012 0 0.03"/>
            <body name="d" pos="0 0 0.045">
              <joint name="d" type="slide" range="-0.005 0.01" stiffness="20" damping="0.1"/>
              <geom type="sphere" size="0.006"/>
              <body name="e" pos="0 0 0.01"><joint name="e" type="ball" range="0 30"/>
                <geom type="ellipsoid" size="0.004 0.005 0.012" pos="0 0 0.01"/><site name="s4" pos="0 0.004 0.01"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="flexor" stiffness="30" springlength="0.05 0.11" range="0.05 0.2">
      <site site="s0"/><site site="s1"/><geom geom="pulley" sidesite="side"/><site site="s2"/><site site="s3"/>
    </spatial>
    <spatial name="other" frictionloss="0.01"><site site="s0"/><site site="s2"/></spatial>
    <fixed name="sum" stiffness="0.01"><joint joint="a" coef="1"/><joint joint="a2" coef="-2"/></fixed>
  </tendon>
  <equality><joint joint1="c" joint2="b" polycoef="0 0.5 0.1 0 0" solref="0.01 1"/></equality>
  <actuator>
    <position name="servo" tendon="flexor" kp="200" kv="4" ctrlrange="0.02 0.2" forcerange="-6 0"/>
    <position name="critical" joint="d" kp="50" dampratio="1" ctrlrange="-0.01 0.01"/>
    <velocity name="rate" joint="a" kv="0.002" ctrlrange="-2 2"/>
    <motor name="pull" tendon="other" gear="-1" ctrlrange="0 2"/>
    <general name="winch" tendon="other" dyntype="filterexact" dynprm="0.02" gainprm="-3" biastype="affine"
      biasprm="-0.1 0 -0.2" ctrlrange="0 1"/>
    <intvelocity name="integral" joint="b" kp="0.05" actrange="-0.3 0.3" ctrlrange="-1 1"/>
    <muscle name="muscle" tendon="sum" force="0.02" lengthrange="-1 1" ctrlrange="0 1"/>
    <motor name="push" site="s4" gear="0.02 0 0.01 0 0.001 0" ctrlrange="-1 1"/>
    <motor name="twist" site="s4" gear="0 0 0 0 0.001 0" ctrlrange="-1 1"/>
  </actuator>
  <sensor>
    <touch site="s4" cutoff="3"/><jointpos joint="d" noise="0.001"/><tendonvel tendon="flexor" cutoff="2"/>
  </sensor>
</mujoco>
"""
FACTORS = (0.5, 0.8, 2.0)
COMMANDS = {
    "servo": (0.03, 0.1),
    "critical": (-0.005, 0.005),
    "rate": (-2, 2),
    "pull": (0, 2),
    "winch": (0, 1),
    "integral": (-1, 1),
    "muscle": (0, 1),
    "push": (-1, 1),
    "twist": (-1, 1),
}
CONTROL_AS_COORDINATE = {"servo": (1, 0), "critical": (1, 0), "rate": (0, -1), "integral": (0, -1)}
"""Powers of length and time in the input of the servos; the other inputs are pure numbers."""


def robot(factor: float = 1.0) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(ROBOT)
    scale_robot(spec, factor)
    return spec.compile()


def drive(model: mujoco.MjModel, units: Units, steps: int = 800) -> tuple[np.ndarray, np.ndarray, int]:
    """Return positions (steps, nq), tendon lengths (steps, ntendon) and the most contacts at any time."""
    data = mujoco.MjData(model)
    commands = np.random.default_rng(3).uniform(0.0, 1.0, (4, model.nu))
    positions, lengths, contacts = [], [], 0
    for step in range(steps):
        for (name, (low, high)), command in zip(COMMANDS.items(), commands[step * 4 // steps], strict=True):
            length, time = CONTROL_AS_COORDINATE.get(name, (0, 0))
            data.actuator(name).ctrl = (low + command * (high - low)) * units.of(length=length, time=time)
        mujoco.mj_step(model, data)
        positions.append(data.qpos.copy())
        lengths.append(data.ten_length.copy())
        contacts = max(contacts, data.ncon)
    return np.array(positions), np.array(lengths), contacts


@pytest.mark.parametrize("factor", FACTORS)
def test_the_scaled_robot_moves_alike_in_scaled_time(factor: float) -> None:
    small, large = robot(), robot(factor)
    assert large.opt.timestep == pytest.approx(factor * small.opt.timestep)
    positions, lengths, contacts = drive(small, Units(1, 1, 1))
    new_positions, new_lengths, _ = drive(large, Units.same_material(factor))
    new_positions[:, small.joint("d").qposadr] /= factor
    new_lengths[:, :2] /= factor
    assert np.ptp(positions[:, :4], axis=0).min() > 0.1, "the comparison needs a robot that moves"
    assert contacts > 0, "the comparison needs contact"
    # Collision detection has tolerances in metres: the only thing that tells the two apart.
    np.testing.assert_allclose(new_positions, positions, atol=2e-4)
    np.testing.assert_allclose(new_lengths, lengths, atol=2e-4)


@pytest.mark.parametrize("factor", FACTORS)
def test_mujoco_agrees_on_lengths_and_masses(factor: float) -> None:
    """MuJoCo can scale a frame's contents with time unscaled: an independent implementation of the same table."""
    framed = ROBOT.replace("<worldbody>", f'<worldbody><frame scale="{factor}">')
    framed = framed.replace("</worldbody>", "</frame></worldbody>")
    expected = mujoco.MjSpec.from_string(framed).compile()
    spec = mujoco.MjSpec.from_string(ROBOT)
    change_units(spec, Units(mass=factor**3, length=factor, time=1.0))
    model = spec.compile()
    model.site_size[:, 1:] = expected.site_size[:, 1:]  # spheres have one size; what stands behind it means nothing
    for field in physical_fields(model):
        np.testing.assert_allclose(
            getattr(model, field), getattr(expected, field), rtol=1e-6, atol=1e-12, err_msg=field
        )


@pytest.mark.parametrize("factor", FACTORS)
def test_there_and_back_is_the_identity(factor: float) -> None:
    spec = mujoco.MjSpec.from_string(ROBOT)
    scale_robot(spec, factor)
    scale_robot(spec, 1 / factor)
    model, expected = spec.compile(), robot()
    for field in physical_fields(model):
        np.testing.assert_allclose(
            getattr(model, field), getattr(expected, field), rtol=1e-9, atol=1e-15, err_msg=field
        )


def physical_fields(model: mujoco.MjModel) -> list[str]:
    fields = [name for name in dir(model) if not name.startswith(("_", "bvh", "tex", "mat", "light", "cam"))]
    fields = [name for name in fields if getattr(getattr(model, name), "dtype", None) == np.float64]
    assert len(fields) > 100
    return fields


@pytest.mark.parametrize("factor", FACTORS)
def test_the_rule_for_each_way_of_giving_mass(factor: float) -> None:
    """Density, mass=, shell density and explicit inertia, some of them from default classes, all s^3 and s^5."""
    small, large = robot(), robot(factor)
    np.testing.assert_allclose(large.body_mass, factor**3 * small.body_mass, rtol=1e-12)
    np.testing.assert_allclose(large.body_inertia, factor**5 * small.body_inertia, rtol=1e-12)
    assert small.body("c").mass[0] == pytest.approx(0.004)


@pytest.mark.parametrize("factor", FACTORS)
def test_values_from_default_classes_scale_once(factor: float) -> None:
    small, large = robot(), robot(factor)
    for name in "abce":
        assert large.joint(name).stiffness[0] == pytest.approx(factor**3 * small.joint(name).stiffness[0])
        assert large.joint(name).damping[0] == pytest.approx(factor**4 * small.joint(name).damping[0])
        assert large.joint(name).armature[0] == pytest.approx(factor**5 * 1e-5)
        assert large.joint(name).frictionloss[0] == pytest.approx(factor**3 * 1e-4)
    np.testing.assert_allclose(large.joint("c").range, np.deg2rad([-20, 20]))
    assert large.joint("d").stiffness[0] == pytest.approx(factor * 20)
    assert large.tendon_stiffness[large.tendon("flexor").id].flat[0] == pytest.approx(factor * 30)
    assert large.tendon_damping[large.tendon("flexor").id].flat[0] == pytest.approx(factor**2 * 0.1)
    assert large.tendon_width[large.tendon("flexor").id].flat[0] == pytest.approx(factor * 0.001)
    np.testing.assert_allclose(large.actuator("servo").forcerange, [-6 * factor**2, 0])
    np.testing.assert_allclose(large.actuator("servo").ctrlrange, [0.02 * factor, 0.2 * factor])
    np.testing.assert_allclose(large.actuator("pull").ctrlrange, [0, 2])
    assert large.actuator("pull").gainprm[0] == pytest.approx(factor**2)


def cantilever(factor: float) -> mujoco.MjModel:
    """Ten segments of 30 mm, 10 g each, 0.4 N m/rad, with one tendon 12 mm beside the backbone."""
    inner, sites = "", ""
    for i in reversed(range(10)):
        sites = f'<site site="p{i}"/><site site="q{i}"/>' + sites
        inner = f"""<body name="l{i}" pos="0 0 {0.03 if i else 0}"><joint name="j{i}" pos="0 0 0.015" axis="0 1 0"
          stiffness="0.4" damping="0.004"/><geom type="cylinder" fromto="0 0 0 0 0 0.03" size="0.01" mass="0.01"
          contype="0" conaffinity="0"/><site name="p{i}" pos="0.012 0 0.0075"/><site name="q{i}" pos="0.012 0 0.0225"/>
          {inner}</body>"""
    spec = mujoco.MjSpec.from_string(
        f"""<mujoco><option gravity="0 0 0" integrator="implicitfast"/><worldbody>{inner}</worldbody>
        <tendon><spatial name="t">{sites}</spatial></tendon>
        <actuator><motor tendon="t" gear="-1" ctrlrange="0 20"/></actuator></mujoco>"""
    )
    scale_robot(spec, factor)
    return spec.compile()


@pytest.mark.parametrize("factor", FACTORS)
def test_the_same_command_bends_to_the_same_shape(factor: float) -> None:
    shapes = {}
    for size in (1.0, factor):
        model = cantilever(size)
        data = mujoco.MjData(model)
        data.ctrl[0] = 8.0
        mujoco.mj_step(model, data, 2000)
        assert data.actuator_force[0] == pytest.approx(8.0 * size**2), "tendon force grows with the cross-section"
        shapes[size] = data.qpos.copy()
    assert shapes[1.0].sum() > 1.0
    np.testing.assert_allclose(shapes[factor], shapes[1.0], rtol=1e-5)


@pytest.mark.parametrize("factor", FACTORS)
def test_the_larger_robot_sags_more_under_the_same_gravity(factor: float) -> None:
    """Weight grows with s^3, its arm with s and bending stiffness with s^3: small angles grow with s."""
    sag = {}
    for size in (1.0, factor):
        model = cantilever(size)
        model.opt.gravity[:] = 0.1, 0, 0
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 4000)
        sag[size] = data.qpos.sum()
    assert sag[factor] == pytest.approx(factor * sag[1.0], rel=0.01)


@pytest.mark.parametrize("factor", FACTORS)
def test_frequencies_fall_as_the_robot_grows_and_damping_ratios_stay(factor: float) -> None:
    def modes(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        squared, shapes = np.linalg.eig(
            np.linalg.solve(inertia, np.diag(model.jnt_stiffness.reshape(model.njnt, -1)[:, 0]))
        )
        order = np.argsort(squared.real)
        shapes = shapes[:, order].real
        omega = np.sqrt(squared.real[order])
        damping = np.einsum("ik,i,ik->k", shapes, model.dof_damping.reshape(model.nv, -1)[:, 0], shapes)
        return omega, damping / (2 * omega * np.einsum("ik,ij,jk->k", shapes, inertia, shapes))

    omega, ratio = modes(cantilever(1.0))
    scaled_omega, scaled_ratio = modes(cantilever(factor))
    np.testing.assert_allclose(scaled_omega, omega / factor, rtol=1e-9)
    np.testing.assert_allclose(scaled_ratio, ratio, rtol=1e-6)


@pytest.mark.parametrize(
    ("part", "named"),
    [
        ('<actuator><dcmotor name="electric" joint="a" motorconst="0.1" resistance="1"/></actuator>', "electric"),
        (
            '<tendon><fixed name="mixed"><joint joint="a" coef="1"/><joint joint="s" coef="1"/></fixed></tendon>',
            "mixed",
        ),
    ],
)
def test_what_has_no_rule_is_refused_by_name(part: str, named: str) -> None:
    spec = mujoco.MjSpec.from_string(
        f"""<mujoco><worldbody><body><joint name="a"/><joint name="s" type="slide"/><geom size="0.01"/></body>
        </worldbody>{part}</mujoco>"""
    )
    with pytest.raises(MjcfError, match=named) as caught:
        scale_robot(spec, 2.0)
    assert "scale 1" in caught.value.faults[0].cure


def test_a_text_is_scaled_as_its_model_is() -> None:
    text = """<mujoco><default><joint range="-30 30" stiffness="0.2"/><geom size="0.01"/></default><worldbody>
    <body name="base"><geom type="sphere" mass="0.1"/><body name="link" pos="0 0 0.05"><joint name="bend" axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 0 0 0.05"/></body></body></worldbody></mujoco>"""
    spec = mujoco.MjSpec.from_string(text)
    scale_robot(spec, 1.5)
    asked, found = spec.compile(), mujoco.MjModel.from_xml_string(resize_robot(text, 1.5))
    for name in ("jnt_range", "jnt_stiffness", "geom_size", "body_pos", "body_mass", "body_inertia"):
        assert getattr(found, name) == pytest.approx(getattr(asked, name), rel=1e-4, abs=1e-9), name
    assert found.opt.timestep == pytest.approx(asked.opt.timestep)
