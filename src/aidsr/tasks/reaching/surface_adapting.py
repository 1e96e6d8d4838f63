"""Lie along a curved surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.condition import Condition
from aidsr.tasks.gentleness import SELDOM, after_touch, is_gentle, untouched
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import TOUCH_N, BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess, share
from aidsr.tasks.task import FORCE_SCALE_N, Criteria, Feature, Task, TaskState, span
from aidsr.tasks.variation import Change, Variation

MOUNT_HEIGHT_M = 0.7
AXIS_HEIGHT_M = 0.65
GAP_M, GAP_SPREAD_M = 0.13, 0.03
"""Distance from the line straight down to the surface's nearest side, and its largest variation [m]."""
RADIUS_M = (0.08, 0.25)
HALF_WIDTH_M = 0.12
WAVE_M = 0.008
"""Height of the waves [m], less than the gap that still counts as lying on the surface."""
RODS_DEG = np.arange(-80.0, 81.0, 20.0)
ROD_M = 0.02
"""Rods that form the waves: their angles around the axis [deg], and their radius [m]."""

NEAR_LENGTHS = 0.03
"""Largest gap at which a part of the body lies on the surface, as a share of the robot's length."""
SPREAD_LENGTHS = 0.15
"""Smallest distance around the curve between the outermost contacts, as a share of the robot's length. Our choice: two
neighbours of the 15 segments of a built-in arm are 7 % apart, and such arms that were found by search and lie on the
surface with 40 to 45 % of their length touched over 17 %."""
MAX_FORCE_N = 5.0


