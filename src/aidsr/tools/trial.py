"""Trial of a scene on its task without learning: whether an open-loop motion reaches the decisive stage, or why not.

1. Search for motions, each search with its own seed and variation.
2. If most searches do not reach the task's decisive stage, search for a script, starting from the best motion that does
   not reach it. If a training follows, success is required here instead of the decisive stage.
3. If the script does not reach it either, play and record the best failed attempt again, and attribute its failure to a
   role. The placement is blamed only if other placements improve progress by more than the spread over seeds.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from aidsr.core.artifacts import Attempt, Critique, CritiqueIssue, Placement, Robot, Scene, TaskReport
from aidsr.core.errors import IsolationError, MjcfError
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tasks import Level, Task, load_task

if TYPE_CHECKING:
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.learn.openloop.report import ProbeReport

Wanted = Literal["decisive", "solved"]
"""Result that a motion must reach for the scene to pass: the task's decisive stage, or success."""
SEEDS = 3
"""Largest number of searches: the third decides if the first two disagree. Our choice."""
MOTIONS = 160
LEAST_STEPS = 150_000
"""Smallest number of physics steps of a search; it grows with the time limit as that of a probe. Our choice: with
150,000 steps for episodes of any length, 29 to 46 motions were tried, and the same scene reached 0.32, 0.96 and 0.34.
"""
LONGEST_S = 10.0
"""Longest duration of a motion in a search. Our choice."""
_LIMITS = Limits(wall_s=7200.0, cpu_s=3600.0)
_OTHER_SCALES, _OTHER_TURNS_DEG = (0.8, 1.25), (90.0, 180.0)
"""Factors of the scale, and rotations about the robot's z axis, of the placements with which a blamed one is compared.
Our choice."""


@isolated(limits=_LIMITS)
def try_task(
    robot: Robot,
    scene: Scene,
    *,
    task: str = "",
    level: Level = "standard",
    goal: Path | None = None,
    environment: str = "",
    first_seed: int = 0,
    attribute: bool = True,
    wanted: Wanted = "decisive",
) -> TaskReport:
    """Return the progress of a scene on its task without learning, and the role to which a failure is attributed.

    Args:
        robot: The robot in the scene.
        scene: A stable scene.
        task: Name of the task.
        level: Level of the task.
        goal: File of a goal, instead of a task.
        environment: MJCF of the environment for trials of other placements; empty for no such trials.
        first_seed: Seed of the first search and index of its development variation; the following ones count up.
            Another value than 0 gives an independent measurement.
        attribute: Whether to search for a script and attribute a failure; otherwise only make all searches.
        wanted: Result that most searches, or the script, must reach.

    Raises:
        UserError: There is no such task, or the scene does not belong to it.
        MjcfError: The scene cannot be loaded.
        IsolationError: The trial exceeded a limit.
    """
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.tasks import goal_task, read_goal

    goal_or_task = goal_task(read_goal(goal), scene.mjcf) if goal else load_task(task, level)
    placed = TaskScene.of(scene.mjcf, goal_or_task, groups=robot.actuator_groups)
    others = _Others(robot, scene.placement, environment, goal_or_task) if environment else None
    return try_scene(placed, first_seed=first_seed, attribute=attribute, others=others, wanted=wanted)


@dataclass(frozen=True)
class _Others:
    """Factory of scenes of a robot with other placements."""

    robot: Robot
    placement: Placement
    environment: str
    task: Task

    def placements(self) -> list[tuple[str, Placement]]:
        """Return other placements, each with a description."""
        x, y, z = self.placement.rotation_deg
        scales = [round(self.placement.scale * factor, 3) for factor in _OTHER_SCALES]
        changes: list[tuple[str, dict[str, Any]]] = [
            *((f"at scale {scale:g}", {"scale": scale}) for scale in scales if 0.5 <= scale <= 2.0),
            *((f"turned by {turn:g} deg", {"rotation_deg": (x, y, z + turn)}) for turn in _OTHER_TURNS_DEG),
        ]
        return [(words, self.placement.model_copy(update=change)) for words, change in changes]

    def scene(self, placement: Placement) -> TaskScene:
        """Return the scene with a placement.

        Raises:
            MjcfError: Robot and environment cannot be assembled into one model.
        """
        from aidsr.learn.episodes.scene import TaskScene
        from aidsr.sim.assembly import assemble

        made = assemble(self.robot, self.environment, placement, self.task.sensors)
        return TaskScene.of(made.mjcf, self.task, groups=self.robot.actuator_groups)


