"""A team, a validator and an assembly that follow a script, for tests of the loop."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from aidsr.core.artifacts import (
    Attempt,
    Brief,
    Concept,
    Critique,
    CritiqueIssue,
    EnvironmentSummary,
    Fault,
    Placement,
    Robot,
    Scene,
    TaskReport,
    ValidationReport,
)
from aidsr.core.config import RunConfig
from aidsr.core.errors import MjcfError
from aidsr.core.roles import Feedback, Team
from aidsr.fixes import FixResult
from aidsr.loop.human import approve
from aidsr.loop.parts import Parts
from aidsr.loop.run import create_run
from aidsr.runs import Run

PNG = b"\x89PNG\r\n\x1a\n"


def brief(objective: str = "reach") -> Brief:
    summary = EnvironmentSummary(
        gravity_m_s2=(0, 0, -9.81), timestep_s=0.002, mounts=(), bodies=(), sites=(), sensors=(), actuators=()
    )
    return Brief(objective=objective, environment="<mujoco/>", summary=summary)


def fault(code: str, *names: str) -> Fault:
    return Fault(code=code, layer="simulate", severity="error", names=names, message=f"{code} was seen")


@dataclass
class Script:
    """What the roles answer, in order, for one concept; a word that is an exception is raised."""

    robots: Sequence[str | Exception] = ("ok",)
    placements: Sequence[str | Exception] = ("ok",)
    verdicts: Sequence[str | Exception] = ("pass",)


@dataclass
class Scripted:
    """All four roles; remembers who was asked what."""

    scripts: Sequence[Script] = field(default_factory=lambda: [Script()])
    asked: list[tuple[str, str, object]] = field(default_factory=list)
    briefs: list[Brief] = field(default_factory=list)
    """What the Coder was told of the job when it wrote robots, in order."""

    def team(self, _folder: Path) -> Team:
        return Team(designer=self, coder=self, integrator=self, judge=self)

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        self.asked.append(("designer", "propose", None))
        return tuple(_concept(f"concept {number}") for number in range(1, count + 1))

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        self.asked.append(("designer", concept.name, feedback))
        return concept.model_copy(update={"name": concept.name + "'"})

    def write(self, brief: Brief, concept: Concept) -> Robot:
        self.briefs.append(brief)
        return self._robot(concept, None)

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        return self._robot(concept, feedback)

    def place(self, brief: Brief, concept: Concept, robot: Robot) -> Placement:
        return self._placed(concept, None)

    def adjust(
        self, brief: Brief, concept: Concept, robot: Robot, placement: Placement, feedback: Feedback
    ) -> Placement:
        return self._placed(concept, feedback)

    def judge(self, brief: Brief, concept: Concept, robot: Robot, scene: Scene, report: ValidationReport) -> Critique:
        word = self._next("judge", concept, report.measurements.get("trial"), "verdicts")
        if word == "pass":
            return Critique(passed=True, summary="Plausible.")
        issues = tuple(CritiqueIssue(blame=role, component="body", problem="Too short.") for role in word.split("+"))
        return Critique(passed=False, issues=issues)

    def _robot(self, concept: Concept, feedback: Feedback | None) -> Robot:
        word = self._next("coder", concept, feedback, "robots")
        count = sum(role == "coder" for role, name, _ in self.asked if name.rstrip("'") == concept.name.rstrip("'"))
        return Robot(mjcf=f"<mujoco><robot faults='{word}' number='{count}'/></mujoco>", functional_part="tip")

    def _placed(self, concept: Concept, feedback: Feedback | None) -> Placement:
        return Placement(mount=self._next("integrator", concept, feedback, "placements"), base="fixed")

    def _next(self, role: str, concept: Concept, feedback: object, words: str) -> str:
        number = int(re.search(r"\d+", concept.name).group())
        before = sum(r == role and name.rstrip("'") == concept.name.rstrip("'") for r, name, _ in self.asked)
        self.asked.append((role, concept.name, feedback))
        said = getattr(self.scripts[number - 1], words)
        word = said[min(before, len(said) - 1)]
        if isinstance(word, Exception):
            raise word
        return word


def repair(mjcf: str, *, kept_names=(), keep=()) -> FixResult:
    """Put the word "misspelt" right."""
    if "misspelt" not in mjcf:
        return FixResult(mjcf=mjcf)
    notes = ("<robot>: renamed 'misspelt' 'ok'.",)
    return FixResult(mjcf=mjcf.replace("misspelt", "ok"), notes=notes, counts={"misspelt_attributes": 1})


def validate(mjcf: str, *, mount="auto", needs_contact=False, environment="") -> ValidationReport:
    """Report the faults written into the text: those of the robot alone, and with a scene those of its placement."""
    words = re.search(r"<scene faults='(.*?)'" if mjcf.startswith("<scene") else r"faults='(.*?)'", mjcf).group(1)
    faults = () if words == "ok" else tuple(fault(*word.split("@")) for word in words.split("+"))
    return ValidationReport(stable=not faults, faults=faults)


def assemble(robot: Robot, environment: str, placement: Placement) -> Scene:
    """A mount named "nowhere" cannot be assembled; other names are the faults the scene will have."""
    if placement.mount == "nowhere":
        raise MjcfError([fault("undefined_reference", "nowhere")])
    return Scene(mjcf=f"<scene faults='{placement.mount}'>{robot.mjcf}</scene>", placement=placement)


def parts(scripted: Scripted, **changes: object) -> Parts:
    values = {
        "team_for": scripted.team,
        "repair": repair,
        "validate": validate,
        "assemble": assemble,
        "picture": lambda _mjcf: PNG,
        "filmstrip": lambda _mjcf: PNG,
        "person": approve,
    }
    return Parts(**{**values, **changes})


def tried(progress: float, *, decisive: bool) -> TaskReport:
    """Return what a trial of two searches found."""
    attempts = tuple(
        Attempt(how="search", seed=seed, variation=0, tried=9, progress=progress + spread, reached="on its way",
                decisive=decisive, succeeded=decisive)
        for seed, spread in enumerate((-0.1, 0.1))
    )  # fmt: skip
    critique = Critique(passed=True, summary=f"It comes\nto {progress}.")
    return TaskReport(
        phase="solved" if decisive else "partial", progress=progress, critique=critique, attempts=attempts
    )


def new_run(folder: Path, **config: object) -> Run:
    return create_run(brief(), RunConfig(**{"concepts": 1, **config}), runs=folder)


def _concept(name: str) -> Concept:
    return Concept(
        name=name, interpretation="reach", morphology="arm", actuation="tendons", functional_part="tip", family="arm"
    )
