"""Limbs of cable-driven continuum robots, as MJCF: chains of short capsules between bending joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aidsr.core.artifacts import Robot

ROUND_DEG = (0, 90, 180, 270)
BOTH_WAYS = ("1 0 0", "0 1 0")


def arched(segments: int, turn_deg: float) -> tuple[float, ...]:
    """Return the bends [deg] of an arm's segments: three sections rise, descend and level out, so it can stretch."""
    third = segments // 3
    return (-turn_deg / third,) * third + (2 * turn_deg / third,) * third + (-turn_deg / third,) * third


@dataclass(frozen=True)
class Cable:
    """A cable along a limb: angle about the limb's axis, last segment, largest tension, distance from the axis."""

    name: str
    angle_deg: float
    last: int
    tension_n: float
    radius_m: float

    @property
    def xy(self) -> str:
        """Position of the cable in the frame of a segment, as MJCF [m]."""
        angle = np.deg2rad(self.angle_deg)
        return f"{self.radius_m * np.cos(angle):.6g} {self.radius_m * np.sin(angle):.6g}"


@dataclass(frozen=True)
class Limb:
    """A chain of equal segments along the +z axis of its own frame, with cables."""

    name: str
    length_m: float
    segments: int
    cables: tuple[Cable, ...]
    radius_m: float
    stiffness: float
    """Stiffness of each joint [N m/rad]."""
    damping: float
    tip: str
    """MJCF of the elements at the limb's end."""
    place: str
    axes: tuple[str, ...] = BOTH_WAYS
    density: float = 500.0
    range_deg: float = 75.0
    """Range of each joint to either side [deg]."""
    bends_deg: tuple[float, ...] = ()
    """Rotation of each segment about y in the drawn pose [deg]; straight by default."""

    def mjcf(self) -> str:
        """Return the MJCF of the bodies."""
        step = self.length_m / self.segments
        text = f'<body name="{self.name}_end" pos="0 0 {step:.6g}">{self.tip}</body>'
        for i in reversed(range(1, self.segments + 1)):
            joints = "".join(
                f'<joint name="{self.name}_{i}_{k}" axis="{axis}" stiffness="{self.stiffness}" '
                f'damping="{self.damping}" range="-{self.range_deg} {self.range_deg}" solreflimit="0.004 1"/>'
                for k, axis in enumerate(self.axes)
            )
            holes = "".join(self._hole(cable, i, step / 2) for cable in self.cables if cable.last >= i)
            geom = (
                f'<geom type="capsule" size="{self.radius_m}" fromto="0 0 0 0 0 {step:.6g}" density="{self.density}"/>'
            )
            at = f' pos="0 0 {step:.6g}"' if i > 1 else ""
            at += f' euler="0 {self.bends_deg[i - 1]:.6g} 0"' if self.bends_deg else ""
            text = f'<body name="{self.name}_{i}"{at}>{joints}{geom}{holes}{text}</body>'
        holes = "".join(self._hole(cable, 0, -0.004) for cable in self.cables)
        return f'<body name="{self.name}_root" {self.place}>{holes}{text}</body>'

    def _hole(self, cable: Cable, segment: int, along_m: float) -> str:
        return f'<site name="{self.name}_{cable.name}_{segment}" pos="{cable.xy} {along_m:.6g}"/>'

    def tendons(self) -> str:
        """Return the MJCF of the tendons, one for each cable."""
        paths = {
            cable.name: "".join(f'<site site="{self.name}_{cable.name}_{i}"/>' for i in range(cable.last + 1))
            for cable in self.cables
        }
        return "".join(f'<spatial name="{self.name}_{name}">{path}</spatial>' for name, path in paths.items())

    def sensors(self) -> str:
        """Return the MJCF of a length sensor for each cable."""
        return "".join(f'<tendonpos tendon="{self.name}_{cable.name}"/>' for cable in self.cables)

    def actuators(self) -> str:
        """Return the MJCF of a winch for each cable, from slack to full tension."""
        return "".join(
            f'<general name="{self.name}_{cable.name}" tendon="{self.name}_{cable.name}" '
            f'ctrlrange="0 {cable.tension_n}" gainprm="-1"/>'
            for cable in self.cables
        )


def robot(base: str, limbs: Sequence[Limb], functional_part: str) -> Robot:
    """Return a robot with limbs on a base, which is given as MJCF of its geoms and sites."""
    mjcf = f"""<mujoco model="hand_made">
  <worldbody><body name="base">{base}{"".join(limb.mjcf() for limb in limbs)}</body></worldbody>
  <tendon>{"".join(limb.tendons() for limb in limbs)}</tendon>
  <actuator>{"".join(limb.actuators() for limb in limbs)}</actuator>
  <sensor>{"".join(limb.sensors() for limb in limbs)}</sensor>
</mujoco>"""
    return Robot(mjcf=mjcf, functional_part=functional_part)
