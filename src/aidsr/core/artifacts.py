"""The data that the stages of AID-SR pass on, in the order of the stages. Read this file first.

    Brief -> Concept -> Robot -> ValidationReport -> Placement -> Scene -> ValidationReport -> Critique -> Decision

Every artifact is an immutable value that can be written to a run folder as JSON and read back equal. This file computes
nothing about robots: other packages create these values and pass them on.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import AliasChoices, BaseModel, ConfigDict, Field, computed_field, model_validator

from aidsr.core.errors import Limit
from aidsr.core.formatting import format_faults
from aidsr.core.rates import Rate

Vec3 = tuple[float, float, float]
Role = Literal["designer", "coder", "integrator", "judge"]
Base = Literal["fixed", "free", "moving", "any"]
Layer = Literal["load", "structure", "scope", "simulate", "realizability"]
MOUNTS: dict[Base, Literal["auto", "fixed", "free"]] = {
    "fixed": "fixed",
    "moving": "fixed",
    "free": "free",
    "any": "auto",
}
"""Mount of a robot alone in validation and measurement, by the base of its job."""


class Artifact(BaseModel):
    """Base class of immutable values; unknown fields are rejected."""

    model_config = ConfigDict(frozen=True, extra="forbid")


# --- the job ---------------------------------------------------------------------------------------------------------


class GeomSummary(Artifact):
    """One collision or visual shape of the environment."""

    name: str
    shape: str
    size_m: tuple[float, ...]
    """MuJoCo's `size` of this shape: radii and half lengths [m]."""
    position_m: Vec3
    """Centre in world coordinates at the start of an episode [m]."""
    z_axis: Vec3 = (0.0, 0.0, 1.0)
    """Direction of its own z axis in world coordinates: along a cylinder or capsule, out of a plane."""
    x_axis: Vec3 = (1.0, 0.0, 0.0)
    """Direction of its own x axis in world coordinates: the rotation of a box or an ellipsoid about its z axis."""
    solid: bool = True
    """Whether it takes part in contacts; a shape that does not is only drawn."""
    friction: Vec3 = (1.0, 0.005, 0.0001)
    """Sliding [1], torsional [m] and rolling [m] friction, as MuJoCo's `friction`."""
    priority: int = 0
    """In a contact, the friction of the shape with the higher priority applies; with equal priorities, the larger."""


class BodySummary(Artifact):
    """One body of the environment; the world body is listed if it has geoms."""

    name: str
    parent: str
    position_m: Vec3
    mass_kg: float
    joints: tuple[str, ...]
    """Each joint in words, for example "button_slide: slide along 0 0 1, 0 to 0.008 m"."""
    free: bool = False
    """Whether it has a free joint, so that it can move in every direction."""
    movable: bool = False
    """Whether any joint moves its centre of mass."""
    geoms: tuple[GeomSummary, ...]


class SiteSummary(Artifact):
    """A named point of the environment."""

    name: str
    body: str
    position_m: Vec3


class MountSummary(Artifact):
    """A site to which a robot can be attached: any site whose name is "mount" or begins with "mount_"."""

    name: str
    position_m: Vec3
    z_axis: Vec3
    """Direction of the robot's +z axis in world coordinates when it is placed there without rotation."""
    x_axis: Vec3
    moved_by: tuple[str, ...]
    """Joints of the environment that move this mount; empty if it does not move."""


class EnvironmentSummary(Artifact):
    """Facts about the environment, read from its MJCF."""

    gravity_m_s2: Vec3
    timestep_s: float
    mounts: tuple[MountSummary, ...]
    bodies: tuple[BodySummary, ...]
    sites: tuple[SiteSummary, ...]
    sensors: tuple[str, ...]
    actuators: tuple[str, ...]
    """Name of each actuator and, if it drives a hinge or slide joint, the quantity, unit and range of its control."""


class Keep(Artifact):
    """A named element of a robot that must stay unchanged, with everything inside it."""

    name: str
    """Name of a body, tendon, actuator or any other MJCF element."""
    but: tuple[str, ...] = ()
    """MJCF attributes that may still change, such as "stiffness"."""


