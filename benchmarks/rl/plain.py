"""Environments as a user would write them today: Gymnasium, one MuJoCo simulation, one Python loop.

They have the observations, the reward and the success and failure conditions of the package's tasks, except that forces
are those at the end of a control step, not its peaks. They share none of the package's stepping: they are the baseline
for the batched environment.
"""

from __future__ import annotations

from pathlib import Path

import gymnasium
import mujoco
import numpy as np

from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.structure import read_structure
from aidsr.tasks.variation import apply_to_simulation

_HALF_WIDTH_M = 0.3


class PlainEnv(gymnasium.Env):
    """A robot in its scene. A subclass for each task defines `_features` and `_judge`.

    Args:
        scene: MJCF of a robot in the task's environment.
        task: Name of the task.
        seed: Seed of the variations drawn.
    """

    def __init__(self, scene: Path, task: str, seed: int) -> None:
        found = TaskScene.of(scene, task)
        self.task, self.actions, self.model = found.task, found.actions, found.model
        self.data = mujoco.MjData(self.model)
        self.rng = np.random.default_rng(seed)
        self.substeps = round(self.task.control_dt_s / self.model.opt.timestep)
        self.limit = round(self.task.time_limit_s / self.task.control_dt_s)
        structure = read_structure(self.model)
        self.length_m = structure.characteristic_length_m
        self.robot_actuators = list(structure.actuators)
        self.driven, self.follows = list(self.actions.actuators), list(self.actions.follows)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (self.actions.size,), np.float32)
        seen, _ = self.reset()
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, seen.shape, np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, object] | None = None):
        """Begin an episode with a new random variation."""
        super().reset(seed=seed, options=options)
        variation = self.task.variation("development", int(self.rng.integers(2**31)))
        apply_to_simulation(variation, self.model, self.data)
        self.steps, self.held_s = 0, 0.0
        self.last = self.actions.rest.copy()
        self._begin()
        self.progress = self._judge()[0]
        return self._observe(), {}

    def step(self, action: np.ndarray):
        """Advance by one control step."""
        self.last = np.clip(action, -1.0, 1.0).astype(float)
        low, high = self.actions.low, self.actions.high
        self.data.ctrl[self.driven] = low + (self.last[self.follows] + 1.0) / 2.0 * (high - low)
        mujoco.mj_step(self.model, self.data, self.substeps)
        self.steps += 1
        progress, violation, reached, lost = self._judge()
        self.held_s = self.held_s + self.task.control_dt_s if reached else 0.0
        won = self.held_s > self.task.hold_s - self.task.control_dt_s / 2
        reward = 10.0 * (progress - self.progress) + 5.0 * won - violation - 0.01 * float(np.mean(self.last**2))
        self.progress = progress
        over = won or lost
        return self._observe(), reward, over, self.steps >= self.limit and not over, {"is_success": won}

    def _observe(self) -> np.ndarray:
        data = self.data
        own = [data.qpos, data.qvel, data.ten_length, data.ten_velocity, data.actuator_force[self.robot_actuators]]
        return np.concatenate([*own, self.last, self._features()]).astype(np.float32)

    def _begin(self) -> None:
        """Store values of the episode's start; called at every reset."""


class PlainButton(PlainEnv):
    """Button pushing."""

    def _sensed(self):
        sensor = self.data.sensor
        reach = sensor("button_position").data - sensor("tip_position").data
        force_n = float(np.linalg.norm(sensor("tip_force").data[:3]))
        return reach, sensor("button_direction").data, float(sensor("button_travel").data[0]), force_n

    def _features(self) -> np.ndarray:
        reach, direction, travel_m, force_n = self._sensed()
        return np.concatenate([reach, direction, [travel_m / 0.005, force_n / 5.0]])

    def _judge(self) -> tuple[float, float, bool, bool]:
        reach, _, travel_m, force_n = self._sensed()
        beyond_m = max(float(np.linalg.norm(reach)) - 0.01, 0.0)
        near = 0.5 / (1.0 + 9.0 * (beyond_m / 0.2) ** 2) + 0.5 / (1.0 + 9.0 * (beyond_m / 0.04) ** 2)
        violation = min(max((force_n - 20.0) / 20.0, 0.0), 1.0)
        pressed = min(max(travel_m / 0.005, 0.0), 1.0)
        return 0.5 * near + 0.5 * pressed, violation, travel_m >= 0.005 and force_n > 0.05, False


class PlainGround(PlainEnv):
    """Flat ground."""

    def _in_lane(self, vector: np.ndarray) -> np.ndarray:
        forward, left = self.data.sensor("lane_forward").data, self.data.sensor("lane_left").data
        return np.array([vector @ forward, vector @ left, vector[2]])

    def _place(self) -> np.ndarray:
        return self._in_lane(self.data.sensor("com_position").data - self.data.sensor("lane_position").data)

    def _begin(self) -> None:
        self.start_m = self._place()[0]
        self.goal_m = max(1.2, 4.0 * self.length_m)

    def _features(self) -> np.ndarray:
        velocity = self._in_lane(self.data.sensor("com_velocity").data)
        return np.concatenate([self._place(), velocity, self.data.sensor("lane_forward").data[:2]])

    def _judge(self) -> tuple[float, float, bool, bool]:
        along, aside, _ = self._place()
        forward = along - self.start_m
        violation = min(max((abs(aside) - _HALF_WIDTH_M) / 0.1, 0.0), 1.0)
        reached = forward >= self.goal_m and abs(aside) < _HALF_WIDTH_M
        return min(max(forward / self.goal_m, 0.0), 1.0), violation, reached, abs(aside) >= _HALF_WIDTH_M + 0.1
