"""Get through a low tunnel with a bend."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.locomotion.base import OUT_OF_LANE, LaneTask, box_between, outline_in_lane
from aidsr.tasks.locomotion.course import starts_beyond
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import excess, share
from aidsr.tasks.task import FRICTION_ELSE, Criteria, Edits, Feature, TaskState, span
from aidsr.tasks.variation import Change, Variation, turn_words

ENTRANCE_M = 0.35
"""Position of the entrance along the lane [m]: a robot of the usual size starts clear of it."""
LENGTH_M = 0.60
HALF_LENGTH_M = LENGTH_M / 2
HALF_WIDTH_M = 0.06
"""Half of the inner width [m]."""
WALL_M = 0.008
PORTAL_M = (0.6, 0.3)
"""Half width and height of the wall around the entrance [m]."""
BEND_DEG = (15.0, 25.0)
"""Range of the bend to either side [deg]. Our choice: in 144 episodes of rings under random actions at 0 to 25 deg, all
that succeeded had less than 10 deg; at 15 deg and more, 1 of 160 succeeded."""
HEIGHT_M = 0.10
HEIGHT_FACTOR = (0.9, 1.1)
FRICTION = (0.6, 1.2)
MAX_WALL_N = 20.0
STARTS_BEYOND = "A part of the robot starts in the tunnel."


@dataclass(frozen=True)
class Tunnel(LaneTask):
    """The whole robot gets from before the entrance out of the far end.

    Source: our choice, after EvoGym's caves (0.6 to 1.2 body lengths high; Bhatia et al. 2021).
    """

    name: ClassVar = "locomotion/tunnel"
    time_limit_s: ClassVar = 50.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.1, "moving forward"), (0.4, "in the tunnel"), (1.0, "out of the far end"))
    needs_outline: ClassVar = True
    required_names: ClassVar = ("mount", "ground", "lane", "tunnel")
    sensors: ClassVar = (
        *LaneTask.sensors,
        TaskSensor(name="wall_contacts", quantity="contacts", target="tunnel", slots=16),
    )
    features: ClassVar = (
        *LaneTask.features,
        Feature("rearmost part along the tunnel", "m", (-1, 1.5), "(outline)"),
        Feature("foremost part along the tunnel", "m", (-1, 1.5), "(outline)"),
        Feature("bend, to the left", "rad", (-0.44, 0.44), "(parameters)"),
        Feature(f"height, 1 = {HEIGHT_M:.2f} m", "", (0.6, 1.1), "(parameters)"),
    )
    hard: ClassVar = {"height_m": 0.07}

    height_m: float = HEIGHT_M
    """Height of the tunnel [m]; episodes vary it by up to 10 %."""

    @property
    def objective(self) -> str:
        return (
            f"Get through a tunnel, {2 * HALF_WIDTH_M:g} m wide, about {self.height_m:g} m high and {LENGTH_M:g} m "
            f"long, that begins {ENTRANCE_M:g} m ahead and turns by {span(BEND_DEG)} degrees to either side in the "
            "middle, until the whole body is out of its far end."
        )

    @property
    def edits(self) -> Edits:
        boxes = tunnel_changes(0.0, self.height_m)
        return {f"geom/{box.name}": {box.field.removeprefix("geom_"): box.value} for box in boxes}

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"Bend of {span(BEND_DEG)} deg to either side, height +-{100 * (HEIGHT_FACTOR[1] - 1):g} %, friction "
                f"of the ground {span(FRICTION)}."
            ),
            progress="Way of the rearmost part to the far end.",
            success="The whole body is out of the far end.",
            violation=f"A mean force of more than {MAX_WALL_N:g} N on the walls.",
            failure=f"{STARTS_BEYOND} {OUT_OF_LANE}",
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        # the mark is in the middle of the tunnel, beside the wall, whose length a bend changes by up to 14 mm
        beyond_m = HALF_LENGTH_M / 2 + HALF_WIDTH_M / 2
        place = (beyond_m, -HALF_WIDTH_M - WALL_M / 2, 0.0)
        return (Mark(element="geom", name="left_2", at_m=place, radius_m=HALF_WIDTH_M / 2),)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        bend_rad = float(np.deg2rad(rng.choice([-1.0, 1.0]) * rng.uniform(*BEND_DEG)))
        height_m = self.height_m * rng.uniform(*HEIGHT_FACTOR)
        friction = rng.uniform(*FRICTION)
        rough = Change("geom_friction", "ground", (friction, *FRICTION_ELSE))
        bends = turn_words(np.rad2deg(bend_rad))
        words = f"bends {bends}, {1000 * height_m:.0f} mm high, friction of the ground {friction:.2f}"
        parameters = {"bend_rad": (bend_rad,), "height_m": (height_m,)}
        return Variation((*tunnel_changes(bend_rad, height_m), rough), parameters, words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        ends = [_rear_m(readings), readings.body.foremost_m(_outline_along_m(readings))]
        height = readings.parameters["height_m"] / HEIGHT_M
        base = super().observe(readings, state)
        return np.column_stack([base, *ends, readings.parameters["bend_rad"], height])

    def reset_state(self, readings: Readings) -> TaskState:
        return {"rear": _rear_m(readings), "beyond": starts_beyond(readings, ENTRANCE_M)}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        return share(_rear_m(readings) - state["rear"], LENGTH_M - state["rear"])

    def violation(self, readings: Readings) -> FloatArray:
        force_n = readings.peak_contact_n("wall_contacts", mean_over_s=self.control_dt_s, together=True)
        return excess(force_n, MAX_WALL_N)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        return _rear_m(readings) >= LENGTH_M

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        return {**super().losses(readings, state), STARTS_BEYOND: state["beyond"] > 0.0}


def _outline_along_m(readings: Readings) -> FloatArray:
    """Return the positions of the outline's spheres along the tunnel, 0 at its entrance, (n, p) [m]."""
    from_entrance = outline_in_lane(readings)[:, :, :2] - [ENTRANCE_M, 0.0]
    return along_tunnel_m(from_entrance, readings.parameters["bend_rad"])


