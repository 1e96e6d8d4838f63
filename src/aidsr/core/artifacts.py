"""What flows through AID-SR, in the order it flows. Read this file first.

    Brief -> Concept -> Robot -> ValidationReport -> Placement -> Scene -> ValidationReport -> Critique -> Decision

Every artifact is an immutable value that can be written to a run folder as JSON and read back equal. Nothing in this
file computes anything about robots: packages above it make these values and pass them on.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, computed_field, model_validator

from aidsr.core.errors import Limit
from aidsr.core.formatting import format_faults
from aidsr.core.rates import Rate

Vec3 = tuple[float, float, float]
Role = Literal["designer", "coder", "integrator", "judge"]
Base = Literal["fixed", "free", "moving", "any"]
Layer = Literal["load", "structure", "scope", "simulate", "realizability"]


class Artifact(BaseModel):
    """An immutable value; unknown fields are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


# --- what is asked ---------------------------------------------------------------------------------------------------


class GeomSummary(Artifact):
    """One collision or visual shape of the environment."""

    name: str
    shape: str
    size_m: tuple[float, ...]
    """MuJoCo's size numbers for this shape: radii and half lengths [m]."""
    position_m: Vec3
    """Centre in world coordinates at the start of an episode [m]."""
    z_axis: Vec3 = (0.0, 0.0, 1.0)
    """Direction of its own z axis in world coordinates: along a cylinder or capsule, out of a plane."""
    x_axis: Vec3 = (1.0, 0.0, 0.0)
    """Direction of its own x axis in world coordinates; gives how a box or an ellipsoid is turned about its z axis."""
    solid: bool = True
    """Whether it can be touched; what cannot is only drawn."""
    friction: Vec3 = (1.0, 0.005, 0.0001)
    """Sliding [1], torsional [m] and rolling [m], as MuJoCo's `friction`."""
    priority: int = 0
    """Of two shapes that touch, the friction of the one with the higher priority holds; of equal ones, the larger."""


class BodySummary(Artifact):
    """One body of the environment; the world itself is listed when it carries geoms."""

    name: str
    parent: str
    position_m: Vec3
    mass_kg: float
    joints: tuple[str, ...]
    """Each joint in words, for example "button_slide: slide along 0 0 1, 0 to 0.008 m"."""
    free: bool = False
    """Whether it has a free joint, and so can move in every direction."""
    movable: bool = False
    """Whether any joint moves its centre of mass."""
    geoms: tuple[GeomSummary, ...]


class SiteSummary(Artifact):
    """A named point of the environment."""

    name: str
    body: str
    position_m: Vec3


class MountSummary(Artifact):
    """A site where a robot may be attached: any site whose name is "mount" or begins with "mount_"."""

    name: str
    position_m: Vec3
    z_axis: Vec3
    """Direction the robot's own +z takes when it is placed there without rotation, in world coordinates."""
    x_axis: Vec3
    moved_by: tuple[str, ...]
    """Environment joints that move this mount; empty for one that stands still."""


class EnvironmentSummary(Artifact):
    """The environment as facts read from its MJCF."""

    gravity_m_s2: Vec3
    timestep_s: float
    mounts: tuple[MountSummary, ...]
    bodies: tuple[BodySummary, ...]
    sites: tuple[SiteSummary, ...]
    sensors: tuple[str, ...]
    actuators: tuple[str, ...]
    """Each by its name and, where it drives a hinge or slide, what its command means: quantity, unit and range."""


class Keep(Artifact):
    """A named part of a robot that must stay as it is, with everything inside it."""

    name: str
    """Of a body, tendon, actuator or any other element of the MJCF."""
    but: tuple[str, ...] = ()
    """MJCF attributes that may change all the same, such as "stiffness"."""


