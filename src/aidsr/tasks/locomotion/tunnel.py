"""Get through a low tunnel with a bend."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.locomotion.bent_tunnel import ENTRANCE_M, LENGTH_M, along_tunnel_m, tunnel_changes
from aidsr.tasks.locomotion.lane import LaneTask, outline_in_lane
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import excess, share
from aidsr.tasks.task import Edits, Memory
from aidsr.tasks.variation import Change, Variation


@dataclass(frozen=True)
class Tunnel(LaneTask):
    """The whole robot comes out of the tunnel's far end.

    | index | feature                                | unit | range       | sensor                                    |
    |-------|----------------------------------------|------|-------------|-------------------------------------------|
    | 0     | centre of mass along the lane          | m    | -1 to 5     | com_position, lane_position, lane_forward |
    | 1     | centre of mass to the left of the lane | m    | -1 to 1     | com_position, lane_position, lane_left    |
    | 2     | centre of mass over the ground         | m    | 0 to 1      | com_position                              |
    | 3     | speed along the lane                   | m/s  | -2 to 2     | com_velocity, lane_forward                |
    | 4     | speed to the left                      | m/s  | -2 to 2     | com_velocity, lane_left                   |
    | 5     | speed upwards                          | m/s  | -2 to 2     | com_velocity                              |
    | 6-7   | forward direction, world x and y       |      | -1 to 1     | lane_forward                              |
    | 8     | rearmost part along the tunnel         | m    | -1 to 1.5   | (outline)                                 |
    | 9     | foremost part along the tunnel         | m    | -1 to 1.5   | (outline)                                 |
    | 10    | bend, to the left                      | rad  | -0.44 to 0.44 | (parameters)                            |
    | 11    | height, 1 = 0.10 m                     |      | 0.6 to 1.1  | (parameters)                              |

    Source: our choice, after EvoGym's caves (0.6 to 1.2 body lengths high; Bhatia et al. 2021).
    """

    name: ClassVar = "locomotion/tunnel"
    time_limit_s: ClassVar = 50.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.1, "moving forward"), (0.4, "in the tunnel"), (1.0, "out of the far end"))
    needs_outline: ClassVar = True
    required_names: ClassVar = ("mount", "ground", "lane", "tunnel")
    sensors: ClassVar = (
        *LaneTask.sensors,
        TaskSensor(name="wall_contacts", quantity="contacts", target="tunnel", slots=16),
    )
    hard: ClassVar = {"height_m": 0.07}

    height_m: float = 0.10
    """Height of the tunnel [m]; an episode has 10 % more or less."""

    @property
    def objective(self) -> str:
        """See `Task`."""
        return (
            f"Get through a tunnel, 0.12 m wide, about {self.height_m:g} m high and 0.6 m long, that begins 0.35 m "
            "ahead and turns by up to 25 degrees in the middle, until the whole body is out of its far end."
        )

    @property
    def edits(self) -> Edits:
        """See `Task`."""
        boxes = tunnel_changes(0.0, self.height_m)
        return {f"geom/{box.name}": {box.field.removeprefix("geom_"): box.value} for box in boxes}

    def draw(self, rng: np.random.Generator) -> Variation:
        """Bend up to 25 deg to either side, height +-10 %, friction of the ground 0.6 to 1.2."""
        bend_rad = float(np.deg2rad(rng.uniform(-25.0, 25.0)))
        height_m = self.height_m * rng.uniform(0.9, 1.1)
        friction = Change("geom_friction", "ground", (rng.uniform(0.6, 1.2), 0.005, 0.0001))
        parameters = {"bend_rad": (bend_rad,), "height_m": (height_m,)}
        return Variation((*tunnel_changes(bend_rad, height_m), friction), parameters)

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        along_m = _outline_along_m(readings)
        ends = [_rear_m(readings), (along_m + readings.body.radius_m).max(axis=1)]
        height = readings.parameters["height_m"] / 0.10
        base = super().features(readings, memory)
        return np.column_stack([base, *ends, readings.parameters["bend_rad"], height])

    def begin(self, readings: Readings) -> Memory:
        """Where the rearmost part starts."""
        return {"rear": _rear_m(readings)}

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Way of the rearmost part to the far end."""
        return share(_rear_m(readings) - memory["rear"], LENGTH_M - memory["rear"])

    def violation(self, readings: Readings) -> FloatArray:
        """A mean force of more than 20 N on the walls."""
        force_n = readings.peak_contact_n("wall_contacts", mean_over_s=self.control_dt_s, together=True)
        return excess(force_n, 20.0)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """The whole body is out of the far end."""
        del memory
        return _rear_m(readings) >= LENGTH_M


def _outline_along_m(readings: Readings) -> FloatArray:
    """Return where the outline's balls are along the tunnel, 0 at its entrance, (n, p) [m]."""
    from_entrance = outline_in_lane(readings)[:, :, :2] - [ENTRANCE_M, 0.0]
    return along_tunnel_m(from_entrance, readings.parameters["bend_rad"])


def _rear_m(readings: Readings) -> FloatArray:
    """Return where the rearmost part is along the tunnel, (n,) [m]."""
    return np.asarray((_outline_along_m(readings) - readings.body.radius_m).min(axis=1))
