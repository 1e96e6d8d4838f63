"""Turn a crank by its pin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import approach, excess, share
from aidsr.tasks.task import FORCE_SCALE_N, Criteria, Edits, Feature, Task, TaskState, span
from aidsr.tasks.variation import Change, Variation

RADIUS_M = 0.06
"""Distance from the axle to the pin [m]."""
HEIGHT_M, AHEAD_M = 0.30, 0.25
"""Position of the crank's front: height above the floor, and distance from the mount [m]."""
OFFSET_M = 0.01
TORQUE_FACTOR = (0.5, 1.5)
MAX_FORCE_N = 15.0
MAX_WRONG_WAY_DEG = 90.0
"""Largest turn in the wrong direction [deg]. Our choice: a third of the required turn, far more than a bump."""
WRONG_WAY = f"The crank was turned by more than {MAX_WRONG_WAY_DEG:g} degrees in the wrong direction."


@dataclass(frozen=True)
class CrankTurning(Task):
    """The pin of a crank is pushed around its axle, to the side that the episode asks for.

    Source: our choice. A pin goes in a circle, so that the push has to change its direction all the time. Turning it
    the wrong way loses, because one motion that turned it far in both directions, one after the other, had succeeded
    without looking which was demanded.
    """

    name: ClassVar = "manipulation/crank_turning"
    unchanged_since: ClassVar = 6
    base: ClassVar = "moving"
    time_limit_s: ClassVar = 30.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.2, "at the pin"), (0.6, "half of the turn"), (1.0, "turned"))
    required_names: ClassVar = ("mount", "board", "crank", "pin", "base_y", "base_z")
    policy_actuators: ClassVar = ("base_y", "base_z")
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="pin_force", quantity="contact_force", target="pin"),
    )
    features: ClassVar = (
        Feature("functional part to the middle of the pin", "m", (-0.5, 0.5), "pin_position, tip_position", size=3),
        Feature("angle of the crank, cosine and sine; 0 has the pin on top", "", (-1, 1), "crank_angle", size=2),
        Feature("turned, 1 = as far as wanted", "", (-1, 1.2), "crank_angle"),
        Feature("1: clockwise as the robot sees it, -1: the other way", "", (-1, 1), "(parameters)"),
        Feature("base sideways", "m", (-0.1, 0.1), "base_y_position"),
        Feature("base up and down", "m", (-0.1, 0.1), "base_z_position"),
        Feature(f"force on the pin, 1 = {FORCE_SCALE_N:g} N", "", (0, 3), "pin_force"),
    )
    hard: ClassVar = {"torque_nm": 0.08, "turn_deg": 540.0}

    torque_nm: float = 0.04
    """Friction of the axle [N m]; see `TORQUE_FACTOR`."""
    turn_deg: float = 270.0
    """Required turn of the crank [deg]."""

    @property
    def objective(self) -> str:
        return (
            f"Rotate a crank on a vertical board by {self.turn_deg:g} degrees, clockwise or counterclockwise as "
            f"demanded, despite {self.torque_nm:g} N m of resistance. Its axle is {AHEAD_M:g} m ahead of the base, its "
            f"pin 14 mm thick, {RADIUS_M:g} m from the axle, and it sticks out from the board by 66 mm; the base "
            "shifts by 0.10 m sideways, upwards and downwards."
        )

    @property
    def edits(self) -> Edits:
        return {"joint/crank": {"frictionloss": self.torque_nm}}

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"Direction of the turn, where the pin starts (anywhere on its circle), place of the axle "
                f"+-{1000 * OFFSET_M:g} mm sideways and in height, friction {span(TORQUE_FACTOR)} times the nominal."
            ),
            progress="A fifth for nearness of the functional part to the pin, the rest for the angle turned.",
            success=f"Turned by at least {self.turn_deg:g} degrees in the given direction, and not turned back.",
            violation=f"More than {MAX_FORCE_N:g} N on the pin.",
            failure=WRONG_WAY,
        )

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        y, z = rng.uniform(-OFFSET_M, OFFSET_M, size=2)
        start = float(rng.uniform(-np.pi, np.pi))
        torque_nm = self.torque_nm * rng.uniform(*TORQUE_FACTOR)
        changes = (
            Change("body_pos", "crank", (0.0, y, z)),
            Change("dof_frictionloss", "crank", (torque_nm,)),
            Change("qpos", "crank", (start,)),
        )
        direction = float(rng.choice((-1.0, 1.0)))
        words = (
            f"turn {'clockwise' if direction > 0 else 'counterclockwise'} as the robot sees it; pin starts "
            f"{np.rad2deg(start):+.0f} deg from the top (clockwise positive), axle {1000 * y:+.1f} mm to the left and "
            f"{1000 * z:+.1f} mm up, friction {torque_nm:.3f} N m"
        )
        return Variation(changes, {"direction": (direction,)}, words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        angle = readings.scalar("crank_angle")
        turned = self._turned_deg(readings, state) / self.turn_deg
        base_m = [readings["base_y_position"], readings["base_z_position"]]
        force = readings.force_n("pin_force") / FORCE_SCALE_N
        return np.column_stack(
            [
                _to_pin_m(readings),
                np.cos(angle),
                np.sin(angle),
                turned,
                readings.parameters["direction"],
                *base_m,
                force,
            ]
        )

    def reset_state(self, readings: Readings) -> TaskState:
        return {"start": readings.scalar("crank_angle")}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        turned = share(self._turned_deg(readings, state), self.turn_deg)
        near = approach(np.linalg.norm(_to_pin_m(readings), axis=1), within=0.03)
        # a crank that turns counts as reached, whichever part of the robot pushes it
        return 0.2 * np.maximum(near, turned) + 0.8 * turned

    def violation(self, readings: Readings) -> FloatArray:
        return excess(readings.peak_force_n("pin_force"), MAX_FORCE_N)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        return self._turned_deg(readings, state) >= self.turn_deg

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        return {WRONG_WAY: self._turned_deg(readings, state) < -MAX_WRONG_WAY_DEG}

    def _turned_deg(self, readings: Readings, state: TaskState) -> FloatArray:
        """Return the angle of the crank since the start in the required direction, (n,) [deg]."""
        turned = readings.scalar("crank_angle") - state["start"]
        return np.asarray(np.rad2deg(turned) * readings.parameters["direction"][:, 0])


def _to_pin_m(readings: Readings) -> FloatArray:
    """Return the vector from the functional part to the middle of the pin, (n, 3) [m]."""
    return np.asarray(readings["pin_position"] - readings["tip_position"])
