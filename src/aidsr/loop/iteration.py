"""One iteration of a design: create what is missing or requested, validate it, judge it, and return what comes next.

Every step is named after the file it writes and is skipped if that file exists, so resuming uses the same code.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from aidsr.core.artifacts import (
    MOUNTS,
    Brief,
    Concept,
    Critique,
    Decision,
    Fault,
    Placement,
    Robot,
    Scene,
    TaskReport,
    ValidationReport,
)
from aidsr.core.errors import IsolationError, MjcfError
from aidsr.core.formatting import counted
from aidsr.core.roles import Team
from aidsr.loop.earlier_trials import earlier_trials
from aidsr.loop.parts import Halt, Parts, TryOnTask
from aidsr.loop.routing import Change, after_critique, after_scene_faults, after_trial
from aidsr.loop.steps import Steps, reporting
from aidsr.runs import EventLog, IterationFolder
from aidsr.runs.events import Repaired


@dataclass(frozen=True)
class Draft:
    """The latest version of each artifact of a design."""

    concept: Concept
    robot: Robot | None = None
    robot_report: ValidationReport | None = None
    placement: Placement | None = None


@dataclass(frozen=True)
class Iteration:
    """Steps of one iteration, in its folder."""

    folder: IterationFolder
    brief: Brief
    parts: Parts
    log: EventLog
    halt: Halt

    def run(self, draft: Draft, requested: Change) -> tuple[Draft, Decision | Change]:
        """Return the draft after this iteration, and a person's decision or the change for the next iteration.

        Raises:
            ReplyError: A role's reply could not be used.
            HaltedError: Work was requested to stop.
        """
        team = self.parts.team_for(self.folder.path)
        if team.places_with_robot:
            requested = requested.of_robot_and_placement
        draft, robot = self._robot(team, draft, requested)
        report = self._robot_report(draft, robot)
        draft = replace(draft, robot=robot, robot_report=report)
        if not report.stable:
            self._steps.draw("preview", self.folder.preview, self.parts.picture, robot.mjcf)
            return draft, Change(robot=report, placement=requested.placement)
        placement = self._placement(team, draft.concept, robot, draft.placement, requested)
        draft = replace(draft, placement=placement)
        scene, report = self._scene(robot, placement)
        self._steps.draw("preview", self.folder.preview, self.parts.picture, scene.mjcf if scene else robot.mjcf)
        if scene is None or not report.stable:
            return draft, after_scene_faults(report, requested)
        trial = self._trial(robot, scene)
        critique = self._steps.run(
            "critique",
            self.folder.critique,
            lambda: team.judge.judge(self.brief, draft.concept, robot, scene, _with_trial(report, trial)),
            _verdict_in_words,
        )
        if not critique.passed:
            return draft, after_critique(critique)
        if trial is not None and not trial.critique.passed:
            return draft, after_trial(trial, earlier_trials(self.folder))
        return draft, self.decide()

    def measure_again(self, robot: Robot) -> TaskReport:
        """Return a second report of a trial, with seeds and variations by which the scene was not selected."""
        scene, measure = self.folder.scene.read(), self.parts.measure_again
        assert scene is not None, "only an assembled scene is tried"
        assert measure is not None, "only what was tried is measured again"
        return self._steps.run(
            "measured_again", self.folder.measured_again, lambda: _tried(measure, robot, scene), _progress_in_words
        )

    def decide(self) -> Decision:
        """Return a person's decision on the scene of this iteration, which has passed the Judge."""
        scene = self.folder.scene.read()
        assert scene is not None, "only an assembled scene is judged"
        self._steps.draw("motion", self.folder.motion, self.parts.filmstrip, scene.mjcf)
        return self.parts.person(self.folder, self.log, self.halt)

    def _trial(self, robot: Robot, scene: Scene) -> TaskReport | None:
        try_on_task = self.parts.try_on_task
        if try_on_task is None:
            return None
        return self._steps.run(
            "task_report", self.folder.task_report, lambda: _tried(try_on_task, robot, scene), _phase_in_words
        )

    @property
    def _steps(self) -> Steps:
        return Steps(self.log, self.halt, self.folder.number)

    def _robot(self, team: Team, draft: Draft, requested: Change) -> tuple[Draft, Robot]:
        if requested.concept:
            concept = self._steps.run(
                "concept",
                self.folder.concept,
                lambda: reporting(team.designer, self.log).revise(
                    self.brief, draft.concept, draft.robot, requested.to_designer
                ),
                lambda concept: concept.name,
            )
            draft = Draft(concept)
        before, feedback = draft.robot, requested.with_details(requested.robot)
        if before is None:
            robot = self._steps.run(
                "robot", self.folder.robot, lambda: self._fixed(team.coder.write(self.brief, draft.concept))
            )
        elif feedback is None:
            return draft, before
        else:
            robot = self._steps.run(
                "robot",
                self.folder.robot,
                lambda: self._fixed(team.coder.repair(self.brief, draft.concept, before, feedback)),
            )
        return replace(draft, robot_report=None), robot

    def _fixed(self, written: Robot) -> Robot:
        """Return the Coder's robot after automatic fixes; the fixes and the original are stored beside it."""
        actuators = (name for group in written.actuator_groups for name in group.actuators)
        kept_names = {written.functional_part, *actuators}
        fixed = self.parts.repair(written.mjcf, kept_names=kept_names, keep=self.brief.keep)
        if fixed.notes:
            self.folder.repairs.write(fixed.repairs)
        if not fixed.total:
            return written
        self.folder.robot_as_written.write(written.mjcf.encode())
        self.log.write(Repaired(iteration=self.folder.number, counts=fixed.counts))
        return written.model_copy(update={"mjcf": fixed.mjcf})

    def _robot_report(self, draft: Draft, robot: Robot) -> ValidationReport:
        return draft.robot_report or self._steps.run(
            "robot_report",
            self.folder.robot_report,
            lambda: self.parts.validate(
                robot.mjcf,
                mount=MOUNTS[self.brief.base],
                needs_contact=self.brief.needs_contact,
                environment=self.brief.environment,
            ),
            _faults_in_words,
        )

    def _placement(
        self, team: Team, concept: Concept, robot: Robot, before: Placement | None, requested: Change
    ) -> Placement:
        feedback = requested.with_details(requested.placement)
        if before is None:
            return self._steps.run(
                "placement", self.folder.placement, lambda: team.integrator.place(self.brief, concept, robot)
            )
        if feedback is None:
            return before
        return self._steps.run(
            "placement",
            self.folder.placement,
            lambda: team.integrator.adjust(self.brief, concept, robot, before, feedback),
        )

    def _scene(self, robot: Robot, placement: Placement) -> tuple[Scene | None, ValidationReport]:
        """Return the scene and its report; without a scene, the report gives the reason."""
        known = self.folder.scene_report.read()
        if known is not None and self.folder.scene.read() is None:
            return None, known
        try:
            scene = self._steps.run(
                "scene",
                self.folder.scene,
                lambda: self.parts.assemble(robot, self.brief.environment, placement),
            )
        except (MjcfError, IsolationError) as error:
            unassembled = ValidationReport(stable=False, faults=_faults(error))
            return None, self._steps.run(
                "scene_report", self.folder.scene_report, lambda: unassembled, _faults_in_words
            )
        return scene, self._steps.run(
            "scene_report",
            self.folder.scene_report,
            lambda: self.parts.validate(scene.mjcf, needs_contact=self.brief.needs_contact),
            _faults_in_words,
        )


