"""Brush a wall with a steady force."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.gentleness import SELDOM, after_touch, is_gentle, untouched
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import TOUCH_N, BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess, share
from aidsr.tasks.task import Criteria, Feature, Task, TaskState
from aidsr.tasks.variation import Change, Variation, turn_words

CENTER_M = (0.0, 0.25, 0.30)
OFFSET_M, TILT_DEG = 0.015, 5.0
WALL_M = 0.30
"""Width and height of the wall [m]."""
BAND_N = (0.3, 1.0)
"""Range of the force [N]: strong enough to brush and too weak to scratch."""
STEADY = 0.6
"""Smallest share of the time in contact in which the force must be in the band."""
STROKE_S = 0.1
"""Time for which the force must be in the band on a cell to brush it [s]."""
MAX_FORCE_N = 3.0
NEAR_M = 0.2
"""Scale on which coming nearer to the wanted cell is rewarded [m]: cells are up to 0.24 m apart."""


@dataclass(frozen=True)
class ForceControlledBrushing(Task):
    """The functional part goes over a wall cell by cell, row by row from the top, with a force in a narrow band.

    Source: our choice, after robosuite's Wipe (force window and coverage; Zhu et al. 2020).
    """

    name: ClassVar = "manipulation/force_controlled_brushing"
    base: ClassVar = "moving"
    time_limit_s: ClassVar = 60.0
    hold_s: ClassVar = 0.5
    unchanged_since: ClassVar = 8
    stages: ClassVar = ((0.04, "at the wall"), (0.3, "brushing"), (1.0, "all brushed"))
    required_names: ClassVar = ("mount", "wall", "base_x", "base_z")
    policy_actuators: ClassVar = ("base_x", "base_z")
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="brush_contacts", quantity="contacts", target="wall", part="functional_part", slots=4),
        TaskSensor(name="robot_contacts", quantity="contacts", target="wall", slots=8),
    )
    features: ClassVar = (
        Feature("functional part to the wanted cell", "m", (-0.8, 0.8), "wall_*, tip_position, (state)", size=3),
        Feature("outward direction of the wall", "", (-1, 1), "wall_back", size=3),
        Feature("force on the wall, 1 = 1 N", "", (0, 40), "brush_contacts"),
        Feature("1 while the force is in the band", "", (0, 1), "brush_contacts"),
        Feature("share of cells brushed", "", (0, 1), "(state)"),
        Feature("share of the contact time in the band", "", (0, 1), "(state)"),
        Feature("base sideways", "m", (-0.05, 0.05), "base_x_position"),
        Feature("base up and down", "m", (-0.05, 0.05), "base_z_position"),
    )
    hard: ClassVar = {"cells_a_side": 10, "coverage": 0.9}

    cells_a_side: int = 5
    coverage: float = 0.7
    """Share of the cells that must be brushed."""

    @property
    def objective(self) -> str:
        n, size_mm = self.cells_a_side, 1000 * WALL_M / self.cells_a_side
        return (
            f"Brush an upright wall of {WALL_M:g} x {WALL_M:g} m: the functional part, whose contact alone counts, has "
            f"to press on at least {100 * self.coverage:g} % of its {n} x {n} cells ({size_mm:g} mm each), "
            "one after the other, row by row from the top, to and fro, with "
            f"{BAND_N[0]:.1f} to {BAND_N[1]:.1f} N for {STROKE_S:g} s each and stay in that range for "
            f"{100 * STEADY:g} % of its time in contact; the whole robot may press with more than {MAX_FORCE_N:g} N in "
            f"at most {100 * SELDOM:g} % of its time in contact. The mount faces the wall's middle from "
            f"{CENTER_M[1]:g} m and moves 0.05 m up, down and to either side."
        )

    @property
    def criteria(self) -> Criteria:
        asked = math.ceil(self.coverage * self.cells_a_side**2)
        return Criteria(
            variation=(
                f"Wall +-{1000 * OFFSET_M:g} mm nearer or farther, tilted by up to +-{TILT_DEG:g} deg about both of "
                "its edges."
            ),
            progress=(
                "Cells brushed in order, weighted by how steady the force was; a twentieth for coming to the wanted "
                "cell."
            ),
            success=(
                f"The first {asked} cells are brushed, beginning at the top left (-x); none can be skipped, since a "
                "cell is brushed only in its turn. The force is in the band most of the time and hardly ever more than "
                f"{MAX_FORCE_N:g} N. A force is that of all contacts together, at right angles to the wall."
            ),
            violation=f"A peak of more than {MAX_FORCE_N:g} N.",
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        return (Mark(element="geom", name="wall"),)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        x, y, z = CENTER_M
        tip_deg, turn_deg = rng.uniform(-TILT_DEG, TILT_DEG, size=2)
        tip, turn = np.deg2rad([tip_deg, turn_deg]) / 2
        tipped, turned = (np.cos(tip), np.sin(tip)), (np.cos(turn), np.sin(turn))
        tilt = (tipped[0] * turned[0], tipped[1] * turned[0], tipped[1] * turned[1], tipped[0] * turned[1])
        offset_m = rng.uniform(-OFFSET_M, OFFSET_M)
        place = Change("body_pos", "wall", (x, y + offset_m, z))
        words = (
            f"wall {1000 * abs(offset_m):.1f} mm {'farther' if offset_m >= 0 else 'nearer'}, its top tilted "
            f"{abs(tip_deg):.1f} deg {'nearer' if tip_deg >= 0 else 'farther'}, turned {turn_words(turn_deg)}"
        )
        return Variation((place, Change("body_quat", "wall", tilt)), words=words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        force_n = self._force_n(readings)
        brushing = [force_n, self._in_band(readings), brushed(state).mean(axis=1), steady(state)]
        base_m = [readings["base_x_position"], readings["base_z_position"]]
        return np.column_stack(
            [to_wanted_m(readings, state, self.cells_a_side), -readings["wall_back"], *brushing, *base_m]
        )

    def reset_state(self, readings: Readings) -> TaskState:
        cells = np.zeros((readings.n, self.cells_a_side**2))
        times_s = {"band_s": np.zeros(readings.n), "contact_s": np.zeros(readings.n)}
        return {"cells_s": cells, **times_s, **untouched(readings.n)}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        force_n, dt = self._force_n(readings), self.control_dt_s
        band = self._in_band(readings)
        touched = cell_of(readings, readings.contacts("brush_contacts").position_m[:, 0], self.cells_a_side)
        cells_s = state["cells_s"].copy()
        in_turn = touched == np.argmin(brushed(state), axis=1)
        cells_s[np.arange(readings.n), touched] += dt * (band & in_turn)
        contact_s = state["contact_s"] + dt * (force_n > TOUCH_N)
        pressing = after_touch(state, self._robot_n(readings), MAX_FORCE_N, dt)
        return {"cells_s": cells_s, "band_s": state["band_s"] + dt * band, "contact_s": contact_s, **pressing}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        covered = done(state, self.coverage) * share(steady(state), STEADY)
        near = closeness(np.linalg.norm(to_wanted_m(readings, state, self.cells_a_side), axis=1), margin=NEAR_M)
        return 0.95 * covered + 0.05 * np.where(covered < 1.0, near, 1.0)

    def violation(self, readings: Readings) -> FloatArray:
        return excess(self._robot_n(readings), MAX_FORCE_N)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        del readings
        enough = done(state, self.coverage) >= 1.0
        return np.asarray(enough & (steady(state) >= STEADY) & is_gentle(state))

    def _robot_n(self, readings: Readings) -> FloatArray:
        """Return the largest total force of the robot's contacts on the wall during a control step, (n,) [N]."""
        return readings.all_contacts_n("robot_contacts")

    def _force_n(self, readings: Readings) -> FloatArray:
        """Return the mean force of the functional part on the wall over a control step, (n,) [N].

        Contacts beyond the sensor's slots do not count.
        """
        return readings.peak_contact_n("brush_contacts", mean_over_s=self.control_dt_s, together=True)

    def _in_band(self, readings: Readings) -> BoolArray:
        """Return whether the functional part presses hard enough to brush and too gently to scratch, (n,).

        With more contacts than slots the force is known between two bounds, and both must be in the band.
        """
        most_n = readings.all_contacts_n("brush_contacts", mean_over_s=self.control_dt_s)
        return (self._force_n(readings) >= BAND_N[0]) & (most_n <= BAND_N[1])


