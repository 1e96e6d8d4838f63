"""A robot in a scene is the robot that was written: same bodies, same physics, other surroundings."""

from collections.abc import Sequence

import mujoco
import numpy as np
import pytest

from aidsr.core.artifacts import Placement, Robot, Scene
from aidsr.core.errors import MjcfError
from aidsr.mjcf.read import read_mjcf
from aidsr.sim.assembly import add_sensors, assemble
from aidsr.sim.functional_part import FUNCTIONAL_SITE
from aidsr.sim.task_sensors import TaskSensor, check_task_sensors

STAGE = """
<mujoco model="stage">
  <compiler angle="radian" autolimits="false"/>
  <option timestep="0.002" integrator="implicitfast" gravity="0 0 -9.81"/>
  <default>
    <geom priority="1" friction="0.9" solref="0.004 1"/>
    <joint damping="3" stiffness="2" armature="0.1"/>
    <site size="0.03" group="4"/>
    <tendon damping="7" frictionloss="0.2"/>
    <general ctrllimited="true" ctrlrange="-9 9" forcelimited="true" forcerange="-1 1"/>
    <default class="pad"><geom rgba="1 0 0 1"/></default>
  </default>
  <asset><material name="skin" rgba="0 0 1 1"/></asset>
  <worldbody>
    <light pos="0 0 2"/>
    <geom name="floor" type="plane" size="1 1 0.1" material="skin"/>
    <site name="mount_floor" pos="0.5 0 0"/>
    <body name="carriage" pos="0 0 0.6" euler="0 0 0.5">
      <joint name="lift" type="slide" axis="0 0 1" range="-0.3 0.3" limited="true"/>
      <geom name="plate" type="box" size="0.05 0.05 0.01" class="pad"/>
      <site name="mount" pos="0.02 0 -0.01" zaxis="0 0 -1"/>
    </body>
    <body name="pedestal" pos="-0.5 0 0.1"><geom name="pedestal" type="box" size="0.05 0.05 0.1"/>
      <site name="mount_pedestal" pos="0 0 0.1"/></body>
    <body name="object" pos="0.3 0 0.03"><freejoint name="object"/><geom name="object" size="0.03"/>
      <site name="object"/></body>
  </worldbody>
  <actuator><position name="lift" joint="lift" kp="400" ctrlrange="-0.3 0.3"/></actuator>
  <sensor><jointpos name="lift" joint="lift"/></sensor>
  <keyframe><key name="up" qpos="0.2 0.3 0 0.03 1 0 0 0" ctrl="0.2"/></keyframe>
</mujoco>
"""

FOOT = '<pair name="foot" geom1="floor" geom2="seg3"/>'
ARM = f"""
<mujoco model="arm">
  <compiler angle="degree" autolimits="true" eulerseq="zyx"/>
  <option timestep="0.001" integrator="RK4" gravity="0 0 -1"><flag contact="disable"/></option>
  <visual><global offwidth="1000"/></visual>
  <default>
    <joint damping="0.01" stiffness="0.1" armature="1e-5" axis="1 0 0"/>
    <geom rgba="0 1 0 1" friction="0.4" priority="2"/>
    <tendon width="0.002"/>
    <default class="pad"><geom size="0.01"/><joint range="-30 30" springref="4"/></default>
    <default class="unused"><geom material="skin"/><material texture="grid"/></default>
  </default>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="0 0 0" rgb2="1 1 1" width="32" height="32"/>
    <texture name="grid" type="2d" builtin="checker" rgb1="0 0 0" rgb2="1 1 1" width="32" height="32"/>
    <material name="grid" texture="grid"/><material name="skin" rgba="1 1 0 1"/>
  </asset>
  <worldbody>
    <light name="lamp" pos="0 0 3"/><geom name="floor" type="plane" size="1 1 0.1" material="grid"/>
    <body name="base" pos="0 0 0.3" euler="30 0 10" childclass="pad">
      <geom name="base" type="capsule" fromto="0 0 0 0 0 0.05" material="skin"/><site name="lift" pos="0.01 0 0.02"/>
      <body name="seg1" pos="0 0 0.05"><joint name="lift"/>
        <geom name="seg1" type="capsule" fromto="0 0 0 0 0 0.05" mass="0.02"/><site name="s1" pos="0.01 0 0.02"/>
        <body name="seg2" pos="0 0 0.05"><joint name="j2" range="-20 40" axis="0 1 0"/>
          <geom name="seg2" type="capsule" fromto="0 0 0 0 0 0.05"/><site name="side" pos="0.03 0 0"/>
          <geom name="wrap" type="cylinder" size="0.005 0.01" zaxis="0 1 0" mass="0" contype="0" conaffinity="0"/>
          <site name="s2" pos="0.01 0 0.03"/>
          <body name="seg3" pos="0 0 0.05">
            <joint name="j3" type="slide" range="-0.01 0.01" stiffness="50" axis="0 0 1"/>
            <geom name="seg3" type="box" size="0.008 0.006 0.02" pos="0 0 0.02" euler="10 20 30"/>
            <site name="tip" pos="0 0 0.045" euler="0 90 0"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <contact>
    <exclude name="e" body1="seg1" body2="seg3"/><pair name="p" geom1="seg1" geom2="seg3" friction="0.1 0.1 0 0 0"/>
    {FOOT}
  </contact>
  <tendon>
    <spatial name="flexor" springlength="0.02" stiffness="10" range="0 0.2">
      <site site="lift"/><site site="s1"/><geom geom="wrap" sidesite="side"/><site site="s2"/>
    </spatial>
    <fixed name="sum"><joint joint="lift" coef="1"/><joint joint="j2" coef="-2"/></fixed>
  </tendon>
  <equality><joint name="couple" joint1="j2" joint2="lift" polycoef="0 0.5 0 0 0"/></equality>
  <actuator>
    <position name="lift" tendon="flexor" kp="100" kv="2" ctrlrange="0 0.2" forcerange="-8 0"/>
    <motor name="twist" joint="lift" ctrlrange="-1 1"/><position name="damped" joint="j2" kp="2" dampratio="1"/>
    <muscle name="muscle" tendon="sum" lengthrange="-1 1"/>
  </actuator>
  <sensor><tendonpos name="lift" tendon="flexor"/><framepos name="tip" objtype="site" objname="tip"/></sensor>
  <keyframe><key name="home" qpos="0.1 0.2 0"/></keyframe>
</mujoco>
"""