class Brief(Artifact):
    """The job given to a team: objective and environment."""

    objective: str
    task: str = ""
    """Name of the benchmark task; empty for an objective in the user's own words."""
    environment: str
    """MJCF of the environment, without a robot."""
    summary: EnvironmentSummary
    base: Base = "any"
    """How the task holds the robot's root: "fixed" to a mount, "free" on the ground, "moving" with a mount that the
    environment drives, or "any" if the Scene Integrator may choose."""
    needs_contact: bool = False
    """Whether the job can only be done with contact."""
    judging: dict[str, str] = Field(default_factory=dict)
    """How success is judged, as text by title: what varies between episodes, what counts and what does not."""
    starting_robot: str = ""
    """MJCF of a robot that the user supplied as a starting point; empty if there is none."""
    keep: tuple[Keep, ...] = ()
    """Parts of the starting robot that must stay unchanged."""
    lessons: tuple[str, ...] = ()
    """Measurements of earlier designs, one paragraph each; empty if the run uses no memory."""


# --- what the team designs -------------------------------------------------------------------------------------------


class ActuatorGroup(Artifact):
    """Actuators that act together as one action of a policy, as mirrored fingers do."""

    model_config = ConfigDict(use_attribute_docstrings=True)

    name: str
    """By which scripts and policies call them."""
    actuators: Annotated[tuple[str, ...], Field(min_length=1)]
    """Their names in the MJCF."""


class Concept(Artifact):
    """One design idea of the Designer."""

    name: str
    interpretation: str
    """What the task requires of a robot, stated before any robot is designed."""
    morphology: str
    actuation: str
    functional_part: str
    """Part that does the work, described in words or by the name that it should get in the MJCF."""
    family: str
    """Short label of the morphology, for example "arm" or "three-finger gripper"; concepts of one run should
    differ."""
    parameters: dict[str, float] = Field(default_factory=dict)
    """Numbers that the concept fixes, with SI units in their names: {"length_m": 0.3, "segments": 12}."""
    actuator_groups: tuple[ActuatorGroup, ...] = ()
    rationale: str = ""


class Robot(Artifact):
    """A robot without an environment: its MJCF and its author's notes."""

    mjcf: str
    functional_part: str
    """Name of the body or site that does the work."""
    actuator_groups: tuple[ActuatorGroup, ...] = ()
    notes: str = ""
    script: str = ""
    """Motion with which the author saw it do the job, in the notation of `aidsr.learn.openloop.script`; "" for none."""


class Repairs(Artifact):
    """Fixes applied by code to a robot's MJCF before validation, where only one meaning was possible."""

    model_config = ConfigDict(use_attribute_docstrings=True)

    notes: tuple[str, ...] = ()
    """One sentence each: element, name, line, what was done."""
    counts: dict[str, int] = Field(default_factory=dict)
    """How often each kind of repair was made; those never made are left out."""

    @property
    def total(self) -> int:
        """Number of repairs."""
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
    """MJCF of a robot placed in an environment. All names of the robot begin with "robot/"."""

    mjcf: str
    placement: Placement
    notes: tuple[str, ...] = ()
    """Changes made by assembly, one sentence each: robot scaled, floor removed, free joint added."""


# --- results ---------------------------------------------------------------------------------------------------------


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
"""Fields of a report that are computed from its faults."""


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
        """Drop the verdicts that a file holds: they are recomputed from its faults."""
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

        Faults with the same code share a line. Codes that do not fit are listed in the last line; the report itself has
        all faults.

        Args:
            max_bytes: Maximum length of the text in UTF-8 [bytes], at least 200.
        """
        return format_faults((*self.errors, *self.warnings), max_bytes)


class CritiqueIssue(Artifact):
    """One reason why the Judge rejected a scene."""

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
    """Progress of the scene without learning, 0 to 1; None if the Judge did not measure it."""

    @model_validator(mode="after")
    def _reasons_with_a_fail(self) -> Self:
        if self.passed == bool(self.issues):
            raise ValueError("a passing critique has no issues and a failing one at least one")
        return self


class Decision(Artifact):
    """A person's decision on a scene that the Judge passed."""

    verdict: Literal["approve", "refine", "quit"]
    text: str = ""
    keep: tuple[Keep, ...] = ()
    """Parts that a refinement must leave unchanged."""

    @model_validator(mode="after")
    def _refine_says_what(self) -> Self:
        if self.verdict == "refine" and not self.text.strip():
            raise ValueError('a "refine" decision needs a text that says what to change')
        return self


