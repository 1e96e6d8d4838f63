"""A stick in the place of a robot, and episodes of one simulation that a test plays by hand."""

from functools import cache

import mujoco
import numpy as np

from aidsr.core.artifacts import Placement, Robot
from aidsr.sim.assembly import assemble
from aidsr.tasks import Reader, Readings, Task, apply_to_simulation
from aidsr.tasks.scoring import Score, reset, score
from aidsr.tasks.task import TaskState

STICK = """
<mujoco model="stick">
  <worldbody>
    <body name="stick" gravcomp="1">
      <geom name="stick" type="capsule" fromto="0 0 0.008 0 0 0.112" size="0.008" mass="0.05"/>
      <site name="tip" pos="0 0 0.12"/>
    </body>
  </worldbody>
</mujoco>
"""
"""0.12 m long, weightless, with its tip at the far end."""

LENGTH_M = 0.12
STIFFNESS_N_M = 1000.0
"""Of the hand that pulls things about."""

FREE_M = (0.0, 0.0, 0.02)
"""Where a free stick stands over its mount: clear of the ground."""


@cache
def scene(task: Task, base: str) -> str:
    """The stick in the task's environment, held by the mount ("fixed") or by nobody ("free")."""
    placement = Placement(mount="mount", base=base, position_m=FREE_M if base == "free" else (0.0, 0.0, 0.0))
    robot = Robot(mjcf=STICK, functional_part="tip")
    return assemble(robot, task.environment, placement, task.sensors).mjcf


class Episode:
    """One episode of a task with the stick; `score` is that of the last step, `progress` the whole course.

    `course` is what was read and remembered at the beginning and after each step.
    """

    def __init__(self, task: Task, *, base: str | None = None, split: str = "development", index: int = 0) -> None:
        self.task = task
        self.base = base or ("free" if task.base == "free" else "fixed")
        self.model = mujoco.MjModel.from_xml_string(scene(task, self.base))
        self.data = mujoco.MjData(self.model)
        self.reader = Reader.of(task, self.model)
        self.variation = task.variation(split, index)
        apply_to_simulation(self.variation, self.model, self.data)
        seen = self.look()
        self.state = reset(task, seen)
        self.progress = [float(self.state.progress[0])]
        self.course: list[tuple[Readings, TaskState]] = [(seen, self.state.task_state)]
        self.score: Score | None = None

    @property
    def won(self) -> bool:
        return bool(self.state.success[0])

    def look(self, samples: list[np.ndarray] | None = None) -> Readings:
        """What the task reads now."""
        samples = [self.data.sensordata.copy()] if samples is None else samples
        return self.reader.read(
            np.array(samples)[None],
            np.array([self.data.time]),
            [self.variation],
            self.data.geom_xpos[None],
            self.data.geom_xmat[None],
        )

    def step(self, hand=None, ctrl=None) -> Score:
        """Go on by one control step.

        Args:
            hand: Called before every physics step with this episode, to push things about. Without one, only the last
                step is read.
            ctrl: Controls of the environment's actuators by name, beside the task's own script.
        """
        script = {name: value[0] for name, value in self.task.script(self.look()).items()}
        for name, value in {**script, **(ctrl or {})}.items():
            self.data.actuator(name).ctrl = value
        steps, samples = round(self.task.control_dt_s / self.model.opt.timestep), []
        if hand is None:
            mujoco.mj_step(self.model, self.data, nstep=steps)
            samples.append(self.data.sensordata.copy())
        else:
            for _ in range(steps):
                hand(self)
                mujoco.mj_step(self.model, self.data)
                samples.append(self.data.sensordata.copy())
        seen = self.look(samples)
        self.state, self.score = score(self.task, self.state, seen, np.zeros((1, 1)))
        self.progress.append(float(self.score.progress[0]))
        self.course.append((seen, self.state.task_state))
        return self.score

    def run(self, seconds: float, hand=None) -> None:
        """Go on until the time is over or the episode ends."""
        end = self.data.time + seconds
        while self.data.time < end - 1e-9:
            self.step(hand)
            if self.won or self.score.failure[0]:
                break

    # --- hands ---

    @property
    def tip_m(self) -> np.ndarray:
        return self.data.site("robot/tip").xpos

    def sensor(self, name: str) -> np.ndarray:
        return self.data.sensor(name).data.copy()

    def place(self, tip_m, along) -> None:
        """Put a free stick somewhere, at rest, with its tip and its direction given."""
        quaternion = np.zeros(4)
        mujoco.mju_quatZ2Vec(quaternion, np.asarray(along, dtype=float) / np.linalg.norm(along))
        self.put(self.model.body("robot/stick").jntadr[0], tip_m - LENGTH_M * self._axis(quaternion), quaternion)

    def put(self, joint, position_m, quaternion=(1.0, 0.0, 0.0, 0.0)) -> None:
        """Put a free body somewhere, at rest."""
        self.data.joint(joint).qpos = (*position_m, *quaternion)
        self.data.joint(joint).qvel = 0.0
        mujoco.mj_forward(self.model, self.data)

    def hold(self, body: str, point_m, target_m, *, along=None, strongest_n: float = 10.0) -> None:
        """Pull a point of a body to a place and, where a direction is given, turn its z axis into it."""
        body_id = self.model.body(body).id
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(self.model, self.data, mujoco.mjtObj.mjOBJ_BODY, body_id, velocity, 0)
        mass = self.model.body_mass[body_id]
        force = STIFFNESS_N_M * (np.asarray(target_m) - point_m) - 2 * np.sqrt(STIFFNESS_N_M * mass) * velocity[3:]
        force *= min(1.0, strongest_n / max(np.linalg.norm(force), 1e-9))
        torque = np.zeros(3)
        if along is not None:
            axis = self._axis(self.data.xquat[body_id])
            spin = velocity[:3] - axis * (axis @ velocity[:3])
            torque = 0.05 * np.cross(axis, np.asarray(along) / np.linalg.norm(along)) - 3e-3 * spin
        self.data.xfrc_applied[body_id] = (*force, *torque)

    @staticmethod
    def _axis(quaternion) -> np.ndarray:
        axis = np.zeros(3)
        mujoco.mju_rotVecQuat(axis, np.array([0.0, 0.0, 1.0]), np.asarray(quaternion, dtype=float))
        return axis
