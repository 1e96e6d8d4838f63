"""A region of space: a box along the world axes or a ball, around a fixed point or around a site or body."""

from __future__ import annotations

from itertools import product
from typing import Self

import numpy as np
from pydantic import field_validator, model_validator

from aidsr.core.artifacts import Artifact
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goals.environment_index import EnvironmentIndex
from aidsr.tasks.goals.goal_readings import GoalReadings
from aidsr.tasks.goals.numbers import Finite, Positive, three_numbers
from aidsr.tasks.readings import FloatArray


class Region(Artifact):
    """A box or a ball, with its centre."""

    at: str = ""
    """Site, or body by its origin, that the centre follows; empty if `center_m` is given."""
    center_m: tuple[Finite, ...] | None = None
    """Fixed centre in world coordinates [m]."""
    size_m: tuple[Positive, ...] | None = None
    """Side lengths of the box along x, y and z [m]."""
    radius_m: Positive | None = None
    """Radius of the ball [m]."""

    @field_validator("center_m", "size_m")
    @classmethod
    def _three(cls, value: tuple[float, ...] | None) -> tuple[float, ...] | None:
        return value if value is None else three_numbers(value)

    @model_validator(mode="after")
    def _one_of_each(self) -> Self:
        if (self.center_m is None) == (not self.at):
            raise ValueError("a region requires either `center_m`, a point, or `at`, a site or a body")
        if (self.size_m is None) == (self.radius_m is None):
            raise ValueError("a region requires either `size_m`, of a box, or `radius_m`, of a ball")
        return self

    def check(self, environment: EnvironmentIndex, kind: str) -> None:
        """Refuse a region around something that does not exist.

        Raises:
            UserError: `at` is neither a site nor a body of the environment.
        """
        if self.at:
            environment.require_place(self.at, kind)

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        """Return the sensor of the centre; none if the centre is fixed."""
        return (TaskSensor(name=f"{tag}_region", quantity="target_position", target=self.at),) if self.at else ()

    def start_m(self, environment: EnvironmentIndex) -> tuple[float, ...]:
        """Return the centre at the start, (3,) [m]; for a body its origin, as the sensor measures it."""
        return self.center_m or environment.sites.get(self.at) or environment.body(self.at, "region").position_m

    def middle_m(self, seen: GoalReadings) -> FloatArray:
        """Return the centre, (n, 3) [m]."""
        return np.tile(self.center_m, (seen.n, 1)) if self.center_m is not None else seen["region"]

    def outside_m(self, points_m: FloatArray, middle_m: FloatArray) -> FloatArray:
        """Return the distances of points from the region, 0 inside.

        Args:
            points_m: Points, (n, k, 3) [m].
            middle_m: Centre of the region, (n, 3) [m].

        Returns:
            Distances, (n, k) [m].
        """
        return np.maximum(self.depth_m(points_m, middle_m), 0.0)

    def depth_m(self, points_m: FloatArray, middle_m: FloatArray) -> FloatArray:
        """Return signed distances of points from the surface, negative inside, (n, k, 3) and (n, 3) -> (n, k) [m]."""
        away = points_m - middle_m[:, None]
        if self.size_m is None:
            assert self.radius_m is not None
            return np.asarray(np.linalg.norm(away, axis=-1) - self.radius_m)
        beyond = np.abs(away) - np.array(self.size_m) / 2
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
        return np.asarray(outside + np.minimum(beyond.max(axis=-1), 0.0))

    def lies_in(self, other: Region) -> bool:
        """Return whether every point of the region is inside another one; False unless both have a `center_m`."""
        if self.center_m is None or other.center_m is None:
            return False
        points_m, margin_m = np.array([self.center_m]), self.radius_m or 0.0
        if self.size_m is not None:
            points_m = points_m + np.array(list(product((-0.5, 0.5), repeat=3))) * self.size_m
        return bool((other.depth_m(points_m[None], np.array([other.center_m])) < -margin_m).all())

    def nearest_m(self, point_m: FloatArray) -> FloatArray:
        """Return the point of the region nearest to a given point, (3,) [m]; only with a `center_m`."""
        middle = np.array(self.center_m)
        away = point_m - middle
        if self.size_m is None:
            assert self.radius_m is not None
            return np.asarray(middle + away * min(1.0, self.radius_m / max(float(np.linalg.norm(away)), 1e-12)))
        half = np.array(self.size_m) / 2
        return np.asarray(middle + np.clip(away, -half, half))

    @property
    def words(self) -> str:
        """Shape and place of the region, as the end of a sentence."""
        shape = (
            f"the ball of radius {self.radius_m:g} m"
            if self.size_m is None
            else "the box of " + " x ".join(f"{length:g}" for length in self.size_m) + " m"
        )
        where = self.at if self.center_m is None else "(" + ", ".join(f"{each:g}" for each in self.center_m) + ") m"
        return f"{shape} about {where}"
