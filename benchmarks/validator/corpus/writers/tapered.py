"""Planar limbs of boxes that shrink along their length, as in logarithmic-spiral robots: grippers and tentacles."""

from __future__ import annotations

import math

import numpy as np
from benchmarks.validator.corpus.physique import GRAVITY_M_S2
from benchmarks.validator.corpus.writers.written import Written, number, numbers

_DENSITY_KG_M3 = 1200.0  # printed thermoplastic polyurethane


def write_tapered_robot(rng: np.random.Generator) -> Written:
    """Write a hanging tentacle, or a gripper of two or three tapered fingers."""
    fingers = int(rng.choice([1, 2, 2, 3]))
    length = rng.uniform(0.2, 0.5) if fingers == 1 else rng.uniform(0.12, 0.25)
    limb = _Taper(
        length=length,
        count=int(rng.integers(8, 18)),
        ratio=rng.uniform(0.9, 0.97),
        width=length / rng.uniform(6, 9),
        sag=rng.uniform(0.3, 0.8),
        damping_ratio=rng.uniform(0.15, 0.5),
        bend_rad=rng.uniform(1.5, 2.8),
    )
    friction = bool(rng.random() < 0.5)
    palm = 0.0 if fingers == 1 else 0.25 * length
    bodies = tendons = actuators = sensors = ""
    for finger in range(fingers):
        yaw = 360 * finger / fingers
        x, y = palm * math.cos(math.radians(yaw)), palm * math.sin(math.radians(yaw))
        prefix = f"f{finger + 1}_"
        half = limb.widths[0] * 0.4
        bodies += f"""<body name="{prefix}root" pos="{numbers((x, y, 0))}" euler="0 0 {number(yaw)}">
  <site name="{prefix}in_start" pos="{number(-half)} 0 0"/><site name="{prefix}out_start" pos="{number(half)} 0 0"/>
{limb.bodies(prefix)}</body>
"""
        tendons += limb.tendons(prefix, friction=friction)
        actuators += limb.motors(prefix)
        sensors += (
            f'<actuatorpos name="{prefix}in_pos" actuator="{prefix}in"/>\n'
            f'<framepos objtype="body" objname="{prefix}link{limb.count}"/>\n'
        )
    name = {1: "tentacle", 2: "two-finger gripper", 3: "three-finger gripper"}[fingers]
    mjcf = f"""<?xml version="1.0"?>
<!-- {name}, planar joints about y, links shrink by {limb.ratio:.3f} each -->
<mujoco model="{name.replace(" ", "_")}">
  <compiler angle="radian"/>
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 9.81"/>
  <default>
    <geom type="box" density="{number(_DENSITY_KG_M3)}" friction="0.8" condim="4" solref="0.004 1"/>
    <joint type="hinge" axis="0 1 0" limited="true" armature="1e-6" solreflimit="0.004 1"/>
    <site size="0.0008"/>
  </default>
  <worldbody>
  <body name="palm">
  <geom name="palm" size="{numbers((palm + limb.width, palm + limb.width, 0.01))}" pos="0 0 -0.012"/>
{bodies}  </body>
  </worldbody>
  <tendon>
{tendons}  </tendon>
  <actuator>
{actuators}  </actuator>
  <sensor>
{sensors}  </sensor>
</mujoco>
"""
    # gravity points along the fingers: they hang, but are drawn upside down, as many printed grippers on a flange
    return Written(name, mjcf)


class _Taper:
    """A limb whose links shrink by a constant ratio."""

    def __init__(
        self, length: float, count: int, ratio: float, width: float, sag: float, damping_ratio: float, bend_rad: float
    ) -> None:
        first = length * (1 - ratio) / (1 - ratio**count)
        self.count, self.ratio, self.width = count, ratio, width
        self.lengths = [first * ratio**i for i in range(count)]
        self.widths = [width * ratio**i for i in range(count)]
        volumes = [long * wide * 0.6 * wide * 0.9 for long, wide in zip(self.lengths, self.widths, strict=True)]
        mass = _DENSITY_KG_M3 * sum(volumes)
        # joint stiffness follows from the sag at the root, and is proportional to the cube of the width further out
        self.stiffness = [
            mass * GRAVITY_M_S2 * length**2 / (sag * long) * (wide / width) ** 3
            for long, wide in zip(self.lengths, self.widths, strict=True)
        ]
        omega = 3.5 * math.sqrt(GRAVITY_M_S2 / (length * sag))
        self.damping_s = 2 * damping_ratio / omega
        # a pull F at a distance d bends a joint by F d / k; the bends add up to the required one
        self.force = bend_rad / sum(0.4 * wide / k for wide, k in zip(self.widths, self.stiffness, strict=True))
        self.reach = 2.2 * bend_rad / count + 0.1

    def bodies(self, prefix: str) -> str:
        text = ""
        for index in reversed(range(self.count)):
            long, wide = self.lengths[index], self.widths[index]
            half = 0.4 * wide
            place = f'pos="0 0 {number(self.lengths[index - 1])}"' if index else ""
            holes = "".join(
                f'<site name="{prefix}{side}{index}_{end}" pos="{numbers((sign * half, 0, height * long))}"/>'
                for side, sign in (("in", -1), ("out", 1))
                for end, height in (("a", 0.25), ("b", 0.75))
            )
            k = self.stiffness[index]
            text = f"""<body name="{prefix}link{index + 1}" {place}>
<joint name="{prefix}hinge{index + 1}" stiffness="{number(k)}" damping="{number(k * self.damping_s)}"
 range="{numbers((-self.reach, self.reach))}"/>
<geom size="{numbers((wide / 2, 0.3 * wide, 0.45 * long))}" pos="0 0 {number(long / 2)}"/>
{holes}
{text}</body>
"""
        return text

    def tendons(self, prefix: str, *, friction: bool) -> str:
        loss = ' frictionloss="0.02"' if friction else ""
        text = ""
        for side in ("in", "out"):
            route = [f"{prefix}{side}_start"] + [f"{prefix}{side}{i}_{end}" for i in range(self.count) for end in "ab"]
            sites = "".join(f'<site site="{name}"/>' for name in route)
            text += f'<spatial name="{prefix}{side}" width="0.0006"{loss}>{sites}</spatial>\n'
        return text

    def motors(self, prefix: str) -> str:
        return "".join(
            f'<motor name="{prefix}{side}" tendon="{prefix}{side}" ctrllimited="true"'
            f' ctrlrange="{number(-self.force)} 0"/>\n'
            for side in ("in", "out")
        )
