"""Interface of a task: objective, environment, variation, observation, progress and success.

A task works on arrays, not on objects: all its inputs are named sensors with a leading axis of simulations, so the same
code scores one simulation or many. Each task is one `.py` file next to one `.xml` file of the same name.
"""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal, Self

import numpy as np
from lxml import etree

from aidsr.core.artifacts import Base, Brief, ExceededLimit
from aidsr.core.errors import UserError
from aidsr.mjcf.read import parse_document
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.condition import Condition
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.variation import Variation

BENCHMARK_VERSION = 8
"""Version of the benchmark, stored with every result.

It increases when a dimension, a threshold, a variation or an end condition of a task changes.

Version 2 ends an episode that cannot be recovered: a robot 0.1 m outside its lane, an object off the table, on the
floor or out of reach. Before, such episodes were penalized until the time limit, which hid what policies could have
learned.

Version 3 makes the pipe's walls 8 mm thick instead of 3 mm: a tip that was pressed hard came halfway out through the
thin wall. It also changes the progress of drawer_opening, and lets the checks of policies ignore one episode in twenty.

Version 4 removes ways to succeed without a soft body, and makes success test everything that designers are told:
- force_controlled_brushing: success also requires that the whole robot rarely presses with more than 3 N, which was
  stated but not tested. Cells count only in their turn: a mount that moved at random had succeeded in 15 %.
- drawer_opening: a drawer counts as open only while the others are shut, and a robot that starts among the handles
  loses. Three hooks that opened all drawers at once had succeeded in every episode, two of them from behind the bars.
- surface_adapting: success requires contacts at separate places around the curve and compliance with the force limit;
  parts that cannot touch count as length that does not lie on the surface. An arm of which only the tip was solid had
  succeeded by being near.
- pipe_inserting: the tip has to be steered into a branch, while the pipe itself continues straight. A straight rod and
  every slack body had passed the bend of the earlier pipe without steering.
- button_pushing: the button must be pressed after a signal, from its released state, for 0.6 s instead of 0.2 s. Random
  actions had succeeded in a quarter of the episodes, and thirteen fingers that all pulled in 70 %.
- dynamic_catching: the time of the throw is not known beforehand, and the mount turns over after the catch. Constant
  actions had succeeded in 72 % and a basket in 75 %. At the end the ball must be released, which no constant action
  does. No throw begins below the floor any more.
- flat_ground, gap: a robot that falls back by 50 mm loses, and the distance is longer. Rings that shook at random had
  rolled back and forth until they succeeded.
- tunnel: the bend is at least 15 deg. The same rings had passed tunnels that were nearly straight.
- obstacles: each closes one half of a walled lane. Before, there was a straight path beside them.
- stairs, obstacles, gap, tunnel: a robot that starts with a part beyond the beginning loses. A long worm had started
  across the gap.
- all tasks: a valid policy needs its cables and its soft body, and no other actuators; a verdict has 100 episodes.

Version 5 changes only drawer_opening (`Task.unchanged_since`): opening a drawer out of turn loses the episode. One
sequence that contains all six orders had succeeded in every episode without observing which drawer is wanted.

Version 6 changes only crank_turning: turning the crank by more than 90 degrees in the wrong direction loses the
episode. One motion, two turns clockwise and then counterclockwise, had succeeded in both directions.

Version 7 changes two tasks:
- pipe_inserting: the tip must come in through the mouth, stay between the walls, and not be beyond the branch's end.
  An arm beside the pipe could hold its tip behind the branch's open end.
- dynamic_catching: touching the ball before it is thrown loses the episode. It waits within reach of a long hand.
incline also gets the rule on its start that the other courses have, which no recorded robot had broken.

Version 8 changes force_controlled_brushing and delicate_grasping: the force of all contacts together is that of all
contacts. Only the strongest 4 and 8 had counted, so a brush of four flat blocks pressed with 3.9 N and was read as
pressing with 0.98 N, within the band. In dynamic_catching, the check of energy counts the work of the throw, which it
had taken for energy from nowhere; that accepts more, so earlier valid results count.
"""

Level = Literal["standard", "hard"]
Split = Literal["development", "held_out"]
TaskState = Mapping[str, FloatArray]
"""State that a task keeps between the control steps of an episode, by name, each (n, ...)."""
Edits = Mapping[str, Mapping[str, float | tuple[float, ...]]]
"""Attribute values of MJCF elements by "element/name": {"joint/button_slide": {"springref": -0.0025}}."""

