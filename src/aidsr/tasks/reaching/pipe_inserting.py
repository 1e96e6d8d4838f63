"""Push the functional part down a bent pipe."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess, share
from aidsr.tasks.task import FORCE_SCALE_N, FRICTION_ELSE, Criteria, Feature, Task, TaskState, span
from aidsr.tasks.variation import Change, Variation

MOUTH_HEIGHT_M = 0.40
MOUTH_DEPTH_M = 0.35
"""How far below the mount the mouth lies: as far as the mount can move down."""
FEED_M_S = 0.05
OFFSET_M = 0.02
LENGTH_M = 0.30
"""Length of the centre line from the mouth."""
BEND_DEG = (30.0, 60.0)
BEND_RADIUS_M = 0.13
INNER_M = 0.035
"""Inner radius, to the middles of the walls' inner faces."""
THICKNESS_M = 0.008
"""Our choice: a tip that is pressed hard sinks up to 3 mm into a wall, as soft contacts let it, and would come out of
a thinner one on the wrong side."""
SIDES = 8
BENT_RINGS = 5
FRICTION = (0.2, 0.9)

DEPTH_M = 0.24
MAX_WALL_N = 20.0
SELDOM = 0.05
"""Share of the time in which the wall force may be larger than its limit."""


@dataclass(frozen=True)
class PipeInserting(Task):
    """The functional part gets deep into a pipe, gently.

    Source: our choice; a bore of 70 mm, as in inspection of pipes with soft growing robots.
    """

    name: ClassVar = "reaching/pipe_inserting"
    base: ClassVar = "moving"
    time_limit_s: ClassVar = 30.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.2, "in the mouth"), (0.6, "half way down"), (1.0, "all the way down"))
    required_names: ClassVar = ("mount", "feed", "pipe")
    policy_actuators: ClassVar = ("feed",)
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="wall_contacts", quantity="contacts", target="pipe", slots=16),
    )
    features: ClassVar = (
        Feature("functional part to the middle of the mouth", "m", (-0.8, 0.8), "pipe_position, tip_position", size=3),
        Feature(f"depth in the pipe, 1 = {DEPTH_M:g} m", "", (-2, 1.25), "pipe_position, tip_position"),
        Feature(
            f"distance from the centre line, 1 = {1000 * INNER_M:g} mm", "", (0, 20), "pipe_position, tip_position"
        ),
        Feature("angle of the bend", "rad", (0.5, 1.1), "(parameters)"),
        Feature("feed", "m", (0, 0.35), "base_feed"),
        Feature(f"force on the walls, 1 = {FORCE_SCALE_N:g} N", "", (0, 8), "wall_contacts"),
    )
    hard: ClassVar = {"wall_n": 2.0}

    wall_n: float = 5.0
    """Force on the walls that may be passed only seldom [N]."""

    @property
    def objective(self) -> str:
        return (
            f"Get the tip at least {DEPTH_M:g} m deep into a pipe of {2000 * INNER_M:g} mm inner width for "
            f"{self.hold_s:g} s, pressing on its walls with less than {self.wall_n:g} N nearly all the time. The pipe "
            f"is {LENGTH_M:.2f} m long, opens upwards {MOUTH_DEPTH_M:g} m below the mount, goes straight down and then "
            f"bends by {span(BEND_DEG)} degrees with a radius of {BEND_RADIUS_M:g} m; the mount can move down by "
            f"{MOUTH_DEPTH_M:g} m at up to {FEED_M_S:g} m/s."
        )

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"Offset +-{1000 * OFFSET_M:g} mm to each side, bend {span(BEND_DEG)} deg, friction {span(FRICTION)}."
            ),
            progress="A fifth for coming to the mouth, the rest for depth.",
            success="Deep enough, inside, and hardly ever pressed too hard on the way.",
            violation=f"More than {MAX_WALL_N:g} N on the walls.",
        )

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        x, y = rng.uniform(-OFFSET_M, OFFSET_M, size=2)
        bend_rad = float(np.deg2rad(rng.uniform(*BEND_DEG)))
        walls = pipe_changes(bend_rad)
        friction = (rng.uniform(*FRICTION), *FRICTION_ELSE)
        rough = tuple(Change("geom_friction", wall.name, friction) for wall in walls if wall.field == "geom_pos")
        return Variation(
            (Change("body_pos", "pipe", (x, y, MOUTH_HEIGHT_M)), *walls, *rough), {"bend_rad": (bend_rad,)}
        )

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        depth_m, beside_m = _tip(readings)
        way = [readings["pipe_position"] - readings["tip_position"], depth_m / DEPTH_M, beside_m / INNER_M]
        force = readings.peak_contact_n("wall_contacts", together=True) / FORCE_SCALE_N
        return np.column_stack([*way, readings.parameters["bend_rad"], readings["base_feed"], force])

    def reset_state(self, readings: Readings) -> TaskState:
        """No step is counted."""
        return {"steps": np.zeros(readings.n), "pressed": np.zeros(readings.n)}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        """In how many control steps the walls were pressed too hard."""
        too_hard = readings.peak_contact_n("wall_contacts", together=True) >= self.wall_n
        return {"steps": state["steps"] + 1.0, "pressed": state["pressed"] + too_hard}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        depth_m, beside_m = _tip(readings)
        inside = (depth_m >= 0.0) & (beside_m <= INNER_M)
        distance = np.linalg.norm(readings["pipe_position"] - readings["tip_position"], axis=1)
        near = np.where(inside, 1.0, closeness(distance, margin=0.2))
        return 0.2 * near + 0.8 * np.where(inside, share(depth_m, DEPTH_M), 0.0)

    def violation(self, readings: Readings) -> FloatArray:
        return excess(readings.peak_contact_n("wall_contacts", together=True), MAX_WALL_N)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        depth_m, beside_m = _tip(readings)
        gentle = state["pressed"] <= SELDOM * state["steps"]
        return (depth_m >= DEPTH_M) & (beside_m <= INNER_M) & gentle


