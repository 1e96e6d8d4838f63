"""Drive of a mount that moves: timetables, the policy, or both for different actuators."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from aidsr.core.artifacts import Artifact
from aidsr.core.errors import UserError
from aidsr.sim.mechanism import ActuatorFacts
from aidsr.tasks.goals.environment_index import EnvironmentIndex, unknown
from aidsr.tasks.goals.numbers import Finite
from aidsr.tasks.readings import FloatArray


class Course(Artifact):
    """Timetable of one actuator."""

    actuator: str
    points: Annotated[tuple[tuple[Finite, Finite], ...], Field(min_length=1)]
    """Pairs of time [s] and control; interpolated linearly, constant before the first pair and after the last."""

    @field_validator("points")
    @classmethod
    def _rising(cls, value: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        times = [time_s for time_s, _ in value]
        if times != sorted(set(times)):
            raise ValueError("times must rise; write [[0, 0], [2, 0.1]]: seconds and control")
        return value


class MountDrive(Artifact):
    """Actuators of the environment that the policy drives, and timetables of others."""

    policy: tuple[str, ...] = ()
    """Actuators that the policy drives in addition to the robot's own."""
    timetable: tuple[Course, ...] = ()
    """Timetables of other actuators; actuators that are not named stay at 0."""

    @property
    def drives(self) -> bool:
        """Whether any actuator is driven."""
        return bool(self.policy or self.timetable)

    def check(self, environment: EnvironmentIndex) -> None:
        """Refuse a drive that cannot move the mount.

        Raises:
            UserError: An actuator does not exist, is driven twice, or has no suitable control range; or none of the
                actuators moves a mount.
        """
        if not self.drives:
            return
        known = {each.name: each for each in environment.mechanism.actuators if each.name}
        names = [*self.policy, *(course.actuator for course in self.timetable)]
        for name in names:
            if name not in known:
                raise unknown("actuator", name, "[mount] drives actuators of the environment", known)
            if names.count(name) > 1:
                raise UserError(f'"{name}" is driven twice; leave it to the policy or to one timetable')
        for name in self.policy:
            if known[name].low is None:
                raise UserError(f'"{name}" has no ctrlrange, which a policy\'s actions span; give it one')
        for course in self.timetable:
            _check_range(course, known[course.actuator])
        moving = {joint for mount in environment.summary.mounts for joint in mount.moved_by}
        if not any(known[name].joint in moving for name in names):
            raise UserError(
                'base "moving": none of the actuators in [mount] drives a joint that carries a mount; put the site '
                '"mount" on the body that they move, or leave the base "fixed"'
            )

    def controls(self, time_s: FloatArray) -> dict[str, FloatArray]:
        """Return the controls of the timetables by actuator name, (n,) each."""
        return {course.actuator: np.interp(time_s, *np.array(course.points).T) for course in self.timetable}

    @property
    def sentence(self) -> str:
        """Sentences on what moves the mount."""
        said = []
        if self.policy:
            said.append(f"The policy drives {', '.join(self.policy)} beside the robot's own actuators.")
        for course in self.timetable:
            points = ", ".join(f"{control:g} at {time_s:g} s" for time_s, control in course.points)
            said.append(f"A timetable drives {course.actuator}: {points}.")
        return " ".join(said)


def _check_range(course: Course, actuator: ActuatorFacts) -> None:
    low, high = actuator.low, actuator.high
    for _, control in course.points:
        if low is not None and high is not None and not low <= control <= high:
            raise UserError(
                f'the timetable of "{course.actuator}" asks for {control:g}, outside its ctrlrange {low:g} to {high:g}'
            )