class Brief(Artifact):
    """The job given to a team: objective and environment."""

    objective: str
    task: str = ""
    """Name of the benchmark task, empty for an objective in the user's own words."""
    environment: str
    """MJCF of the environment, without a robot."""
    summary: EnvironmentSummary
    base: Base = "any"
    """What the task does with the robot's root: "fixed" to a mount, "free" on the ground, "moving" with a mount that
    the environment drives, or "any" when the Scene Integrator may choose."""
    needs_contact: bool = False
    """Whether the job can only be done by touching something."""
    judging: dict[str, str] = Field(default_factory=dict)
    """How the task is judged: what differs between episodes, what counts and what does not, by a title each."""
    starting_robot: str = ""
    """MJCF of a robot the user brought along to start from, empty otherwise."""
    keep: tuple[Keep, ...] = ()
    """What of the starting robot must stay as it is."""
    lessons: tuple[str, ...] = ()
    """What earlier designs measured, a paragraph each, where the run was given a memory."""


# --- what the team makes ---------------------------------------------------------------------------------------------


class ActuatorGroup(Artifact):
    """Actuators that act together as one action of a policy, as mirrored fingers do."""

    model_config = ConfigDict(use_attribute_docstrings=True)

    name: str
    """By which scripts and policies call them."""
    actuators: Annotated[tuple[str, ...], Field(min_length=1)]
    """Their names in the MJCF."""


class Concept(Artifact):
    """One idea of the Designer."""

    name: str
    interpretation: str
    """What the task demands of a body, before any robot is thought of."""
    morphology: str
    actuation: str
    functional_part: str
    """Which part does the work, in words or as the name it should get in the MJCF."""
    family: str
    """Short label of the morphology, for example "arm" or "three-finger gripper"; concepts of a run should differ."""
    parameters: dict[str, float] = Field(default_factory=dict)
    """Numbers the idea fixes, SI units in their names: {"length_m": 0.3, "segments": 12}."""
    actuator_groups: tuple[ActuatorGroup, ...] = ()
    rationale: str = ""


class Robot(Artifact):
    """The MJCF of a robot alone, and its author's notes."""

    mjcf: str
    functional_part: str
    """Name of the body or site that does the work."""
    actuator_groups: tuple[ActuatorGroup, ...] = ()
    notes: str = ""
    script: str = ""
    """Motion with which its author saw it do the job, in the notation of `aidsr.learn.openloop.script`; "" for none."""


class Repairs(Artifact):
    """Fixes applied by code to a robot's MJCF before validation, where only one meaning was possible."""

    model_config = ConfigDict(use_attribute_docstrings=True)

    notes: tuple[str, ...] = ()
    """One sentence each: element, name, line, what was done."""
    counts: dict[str, int] = Field(default_factory=dict)
    """How often each kind of repair was made; those never made are left out."""

    @property
    def total(self) -> int:
        """How many repairs were made."""
        return sum(self.counts.values())


class Placement(Artifact):
    """Where and how a robot stands in an environment. Decided by the Scene Integrator, carried out by code."""

    model_config = ConfigDict(use_attribute_docstrings=True)

    mount: str
    """Name of a mount site of the environment, or "world" for the origin."""
    base: Literal["fixed", "free"]
    """Whether the mount holds the robot's root; assembly adds or removes the free joint."""
    position_m: Vec3 = (0.0, 0.0, 0.0)
    """Of the robot's root in the mount's frame [m]."""
    rotation_deg: Vec3 = (0.0, 0.0, 0.0)
    """About the mount's x, then the new y, then the new z axis [deg]."""
    scale: Annotated[float, Field(ge=0.5, le=2.0)] = 1.0
    """Factor s on the robot's lengths, in the same material: mass and joint stiffness s^3, cable force s^2."""
    functional_part: str = ""
    """Body or site that does the work; empty keeps the robot's."""
    intended_contacts: tuple[str, ...] = ()
    """Environment bodies the robot is meant to touch."""
    reason: str = ""
    """Why there."""


class Scene(Artifact):
    """MJCF of a robot placed in an environment. The robot's names all begin with "robot/"."""

    mjcf: str
    placement: Placement
    notes: tuple[str, ...] = ()
    """What assembly changed, one sentence each: scaled, floor removed, free joint added."""


# --- what is found ---------------------------------------------------------------------------------------------------


