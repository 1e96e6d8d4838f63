"""Lessons from a session of the measuring team: one for each scene on which a script was played or a probe was run."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from aidsr.core.artifacts import SUCCESSFUL_SHARE, Brief
from aidsr.core.formatting import excerpt
from aidsr.core.provenance import commit
from aidsr.memory.lesson import Lesson, designer_of
from aidsr.mjcf.read import parse_document
from aidsr.runs.folders import IterationFolder
from aidsr.runs.record import RunRecord
from aidsr.teams.measuring.exploration import Exploration
from aidsr.teams.measuring.records import WORK_FOLDER, ToolRecord, recorded_calls
from aidsr.tools import Workspace

_MOST_MEASURED = 2
"""Maximum number of other measurements of a scene that a lesson repeats; the newest are chosen."""


def lessons_of_session(iteration: IterationFolder, evidence: str, asked: RunRecord, brief: Brief) -> Iterator[Lesson]:
    """Yield the lessons of a session; none if the iteration is not one of the measuring team.

    Args:
        iteration: Iteration that holds the session.
        evidence: Reference to the iteration, for example RUN/designs/1/01; the scene's name is appended.
        asked: Record of the run.
        brief: Job of the run.

    Raises:
        UserError: A file of the session is damaged.
    """
    session = _Session(recorded_calls(iteration.path), Workspace(iteration.path / WORK_FOLDER))
    before: dict[str, float] = {}
    for scene, robot in session.scenes.items():
        best = session.best(scene)
        if best is None or best.progress is None:
            continue
        mjcf, made, changed_from = session.work.mjcf(scene), session.work.robot(robot), session.edited_from(robot)
        grouped = {name for group in made.actuator_groups for name in group.actuators}
        actuators = len(parse_document(made.mjcf).root.findall("actuator/*"))
        family = session.families.get(robot, "")
        trained = session.last(scene, "train")
        yield Lesson(
            objective=brief.objective,
            task=brief.task,
            level=asked.level or "",
            base=brief.base,
            name=robot,
            family=family or "body",
            morphology=session.ideas.get(family, ""),
            actuation="",
            actuators=actuators,
            groups=len(made.actuator_groups) + actuators - len(grouped),
            changed=session.changes(robot),
            progress_before=before.get(changed_from),
            progress=best.progress,
            least=best.progress,
            most=best.progress,
            searches=max(round(best.figures.get("episodes", 1.0)), 1),
            how=f"{best.name}: {best.headline.partition('. ')[0]}",
            solved=best.figures.get("success", 0.0) >= SUCCESSFUL_SHARE,
            found=session.found(scene),
            policy_success=trained.figures.get("success") if trained else None,
            policy_valid=trained is None or bool(trained.figures.get("valid", 0.0)),
            model=designer_of(asked.config.model),
            evidence=f"{evidence}/{WORK_FOLDER}/{scene}",
            scene_sha256=hashlib.sha256(mjcf.encode()).hexdigest(),
            commit=commit(),
        )
        before[robot] = max(best.progress, before.get(robot, 0.0))


@dataclass(frozen=True)
class _Session:
    records: Sequence[ToolRecord]
    work: Workspace

    @cached_property
    def done(self) -> list[ToolRecord]:
        return [record for record in self.records if record.outcome == "done"]

    @cached_property
    def scenes(self) -> dict[str, str]:
        """Robot of each stable scene, by the scene's name."""
        made = {one.made: str(one.values["robot"]) for one in self.done if one.name == "assemble" and one.made}
        return {scene: robot for scene, robot in made.items() if self.work.record(scene).stable}

    @cached_property
    def families(self) -> dict[str, str]:
        return Exploration(self.records, self.work).families()

    @cached_property
    def ideas(self) -> dict[str, str]:
        """Idea given for each family when it was proposed, by the family's name in lower case."""
        proposed = [family for one in self.done if one.name == "propose" for family in one.values["families"]]
        return {str(family["name"]).strip().lower(): str(family.get("idea", "")) for family in proposed}

    def best(self, scene: str) -> ToolRecord | None:
        """Return the `play` or `probe` call with the most progress, if possible over several variations or seeds."""
        far = [one for one in self.about(scene) if one.name in ("play", "probe") and one.progress is not None]
        wide = [one for one in far if one.name == "probe" or one.figures.get("episodes", 1.0) > 1.0]
        return max(wide or far, key=lambda one: one.progress or 0.0, default=None)

    def last(self, scene: str, tool: str) -> ToolRecord | None:
        return next((one for one in reversed(self.about(scene)) if one.name == tool), None)

    def about(self, scene: str) -> list[ToolRecord]:
        return [one for one in self.done if one.subject == scene]

    def found(self, scene: str) -> str:
        """Return the model's reason for keeping a scene, and other measurements of the scene and its robot."""
        kept = self.last(scene, "keep")
        reasons = [str(kept.values.get("why", ""))] if kept else []
        bodies = (scene, self.scenes[scene])
        measured = [one for one in self.done if one.name == "measure" and one.subject in bodies]
        return "; ".join(
            [*reasons, *(f"{one.values.get('what')}: {one.headline}" for one in measured[-_MOST_MEASURED:])]
        )

    def edited_from(self, robot: str) -> str:
        """Return the robot that a robot was edited from, "" if it was written from scratch."""
        edit = next((one for one in self.done if one.name == "edit" and one.made == robot), None)
        return str(edit.values["robot"]) if edit else ""

    def changes(self, robot: str) -> tuple[str, ...]:
        edit = next((one for one in self.done if one.name == "edit" and one.made == robot), None)
        return (excerpt(" ".join(str(edit.values.get("patch", "")).split()), 200),) if edit else ()