def _tip(readings: Readings) -> tuple[FloatArray, FloatArray]:
    """Return depth of the functional part and its distance from the centre line, (n,) each [m]."""
    point_m = readings["tip_position"] - readings["pipe_position"]
    return along_pipe_m(point_m, readings.parameters["bend_rad"][:, 0])


@dataclass(frozen=True)
class Wall:
    """One flat wall, a box in the frame of the pipe: origin in the mouth, +z out of it, bending towards +x."""

    half_size_m: tuple[float, float, float]
    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


def pipe_walls(bend_rad: float) -> tuple[Wall, ...]:
    """Return the walls of a pipe that ends turned by an angle, ring after ring from the mouth."""
    straight_m = LENGTH_M - BEND_RADIUS_M * bend_rad
    walls = [_wall(side, 0.0, straight_m / 2, straight_m / 2) for side in range(SIDES)]
    half_turn = bend_rad / BENT_RINGS / 2
    for ring in range(BENT_RINGS):
        for side in range(SIDES):
            angle = (2 * ring + 1) * half_turn
            # walls on the outside of the bend are longer: they meet at the same angles
            across_m = BEND_RADIUS_M - INNER_M * np.cos(_facing(side))
            walls.append(_wall(side, angle, straight_m, across_m * np.tan(half_turn)))
    return tuple(walls)


def pipe_changes(bend_rad: float) -> tuple[Change, ...]:
    """Return the changes that give the pipe of an environment another bend."""
    return tuple(
        change
        for number, wall in enumerate(pipe_walls(bend_rad), start=1)
        for change in (
            Change("geom_size", f"pipe_{number}", wall.half_size_m),
            Change("geom_pos", f"pipe_{number}", wall.position_m),
            Change("geom_quat", f"pipe_{number}", wall.quaternion),
        )
    )


def along_pipe_m(point_m: FloatArray, bend_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how deep points are in the pipe along its centre line, and how far beside that line.

    Args:
        point_m: Points in the frame of the pipe, (n, 3) [m].
        bend_rad: Angle by which each pipe turns, (n,) [rad].

    Returns:
        Depth, negative before the mouth and at most the pipe's length, and distance, (n,) each [m].
    """
    straight_m = LENGTH_M - BEND_RADIUS_M * bend_rad
    below_m = -point_m[:, 2] - straight_m
    inwards_m = BEND_RADIUS_M - point_m[:, 0]
    angle = np.clip(np.arctan2(below_m, inwards_m), 0.0, bend_rad)
    bent = below_m > 0.0
    depth_m = np.where(bent, straight_m + BEND_RADIUS_M * angle, -point_m[:, 2])
    sideways_m = np.where(bent, BEND_RADIUS_M - np.hypot(below_m, inwards_m), point_m[:, 0])
    return depth_m, np.hypot(sideways_m, point_m[:, 1])


def _facing(side: int) -> float:
    """Return the angle of a wall around the centre line, 0 on the inside of the bend."""
    return 2 * np.pi * (side + 0.5) / SIDES


def _wall(side: int, angle: float, straight_m: float, half_length_m: float) -> Wall:
    """Return one wall of the ring whose middle lies at an angle of the bend, behind a straight part."""
    facing, out_m = _facing(side), INNER_M + THICKNESS_M / 2
    inward = np.array([np.cos(angle), 0.0, np.sin(angle)])
    center = np.array([BEND_RADIUS_M, 0.0, -straight_m]) - BEND_RADIUS_M * inward
    center += out_m * (np.cos(facing) * inward + np.sin(facing) * np.array([0.0, 1.0, 0.0]))
    c, s, cf, sf = np.cos(angle / 2), np.sin(angle / 2), np.cos(facing / 2), np.sin(facing / 2)
    half_width_m = (INNER_M + THICKNESS_M) * np.tan(np.pi / SIDES)
    return Wall(
        half_size_m=(THICKNESS_M / 2, half_width_m, half_length_m),
        position_m=(float(center[0]), float(center[1]), float(center[2])),
        # turned about y by -angle, then about its own z by the facing
        quaternion=(float(c * cf), float(-s * sf), float(-s * cf), float(c * sf)),
    )
