"""Brush a wall with a steady force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.manipulation.cells import STEADY, WALL_M, brushed, cell_of, done, in_band, steady, to_wanted_m
from aidsr.tasks.readings import TOUCH_N, BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess, share
from aidsr.tasks.task import Memory, Task
from aidsr.tasks.variation import Change, Variation

CENTER_M = (0.0, 0.25, 0.30)
NEAR_M = 0.2
"""Scale on which coming to the wanted cell is worth something: cells lie up to 0.24 m apart."""


@dataclass(frozen=True)
class ForceControlledBrushing(Task):
    """The functional part goes over a wall cell by cell, row by row from the top, with a force in a narrow band.

    | index | feature                                    | unit | range       | sensor                       |
    |-------|--------------------------------------------|------|-------------|------------------------------|
    | 0-2   | functional part to the wanted cell         | m    | -0.8 to 0.8 | wall_*, tip_position, (memory) |
    | 3-5   | outward direction of the wall              |      | -1 to 1     | wall_back                    |
    | 6     | force on the wall, 1 = 1 N                 |      | 0 to 40     | brush_contacts               |
    | 7     | 1 while the force is in the band           |      | 0 or 1      | brush_contacts               |
    | 8     | share of cells brushed                     |      | 0 to 1      | (memory)                     |
    | 9     | share of the contact time in the band      |      | 0 to 1      | (memory)                     |
    | 10    | base sideways                              | m    | -0.1 to 0.1 | base_x_position              |
    | 11    | base up and down                           | m    | -0.1 to 0.1 | base_z_position              |

    Source: our choice, after robosuite's Wipe (force window and coverage; Zhu et al. 2020).
    """

    name: ClassVar = "manipulation/force_controlled_brushing"
    base: ClassVar = "moving"
    time_limit_s: ClassVar = 60.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.04, "at the wall"), (0.3, "brushing"), (1.0, "all brushed"))
    required_names: ClassVar = ("mount", "wall", "base_x", "base_z")
    policy_actuators: ClassVar = ("base_x", "base_z")
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="brush_contacts", quantity="contacts", target="wall", part="functional_part", slots=4),
        TaskSensor(name="robot_contacts", quantity="contacts", target="wall", slots=8),
    )
    hard: ClassVar = {"cells_a_side": 10, "coverage": 0.9}

    cells_a_side: int = 5
    coverage: float = 0.7
    """Share of the cells that has to be brushed."""

    @property
    def objective(self) -> str:
        """See `Task`."""
        n, size_mm = self.cells_a_side, 1000 * WALL_M / self.cells_a_side
        return (
            "Brush an upright wall of 0.3 x 0.3 m: the functional part, whose contact alone counts, has to press on at "
            f"least {100 * self.coverage:g} % of its {n} x {n} cells ({size_mm:g} mm each) with 0.3 to 1.0 N for 0.1 s "
            "each and stay in that range for 60 % of its time in contact; no part of the robot may press with more "
            "than 3 N. The mount faces the wall's middle from 0.25 m and moves 0.10 m up, down and to either side."
        )

    def draw(self, rng: np.random.Generator) -> Variation:
        """Wall +-15 mm nearer or farther, tilted by up to +-5 deg about both of its edges."""
        x, y, z = CENTER_M
        tip, turn = np.deg2rad(rng.uniform(-5.0, 5.0, size=2)) / 2
        tipped, turned = (np.cos(tip), np.sin(tip)), (np.cos(turn), np.sin(turn))
        tilt = (tipped[0] * turned[0], tipped[1] * turned[0], tipped[1] * turned[1], tipped[0] * turned[1])
        place = Change("body_pos", "wall", (x, y + rng.uniform(-0.015, 0.015), z))
        return Variation((place, Change("body_quat", "wall", tilt)))

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        force_n = self._force_n(readings)
        brushing = [force_n, in_band(force_n), brushed(memory).mean(axis=1), steady(memory)]
        base_m = [readings["base_x_position"], readings["base_z_position"]]
        return np.column_stack(
            [to_wanted_m(readings, memory, self.cells_a_side), -readings["wall_back"], *brushing, *base_m]
        )

    def begin(self, readings: Readings) -> Memory:
        """Nothing is brushed."""
        cells = np.zeros((readings.n, self.cells_a_side**2))
        return {"cells_s": cells, "band_s": np.zeros(readings.n), "contact_s": np.zeros(readings.n)}

    def remember(self, readings: Readings, memory: Memory) -> Memory:
        """Time in the band for each cell and in all, and time in contact."""
        force_n, dt = self._force_n(readings), self.control_dt_s
        band = in_band(force_n)
        touched = cell_of(readings, readings.contacts("brush_contacts").position_m[:, 0], self.cells_a_side)
        cells_s = memory["cells_s"].copy()
        cells_s[np.arange(readings.n), touched] += dt * band
        contact_s = memory["contact_s"] + dt * (force_n > TOUCH_N)
        return {"cells_s": cells_s, "band_s": memory["band_s"] + dt * band, "contact_s": contact_s}

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Cells brushed in order, weighted by how steady the force was; a twentieth for coming to the wanted cell."""
        covered = done(memory, self.coverage) * share(steady(memory), STEADY)
        near = closeness(np.linalg.norm(to_wanted_m(readings, memory, self.cells_a_side), axis=1), margin=NEAR_M)
        return 0.95 * covered + 0.05 * np.where(covered < 1.0, near, 1.0)

    def violation(self, readings: Readings) -> FloatArray:
        """A peak of more than 3 N."""
        return excess(readings.peak_contact_n("robot_contacts", together=True), 3.0)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Enough cells are brushed, with the force in the band most of the time."""
        del readings
        return np.asarray((brushed(memory).mean(axis=1) >= self.coverage) & (steady(memory) >= STEADY))

    def _force_n(self, readings: Readings) -> FloatArray:
        """Return the mean force of the functional part on the wall over a control step, (n,) [N]."""
        return readings.peak_contact_n("brush_contacts", mean_over_s=self.control_dt_s, together=True)
