"""The four roles of a run, played by one measuring session for each design."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from aidsr.core.artifacts import Brief, Concept, Critique, Placement, Robot, Scene, ValidationReport
from aidsr.core.errors import ReplyError
from aidsr.core.model import Model
from aidsr.core.roles import Feedback, Team
from aidsr.runs import DesignFolder, IterationFolder, Run
from aidsr.runs.status import newest
from aidsr.tasks import Level
from aidsr.teams.llm.describe_environment import describe_environment
from aidsr.teams.llm.prompts import render
from aidsr.teams.measuring.own_tools import Chosen, chosen, proposed_families, write_chosen
from aidsr.teams.measuring.records import TOOLS_FOLDER, WORK_FOLDER
from aidsr.teams.measuring.session import Session
from aidsr.teams.measuring.toolbox import Toolbox, ToolBudget
from aidsr.tools import Job, Workspace

_REPAIRED = "robot_1"
"""Name of the robot to be repaired in the workspace of a session that repairs one."""


def measuring_team(
    model: Model,
    folder: Path,
    *,
    level: Level = "standard",
    goal: Path | None = None,
    budget: ToolBudget,
    pictures: bool = False,
    text_tools: bool = False,
    may_continue: bool = False,
) -> Team:
    """Return the team for one folder of a run.

    One session makes robot and placement together; it runs when the loop calls the Coder. The Designer's concepts have
    only numbers, and the Judge passes every scene, because the session has measured it.

    Args:
        model: The language model.
        folder: Folder of the iteration; for concepts, folder of the run.
        level: Level of the task.
        goal: File of the goal, if success is measured by a goal.
        budget: Limits for the use of tools in a session.
        pictures: Whether the model accepts pictures.
        text_tools: Whether calls are written as text even if the model supports tools.
        may_continue: Whether the run may get another budget, so that a spent one ends a session without a result.
    """
    roles = _Roles(model, folder, level, goal, budget, pictures, text_tools, may_continue)
    return Team(designer=roles, coder=roles, integrator=roles, judge=roles, places_with_robot=True)


def copy_measured(recorded: Run, run: Run, folder: Path) -> None:
    """Copy the measurements of a recorded run into the same folder of a run that replays it, unless they exist there.

    A replay therefore measures nothing again: the recorded replies fit only if every result is the same.
    """
    source = recorded.path / folder.relative_to(run.path)
    for name in (WORK_FOLDER, TOOLS_FOLDER):
        if (source / name).is_dir() and not (folder / name).exists():
            shutil.copytree(source / name, folder / name)


@dataclass(frozen=True)
class _Roles:
    """The four roles in one class."""

    model: Model
    folder: Path
    level: Level
    goal: Path | None
    budget: ToolBudget
    pictures: bool
    text_tools: bool
    may_continue: bool

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return `count` concepts that have only numbers: each session proposes its own families."""
        return tuple(
            Concept(
                name=f"Measured design {number} of {count}",
                interpretation=brief.objective,
                morphology="What measuring makes of the job; the robot's notes say what.",
                actuation="Likewise.",
                functional_part="Likewise.",
                family=f"measured {number}",
            )
            for number in range(1, count + 1)
        )

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the concept with the feedback as its rationale."""
        del brief, robot
        return concept.model_copy(update={"rationale": feedback})

    def write(self, brief: Brief, concept: Concept) -> Robot:
        """Return the robot of the scene that a session ends with.

        After a refinement, the session starts with the robot of the last iteration, and the request is its feedback.

        Raises:
            ReplyError: The session ended without a scene.
        """
        before = self._robot_before()
        if before is None:
            return self._designed(brief, concept, None, None)
        asked = Critique(passed=True, summary=concept.rationale)
        return self._designed(brief, concept.model_copy(update={"rationale": ""}), before, asked)

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        """Return the robot of a further session that starts with the present robot and the feedback."""
        return self._designed(brief, concept, robot, feedback)

    def place(self, brief: Brief, concept: Concept, robot: Robot) -> Placement:
        """Return the placement of the scene that the session ended with.

        Raises:
            ReplyError: No session has ended in this folder.
        """
        del concept, robot
        workspace = self._workspace(brief)
        found = chosen(workspace, "finished")
        if found is None:
            raise ReplyError(f"no session has ended in {self.folder}")
        return workspace.placement(found.scene)

    def adjust(
        self, brief: Brief, concept: Concept, robot: Robot, placement: Placement, feedback: Feedback
    ) -> Placement:
        """Return the placement of the session that repaired the robot in this folder; the given one if there was none.

        The team places its robot itself, so feedback on a placement reaches the session by `repair`.
        """
        del concept, robot, feedback
        workspace = self._workspace(brief)
        found = chosen(workspace, "finished")
        return workspace.placement(found.scene) if found else placement

    def judge(self, brief: Brief, concept: Concept, robot: Robot, scene: Scene, report: ValidationReport) -> Critique:
        """Return a pass: the session has measured the scene."""
        del brief, concept, scene, report
        return Critique(passed=True, summary=f"Passed by its designer, who measured it. {robot.notes}".strip())

    def _robot_before(self) -> Robot | None:
        """Return the robot of the iterations before this one; None in the first."""
        iterations = DesignFolder(self.folder.parent).iterations
        earlier = (it for it in reversed(iterations) if it.number < IterationFolder(self.folder).number)
        return newest(it.robot.read() for it in earlier)

    def _workspace(self, brief: Brief) -> Workspace:
        return Workspace(self.folder / WORK_FOLDER, Job(brief, self.level, self.goal), draws=False)

    def _designed(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: Feedback | None) -> Robot:
        workspace = self._workspace(brief)
        toolbox = Toolbox(workspace, self.folder, self.budget, self.pictures, explore=robot is None)
        toolbox.remove_unrecorded(kept=(_REPAIRED,) if robot else ())
        start = render(
            "measuring_start",
            brief=brief,
            environment=describe_environment(brief.summary),
            concept=concept,
            calls=self.budget.calls,
            minutes=f"{self.budget.minutes:g}",
            before=_first_robot(workspace, robot) if robot else "",
            feedback=_words(feedback),
        )
        found = Session(self.model, toolbox, self.text_tools, self.may_continue).run(start)
        script = toolbox.exploration.script_for(found.scene)
        if chosen(workspace, "finished") is None:
            write_chosen(workspace, "finished", found)
        return _robot_of(workspace, found).model_copy(update={"script": script})


def _first_robot(workspace: Workspace, robot: Robot) -> str:
    """Store the robot to be repaired as the first robot of a workspace, unless that was done, and return its name."""
    return _REPAIRED if (workspace.folder / _REPAIRED).is_dir() else workspace.add_robot(robot)


def _words(feedback: Feedback | None) -> str:
    """Return the feedback on a robot as text; empty without feedback."""
    match feedback:
        case ValidationReport():
            return feedback.account()
        case Critique():
            issues = "; ".join(f"{issue.component}: {issue.problem}" for issue in feedback.issues)
            return f"{feedback.summary} {issues}".strip()
    return ""


def _robot_of(workspace: Workspace, found: Chosen) -> Robot:
    """Return the robot of the scene with which a session ended, with the reason for the end in its notes."""
    robot = workspace.robot(workspace.record(found.scene).robot)
    proposed = ", ".join(family.name for family in proposed_families(workspace))
    why = found.why if found.measured else f"Kept, not measured again: {found.why}"
    return robot.model_copy(
        update={"notes": f"{found.ended} {why.rstrip('.')}. Families proposed: {proposed}.".strip()}
    )
