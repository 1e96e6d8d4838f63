"""What training made of a design, read from the folders training/001, 002 … beside its iterations.

The files are written by `aidsr.learn.rl`; reading them needs none of its libraries.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from aidsr.core.artifacts import Artifact, Evaluation
from aidsr.core.directory_lock import LOCK_FILE
from aidsr.core.errors import UserError
from aidsr.core.numbered import numbered_in
from aidsr.runs.events import at_work
from aidsr.runs.files import BytesFile, JsonFile, replace_file
from aidsr.runs.folders import DesignFolder

_CURVE_POINTS = 8
"""Of a learning curve in words. Our choice: what a line holds."""
_STOPPED = {
    "budget": "all steps were used",
    "saturated": "its policy succeeded nearly always",
    "time": "its time was over",
    "hopeless": "it was hopeless: no episode had succeeded by then",
}


class Inspection(Artifact):
    """A person's word on whether a trained robot moves as a continuum robot could.

    It stands beside the automatic verdict and changes nothing in it.

    Source: AID-SR counts a design as valid after a person has looked at it.
    """

    plausible: bool
    text: str = ""


@dataclass(frozen=True)
class CurveRow:
    """The state of a training after some steps; None where nothing was measured yet."""

    steps: int
    wall_s: float
    success_share: float | None
    progress: float | None
    reward: float | None
    steps_per_s: float


@dataclass(frozen=True)
class Training:
    """One trained policy, or one that is learning."""

    path: Path

    @property
    def number(self) -> int:
        """Counts from 1 within the design."""
        return int(self.path.name)

    @property
    def config(self) -> JsonFile[dict[str, Any]]:
        """What was asked: task, level, steps, seed, recipe."""
        return JsonFile(self.path / "config.json", dict[str, Any])

    @property
    def result(self) -> JsonFile[dict[str, Any]]:
        """How it ended; absent while it learns."""
        return JsonFile(self.path / "training.json", dict[str, Any])

    @property
    def beginning(self) -> str:
        """With what the policy began, as the end of a sentence; "" where it learned from nothing."""
        recipe = (self.config.read() or {}).get("recipe", {})
        if not recipe.get("script"):
            return ""
        if recipe.get("from_probe"):
            return "; the policy is a motion of the probe, which learning did not beat"
        return "; it began with a script"

    @property
    def stage(self) -> Literal["learning", "evaluating", "judged"]:
        """What its files say comes next, or that it has its verdict; films may be drawn after that."""
        if not self.result.path.exists():
            return "learning"
        return "judged" if self.evaluation.path.exists() else "evaluating"

    @property
    def at_work(self) -> bool:
        """Whether a process of this machine learns, judges or films there, whoever started it.

        False where the system cannot answer, as on Windows, and for the seconds between learning and judging.
        """
        return bool(at_work(self.path / LOCK_FILE))

    @property
    def resumed(self) -> int:
        """How often it resumed after it was killed while learning: its policy is another than if it had not been."""
        count = (self.result.read() or {}).get("resumed", 0)
        return count if isinstance(count, int) else 0

    @property
    def evaluation(self) -> JsonFile[Evaluation]:
        """The verdict on held-out variations."""
        return JsonFile(self.path / "evaluation.json", Evaluation)

    @property
    def inspection(self) -> JsonFile[Inspection]:
        """A person's inspection of it."""
        return JsonFile(self.path / "inspection.json", Inspection)

    def inspect(self, inspection: Inspection) -> None:
        """Write a person's inspection; unlike other files of a run it may be replaced."""
        replace_file(self.inspection.path, inspection.model_dump_json(indent=2).encode() + b"\n")

    @property
    def films(self) -> tuple[BytesFile, ...]:
        """The films of held-out episodes that exist, the best first."""
        return tuple(BytesFile(self.path / name) for name in ("best.mp4", "median.mp4") if (self.path / name).exists())

    @property
    def motions(self) -> tuple[BytesFile, ...]:
        """The same episodes as motions, as far as they exist."""
        return tuple(BytesFile(self.path / name) for name in ("best.npz", "median.npz") if (self.path / name).exists())


def trainings_of(design: DesignFolder) -> tuple[Training, ...]:
    """Return the trainings of a design, in order."""
    folder = design.path / "training"
    return tuple(Training(path) for path in numbered_in(folder) if (path / "config.json").exists())


def verdict_in_words(training: Training) -> str:
    """Return what a training came to: its verdict and the share of held-out episodes, or that there is none yet."""
    resumed = ["resumed during training, so not the policy of an uninterrupted training"] if training.resumed else []
    verdict = training.evaluation.read()
    if verdict is None:
        state = "not judged" if training.result.path.exists() else "not finished"
        return "; ".join([f"training {training.path.name}: {state}", *resumed])
    word = "valid and successful" if verdict.successful else "valid, not successful" if verdict.valid else "not valid"
    failed = ", ".join(check.name for check in verdict.checks if not check.passed)
    share = f"{verdict.success_share:.0%} of {len(verdict.episodes)} held-out episodes"
    reasons = [*([f"fails {failed}"] if failed else []), *resumed]
    return f"training {training.path.name}: {word}, {share}" + (f" ({'; '.join(reasons)})" if reasons else "")


def verdicts_of(design: DesignFolder) -> tuple[Evaluation, ...]:
    """Return the verdicts of the policies of a design that were judged, in order."""
    return tuple(verdict for one in trainings_of(design) if (verdict := one.evaluation.read()) is not None)


def best_verdict(verdicts: Iterable[Evaluation]) -> Evaluation | None:
    """Return the verdict of the policy that speaks for a design, None where none was judged.

    A valid policy speaks before one that is not, then the one with the most held-out successes: what is said of a
    design is said of this one policy.
    """
    return max(verdicts, key=lambda one: (one.valid, one.success_share), default=None)


def read_curve(training: Training) -> tuple[CurveRow, ...]:
    """Return the curve so far; a line that is just being written is left out.

    Raises:
        UserError: The file is not a learning curve of AID-SR.
    """
    path = training.path / "curve.csv"
    try:
        text = path.read_text(encoding="utf-8")
        return tuple(_row(row) for row in csv.DictReader(text[: text.rfind("\n") + 1].splitlines()))
    except FileNotFoundError:
        return ()
    except (KeyError, TypeError, ValueError) as error:  # a column, a field or a number that is not there
        raise UserError(f"cannot read the learning curve {path} ({error}); restore or remove it") from None


def learning_in_words(training: Training) -> list[str]:
    """Return how long a finished training took, why it stopped, and some points of its curve, in lines."""
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
    return None if math.isnan(number) else number  # a row with nan would not equal itself when it is read again
