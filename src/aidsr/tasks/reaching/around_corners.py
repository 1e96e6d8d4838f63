"""Get the functional part around two corners to a plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import approach, excess, share
from aidsr.tasks.task import FORCE_SCALE_N, Criteria, Edits, Feature, Task, TaskState
from aidsr.tasks.variation import Change, Variation, shift_words

HEIGHT_M = 0.88
DEPTH_M = 0.42
"""Depth of the box's lid below the mount at the start [m]."""
FEED_M = 0.40
FEED_M_S = 0.05
SHELF_M = 0.17
"""Depth of the second opening below the first [m]."""
FAR_M = 0.13
"""Inner half width of the box along its forward axis, where the openings end [m]."""
HALF_DEPTH_M = 0.09
"""Inner half width of the box in the other direction [m]."""
PLATE_M = np.array([-0.07, 0.0, -0.246])
"""Middle of the plate's top in the frame of the box [m]."""
OFFSET_M = 0.01
YAW_DEG = 15.0
CONTACT_N = 0.5
MAX_WALL_N = 20.0
_PLATE_HALF_SIZE_M = np.array([0.045, 0.075, 0.0])
"""Half sizes of the part of the plate's top that progress leads to [m]."""
_LIMITS_M = np.array([FAR_M, HALF_DEPTH_M])