FORCE_SCALE_N = 5.0
"""Unit in which contact forces are observed [N]. Our choice: typical contact force of a tendon robot of this size."""
FRICTION_ELSE = (0.005, 0.0001)
"""Torsional and rolling friction in variations that change the sliding friction: MuJoCo's defaults."""
_ENOUGH = 0.5
"""Decisive progress of a task without stages. Our choice."""
_ROUNDING = 1e-6
"""Tolerance of progress: a stage counts as reached this far below its value."""


@dataclass(frozen=True)
class Feature:
    """One group of numbers that a policy observes in addition to its own body."""

    name: str
    unit: str
    """Unit; empty for a dimensionless number."""
    range: tuple[float, float]
    """Smallest and largest value in a good episode; not enforced."""
    source: str
    """Sensors from which it is computed; other sources are in brackets, such as "(time)", "(state)", "(outline)"."""
    size: int = 1
    """Number of values."""


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """Sentences on how a task is judged, formatted from the task's own numbers.

    Designers read them together with the objective, so they must be true at the task's level.
    """

    variation: str
    """Differences between episodes."""
    progress: str
    """Components of the progress; only for the docs, designers do not read it."""
    success: str
    violation: str
    """What the reward penalizes. It is a condition of success only where `success` says so."""
    failure: str = ""
    """Conditions that end an episode as lost; empty if there are none."""