CRAWLER = """
<mujoco model="crawler">
  <worldbody>
    <geom name="ground" type="box" size="2 2 0.1" pos="0 0 -0.1"/><geom name="rock" size="0.1" pos="1 0 0"/>
    <body name="head" pos="0 0 0.02" euler="0 90 0"><freejoint name="float"/>
      <geom name="head" type="capsule" size="0.02" fromto="0 0 0 0 0 0.08"/>
      <body name="tail" pos="0 0 0.1"><joint name="bend" axis="0 1 0" stiffness="0.2" damping="0.01"/>
        <geom name="tail" type="capsule" size="0.02" fromto="0 0 0 0 0 0.08"/>
      </body>
    </body>
  </worldbody>
  <sensor><framepos name="head" objtype="body" objname="head"/><jointpos name="bend" joint="bend"/></sensor>
</mujoco>
"""

HAND = """
<mujoco model="hand">
  <worldbody>
    <geom name="palm" type="cylinder" size="0.03 0.005" mass="0.1"/><site name="anchor" pos="0.01 0 0"/>
    <body name="left" pos="0.02 0 0.01"><joint name="left" axis="0 1 0"/>
      <geom name="left" type="capsule" size="0.005" fromto="0 0 0 0 0 0.05"/><site name="left" pos="0 0 0.04"/></body>
    <body name="right" pos="-0.02 0 0.01"><joint name="right" axis="0 1 0"/>
      <geom name="right" type="capsule" size="0.005" fromto="0 0 0 0 0 0.05"/></body>
  </worldbody>
  <tendon><spatial name="close"><site site="anchor"/><site site="left"/></spatial></tendon>
</mujoco>
"""


def scene(
    robot: str,
    placement: Placement,
    *,
    part: str = "",
    environment: str = STAGE,
    sensors: Sequence[TaskSensor] = (),
) -> tuple[Scene, mujoco.MjModel]:
    """Assemble, and load what was written."""
    result = assemble(Robot(mjcf=robot, functional_part=part), environment, placement, sensors)
    return result, mujoco.MjModel.from_xml_string(read_mjcf(result.mjcf).text)


def pose(model: mujoco.MjModel, kind: str, name: str) -> tuple[np.ndarray, np.ndarray]:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = getattr(data, kind)(name)
    return found.xpos.copy(), found.xmat.reshape(3, 3).copy()


COUNTS = {"body": "nbody", "jnt": "njnt", "geom": "ngeom", "site": "nsite", "tendon": "ntendon", "actuator": "nu"}
VIEWS = {"body": "body", "jnt": "joint", "geom": "geom", "site": "site", "tendon": "tendon", "actuator": "actuator"}
ADDRESSES = ("adr", "num", "id", "_plugin", "_user", "treeid", "matid", "plugin", "bvh", "dataid")
NOT_THE_ROBOTS = {
    "geom_solref",
    "geom_priority",
    "body_subtreemass",
    "body_invweight0",
    "tendon_invweight0",
    "tendon_width",
    "actuator_acc0",
}
"""What an environment decides, what depends on what the robot stands on, and the width a fixed tendon does not have."""


