"""Hands with fingers on a palm. Tendons wrap around pulleys, couple joints by a fixed ratio, or run over sites."""

from __future__ import annotations

import math

import numpy as np
from benchmarks.validator.corpus.writers.written import Written, number, numbers


def write_hand(rng: np.random.Generator) -> Written:
    """Write a hand of three to five fingers, pointing up or down from its palm."""
    fingers = int(rng.integers(3, 6))
    phalanges = int(rng.integers(3, 6))
    routing = str(rng.choice(["wrapped", "fixed", "sites"]))
    length = rng.uniform(0.08, 0.2)
    finger = _Finger(phalanges, length, routing, rng.uniform(0.8, 2.0), rng.uniform(0.8, 1.4))
    bodies = tendons = actuators = sensors = ""
    width = 0.35 * length
    for index in range(fingers):
        thumb = index == fingers - 1
        name = "thumb" if thumb else f"finger{index}"
        place = (0.0, -0.3 * length, 0.0) if thumb else ((index - (fingers - 2) / 2) * width, 0.3 * length, 0.0)
        yaw = math.pi if thumb else 0.0
        bodies += finger.body(name, place, yaw)
        tendons += finger.tendons(name)
        actuators += finger.actuators(name)
        sensors += f'    <framepos objtype="site" objname="{name}_tip"/>\n'
        sensors += f'    <tendonpos tendon="{name}_flex"/>\n'
    palm = (width * fingers / 2, 0.36 * length, 0.01)
    turn = "0 0 0" if rng.random() < 0.5 else "3.14159 0 0"
    mjcf = f"""<mujoco model="hand">
  <compiler angle="radian"/>
  <option timestep="0.001" integrator="implicitfast"/>
  <default>
    <default class="phalanx">
      <geom type="capsule" solref="0.004 1" rgba="0.9 0.8 0.7 1"/>
      <joint axis="1 0 0" range="-0.3 1.2" stiffness="{number(finger.stiffness)}" damping="{number(finger.damping)}"
        armature="1e-6" solreflimit="0.004 1"/>
      <site type="sphere" size="0.001"/>
    </default>
    <default class="pulley">
      <geom type="cylinder" contype="0" conaffinity="0" mass="0" group="3"/>
    </default>
  </default>
  <worldbody>
    <body name="palm" pos="0 0 0.4" euler="{turn}">
      <geom name="palm" type="box" size="{numbers(palm)}" pos="0 0 {number(-0.012 - finger.radius)}"/>
{bodies}    </body>
  </worldbody>
  <tendon>
{tendons}  </tendon>
  <actuator>
{actuators}  </actuator>
  <sensor>
{sensors}  </sensor>
</mujoco>
"""
    return Written(f"hand with {routing} tendons", mjcf)


class _Finger:
    """Equal phalanges that flex about x, towards +y of the finger's frame."""

    def __init__(self, phalanges: int, length: float, routing: str, stiff: float, bend: float) -> None:
        self.count, self.pitch, self.routing = phalanges, length / phalanges, routing
        self.radius = length / 16
        self.mass = 900 * math.pi * self.radius**2 * self.pitch
        weight = 9.81 * self.mass * phalanges
        self.stiffness = stiff * weight * length
        self.damping = 0.03 * math.sqrt(length / 0.1) * self.stiffness
        self.offset = 0.7 * self.radius
        self.force = bend / phalanges * self.stiffness / self.offset * 1.5

    def body(self, name: str, place: tuple[float, float, float], yaw: float) -> str:
        text = ""
        for index in reversed(range(self.count)):
            pitch, r = self.pitch, self.radius
            where = f'pos="0 0 {number(pitch)}"' if index else f'pos="{numbers(place)}" euler="0 0 {number(yaw)}"'
            tip = f'<site name="{name}_tip" pos="0 0 {number(pitch)}"/>' if not text else ""
            pulley = ""
            if self.routing == "wrapped":
                pulley = (
                    f'<geom name="{name}_pulley{index}" class="pulley" size="{numbers((self.offset, r / 2))}"'
                    f' zaxis="1 0 0"/>\n<site name="{name}_side{index}" pos="0 {number(1.4 * r)} 0"/>\n'
                )
            childclass = "" if index else ' childclass="phalanx"'
            text = f"""<body name="{name}_p{index}" {where}{childclass}>
<joint name="{name}_j{index}"/>
<geom fromto="0 0 {number(0.3 * pitch)} 0 0 {number(0.7 * pitch)}" size="{number(r)}" mass="{number(self.mass)}"/>
{pulley}<site name="{name}_f{index}" pos="{numbers((0, self.offset, pitch / 2))}"/>
<site name="{name}_e{index}" pos="{numbers((0, -self.offset, pitch / 2))}"/>{tip}
{text}</body>
"""
        holes = "".join(
            f'<site name="{name}_{side}" pos="{numbers(self._anchor(place, yaw, sign))}"/>'
            for side, sign in (("fbase", 1), ("ebase", -1))
        )
        return holes + "\n" + text

    def _anchor(self, place: tuple[float, float, float], yaw: float, sign: int) -> tuple[float, float, float]:
        return place[0], place[1] + sign * self.offset * math.cos(yaw), place[2] - self.radius

    def tendons(self, name: str) -> str:
        if self.routing == "fixed":
            ratios = [1.0 - 0.15 * index for index in range(self.count)]
            flex = "".join(
                f'<joint joint="{name}_j{i}" coef="{number(ratio * self.offset)}"/>' for i, ratio in enumerate(ratios)
            )
            return f'    <fixed name="{name}_flex">{flex}</fixed>\n'
        flex = f'<site site="{name}_fbase"/>'
        for index in range(self.count):
            if self.routing == "wrapped":
                flex += f'<geom geom="{name}_pulley{index}" sidesite="{name}_side{index}"/>'
            flex += f'<site site="{name}_f{index}"/>'
        extend = f'<site site="{name}_ebase"/>' + "".join(f'<site site="{name}_e{i}"/>' for i in range(self.count))
        return (
            f'    <spatial name="{name}_flex" width="0.0006">{flex}</spatial>\n'
            f'    <spatial name="{name}_extend" width="0.0006">{extend}</spatial>\n'
        )

    def actuators(self, name: str) -> str:
        force = number(self.force)
        if self.routing == "fixed":
            return f'    <motor name="{name}_flexor" tendon="{name}_flex" ctrlrange="0 {force}"/>\n'
        weak = number(0.25 * self.force)
        return (
            f'    <motor name="{name}_flexor" tendon="{name}_flex" gear="-1" ctrlrange="0 {force}"/>\n'
            f'    <motor name="{name}_extensor" tendon="{name}_extend" gear="-1" ctrlrange="0 {weak}"/>\n'
        )