class Fault(Artifact):
    """One diagnosed physical problem: what, where, how much, and what usually cures it."""

    model_config = ConfigDict(use_attribute_docstrings=True)

    code: str
    """Stable name of the kind of fault."""
    layer: Layer
    """What had to be looked at to find it."""
    severity: Literal["error", "warning"]
    names: tuple[str, ...] = ()
    """Bodies, joints, tendons, actuators or sensors concerned."""
    measured: float | None = None
    limit: float | None = None
    """What is allowed: the most where `measured` is above it, the least where it is below."""
    unit: str = ""
    whole: float | None = None
    """What 1 of `unit` is in `whole_unit`, where `unit` is relative: the length that `measured` is a share of."""
    whole_unit: str = ""
    """SI unit of `whole`."""
    message: str
    """What was measured or read, without guessing why."""
    likely_cause: str = ""
    cure: str = ""
    first_time_s: float | None = None
    """When it first showed in the test [s of simulation], where that is known."""
    line: int | None = None
    """Line of the MJCF text, where that is known."""


_VERDICTS = ("sound", "in_scope")
"""Verdicts of a report that follow from its faults."""


class ValidationReport(Artifact):
    """All faults of one model and the measurements behind them."""

    model_config = ConfigDict(use_attribute_docstrings=True)

    stable: bool
    """Sound and in scope: false exactly when a fault of severity "error" is among them."""
    faults: tuple[Fault, ...] = ()
    """Errors first."""
    measurements: dict[str, Any] = Field(default_factory=dict)
    """What the model is made of and what the tests measured, by names that carry their units."""
    versions: dict[str, str] = Field(default_factory=dict)
    notes: tuple[str, ...] = ()
    """What was put aside before looking, for example Markdown fences around the document."""

    @model_validator(mode="before")
    @classmethod
    def _without_verdicts(cls, data: Any) -> Any:
        """The verdicts of a file are computed again from its faults."""
        return {k: v for k, v in data.items() if k not in _VERDICTS} if isinstance(data, dict) else data

    @computed_field  # type: ignore[prop-decorator]
    @property
    def sound(self) -> bool:
        """Whether the physics holds: no error but those of the layer "scope"."""
        return all(fault.layer == "scope" for fault in self.errors)

    @computed_field  # type: ignore[prop-decorator]
    @property
    def in_scope(self) -> bool:
        """Whether it is a tendon-driven continuum robot: no error of the layer "scope", in a document that loads."""
        return all(fault.layer not in ("scope", "load") for fault in self.errors)

    @property
    def errors(self) -> tuple[Fault, ...]:
        """The faults of severity "error"."""
        return tuple(fault for fault in self.faults if fault.severity == "error")

    @property
    def warnings(self) -> tuple[Fault, ...]:
        """The faults of severity "warning"."""
        return tuple(fault for fault in self.faults if fault.severity == "warning")

    def account(self, max_bytes: int = 1600) -> str:
        """Return the report as plain text, one line per fault code, errors first.

        Faults of one code share a line. What does not fit is counted by code in the last line; all of it stands in the
        report itself.

        Args:
            max_bytes: Bound on the text in UTF-8, at least 200.
        """
        return format_faults((*self.errors, *self.warnings), max_bytes)


class CritiqueIssue(Artifact):
    """One reason why the Judge does not pass a scene."""

    blame: Literal["designer", "coder", "integrator"]
    component: str
    problem: str
    suggestion: str = ""


class Critique(Artifact):
    """The Judge's verdict on a stable scene."""

    passed: bool
    summary: str = ""
    issues: tuple[CritiqueIssue, ...] = ()
    progress: float | None = None
    """How far the scene came without learning, 0 to 1, where the Judge measured that."""

    @model_validator(mode="after")
    def _reasons_with_a_fail(self) -> Self:
        if self.passed == bool(self.issues):
            raise ValueError("a passing critique has no issues and a failing one at least one")
        return self


