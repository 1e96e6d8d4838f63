"""Open and shut three drawers in a given order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.manipulation.drawers import (
    ALL_STAGES,
    DRAWERS,
    OPEN_M,
    SHUT_M,
    STAGES,
    nearness,
    openings_m,
    staged,
    to_be_shut,
    wanted,
)
from aidsr.tasks.readings import TOUCH_N, BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import excess
from aidsr.tasks.task import Edits, Memory, Task
from aidsr.tasks.variation import Change, Variation

NEAR_M = 0.03


@dataclass(frozen=True)
class DrawerOpening(Task):
    """Twelve stages: each drawer in its turn is approached, held, pulled open and pushed shut.

    | index | feature                                     | unit | range       | sensor                           |
    |-------|---------------------------------------------|------|-------------|----------------------------------|
    | 0-2   | functional part to the wanted drawer's handle | m  | -0.8 to 0.8 | drawer_*_position, tip_position  |
    | 3     | opening of the wanted drawer, 1 = 60 mm     |      | 0 to 1.7    | drawer_*_opening                 |
    | 4     | force on its handle, 1 = 5 N                |      | 0 to 8      | drawer_*_force                   |
    | 5     | 1: to be opened, -1: to be shut, or kept so |      | -1 or 1     | (memory)                         |
    | 6     | base forwards and back                      | m    | -0.1 to 0.1 | base_x_position                  |
    | 7     | base up and down                            | m    | -0.2 to 0.15 | base_z_position                 |
    | 8-10  | openings of drawers 1 to 3, 1 = 60 mm       |      | 0 to 1.7    | drawer_*_opening                 |

    Source: our choice, after Meta-World's drawer-open (Yu et al. 2019) and ManiSkill's cabinet drawers (75 % open).
    """

    name: ClassVar = "manipulation/drawer_opening"
    base: ClassVar = "moving"
    time_limit_s: ClassVar = 60.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((1 / 12, "at a handle"), (3 / 12, "one drawer open"), (7 / 12, "two open"), (1.0, "all done"))
    required_names: ClassVar = ("mount", "cabinet", *DRAWERS, *(f"{drawer}_handle" for drawer in DRAWERS))
    policy_actuators: ClassVar = ("base_x", "base_z")
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        *(TaskSensor(name=f"{d}_force", quantity="contact_force", target=f"{d}_handle") for d in DRAWERS),
    )
    hard: ClassVar = {"friction_n": 1.5}

    friction_n: float = 0.4
    """Sliding friction of a drawer [N]; an episode has half to twice of it."""

    @property
    def objective(self) -> str:
        """See `Task`."""
        return (
            "Open three drawers by their bar handles (12 mm thick, 60 mm wide, 25 mm in front), 0.10, 0.20 and 0.30 "
            "m above the floor, one after the other in a given order: at least 60 mm out, then back to 10 mm or "
            f"less, against {self.friction_n:g} N of friction. The mount, 0.25 m before them, moves between floor "
            "and 0.35 m and 0.10 m to and fro."
        )

    @property
    def edits(self) -> Edits:
        """See `Task`."""
        return {f"joint/{drawer}": {"frictionloss": self.friction_n} for drawer in DRAWERS}

    def draw(self, rng: np.random.Generator) -> Variation:
        """Order of the drawers, friction of each from half to twice the nominal one."""
        friction_n = self.friction_n * rng.uniform(0.5, 2.0, size=3)
        changes = tuple(Change("dof_frictionloss", d, (f,)) for d, f in zip(DRAWERS, friction_n, strict=True))
        return Variation(changes, {"order": tuple(float(drawer) for drawer in rng.permutation(3))})

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        to_handle, opening_m, force_n = wanted(readings, memory)
        turn = [opening_m / OPEN_M, force_n / 5.0, np.where(to_be_shut(memory), -1.0, 1.0)]
        base_m = [readings["base_x_position"], readings["base_z_position"]]
        return np.column_stack([to_handle, *turn, *base_m, openings_m(readings) / OPEN_M])

    def begin(self, readings: Readings) -> Memory:
        """No stage is done."""
        return {"stage": np.zeros(readings.n)}

    def remember(self, readings: Readings, memory: Memory) -> Memory:
        """Pass, in order, every stage of the wanted drawer whose goal is reached."""
        to_handle, opening_m, force_n = wanted(readings, memory)
        arrived, touched = np.linalg.norm(to_handle, axis=1) < NEAR_M, force_n > TOUCH_N
        stage, first = memory["stage"], memory["stage"] // STAGES * STAGES
        for done, reached in enumerate((arrived | touched, touched, opening_m >= OPEN_M, opening_m <= SHUT_M)):
            stage = np.where((stage == first + done) & reached & (stage < ALL_STAGES), stage + 1, stage)
        return {"stage": stage}

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Stages done, and the share of the present one; after the last one its share is that of all being shut.

        A part of pulling and pushing is to be near the handle, in pulling behind its bar, so that a robot that has lost
        it gains by going back.
        """
        to_handle, opening_m, _ = wanted(readings, memory)
        return staged(memory, nearness(memory, to_handle), opening_m, openings_m(readings).max(axis=1))

    def violation(self, readings: Readings) -> FloatArray:
        """More than 40 N on a handle."""
        return excess(np.max([readings.peak_force_n(f"{drawer}_force") for drawer in DRAWERS], axis=0), 40.0)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """All twelve stages are done and all drawers are shut."""
        return (memory["stage"] >= ALL_STAGES) & (openings_m(readings) <= SHUT_M).all(axis=1)
