"""The goal of bringing bodies into a region: all of them, some, or each at some time."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from aidsr.core.errors import UserError
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goals.environment_index import EnvironmentIndex
from aidsr.tasks.goals.goal import COMING, MARGIN_M, NEAR_M, Goal, Wording, length_m
from aidsr.tasks.goals.goal_readings import GoalReadings
from aidsr.tasks.goals.region import Region
from aidsr.tasks.readings import BoolArray, FloatArray
from aidsr.tasks.shaping import closeness
from aidsr.tasks.task import Feature, TaskState

_MOST = 20
"""Largest number of bodies in one goal. Our choice: a policy observes six numbers of each."""
_LEAST_WAY_M = 0.01
"""Smallest distance from the region at the start that progress is measured by [m]. Our choice: no division by 0."""


class Bring(Goal):
    """The centres of mass of bodies are brought into a region."""

    wording: ClassVar = Wording(
        "goal/bring",
        "Bodies are brought into a region.",
        "The way of the bodies that count, of which three tenths are had for coming to the next.",
        ((0.1, "at a body"), (0.5, "half done"), (1.0, "all there")),
    )
    kind: Literal["bring"]
    targets: Annotated[tuple[str, ...], Field(min_length=1)]
    """Bodies of the environment; "pellet_*" stands for all bodies whose names begin with "pellet_"."""
    region: Region
    """Region into which the bodies are brought."""
    count: Annotated[int, Field(ge=1)] | Literal["all", "each"] = "all"
    """How many must be in the region: "all" or a number at the same time, or "each" at some time during the episode."""

    def resolved(self, environment: EnvironmentIndex) -> Self:
        targets = environment.matching(self.targets, "bring")
        if len(targets) > _MOST:
            raise UserError(f"{len(targets)} targets; a goal takes at most {_MOST}: name fewer")
        if isinstance(self.count, int) and self.count > len(targets):
            raise UserError(f"count is {self.count}, and there are only {len(targets)} targets: {', '.join(targets)}")
        for name in targets:
            environment.require_movable(name, "bring")
        self.region.check(environment, "bring")
        found = self.model_copy(update={"targets": targets})
        if self.region.center_m is not None:
            self._require_ways(environment, targets, found.needed)
        return found

    def check_start(self, environment: EnvironmentIndex) -> None:
        centers_m = environment.mechanism.centers_m
        points = np.array([centers_m[name] for name in self.targets])[None]
        inside = self.region.outside_m(points, np.array(self.region.start_m(environment))[None]) <= 0.0
        if inside.sum() >= self.needed:
            there = ", ".join(name for name, is_in in zip(self.targets, inside[0], strict=True) if is_in)
            raise UserError(f"the goal is met before anything moves: {there} begin in {self.region.words}")

    def _require_ways(self, environment: EnvironmentIndex, targets: tuple[str, ...], needed: int) -> None:
        """Refuse a region that too few bodies can reach, because of their joints.

        Raises:
            UserError: Fewer than `needed` bodies can reach it.
        """
        kept: list[UserError] = []
        for name in targets:
            start = np.array(environment.mechanism.centers_m[name])
            way = self.region.nearest_m(start) - start
            far_m = float(np.linalg.norm(way)) - float(np.linalg.norm(self.vary_m))
            try:
                if far_m > 0.0:
                    environment.require_way(
                        name, tuple(np.round(way / np.linalg.norm(way), 3).tolist()), round(far_m, 4)
                    )
            except UserError as error:
                kept.append(error)
        if len(targets) - len(kept) < needed:
            raise kept[0]

    @property
    def needed(self) -> int:
        """Number of bodies that must be in the region."""
        return self.count if isinstance(self.count, int) else len(self.targets)

    @property
    def places(self) -> tuple[str, ...]:
        return self.targets

    @property
    def moves_bodies(self) -> bool:
        return True

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        return (
            TaskSensor(name=f"{tag}_tip", quantity="position"),
            *self.region.sensors(tag),
            *(
                TaskSensor(name=f"{tag}_body{index}", quantity="target_center_of_mass", target=name)
                for index, name in enumerate(self.targets)
            ),
        )

    @property
    def features(self) -> tuple[Feature, ...]:
        k = len(self.targets)
        return (
            Feature("functional part from each body's centre of mass", "m", (-2, 2), "goal_tip, goal_body", size=3 * k),
            Feature("each body from the middle of the region", "m", (-2, 2), "goal_body, goal_region", size=3 * k),
        )

    def start(self, seen: GoalReadings) -> TaskState:
        outside_m = self._outside_m(seen)
        return {"way_m": np.maximum(outside_m, _LEAST_WAY_M), "been": (outside_m <= 0.0).astype(float)}

    def update(self, seen: GoalReadings, state: TaskState) -> TaskState:
        return {**state, "been": np.maximum(state["been"], self._outside_m(seen) <= 0.0)}

    def observe(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        del state
        bodies_m = self._bodies_m(seen)
        from_tip = seen["tip"][:, None] - bodies_m
        from_middle = bodies_m - self.region.middle_m(seen)[:, None]
        return np.concatenate([from_tip.reshape(seen.n, -1), from_middle.reshape(seen.n, -1)], axis=1)

    def progress(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        moved = np.clip(1.0 - self._outside_m(seen) / state["way_m"], 0.0, 1.0)
        if self.count == "each":
            moved = np.maximum(moved, state["been"])
        near = closeness(length_m(seen["tip"][:, None] - self._bodies_m(seen)), within=NEAR_M, margin=MARGIN_M)
        done = np.sort(moved, axis=1)[:, -self.needed :].mean(axis=1)
        # nearness counts for one body only: carrying it away from the others costs nothing
        coming = (near * (1.0 - moved)).max(axis=1) / self.needed
        return np.asarray(np.minimum(done + COMING * coming, 1.0))

    def is_met(self, seen: GoalReadings, state: TaskState) -> BoolArray:
        there = state["been"] > 0 if self.count == "each" else self._outside_m(seen) <= 0.0
        return np.asarray(there.sum(axis=1) >= self.needed)

    def _bodies_m(self, seen: GoalReadings) -> FloatArray:
        """Return the centres of mass, (n, k, 3) [m]."""
        return np.stack([seen[f"body{index}"] for index in range(len(self.targets))], axis=1)

    def _outside_m(self, seen: GoalReadings) -> FloatArray:
        """Return the distance of each body from the region, 0 inside, (n, k) [m]."""
        return self.region.outside_m(self._bodies_m(seen), self.region.middle_m(seen))

    @property
    def success_text(self) -> str:
        names, where = ", ".join(self.targets), self.region.words
        if len(self.targets) == 1:
            return f"The centre of mass of {names} is in {where}."
        if self.count == "each":
            return f"The centre of mass of each of {names} has been in {where}, at any time."
        many = "all" if self.needed == len(self.targets) else f"at least {self.needed}"
        return f"The centres of mass of {many} of {names} are in {where} at the same time."
