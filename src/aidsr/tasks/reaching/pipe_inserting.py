"""Steer the functional part into the branch of a pipe."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.gentleness import SELDOM, after_touch, is_gentle, untouched
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess, share
from aidsr.tasks.task import FORCE_SCALE_N, FRICTION_ELSE, Criteria, Feature, Task, TaskState, span
from aidsr.tasks.variation import Change, Variation, shift_words

MOUTH_HEIGHT_M = 0.40
MOUTH_DEPTH_M = 0.35
"""Depth of the mouth below the mount [m]: as far as the mount can move down."""
FEED_M_S = 0.05
OFFSET_M = 0.02
LENGTH_M = 0.30
"""Length of the straight pipe [m]."""
JUNCTION_M = (0.13, 0.16)
"""Range of the depth below the mouth at which the middle lines of pipe and branch cross [m]."""
BRANCH_DEG = (50.0, 80.0)
"""Range of the angle between the branch and straight down [deg]."""
BRANCH_M = 0.16
"""Length of the branch from that crossing [m]."""
INNER_M = 0.035
"""Half the inner width of pipe and branch [m]."""
THICKNESS_M = 0.008
"""Thickness of the walls [m]. Our choice: a tip that is pressed hard sinks up to 3 mm into a wall, because contacts are
soft, and would come out on the other side of a thinner wall."""
FRICTION = (0.2, 0.9)

DEPTH_M = 0.10
"""Required depth of the functional part in the branch, from the crossing [m]."""
PASSED_M = 0.03
"""Distance outside the branch at which a tenth of the way past the crossing counts [m]; see `closeness`. Our choice."""
MAX_WALL_N = 20.0


@dataclass(frozen=True)
class PipeInserting(Task):
    """The functional part gets into a branch of a pipe through its mouth, gently.

    What is straight or limp goes on straight down: only a body that bends where the branch leaves gets into it. A tip
    that comes into the branch from outside does not count, nor one beyond the branch's end.

    Source: our choice; a bore of 70 mm, as in inspection of pipes with soft growing robots, and a branch that the tip
    has to be steered into, as in bronchoscopy.
    """

    name: ClassVar = "reaching/pipe_inserting"
    unchanged_since: ClassVar = 7
    base: ClassVar = "moving"
    time_limit_s: ClassVar = 30.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.2, "in the mouth"), (0.65, "at the branch"), (1.0, "deep in the branch"))
    decisive: ClassVar = "deep in the branch"
    required_names: ClassVar = ("mount", "feed", "pipe")
    policy_actuators: ClassVar = ("feed",)
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="wall_contacts", quantity="contacts", target="pipe", slots=16),
    )
    features: ClassVar = (
        Feature("functional part to the middle of the mouth", "m", (-0.8, 0.8), "pipe_position, tip_position", size=3),
        Feature("functional part to its goal in the branch", "m", (-0.8, 0.8), "pipe_position, tip_position", size=3),
        Feature("direction of the branch", "", (-1, 1), "(parameters)", size=3),
        Feature("way in pipe and branch, 1 = at the goal", "", (-2, 1.25), "pipe_position, tip_position"),
        Feature(
            f"distance from their middle lines, 1 = {1000 * INNER_M:g} mm", "", (0, 20), "pipe_position, tip_position"
        ),
        Feature("feed", "m", (0, 0.35), "base_feed"),
        Feature(f"force on the walls, 1 = {FORCE_SCALE_N:g} N", "", (0, 8), "wall_contacts"),
        Feature("1 while inside, having come in through the mouth", "", (0, 1), "(state)"),
    )
    hard: ClassVar = {"wall_n": 2.0}

    wall_n: float = 5.0
    """Force on the walls that may be exceeded only rarely [N]; see `SELDOM`."""

    @property
    def objective(self) -> str:
        return (
            f"Get the tip {DEPTH_M:g} m deep into the branch of a pipe for {self.hold_s:g} s, counted from the pipe's "
            f"middle line, in through its mouth and never outside its walls on the way, with more than {self.wall_n:g} "
            f"N on the walls in at most {100 * SELDOM:g} % of the time in contact. The pipe is square, "
            f"{2000 * INNER_M:g} mm wide inside, opens upwards {MOUTH_DEPTH_M:g} m below the mount and goes straight "
            f"down for {LENGTH_M:g} m, and {span(JUNCTION_M)} m below its mouth a branch as wide and {BRANCH_M:g} m "
            f"long leaves it to any side, {span(BRANCH_DEG)} degrees from straight down; the mount can move down by "
            f"{MOUTH_DEPTH_M:g} m at up to {FEED_M_S:g} m/s."
        )

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"Offset +-{1000 * OFFSET_M:g} mm to each side, branch to any side, {span(JUNCTION_M)} m below the "
                f"mouth and {span(BRANCH_DEG)} deg from straight down, friction {span(FRICTION)}."
            ),
            progress=(
                "A fifth for coming to the mouth, the rest for the way down the pipe and into the branch, if it was "
                "entered through the mouth and not left since."
            ),
            success=(
                f"The tip is deep enough along the branch and not beyond its end at {BRANCH_M:g} m, it came in through "
                "the mouth and has been between the outer faces of the walls since, and all contacts on the walls "
                f"together were more than {self.wall_n:g} N in at most {100 * SELDOM:g} % of the time in contact. The "
                "policy observes to which side the branch leaves, and how steeply."
            ),
            violation=f"More than {MAX_WALL_N:g} N on the walls.",
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        return (
            # the wall's z axis points outwards along the branch, and its centre is half way along it
            Mark(
                element="geom",
                name="branch_left",
                at_m=(0.0, -INNER_M - THICKNESS_M / 2, DEPTH_M - BRANCH_M / 2),
                radius_m=INNER_M / 2,
            ),
        )

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        x, y = rng.uniform(-OFFSET_M, OFFSET_M, size=2)
        side_rad, junction_m = rng.uniform(-np.pi, np.pi), rng.uniform(*JUNCTION_M)
        branch_rad = float(np.deg2rad(rng.uniform(*BRANCH_DEG)))
        walls = pipe_changes(junction_m, branch_rad)
        friction = (rng.uniform(*FRICTION), *FRICTION_ELSE)
        rough = tuple(Change("geom_friction", wall.name, friction) for wall in walls if wall.field == "geom_pos")
        place = Change("body_pos", "pipe", (x, y, MOUTH_HEIGHT_M))
        turn = Change("body_quat", "pipe", (np.cos(side_rad / 2), 0.0, 0.0, np.sin(side_rad / 2)))
        way = {"side_rad": (side_rad,), "junction_m": (junction_m,), "branch_rad": (branch_rad,)}
        words = (
            f"pipe {shift_words(x, y)}; branch {np.rad2deg(side_rad):+.0f} deg from +x towards +y, "
            f"{1000 * junction_m:.0f} mm below the mouth, {np.rad2deg(branch_rad):.0f} deg from straight down; "
            f"friction {friction[0]:.2f}"
        )
        return Variation((place, turn, *walls, *rough), way, words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        tip, to_mouth_m = _tip(readings), readings["pipe_position"] - readings["tip_position"]
        junction_m, direction = readings.parameters["junction_m"], branch_direction(readings)
        to_goal_m = to_mouth_m + DEPTH_M * direction - junction_m * (0.0, 0.0, 1.0)
        way = tip.way_m / (junction_m[:, 0] + DEPTH_M)
        beside = np.minimum(tip.beside_pipe_m, tip.beside_branch_m) / INNER_M
        force = readings.peak_contact_n("wall_contacts", together=True) / FORCE_SCALE_N
        return np.column_stack(
            [to_mouth_m, to_goal_m, direction, way, beside, readings["base_feed"], force, state["entered"]]
        )

    def reset_state(self, readings: Readings) -> TaskState:
        tip = _tip(readings)
        # a long robot that hangs straight down has its tip in the mouth at once
        return {**untouched(readings.n), "over": tip.over.astype(float), "entered": tip.before_branch.astype(float)}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        force_n = readings.peak_contact_n("wall_contacts", together=True)
        tip = _tip(readings)
        through_mouth = (state["over"] > 0.0) & tip.before_branch
        entered = through_mouth | ((state["entered"] > 0.0) & tip.within)
        return {
            **after_touch(state, force_n, self.wall_n, self.control_dt_s),
            "over": tip.over.astype(float),
            "entered": entered.astype(float),
        }

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        tip = _tip(readings)
        inside = tip.inside & (state["entered"] > 0.0)
        distance = np.linalg.norm(readings["pipe_position"] - readings["tip_position"], axis=1)
        near = np.where(inside, 1.0, closeness(distance, margin=0.2))
        goal_m = readings.parameters["junction_m"][:, 0] + DEPTH_M
        return 0.2 * near + 0.8 * np.where(inside, share(tip.way_m, goal_m), 0.0)

    def violation(self, readings: Readings) -> FloatArray:
        return excess(readings.peak_contact_n("wall_contacts", together=True), MAX_WALL_N)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        tip = _tip(readings)
        deep = tip.in_branch & (tip.branch_m >= DEPTH_M)
        return deep & (state["entered"] > 0.0) & is_gentle(state)


@dataclass(frozen=True)
class InPipe:
    """Positions of points in a pipe with a branch, each (n,) [m]."""

    branch_m: FloatArray
    """Depth in the branch, from the crossing of the middle lines; negative before it."""
    beside_branch_m: FloatArray
    """Distance from the branch's middle line: the larger of the distances along the two sides of its cross-section."""
    beside_pipe_m: FloatArray
    """Distance from the pipe's middle line, likewise."""
    way_m: FloatArray
    """Depth in the pipe up to the crossing, plus depth in the branch; it decreases for points that miss the branch."""
    over: BoolArray
    """Whether the point is higher than the mouth, or on its rim."""
    before_branch: BoolArray
    """Whether the point is between the walls of the pipe, from the mouth to the crossing."""
    in_branch: BoolArray
    """Whether the point is between the walls of the branch, from the crossing to the end."""
    inside: BoolArray
    """Whether the point is between the walls of the pipe or of the branch, and not beyond their ends."""
    within: BoolArray
    """The same with the walls as part of the inside: a tip that is pressed against a wall sinks into it."""