@dataclass(frozen=True)
class Task(ABC):
    """One task at one level. Values that the hard level changes are fields; values of both levels are class constants.

    A subclass in `some_task.py` has its environment in `some_task.xml`.
    """

    name: ClassVar[str]
    """Category and name, for example "reaching/button_pushing"."""
    base: ClassVar[Base]
    time_limit_s: ClassVar[float]
    hold_s: ClassVar[float]
    """How long success must last before it counts [s]."""
    control_dt_s: ClassVar[float] = 0.04
    """Time between two actions [s]. Source: our choice, 25 Hz, above the bandwidth of a tendon winch."""
    needs_contact: ClassVar[bool] = True
    unchanged_since: ClassVar[int] = 4
    """First version of the benchmark whose results of this task are comparable with current ones."""
    required_names: ClassVar[tuple[str, ...]]
    """Bodies, joints, sites, actuators and sensors of the environment that this task requires."""
    sensors: ClassVar[tuple[TaskSensor, ...]]
    """Sensors that scene assembly adds to measure the robot."""
    features: ClassVar[tuple[Feature, ...]]
    """Features that `observe` returns, in this order."""
    needs_outline: ClassVar[bool] = False
    """Whether the task reads the robot's surface; see `Readings.outline`."""
    covers_outline: ClassVar[bool] = False
    """Whether the spheres of the outline cover each geom; otherwise there are three along each."""
    stages: ClassVar[tuple[tuple[float, str], ...]] = ()
    """Progress of each stage and its words, in ascending order: ((0.5, "at the button"), (1.0, "pressed"))."""
    decisive: ClassVar[str] = ""
    """Words of the stage that a body reaches only by doing the essential part of the job. If empty, it is the last but
    one, or the last of at most two stages. The trial sends back a design that no blind motion brings to this stage."""
    policy_actuators: ClassVar[tuple[str, ...]] = ()
    """Actuators of the environment that the policy also drives: an action of -1 to 1 spans their control range."""
    hard: ClassVar[Mapping[str, float]] = {}
    """Values of fields at the hard level; empty for a task without a hard level."""

    level: Level = "standard"

    @classmethod
    def at(cls, level: Level) -> Self:
        """Return the task at a level."""
        return cls(level=level, **(cls.hard if level == "hard" else {}))

    # --- what a designer reads ---

    @property
    @abstractmethod
    def objective(self) -> str:
        """One or two sentences with sizes and goal, without any hint at a mechanism."""

    @property
    @abstractmethod
    def criteria(self) -> Criteria:
        """Sentences on how the task is judged."""

    @property
    def edits(self) -> Edits:
        """Attributes of the environment's MJCF that depend on this task's fields."""
        return {}

    @property
    def environment(self) -> str:
        """MJCF of the environment, without a robot."""
        return edit_environment(_environment_path(type(self)).read_text(encoding="utf-8"), self.edits)

    @property
    def target(self) -> tuple[Mark, ...]:
        """Target positions for pictures; empty if the target is no place, or depends on values that no scene shows."""
        return ()

    def judging(self) -> dict[str, str]:
        """Return the judging by title: differences between episodes, success, violations, stages, time and failure.

        Raises:
            UserError: The task can end an episode as lost, but its criteria do not say when.
        """
        criteria = self.criteria
        if self.can_be_lost() and not criteria.failure:
            method = "losses" if type(self).is_failure is Task.is_failure else "is_failure"
            raise UserError(f'task "{self.name}" defines {method} without a sentence: set Criteria.failure')
        facts = {
            "Episodes differ": criteria.variation,
            "Success": f"{criteria.success} Held for {self.hold_s:g} s.",
            "Penalty": criteria.violation,
            **({"Stages": self._stages_in_words()} if self.stages else {}),
            "Time": f"{self.time_limit_s:g} s, {1 / self.control_dt_s:g} actions a second.",
        }
        if criteria.failure:
            facts["Lost at once"] = criteria.failure
        if self.base == "moving":
            driven = ", ".join(self.policy_actuators)
            facts["Who moves the mount"] = (
                f"The policy drives {driven} beside the robot's own actuators." if driven else "A timetable does."
            )
        return facts

    def _stages_in_words(self) -> str:
        told = ", ".join(f"{words} ({start:.2g})" for start, words in self.stages)
        return f"By progress: {told}; decisive: {self.decisive_stage()[1]}."

    def brief(self) -> Brief:
        """Return the job description for a team of designers."""
        from aidsr.sim.environment_summary import summarize_environment

        environment = self.environment
        return Brief(
            objective=self.objective,
            task=self.name,
            environment=environment,
            summary=summarize_environment(environment),
            base=self.base,
            needs_contact=self.needs_contact,
            judging=self.judging(),
        )

    # --- an episode, in the order of calls ---

    def variation(self, split: Split, index: int) -> Variation:
        """Return the variation of one episode.

        Args:
            split: Agents and training use only "development", scoring uses "held_out". The two never share a seed.
            index: Index of the episode; the same index always gives the same variation.

        Raises:
            ValueError: The index is negative.
        """
        if index < 0:
            raise ValueError(f"negative episode index: {index}")
        seed = np.random.SeedSequence([("development", "held_out").index(split), index])
        return self.sample_variation(np.random.default_rng(seed))

    @abstractmethod
    def sample_variation(self, rng: np.random.Generator) -> Variation:
        """Sample the variation of one episode."""

    def reset_state(self, readings: Readings) -> TaskState:
        """Return the task state at the first readings of an episode."""
        del readings
        return {}

    def script(self, readings: Readings) -> Mapping[str, FloatArray]:
        """Return the controls of the environment's scripted actuators by actuator name, (n,) each."""
        del readings
        return {}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        """Return the task state after one more control step."""
        del readings
        return state

    @abstractmethod
    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        """Return what a policy observes in addition to its own body, (n, k), in the order of `features`."""

    @abstractmethod
    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        """Return the progress of the task, 0 to 1, (n,)."""

    def conditions(self, readings: Readings, state: TaskState) -> tuple[Condition, ...]:
        """Return the measured values behind the stages with their limits; empty if the stages say everything."""
        del readings, state
        return ()

    @abstractmethod
    def violation(self, readings: Readings) -> FloatArray:
        """Return the severity of what the robot must not do, 0 to 1, (n,)."""

    @abstractmethod
    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        """Return whether the goal is met at this moment, (n,); `scoring` requires that it is met for `hold_s`."""

    @classmethod
    def can_be_lost(cls) -> bool:
        """Return whether the task can end an episode as lost: it defines `is_failure` or `losses`."""
        return cls.is_failure is not Task.is_failure or cls.losses is not Task.losses

    def is_failure(self, readings: Readings, state: TaskState) -> BoolArray:
        """Return whether the episode is irrecoverably lost, (n,): by any of `losses`. A task defines one of the two."""
        lost = np.zeros(readings.n, dtype=np.bool_)
        if type(self).losses is not Task.losses:
            for by_rule in self.losses(readings, state).values():
                lost |= by_rule
        return lost

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        """Return `is_failure` for each rule, by the sentence of the rule, (n,) each; for tasks with several rules."""
        # a task that defines this method itself gets no rule from here: they would be asked for each other without end
        if type(self).losses is not Task.losses or type(self).is_failure is Task.is_failure:
            return {}
        return {self.criteria.failure: self.is_failure(readings, state)}

    def exceeded_limits(self, state: TaskState) -> tuple[ExceededLimit, ...]:
        """Return the limits that were exceeded in one episode.

        Args:
            state: Task state of that episode alone, without the axis of episodes.
        """
        del state
        return ()

    def stage_reached(self, progress: float, *, success: bool = False, met: bool = False) -> str:
        """Return in words which stage an episode has reached.

        Args:
            progress: Largest progress of the episode, 0 to 1.
            success: Whether the episode succeeded.
            met: Whether the condition of success held at some time. It can hold below progress 1, for example when a
                button is pressed by the edge of the functional part.
        """
        if success:
            return "held success"
        if met and self.stages:
            return f"{self.stages[-1][1]}, but success was not held"
        before = [words for start, words in self.stages if progress >= start - _ROUNDING]
        after = [words for start, words in self.stages if progress < start - _ROUNDING]
        if not self.stages:
            return f"progress {progress:.2f} of 1"
        if not after:
            return f"{before[-1]}, but success was not held"
        return f"{before[-1] if before else 'begun'}, not yet {after[0]}"

    def decisive_stage(self) -> tuple[float, str]:
        """Return the progress and the words of the decisive stage; see `decisive`."""
        if not self.stages:
            return _ENOUGH, f"progress {_ENOUGH:g}"
        named = [stage for stage in self.stages if stage[1] == self.decisive]
        return named[0] if named else self.stages[-2 if len(self.stages) > 2 else -1]

    def is_decisive(self, progress: float) -> bool:
        """Return whether this progress reaches the decisive stage."""
        return progress >= self.decisive_stage()[0] - _ROUNDING


