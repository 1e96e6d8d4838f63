"""Submissions: a study's results in one file that others can verify and merge."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, Field, ValidationError

from aidsr.core.artifacts import Artifact, Evaluation
from aidsr.core.errors import UserError
from aidsr.core.text_files import read_text_file
from aidsr.runs.files import replace_file
from aidsr.studies.file_errors import first_error
from aidsr.studies.outcomes import DesignRow, read_outcomes
from aidsr.studies.study import Study, StudyPlan, fill_protocol
from aidsr.studies.tables import Line, task_lines
from aidsr.tasks import TASKS

_MAX_BYTES = 64 * 2**20
"""Largest size of a submission file [bytes]. Our choice: 1,000 designs with five policies each take half of that."""
_MAX_DESIGNS = 20_000


class Submission(Artifact):
    """A study's results, with the raw outcomes from which they can be computed again."""

    plan: Annotated[StudyPlan, BeforeValidator(fill_protocol)]
    designs: Annotated[tuple[DesignRow, ...], Field(max_length=_MAX_DESIGNS)]
    scenes_sha256: dict[str, str]
    """Hash of every approved scene by "arm/task/run/design", so that a submission can be checked against its study."""
    lines: dict[str, tuple[Line, ...]]
    """Results by arm, one line for each task; they follow from `designs`."""
    sha256: str = ""
    """Hash of all other fields, in canonical JSON."""


def submit(study: Study, path: Path) -> Submission:
    """Write a study's results into one file.

    Raises:
        UserError: No design of the study is finished, or policies were not evaluated according to its plan.
    """
    rows = read_outcomes(study)
    if all(row.outcome == "unfinished" for row in rows):
        raise UserError(f"{study.path} has no finished design; run aidsr benchmark first")
    submission = Submission(
        plan=study.plan,
        designs=rows,
        scenes_sha256=hash_scenes(study),
        lines={arm.name: task_lines(rows, arm.name) for arm in study.plan.arms},
    )
    _check_evaluations(study.path, submission)
    whole = with_hash(submission)
    replace_file(path, whole.model_dump_json(indent=1).encode() + b"\n")
    return whole


def with_hash(submission: Submission) -> Submission:
    """Return a submission with the hash of its content."""
    return submission.model_copy(update={"sha256": _digest(submission.model_dump_json())})


def read_submission(path: Path) -> Submission:
    """Read a submission and check that its results follow from its raw outcomes, and its hash from its content.

    Raises:
        UserError: The file cannot be read, was changed, or its results do not match its outcomes.
    """
    try:
        text = read_text_file(path, max_bytes=_MAX_BYTES)
        found = Submission.model_validate_json(text)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}; give a file that `aidsr submit` wrote") from None
    except ValidationError as error:
        raise UserError(f"{path} is not a file written by `aidsr submit`: {first_error(error)}") from None
    if found.sha256 != _digest(text):
        raise UserError(
            f"{path} was changed after it was written: its hash does not match; write it again with aidsr submit"
        )
    _check_evaluations(path, found)
    if found.plan.seeds > 1 and any(row.seeds != found.plan.seeds for row in found.designs):
        raise UserError(
            f"{path}: not every design records the {found.plan.seeds} policies of the plan: an older version wrote it; "
            "write the file again with aidsr submit"
        )
    rows = tuple(row.model_copy(update={"seeds": found.plan.seeds}) for row in found.designs)
    found = found.model_copy(update={"designs": rows})
    # compared lazily: a plan can have far more designs than the file
    if any(_place(row) != place if row else True for row, place in zip_longest(found.designs, _places(found.plan))):
        raise UserError(f"{path}: its designs do not match its plan, in which each design occurs once")
    for arm in (arm.name for arm in found.plan.arms):
        if not _follow(found.lines.get(arm, ()), task_lines(found.designs, arm)):
            raise UserError(f"{path}: the figures of {arm} do not match its designs")
    return found


def _check_evaluations(path: Path, found: Submission) -> None:
    """Refuse evaluations that differ from the plan in task, level, version, split, number or number of episodes.

    Raises:
        UserError: There is such an evaluation, or one with a success in which the goal was not held long enough.
    """
    plan = found.plan
    for row in found.designs:
        asked = {(row.task, plan.level, plan.benchmark_version, "held_out")}
        judged = {(each.task, each.level, each.benchmark_version, each.split) for each in row.evaluations}
        if not judged <= asked or len(row.evaluations) > plan.seeds:
            raise UserError(
                f"{path}: a design has an evaluation that is not on held-out variations of {row.task}, level "
                f"{plan.level}, version {plan.benchmark_version}, or more than {plan.seeds}; submit a study whose "
                "policies were all evaluated according to its plan"
            )
        policy = f"{path}: a policy of {row.arm}/{row.task}/{row.run}/{row.design}"
        for each in row.evaluations:
            if len(each.episodes) != plan.verdict_episodes:
                raise UserError(
                    f"{policy} was evaluated on {len(each.episodes)} held-out episodes, not on "
                    f"{plan.verdict_episodes}; evaluate it again with aidsr evaluate without --episodes, then repeat "
                    "aidsr submit"
                )
            least_s = _least_held_s(each)
            for episode in each.episodes:
                if episode.ended == "succeeded" and episode.held_s < least_s:
                    raise UserError(
                        f"{policy} succeeds in variation {episode.variation} with its goal held for "
                        f"{episode.held_s:g} s of {each.hold_s:g} s; evaluate it again with aidsr evaluate, then "
                        "repeat aidsr submit"
                    )


def _least_held_s(evaluation: Evaluation) -> float:
    """Return the shortest time for which the goal of a successful episode can have been held [s].

    Success counts from half a control step before `hold_s` (`aidsr.tasks.scoring`). One step is tolerated here, and
    half of `hold_s` in tasks of other packages, whose step is not known. Older results have a `hold_s` of 0.
    """
    task = TASKS.get(evaluation.task)
    return evaluation.hold_s - (task.control_dt_s if task else evaluation.hold_s / 2)


def _digest(text: str) -> str:
    """Return the hash of a submission's JSON text.

    It is computed from the text, not the model, so that a later version with more fields still accepts the file.
    """
    content = json.loads(text)
    content.pop("sha256", None)  # absent in a file that somebody changed
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _place(row: DesignRow) -> tuple[str, str, int, int]:
    return row.arm, row.task, row.run, row.design


def _places(plan: StudyPlan) -> Iterator[tuple[str, str, int, int]]:
    """Yield the place of every design of a plan: a submission may not leave out designs that failed."""
    study = Study(Path(), plan)
    for cell in study.cells:
        for number in range(1, study.arm(cell.arm).config.concepts + 1):
            yield cell.arm, cell.task, cell.number, number


def _follow(written: Sequence[Line], computed: Sequence[Line]) -> bool:
    """Return whether written lines equal computed ones, without fields that an earlier version did not write."""
    if len(written) != len(computed):
        return False
    pairs = zip(written, computed, strict=True)
    return all(
        line.model_dump(mode="json", exclude_unset=True) == now.model_dump(mode="json", include=line.model_fields_set)
        for line, now in pairs
    )


def hash_scenes(study: Study) -> dict[str, str]:
    """Return the SHA-256 of every approved scene of a study, by "arm/task/run/design"."""
    found = {}
    for cell in study.cells:
        run = study.run(cell)
        for design in run.designs if run else ():
            scene = design.final_scene.read()
            if scene:
                found[f"{cell.arm}/{cell.task}/{cell.number}/{design.number}"] = hashlib.sha256(scene).hexdigest()
    return found