def _tip(readings: Readings) -> InPipe:
    """Return the position of the functional part in the pipe."""
    x, y, z = (readings["tip_position"] - readings["pipe_position"]).T
    side_rad, junction_m, branch_rad = (
        readings.parameters[name][:, 0] for name in ("side_rad", "junction_m", "branch_rad")
    )
    point_m = np.column_stack(
        [np.cos(side_rad) * x + np.sin(side_rad) * y, np.cos(side_rad) * y - np.sin(side_rad) * x, z]
    )
    return in_pipe(point_m, junction_m, branch_rad)


def branch_direction(readings: Readings) -> FloatArray:
    """Return the direction in which the branch leaves, in world axes, (n, 3)."""
    side_rad, branch_rad = readings.parameters["side_rad"][:, 0], readings.parameters["branch_rad"][:, 0]
    out = np.sin(branch_rad)
    return np.column_stack([out * np.cos(side_rad), out * np.sin(side_rad), -np.cos(branch_rad)])


def in_pipe(point_m: FloatArray, junction_m: FloatArray, branch_rad: FloatArray) -> InPipe:
    """Return the positions of points in a pipe.

    Args:
        point_m: Points in the frame of the pipe (see `Wall`), (n, 3) [m].
        junction_m: Depth of each crossing, (n,) [m].
        branch_rad: Angle of each branch from straight down, (n,) [rad].
    """
    x, y, z = point_m.T
    below_m, c, s = -z - junction_m, np.cos(branch_rad), np.sin(branch_rad)
    branch_m = s * x + c * below_m
    beside_branch_m = np.maximum(np.abs(c * x - s * below_m), np.abs(y))
    beside_pipe_m = np.maximum(np.abs(x), np.abs(y))
    off_way = closeness(beside_branch_m, within=INNER_M, margin=PASSED_M)
    past = (branch_m > 0.0) & ((below_m > 0.0) | (beside_branch_m <= INNER_M))
    way_m = np.where(past, junction_m + branch_m * off_way, np.minimum(-z, junction_m))

    def between(half_m: float) -> tuple[BoolArray, BoolArray]:
        in_straight = (z <= 0.0) & (z >= -LENGTH_M) & (beside_pipe_m <= half_m)
        in_branch = (z <= 0.0) & (branch_m > 0.0) & (branch_m <= BRANCH_M) & (beside_branch_m <= half_m)
        return in_straight, in_branch

    in_straight, in_branch = between(INNER_M)
    return InPipe(
        branch_m=branch_m,
        beside_branch_m=beside_branch_m,
        beside_pipe_m=beside_pipe_m,
        way_m=way_m,
        over=z > -THICKNESS_M,  # as far as a tip sinks into the rim
        before_branch=in_straight & (below_m <= 0.0),
        in_branch=in_branch,
        inside=in_straight | in_branch,
        within=np.logical_or(*between(INNER_M + THICKNESS_M)),
    )


