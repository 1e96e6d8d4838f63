"""Trained policies of a design, read from the folders training/001, 002 … in the design's folder.

The files are written by `aidsr.learn.rl`; reading them needs none of its libraries.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from aidsr.core.arguments import check_type
from aidsr.core.artifacts import Artifact, Evaluation
from aidsr.core.directory_lock import LOCK_FILE
from aidsr.core.errors import UserError
from aidsr.core.numbered import numbered_in
from aidsr.runs.events import at_work
from aidsr.runs.files import BytesFile, JsonFile, replace_file
from aidsr.runs.folders import DesignFolder, Run

_CURVE_POINTS = 8
"""Number of points of a learning curve in words. Our choice: fits on a line."""
_STOPPED = {
    "budget": "all steps were used",
    "saturated": "its policy succeeded nearly always",
    "time": "its time was over",
    "hopeless": "it was hopeless: no episode had succeeded by then",
}


class Inspection(Artifact):
    """A person's assessment of whether a trained robot moves as a continuum robot could.

    It is shown beside the automatic verdict and does not change it.

    Source: AID-SR counts a design as valid after a person has looked at it.
    """

    plausible: bool
    text: str = ""


@dataclass(frozen=True)
class CurveRow:
    """One point of a learning curve; values are None before they were first measured."""

    steps: int
    wall_s: float
    success_share: float | None
    progress: float | None
    reward: float | None
    steps_per_s: float


@dataclass(frozen=True)
class Training:
    """Folder of one policy that is trained or in training."""

    path: Path

    @property
    def number(self) -> int:
        """Number of the training, counted from 1 within the design."""
        return int(self.path.name)

    @property
    def config(self) -> JsonFile[dict[str, Any]]:
        """Requested task, level, steps, seed and recipe."""
        return JsonFile(self.path / "config.json", dict[str, Any])

    @property
    def result(self) -> JsonFile[dict[str, Any]]:
        """Result of the training; absent during training."""
        return JsonFile(self.path / "training.json", dict[str, Any])

    @property
    def beginning(self) -> str:
        """Initial motion of the policy, as the end of a sentence; "" for training from scratch."""
        if self.plays_the_motion:
            return "; the policy is a motion of the probe, which learning did not beat"
        return "; it began with a script" if self._recipe.get("script") else ""

    @property
    def plays_the_motion(self) -> bool:
        """Whether the policy is an open-loop motion of the probe, which learning did not beat."""
        return bool(self._recipe.get("script") and self._recipe.get("from_probe"))

    @property
    def _recipe(self) -> dict[str, Any]:
        recipe = (self.config.read() or {}).get("recipe")
        return recipe if isinstance(recipe, dict) else {}

    @property
    def stage(self) -> Literal["learning", "evaluating", "judged"]:
        """Stage according to its files: in training, waiting for evaluation, or evaluated; videos may follow."""
        if not self.result.path.exists():
            return "learning"
        return "judged" if self.evaluation.path.exists() else "evaluating"

    @property
    def at_work(self) -> bool:
        """Whether any process on this machine is training or evaluating the policy, or rendering its videos.

        False where the system cannot tell, as on Windows, and for a few seconds between training and evaluation.
        """
        return bool(at_work(self.path / LOCK_FILE))

    @property
    def resumed(self) -> int:
        """Number of times that training was killed and resumed, which changes the resulting policy."""
        count = (self.result.read() or {}).get("resumed", 0)
        return count if isinstance(count, int) else 0

    @property
    def evaluation(self) -> JsonFile[Evaluation]:
        """Evaluation of the policy on held-out variations."""
        return JsonFile(self.path / "evaluation.json", Evaluation)

    @property
    def policy(self) -> Path:
        """The trained policy, as `aidsr.learn.rl` stores it; absent during training."""
        return self.path / "policy.zip"

    @property
    def inspection(self) -> JsonFile[Inspection]:
        """A person's assessment."""
        return JsonFile(self.path / "inspection.json", Inspection)

    def inspect(self, inspection: Inspection) -> None:
        """Write a person's assessment; unlike other files of a run, it may be replaced."""
        replace_file(self.inspection.path, inspection.model_dump_json(indent=2).encode() + b"\n")

    @property
    def films(self) -> tuple[BytesFile, ...]:
        """Existing videos of held-out episodes, the best episode first."""
        return tuple(BytesFile(self.path / name) for name in ("best.mp4", "median.mp4") if (self.path / name).exists())

    @property
    def motions(self) -> tuple[BytesFile, ...]:
        """Existing recorded motions of the same episodes."""
        return tuple(BytesFile(self.path / name) for name in ("best.npz", "median.npz") if (self.path / name).exists())