def brushed(state: TaskState) -> BoolArray:
    """Return which cells are brushed, (n, cells)."""
    return state["cells_s"] >= STROKE_S


def in_order(state: TaskState) -> FloatArray:
    """Return how many cells are brushed before the first one that is not, (n,)."""
    return np.asarray(np.cumprod(brushed(state), axis=1).sum(axis=1), dtype=np.float64)


def done(state: TaskState, coverage: float) -> FloatArray:
    """Return the share of the required cells that are brushed, counted in order, (n,)."""
    return share(in_order(state), coverage * brushed(state).shape[1])


def steady(state: TaskState) -> FloatArray:
    """Return the share of the contact time in which the force was in the band, 0 before any contact, (n,)."""
    return state["band_s"] / np.maximum(state["contact_s"], 1e-9)


def cell_of(readings: Readings, point_m: FloatArray, a_side: int) -> NDArray[np.intp]:
    """Return the index, in the order of brushing, of the cell nearest to a world point, (n,)."""
    from_middle = point_m - readings["wall_position"]
    right_m = np.einsum("nk,nk->n", from_middle, readings["wall_right"])
    down_m = -np.einsum("nk,nk->n", from_middle, readings["wall_up"])
    column, row = (_index(way_m, a_side) for way_m in (right_m, down_m))
    return row * a_side + np.where(row % 2 == 0, column, a_side - 1 - column)


def _cell_center_m(readings: Readings, number: NDArray[np.intp], a_side: int) -> FloatArray:
    """Return the world positions of the centres of cells, (n, 3) [m]."""
    row, place = number // a_side, number % a_side
    column = np.where(row % 2 == 0, place, a_side - 1 - place)
    right_m, down_m = ((index + 0.5) * WALL_M / a_side - WALL_M / 2 for index in (column, row))
    across = right_m[:, None] * readings["wall_right"] - down_m[:, None] * readings["wall_up"]
    return np.asarray(readings["wall_position"] + across)


def to_wanted_m(readings: Readings, state: TaskState, a_side: int) -> FloatArray:
    """Return the vector from the functional part to the first cell that is not brushed, (n, 3) [m]."""
    return _cell_center_m(readings, np.argmin(brushed(state), axis=1), a_side) - readings["tip_position"]


def _index(way_m: FloatArray, a_side: int) -> NDArray[np.intp]:
    """Return the index of the column or row at a signed distance from the middle [m]."""
    return np.clip(np.floor((way_m / WALL_M + 0.5) * a_side), 0, a_side - 1).astype(np.intp)