class Decision(Artifact):
    """The person's answer to a judged scene."""

    verdict: Literal["approve", "refine", "quit"]
    text: str = ""
    keep: tuple[Keep, ...] = ()
    """What a refinement must leave as it is."""

    @model_validator(mode="after")
    def _refine_says_what(self) -> Self:
        if self.verdict == "refine" and not self.text.strip():
            raise ValueError('a "refine" decision needs a text that says what to change')
        return self


class PassedLimit(Artifact):
    """A limit of a goal that was passed in an episode."""

    limit: str
    """What it is about, as "force on panel"."""
    worst: float
    """Largest value in the episode, in `unit`."""
    allowed: float
    """Largest value that passes nothing, in `unit`."""
    unit: str
    time_s: float
    """How long it was passed altogether [s]."""
    tolerated_s: float = 0.0
    """How long may pass in all limits together in an episode that still succeeds [s]."""

    @property
    def text(self) -> str:
        """The same as a clause, such as "force on panel 7.1 N of 6 N allowed, for 0.8 s of 0.2 s tolerated"."""
        much = f"{self.worst:.3g} {self.unit}"
        much += f" of {self.allowed:.3g} {self.unit} allowed" if self.allowed else " deep"
        tolerated = f" of {self.tolerated_s:.3g} s tolerated" if self.tolerated_s else ""
        return f"{self.limit} {much}, for {self.time_s:.3g} s{tolerated}"


class EpisodeResult(Artifact):
    """How one episode of a trained policy went."""

    variation: int
    """Index among the variations of its split."""
    ended: Literal["succeeded", "failed", "out_of_time", "diverged"]
    progress: float
    best_progress: float
    """The largest at any time, 0 to 1; `progress` is that at the end."""
    reward: float
    """Sum over the episode."""
    time_s: float
    reached: str = ""
    """The stage that it came to, in words; empty in older results."""
    held_s: float = 0.0
    """The longest that the goal held without a break [s]."""
    passed: tuple[PassedLimit, ...] = ()
    """Limits of a goal that it passed, for however short a time."""


class PlausibilityCheck(Artifact):
    """One condition of a valid result: what was measured (None where nothing could be), and whether it holds."""

    name: str
    passed: bool
    measured: float | None
    limit: float
    bound: Literal["at most", "at least", "limit"] = "limit"
    """On which side of the limit to be; older results have none."""
    unit: str = ""
    message: str


PerturbationKind = Literal[
    "stiffness",
    "damping",
    "friction",
    "mass",
    "cable_force",
    "delay",
    "low_cable_friction",
    "high_cable_friction",
    "combined",
]
"""In which way a scene is made to differ from its model; see docs/learning.md, robustness."""


class PerturbedEpisodes(Artifact):
    """How a policy does when the scene differs from its model in one way, at the variations of its evaluation."""

    model_config = ConfigDict(extra="ignore")

    kind: PerturbationKind
    summary: str
    """What differs, in words."""
    episodes: Annotated[int, Field(ge=1)]
    succeeded: tuple[int, ...]
    """Indices of the variations that succeeded."""
    diverged: int = 0
    """Episodes in which the simulation diverged."""
    nominal_successes: int
    """Episodes that succeed without the perturbation."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def success_share(self) -> float:
        """Share of the episodes that succeeded."""
        return self.success_rate.share

    @computed_field  # type: ignore[prop-decorator]
    @property
    def success_interval(self) -> tuple[float, float]:
        """Its Wilson interval at 95 %."""
        return self.success_rate.interval.low, self.success_rate.interval.high

    @property
    def success_rate(self) -> Rate:
        """Episodes that succeeded, of all."""
        return Rate(len(self.succeeded), self.episodes)

    @computed_field  # type: ignore[prop-decorator]
    @property
    def kept_share(self) -> float | None:
        """Successes as a share of those without the perturbation; None where there are none."""
        return len(self.succeeded) / self.nominal_successes if self.nominal_successes else None


SUCCESSFUL_SHARE = 0.5
"""Of its episodes that a successful policy wins, at least. Source: the paper's binary rate."""


class MeanAction(Artifact):
    """What the mean action of a policy wins alone, held from the beginning of an episode to its end."""

    action: tuple[float, ...]
    """Mean over all control steps of the episodes that the policy won, -1 to 1, one number for each group."""
    succeeded: int
    """Episodes that it wins."""
    of: int
    """Of so many that the policy won."""