def try_scene(
    scene: TaskScene,
    *,
    first_seed: int = 0,
    attribute: bool = True,
    others: _Others | None = None,
    wanted: Wanted = "decisive",
) -> TaskReport:
    """Try a loaded scene in this process; see `try_task`."""
    from aidsr.learn.openloop.script import script_of

    reports: list[ProbeReport] = []
    for seed in range(first_seed, first_seed + SEEDS):
        reports.append(_search(scene, seed))
        reached = [_is_enough(_attempt(scene.task, report), wanted) for report in reports]
        if attribute and len(reports) == 2 and reached[0] == reached[1]:
            break  # a third cannot change the majority
    attempts = [_attempt(scene.task, report) for report in reports]
    progress = sum(attempt.progress for attempt in attempts) / len(attempts)
    enough = 2 * sum(reached) > len(attempts)
    fell_short = ""
    if attribute and not enough:
        short = [report for report, is_enough in zip(reports, reached, strict=True) if not is_enough]
        best = max(short, key=lambda report: report.progress)
        script, attempt = _script(scene, best)
        fell_short = script if attempt.progress > best.progress else script_of(best.best.motion)
        attempts.append(attempt)
        enough = _is_enough(attempt, wanted)
    start = _start_progress(scene)
    if enough or not attribute:
        phase = "solved" if any(attempt.succeeded for attempt in attempts) else "partial"
        summary = _summary(scene.task, attempts, start)
        return TaskReport(
            phase=phase,
            progress=progress,
            critique=Critique(passed=True, summary=summary),
            attempts=tuple(attempts),
            start_progress=start,
            account="\n".join(_lines(attempts)),
        )
    return _attributed(scene, fell_short, attempts, progress, start, others, some=any(reached))


def _is_enough(attempt: Attempt, wanted: Wanted) -> bool:
    return attempt.decisive if wanted == "decisive" else attempt.succeeded


def _steps(task: Task) -> int:
    from aidsr.learn.openloop.probe_scene import STEPS_PER_S

    return max(LEAST_STEPS, round(STEPS_PER_S * task.time_limit_s))


def _search(scene: TaskScene, seed: int) -> ProbeReport:
    """Search for the best motion with one seed, in the development variation of the same number."""
    from aidsr.learn.openloop import probe_scene
    from aidsr.learn.openloop.motion_search import ALL_KINDS

    return probe_scene(
        scene,
        candidates=MOTIONS,
        variations=1,
        first=seed,
        max_steps=_steps(scene.task),
        longest_s=LONGEST_S,
        kinds=ALL_KINDS,
        seed=seed,
        threads=1,
    )


def _attempt(task: Task, report: ProbeReport) -> Attempt:
    episode = report.best.episode
    return Attempt(
        how="search",
        seed=report.seed,
        variation=episode.variation,
        tried=report.motions,
        progress=episode.best_progress,
        reached=report.reached,
        decisive=_is_decisive(task, episode.best_progress, succeeded=episode.ended == "succeeded"),
        succeeded=episode.ended == "succeeded",
    )


def _is_decisive(task: Task, progress: float, *, succeeded: bool) -> bool:
    return succeeded or task.is_decisive(progress)


def _script(scene: TaskScene, best: ProbeReport) -> tuple[str, Attempt]:
    """Search for a script, starting from the best motion of a report, in the variation of this motion."""
    from aidsr.tools.script_search import search_script

    variation = best.best.episode.variation
    found = search_script(
        scene,
        best.best.motion,
        variation=variation,
        seed=best.seed,
        max_steps=_steps(scene.task),
        longest_s=LONGEST_S,
    )
    succeeded, progress = found.episode.ended == "succeeded", found.episode.best_progress
    return found.script, Attempt(
        how="script",
        seed=best.seed,
        variation=variation,
        tried=found.tried,
        progress=progress,
        reached=found.episode.reached,
        decisive=_is_decisive(scene.task, progress, succeeded=succeeded),
        succeeded=succeeded,
    )


def _start_progress(scene: TaskScene) -> float:
    from aidsr.learn.episodes.batch import Episodes

    episodes = Episodes(scene.model, scene.task, scene.actions, [scene.task.variation("development", 0)], threads=1)
    return float(episodes.progress[0])