def assert_same_robot(alone: mujoco.MjModel, inside: mujoco.MjModel, roots: Sequence[str]) -> None:
    """Compare every physical array of the robot's named elements in the two models."""
    compared = 0
    for kind, count in COUNTS.items():
        names = [getattr(alone, VIEWS[kind])(i).name for i in range(getattr(alone, count))]
        pairs = [
            (i, getattr(inside, VIEWS[kind])(f"robot/{name}").id) for i, name in enumerate(names) if name != "world"
        ]
        if not pairs:
            continue
        here, there = (np.array(column) for column in zip(*pairs, strict=True))
        for field in dir(alone):
            value = getattr(alone, field)
            if not field.startswith(f"{kind}_") or not isinstance(value, np.ndarray) or field in NOT_THE_ROBOTS:
                continue
            if field.endswith(ADDRESSES) or len(value) != getattr(alone, count):
                continue
            mine, theirs = value[here], getattr(inside, field)[there]
            if field in ("body_pos", "body_quat"):
                keep = [names[i] not in roots for i in here]
                mine, theirs = mine[keep], theirs[keep]
            if field.endswith("quat"):
                theirs = theirs * np.sign(np.sum(mine * theirs, axis=-1, keepdims=True))
            np.testing.assert_allclose(theirs, mine, rtol=2e-5, atol=2e-6, err_msg=field)
            compared += 1
    assert compared > 40


def alone(robot: str) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(robot.replace(FOOT, ""))
    for geom in spec.worldbody.geoms:
        spec.delete(geom)
    return spec.compile()


@pytest.mark.parametrize("mount", ["mount", "mount_floor", "mount_pedestal", "world"])
def test_an_arm_is_the_same_arm_wherever_it_is_mounted(mount: str) -> None:
    """Degrees among radians, classes and names that clash, wrapping tendons, couplings, muscles and damping ratios."""
    _, model = scene(ARM, Placement(mount=mount, base="fixed"), part="tip")
    assert_same_robot(alone(ARM), model, ["base"])
    np.testing.assert_allclose(model.joint("robot/lift").range, np.deg2rad([-30, 30]), rtol=1e-5)
    np.testing.assert_allclose(model.joint("lift").range, [-0.3, 0.3])


def test_the_environment_is_the_same_environment() -> None:
    _, model = scene(ARM, Placement(mount="mount", base="fixed"), part="tip")
    before = mujoco.MjModel.from_xml_string(STAGE)
    for name in ("lift", "object"):
        assert model.dof_damping[model.joint(name).dofadr[0]] == before.dof_damping[before.joint(name).dofadr[0]]
    np.testing.assert_array_equal(model.geom("object").friction, before.geom("object").friction)
    np.testing.assert_array_equal(model.geom("plate").rgba, [1, 0, 0, 1])
    np.testing.assert_array_equal(model.actuator("lift").ctrlrange, before.actuator("lift").ctrlrange)
    assert (model.opt.integrator, model.opt.disableflags) == (before.opt.integrator, before.opt.disableflags)
    np.testing.assert_array_equal(model.opt.gravity, before.opt.gravity)
    assert model.key("up").qpos[model.joint("lift").qposadr[0]] == 0.2
    assert model.nkey == 1


def test_the_environments_actuators_and_sensors_come_first() -> None:
    _, model = scene(
        ARM, Placement(mount="mount", base="fixed"), sensors=[TaskSensor(name="c", quantity="center_of_mass")]
    )
    assert [model.actuator(i).name for i in range(3)] == ["lift", "robot/lift", "robot/twist"]
    assert [model.sensor(i).name for i in range(model.nsensor)] == ["lift", "robot/lift", "robot/tip", "c"]


def test_a_robot_moves_in_a_scene_as_it_does_alone() -> None:
    empty = '<mujoco><option timestep="0.001" integrator="implicitfast" gravity="0 0 -3"/></mujoco>'
    _, model = scene(ARM, Placement(mount="world", base="fixed"), environment=empty)
    spec = mujoco.MjSpec.from_string(ARM)
    spec.option.integrator, spec.option.gravity[2] = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, -3
    own = spec.compile()
    assert model.opt.timestep == own.opt.timestep == 0.001
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    first, second = mujoco.MjData(own), mujoco.MjData(model)
    for step in range(600):
        for actuator in range(own.nu):
            first.ctrl[actuator] = second.ctrl[actuator] = 0.05 * np.sin(0.01 * step + actuator)
        mujoco.mj_step(own, first)
        mujoco.mj_step(model, second)
    assert np.ptp(first.qpos) > 0.05
    np.testing.assert_allclose(second.qpos, first.qpos, atol=1e-4)
    np.testing.assert_allclose(second.sensor("robot/lift").data, first.sensor("lift").data, atol=1e-5)


def test_scenery_of_the_robot_is_removed_and_said() -> None:
    made, model = scene(ARM, Placement(mount="mount", base="fixed"))
    names = [model.geom(i).name for i in range(model.ngeom)]
    assert "robot/floor" not in names
    assert (model.nlight, model.ntex, model.nmat) == (1, 0, 2)
    assert [model.pair(i).name for i in range(model.npair)] == ["robot/p"], "the environment has a floor as well"
    for words in ("floor", "light", "keyframe", "option", "contact pair"):
        assert any(words in note for note in made.notes), made.notes


