"""Catch a thrown ball."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess, share
from aidsr.tasks.task import FORCE_SCALE_N, Criteria, Feature, Task, TaskState, span
from aidsr.tasks.variation import Change, Variation

MOUNT_HEIGHT_M, MOUNT_DEG = 0.4, 45.0
"""The mount looks up and forward."""
AHEAD_M = 0.12
CAPTURE_M = np.array([AHEAD_M * np.sqrt(0.5), 0.0, MOUNT_HEIGHT_M + AHEAD_M * np.sqrt(0.5)])
"""The capture point, in front of the mount."""
SPEED_M_S = (1.0, 1.8)
FLIGHT_S = (0.2, 0.4)
OFFSET_M, SPREAD_DEG = 0.025, 15.0
CAUGHT_M, FLOOR_M, GRAVITY_M_S2 = 0.06, 0.05, 9.81
HOLD_S = 1.0
MAX_IMPACT_N = 20.0


@dataclass(frozen=True)
class DynamicCatching(Task):
    """A ball flies at the robot and must stay near the capture point.

    Source: our choice, below the 2 m/s at which soft drones catch.
    """

    name: ClassVar = "grasping/dynamic_catching"
    base: ClassVar = "fixed"
    time_limit_s: ClassVar = 4.0
    hold_s: ClassVar = HOLD_S
    stages: ClassVar = ((0.2, "in the ball's way"), (0.4, "touching it"), (0.7, "holding it a while"), (1.0, "caught"))
    control_dt_s: ClassVar = 0.02
    required_names: ClassVar = ("mount", "ball", "ball_free", "capture_point")
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="grip", quantity="contacts", target="ball", slots=8),
    )
    features: ClassVar = (
        Feature("functional part to ball", "m", (-1, 1), "ball_position, tip_position", size=3),
        Feature("capture point to ball", "m", (-1, 1), "ball_position, capture_position", size=3),
        Feature("ball's velocity", "m/s", (-4, 4), "ball_velocity", size=3),
        Feature(f"strongest contact with the ball, 1 = {FORCE_SCALE_N:g} N", "", (0, 8), "grip"),
        Feature("how far the contacts face each other", "", (0, 1), "grip"),
        Feature(f"time held, 1 = {HOLD_S:g} s", "", (0, 1), "(state)"),
    )
    hard: ClassVar = {"slowest_m_s": 2.5, "fastest_m_s": 2.5}

    slowest_m_s: float = SPEED_M_S[0]
    fastest_m_s: float = SPEED_M_S[1]

    @property
    def objective(self) -> str:
        speed = span((self.slowest_m_s, self.fastest_m_s))
        return (
            f"Catch a ball of 30 mm radius and 40 g that arrives at {speed} m/s after {span(FLIGHT_S)} s of flight, "
            f"and keep it within {1000 * CAUGHT_M:g} mm of the capture point for {self.hold_s:g} s. The capture point "
            f"is {AHEAD_M:g} m in front of the fixed mount, which looks up and forward at {MOUNT_DEG:g} degrees; the "
            f"ball comes from there, up to {1000 * OFFSET_M:g} mm and {SPREAD_DEG:g} degrees off."
        )

    @property
    def criteria(self) -> Criteria:
        varies = self.slowest_m_s < self.fastest_m_s
        return Criteria(
            variation=(
                f"{'Speed, time' if varies else 'Time'} of flight, +-{1000 * OFFSET_M:g} mm sideways and across, "
                f"+-{SPREAD_DEG:g} deg in elevation and azimuth."
            ),
            progress=(
                "A fifth for the closest pass of the functional part, a fifth for a touch, the rest for time held."
            ),
            success=f"Within {1000 * CAUGHT_M:g} mm of the capture point and off the floor.",
            violation=f"An impact of more than {MAX_IMPACT_N:g} N.",
            failure="The ball is on the floor.",
        )

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        speed_m_s, flight_s = rng.uniform(self.slowest_m_s, self.fastest_m_s), rng.uniform(*FLIGHT_S)
        down = np.deg2rad(MOUNT_DEG + rng.uniform(-SPREAD_DEG, SPREAD_DEG))
        aside = np.deg2rad(rng.uniform(-SPREAD_DEG, SPREAD_DEG))
        sideways_m, across_m = rng.uniform(-OFFSET_M, OFFSET_M, size=2)
        arrival = speed_m_s * np.array([-np.cos(down) * np.cos(aside), -np.cos(down) * np.sin(aside), -np.sin(down)])
        passes = CAPTURE_M + np.array([-across_m * np.sqrt(0.5), sideways_m, across_m * np.sqrt(0.5)])
        # the throw, found by flying backwards from the capture point
        fall = np.array([0.0, 0.0, GRAVITY_M_S2 * flight_s])
        start = passes - flight_s * (arrival + fall / 2)
        pose, velocity = (*start, 1.0, 0.0, 0.0, 0.0), (*(arrival + fall), 0.0, 0.0, 0.0)
        return Variation((Change("qpos", "ball_free", pose), Change("qvel", "ball_free", velocity)))

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        ball_m, grip = readings["ball_position"], readings.contacts("grip")
        ways = [ball_m - readings["tip_position"], ball_m - readings["capture_position"], readings["ball_velocity"]]
        held = [grip.force_n.max(axis=1) / FORCE_SCALE_N, grip.opposition(), state["caught_s"] / self.hold_s]
        return np.column_stack([*ways, *held])

    def reset_state(self, readings: Readings) -> TaskState:
        return {"closest": _distance_m(readings), "touched": np.zeros(readings.n), "caught_s": np.zeros(readings.n)}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        closest = np.minimum(state["closest"], _distance_m(readings))
        touched = np.maximum(state["touched"], readings.contacts("grip").found.any(axis=1))
        caught_s = np.where(self.is_success(readings, state), state["caught_s"] + self.control_dt_s, 0.0)
        return {"closest": closest, "touched": touched, "caught_s": caught_s}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        del readings
        near = closeness(state["closest"], within=0.04, margin=0.2)
        return 0.2 * near + 0.2 * state["touched"] + 0.6 * share(state["caught_s"], self.hold_s)

    def violation(self, readings: Readings) -> FloatArray:
        return excess(readings.peak_contact_n("grip"), MAX_IMPACT_N)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        away_m = np.linalg.norm(readings["ball_position"] - readings["capture_position"], axis=1)
        return np.asarray((away_m <= CAUGHT_M) & (readings["ball_position"][:, 2] > FLOOR_M))

    def is_failure(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        return np.asarray(readings["ball_position"][:, 2] <= FLOOR_M)


def _distance_m(readings: Readings) -> FloatArray:
    """Return how far the ball is from the functional part, (n,) [m]."""
    return np.asarray(np.linalg.norm(readings["ball_position"] - readings["tip_position"], axis=1))