@dataclass(frozen=True)
class Wall:
    """One flat wall, a box in the frame of the pipe: origin in the mouth, +z out of it, branch towards +x."""

    half_size_m: tuple[float, float, float]
    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


def pipe_walls(junction_m: float, branch_rad: float) -> dict[str, Wall]:
    """Return the walls of a pipe, by the names of their geoms.

    Args:
        junction_m: Depth at which the middle lines of pipe and branch cross [m].
        branch_rad: Angle of the branch from straight down [rad].
    """
    inner, thick = INNER_M, THICKNESS_M
    out, wide = inner + thick / 2, inner + thick
    c, s = np.cos(branch_rad), np.sin(branch_rad)
    # where the faces of the branch meet that of the pipe: first along the branch, then (opens, closes) from the mouth
    above_m, below_m = inner * (1.0 - c) / s, inner * (1.0 + c) / s
    below_m += thick / s  # it begins at the outside of the pipe's wall, which ends level with it
    opens_m, closes_m = (junction_m - inner * s + above_m * c, junction_m + inner * s + below_m * c)
    along, up = np.array([s, 0.0, -c]), np.array([c, 0.0, s])
    junction = np.array([0.0, 0.0, -junction_m])
    turn = (np.pi - branch_rad) / 2
    turned = (float(np.cos(turn)), 0.0, float(np.sin(turn)), 0.0)

    def straight(x: float, y: float, half_x: float, half_y: float, start_m: float, end_m: float) -> Wall:
        return Wall((half_x, half_y, (end_m - start_m) / 2), (x, y, -(start_m + end_m) / 2))

    def branching(up_m: float, y: float, half_x: float, half_y: float, start_m: float) -> Wall:
        middle = junction + up_m * up + (start_m + BRANCH_M) / 2 * along + np.array([0.0, y, 0.0])
        place = (float(middle[0]), float(middle[1]), float(middle[2]))
        return Wall((half_x, half_y, float(BRANCH_M - start_m) / 2), place, turned)

    return {
        "pipe_back": straight(-out, 0.0, thick / 2, wide, 0.0, LENGTH_M),
        "pipe_left": straight(0.0, out, wide, thick / 2, 0.0, LENGTH_M),
        "pipe_right": straight(0.0, -out, wide, thick / 2, 0.0, LENGTH_M),
        "pipe_above": straight(out, 0.0, thick / 2, wide, 0.0, float(opens_m)),
        "pipe_below": straight(out, 0.0, thick / 2, wide, float(closes_m), LENGTH_M),
        "branch_above": branching(out, 0.0, thick / 2, wide, float(above_m)),
        "branch_below": branching(-out, 0.0, thick / 2, wide, float(below_m)),
        "branch_left": branching(0.0, out, wide, thick / 2, 0.0),
        "branch_right": branching(0.0, -out, wide, thick / 2, 0.0),
    }


def pipe_changes(junction_m: float, branch_rad: float) -> tuple[Change, ...]:
    """Return the changes that give the environment's pipe another branch; arguments as in `pipe_walls`."""
    return tuple(
        change
        for name, wall in pipe_walls(junction_m, branch_rad).items()
        for change in (
            Change("geom_size", name, wall.half_size_m),
            Change("geom_pos", name, wall.position_m),
            Change("geom_quat", name, wall.quaternion),
        )
    )