def trainings_of(design: str | Path | DesignFolder) -> tuple[Training, ...]:
    """Return the trainings of a design, in order.

        for training in aidsr.trainings_of(run.design(1)):
            print(training.number, training.result.read(), training.evaluation.read())

    Args:
        design: A design, or its folder.

    Raises:
        TypeError: `design` has another type.
    """
    check_type(design, (str, Path, DesignFolder), "design must be a design or its folder")
    folder = design if isinstance(design, DesignFolder) else DesignFolder(Path(design))
    trainings = map(Training, numbered_in(folder.trainings))
    return tuple(training for training in trainings if training.config.path.exists())


def verdict_in_words(training: Training) -> str:
    """Return the result of a training in words: its verdict and success rate in held-out episodes, or its state.

    A training for something else than the run says for what.
    """
    other = other_job(training)
    name = f"training {training.path.name}" + (f", for {other}" if other else "")
    resumed = ["resumed during training, so not the policy of an uninterrupted training"] if training.resumed else []
    verdict = training.evaluation.read()
    if verdict is None:
        state = "not judged" if training.result.path.exists() else "not finished"
        return "; ".join([f"{name}: {state}", *resumed])
    word = "valid and successful" if verdict.successful else "valid, not successful" if verdict.valid else "not valid"
    failed = ", ".join(check.name for check in verdict.checks if not check.passed)
    share = f"{verdict.success_share:.0%} of {len(verdict.episodes)} held-out episodes"
    reasons = [*([f"fails {failed}"] if failed else []), *resumed]
    return f"{name}: {word}, {share}" + (f" ({'; '.join(reasons)})" if reasons else "")


def verdicts_of(design: DesignFolder) -> tuple[Evaluation, ...]:
    """Return the evaluations of a design's policies in the task, level or goal of its run, in order.

    A run without any, for an objective in words, has the evaluations of all policies.
    """
    judged = ((one, one.evaluation.read()) for one in trainings_of(design))
    return tuple(verdict for one, verdict in judged if verdict is not None and not other_job(one))


def other_job(training: Training) -> str:
    """Return the task or goal of a training in words if its run is for another one, otherwise "".

    Of a training whose settings name neither, nothing is known to differ.
    """
    config, home = training.config.read() or {}, training.path.absolute().parents[3:4]
    run = Run(home[0]) if home else None
    record = run.record.read() if run else None
    goal, task, level = config.get("goal"), config.get("task", ""), config.get("level", "")
    if run is None or record is None or not (goal or task):
        return ""
    wanted = run.goal.read()
    if goal and (record.task or wanted is not None):
        same = wanted is not None and _is_goal(goal, wanted.decode(errors="replace"), training.path / "scene.xml")
        target = goal.get("target") or goal.get("joint") or ", ".join(goal.get("targets", ()))
        return "" if same else f"the goal {' '.join(filter(None, [goal.get('kind', ''), target]))}"
    if not goal and wanted is not None:
        return f"the task {task}"
    if not record.task or (task, level) == (record.task, record.level or level):
        return ""
    return f"the task {task}, level {level}"


def _is_goal(goal: dict[str, Any], wanted: str, scene: Path) -> bool:
    """Return whether the goal of a training is the one in a TOML text, as the scene of the training resolves it.

    Where the text cannot be resolved, nothing is known to differ.
    """
    try:
        return goal in _forms(wanted, scene, scene.stat().st_mtime_ns)
    except (OSError, UserError):
        return True


