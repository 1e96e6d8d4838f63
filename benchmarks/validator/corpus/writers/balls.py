"""Ball joints, default classes, radians, and position servos that command the length of tendons."""

from __future__ import annotations

import math

import numpy as np
from benchmarks.validator.corpus.physique import Physique, draw_physique
from benchmarks.validator.corpus.writers.written import Written, around, number, numbers


def write_ball_robot(rng: np.random.Generator) -> Written:
    """Write an arm on a wall or ceiling, or an octopus of several arms around a fixed head."""
    octopus = bool(rng.random() < 0.35)
    if octopus:
        limb = draw_physique(rng, length_m=(0.15, 0.35), segments=(4, 6), sag=(0.2, 0.5))
        count = int(rng.choice([3, 4]))
    else:
        limb = draw_physique(rng, segments=(6, 14), sag=(0.3, 1.0))
        count = 1
    tendons_each = int(rng.choice([3, 4]))
    servo = bool(rng.random() < 0.6)
    down = bool(rng.random() < 0.5)
    offset = 0.9 * limb.radius_m
    bodies = tendons = actuators = sensors = excludes = ""
    for arm in range(count):
        heading = 2 * math.pi * arm / count
        turn, start = _mounting(heading, 2.2 * limb.radius_m, octopus=octopus, down=down)
        prefix = f"a{arm}/"
        anchors = "".join(
            f'<site name="{prefix}anchor{t}" class="hole" pos="{numbers((x, y, 0))}"/>'
            for t, (x, y) in enumerate(around(tendons_each, offset))
        )
        bodies += (
            f'<body name="{prefix}mount" pos="{numbers(start)}" quat="{numbers(turn)}">{anchors}\n'
            f"{_links(limb, prefix, tendons_each, offset)}</body>\n"
        )
        excludes += (
            f'<exclude body1="head" body2="{prefix}link0"/><exclude body1="{prefix}mount" body2="{prefix}link0"/>'
        )
        tendons += _tendons(limb, prefix, tendons_each)
        actuators += _actuators(limb, prefix, tendons_each, offset, servo=servo)
        sensors += (
            f'<framepos objtype="site" objname="{prefix}end"/><framequat objtype="site" objname="{prefix}end"/>'
            + "".join(f'<tendonvel tendon="{prefix}cable{t}"/>' for t in range(tendons_each))
        )
    reach = max(0.6, 2.2 * limb.bend_rad / limb.segments)
    k, c = limb.stiffness_n_m_rad, limb.damping_n_m_s_rad
    mjcf = f"""<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.002" integrator="implicitfast" cone="elliptic"/>
  <default>
    <default class="limb">
      <joint type="ball" stiffness="{number(k)}" damping="{number(c)}" range="0 {number(reach)}" solreflimit="0.004 1"/>
      <geom type="capsule" size="{number(0.8 * limb.radius_m)}" solref="0.004 1" rgba="0.8 0.5 0.4 1"/>
    </default>
    <default class="hole"><site size="0.001" rgba="0 0 0 1"/></default>
  </default>
  <worldbody>
    <body name="head" pos="0 0 1">
      <geom name="head" type="sphere" size="{number(1.3 * limb.radius_m)}" contype="0" conaffinity="0"/>
{bodies}    </body>
  </worldbody>
  <contact>{excludes}</contact>
  <tendon>
{tendons}  </tendon>
  <actuator>
{actuators}  </actuator>
  <sensor>{sensors}</sensor>
</mujoco>
"""
    return Written("octopus" if octopus else "ball-jointed arm", mjcf)


def _mounting(
    heading: float, distance: float, *, octopus: bool, down: bool
) -> tuple[tuple[float, float, float, float], tuple[float, float, float]]:
    """Return the quaternion and the position of a limb's first frame; limbs grow along z."""
    if octopus:
        # tilted 60 deg from straight down, outwards
        tilt = math.pi - math.radians(60)
        half_c, half_s = math.cos(tilt / 2), math.sin(tilt / 2)
        axis = (-math.sin(heading), math.cos(heading), 0.0)
        place = (distance * math.cos(heading), distance * math.sin(heading), -distance / 2)
        return (half_c, half_s * axis[0], half_s * axis[1], 0.0), place
    return ((0.0, 1.0, 0.0, 0.0), (0.0, 0.0, -distance)) if down else ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, distance))


def _links(limb: Physique, prefix: str, tendons: int, offset: float) -> str:
    pitch, text = limb.pitch_m, ""
    inset = 0.12 * pitch
    for index in reversed(range(limb.segments)):
        holes = "".join(
            f'<site name="{prefix}{half}{index}_{t}" class="hole" pos="{numbers((x, y, height))}"/>'
            for half, height in (("low", 0.25 * pitch), ("high", 0.75 * pitch))
            for t, (x, y) in enumerate(around(tendons, offset))
        )
        end = f'<site name="{prefix}end" class="hole" pos="0 0 {number(pitch)}"/>' if not text else ""
        place = f'pos="0 0 {number(pitch)}"' if index else 'childclass="limb"'
        text = (
            f'<body name="{prefix}link{index}" {place}>\n<joint name="{prefix}ball{index}"/>'
            f'<geom fromto="0 0 {number(inset)} 0 0 {number(pitch - inset)}"'
            f' mass="{number(limb.mass_kg / limb.segments)}"/>\n{holes}{end}\n{text}</body>\n'
        )
    return text


def _tendons(limb: Physique, prefix: str, tendons: int) -> str:
    text = ""
    for t in range(tendons):
        route = [f"{prefix}anchor{t}"]
        route += [f"{prefix}{half}{index}_{t}" for index in range(limb.segments) for half in ("low", "high")]
        text += f'<spatial name="{prefix}cable{t}">' + "".join(f'<site site="{name}"/>' for name in route)
        text += "</spatial>\n"
    return text


def _actuators(limb: Physique, prefix: str, tendons: int, offset: float, *, servo: bool) -> str:
    """Return servos that only pull and can pay out more than the tendon needs, or motors with a negative gear."""
    force = limb.force_n(offset)
    if not servo:
        return "".join(
            f'<motor name="{prefix}pull{t}" tendon="{prefix}cable{t}" gear="-1" ctrlrange="0 {number(force)}"/>\n'
            for t in range(tendons)
        )
    rest = limb.length_m - 0.25 * limb.pitch_m
    stroke = 1.3 * offset * limb.bend_rad
    kp = 2.5 * force / stroke
    return "".join(
        f'<position name="{prefix}servo{t}" tendon="{prefix}cable{t}" kp="{number(kp)}" kv="{number(0.03 * kp)}"'
        f' ctrlrange="{numbers((rest - stroke, rest + stroke))}" forcerange="-{number(force)} 0"/>\n'
        for t in range(tendons)
    )
