"""Limits that must not be exceeded while a goal is pursued: one record for each kind of limit."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from aidsr.core.artifacts import Artifact
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goals.environment_index import EnvironmentIndex
from aidsr.tasks.goals.goal_readings import GoalReadings
from aidsr.tasks.goals.numbers import Positive
from aidsr.tasks.goals.region import Region
from aidsr.tasks.readings import FloatArray
from aidsr.tasks.shaping import excess

ROBOT, PART = "robot", "functional_part"
_WHO = {ROBOT: "robot", PART: "functional part"}

TOLERATED_S = 0.2
"""Total time for which limits may be exceeded in a successful episode [s]. Our choice: one impact, not several."""
ROUNDING_S = 1e-9
"""Tolerance of this time, because the sum of many time steps has a rounding error [s]."""
_FULL_MM = 20.0
"""Depth in a forbidden region at which the violation is 1 [mm]. Our choice: a limb of this size is then all inside."""


class Limit(Artifact):
    """Base class of all kinds of limit."""

    @abstractmethod
    def check(self, environment: EnvironmentIndex) -> None:
        """Check the names in the limit.

        Raises:
            UserError: A name does not exist in the environment or does not suit the limit.
        """

    @property
    def needs_outline(self) -> bool:
        """Whether the limit concerns the robot's whole surface."""
        return False

    @abstractmethod
    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        """Return the sensors that measure the limited value."""

    @abstractmethod
    def measured(self, seen: GoalReadings) -> FloatArray:
        """Return the measured value that must not exceed `allowed`, (n,), in `unit`."""

    @property
    @abstractmethod
    def allowed(self) -> float:
        """Largest allowed value, in `unit`."""

    unit: ClassVar[str]
    """Unit of the measured value."""

    def severity(self, measured: FloatArray) -> FloatArray:
        """Return how severely measured values exceed the limit, 0 to 1, (n,)."""
        return excess(measured, self.allowed)

    @property
    @abstractmethod
    def subject(self) -> str:
        """Subject of the limit, such as "force on panel"."""

    @property
    @abstractmethod
    def sentence(self) -> str:
        """Sentence on what exceeds the limit."""


class KeepOut(Limit, Region):
    """A region that the robot, or something else, must keep out of."""

    kind: Literal["keep_out"]
    what: str = ROBOT
    """What must keep out: "robot" (all of it), "functional_part", or a body of the environment (its centre of mass)."""

    def check(self, environment: EnvironmentIndex, kind: str = "keep_out") -> None:
        """See `Limit`."""
        Region.check(self, environment, kind)
        if self.what not in (ROBOT, PART):
            environment.body(self.what, "keep_out")

    @property
    def needs_outline(self) -> bool:
        """See `Limit`."""
        return self.what == ROBOT

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        """See `Limit`."""
        region = Region.sensors(self, tag)
        if self.what == ROBOT:
            return region
        if self.what == PART:
            return (*region, TaskSensor(name=f"{tag}_position", quantity="position"))
        return (*region, TaskSensor(name=f"{tag}_position", quantity="target_center_of_mass", target=self.what))

    unit: ClassVar = "mm"

    @property
    def allowed(self) -> float:
        """See `Limit`."""
        return 0.0

    def measured(self, seen: GoalReadings) -> FloatArray:
        """See `Limit`; the depth in the region."""
        if self.what == ROBOT:
            body = seen.readings.body
            deepest = (self.depth_m(body.center_m, self.middle_m(seen)) - body.radius_m).min(axis=1)
        else:
            deepest = self.depth_m(seen["position"][:, None], self.middle_m(seen))[:, 0]
        return np.asarray(-1000.0 * deepest)

    def severity(self, measured: FloatArray) -> FloatArray:
        """See `Limit`."""
        return np.asarray(np.clip(measured / _FULL_MM, 0.0, 1.0))

    @property
    def subject(self) -> str:
        """See `Limit`."""
        return f"{_WHO.get(self.what, self.what)} in {self.words}"

    @property
    def sentence(self) -> str:
        """See `Limit`."""
        who = {ROBOT: "Any part of the robot", PART: "The functional part"}.get(self.what, f"{self.what}")
        return f"{who} in {self.words}."


class SpeedLimit(Limit):
    """An upper limit on the speed of something."""

    kind: Literal["speed"]
    of: str = PART
    """What must not be faster: "functional_part", "robot" (its centre of mass), or a body of the environment."""
    at_most_m_s: Positive
    """Largest mean speed between two control steps [m/s]."""

    def check(self, environment: EnvironmentIndex) -> None:
        """See `Limit`."""
        if self.of not in (ROBOT, PART):
            environment.require_movable(self.of, "speed")

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        """See `Limit`."""
        name = f"{tag}_velocity"
        if self.of == PART:
            return (TaskSensor(name=name, quantity="linear_velocity"),)
        if self.of == ROBOT:
            return (TaskSensor(name=name, quantity="center_of_mass_velocity"),)
        return (TaskSensor(name=name, quantity="target_velocity", target=self.of),)

    unit: ClassVar = "m/s"

    def measured(self, seen: GoalReadings) -> FloatArray:
        """See `Limit`."""
        return seen.mean_speed_m_s("velocity")

    @property
    def allowed(self) -> float:
        """See `Limit`."""
        return self.at_most_m_s

    @property
    def subject(self) -> str:
        """See `Limit`."""
        return f"speed of {_WHO.get(self.of, self.of)}"

    @property
    def sentence(self) -> str:
        """See `Limit`."""
        what = {ROBOT: "the robot's centre of mass", PART: "the functional part"}.get(self.of, self.of)
        return f"More than {self.at_most_m_s:g} m/s of {what}."


class ForceLimit(Limit):
    """An upper limit on the force on a body."""

    kind: Literal["force"]
    on: str
    """Body of the environment."""
    at_most_n: Positive
    """Largest sum of the normal forces of the robot's contacts [N]: in a net force those of two jaws would cancel."""

    def check(self, environment: EnvironmentIndex) -> None:
        """See `Limit`."""
        environment.require_solid(self.on, "force")

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        """See `Limit`."""
        return (TaskSensor(name=f"{tag}_contacts", quantity="contacts", target=self.on, slots=8),)

    unit: ClassVar = "N"

    def measured(self, seen: GoalReadings) -> FloatArray:
        """See `Limit`."""
        return seen.all_contacts_n("contacts")

    @property
    def allowed(self) -> float:
        """See `Limit`."""
        return self.at_most_n

    @property
    def subject(self) -> str:
        """See `Limit`."""
        return f"force on {self.on}"

    @property
    def sentence(self) -> str:
        """See `Limit`."""
        return f"More than {self.at_most_n:g} N by the robot on {self.on}, all contacts together."


class NetForceLimit(ForceLimit):
    """An upper limit on the net force on a body, which a goal that asks for a net force sets itself."""

    def measured(self, seen: GoalReadings) -> FloatArray:
        """See `Limit`; the goal has the sensor."""
        return seen.peak_force_n("force")


AnyLimit = Annotated[KeepOut | SpeedLimit | ForceLimit, Field(discriminator="kind")]
