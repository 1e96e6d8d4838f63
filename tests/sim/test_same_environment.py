"""What is changed around a robot is found, and what assembly does is not."""

from __future__ import annotations

import mujoco
import pytest

from aidsr.core.artifacts import Placement, Robot
from aidsr.core.errors import UserError
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.assembly import assemble
from aidsr.sim.same_environment import find_environment_change
from aidsr.tasks import TASKS, load_task

ROBOT = Robot(
    functional_part="stick",
    mjcf="""
<mujoco>
  <option timestep="0.001"/>
  <worldbody>
    <body name="base">
      <geom name="base" size="0.02"/>
      <body name="stick">
        <joint name="bend" axis="0 1 0" stiffness="0.2" damping="0.01"/>
        <geom name="stick" type="capsule" size="0.01" fromto="0 0 0 0 0 0.2" mass="0.05"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="bend" joint="bend" ctrlrange="-1 1"/></actuator>
  <sensor><jointpos name="bend" joint="bend"/></sensor>
</mujoco>""",
)


def scene_of(name: str) -> str:
    task = load_task(name)
    base = "free" if task.base == "free" else "fixed"
    return assemble(ROBOT, task.environment, Placement(mount="mount", base=base), task.sensors).mjcf


@pytest.mark.parametrize("name", TASKS)
def test_an_assembled_scene_leaves_the_environment_as_it_is(name):
    environment = mujoco.MjModel.from_xml_string(load_task(name).environment)
    scene = mujoco.MjModel.from_xml_string(scene_of(name))
    assert find_environment_change(scene, environment) == ""
    assert find_environment_change(scene, scene) == ""


CHANGES = {
    "gravity": ("gravity has", lambda spec: setattr(spec.option, "gravity", [1.0, 0.0, -9.8])),
    "wind": ("wind", lambda spec: setattr(spec.option, "wind", [1.0, 0.0, 0.0])),
    "time step": ("time step", lambda spec: setattr(spec.option, "timestep", 0.0015)),
    "spring": (
        "joint button_slide has stiffness",
        lambda spec: spec.joint("button_slide").stiffness.__setitem__(0, 1.0),
    ),
    "place": ("body button has pos", lambda spec: setattr(spec.body("button"), "pos", [0.1, 0.0, 0.5])),
    "friction": ("geom floor has friction", lambda spec: setattr(spec.geom("floor"), "friction", [5.0, 0.005, 0.0001])),
    "mount": ("site mount has pos", lambda spec: setattr(spec.site("mount"), "pos", [0.1, 0.0, 0.7])),
    "sensor": (
        "sensor button_travel refers to",
        lambda spec: setattr(spec.sensor("button_travel"), "objname", "robot/bend"),
    ),
    "equality": ("elements of the kind equality", lambda spec: _hold(spec)),
    "exclusion": ("exclusions of contact", lambda spec: _exclude(spec)),
    "second mount": ("site mount_2 is none of", lambda spec: spec.worldbody.add_site(name="mount_2")),
    "actuator": ("actuator helper is none of", lambda spec: _help(spec)),
    "belt to the robot": ("tendon belt is none of", lambda spec: _belt(spec, "button_slide", "robot/bend")),
    "damper": ("tendon belt is none of", lambda spec: _belt(spec, "button_slide")),
    "gear to the robot": ("elements of the kind equality", lambda spec: _hold(spec, "robot/bend")),
    "reference": ("joint button_slide has qpos0", lambda spec: setattr(spec.joint("button_slide"), "ref", 0.01)),
    "spring reference": (
        "joint button_slide has qpos_spring",
        lambda spec: setattr(spec.joint("button_slide"), "springref", 0.01),
    ),
    "switched off": ("option has disableactuator", lambda spec: setattr(spec.option, "disableactuator", 2)),
    "no solver": ("option has iterations", lambda spec: setattr(spec.option, "iterations", 1)),
    "no slip": ("option has noslip_iterations", lambda spec: setattr(spec.option, "noslip_iterations", 20)),
    "conveyor": (
        "geom floor has surfacevel",
        lambda spec: setattr(spec.geom("floor"), "surfacevel", [0.1, 0, 0, 0, 0, 0]),
    ),
    "glue": ("geom floor has adhesion", lambda spec: setattr(spec.geom("floor"), "adhesion", 5.0)),
}


def _hold(spec, other=""):
    joint = mujoco.mjtObj.mjOBJ_JOINT
    spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1="button_slide", name2=other, objtype=joint)


def _belt(spec, *joints):
    belt = spec.add_tendon(name="belt", damping=[2.0, 0.0, 0.0])
    for joint in joints:
        belt.wrap_joint(joint, 1.0)


def _exclude(spec):
    spec.add_exclude(bodyname1="button", bodyname2="world")


def _help(spec):
    spec.add_actuator(name="helper", target="button_slide", trntype=mujoco.mjtTrn.mjTRN_JOINT)


@pytest.mark.parametrize(("words", "change"), CHANGES.values(), ids=CHANGES)
def test_a_change_around_the_robot_is_found(words, change):
    environment = mujoco.MjModel.from_xml_string(load_task("button_pushing").environment)
    spec = mujoco.MjSpec.from_string(scene_of("button_pushing"))
    change(spec)
    found = find_environment_change(spec.compile(), environment)
    assert all(word in found for word in words.split(" has"))
    with pytest.raises(UserError, match="not a scene of reaching/button_pushing"):
        TaskScene.of(spec.to_xml(), "button_pushing")


COUPLINGS = {
    "joints": '<joint joint1="bend" joint2="curl"/>',
    "one joint": '<joint joint1="curl"/>',
    "tendons": '<tendon tendon1="all" tendon2="last"/>',
}


@pytest.mark.parametrize("equality", COUPLINGS.values(), ids=COUPLINGS)
def test_a_coupling_inside_the_robot_is_none_of_the_environment(equality):
    tip = '<body pos="0 0 0.2"><joint name="curl" axis="0 1 0" stiffness="0.2"/><geom size="0.01" mass="0.01"/></body>'
    text = ROBOT.mjcf.replace('mass="0.05"/>', f'mass="0.05"/>{tip}')
    bend, curl = (f'<joint joint="{name}" coef="1"/>' for name in ("bend", "curl"))
    tendons = f'<fixed name="all">{bend}{curl}</fixed><fixed name="last">{curl}</fixed>'
    text = text.replace("<actuator>", f"<tendon>{tendons}</tendon><equality>{equality}</equality><actuator>")
    task = load_task("button_pushing")
    robot = ROBOT.model_copy(update={"mjcf": text})
    scene = assemble(robot, task.environment, Placement(mount="mount", base="fixed"), task.sensors).mjcf
    environment = mujoco.MjModel.from_xml_string(task.environment)
    assert find_environment_change(mujoco.MjModel.from_xml_string(scene), environment) == ""