def _rear_m(readings: Readings) -> FloatArray:
    """Return the position of the rearmost part along the tunnel, (n,) [m]."""
    return readings.body.rearmost_m(_outline_along_m(readings))


def tunnel_changes(bend_rad: float, height_m: float) -> tuple[Change, ...]:
    """Return the changes that give the tunnel a bend, positive to the left, and a height."""
    # a wall on the outside of the bend has to be longer for the halves to meet
    longer_m = (HALF_WIDTH_M + WALL_M / 2) * np.tan(bend_rad / 2)
    outer_m, top_m, (wide_m, high_m) = HALF_WIDTH_M + WALL_M, height_m + WALL_M, PORTAL_M
    turn = (np.cos(bend_rad / 2), 0.0, 0.0, np.sin(bend_rad / 2))
    changes = [
        *box_between("portal_left", (-WALL_M, HALF_WIDTH_M, 0.0), (0.0, wide_m, high_m)),
        *box_between("portal_right", (-WALL_M, -wide_m, 0.0), (0.0, -HALF_WIDTH_M, high_m)),
        *box_between("portal_top", (-WALL_M, -HALF_WIDTH_M, height_m), (0.0, HALF_WIDTH_M, high_m)),
        *box_between("left_1", (0.0, HALF_WIDTH_M, 0.0), (HALF_LENGTH_M - longer_m, outer_m, height_m)),
        *box_between("right_1", (0.0, -outer_m, 0.0), (HALF_LENGTH_M + longer_m, -HALF_WIDTH_M, height_m)),
        *box_between("roof_1", (0.0, -outer_m, height_m), (HALF_LENGTH_M + abs(longer_m), outer_m, top_m)),
    ]
    second = [
        *box_between("left_2", (longer_m, HALF_WIDTH_M, 0.0), (HALF_LENGTH_M, outer_m, height_m)),
        *box_between("right_2", (-longer_m, -outer_m, 0.0), (HALF_LENGTH_M, -HALF_WIDTH_M, height_m)),
        *box_between("roof_2", (-abs(longer_m), -outer_m, height_m), (HALF_LENGTH_M, outer_m, top_m)),
    ]
    for change in second:
        if change.field == "geom_pos":
            x, y, z = change.value
            place = (
                HALF_LENGTH_M + x * np.cos(bend_rad) - y * np.sin(bend_rad),
                x * np.sin(bend_rad) + y * np.cos(bend_rad),
                z,
            )
            changes += [Change("geom_pos", change.name, place), Change("geom_quat", change.name, turn)]
        else:
            changes.append(change)
    return tuple(changes)


def along_tunnel_m(point_m: FloatArray, bend_rad: FloatArray) -> FloatArray:
    """Return the positions of points along the tunnel's middle line, (n, p) [m].

    Before the entrance, the position is the negative distance to the middle of the entrance: a body that turns sideways
    in front of it comes no nearer.

    Args:
        point_m: Horizontal positions relative to the entrance, along the lane and to its left, (n, p, 2) [m].
        bend_rad: Bend of each tunnel, positive to the left, (n, 1) [rad].
    """
    x, y = point_m[:, :, 0] - HALF_LENGTH_M, point_m[:, :, 1]
    beyond = x * np.cos(bend_rad) + y * np.sin(bend_rad)
    # the halves meet in the plane that bisects their angle
    second = x * np.cos(bend_rad / 2) + y * np.sin(bend_rad / 2) > 0.0
    along = np.where(second, HALF_LENGTH_M + beyond, point_m[:, :, 0])
    return np.where(along < 0.0, -np.linalg.norm(point_m, axis=2), along)
