"""Scenes to learn in: built-in robots at their tasks, and one that is quick to simulate."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from aidsr.core.artifacts import Placement, Robot
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.assembly import assemble
from aidsr.tasks import load_task
from aidsr.tasks.reaching.button_pushing import ButtonPushing
from aidsr.teams.rules import team

_SEGMENT = """
<body name="seg{i}" pos="0 0 0.06">
  <joint name="bend{i}" axis="0 1 0" stiffness="0.2" damping="0.02" range="-40 40"/>
  <geom type="capsule" size="0.008" fromto="0 0 0 0 0 0.05" mass="0.01"/>
  <site name="left{i}" pos="0.009 0 0.03"/><site name="right{i}" pos="-0.009 0 0.03"/>
  {inside}
</body>"""

_ACTUATOR = """<general name="pull_{side}" tendon="{side}" ctrlrange="0 {tension}" gainprm="-1"/>"""


def small_arm(tension: float = 8.0, damping: float = 0.02, third: str = "") -> str:
    """MJCF of four segments between two tendons, on a base."""
    inside = '<site name="tip" pos="0 0 0.058"/>'
    for i in (4, 3, 2, 1):
        inside = _SEGMENT.format(i=i, inside=inside)
    paths = {side: "".join(f'<site site="{side}{i}"/>' for i in range(5)) for side in ("left", "right")}
    tendons = "".join(f'<spatial name="{side}">{path}</spatial>' for side, path in paths.items())
    actuators = "".join(_ACTUATOR.format(side=side, tension=tension) for side in paths)
    text = f"""
<mujoco model="small_arm">
  <worldbody>
    <body name="base">
      <geom type="cylinder" size="0.02 0.01" mass="0.1"/>
      <site name="left0" pos="0.009 0 0.02"/><site name="right0" pos="-0.009 0 0.02"/>
      {inside}
    </body>
  </worldbody>
  <tendon>{tendons}</tendon>
  <actuator>{actuators}{third}</actuator>
  <sensor><framepos objtype="site" objname="tip"/></sensor>
</mujoco>"""
    return text.replace('damping="0.02"', f'damping="{damping}"')


def changed_arm(*pairs: tuple[str, str]) -> str:
    """Return the small arm with texts replaced by others: (old, new), in order."""
    text = small_arm()
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    return text


@cache
def small_scene(task_name: str = "button_pushing", **changes) -> str:
    """The small arm at a task with a fixed mount."""
    task = load_task(task_name)
    robot = Robot(mjcf=small_arm(**changes), functional_part="tip")
    return assemble(robot, task.environment, Placement(mount="mount", base="fixed"), task.sensors).mjcf


@cache
def builtin_scene(task_name: str, pick: int = 0) -> str:
    """A robot of the built-in team at a task, unvalidated."""
    task = load_task(task_name)
    brief, roles = task.brief(), team(1)
    concept = roles.designer.propose(brief, 3)[pick]
    robot = roles.coder.write(brief, concept)
    return assemble(robot, brief.environment, roles.integrator.place(brief, concept, robot), task.sensors).mjcf


@dataclass(frozen=True)
class QuickPushing(ButtonPushing):
    """The button task over in a second, and won by bending towards any side."""

    time_limit_s = 1.0
    hold_s = 0.2

    @property
    def environment(self):
        return load_task("button_pushing").environment

    def is_success(self, readings, state):
        return np.abs(readings["tip_position"][:, 0]) > 0.05


def small_learning(task=None, **options) -> TaskScene:
    """The small arm, ready to learn."""
    return TaskScene.of(small_scene(), task or QuickPushing(), **options)


class Always:
    """Takes one action for ever."""

    def __init__(self, *action: float) -> None:
        self.action = np.array(action)

    def act(self, observation):
        return np.tile(self.action, (len(observation), 1))


class Breaking(Episodes):
    """The second simulation breaks down in the third step."""

    steps = 0

    def step(self, action):
        self.steps += 1
        if self.steps == 3:
            self.batch.bind("qvel")[1] = 1e9
        return super().step(action)
