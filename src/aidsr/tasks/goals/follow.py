"""The goal of following a path of straight lines."""

from __future__ import annotations

from functools import cached_property
from itertools import groupby, pairwise
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import field_validator, model_validator

from aidsr.core.errors import UserError
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goals.environment_index import EnvironmentIndex, unknown
from aidsr.tasks.goals.goal import COMING, MARGIN_M, NEAR_M, Goal, Wording, length_m
from aidsr.tasks.goals.goal_readings import GoalReadings
from aidsr.tasks.goals.numbers import Finite, Positive, three_numbers
from aidsr.tasks.readings import BoolArray, FloatArray
from aidsr.tasks.shaping import closeness
from aidsr.tasks.task import Feature, TaskState

_NEAR = 0.2
"""Share of the progress for being at the path. Our choice: enough to guide there, and less than following it."""
_MOST_POINTS = 400
"""Largest number of points of a sampled path. Our choice: the distance to each is computed at every step."""
_AHEAD_POINTS = 4
"""Largest advance along the path in one control step, in points of the sampled path: twice `within_m`. Our choice: a
faster motion does not follow the path, and a path that comes back near itself cannot be cut short."""


class Follow(Goal):
    """The functional part, or a body, moves along a path and stays near it."""

    wording: ClassVar = Wording(
        "goal/follow",
        "A path is followed.",
        "Two tenths for being at the path, the rest for the length followed.",
        ((0.15, "at the path"), (0.6, "half of the path"), (1.0, "all of the path")),
    )
    kind: Literal["follow"]
    target: str = ""
    """Body whose centre of mass must follow the path; if empty, the functional part must follow it."""
    path_m: tuple[tuple[Finite, ...], ...] = ()
    """Corners of the path in world coordinates [m]."""
    sites: tuple[str, ...] = ()
    """Sites of the environment to use as corners instead, at their positions at the start."""
    within_m: Positive = 0.02
    """Largest distance from the path that still counts as following it [m]."""

    @field_validator("path_m")
    @classmethod
    def _points(cls, value: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
        return tuple(three_numbers(point) for point in value)

    @model_validator(mode="after")
    def _a_path(self) -> Self:
        if bool(self.path_m) and bool(self.sites):
            raise ValueError("a path is given by path_m or by sites, not by both")
        if max(len(self.path_m), len(self.sites)) < 2:
            raise ValueError("a path needs two points or more: path_m, or sites of the environment")
        if self.path_m and self._lengths_m.min() <= 0:
            raise ValueError("path_m has the same point twice in a row; leave one out")
        return self

    def resolved(self, environment: EnvironmentIndex) -> Self:
        if self.target:
            environment.require_movable(self.target, "follow")
        for name in self.sites:
            if name not in environment.sites:
                raise unknown("site", name, "a path leads through sites of the environment", environment.sites)
        for one, other in pairwise(self.sites):
            if environment.sites[one] == environment.sites[other]:
                raise UserError(f'the sites "{one}" and "{other}" of the path are at the same point; leave one out')
        path_m = tuple(environment.sites[name] for name in self.sites) or self.path_m
        found = self.model_copy(update={"path_m": path_m, "sites": ()})
        length_m = found._lengths_m.sum()
        if length_m / self._step_m > _MOST_POINTS:
            raise UserError(
                f"a path of {length_m:.3g} m that is followed within {self.within_m:g} m is too long; "
                "allow more beside it, or make it shorter"
            )
        return found

    @property
    def moves_bodies(self) -> bool:
        return bool(self.target)

    @property
    def needs_contact(self) -> bool:
        return bool(self.target)

    @property
    def corners_m(self) -> tuple[tuple[tuple[float, ...], float], ...]:
        return () if self.target else tuple((point, self.within_m) for point in self.path_m)

    @property
    def ways(self) -> tuple[tuple[str, float], ...]:
        return ((self.target or "functional_part", float(self._lengths_m.sum())),)

    @property
    def _lengths_m(self) -> FloatArray:
        return np.asarray(np.linalg.norm(np.diff(np.array(self.path_m), axis=0), axis=1))

    @property
    def _step_m(self) -> float:
        return self.within_m / 2

    @cached_property
    def line_m(self) -> FloatArray:
        """Points along the path, at most half a tolerance apart, (m, 3) [m]."""
        corners = np.array(self.path_m)
        pieces = [
            np.linspace(one, other, max(2, int(np.ceil(length / self._step_m)) + 1))[:-1]
            for one, other, length in zip(corners, corners[1:], self._lengths_m, strict=False)
        ]
        return np.concatenate([*pieces, corners[-1:]])

    def fewest_steps_near(self, marked: BoolArray) -> int:
        """Return the smallest number of control steps that end near marked points if the whole path is followed.

        Args:
            marked: Whether each point of `line_m` is marked, (m,).
        """
        runs = (len(list(run)) for is_marked, run in groupby(marked.tolist()) if is_marked)
        # the first point may be reached before the first step
        return sum((length - 1) // _AHEAD_POINTS for length in runs)

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        tip = TaskSensor(name=f"{tag}_tip", quantity="position")
        if not self.target:
            return (tip,)
        return (tip, TaskSensor(name=f"{tag}_position", quantity="target_center_of_mass", target=self.target))

    @property
    def features(self) -> tuple[Feature, ...]:
        own = (
            Feature("from the farthest point that was followed", "m", (-2, 2), "goal_tip", size=3),
            Feature("from there to a point ahead", "m", (-1, 1), "(state)", size=3),
            Feature("share of the path followed", "", (0, 1), "(state)"),
        )
        return (
            (*own, Feature("functional part from the body", "m", (-2, 2), "goal_tip", size=3)) if self.target else own
        )

    def start(self, seen: GoalReadings) -> TaskState:
        """Return the state: the index of the last point followed, (n,), or -1 before the first point is reached.

        It is -1 again for a follower that leaves the part of the path up to a little ahead of this point.
        """
        return self.update(seen, {"index": np.full(seen.n, -1.0)})

    def update(self, seen: GoalReadings, state: TaskState) -> TaskState:
        line, follower_m = self.line_m, self._follower_m(seen)
        distance_m = length_m(follower_m[:, None] - line[None])
        number = np.arange(len(line))[None]
        known = number[:, :-1] <= state["index"][:, None] + _AHEAD_POINTS
        beside_m = np.where(known, self._beside_m(follower_m), np.inf).min(axis=1)
        index = np.where(beside_m <= self.within_m, state["index"], -1)
        last = np.where(index < 0, 0, index + _AHEAD_POINTS)[:, None]  # following begins at the first point
        reached = (distance_m <= self.within_m) & (number > index[:, None]) & (number <= last)
        farthest = np.where(reached, number, -1).max(axis=1)
        return {"index": np.maximum(index, farthest).astype(float)}

    def observe(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        line, at = self.line_m, np.maximum(state["index"], 0).astype(int)
        there = line[at]
        ahead = line[np.minimum(at + 2 * _AHEAD_POINTS, len(line) - 1)]
        share = np.maximum(state["index"], 0)[:, None] / (len(line) - 1)
        columns = [self._follower_m(seen) - there, ahead - there, share]
        return np.concatenate([*columns, seen["tip"] - seen["position"]] if self.target else columns, axis=1)

    def progress(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        line, index = self.line_m, state["index"]
        followed = np.maximum(index, 0) / (len(line) - 1)
        away_m = length_m(self._follower_m(seen) - line[np.maximum(index, 0).astype(int)])
        done = _NEAR * closeness(away_m, within=self.within_m, margin=MARGIN_M) + (1.0 - _NEAR) * followed
        if not self.target:
            return np.asarray(done)
        to_body_m = length_m(seen["tip"] - seen["position"])
        near = np.maximum(closeness(to_body_m, within=NEAR_M, margin=MARGIN_M), followed)
        return np.asarray(COMING * near + (1.0 - COMING) * done)

    def is_met(self, seen: GoalReadings, state: TaskState) -> BoolArray:
        """Return whether the whole path was followed and the follower is still at its end, (n,)."""
        at_end = length_m(self._follower_m(seen) - self.line_m[-1]) <= self.within_m
        return np.asarray((state["index"] >= len(self.line_m) - 1) & at_end)

    def _beside_m(self, point_m: FloatArray) -> FloatArray:
        """Return the distances of points, (n, 3) [m], from the lines between neighbours of `line_m`, (n, m - 1) [m]."""
        start, way = self.line_m[:-1], np.diff(self.line_m, axis=0)
        from_start = point_m[:, None] - start
        share = np.clip((from_start * way).sum(axis=-1) / np.square(way).sum(axis=-1), 0.0, 1.0)
        return length_m(from_start - share[..., None] * way)

    def _follower_m(self, seen: GoalReadings) -> FloatArray:
        return seen["position" if self.target else "tip"]

    @property
    def success_text(self) -> str:
        who = (
            f"The centre of mass of {self.target}" if self.target else "The point with which the functional part works"
        )
        corners = " to ".join("(" + ", ".join(f"{each:g}" for each in point) + ")" for point in self.path_m)
        return (
            f"{who} has gone from {corners} m, never more than {self.within_m:g} m beside the lines between, and is at "
            "their end. Who leaves them has to begin again at the first point."
        )
