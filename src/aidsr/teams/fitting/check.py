"""Check of a goal in an environment before anything is designed: it can be met, but not by rest or random actions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import ActuatorGroup, Artifact
from aidsr.learn.episodes.actions import ActionMap
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import Constant, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop import ProbeReport, probe
from aidsr.learn.openloop.film import film
from aidsr.mjcf.read import open_mjcf
from aidsr.render.pictures import picture
from aidsr.render.view import View
from aidsr.runs.event_text import tried_text
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.sim.assembly import assemble
from aidsr.tasks import GoalTask, goal_task, read_goal
from aidsr.tasks.readings import FloatArray
from aidsr.tasks.targets import targets_and_mounts, targets_of
from aidsr.tasks.travelling_task import TravellingTask
from aidsr.teams.fitting.facts import GoalFacts, brief_of, goal_facts
from aidsr.teams.fitting.team import FittingCoder, FittingDesigner, FittingIntegrator
from aidsr.teams.fitting.trial import Round

EPISODES = 5
"""Number of episodes with each kind of blind action. Our choice: what succeeds by itself succeeds in most of them."""
_NOISE_S = 0.4
"""Duration of a random action [s]. Our choice: long enough for a soft body to follow."""
_CLOSE = 0.8
"""Progress from which random actions count as close to the goal. Our choice."""
_LIMITS = Limits(wall_s=1200.0, cpu_s=600.0)
ROUNDS = (Round(6, 16, 120_000), Round(2, 64, 400_000))
"""Rounds of trials in which the reference robot is chosen. Our choice: a quarter of the effort for a design."""


class Blind(Artifact):
    """Results of blind actions, which use no observation."""

    idle: int
    """Number of episodes won by a robot at rest."""
    noise: int
    """Number of episodes won by random actions."""
    idle_progress: float
    """Best progress of the robot at rest."""
    noise_progress: float
    """Best progress of random actions."""
    episodes: int


class GoalCheck(GoalFacts):
    """Findings about a goal in an environment before anything is designed."""

    reference: str
    """Name of the built-in robot with which the goal was tried; empty if none could be placed."""
    blind: Blind | None
    probe: ProbeReport | None
    """Result of open-loop motions of that robot."""
    scene: str
    """MJCF of that robot in the environment, or of the environment alone."""
    picture: bytes
    """PNG of the scene."""
    strip: bytes | None
    """PNG filmstrip of the probe's best motion."""

    @property
    def lines(self) -> tuple[str, ...]:
        """All findings in words, problems last."""
        return (*self.fact_lines, *self.trial_lines, *self.problems)

    @property
    def trial_lines(self) -> tuple[str, ...]:
        """What the trials showed, in words."""
        said = []
        if blind := self.blind:
            said.append(
                f"No actions: {blind.idle} of {blind.episodes} episodes succeed, best progress "
                f"{blind.idle_progress:.2f}"
            )
            said.append(
                f"Random actions: {blind.noise} of {blind.episodes} episodes succeed, best progress "
                f"{blind.noise_progress:.2f}"
                + (", close to the goal: make it harder, or require a longer hold" * (blind.noise_progress >= _CLOSE))
            )
        if self.probe:
            said.append(
                f"A built-in robot: {self.reference} reaches progress {self.probe.progress:.2f} with open-loop "
                f"motions: {self.probe.reached}"
            )
        return tuple(said)

    @property
    def problems(self) -> tuple[str, ...]:
        """Reasons why the goal does not measure the quality of a design, in sentences."""
        found = list(self.faults)
        if not self.reference and not self.faults:
            found.append(
                "No built-in robot could be placed: each overlaps something at the start; make room at the mount."
            )
        found += [f"{drift}: fix it in place, or this motion is credited to the robot." for drift in self.drifts]
        if self.blind and self.blind.idle:
            found.append(
                f"A robot at rest wins {self.blind.idle} of {self.blind.episodes} episodes: make the goal harder."
            )
        if self.blind and self.blind.noise:
            found.append(
                f"Random actions win {self.blind.noise} of {self.blind.episodes} episodes: make the goal harder, or "
                "require a longer hold."
            )
        return tuple(found)


