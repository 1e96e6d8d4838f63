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

from aidsr.core.artifacts import Base, Brief
from aidsr.mjcf.read import parse_document
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.judging import judging, said
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.variation import Variation

__all__ = ["BENCHMARK_VERSION", "Edits", "Level", "Memory", "Split", "Task"]

BENCHMARK_VERSION = 3
"""Changes whenever a dimension, a threshold, a variation or an end of a task does; every result carries it.

Version 2 ends an episode that cannot be made good any more: a robot 0.1 m outside its lane, an object off the table, on
the floor or out of reach. Before, policies paid for it to the time limit, which drowned what they could have learned.

Version 3 makes the pipe's walls 8 mm thick and not 3, through which a tip that was pressed hard came half out. With it
came another progress on the drawers, and in all tasks checks of policies that forgive a freak in twenty.
"""

Level = Literal["standard", "hard"]
Split = Literal["development", "held_out"]
_ROUNDING = 1e-6
"""Progress that much below a stage has reached it."""
Memory = Mapping[str, FloatArray]
"""What a task carries from one control step of an episode to the next, by name, each (n, ...)."""
Edits = Mapping[str, Mapping[str, float | tuple[float, ...]]]
"""Attributes of MJCF elements by "element/name": {"joint/button_slide": {"springref": -0.0025}}."""


@dataclass(frozen=True)
class Task(ABC):
    """One task at one level: what the hard level changes are fields, what both share are class constants.

    A subclass in `some_task.py` finds its environment in `some_task.xml`. Its docstring holds a table of its features:
    index, feature, unit, range, sensor.
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
    required_names: ClassVar[tuple[str, ...]]
    """Bodies, joints, sites, actuators and sensors of the environment that this task cannot do without."""
    sensors: ClassVar[tuple[TaskSensor, ...]]
    """What scene assembly adds to measure the robot."""
    needs_outline: ClassVar[bool] = False
    """Whether it looks at all of the robot's surface; see `Readings.outline`."""
    stages: ClassVar[tuple[tuple[float, str], ...]] = ()
    """What is reached at which progress, in rising order: ((0.5, "at the button"), (1.0, "pressed"))."""
    policy_actuators: ClassVar[tuple[str, ...]] = ()
    """Actuators of the environment that the policy drives as well: an action of -1 to 1 spans their control range."""
    hard: ClassVar[Mapping[str, float]] = {}
    """Fields that differ at the hard level, empty for a task that has none."""
    hard_words: ClassVar[Mapping[str, str]] = {}
    """What designers are told at the hard level where a method's docstring is not so there, by the method's name."""

    level: Level = "standard"

    @classmethod
    def at(cls, level: Level) -> Self:
        """Return the task at a level."""
        return cls(level=level, **(cls.hard if level == "hard" else {}))

    def reached(self, progress: float, *, won: bool = False) -> str:
        """Return in words how far an episode came that got to this progress."""
        if won:
            return "held success"
        before = [words for start, words in self.stages if progress >= start - _ROUNDING]
        after = [words for start, words in self.stages if progress < start - _ROUNDING]
        if not self.stages:
            return f"progress {progress:.2f} of 1"
        if not after:
            return f"{before[-1]}, but success was not held"
        return f"{before[-1] if before else 'begun'}, not yet {after[0]}"

    # --- what a designer is told ---

    @property
    @abstractmethod
    def objective(self) -> str:
        """One or two sentences with sizes and goal, and no hint of a mechanism."""

    @property
    def edits(self) -> Edits:
        """Attributes of the environment's MJCF that follow this task's numbers."""
        return {}

    @property
    def environment(self) -> str:
        """MJCF of the environment, without a robot."""
        path = Path(str(sys.modules[type(self).__module__].__file__)).with_suffix(".xml")
        return _edited(path.read_text(encoding="utf-8"), self.edits)

    def terms(self) -> tuple[str, str, str]:
        """Return what differs between episodes, what success is and what counts against it, as the docstrings say.

        Raises:
            UserError: One of them is missing.
        """
        return said(self, "draw"), said(self, "succeeded"), said(self, "violation")

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
            judging=judging(self),
        )

    # --- what happens in an episode ---

    def variation(self, split: Split, index: int) -> Variation:
        """Return what sets an episode apart.

        Args:
            split: Agents and training see "development" only, scoring uses "held_out". The two never share a seed.
            index: Which one; the same index is the same variation for ever.
        """
        if index < 0:
            raise ValueError(f"an episode's index counts from 0, found {index}")
        seed = np.random.SeedSequence([("development", "held_out").index(split), index])
        return self.draw(np.random.default_rng(seed))

    @abstractmethod
    def draw(self, rng: np.random.Generator) -> Variation:
        """Draw one variation."""

    def script(self, readings: Readings) -> Mapping[str, FloatArray]:
        """Return the controls of the environment's actuators that follow a script, by name, (n,) each."""
        del readings
        return {}

    # --- what is seen, and what it is worth ---

    @abstractmethod
    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """Return what a policy sees beside its own body, (n, k): the table in the task's docstring."""

    def begin(self, readings: Readings) -> Memory:
        """Return the memory of an episode at its first readings."""
        del readings
        return {}

    def remember(self, readings: Readings, memory: Memory) -> Memory:
        """Return the memory after one more control step."""
        del readings
        return memory

    @abstractmethod
    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Return how far the task is done, 0 to 1, (n,)."""

    @abstractmethod
    def violation(self, readings: Readings) -> FloatArray:
        """Return how badly the robot does what it must not, 0 to 1, (n,)."""

    @abstractmethod
    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Return where the goal holds at this moment, (n,). Holding it for `hold_s` is seen to in `scoring`."""

    @property
    def can_be_lost(self) -> bool:
        """Whether anything but a divergence ends an episode before its time without success."""
        return type(self).failed is not Task.failed

    def failed(self, readings: Readings, memory: Memory) -> BoolArray:
        """Return where the episode is lost for good, (n,)."""
        del memory
        return np.zeros(readings.n, dtype=np.bool_)


def _edited(mjcf: str, edits: Edits) -> str:
    """Return the MJCF with some attributes set; the very same text where each of them has its value already."""
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
