"""The contract of a task: objective, environment, what varies, what is observed, how far it is done.

A task is arrays, not objects: everything it reads are named sensors with a leading axis of simulations, so the same few
lines score one simulation or many. One task is one `.py` file beside one `.xml` file of the same name.
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

from aidsr.core.artifacts import Base, Brief, PassedLimit
from aidsr.core.errors import UserError
from aidsr.mjcf.read import parse_document
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.condition import Condition
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.variation import Variation

BENCHMARK_VERSION = 5
"""Changes whenever a dimension, a threshold, a variation or an end of a task does; every result carries it.

Version 2 ends an episode that cannot be recovered: a robot 0.1 m outside its lane, an object off the table, on the
floor or out of reach. Before, policies paid for it to the time limit, which drowned what they could have learned.

Version 3 makes the pipe's walls 8 mm thick and not 3, through which a tip that was pressed hard came half out. It also
changes the progress of the drawers, and lets the checks of policies ignore one episode in twenty.

Version 4 closes ways to success that need no soft body, and tests by success what designers are told:
- force_controlled_brushing: success also asks that the whole robot hardly ever presses with more than 3 N, which was
  asked for and not tested. Cells count in their turn only: a mount that moved at random had won 15 %.
- drawer_opening: a drawer counts as open only while the others are shut, and a robot that starts among the handles has
  lost. Three hooks that opened all drawers at once had won every episode, two of them from behind the bars.
- surface_adapting: success asks for contact at places apart around the curve and for the force limit, and what cannot
  touch is length that lies nowhere. An arm of which only the tip was solid had won by being near.
- pipe_inserting: the tip has to be steered into a branch, past which the pipe goes straight on. Through the
  bend before, a straight rod and every slack body went by themselves.
- button_pushing: the button is pressed at a signal, and was out then, for 0.6 s and not 0.2 s. Random actions had won a
  quarter of the episodes, and thirteen fingers that all pulled 70 %.
- dynamic_catching: nobody knows when the ball is thrown, and the mount turns over after the catch. Constant actions had
  won 72 % and a basket 75 %; the ball is let go in the end, which no constant action does. No throw begins
  below the floor any more.
- flat_ground, gap: who falls back by 50 mm has lost, and the way is longer. Rings that shook at random had rolled there
  and back until they won.
- tunnel: it bends by 15 deg at least. The same rings had got through those that were nearly straight.
- obstacles: they close one half each of a walled lane. Before, there was a straight way at their side.
- stairs, obstacles, gap, tunnel: a robot that starts with a part beyond the beginning has lost. A long worm had started
  across the gap.
- all tasks: a valid policy needs its cables and its soft body, and no other actuators; a verdict has 100 episodes.

Version 5 changes drawer_opening alone (`Task.unchanged_since`): who opens a drawer out of turn has lost. One sequence
that holds all six orders had won every episode without looking at which drawer is wanted.
"""

Level = Literal["standard", "hard"]
Split = Literal["development", "held_out"]
TaskState = Mapping[str, FloatArray]
"""What a task carries from one control step of an episode to the next, by name, each (n, ...)."""
Edits = Mapping[str, Mapping[str, float | tuple[float, ...]]]
"""Attributes of MJCF elements by "element/name": {"joint/button_slide": {"springref": -0.0025}}."""

FORCE_SCALE_N = 5.0
"""Contact forces are observed in units of this. Our choice: what a tendon robot of this size presses with."""
FRICTION_ELSE = (0.005, 0.0001)
"""Torsional and rolling friction where a variation changes the sliding one: MuJoCo's defaults."""
_ENOUGH = 0.5
"""Progress that is decisive in a task without stages. Our choice."""
_ROUNDING = 1e-6
"""Progress this close below a stage has reached it."""


