"""Press a spring-loaded button beside a hanging robot when a signal asks for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import TOUCH_N, BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import approach, excess, share
from aidsr.tasks.task import FORCE_SCALE_N, Criteria, Edits, Feature, Task, TaskState, span
from aidsr.tasks.variation import Change, Variation

MOUNT_HEIGHT_M = 0.7
DEPTH_M = 0.26
"""Depth of the button's centre below the mount [m]."""
OFFSET_M = 0.115
"""Mean distance of the button from the line straight down from the mount [m]."""
OFFSET_FACTOR = (0.8, 1.2)
AZIMUTH_DEG = 90.0
TILT_DEG = 20.0
STIFFNESS_N_M = 60.0
PRESSED_M = 0.005
OUT_M = 0.001
"""Travel below which a button counts as released [m]."""
SIGNAL_S = (0.5, 1.5)
"""Range of the time of the signal [s]. Our choice: a robot that moves there at once has pressed before it."""
MAX_FORCE_N = 20.0


@dataclass(frozen=True)
class ButtonPushing(Task):
    """The functional part presses a button that faces the robot, at a signal: a button pressed before is let out first.

    Source: our choice, after Meta-World's button-press (Yu et al. 2019). The button lies in the middle of the space
    that an arm of 0.25 to 0.35 m sweeps; its distance from the line straight down varies, its depth does not, so that
    an arm which bends in one piece can reach every one. When the signal comes varies too, so that nothing which moves
    there by itself, however it is built, can win.
    """

    name: ClassVar = "reaching/button_pushing"
    base: ClassVar = "fixed"
    time_limit_s: ClassVar = 10.0
    hold_s: ClassVar = 0.6
    stages: ClassVar = ((0.5, "at the button"), (1.0, "pressed"))
    decisive: ClassVar = "pressed"
    required_names: ClassVar = ("mount", "button", "button_cap", "button_slide", "button_face")
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="tip_force", quantity="contact_force", target="button_cap", part="functional_part"),
        TaskSensor(name="robot_force", quantity="contact_force", target="button_cap", part="robot"),
    )
    features: ClassVar = (
        Feature("functional part to button", "m", (-0.8, 0.8), "button_position, tip_position", size=3),
        Feature("direction in which it is pressed", "", (-1, 1), "button_direction", size=3),
        Feature("travel, 1 when pressed", "", (0, 1.6), "button_travel"),
        Feature(f"force of the functional part, 1 = {FORCE_SCALE_N:g} N", "", (0, 8), "tip_force"),
        Feature("1 once the button was out after the signal", "", (0, 1), "(state)"),
    )
    hard: ClassVar = {"preload_n": 5.0}

    preload_n: float = 0.15
    """Force that must be exceeded before the button moves [N]."""

    @property
    def objective(self) -> str:
        nearest_m, farthest_m = (OFFSET_M * factor for factor in OFFSET_FACTOR)
        return (
            f"Press a round push button of 20 mm radius at least {1000 * PRESSED_M:g} mm in and keep it in for "
            f"{self.hold_s:g} s after a signal, which comes {span(SIGNAL_S)} s after the start and finds it out, or "
            f"sees it let out first; it takes {self.preload_n:g} N to start moving and {STIFFNESS_N_M:g} N/m more from "
            f"there. It lies {DEPTH_M:g} m below the fixed mount, {nearest_m:.2f} to {farthest_m:.2f} m to the side, "
            f"anywhere within {AZIMUTH_DEG:g} degrees to either side of the front, and faces inwards."
        )

    @property
    def edits(self) -> Edits:
        return {"joint/button_slide": {"springref": -self.preload_n / STIFFNESS_N_M}}

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"Azimuth +-{AZIMUTH_DEG:g} deg, distance from the axis +-{100 * (OFFSET_FACTOR[1] - 1):g} %, "
                f"tilt of the pressing direction +-{TILT_DEG:g} deg; the signal comes after {span(SIGNAL_S)} s."
            ),
            progress=(
                "Half for nearness of the functional part to the button, half for the button's travel, once it was out "
                "after the signal."
            ),
            success=f"Pressed at least {1000 * PRESSED_M:g} mm by the functional part, from less than "
            f"{1000 * OUT_M:g} mm after the signal.",
            violation=f"More than {MAX_FORCE_N:g} N on the button.",
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        return (Mark(element="joint", name="button_slide", by=PRESSED_M),)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        azimuth_deg, tilt_deg = rng.uniform(-AZIMUTH_DEG, AZIMUTH_DEG), rng.uniform(-TILT_DEG, TILT_DEG)
        azimuth, tilt = np.deg2rad(azimuth_deg), np.deg2rad(tilt_deg)
        offset_m = OFFSET_M * rng.uniform(*OFFSET_FACTOR)
        cos, sin, up, down = np.cos(azimuth / 2), np.sin(azimuth / 2), np.cos(tilt / 2), np.sin(tilt / 2)
        place = (offset_m * np.cos(azimuth), offset_m * np.sin(azimuth), MOUNT_HEIGHT_M - DEPTH_M)
        turn = (cos * up, -sin * down, cos * down, sin * up)
        signal_s = rng.uniform(*SIGNAL_S)
        words = (
            f"button {azimuth_deg:+.0f} deg from +x towards +y, {1000 * offset_m:.0f} mm from the axis, faces "
            f"{abs(tilt_deg):.0f} deg {'upwards' if tilt_deg >= 0 else 'downwards'}; signal after {signal_s:.2f} s"
        )
        changes = (Change("body_pos", "button", place), Change("body_quat", "button", turn))
        return Variation(changes, {"signal_s": (signal_s,)}, words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        return np.column_stack(
            [
                readings["button_position"] - readings["tip_position"],
                readings["button_direction"],
                readings["button_travel"] / PRESSED_M,
                readings.force_n("tip_force") / FORCE_SCALE_N,
                state["asked"],
            ]
        )

    def reset_state(self, readings: Readings) -> TaskState:
        return {"asked": np.zeros(readings.n)}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        out = readings.scalar("button_travel") < OUT_M
        asked = out & (readings.time_s >= readings.parameters["signal_s"][:, 0])
        return {"asked": np.maximum(state["asked"], asked)}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        distance = np.linalg.norm(readings["button_position"] - readings["tip_position"], axis=1)
        near = approach(distance, within=0.01)
        return 0.5 * near + 0.5 * state["asked"] * share(readings.scalar("button_travel"), PRESSED_M)

    def violation(self, readings: Readings) -> FloatArray:
        return excess(readings.peak_force_n("robot_force"), MAX_FORCE_N)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        pressed = (readings.scalar("button_travel") >= PRESSED_M) & (readings.force_n("tip_force") > TOUCH_N)
        return np.asarray(pressed & (state["asked"] > 0.0))