def test_contacts_that_a_robot_excludes_with_its_own_world_are_no_matter_of_the_environments() -> None:
    robot = ARM.replace("<contact>", '<contact><exclude body1="world" body2="seg2"/>')
    _, model = scene(robot, Placement(mount="mount", base="fixed"))
    pairs = {(int(signature) >> 16, int(signature) & 0xFFFF) for signature in model.exclude_signature}
    assert not any(0 in pair for pair in pairs)


def test_bodies_of_an_environment_that_asks_to_fuse_them_can_be_named() -> None:
    fused = STAGE.replace("<compiler", '<compiler fusestatic="true"')
    _, model = scene(ARM, Placement(mount="mount", base="fixed", intended_contacts=("pedestal",)), environment=fused)
    assert model.body("pedestal").parentid[0] == 0


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [('name="carriage"', 'name="robot/base"', "placed here, found robot/base"), ('"0.002"', '"0"', "found 0 s")],
)
def test_an_environment_in_which_no_robot_can_be_placed_is_a_fault(old: str, new: str, found: str) -> None:
    with pytest.raises(MjcfError, match=found):
        scene(ARM, Placement(mount="mount", base="fixed"), environment=STAGE.replace(old, new))


def test_a_placement_is_a_pose_in_the_mounts_frame() -> None:
    placement = Placement(mount="mount", base="fixed", position_m=(0.01, 0.02, 0.03), rotation_deg=(90, 90, 0))
    stage = mujoco.MjModel.from_xml_string(STAGE)
    _, model = scene(ARM.replace('euler="30 0 10"', ""), placement)
    mount_position, mount_axes = pose(stage, "site", "mount")
    position, axes = pose(model, "body", "robot/base")
    np.testing.assert_allclose(position, mount_position + mount_axes @ [0.01, 0.02, 0.03], atol=1e-6)
    # About x first, then about the new y: x goes to -z and thence to y, as seen from the mount.
    np.testing.assert_allclose(mount_axes.T @ axes[:, 0], [0, 1, 0], atol=1e-6)
    np.testing.assert_allclose(mount_axes.T @ axes[:, 1], [0, 0, 1], atol=1e-6)