class Evaluation(Artifact):
    """What a trained policy did at variations of its task it had never seen, and whether to believe it.

    The verdict stands in the file as well; when the file is read, it is computed again from episodes and checks.
    """

    model_config = ConfigDict(extra="ignore")

    task: str
    level: str
    benchmark_version: int
    episodes: Annotated[tuple[EpisodeResult, ...], Field(min_length=1)]
    checks: tuple[PlausibilityCheck, ...]
    versions: dict[str, str] = Field(default_factory=dict)
    """Of Python and of the packages that shape a result."""
    hold_s: float = 0.0
    """How long the goal has to hold without a break [s]; 0 in older results."""
    split: Literal["held_out", "development"] = "held_out"
    """Only held-out variations score a design; a verdict on others is advice to its designers."""
    perturbed: tuple[PerturbedEpisodes, ...] = ()
    """The same variations in scenes that differ from their model, where asked for; the verdict leaves them out."""
    mean_action: MeanAction | None = None
    """Whether a policy is needed at all; the verdict leaves it out. None where the policy won nothing, and in older
    results."""
    commit: str = ""
    """Of the source that evaluated, "-dirty" where files differed from it; a version where it was installed from a
    package; empty in results of before it was kept."""
    processor: str = ""
    """That evaluated; the last digits of a simulation depend on it."""
    scene_sha256: str = ""
    """Of the scene's text."""
    policy_sha256: str = ""
    """Of the policy's weights and normalisation; empty for what is no trained policy."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def success_share(self) -> float:
        """Share of the episodes that succeeded."""
        return self.success_rate.share

    @property
    def success_rate(self) -> Rate:
        """Episodes that succeeded, of all, with their interval."""
        return Rate(sum(episode.ended == "succeeded" for episode in self.episodes), len(self.episodes))

    @computed_field  # type: ignore[prop-decorator]
    @property
    def valid(self) -> bool:
        """Trained without failure and plausible as a continuum robot: every check passed."""
        return all(check.passed for check in self.checks)

    @computed_field  # type: ignore[prop-decorator]
    @property
    def successful(self) -> bool:
        """Valid, and success in at least half of the episodes."""
        return self.valid and self.success_share >= SUCCESSFUL_SHARE


class Attempt(Artifact):
    """One search for a motion that does the job blindly, in one variation, and how far its best motion came."""

    how: Literal["search", "script"]
    """Among motions of a few numbers; or among scripts of waypoints, from the best of the motions."""
    seed: int
    variation: int
    """Index among the development variations."""
    tried: int
    """Motions that were played."""
    progress: float
    reached: str
    """The same in words."""
    decisive: bool
    """Whether it reached the decisive stage of the task."""
    succeeded: bool


class TaskReport(Artifact):
    """Where a stable scene stops on its task when it is tried without learning, and whose work that is."""

    phase: Literal[
        "solved",
        "partial",
        "never_reached",
        "no_force",
        "wrong_way",
        "slipped",
        "unstable",
        "not_forward",
        "not_valid",
    ]
    progress: float
    """Mean over the searches."""
    critique: Critique
    attempts: tuple[Attempt, ...] = ()
    start_progress: float = 0.0
    """Before anything moves."""
    account: str = ""
    """What was tried and what happened, in figures; several lines."""
    policy: Evaluation | None = None
    """What a policy did after a short training, where one was asked for."""

    @property
    def spread(self) -> tuple[float, float]:
        """Least and greatest progress of the searches."""
        found = [attempt.progress for attempt in self.attempts if attempt.how == "search"] or [self.progress]
        return min(found), max(found)


class Outcome(Artifact):
    """How a design ended."""

    outcome: Literal["approved", "invalid", "quit", "out_of_budget"]
    reason: str
    iteration: int | None = None
    """Folder number of the iteration that was approved or given up."""
    limits: tuple[Limit, ...] = ()
    """Which limits a design that is out of budget came to."""