@lru_cache(maxsize=256)
def _forms(goal: str, scene: Path, changed_ns: int) -> tuple[dict[str, Any], ...]:
    """Return a goal in JSON as it is written and as a scene resolves it.

    Raises:
        OSError: The scene cannot be read.
        UserError: The goal or the scene is not valid.
    """
    from aidsr.tasks import goal_task, parse_goal

    del changed_ns  # a changed scene is read again
    written = parse_goal(goal)
    resolved = goal_task(written, scene.read_text(encoding="utf-8")).goal
    return written.model_dump(mode="json"), resolved.model_dump(mode="json")


def best_verdict(verdicts: Iterable[Evaluation]) -> Evaluation | None:
    """Return the evaluation of the policy that represents a design, None where none was evaluated.

    Valid policies are preferred, then those with a higher success rate. All statements about a design refer to this one
    policy.
    """
    return max(verdicts, key=lambda one: (one.valid, one.success_share), default=None)


def best_training(design: DesignFolder) -> Training | None:
    """Return the training whose evaluation represents a design, see `best_verdict`; None where none was evaluated."""
    best = best_verdict(verdicts_of(design))
    return next((one for one in trainings_of(design) if best is not None and one.evaluation.read() == best), None)


def read_curve(training: Training) -> tuple[CurveRow, ...]:
    """Return the learning curve so far; an unfinished last line is left out.

    Raises:
        UserError: The file is not a learning curve of AID-SR.
    """
    path = training.path / "curve.csv"
    try:
        text = path.read_text(encoding="utf-8")
        return tuple(_row(row) for row in csv.DictReader(text[: text.rfind("\n") + 1].splitlines()))
    except FileNotFoundError:
        return ()
    except (KeyError, TypeError, ValueError) as error:  # a missing column or field, or text that is no number
        raise UserError(f"cannot read the learning curve {path} ({error}); restore or remove it") from None


def without_tests(training: Training, curve: tuple[CurveRow, ...]) -> tuple[tuple[CurveRow, ...], CurveRow | None]:
    """Return the rows of a learning curve that were written while learning, and the test of the final policy.

    After the last step of learning, the policy to keep is tested in new episodes without noise, which is written as
    another row. Success in other episodes is no change of the policy, so it must not be drawn as one.

    Returns:
        The rows of learning; the last row of the tests, None before there is one.
    """
    learned = next((i for i in range(1, len(curve)) if curve[i].steps == curve[i - 1].steps), len(curve))
    recipe = (training.config.read() or {}).get("recipe") or {}
    if learned == len(curve) > 1 and recipe.get("script") and recipe.get("from_probe"):
        learned -= 1  # a policy that never succeeded was not tested; the searched motion that replaced it was
    return curve[:learned], curve[-1] if learned < len(curve) else None


def learning_in_words(training: Training) -> list[str]:
    """Return lines of text on a finished training: duration, reason of its end, and points of its learning curve."""
    result, curve = training.result.read() or {}, read_curve(training)
    if not result:
        return []
    stopped = _STOPPED[result["stopped"]]
    lines = [
        f"trained for {result['wall_s'] / 60:.1f} minutes and {result['steps']:,} control steps, until {stopped}; "
        f"{result['episodes']:,} episodes, {result['diverged_episodes']:,} of them diverged"
    ]
    told = [row for row in curve if row.success_share is not None]
    if not told:
        return [*lines, "no episode ended that tells how far the policy had come"]
    last = len(told) - 1
    picked = sorted({round(i * last / (_CURVE_POINTS - 1)) for i in range(_CURVE_POINTS)})
    points = [f"{told[i].steps:,}: {told[i].success_share:.0%}, {told[i].progress or 0.0:.2f}" for i in picked]
    return [
        *lines,
        f"learning curve (steps: success, progress at the end, of the latest episodes): {'; '.join(points)}",
    ]


def _row(row: dict[str, str]) -> CurveRow:
    return CurveRow(
        steps=int(row["steps"]),
        wall_s=float(row["wall_s"]),
        success_share=_measured(row["success_share"]),
        progress=_measured(row["progress"]),
        reward=_measured(row["reward"]),
        steps_per_s=float(row["steps_per_s"]),
    )


def _measured(text: str) -> float | None:
    number = float(text)
    return None if math.isnan(number) else number  # rows with NaN would not compare equal
