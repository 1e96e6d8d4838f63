"""A human engineer's style: <frame>, quaternions, ellipsoids, limbs oblique to the axes, commands from 0 to 1."""

from __future__ import annotations

import math

import numpy as np
from benchmarks.validator.corpus.physique import Physique, draw_physique
from benchmarks.validator.corpus.writers.written import Written, around, number, numbers


def write_frame_robot(rng: np.random.Generator) -> Written:
    """Write a slanted arm, a fish tail without gravity, or a pair of feelers."""
    kind = str(rng.choice(["slanted arm", "tail", "feelers"]))
    segments = (5, 9) if kind == "feelers" else (7, 20)
    limb = draw_physique(
        rng, length_m=(0.1, 0.8), segments=segments, sag=(0.2, 0.6), slenderness=(9, 22), bend_rad=(0.9, 2.4)
    )
    planar = kind == "tail"
    limbs = 2 if kind == "feelers" else 1
    gravity = "0 0 0" if planar else "0 0 -9.81"
    bodies = tendons = actuators = sensors = ""
    for index in range(limbs):
        tilt = rng.uniform(0.2, 2.6)
        side = 1 if index else -1
        quat = (math.cos(tilt / 2), 0.0, side * math.sin(tilt / 2), 0.0)
        bodies += _limb(limb, f"L{index}", (3 * side * limb.radius_m if limbs > 1 else 0.0, 0, 0), quat, planar=planar)
        directions = 2 if planar else 3
        for cable, _ in enumerate(_holes(limb, planar=planar)):
            route = "".join(f'<site site="L{index}.{k}.{cable}"/>' for k in range(limb.segments + 1))
            tendons += f'<spatial name="L{index}.cable{cable}" damping="0.01">{route}</spatial>\n'
        force = limb.force_n(0.75 * limb.radius_m)
        actuators += "".join(
            f'<general name="L{index}.spool{cable}" tendon="L{index}.cable{cable}" ctrlrange="0 1" dyntype="filter"'
            f' dynprm="0.08" gaintype="fixed" gainprm="{number(-force)}"/>\n'
            for cable in range(directions)
        )
        sensors += (
            f'<framepos objtype="site" objname="L{index}.end"/><framezaxis objtype="site" objname="L{index}.end"/>'
        )
        sensors += "".join(f'<actuatorpos actuator="L{index}.spool{cable}"/>' for cable in range(directions))
    mjcf = f"""<mujoco model="{kind}">
<compiler autolimits="true" angle="degree"/>
<option timestep="0.0015" integrator="implicit" gravity="{gravity}"/>
<statistic extent="1"/>
<default>
  <default class="flesh">
    <geom type="ellipsoid" solref="0.005 1" condim="3"/>
    <joint stiffness="{number(limb.stiffness_n_m_rad)}" damping="{number(limb.damping_n_m_s_rad)}" range="-40 40"
      solreflimit="0.005 1"/>
  </default>
</default>
<worldbody>
<frame pos="0.2 -0.1 0.8" euler="0 0 30">
<body name="root">
<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
<geom type="sphere" size="{number(limb.radius_m)}" contype="0" conaffinity="0"/>
{bodies}</body>
</frame>
</worldbody>
<tendon>
{tendons}</tendon>
<actuator>
{actuators}</actuator>
<sensor>{sensors}</sensor>
</mujoco>
"""
    return Written(kind, mjcf)


def _holes(limb: Physique, *, planar: bool) -> list[tuple[float, float]]:
    offset = 0.75 * limb.radius_m
    return [(offset, 0.0), (-offset, 0.0)] if planar else around(3, offset, first_rad=0.4)


def _limb(
    limb: Physique,
    name: str,
    start: tuple[float, float, float],
    quat: tuple[float, float, float, float],
    *,
    planar: bool,
) -> str:
    pitch, text = limb.pitch_m, ""
    mass = number(limb.mass_kg / limb.segments)
    axes = {"b": "0 1 0"} if planar else {"a": "1 0 0", "b": "0 1 0"}
    for index in reversed(range(limb.segments)):
        joints = "".join(f'<joint name="{name}.{index}{a}" axis="{axis}"/>' for a, axis in axes.items())
        sites = "".join(
            f'<site name="{name}.{index + 1}.{cable}" pos="{numbers((x, y, pitch / 2))}"/>'
            for cable, (x, y) in enumerate(_holes(limb, planar=planar))
        )
        end = f'<site name="{name}.end" pos="0 0 {number(pitch)}"/>' if not text else ""
        shape = (limb.radius_m, limb.radius_m, 0.49 * pitch)
        place = f'pos="0 0 {number(pitch)}"' if index else 'pos="0 0 0" childclass="flesh"'
        text = (
            f'<body name="{name}.{index}" {place}>{joints}\n'
            f'<geom size="{numbers(shape)}" pos="0 0 {number(pitch / 2)}" mass="{mass}"/>'
            f"\n{sites}{end}\n{text}</body>\n"
        )
    anchors = "".join(
        f'<site name="{name}.0.{cable}" pos="{numbers((x, y, -pitch / 2))}"/>'
        for cable, (x, y) in enumerate(_holes(limb, planar=planar))
    )
    return f'<frame pos="{numbers(start)}" quat="{numbers(quat)}">\n{anchors}\n{text}</frame>\n'