def test_a_robot_on_a_moving_body_moves_with_it() -> None:
    _, model = scene(ARM, Placement(mount="mount", base="fixed"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    before = data.body("robot/base").xpos.copy()
    data.joint("lift").qpos[0] = 0.1
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.body("robot/base").xpos - before, [0, 0, 0.1], atol=1e-9)


@pytest.mark.parametrize("mount", ["mount", "mount_floor"])
def test_a_free_robot_stands_in_the_world_at_the_mount(mount: str) -> None:
    made, model = scene(ARM, Placement(mount=mount, base="free", position_m=(0, 0, 0.1)))
    assert model.body("robot/base").parentid[0] == 0
    assert model.jnt_type[model.body("robot/base").jntadr[0]] == mujoco.mjtJoint.mjJNT_FREE
    assert any("added a free joint" in note for note in made.notes)
    stage = mujoco.MjModel.from_xml_string(STAGE)
    mount_position, mount_axes = pose(stage, "site", mount)
    position, _ = pose(model, "body", "robot/base")
    np.testing.assert_allclose(position, mount_position + 0.1 * mount_axes[:, 2], atol=1e-6)


def test_a_free_robot_stays_free_and_loses_the_things_beside_it() -> None:
    made, model = scene(CRAWLER, Placement(mount="mount_floor", base="free", position_m=(0, 0, 0.03)))
    assert model.joint("robot/float").type == mujoco.mjtJoint.mjJNT_FREE
    position, axes = pose(model, "body", "robot/head")
    np.testing.assert_allclose(position, [0.5, 0, 0.03], atol=1e-9)
    np.testing.assert_allclose(axes[:, 2], [1, 0, 0], atol=1e-6)  # it lies as it was written
    assert {model.geom(i).name for i in range(model.ngeom)} & {"robot/ground", "robot/rock"} == set()
    assert sum("ground" in note or "rock" in note for note in made.notes) == 2
    assert_same_robot(alone(CRAWLER), model, ["head"])


def test_a_free_robot_can_be_fixed() -> None:
    made, model = scene(CRAWLER, Placement(mount="mount_pedestal", base="fixed"))
    assert model.body("robot/head").dofnum[0] == 0
    assert model.body("robot/head").weldid[0] == 0
    assert any("removed its free joint" in note for note in made.notes)
    # What measured the joint is gone, what measures the body is not.
    assert model.sensor("robot/head").id >= 0


@pytest.mark.parametrize("base", ["fixed", "free"])
def test_several_roots_and_a_palm_in_the_world_get_one_carrier(base: str) -> None:
    made, model = scene(HAND, Placement(mount="mount", base=base))
    root = model.body("robot/root")
    assert model.geom("robot/palm").bodyid == root.id
    assert model.body("robot/left").parentid == model.body("robot/right").parentid == root.id
    assert bool(root.dofnum[0]) == (base == "free")
    assert any("robot/root" in note for note in made.notes)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ten_length[0] == pytest.approx(np.linalg.norm([0.01, 0, 0.05]), rel=1e-5)


def test_a_part_written_into_the_world_can_be_functional() -> None:
    _, model = scene(HAND, Placement(mount="mount", base="free"), part="palm")
    assert model.body(model.site(FUNCTIONAL_SITE).bodyid[0]).name == "robot/root"


def test_a_floor_inside_the_robot_and_a_tether_are_scenery_too() -> None:
    tethered = CRAWLER.replace(
        "<worldbody>",
        """<worldbody><site name="hook" pos="0 0 1"/><site name="goal"/>
      <body name="ground_body"><geom type="plane" size="1 1 1"/></body>""",
    )
    tethered = tethered.replace(
        "<sensor>",
        """<tendon><spatial name="tether"><site site="hook"/><site site="eye"/></spatial>
      </tendon><actuator><motor name="pull" tendon="tether"/></actuator><sensor><tendonpos tendon="tether"/>""",
    )
    tethered = tethered.replace('<freejoint name="float"/>', '<freejoint name="float"/><site name="eye"/>')
    made, model = scene(tethered, Placement(mount="mount_floor", base="free"))
    assert (model.ntendon, model.nu) == (0, 1)
    assert [model.sensor(i).name for i in range(model.nsensor)] == ["lift", "robot/head", "robot/bend"]
    for words in ("ground_body", "hook", "tether", "pull"):
        assert any(words in note for note in made.notes), made.notes


@pytest.mark.parametrize("pin", ['<weld body1="head" body2="world"/>', '<connect body1="head" anchor="0 0 0"/>'])
def test_a_robot_is_not_pinned_to_its_own_world(pin: str) -> None:
    pinned = CRAWLER.replace("<sensor>", f"<equality>{pin}<weld body1='head' body2='tail'/></equality><sensor>")
    made, model = scene(pinned, Placement(mount="mount_floor", base="free"))
    assert model.neq == 1
    assert any("equality with the world" in note for note in made.notes)


def test_a_mount_on_a_body_without_a_name() -> None:
    nameless = STAGE.replace('<body name="pedestal"', "<body")
    _, model = scene(ARM, Placement(mount="mount_pedestal", base="fixed"), environment=nameless)
    np.testing.assert_allclose(pose(model, "body", "robot/base")[0], [-0.5, 0, 0.2], atol=1e-6)


def test_parts_that_hang_on_nothing_are_refused() -> None:
    loose = CRAWLER.replace("</worldbody>", '<body name="other"><freejoint/><geom size="0.01"/></body></worldbody>')
    with pytest.raises(MjcfError) as caught:
        scene(loose, Placement(mount="mount_floor", base="free"))
    assert [fault.code for fault in caught.value.faults] == ["disconnected"]
    assert caught.value.faults[0].names == ("head", "other")


def test_a_root_with_joints_of_its_own_cannot_be_free() -> None:
    hinged = '<mujoco><worldbody><body name="a"><joint name="h"/><geom size="0.1"/></body></worldbody></mujoco>'
    with pytest.raises(MjcfError) as caught:
        scene(hinged, Placement(mount="mount", base="free"))
    assert [fault.code for fault in caught.value.faults] == ["invalid_joint_placement"]
    assert caught.value.faults[0].names == ("a", "h")


def test_wrong_names_are_reported_together_with_what_exists() -> None:
    placement = Placement(mount="roof", base="fixed", functional_part="finger9", intended_contacts=("object", "ball"))
    with pytest.raises(MjcfError) as caught:
        scene(ARM, placement, sensors=[TaskSensor(name="d", quantity="distance", target="wall")])
    faults = {fault.names[0]: fault for fault in caught.value.faults}
    assert {fault.code for fault in faults.values()} == {"undefined_reference"}
    assert set(faults) == {"roof", "finger9", "ball", "wall"}
    assert "mount_pedestal" in faults["roof"].cure
    assert "world" in faults["roof"].cure
    assert "seg3" in faults["finger9"].cure
    assert "carriage" in faults["ball"].cure


@pytest.mark.parametrize("part", ["tip", "robot/tip"])
def test_a_functional_site_is_marked_with_its_frame(part: str) -> None:
    _, model = scene(ARM, Placement(mount="mount", base="fixed", functional_part=part), part="seg1")
    for mine, expected in zip(pose(model, "site", FUNCTIONAL_SITE), pose(model, "site", "robot/tip"), strict=True):
        np.testing.assert_allclose(mine, expected, atol=1e-5)


@pytest.mark.parametrize(
    ("part", "tip"),
    [
        ("seg1", (0, 0, 0.06)),  # end of the capsule, cap included
        ("base", (0, 0, 0.06)),
        ("left", (0, 0, 0.055)),
    ],
)
def test_a_body_works_with_its_distal_tip(part: str, tip: tuple[float, float, float]) -> None:
    _, model = scene(HAND if part == "left" else ARM, Placement(mount="mount", base="fixed"), part=part)
    np.testing.assert_allclose(model.site(FUNCTIONAL_SITE).pos, tip, atol=1e-5)
    assert model.body(model.site(FUNCTIONAL_SITE).bodyid[0]).name == f"robot/{part}"


def test_a_geom_works_with_its_far_end() -> None:
    _, model = scene(CRAWLER, Placement(mount="mount_floor", base="free"), part="tail")
    np.testing.assert_allclose(model.site(FUNCTIONAL_SITE).pos, [0, 0, 0.1], atol=1e-6)


def test_scale_scales_the_robot_and_nothing_else() -> None:
    made, model = scene(ARM, Placement(mount="mount", base="fixed", scale=0.5))
    _, plain = scene(ARM, Placement(mount="mount", base="fixed"))
    assert model.body("robot/seg1").mass[0] == pytest.approx(plain.body("robot/seg1").mass[0] / 8, rel=1e-4)
    assert model.geom("robot/seg1").size[0] == pytest.approx(0.005)
    assert model.joint("robot/j2").stiffness[0] == pytest.approx(0.1 / 8)
    np.testing.assert_array_equal(model.geom("plate").size, plain.geom("plate").size)
    assert any("Scaled" in note for note in made.notes)


@pytest.mark.parametrize(
    ("robot_s", "scale", "expected_s"),
    [
        (None, 1.0, 0.002),
        (0.001, 1.0, 0.001),
        (0.0015, 1.0, 0.001),
        (0.01, 1.0, 0.002),
        (None, 0.9, 0.002),
        (None, 0.5, 0.001),
        (0.001, 2.0, 0.002),
    ],
)
def test_the_smaller_timestep_is_honoured(robot_s: float | None, scale: float, expected_s: float) -> None:
    """As a whole fraction of the environment's, so that control periods stay what they are."""
    option = f'<option timestep="{robot_s}"/>' if robot_s else ""
    made, model = scene(
        CRAWLER.replace("<worldbody>", option + "<worldbody>", 1), Placement(mount="world", base="free", scale=scale)
    )
    assert model.opt.timestep == pytest.approx(expected_s)
    assert any("timestep" in note for note in made.notes) == (expected_s != 0.002)


def test_masses_that_compiler_settings_decide_survive() -> None:
    heavy = ARM.replace("<compiler ", '<compiler boundmass="0.03" inertiagrouprange="0 3" ', 1)
    _, model = scene(heavy, Placement(mount="mount", base="fixed"))
    own = mujoco.MjModel.from_xml_string(heavy)
    assert own.body("seg1").mass[0] == 0.03
    for name in ("base", "seg1", "seg2", "seg3"):
        np.testing.assert_allclose(model.body(f"robot/{name}").mass, own.body(name).mass, rtol=1e-5)
        np.testing.assert_allclose(model.body(f"robot/{name}").inertia, own.body(name).inertia, rtol=1e-4)
    assert model.body("carriage").mass[0] == pytest.approx(0.1 * 0.1 * 0.02 * 1000, rel=1e-5)


def test_settings_that_leave_geoms_out_of_the_mass_leave_them_out() -> None:
    grouped = CRAWLER.replace("<worldbody>", '<compiler inertiagrouprange="0 1"/><worldbody>', 1)
    grouped = grouped.replace("</body>", '<body><geom size="0.05" group="3"/></body></body>', 1)
    _, model = scene(grouped, Placement(mount="mount_floor", base="free"))
    own = mujoco.MjModel.from_xml_string(grouped)
    assert model.body("robot/head").subtreemass[0] == pytest.approx(own.body("head").subtreemass[0], rel=1e-5)


def test_parts_without_names_can_be_used() -> None:
    nameless = """<mujoco><worldbody><body mocap="true"><geom size="0.02"/><body pos="0 0 0.02"><joint/>
      <geom type="capsule" size="0.01" fromto="0 0 0 0 0 0.1"/><site name="end" pos="0 0 0.1"/></body></body>
      </worldbody></mujoco>"""
    _, model = scene(nameless, Placement(mount="mount", base="fixed"), part="end")
    bodies = [model.body(i).name for i in range(model.nbody)]
    assert sum(name.startswith("robot/") for name in bodies) == 2
    assert model.nexclude == 2
    assert model.nmocap == 0


def test_what_mujoco_refuses_in_the_scene_is_a_fault() -> None:
    massless = """<mujoco><worldbody><body name="a"><body name="b"><joint/><geom size="0.1"/></body></body></worldbody>
      </mujoco>"""
    with pytest.raises(MjcfError, match="mass") as caught:
        scene(massless, Placement(mount="mount", base="free"))
    assert caught.value.faults[0].code == "load_error"


def test_the_environment_decides_on_contact_with_it() -> None:
    _, model = scene(ARM, Placement(mount="mount", base="fixed"))
    assert model.geom("robot/seg1").priority[0] < model.geom("floor").priority[0]
    np.testing.assert_allclose(model.geom("robot/seg1").solref, [2 * model.opt.timestep, 1])
    assert model.geom("robot/seg1").friction[0] == 0.4  # among its own parts the robot's friction holds
    plain = STAGE.replace('priority="1"', "")
    _, model = scene(ARM, Placement(mount="mount", base="fixed"), environment=plain)
    assert model.geom("robot/seg1").priority[0] < model.geom("floor").priority[0] == 0


BURIED = """
<mujoco><worldbody><body name="base"><geom name="base" type="cylinder" size="0.02 0.004"/>
  <body name="gimbal"><joint name="x" axis="1 0 0"/><inertial pos="0 0 0" mass="0.001" diaginertia="1e-6 1e-6 1e-6"/>
    <body name="first"><joint name="y" axis="0 1 0"/>
      <geom name="first" type="capsule" size="0.01" fromto="0 0 0 0 0 0.1"/>
      <body name="second" pos="0 0 0.1"><joint name="z" axis="0 1 0"/>
        <geom name="second" type="capsule" size="0.01" fromto="0 0 0 0 0 0.1"/></body>
    </body></body></body></worldbody></mujoco>
"""


@pytest.mark.parametrize("mount", ["mount", "mount_floor", "mount_pedestal"])
def test_the_first_moving_part_does_not_collide_with_what_holds_it(mount: str) -> None:
    """Not with the robot's base, not with the mount, across a gimbal, whether the mount moves or not."""
    _, model = scene(BURIED, Placement(mount=mount, base="fixed"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    robot = {model.geom(i).id for i in range(model.ngeom) if model.geom(i).name.startswith("robot/")}
    assert not any(robot & set(contact.geom) for contact in data.contact[: data.ncon])
    # The second part has no business being in the floor, and is not excused.
    data.joint("robot/y").qpos[0] = np.pi / 2
    data.joint("robot/z").qpos[0] = 0.2
    mujoco.mj_forward(model, data)
    touched = any(model.geom("robot/second").id in contact.geom for contact in data.contact[: data.ncon])
    assert touched == (mount == "mount_floor")


def test_contact_with_the_world_is_kept_where_nothing_touches_at_the_start() -> None:
    _, model = scene(BURIED, Placement(mount="mount_floor", base="fixed", position_m=(0, 0, 0.3)))
    bodies = {model.body(name).id for name in ("world", "robot/first")}
    signatures = {(signature >> 16, signature & 0xFFFF) for signature in model.exclude_signature}
    assert not any(set(pair) == bodies for pair in signatures)
    assert model.nexclude == 1


def sensor_reading(model: mujoco.MjModel, name: str, steps: int = 0) -> np.ndarray:
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, steps)
    mujoco.mj_forward(model, data)
    return data.sensor(name).data.copy()


def test_task_sensors_measure_what_they_say() -> None:
    sensors = [
        TaskSensor(name="at", quantity="position"),
        TaskSensor(name="seen", quantity="position", target="object"),
        TaskSensor(name="turned", quantity="quaternion", target="carriage"),
        TaskSensor(name="speed", quantity="linear_velocity"),
        TaskSensor(name="spin", quantity="angular_velocity", target="carriage"),
        TaskSensor(name="com", quantity="center_of_mass"),
        TaskSensor(name="com_speed", quantity="center_of_mass_velocity"),
        TaskSensor(name="gap", quantity="distance", target="object", max_distance_m=2.0),
        TaskSensor(name="far", quantity="distance", target="object", max_distance_m=0.1),
    ]
    _, model = scene(ARM, Placement(mount="mount", base="fixed"), part="seg3", sensors=sensors)
    data = mujoco.MjData(model)
    data.qvel[:] = np.random.default_rng(0).normal(size=model.nv)
    mujoco.mj_forward(model, data)
    site = data.site(FUNCTIONAL_SITE).xpos
    np.testing.assert_allclose(data.sensor("at").data, site)
    np.testing.assert_allclose(data.sensor("seen").data, site - data.site("object").xpos, atol=1e-9)
    assert data.sensor("turned").data.shape == (4,)
    velocity = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, model.site(FUNCTIONAL_SITE).id, velocity, 0)
    np.testing.assert_allclose(data.sensor("speed").data, velocity[3:], atol=1e-9)
    np.testing.assert_allclose(data.sensor("com").data, data.subtree_com[model.body("robot/base").id], atol=1e-9)
    assert np.linalg.norm(data.sensor("com_speed").data) > 0
    assert 0.1 < data.sensor("gap").data[0] < 1.0
    assert data.sensor("far").data[0] == 0.1
    assert [model.sensor(s.name).dim[0] for s in sensors] == [s.size for s in sensors]


def test_contact_sensors_give_the_force_on_the_target() -> None:
    sensors = [
        TaskSensor(name="weight", quantity="contact_force", target="world"),
        TaskSensor(name="tail", quantity="contact_force", target="world", part="functional_part"),
        TaskSensor(name="touching", quantity="contacts", target="world", slots=8),
        TaskSensor(name="object", quantity="contacts", target="object", slots=2),
    ]
    placement = Placement(mount="mount_floor", base="free", position_m=(0, 0, 0.02))
    _, model = scene(CRAWLER, placement, part="tail", sensors=sensors)
    weight_n = 9.81 * sum(model.body(f"robot/{name}").mass[0] for name in ("head", "tail"))
    force = sensor_reading(model, "weight", 1500)
    np.testing.assert_allclose(force, [0, 0, -weight_n], atol=0.02 * weight_n)
    assert -0.8 * weight_n < sensor_reading(model, "tail", 1500)[2] < -0.2 * weight_n
    slots = sensor_reading(model, "touching", 1500).reshape(8, 10)
    found = slots[slots[:, 0] > 0]
    assert len(found) == found[0, 0] >= 2
    assert np.all(np.diff(np.linalg.norm(found[:, 1:4], axis=1)) <= 1e-9)
    assert found[:, 1].sum() == pytest.approx(weight_n, rel=0.02)
    np.testing.assert_allclose(found[:, 7:10], np.tile([0, 0, -1], (len(found), 1)), atol=1e-6)
    np.testing.assert_allclose(found[:, 6], 0, atol=1e-3)
    assert not sensor_reading(model, "object").any()


MEASURED = {
    "position": {"target": "object"},
    "quaternion": {"target": "object", "of_body": True},
    "linear_velocity": {},
    "center_of_mass": {},
    "contact_force": {"target": "object", "part": "functional_part"},
    "contacts": {"target": "object", "slots": 2},
    "distance": {"target": "object", "max_distance_m": 0.123456789},
    "target_position": {"target": "object"},
    "target_center_of_mass": {"target": "object"},
}
OTHERWISE = {
    "position": {"target": "object", "of_body": True},
    "quaternion": {"target": "carriage"},
    "linear_velocity": {"target": "carriage"},
    "contact_force": {"target": "object"},
    "contacts": {"target": "object", "slots": 3},
    "distance": {"target": "object"},
    "target_position": {"target": "object", "of_body": True},
    "target_center_of_mass": {"target": "carriage"},
}


def test_a_sensor_that_is_there_is_a_tasks_own_only_if_it_measures_the_same() -> None:
    sensors = [TaskSensor(name=quantity, quantity=quantity, **how) for quantity, how in MEASURED.items()]
    made, model = scene(ARM, Placement(mount="mount", base="fixed"), part="seg3", sensors=sensors)
    check_task_sensors(model, sensors)
    assert add_sensors(made.mjcf, sensors).count("<framepos") == made.mjcf.count("<framepos")
    swapped = TaskSensor(name="center_of_mass", quantity="center_of_mass_velocity")
    others = [swapped, *(TaskSensor(name=quantity, quantity=quantity, **how) for quantity, how in OTHERWISE.items())]
    for other in others:
        with pytest.raises(MjcfError, match="measures something else; rename or delete it") as caught:
            check_task_sensors(model, [*(one for one in sensors if one.name != other.name), other])
        assert [fault.names for fault in caught.value.faults] == [(other.name,)]


def test_a_scene_without_a_site_can_be_measured_where_no_part_works() -> None:
    text = '<mujoco><worldbody><body name="robot/a"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>'
    measured = add_sensors(text, [TaskSensor(name="c", quantity="center_of_mass")])
    assert mujoco.MjModel.from_xml_string(measured).sensor("c").dim[0] == 3
    with pytest.raises(MjcfError, match="functional part"):
        add_sensors(text, [TaskSensor(name="p", quantity="position")])


def test_two_sensors_of_one_name_are_refused() -> None:
    with pytest.raises(MjcfError) as caught:
        scene(ARM, Placement(mount="mount", base="fixed"), sensors=[TaskSensor(name="lift", quantity="center_of_mass")])
    assert "lift" in caught.value.faults[0].message


def test_a_broken_robot_or_environment_is_a_fault() -> None:
    with pytest.raises(MjcfError):
        scene("<mujoco><worldbody><body></worldbody></mujoco>", Placement(mount="mount", base="fixed"))
    with pytest.raises(MjcfError):
        scene(ARM, Placement(mount="mount", base="fixed"), environment="no model at all")


def test_assembly_runs_in_a_process_of_its_own() -> None:
    robot = Robot(mjcf=f"Here it is:\n```xml\n{ARM}\n```", functional_part="tip")
    made = assemble(robot, STAGE, Placement(mount="mount", base="fixed"), [TaskSensor(name="at", quantity="position")])
    assert mujoco.MjModel.from_xml_string(made.mjcf).sensor("at").dim[0] == 3
    again = assemble(robot, STAGE, Placement(mount="mount", base="fixed"), [TaskSensor(name="at", quantity="position")])
    assert again == made
    with pytest.raises(MjcfError, match="roof"):
        assemble(robot, STAGE, Placement(mount="roof", base="fixed"))