def check_goal(
    environment: str | Path, goal: str | Path, *, seed: int = 0, listen: Callable[[str], None] = lambda _step: None
) -> GoalCheck:
    """Examine a goal in an environment, and try it with a built-in robot.

    Args:
        environment: MJCF file of the environment.
        goal: File of the goal.
        seed: Seed of the robot's parameters and of the random actions.
        listen: Function called with a text about the next step.

    Raises:
        UserError: A file does not exist or cannot be read as what it should be, or the goal cannot be met.
        MjcfError: The environment cannot be loaded.
        IsolationError: A trial exceeded its limits.
    """
    return check_task(goal_task(read_goal(goal), open_mjcf(Path(environment))), seed=seed, listen=listen)


def check_task(task: GoalTask, *, seed: int = 0, listen: Callable[[str], None] = lambda _step: None) -> GoalCheck:
    """Do the work of `check_goal` for a goal that has been read and resolved in its environment."""
    asked, mjcf = task.goal, task.environment
    facts = goal_facts(task)

    def nothing_tried() -> GoalCheck:
        drawn = picture(mjcf, view=View(shown=targets_and_mounts(task)))
        return GoalCheck(**dict(facts), reference="", blind=None, probe=None, scene=mjcf, picture=drawn, strip=None)

    if facts.faults:
        return nothing_tried()
    brief = brief_of(task)
    listen("choosing a reference robot")
    tried = FittingDesigner(asked, seed, listen=lambda body: listen(tried_text(body))).tried(brief, ROUNDS)
    if not tried:
        return nothing_tried()
    best = max(tried, key=lambda each: each.fit.value)
    robot = FittingCoder(asked).write(brief, best.concept)
    placement = FittingIntegrator(asked).place(brief, best.concept, robot)
    scene = assemble(robot, mjcf, placement, task.sensors).mjcf
    listen("testing without actions, then with random actions")
    blind = play_blind(scene, task, robot.actuator_groups, EPISODES, seed)
    listen("trying motions")
    report = probe(scene, task, groups=robot.actuator_groups, candidates=64, variations=1, max_steps=100_000, threads=1)
    listen("drawing")
    played = film(scene, task, report.best, groups=robot.actuator_groups)
    return GoalCheck(
        **dict(facts),
        reference=best.concept.name,
        blind=blind,
        probe=report,
        scene=scene,
        picture=picture(scene, view=View(shown=(*targets_of(task), placement.mount))),
        strip=played.strip(),
    )


@isolated(limits=_LIMITS)
def play_blind(scene: str, task: TravellingTask, groups: tuple[ActuatorGroup, ...], episodes: int, seed: int) -> Blind:
    """Return the results of a robot at rest and of random actions in development variations.

    Raises:
        MjcfError: The scene cannot be loaded.
        IsolationError: The episodes exceeded their limits of time or memory.
    """
    placed = TaskScene.of(scene, task, groups=groups)
    hold = max(1, round(_NOISE_S / placed.task.control_dt_s))
    won, progress = [], []
    for policy in (Constant(placed.actions.rest), _Noise(placed.actions, np.random.default_rng(seed), hold)):
        variations = [placed.task.variation("development", index) for index in range(episodes)]
        outcomes = rollout(Episodes(placed.model, placed.task, placed.actions, variations, threads=1), policy)
        won.append(int(outcomes.success.sum()))
        progress.append(float(outcomes.best_progress.max()))
    return Blind(idle=won[0], noise=won[1], idle_progress=progress[0], noise_progress=progress[1], episodes=episodes)


@dataclass
class _Noise:
    """Random actions, each held for some control steps."""

    actions: ActionMap
    rng: np.random.Generator
    hold: int
    _step: int = 0
    _now: FloatArray | None = None

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        if self._now is None or self._step % self.hold == 0:
            self._now = self.rng.uniform(-1.0, 1.0, (len(observation), self.actions.size))
        self._step += 1
        return self._now