def _attributed(
    scene: TaskScene,
    script: str,
    attempts: list[Attempt],
    progress: float,
    start: float,
    others: _Others | None,
    *,
    some: bool,
) -> TaskReport:
    """Return the report of a scene in which neither most searches nor the script reached the required result.

    Args:
        scene: The scene.
        script: The best of the failed attempts as a script, in the variation of the last attempt.
        attempts: All attempts, the search for a script last.
        progress: Mean progress of the searches.
        start: Progress in the initial state.
        others: Factory of scenes with other placements; None where none are tried.
        some: Whether any of the searches reached the required result.
    """
    from aidsr.learn.openloop.failure_attribution import attribute_failure
    from aidsr.learn.openloop.script_policy import script_policy
    from aidsr.learn.openloop.trace import trace
    from aidsr.tasks.targets import targets_of
    from aidsr.tools.playing import record

    tried = attempts[-1].variation
    seen = trace(
        scene, scene.task.variation("development", tried), script_policy(scene, script), targets_of(scene.task)
    )
    phase, issue = attribute_failure(scene.task, seen)
    lines = _lines(attempts)
    if (
        issue.blame == "integrator" and phase != "not_forward"
    ):  # a base that must be free is not compared, as the other placements keep the base
        issue, compared = _placement_or_body(issue, attempts, others)
        lines += compared
    summary = _summary(scene.task, attempts, start)
    again = record(scene, script_policy(scene, script), variation=tried)
    them = "those that fell short" if some else "them"
    account = [
        *lines,
        f"The best of {them}, as a script:",
        script,
        "(-1: the least command, no pull of a cable; 1: the greatest)",
        "What happened:",
        again.text(),
    ]
    return TaskReport(
        phase=phase,
        progress=progress,
        critique=Critique(passed=False, summary=summary, issues=(issue,)),
        attempts=tuple(attempts),
        start_progress=start,
        account="\n".join(account),
    )


def _placement_or_body(
    issue: CritiqueIssue, attempts: list[Attempt], others: _Others | None
) -> tuple[CritiqueIssue, list[str]]:
    """Decide whether placement or body is to blame; return the issue and a line on the progress of other placements.

    The placement is to blame if the same search reaches more progress with another placement, by more than the spread
    over seeds.
    """
    searches = [attempt.progress for attempt in attempts if attempt.how == "search"]
    spread = max(searches) - min(searches)
    compared: list[tuple[float, str]] = []
    if others is not None:
        for words, placement in others.placements():
            with suppress(MjcfError, IsolationError):  # the robot does not fit there
                compared.append((_search(others.scene(placement), attempts[0].seed).progress, words))
    told = ", ".join(f"{progress:.2f} {words}" for progress, words in compared)
    here = f"{attempts[0].progress:.2f} as it is placed, and seeds differ by {spread:.2f}"
    lines = [f"Other placements, by the same search of seed {attempts[0].seed}: {told}; {here}."] * bool(compared)
    farthest, words = max(compared, default=(0.0, ""))
    if compared and farthest - attempts[0].progress > spread:
        suggestion = f"{issue.suggestion}; {words} it comes to {farthest:.2f}"
        return issue.model_copy(update={"suggestion": suggestion}), lines
    problem = issue.problem + ("; other scales and turns come no farther than seeds differ" if compared else "")
    suggestion = "let it bend farther, or another way, towards its target: another placement is not enough"
    return issue.model_copy(
        update={"blame": "designer", "component": "reach", "problem": problem, "suggestion": suggestion}
    ), lines


def _summary(task: Task, attempts: list[Attempt], start: float) -> str:
    """Return a summary of the attempts in a few sentences."""
    limit, words = task.decisive_stage()
    searches = [attempt for attempt in attempts if attempt.how == "search"]
    reached = sum(attempt.decisive for attempt in searches)
    told = ", ".join(f"{attempt.progress:.2f}" for attempt in searches)
    text = f'Tried on its task without learning, {reached} of {len(searches)} searches reach "{words}" (progress '
    text += f"{limit:.2f}): they come to {told}"
    for attempt in attempts[len(searches) :]:
        text += f", and a script that was searched from the best that fell short to {attempt.progress:.2f}"
    best = max(attempts, key=lambda attempt: attempt.progress)
    return f"{text}. The best: {best.reached}. It starts at progress {start:.2f}."


def _lines(attempts: list[Attempt]) -> list[str]:
    """Return a line for each attempt."""
    what = {"search": "open-loop motions", "script": "scripts of waypoints, from the best motion"}
    return [
        f"- {attempt.tried} {what[attempt.how]}, seed {attempt.seed}, development variation {attempt.variation}: "
        f"progress {attempt.progress:.2f}, {attempt.reached}"
        for attempt in attempts
    ]