def find_fault(task: type[Task]) -> str:
    """Return the first fault of a task class, empty if there is none.

    Faults: missing members, an unknown decisive stage, no environment, or required names that are not in it.
    """
    constants = ("base", "time_limit_s", "hold_s", "required_names", "sensors", "features")
    if missing := [*sorted(task.__abstractmethods__), *(name for name in constants if not hasattr(task, name))]:
        return f"{task.__name__} does not define {', '.join(missing)}"
    if task.decisive and task.decisive not in (words for _, words in task.stages):
        return f'{task.__name__} calls "{task.decisive}" decisive, which is none of its stages'
    path = _environment_path(task)
    if task.environment is Task.environment and not path.is_file():
        return f"{path} not found"
    elements = list(parse_document(task.at("standard").environment).root.iter())
    if any(element.tag in ("include", "attach", "replicate") for element in elements):
        return ""  # these add names that are not in the text
    names = {element.get("name") for element in elements}
    if missing := [name for name in task.required_names if name not in names]:
        return f"required_names not in the environment: {', '.join(missing)}"
    return ""


def span(low_high: tuple[float, float], scale: float = 1.0) -> str:
    """Return a range times `scale` as "0.6 to 1.2", or as one number if both ends are equal."""
    low, high = (f"{scale * number:g}" for number in low_high)
    return low if low == high else f"{low} to {high}"


def _environment_path(task: type[Task]) -> Path:
    return Path(str(sys.modules[task.__module__].__file__)).with_suffix(".xml")


def edit_environment(mjcf: str, edits: Edits) -> str:
    """Return the MJCF of an environment, or of a scene that contains one, with some attributes set.

    If all attributes already have their values, the text is returned unchanged.
    """
    root = parse_document(mjcf).root
    changed = False
    for place, attributes in edits.items():
        element, _, name = place.partition("/")
        (found,) = (node for node in root.iter(element) if node.get("name") == name)
        for attribute, value in attributes.items():
            wanted = np.atleast_1d(value)
            present = np.array([float(number) for number in found.get(attribute, "").split()])
            if present.shape != wanted.shape or not np.allclose(present, wanted, rtol=1e-6, atol=1e-9):
                found.set(attribute, " ".join(f"{number:.9g}" for number in wanted))
                changed = True
    return etree.tostring(root.getroottree(), encoding="unicode") if changed else mjcf
