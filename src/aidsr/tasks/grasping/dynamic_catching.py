"""Catch a thrown ball."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess, share
from aidsr.tasks.task import Memory, Task
from aidsr.tasks.variation import Change, Variation

CAPTURE_M = np.array([0.12 * np.sqrt(0.5), 0.0, 0.4 + 0.12 * np.sqrt(0.5)])
"""The capture point, 0.12 m in front of the mount, which looks up and forward at 45 degrees."""
CAUGHT_M, FLOOR_M, GRAVITY_M_S2 = 0.06, 0.05, 9.81


@dataclass(frozen=True)
class DynamicCatching(Task):
    """A ball flies at the robot and must stay near the capture point.

    | index | feature                                | unit | range       | sensor                           |
    |-------|----------------------------------------|------|-------------|----------------------------------|
    | 0-2   | functional part to ball                | m    | -1 to 1     | ball_position, tip_position      |
    | 3-5   | capture point to ball                  | m    | -1 to 1     | ball_position, capture_position  |
    | 6-8   | ball's velocity                        | m/s  | -4 to 4     | ball_velocity                    |
    | 9     | strongest contact with the ball, 1 = 5 N |    | 0 to 8      | grip                             |
    | 10    | how far the contacts face each other   |      | 0 to 1      | grip                             |
    | 11    | time held, 1 = 1 s                     |      | 0 to 1      | (memory)                         |

    Source: our choice, below the 2 m/s at which soft drones catch.
    """

    name: ClassVar = "grasping/dynamic_catching"
    base: ClassVar = "fixed"
    time_limit_s: ClassVar = 4.0
    hold_s: ClassVar = 1.0
    stages: ClassVar = ((0.2, "in the ball's way"), (0.4, "touching it"), (0.7, "holding it a while"), (1.0, "caught"))
    control_dt_s: ClassVar = 0.02
    required_names: ClassVar = ("mount", "ball", "ball_free", "capture_point")
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="grip", quantity="contacts", target="ball", slots=8),
    )
    hard: ClassVar = {"slowest_m_s": 2.5, "fastest_m_s": 2.5}
    hard_words: ClassVar = {"draw": "Time of flight, +-25 mm sideways and across, +-15 deg in elevation and azimuth."}

    slowest_m_s: float = 1.0
    fastest_m_s: float = 1.8

    @property
    def objective(self) -> str:
        """See `Task`."""
        speed = f"{self.slowest_m_s:g}" + f" to {self.fastest_m_s:g}" * (self.slowest_m_s < self.fastest_m_s)
        return (
            f"Catch a ball of 30 mm radius and 40 g that arrives at {speed} m/s after 0.2 to 0.4 s of flight, and "
            "keep it within 60 mm of the capture point for 1 s. The capture point is 0.12 m in front of the fixed "
            "mount, which looks up and forward at 45 degrees; the ball comes from there, up to 25 mm and 15 degrees "
            "off."
        )

    def draw(self, rng: np.random.Generator) -> Variation:
        """Speed, time of flight, +-25 mm sideways and across, +-15 deg in elevation and azimuth."""
        speed_m_s, flight_s = rng.uniform(self.slowest_m_s, self.fastest_m_s), rng.uniform(0.2, 0.4)
        down, aside = np.deg2rad(45.0 + rng.uniform(-15.0, 15.0)), np.deg2rad(rng.uniform(-15.0, 15.0))
        sideways_m, across_m = rng.uniform(-0.025, 0.025, size=2)
        arrival = speed_m_s * np.array([-np.cos(down) * np.cos(aside), -np.cos(down) * np.sin(aside), -np.sin(down)])
        passes = CAPTURE_M + np.array([-across_m * np.sqrt(0.5), sideways_m, across_m * np.sqrt(0.5)])
        # the throw, found by flying backwards from the capture point
        fall = np.array([0.0, 0.0, GRAVITY_M_S2 * flight_s])
        start = passes - flight_s * (arrival + fall / 2)
        pose, velocity = (*start, 1.0, 0.0, 0.0, 0.0), (*(arrival + fall), 0.0, 0.0, 0.0)
        return Variation((Change("qpos", "ball_free", pose), Change("qvel", "ball_free", velocity)))

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        ball_m, grip = readings["ball_position"], readings.contacts("grip")
        ways = [ball_m - readings["tip_position"], ball_m - readings["capture_position"], readings["ball_velocity"]]
        held = [grip.force_n.max(axis=1) / 5.0, grip.opposition(), memory["caught_s"] / self.hold_s]
        return np.column_stack([*ways, *held])

    def begin(self, readings: Readings) -> Memory:
        """Nothing has come near, nothing was touched."""
        return {"closest": _distance_m(readings), "touched": np.zeros(readings.n), "caught_s": np.zeros(readings.n)}

    def remember(self, readings: Readings, memory: Memory) -> Memory:
        """The closest pass, whether the ball was touched, and for how long it has been caught."""
        closest = np.minimum(memory["closest"], _distance_m(readings))
        touched = np.maximum(memory["touched"], readings.contacts("grip").found.any(axis=1))
        caught_s = np.where(self.succeeded(readings, memory), memory["caught_s"] + self.control_dt_s, 0.0)
        return {"closest": closest, "touched": touched, "caught_s": caught_s}

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """A fifth for the closest pass of the functional part, a fifth for a touch, the rest for time held."""
        del readings
        near = closeness(memory["closest"], within=0.04, margin=0.2)
        return 0.2 * near + 0.2 * memory["touched"] + 0.6 * share(memory["caught_s"], self.hold_s)

    def violation(self, readings: Readings) -> FloatArray:
        """An impact of more than 20 N."""
        return excess(readings.peak_contact_n("grip"), 20.0)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Within 60 mm of the capture point and off the floor."""
        del memory
        away_m = np.linalg.norm(readings["ball_position"] - readings["capture_position"], axis=1)
        return np.asarray((away_m <= CAUGHT_M) & (readings["ball_position"][:, 2] > FLOOR_M))

    def failed(self, readings: Readings, memory: Memory) -> BoolArray:
        """The ball is on the floor."""
        del memory
        return np.asarray(readings["ball_position"][:, 2] <= FLOOR_M)


def _distance_m(readings: Readings) -> FloatArray:
    """Return how far the ball is from the functional part, (n,) [m]."""
    return np.asarray(np.linalg.norm(readings["ball_position"] - readings["tip_position"], axis=1))