@dataclass(frozen=True)
class SurfaceAdapting(Task):
    """As much of the body as possible lies along half a cylinder, smooth or with waves.

    Source: our choice. No accepted threshold was found; 3 % of the length is a third of a body's usual thickness.
    """

    name: ClassVar = "reaching/surface_adapting"
    base: ClassVar = "fixed"
    time_limit_s: ClassVar = 15.0
    hold_s: ClassVar = 1.0
    stages: ClassVar = ((0.35, "near the surface"), (0.6, "lying on it in part"), (1.0, "lying on it"))
    needs_outline: ClassVar = True
    required_names: ClassVar = ("mount", "surface")
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="surface_contacts", quantity="contacts", target="surface", slots=16),
    )
    features: ClassVar = (
        Feature("functional part to the cylinder's axis", "m", (-1, 1), "surface_position, tip_position", size=3),
        Feature("direction in which the half cylinder looks", "", (-1, 1), "surface_back", size=3),
        Feature(f"radius, 1 = {RADIUS_M[1]:g} m", "", (0.3, 1), "(parameters)"),
        Feature("share of the body that lies on it", "", (0, 1), "(outline)"),
        Feature("mean gap between body and surface", "m", (0, 1), "(outline)"),
        Feature(f"strongest contact, 1 = {FORCE_SCALE_N:g} N", "", (0, 8), "surface_contacts"),
        Feature("spread of the contacts around the curve, 1 = enough", "", (0, 4), "surface_contacts"),
    )
    hard: ClassVar = {"share_on_surface": 0.7}

    share_on_surface: float = 0.5

    @property
    def objective(self) -> str:
        depth_m = MOUNT_HEIGHT_M - AXIS_HEIGHT_M
        return (
            f"Lie along a rounded surface for {self.hold_s:g} s with at least {100 * self.share_on_surface:g} % of the "
            f"body's length, each part within {100 * NEAR_LENGTHS:g} % of that length, and touch it at two places or "
            f"more, of which the outermost two are at least {100 * SPREAD_LENGTHS:g} % of that length apart around the "
            f"curve; a contact may be stronger than "
            f"{MAX_FORCE_N:g} N in at most {100 * SELDOM:g} % of the time in contact. The surface is half a cylinder "
            f"of {span(RADIUS_M)} m radius, smooth or with {1000 * WAVE_M:g} mm waves; its level axis is {depth_m:g} m "
            f"below the fixed mount and its nearest side {GAP_M - GAP_SPREAD_M:.2f} to {GAP_M + GAP_SPREAD_M:.2f} m "
            "from the line straight down, to the left or to the right."
        )

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"Radius {span(RADIUS_M)} m, distance +-{1000 * GAP_SPREAD_M:g} mm, smooth or with waves, on either "
                f"side. The axis lies along y; the round side is {2 * HALF_WIDTH_M:g} m wide and looks towards the "
                "line straight down, 45 deg downwards. Waves are rods along y, one every "
                f"{RODS_DEG[1] - RODS_DEG[0]:g} deg, that rise {1000 * WAVE_M:g} mm above the cylinder between them: "
                "radius and distance are those of their tops, and gaps are measured to a smooth cylinder of that "
                "radius."
            ),
            progress=(
                "Two fifths for the body's nearness to the surface, two fifths for the share of it that lies there, a "
                "fifth for the spread of its contacts."
            ),
            success=(
                f"Enough of the body lies on the surface and presses on it, with {TOUCH_N:g} N or more at each place "
                f"that counts, far enough apart; hardly ever was a contact of more than {MAX_FORCE_N:g} N. The "
                "share is of all solid parts, laid end to end: a second limb or a post that lies elsewhere counts "
                "against it. Distances are shares of the longest way from the root to a tip, or of the moving parts' "
                "diagonal where that is shorter. The flat back of the half cylinder does not count as its surface."
            ),
            violation=f"A contact of more than {MAX_FORCE_N:g} N.",
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        return (Mark(element="geom", name="surface_round"),)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        radius_m, gap_m = rng.uniform(*RADIUS_M), GAP_M + rng.uniform(-GAP_SPREAD_M, GAP_SPREAD_M)
        side, waves = (1.0, -1.0)[rng.integers(2)], bool(rng.integers(2))
        place_m = (side * (gap_m + radius_m), 0.0, AXIS_HEIGHT_M)
        words = (
            f"on the side of {'+x' if side > 0 else '-x'}, radius {1000 * radius_m:.0f} mm, {1000 * gap_m:.0f} mm "
            f"away, {'with waves' if waves else 'smooth'}"
        )
        return Variation(half_cylinder(place_m, radius_m, waves=waves), {"radius_m": (radius_m,)}, words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        return np.column_stack(
            [
                readings["surface_position"] - readings["tip_position"],
                -readings["surface_back"],
                readings.parameters["radius_m"] / RADIUS_M[1],
                _share_on_surface(readings),
                np.clip(gaps_m(readings), 0.0, 1.0).mean(axis=1),
                readings.contacts("surface_contacts").force_n.max(axis=1) / FORCE_SCALE_N,
                spread_m(readings) / (SPREAD_LENGTHS * readings.length_m),
            ]
        )

    def reset_state(self, readings: Readings) -> TaskState:
        return untouched(readings.n)

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        return after_touch(state, readings.peak_contact_n("surface_contacts"), MAX_FORCE_N, self.control_dt_s)

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        outline = readings.body
        near = closeness(gaps_m(readings), within=NEAR_LENGTHS * readings.length_m, margin=0.2) @ outline.length_share
        touching = share(spread_m(readings), SPREAD_LENGTHS * readings.length_m)
        return 0.4 * near + 0.4 * share(_share_on_surface(readings), self.share_on_surface) + 0.2 * touching

    def conditions(self, readings: Readings, state: TaskState) -> tuple[Condition, ...]:
        too_hard = state["too_hard_s"] / np.maximum(state["touching_s"], self.control_dt_s)
        apart = 1000 * SPREAD_LENGTHS * readings.length_m
        return (
            Condition("share of the body that lies on the surface", _share_on_surface(readings), self.share_on_surface),
            Condition("outermost contacts apart around the curve", 1000 * spread_m(readings), apart, unit="mm"),
            Condition(
                f"share of the time in contact with more than {MAX_FORCE_N:g} N", too_hard, SELDOM, at_least=False
            ),
        )

    def violation(self, readings: Readings) -> FloatArray:
        return excess(readings.peak_contact_n("surface_contacts"), MAX_FORCE_N)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        spread = spread_m(readings) >= SPREAD_LENGTHS * readings.length_m
        return (_share_on_surface(readings) >= self.share_on_surface) & spread & is_gentle(state)


def _share_on_surface(readings: Readings) -> FloatArray:
    """Return the share of the body's length that lies on the surface, (n,)."""
    on = gaps_m(readings) <= NEAR_LENGTHS * readings.length_m
    return np.asarray(on @ readings.body.length_share)


def spread_m(readings: Readings) -> FloatArray:
    """Return the distance around the curve between the outermost contacts on the surface, (n,) [m]."""
    contacts, back = readings.contacts("surface_contacts"), readings["surface_back"]
    from_axis = contacts.position_m - readings["surface_position"][:, None]
    behind = np.einsum("nsk,nk->ns", from_axis, back)
    across = np.einsum("nsk,nk->ns", from_axis, _across(back))
    counts = (contacts.force_n >= TOUCH_N) & (behind < 0.0)
    angle = np.arctan2(across, -behind)
    high, low = (np.where(counts, sign * angle, -np.inf).max(axis=1) for sign in (1.0, -1.0))
    return np.where(counts.any(axis=1), high + low, 0.0) * readings.parameters["radius_m"][:, 0]


def half_cylinder(place_m: tuple[float, float, float], radius_m: float, *, waves: bool) -> tuple[Change, ...]:
    """Return the changes that place the surface and set its radius.

    Args:
        place_m: Position of the cylinder's axis, which is parallel to y [m]; the round side faces x = 0, 45 degrees
            downwards.
        radius_m: Radius to the tops of the waves [m].
        waves: Whether the surface has waves.
    """
    half = np.deg2rad(45.0) / 2
    turn = (np.cos(half), 0.0, -np.sin(half), 0.0) if place_m[0] > 0 else (0.0, np.sin(half), 0.0, np.cos(half))
    rods_m = radius_m - (1 if waves else 2) * ROD_M
    angles = np.deg2rad(RODS_DEG)
    rods = np.column_stack([-rods_m * np.cos(angles), np.zeros_like(angles), rods_m * np.sin(angles)])
    return (
        Change("body_pos", "surface", place_m),
        Change("body_quat", "surface", turn),
        Change("geom_size", "surface_round", (radius_m - WAVE_M * waves, HALF_WIDTH_M, 0.0)),
        # a millimetre narrower, because two faces in one plane flicker in pictures
        Change("geom_size", "surface_block", (radius_m / 2, HALF_WIDTH_M - 0.001, radius_m)),
        Change("geom_pos", "surface_block", (radius_m / 2, 0.0, 0.0)),
        *(Change("geom_pos", f"ripple_{number}", tuple(rod)) for number, rod in enumerate(rods, start=1)),
    )


def gaps_m(readings: Readings) -> FloatArray:
    """Return the gap between each sphere of the robot's outline and the surface, (n, p) [m]; 1 beside or behind it."""
    outline, back = readings.body, readings["surface_back"]
    from_axis = outline.center_m - readings["surface_position"][:, None]
    behind = np.einsum("npk,nk->np", from_axis, back)
    distance = np.hypot(behind, np.einsum("npk,nk->np", from_axis, _across(back)))
    gaps = np.maximum(distance - readings.parameters["radius_m"] - outline.radius_m, 0.0)
    return np.where((behind > 0.0) | (np.abs(from_axis[:, :, 1]) > HALF_WIDTH_M), 1.0, gaps)


def _across(back: FloatArray) -> FloatArray:
    """Return the tangent of the curve in the middle of its round side, (n, 3)."""
    return np.stack([-back[:, 2], np.zeros(len(back)), back[:, 0]], axis=-1)