@dataclass(frozen=True)
class AroundCorners(Task):
    """The functional part passes an opening on one side, then one on the other, and comes down on a plate.

    Source: our choice, after inspection through offset openings. A body that bends in one piece comes through the
    first opening and not through the second.
    """

    name: ClassVar = "reaching/around_corners"
    base: ClassVar = "moving"
    time_limit_s: ClassVar = 30.0
    hold_s: ClassVar = 0.3
    stages: ClassVar = ((0.4, "in the first opening"), (0.7, "in the second one"), (1.0, "on the plate"))
    decisive: ClassVar = "on the plate"
    required_names: ClassVar = ("mount", "feed", "box", "lid", "shelf", "plate")
    policy_actuators: ClassVar = ("feed",)
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="tip_force", quantity="contact_force", target="plate", part="functional_part"),
        TaskSensor(name="wall_contacts", quantity="contacts", target="box", slots=16),
    )
    features: ClassVar = (
        Feature("functional part in the frame of the box", "m", (-0.5, 0.5), "box_*, tip_position", size=3),
        Feature(
            "functional part to the next opening, or to the plate", "m", (-0.5, 0.5), "box_*, tip_position", size=3
        ),
        Feature("direction of the first opening, world x and y", "", (-1, 1), "box_forward", size=2),
        Feature("feed", "m", (0, FEED_M), "feed_position"),
        Feature(f"force on the plate, 1 = {FORCE_SCALE_N:g} N", "", (0, 4), "tip_force"),
        Feature(f"force on the walls, 1 = {FORCE_SCALE_N:g} N", "", (0, 8), "wall_contacts"),
    )
    hard: ClassVar = {"overlap_m": 0.035}

    overlap_m: float = 0.02
    """How far lid and shelf each reach beyond the middle [m]."""

    @property
    def objective(self) -> str:
        width_mm = 1000 * (FAR_M - self.overlap_m)
        return (
            f"Steer the tip around a pair of corners onto a plate at the bottom of a box and bear on it with at least "
            f"{CONTACT_N:g} N for {self.hold_s:g} s: through a window of {width_mm:g} mm in its lid, which begins "
            f"{1000 * self.overlap_m:g} mm beside the base's axis, and {1000 * SHELF_M:g} mm further down through an "
            f"equal one on the opposite side. The lid is {DEPTH_M:g} m below the base, the plate {-PLATE_M[2]:.2f} m "
            f"below the lid, and the base is fed down by up to {FEED_M:g} m at {FEED_M_S:g} m/s."
        )

    @property
    def edits(self) -> Edits:
        half_m, middle_m = (FAR_M + self.overlap_m) / 2, (FAR_M - self.overlap_m) / 2
        size = (half_m, HALF_DEPTH_M, 0.004)
        return {
            "geom/lid": {"size": size, "pos": (-middle_m, 0.0, 0.0)},
            "geom/shelf": {"size": size, "pos": (middle_m, 0.0, -SHELF_M)},
        }

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"The first opening is on the side of +x or of -x, the box turned by up to {YAW_DEG:g} deg about the "
                f"vertical and moved by up to {1000 * OFFSET_M:g} mm along x and along y."
            ),
            progress=(
                "Four tenths for coming to the first opening, three for coming to the second, two for coming to the "
                "plate, one for the force on it."
            ),
            success=f"The functional part is on the plate with at least {CONTACT_N:g} N.",
            violation=f"More than {MAX_WALL_N:g} N on the box.",
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        return (Mark(element="geom", name="plate"),)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        x, y = rng.uniform(-OFFSET_M, OFFSET_M, size=2)
        yaw_deg, other_side = rng.uniform(-YAW_DEG, YAW_DEG), bool(rng.integers(2))
        half = np.deg2rad(yaw_deg + 180.0 * other_side) / 2
        turn = (np.cos(half), 0.0, 0.0, np.sin(half))
        changes = (Change("body_pos", "box", (x, y, HEIGHT_M - DEPTH_M)), Change("body_quat", "box", turn))
        side = "-x" if other_side else "+x"
        words = f"first opening on the side of {side}, box turned {yaw_deg:+.1f} deg and moved {shift_words(x, y)}"
        return Variation(changes, words=words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        tip_m = _in_box_m(readings)
        return np.column_stack(
            [
                tip_m,
                self._next_m(tip_m) - tip_m,
                readings["box_forward"][:, :2],
                readings["feed_position"],
                readings.force_n("tip_force") / FORCE_SCALE_N,
                readings.peak_contact_n("wall_contacts", together=True) / FORCE_SCALE_N,
            ]
        )

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        tip_m = _in_box_m(readings)
        near = approach(np.linalg.norm(self._next_m(tip_m) - tip_m, axis=1), within=0.01)
        bears = share(readings.mean_force_n("tip_force"), CONTACT_N)
        passed = openings_passed(tip_m)
        return np.asarray(
            np.select([passed == 0, passed == 1], [0.4 * near, 0.4 + 0.3 * near], 0.7 + 0.2 * near + 0.1 * bears)
        )

    def violation(self, readings: Readings) -> FloatArray:
        return excess(readings.peak_contact_n("wall_contacts", together=True), MAX_WALL_N)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        through = openings_passed(_in_box_m(readings)) == 2
        return np.asarray(through & (readings.mean_force_n("tip_force") >= CONTACT_N))

    def _next_m(self, tip_m: FloatArray) -> FloatArray:
        """Return the next place of the functional part on its way, in the frame of the box, (n, 3) [m]."""
        middle_m = (FAR_M + self.overlap_m) / 2
        above = np.clip(tip_m - PLATE_M, -_PLATE_HALF_SIZE_M, _PLATE_HALF_SIZE_M) + PLATE_M
        openings = np.array([[middle_m, 0.0, 0.0], [-middle_m, 0.0, -SHELF_M]])
        passed = openings_passed(tip_m)
        return np.asarray(np.where(passed[:, None] == 2, above, openings[np.minimum(passed, 1)]))


def openings_passed(tip_m: FloatArray) -> np.ndarray:
    """Return the number of openings that the functional part has passed: 0, 1 or 2, (n,).

    Args:
        tip_m: Position of the functional part in the frame of the box, (n, 3) [m].
    """
    inside = (np.abs(tip_m[:, :2]) < _LIMITS_M).all(axis=1)
    return np.where(inside, (tip_m[:, 2] < 0.0).astype(np.intp) + (tip_m[:, 2] < -SHELF_M), 0)


def _in_box_m(readings: Readings) -> FloatArray:
    """Return the position of the functional part in the frame of the box, (n, 3) [m]."""
    point_m = readings["tip_position"] - readings["box_position"]
    axes = np.stack([readings["box_forward"], readings["box_left"]], axis=1)
    return np.concatenate([np.einsum("nk,njk->nj", point_m, axes), point_m[:, 2:]], axis=1)
