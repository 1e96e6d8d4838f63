"""Common parts of the grasping tasks on a carriage: timetable, observation of the object and its height."""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.condition import Condition
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import FloatArray, Readings
from aidsr.tasks.shaping import closeness, share
from aidsr.tasks.task import FORCE_SCALE_N, Task, TaskState

TABLE_M = 0.4
"""Height of the table's top above the floor [m]."""
ABOVE_TABLE_M = 0.25
"""Height above the table to which the carriage lowers the mount [m]."""
RAISED_M = 0.10
"""Height by which the object must be raised [m]."""
LIFT_PROGRESS = "Three tenths for coming near, three for holding it from opposite sides, four for its height."
_NEAR_M = 0.05
"""Distance at which the functional part counts as being at the object [m]."""
_LIFT_OFF_M = 0.01
"""Height above its start at which an object has left the table [m]."""


@dataclass(frozen=True)
class CarriageTask(Task, ABC):
    """A carriage with the mount below it follows a timetable; the policy only closes and opens the robot."""

    base: ClassVar = "moving"
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="grip", quantity="contacts", target="object", slots=8),
    )
    times_s: ClassVar[tuple[float, ...]]
    heights_m: ClassVar[tuple[float, ...]]
    """Timetable: heights of the carriage above its start [m] at `times_s`, interpolated linearly."""

    def script(self, readings: Readings) -> Mapping[str, FloatArray]:
        return {"carriage_lift": np.interp(readings.time_s, self.times_s, self.heights_m)}

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        grip = readings.contacts("grip")
        return np.column_stack(
            [
                readings["object_position"] - readings["tip_position"],
                readings["object_velocity"],
                readings["object_position"] - readings["mount_position"],
                readings["carriage_height"],
                readings.time_s / self.times_s[-1],
                grip.force_n.max(axis=1) / FORCE_SCALE_N,
                grip.opposition(),
            ]
        )


@dataclass(frozen=True)
class LiftTask(CarriageTask, ABC):
    """The object stands on a table and must be lifted by the carriage, which goes down and up at 0.1 m/s."""

    times_s: ClassVar = (0.0, 1.0, 3.0, 4.5)
    heights_m: ClassVar = (0.0, -0.10, -0.10, 0.05)
    stages: ClassVar = ((0.25, "at the object"), (0.5, "around it"), (0.7, "off the table"), (1.0, "raised"))

    def reset_state(self, readings: Readings) -> TaskState:
        return {"start": readings["object_position"], "lifted": np.zeros(readings.n), "held": _held(readings)}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        # "held": position of the object relative to the functional part when it left the table
        before = state["lifted"] > 0
        lifted = before | (raised_m(readings, state) > _LIFT_OFF_M)
        held = np.where(before[:, None], state["held"], _held(readings))
        return {"start": state["start"], "lifted": lifted.astype(np.float64), "held": held}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        return lift_progress(readings, state)

    def conditions(self, readings: Readings, state: TaskState) -> tuple[Condition, ...]:
        return (*grip_conditions(readings), raised_condition(raised_m(readings, state), RAISED_M))

    @property
    def target(self) -> tuple[Mark, ...]:
        return (Mark(element="joint", name="object_free", by=RAISED_M),)

    @property
    def timetable(self) -> str:
        """Sentence on the motion of the mount."""
        down_s, up_s, end_s = self.times_s[1:]
        return (
            f"The mount comes down to {ABOVE_TABLE_M:g} m above the table within {down_s:g} s, waits for "
            f"{up_s - down_s:g} s and rises by {self.heights_m[-1] - self.heights_m[-2]:.2f} m within "
            f"{end_s - up_s:g} s."
        )


def nearness(readings: Readings) -> FloatArray:
    """Return the nearness of the functional part to the object, 0 to 1, (n,)."""
    return closeness(away_m(readings), within=_NEAR_M, margin=0.2)


def lift_progress(readings: Readings, state: TaskState) -> FloatArray:
    """Return the progress of raising an object in a grip, 0 to 1, (n,); see `LIFT_PROGRESS`."""
    raised = share(raised_m(readings, state), RAISED_M)
    return 0.3 * nearness(readings) + 0.3 * readings.contacts("grip").opposition() + 0.4 * raised


def grip_conditions(readings: Readings) -> tuple[Condition, Condition]:
    """Return the conditions of the stage "around it": nearness, and contacts on opposite sides."""
    return (
        Condition("functional part to object", 1000 * away_m(readings), 1000 * _NEAR_M, at_least=False, unit="mm"),
        Condition("contacts face each other (1: from opposite sides)", readings.contacts("grip").opposition(), 1.0),
    )


def raised_condition(height_m: FloatArray, needed_m: float) -> Condition:
    """Return the condition on the height of an object, (n,) [m], from the required height [m]."""
    return Condition("raised by", 1000 * height_m, 1000 * needed_m, unit="mm")


def away_m(readings: Readings) -> FloatArray:
    """Return the distance of the object from the functional part, (n,) [m]."""
    return np.asarray(np.linalg.norm(_held(readings), axis=1))


def raised_m(readings: Readings, state: TaskState) -> FloatArray:
    """Return the height of the object above its start, (n,) [m]."""
    return np.asarray(readings["object_position"][:, 2] - state["start"][:, 2])


def slip_m(readings: Readings, state: TaskState) -> FloatArray:
    """Return how far the object has moved relative to the functional part since it left the table, (n,) [m]."""
    return np.asarray(np.linalg.norm(_held(readings) - state["held"], axis=1))


def _held(readings: Readings) -> FloatArray:
    """Return the vector from the functional part to the object, (n, 3) [m]."""
    return np.asarray(readings["object_position"] - readings["tip_position"])
