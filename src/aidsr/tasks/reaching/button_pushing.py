"""Press a spring-loaded button beside a hanging robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.readings import TOUCH_N, BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import approach, excess, share
from aidsr.tasks.task import Edits, Memory, Task
from aidsr.tasks.variation import Change, Variation

STIFFNESS_N_M = 60.0
PRESSED_M = 0.005
DEPTH_M = 0.26
"""How far below the mount the button's centre lies."""
OFFSET_M = 0.115
"""Its middle distance from the line straight down."""


@dataclass(frozen=True)
class ButtonPushing(Task):
    """The functional part presses a button that faces the robot.

    | index | feature                              | unit | range       | sensor                         |
    |-------|--------------------------------------|------|-------------|--------------------------------|
    | 0-2   | functional part to button            | m    | -0.8 to 0.8 | button_position, tip_position  |
    | 3-5   | direction in which it is pressed     |      | -1 to 1     | button_direction               |
    | 6     | travel, 1 when pressed               |      | 0 to 1.6    | button_travel                  |
    | 7     | force of the functional part, 1 = 5 N |     | 0 to 8      | tip_force                      |

    Source: our choice, after Meta-World's button-press (Yu et al. 2019). The button lies in the middle of the space
    that an arm of 0.25 to 0.35 m sweeps; its distance from the line straight down varies, its depth does not, so that
    an arm which bends in one piece can reach every one.
    """

    name: ClassVar = "reaching/button_pushing"
    base: ClassVar = "fixed"
    time_limit_s: ClassVar = 10.0
    hold_s: ClassVar = 0.2
    stages: ClassVar = ((0.5, "at the button"), (1.0, "pressed"))
    required_names: ClassVar = ("mount", "button", "button_cap", "button_slide", "button_face")
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="tip_force", quantity="contact_force", target="button_cap", part="functional_part"),
        TaskSensor(name="robot_force", quantity="contact_force", target="button_cap", part="robot"),
    )
    hard: ClassVar = {"preload_n": 5.0}

    preload_n: float = 0.15
    """Force that must be passed before the button moves [N]."""

    @property
    def objective(self) -> str:
        """See `Task`."""
        return (
            "Press a round push button of 20 mm radius at least 5 mm in and keep it in for 0.2 s; it takes "
            f"{self.preload_n:g} N to start moving and 60 N/m more from there. It lies 0.26 m below the fixed mount, "
            "0.09 to 0.14 m to the side, anywhere within 90 degrees to either side of the front, and faces inwards."
        )

    @property
    def edits(self) -> Edits:
        """See `Task`."""
        return {"joint/button_slide": {"springref": -self.preload_n / STIFFNESS_N_M}}

    def draw(self, rng: np.random.Generator) -> Variation:
        """Azimuth +-90 deg, distance from the axis +-20 %, tilt of the pressing direction +-20 deg."""
        azimuth, tilt = np.deg2rad(rng.uniform(-90.0, 90.0)), np.deg2rad(rng.uniform(-20.0, 20.0))
        offset_m = OFFSET_M * rng.uniform(0.8, 1.2)
        cos, sin, up, down = np.cos(azimuth / 2), np.sin(azimuth / 2), np.cos(tilt / 2), np.sin(tilt / 2)
        place = (offset_m * np.cos(azimuth), offset_m * np.sin(azimuth), 0.7 - DEPTH_M)
        turn = (cos * up, -sin * down, cos * down, sin * up)
        return Variation((Change("body_pos", "button", place), Change("body_quat", "button", turn)))

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        del memory
        return np.column_stack(
            [
                readings["button_position"] - readings["tip_position"],
                readings["button_direction"],
                readings["button_travel"] / PRESSED_M,
                readings.force_n("tip_force") / 5.0,
            ]
        )

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Half for nearness of the functional part to the button, half for the button's travel."""
        del memory
        distance = np.linalg.norm(readings["button_position"] - readings["tip_position"], axis=1)
        near = approach(distance, within=0.01)
        return 0.5 * near + 0.5 * share(readings.scalar("button_travel"), PRESSED_M)

    def violation(self, readings: Readings) -> FloatArray:
        """More than 20 N on the button."""
        return excess(readings.peak_force_n("robot_force"), 20.0)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Pressed at least 5 mm, by the functional part."""
        del memory
        return (readings.scalar("button_travel") >= PRESSED_M) & (readings.force_n("tip_force") > TOUCH_N)