@dataclass(frozen=True)
class Feature:
    """One group of numbers that a policy observes beside its own body."""

    name: str
    unit: str
    """Empty for a number without one."""
    range: tuple[float, float]
    """What it lies between in a good episode; not enforced."""
    source: str
    """The sensors it is computed from; in brackets what is no sensor: "(time)", "(state)", "(outline)"."""
    size: int = 1
    """How many numbers."""


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """How a task is judged, in sentences formatted from its own numbers.

    Designers read them beside the objective, so they must hold at the task's level.
    """

    variation: str
    """What differs between episodes."""
    progress: str
    """What progress is made of; for the docs, designers do not read it."""
    success: str
    violation: str
    failure: str = ""
    """What ends an episode as lost; empty where nothing does."""


@dataclass(frozen=True)
class Task(ABC):
    """One task at one level: what the hard level changes are fields, what both share are class constants.

    A subclass in `some_task.py` finds its environment in `some_task.xml`.
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
    """Version of the benchmark from which on results of this task are comparable with today's."""
    required_names: ClassVar[tuple[str, ...]]
    """Bodies, joints, sites, actuators and sensors of the environment that this task cannot do without."""
    sensors: ClassVar[tuple[TaskSensor, ...]]
    """What scene assembly adds to measure the robot."""
    features: ClassVar[tuple[Feature, ...]]
    """What `observe` returns, in its order."""
    needs_outline: ClassVar[bool] = False
    """Whether it reads the robot's surface; see `Readings.outline`."""
    stages: ClassVar[tuple[tuple[float, str], ...]] = ()
    """What is reached at which progress, in rising order: ((0.5, "at the button"), (1.0, "pressed"))."""
    decisive: ClassVar[str] = ""
    """The stage, in its words, that a body reaches only by doing what the job is about; unless named the last but one,
    of two the last. A design that no blind motion brings there is sent back by the trial."""
    policy_actuators: ClassVar[tuple[str, ...]] = ()
    """Actuators of the environment that the policy drives as well: an action of -1 to 1 spans their control range."""
    hard: ClassVar[Mapping[str, float]] = {}
    """Fields that differ at the hard level, empty for a task that has none."""

    level: Level = "standard"

    @classmethod
    def at(cls, level: Level) -> Self:
        """Return the task at a level."""
        return cls(level=level, **(cls.hard if level == "hard" else {}))

    # --- what a designer reads ---

    @property
    @abstractmethod
    def objective(self) -> str:
        """One or two sentences with sizes and goal, and no hint of a mechanism."""

    @property
    @abstractmethod
    def criteria(self) -> Criteria:
        """How it is judged, in sentences."""

    @property
    def edits(self) -> Edits:
        """Attributes of the environment's MJCF that follow this task's numbers."""
        return {}

    @property
    def environment(self) -> str:
        """MJCF of the environment, without a robot."""
        return edit_environment(_environment_path(type(self)).read_text(encoding="utf-8"), self.edits)

    @property
    def target(self) -> tuple[Mark, ...]:
        """Where things have to be, for pictures; empty where that is no place, or differs with what no scene shows."""
        return ()

    def judging(self) -> dict[str, str]:
        """Return by title what differs between episodes, what success is, its stages, and what counts against it.

        Raises:
            UserError: The task can end an episode as lost and its criteria do not say when.
        """
        criteria = self.criteria
        if type(self).is_failure is not Task.is_failure and not criteria.failure:
            raise UserError(f'task "{self.name}" defines is_failure without a sentence: set Criteria.failure')
        facts = {
            "Episodes differ": criteria.variation,
            "Success": f"{criteria.success} Held for {self.hold_s:g} s.",
            "Counts against it": criteria.violation,
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
        """Return the job as a team of designers gets it."""
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
        """Return what sets an episode apart.

        Args:
            split: Agents and training see "development" only, scoring uses "held_out". The two never share a seed.
            index: Which one; the same index is the same variation for ever.
        """
        if index < 0:
            raise ValueError(f"negative episode index: {index}")
        seed = np.random.SeedSequence([("development", "held_out").index(split), index])
        return self.sample_variation(np.random.default_rng(seed))

    @abstractmethod
    def sample_variation(self, rng: np.random.Generator) -> Variation:
        """Sample what sets one episode apart."""

    def reset_state(self, readings: Readings) -> TaskState:
        """Return the state of an episode at its first readings."""
        del readings
        return {}

    def script(self, readings: Readings) -> Mapping[str, FloatArray]:
        """Return the controls of the environment's actuators that follow a script, by name, (n,) each."""
        del readings
        return {}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        """Return the state after one more control step."""
        del readings
        return state

    @abstractmethod
    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        """Return what a policy observes beside its own body, (n, k), as `features` lists it."""

    @abstractmethod
    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        """Return how far the task is done, 0 to 1, (n,)."""

    def conditions(self, readings: Readings, state: TaskState) -> tuple[Condition, ...]:
        """Return the numbers that its stages are made of, against their limits; none where its stages say it all."""
        del readings, state
        return ()

    @abstractmethod
    def violation(self, readings: Readings) -> FloatArray:
        """Return how badly the robot does what it must not, 0 to 1, (n,)."""

    @abstractmethod
    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        """Return where the goal holds at this moment, (n,); `scoring` asks that it holds for `hold_s`."""

    def is_failure(self, readings: Readings, state: TaskState) -> BoolArray:
        """Return where the episode is lost for good, (n,)."""
        del state
        return np.zeros(readings.n, dtype=np.bool_)

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        """Return the same by the sentence of the rule, (n,) each, for a task that has several."""
        return {self.criteria.failure: self.is_failure(readings, state)}

    def passed_limits(self, state: TaskState) -> tuple[PassedLimit, ...]:
        """Return the limits that one episode has passed.

        Args:
            state: Of that episode alone, without the axis of episodes.
        """
        del state
        return ()

    def stage_reached(self, progress: float, *, success: bool = False) -> str:
        """Return in words how far an episode came that got to this progress."""
        if success:
            return "held success"
        before = [words for start, words in self.stages if progress >= start - _ROUNDING]
        after = [words for start, words in self.stages if progress < start - _ROUNDING]
        if not self.stages:
            return f"progress {progress:.2f} of 1"
        if not after:
            return f"{before[-1]}, but success was not held"
        return f"{before[-1] if before else 'begun'}, not yet {after[0]}"

    def decisive_stage(self) -> tuple[float, str]:
        """Return the progress from which a body has done what the job is about, and the words for it."""
        if not self.stages:
            return _ENOUGH, f"progress {_ENOUGH:g}"
        named = [stage for stage in self.stages if stage[1] == self.decisive]
        return named[0] if named else self.stages[-2 if len(self.stages) > 2 else -1]

    def is_decisive(self, progress: float) -> bool:
        """Return whether a body that comes so far has done what the job is about."""
        return progress >= self.decisive_stage()[0] - _ROUNDING


def find_fault(task: type[Task]) -> str:
    """Return what is wrong with a task class, empty if nothing: members, environment or required names missing."""
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
        return ""  # more names than the text has
    names = {element.get("name") for element in elements}
    if missing := [name for name in task.required_names if name not in names]:
        return f"required_names not in the environment: {', '.join(missing)}"
    return ""


def span(low_high: tuple[float, float], scale: float = 1.0) -> str:
    """Return a range as "0.6 to 1.2", or as one number where both ends are the same."""
    low, high = (f"{scale * number:g}" for number in low_high)
    return low if low == high else f"{low} to {high}"


def _environment_path(task: type[Task]) -> Path:
    return Path(str(sys.modules[task.__module__].__file__)).with_suffix(".xml")


def edit_environment(mjcf: str, edits: Edits) -> str:
    """Return MJCF of an environment, or of a scene in it, with some attributes set.

    The very same text where each of them has its value already.
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
