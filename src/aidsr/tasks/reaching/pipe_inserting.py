"""Push the functional part down a bent pipe."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.reaching.pipe import INNER_M, along_pipe_m, pipe_changes
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess, share
from aidsr.tasks.task import Memory, Task
from aidsr.tasks.variation import Change, Variation

DEPTH_M = 0.24
MOUTH_M = 0.40
"""Height of the mouth over the floor, 0.35 m below the mount."""
SELDOM = 0.05  # share of the time in which the wall force may be larger than its limit


@dataclass(frozen=True)
class PipeInserting(Task):
    """The functional part gets deep into a pipe, gently.

    | index | feature                                  | unit | range       | sensor                          |
    |-------|------------------------------------------|------|-------------|---------------------------------|
    | 0-2   | functional part to the middle of the mouth | m  | -0.8 to 0.8 | pipe_position, tip_position     |
    | 3     | depth in the pipe, 1 = 0.24 m            |      | -2 to 1.25  | pipe_position, tip_position     |
    | 4     | distance from the centre line, 1 = 35 mm |      | 0 to 20     | pipe_position, tip_position     |
    | 5     | angle of the bend                        | rad  | 0.5 to 1.1  | (parameters)                    |
    | 6     | feed                                     | m    | 0 to 0.35   | base_feed                       |
    | 7     | force on the walls, 1 = 5 N              |      | 0 to 8      | wall_contacts                   |

    Source: our choice; a bore of 70 mm, as in inspection of pipes with soft growing robots.
    """

    name: ClassVar = "reaching/pipe_inserting"
    base: ClassVar = "moving"
    time_limit_s: ClassVar = 30.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.2, "in the mouth"), (0.6, "half way down"), (1.0, "all the way down"))
    required_names: ClassVar = ("mount", "feed", "pipe")
    policy_actuators: ClassVar = ("feed",)
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="wall_contacts", quantity="contacts", target="pipe", slots=16),
    )
    hard: ClassVar = {"wall_n": 2.0}

    wall_n: float = 5.0
    """Force on the walls that may be passed only seldom [N]."""

    @property
    def objective(self) -> str:
        """See `Task`."""
        return (
            "Get the tip at least 0.24 m deep into a pipe of 70 mm inner width for 0.5 s, pressing on its walls "
            f"with less than {self.wall_n:g} N nearly all the time. The pipe is 0.30 m long, opens upwards 0.35 m "
            "below the mount, goes straight down and then bends by 30 to 60 degrees with a radius of 0.13 m; the "
            "mount can move down by 0.35 m at up to 0.05 m/s."
        )

    def draw(self, rng: np.random.Generator) -> Variation:
        """Offset +-20 mm to each side, bend 30 to 60 deg, friction 0.2 to 0.9."""
        x, y = rng.uniform(-0.02, 0.02, size=2)
        bend_rad = float(np.deg2rad(rng.uniform(30.0, 60.0)))
        walls = pipe_changes(bend_rad)
        friction = (rng.uniform(0.2, 0.9), 0.005, 0.0001)
        rough = tuple(Change("geom_friction", wall.name, friction) for wall in walls if wall.field == "geom_pos")
        return Variation((Change("body_pos", "pipe", (x, y, MOUTH_M)), *walls, *rough), {"bend_rad": (bend_rad,)})

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        del memory
        depth_m, beside_m = _tip(readings)
        way = [readings["pipe_position"] - readings["tip_position"], depth_m / DEPTH_M, beside_m / INNER_M]
        force = readings.peak_contact_n("wall_contacts", together=True) / 5.0
        return np.column_stack([*way, readings.parameters["bend_rad"], readings["base_feed"], force])

    def begin(self, readings: Readings) -> Memory:
        """No step is counted."""
        return {"steps": np.zeros(readings.n), "pressed": np.zeros(readings.n)}

    def remember(self, readings: Readings, memory: Memory) -> Memory:
        """In how many control steps the walls were pressed too hard."""
        too_hard = readings.peak_contact_n("wall_contacts", together=True) >= self.wall_n
        return {"steps": memory["steps"] + 1.0, "pressed": memory["pressed"] + too_hard}

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """A fifth for coming to the mouth, the rest for depth."""
        del memory
        depth_m, beside_m = _tip(readings)
        inside = (depth_m >= 0.0) & (beside_m <= INNER_M)
        distance = np.linalg.norm(readings["pipe_position"] - readings["tip_position"], axis=1)
        near = np.where(inside, 1.0, closeness(distance, margin=0.2))
        return 0.2 * near + 0.8 * np.where(inside, share(depth_m, DEPTH_M), 0.0)

    def violation(self, readings: Readings) -> FloatArray:
        """More than 20 N on the walls."""
        return excess(readings.peak_contact_n("wall_contacts", together=True), 20.0)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Deep enough, inside, and hardly ever pressed too hard on the way."""
        depth_m, beside_m = _tip(readings)
        gentle = memory["pressed"] <= SELDOM * memory["steps"]
        return (depth_m >= DEPTH_M) & (beside_m <= INNER_M) & gentle


def _tip(readings: Readings) -> tuple[FloatArray, FloatArray]:
    """Return depth of the functional part and its distance from the centre line, (n,) each [m]."""
    point_m = readings["tip_position"] - readings["pipe_position"]
    return along_pipe_m(point_m, readings.parameters["bend_rad"][:, 0])