class ExceededLimit(Artifact):
    """A limit of a goal that was exceeded in an episode."""

    limit: str
    """Name of the limited quantity, such as "force on panel"."""
    worst: float
    """Largest value in the episode, in `unit`."""
    allowed: float
    """Largest allowed value, in `unit`."""
    unit: str
    time_s: float
    """Total time for which the limit was exceeded [s]."""
    tolerated_s: float = 0.0
    """Total time for which limits of the goal may be exceeded in an episode that still succeeds [s]; 0 for limits that
    are not counted this way."""

    @property
    def text(self) -> str:
        """The limit in words, such as "force on panel 7.1 N of 6 N allowed, for 0.8 s of 0.2 s tolerated"."""
        much = f"{self.worst:.3g} {self.unit}"
        much += f" of {self.allowed:.3g} {self.unit} allowed" if self.allowed else " deep"
        tolerated = f" of {self.tolerated_s:.3g} s tolerated" if self.tolerated_s else ""
        return f"{self.limit} {much}, for {self.time_s:.3g} s{tolerated}"


class EpisodeResult(Artifact):
    """Result of one episode of a policy."""

    variation: int
    """Index among the variations of its split."""
    ended: Literal["succeeded", "failed", "out_of_time", "diverged"]
    progress: float
    """Progress at the end of the episode, 0 to 1."""
    best_progress: float
    """Largest progress at any time of the episode, 0 to 1."""
    reward: float
    """Sum of the rewards of the episode."""
    time_s: float
    reached: str = ""
    """Stage that was reached, in words; empty in older results."""
    held_s: float = 0.0
    """Longest time for which the goal held without interruption [s]."""
    exceeded_limits: Annotated[
        tuple[ExceededLimit, ...], Field(validation_alias=AliasChoices("exceeded_limits", "passed"))
    ] = ()
    """Limits of the goal that were exceeded for any length of time; called "passed" in older files."""
    penalized_s: float | None = None
    """Time in which the task's penalty applied, for example because of too large a force [s]; None in older results."""


class PlausibilityCheck(Artifact):
    """One condition of a valid result: the measured value (None if it could not be measured), and whether it passed."""

    name: str
    passed: bool
    measured: float | None
    limit: float
    bound: Literal["at most", "at least", "limit"] = "limit"
    """Direction of the limit; "limit" in older results, which do not record it."""
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
"""Kind of difference between a perturbed scene and its model; see docs/learning.md, robustness."""


class PerturbedEpisodes(Artifact):
    """Results of a policy in scenes that differ from their model in one way, on the variations of its evaluation."""

    model_config = ConfigDict(extra="ignore")

    kind: PerturbationKind
    summary: str
    """The difference in words."""
    episodes: Annotated[int, Field(ge=1)]
    succeeded: tuple[int, ...]
    """Indices of the variations whose episodes succeeded."""
    diverged: int = 0
    """Number of episodes in which the simulation diverged."""
    nominal_successes: int
    """Number of episodes that succeed without the perturbation."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def success_share(self) -> float:
        """Share of the episodes that succeeded."""
        return self.success_rate.share

    @computed_field  # type: ignore[prop-decorator]
    @property
    def success_interval(self) -> tuple[float, float]:
        """Bounds of the 95 % Wilson interval of `success_share`."""
        return self.success_rate.interval.low, self.success_rate.interval.high

    @property
    def success_rate(self) -> Rate:
        """Number of successful episodes, out of all."""
        return Rate(len(self.succeeded), self.episodes)

    @computed_field  # type: ignore[prop-decorator]
    @property
    def kept_share(self) -> float | None:
        """Successes relative to those without the perturbation, above 1 if there are more; None if there are none."""
        return len(self.succeeded) / self.nominal_successes if self.nominal_successes else None


SUCCESSFUL_SHARE = 0.5
"""Least share of successful episodes of a successful policy. Source: the paper's binary rate."""


class MeanAction(Artifact):
    """Result of holding the mean action of a policy constant over whole episodes, instead of running the policy."""

    action: tuple[float, ...]
    """Mean over all control steps of the policy's successful episodes, -1 to 1, one number for each actuator group."""
    succeeded: int
    """Number of replayed episodes that succeed with the mean action."""
    of: int
    """Number of replayed episodes; the policy succeeds in all of them."""

    @property
    def suffices(self) -> bool:
        """Whether at least half of the replayed episodes succeed, so that no policy is needed."""
        return self.succeeded >= SUCCESSFUL_SHARE * self.of