def _tried(try_on_task: TryOnTask, robot: Robot, scene: Scene) -> TaskReport:
    try:
        return try_on_task(robot, scene)
    except IsolationError as error:  # a trial is only advice: a scene that is too slow for it can still be trained
        critique = Critique(passed=True, summary=f"It could not be tried on its task: {error}.")
        return TaskReport(phase="partial", progress=0.0, critique=critique)


def _with_trial(report: ValidationReport, trial: TaskReport | None) -> ValidationReport:
    """Return the Judge's input: the measurements of the scene, with those of its trial."""
    if trial is None:
        return report
    text = "\n".join([trial.critique.summary, trial.account]).strip()
    return report.model_copy(update={"measurements": {**report.measurements, "trial": text}})


def _faults_in_words(report: ValidationReport) -> str:
    if report.stable:
        return "stable"
    codes = ", ".join(dict.fromkeys(fault.code for fault in report.errors))
    return f"{counted(len(report.errors), 'fault')}: {codes}"


def _progress_in_words(report: TaskReport) -> str:
    return f"progress {report.progress:.2f}"


def _phase_in_words(report: TaskReport) -> str:
    return report.phase.replace("_", " ")


def _verdict_in_words(critique: Critique) -> str:
    if critique.passed:
        return "passed"
    return "changes requested from the " + " and the ".join(dict.fromkeys(issue.blame for issue in critique.issues))


def _faults(error: MjcfError | IsolationError) -> tuple[Fault, ...]:
    if isinstance(error, MjcfError):
        return error.faults
    cure = "Make the robot smaller or simpler."
    return (Fault(code="load_error", layer="load", severity="error", message=f"Assembly failed: {error}", cure=cure),)
