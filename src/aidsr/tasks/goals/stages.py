"""Goals in sequence: each must be met before the next one counts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic_core import to_jsonable_python

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goals.bring import Bring
from aidsr.tasks.goals.environment_index import EnvironmentIndex
from aidsr.tasks.goals.follow import Follow
from aidsr.tasks.goals.goal import Goal, Wording
from aidsr.tasks.goals.goal_readings import GoalReadings
from aidsr.tasks.goals.limits import AnyLimit
from aidsr.tasks.goals.move import Lift, Travel
from aidsr.tasks.goals.reach import Pose, Reach
from aidsr.tasks.goals.touch import Touch
from aidsr.tasks.goals.turn import Turn
from aidsr.tasks.goals.unattended import Sweep
from aidsr.tasks.readings import BoolArray, FloatArray
from aidsr.tasks.shaping import share
from aidsr.tasks.task import Feature, TaskState

_OF_THE_WHOLE = ("time_limit_s", "base", "mount", "vary_m", "limits")

_HOLDING = 0.1
"""Share of a stage's progress for holding it, if required. Our choice: little compared with reaching it."""

Stage = Annotated[Reach | Pose | Lift | Travel | Touch | Turn | Bring | Follow, Field(discriminator="kind")]


class Stages(Goal):
    """Several goals in sequence; the last must be held for the `hold_s` of the whole goal."""

    kind: Literal["stages"]
    stages: Annotated[tuple[Stage, ...], Field(min_length=2)]
    """The goals in their order."""

    wording: ClassVar = Wording(
        "goal/stages", "Goals are met in an order.", "Stages met, and how far the present one is.", ()
    )

    @field_validator("stages", mode="before")
    @classmethod
    def _of_a_stage(cls, value: Any, info: ValidationInfo) -> Any:
        """Give each stage a default `hold_s` of 0 and the time limit of the whole goal.

        Raises:
            ValueError: A stage sets a key that belongs to the whole goal.
        """
        if not isinstance(value, list | tuple):
            return value
        time = {"time_limit_s": info.data["time_limit_s"]} if "time_limit_s" in info.data else {}
        stages = []
        for stage in value:
            if not isinstance(stage, dict):
                stages.append(stage)
                continue
            own = {key: given for key, given in stage.items() if key not in time or given != time[key]}
            if misplaced := [key for key in _OF_THE_WHOLE if key in own and not _is_default(key, own[key])]:
                raise ValueError(
                    f"{misplaced[0]} belongs to the whole goal, not to a stage; write it before [[stages]]"
                )
            stages.append({"hold_s": 0.0, **stage, **time})
        return tuple(stages)

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        times = [stage.by_s for stage in self.stages if stage.by_s is not None]
        if times != sorted(times):
            raise ValueError("by_s must rise from stage to stage")
        last = self.stages[-1]
        if last.hold_s and "hold_s" in last.model_fields_set:
            raise ValueError("the last stage is held as long as the whole; write its hold_s before [[stages]]")
        return self

    def resolved(self, environment: EnvironmentIndex) -> Self:
        return self.model_copy(update={"stages": tuple(stage.resolved(environment) for stage in self.stages)})

    def check_start(self, environment: EnvironmentIndex) -> None:
        # a later stage may ask for what holds at the start: the stages before it end that
        self.stages[0].check_start(environment)

    def _parts(self, seen: GoalReadings) -> Iterator[tuple[int, Goal, GoalReadings]]:
        for index, stage in enumerate(self.stages):
            yield index, stage, GoalReadings(seen.readings, _tag(seen.tag, index), seen.dt_s)

    @property
    def needs_contact(self) -> bool:
        return any(stage.needs_contact for stage in self.stages)

    @property
    def places(self) -> tuple[str, ...]:
        return _all(stage.places for stage in self.stages)

    @property
    def points(self) -> tuple[str, ...]:
        return tuple(name for name in _all(stage.points for stage in self.stages) if name not in self.bodies)

    @property
    def reached(self) -> tuple[tuple[str, float], ...]:
        return tuple(point for stage in self.stages for point in stage.reached)

    @property
    def corners_m(self) -> tuple[tuple[tuple[float, ...], float], ...]:
        return tuple(corner for stage in self.stages for corner in stage.corners_m)

    @property
    def bodies(self) -> tuple[str, ...]:
        return _all(stage.bodies for stage in self.stages)

    @property
    def moves_bodies(self) -> bool:
        return any(stage.moves_bodies for stage in self.stages)

    @property
    def may_target_site(self) -> bool:
        return any(stage.may_target_site for stage in self.stages)

    @property
    def near_m(self) -> float:
        return max(stage.near_m for stage in self.stages)

    @property
    def robot_travels(self) -> bool:
        return super().robot_travels or any(stage.robot_travels for stage in self.stages)

    @property
    def ways(self) -> tuple[tuple[str, float], ...]:
        return tuple(way for stage in self.stages for way in stage.ways)

    def sweeps(self, environment: EnvironmentIndex) -> tuple[Sweep, ...]:
        return tuple(dict.fromkeys(sweep for stage in self.stages for sweep in stage.sweeps(environment)))

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        found = (sensor for i, stage in enumerate(self.stages) for sensor in stage.sensors(_tag(tag, i)))
        return tuple({sensor.name: sensor for sensor in found}.values())

    def bounds(self, tag: str) -> tuple[tuple[str, AnyLimit], ...]:
        return tuple(bound for i, stage in enumerate(self.stages) for bound in stage.bounds(_tag(tag, i)))

    @property
    def features(self) -> tuple[Feature, ...]:
        now = Feature("which stage it is, 1 for the present one", "", (0, 1), "(state)", size=len(self.stages))
        return (now, *(feature for stage in self.stages for feature in stage.features))

    def start(self, seen: GoalReadings) -> TaskState:
        state: dict[str, FloatArray] = {"stage": np.zeros(seen.n), "held_s": np.zeros(seen.n)}
        for index, stage, own in self._parts(seen):
            state |= {f"{index}/{key}": value for key, value in stage.start(own).items()}
        return state

    def update(self, seen: GoalReadings, state: TaskState) -> TaskState:
        now, held_s, after = state["stage"], state["held_s"], dict(state)
        advance = np.zeros(seen.n, dtype=np.bool_)
        for index, stage, own in self._parts(seen):
            present = now == index
            mine = _own(state, index)
            for key, value in stage.update(own, mine).items():
                old = mine[key]
                keep = present.reshape(-1, *[1] * (old.ndim - 1))
                after[f"{index}/{key}"] = np.where(keep, value, old)
            met = present & stage.is_met(own, _own(after, index))
            if index == len(self.stages) - 1:
                break  # scoring checks the hold time of the last stage
            held_s = np.where(present, np.where(met, held_s + seen.dt_s, 0.0), held_s)
            advance |= met & (held_s > max(0.0, stage.hold_s - seen.dt_s / 2))
        after["stage"] = now + advance
        after["held_s"] = np.where(advance, 0.0, held_s)
        return after

    def observe(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        now = (state["stage"][:, None] == np.arange(len(self.stages))).astype(float)
        parts = [stage.observe(own, _own(state, index)) for index, stage, own in self._parts(seen)]
        return np.concatenate([now, *parts], axis=1)

    def progress(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        return np.asarray((state["stage"] + self._of_present(seen, state)) / len(self.stages))

    def _of_present(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        each = []
        for index, stage, own in self._parts(seen):
            progress = stage.progress(own, _own(state, index))
            if self._is_held(index):  # a stage that is met but not yet held is not completed
                progress = (1.0 - _HOLDING) * progress + _HOLDING * share(state["held_s"], stage.hold_s)
            each.append(progress)
        return np.asarray(np.stack(each)[state["stage"].astype(int), np.arange(seen.n)])

    def _is_held(self, index: int) -> bool:
        """Return whether a stage has its own hold time; the last stage has that of the whole goal."""
        return self.stages[index].hold_s > 0.0 and index < len(self.stages) - 1

    def is_met(self, seen: GoalReadings, state: TaskState) -> BoolArray:
        *_, (last, stage, own) = self._parts(seen)
        return np.asarray((state["stage"] == last) & stage.is_met(own, _own(state, last)))

    def losses(self, seen: GoalReadings, state: TaskState) -> dict[str, BoolArray]:
        found: dict[str, BoolArray] = {}
        if late := self._late_text:
            by_s = np.array([np.inf if stage.by_s is None else stage.by_s for stage in self.stages])
            found[late] = np.asarray(seen.readings.time_s > by_s[state["stage"].astype(int)])
        for index, stage, own in self._parts(seen):
            for rule, lost in stage.losses(own, _own(state, index)).items():
                found[rule] = found[rule] | lost if rule in found else lost
        return found

    @property
    def success_text(self) -> str:
        told = []
        for number, stage in enumerate(self.stages, start=1):
            held = f" Held for {stage.hold_s:g} s." if stage.hold_s and number < len(self.stages) else ""
            told.append(f"({number}) {stage.success_text}{held}")
        return "In this order: " + " ".join(told)

    @property
    def violation_text(self) -> str:
        return _joined(stage.violation_text for stage in self.stages)

    @property
    def failure_text(self) -> str:
        return _joined([self._late_text, *(stage.failure_text for stage in self.stages)])

    @property
    def _late_text(self) -> str:
        late = [
            f"stage {number} is not over after {stage.by_s:g} s"
            for number, stage in enumerate(self.stages, start=1)
            if stage.by_s is not None
        ]
        return f"{', or '.join(late).capitalize()}." if late else ""

    @property
    def stage_words(self) -> tuple[tuple[float, str], ...]:
        """Progress of each stage and its words; see `Task.stages`."""
        count = len(self.stages)
        words = []
        for index, stage in enumerate(self.stages):
            if self._is_held(index):
                met = f"stage {index + 1} of {count} met, to be held for {stage.hold_s:g} s"
                words.append(((index + 1.0 - _HOLDING) / count, met))
            words.append(((index + 1.0) / count, f"stage {index + 1} of {count} over"))
        return tuple(words)


def _is_default(key: str, value: Any) -> bool:
    """Return whether a key has its default value: a stage that was written by this program has all keys.

    The form in JSON is compared, because a stage that was read from a file has lists where records have tuples.
    """
    return bool(to_jsonable_python(value) == to_jsonable_python(Goal.model_fields[key].default))


def _tag(tag: str, index: int) -> str:
    return f"{tag}{index + 1}"


def _own(state: TaskState, index: int) -> dict[str, FloatArray]:
    prefix = f"{index}/"
    return {key.removeprefix(prefix): value for key, value in state.items() if key.startswith(prefix)}


def _joined(sentences: Iterable[str]) -> str:
    """Return the sentences that are not empty, each once."""
    return " ".join(dict.fromkeys(filter(None, sentences)))


def _all(names: Iterator[tuple[str, ...]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for each in names for name in each))