class Evaluation(Artifact):
    """Results of a trained policy on variations of its task that it had never seen, and checks of their plausibility.

    The verdict is also written to the file; when the file is read, it is recomputed from the episodes and checks.
    """

    model_config = ConfigDict(extra="ignore")

    task: str
    level: str
    benchmark_version: int
    episodes: Annotated[tuple[EpisodeResult, ...], Field(min_length=1)]
    checks: tuple[PlausibilityCheck, ...]
    versions: dict[str, str] = Field(default_factory=dict)
    """Versions of Python and of the packages that affect a result."""
    hold_s: float = 0.0
    """Time for which the goal has to hold without interruption [s]; 0 in older results."""
    split: Literal["held_out", "development"] = "held_out"
    """Split of the variations. Only held-out ones score a design; results on development ones are for its designers."""
    perturbed: tuple[PerturbedEpisodes, ...] = ()
    """Results on the same variations in perturbed scenes, if requested; they do not affect the verdict."""
    mean_action: MeanAction | None = None
    """Test of whether a policy is needed at all; it does not affect the verdict. None if no episode succeeded, and in
    older results."""
    commit: str = ""
    """Commit of the source code that evaluated, with "-dirty" if files differed from it; the package version if it was
    installed as a package; empty in older results."""
    processor: str = ""
    """Processor that evaluated; the last digits of a simulation depend on it."""
    scene_sha256: str = ""
    """SHA-256 of the scene's MJCF text."""
    policy_sha256: str = ""
    """SHA-256 of the policy's weights and normalisation; empty if the policy was not trained."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def success_share(self) -> float:
        """Share of the episodes that succeeded."""
        return self.success_rate.share

    @property
    def penalized_share(self) -> float | None:
        """Share of the time of successful episodes in which the task's penalty applied; None if unknown or none won."""
        won = [one for one in self.episodes if one.ended == "succeeded" and one.penalized_s is not None]
        return sum(one.penalized_s or 0.0 for one in won) / sum(one.time_s for one in won) if won else None

    @property
    def success_rate(self) -> Rate:
        """Number of successful episodes, out of all, with its interval."""
        return Rate(sum(episode.ended == "succeeded" for episode in self.episodes), len(self.episodes))

    @computed_field  # type: ignore[prop-decorator]
    @property
    def valid(self) -> bool:
        """Whether every check passed: trained without failure and plausible as a continuum robot."""
        return all(check.passed for check in self.checks)

    @computed_field  # type: ignore[prop-decorator]
    @property
    def successful(self) -> bool:
        """Whether the result is valid and at least half of the episodes succeeded."""
        return self.valid and self.success_share >= SUCCESSFUL_SHARE


class Attempt(Artifact):
    """One search for an open-loop motion that does the job in one variation, and the result of its best motion."""

    how: Literal["search", "script"]
    """"search": among motions with a few parameters. "script": among scripts of waypoints, starting from the best of
    those motions."""
    seed: int
    variation: int
    """Index among the development variations."""
    tried: int
    """Number of motions that were played."""
    progress: float
    """Progress of the best motion, 0 to 1."""
    reached: str
    """Stage that the best motion reached, in words."""
    decisive: bool
    """Whether the best motion reached the decisive stage of the task."""
    succeeded: bool


class TaskReport(Artifact):
    """Result of trying a stable scene on its task: where it stops, and which role is responsible.

    It is tried without learning, or after a short training.
    """

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
    """Phase in which the scene stops.

    - solved: a motion or a policy succeeds; for a policy, in at least `SUCCESSFUL_SHARE` of its episodes.
    - partial: the decisive stage is reached without success, a policy wins fewer episodes than that but enough, or the
      trial itself failed.
    - never_reached: nothing touched the target, or the functional part did not come to its point.
    - no_force: the target was touched, but never with enough sustained force.
    - wrong_way: touched with enough force, but the target does not move as the job asks.
    - slipped: touched and lost again.
    - unstable: the simulation diverged.
    - not_forward: there is nothing to touch, and the robot did not move forward.
    - not_valid: a policy wins, but a check of its validity fails.
    """
    progress: float
    """Mean progress of the searches, 0 to 1."""
    critique: Critique
    attempts: tuple[Attempt, ...] = ()
    start_progress: float = 0.0
    """Progress before anything moves."""
    account: str = ""
    """Trials and their results with figures, as text of several lines."""
    policy: Evaluation | None = None
    """Evaluation of a policy after a short training, if one was requested."""

    @property
    def spread(self) -> tuple[float, float]:
        """Smallest and largest progress of the searches."""
        found = [attempt.progress for attempt in self.attempts if attempt.how == "search"] or [self.progress]
        return min(found), max(found)


class Outcome(Artifact):
    """How a design ended."""

    outcome: Literal["approved", "invalid", "quit", "out_of_budget"]
    reason: str
    iteration: int | None = None
    """Folder number of the iteration that was approved or given up."""
    limits: tuple[Limit, ...] = ()
    """Limits that ended a design that is out of budget."""
