"""Free bodies on the ground, most with their own floor: crawlers, worms, snakes and stars."""

from __future__ import annotations

import math

import numpy as np
from benchmarks.validator.corpus.writers.written import Written, number, numbers

_FLOOR = '<geom name="floor" type="plane" size="5 5 0.1" friction="1 0.005 0.0001" rgba="0.7 0.7 0.7 1"/>'


def write_ground_robot(rng: np.random.Generator) -> Written:
    """Write one of four kinds of crawling body."""
    kind = str(rng.choice(["crawler", "worm", "snake", "star"]))
    size = rng.uniform(0.6, 1.8)
    floor = _FLOOR if rng.random() < 0.7 else ""
    if kind == "worm":
        return _worm(rng, size, floor)
    if kind == "snake":
        return _snake(rng, size, floor)
    return _legged(rng, size, floor, flat=kind == "star")


def _document(name: str, floor: str, robot: str, tendons: str, actuators: str, sensors: str, compiler: str = "") -> str:
    return f"""<mujoco model="{name}">
  {compiler}
  <option timestep="0.002" integrator="implicitfast"/>
  <default><geom solref="0.004 1" friction="0.9"/><joint solreflimit="0.004 1"/></default>
  <worldbody>
    {floor}
{robot}  </worldbody>
  <tendon>
{tendons}  </tendon>
  <actuator>
{actuators}  </actuator>
  <sensor>
{sensors}  </sensor>
</mujoco>
"""


def _legged(rng: np.random.Generator, size: float, floor: str, *, flat: bool) -> Written:
    """Write legs of hinges around a hub: a star flat on the ground, or a crawler that stands on bent legs."""
    legs = int(rng.choice([5, 6])) if flat else int(rng.choice([4, 6]))
    links, pitch, radius = int(rng.integers(4, 7)), 0.02 * size, 0.006 * size
    slope = 0.0 if flat else math.radians(rng.uniform(20, 40))
    mass = 0.008 * size**3
    total = legs * links * mass + 0.1 * size**3
    length = links * pitch
    # each leg carries its share of the robot's weight at its far end and bends by at most about a tenth of a radian
    stiffness = 9.81 * total / legs * length * (12 if flat else 30) / links
    damping = 0.04 * math.sqrt(size) * stiffness
    pull = 1.6 * stiffness / (0.8 * radius * links) * (1.6 if flat else 0.5)
    hub = 0.03 * size
    height = radius * 1.3 if flat else length * math.sin(slope) + radius + 0.002 * size
    robot = tendons = actuators = sensors = ""
    for leg in range(legs):
        yaw = 2 * math.pi * (leg + 0.5) / legs
        name = f"leg{leg}"
        text = ""
        for link in reversed(range(links)):
            place = (
                f'pos="{number(pitch)} 0 0"'
                if link
                else (
                    f'pos="{numbers((hub * math.cos(yaw), hub * math.sin(yaw), 0))}"'
                    f' xyaxes="{numbers(_leg_axes(yaw, slope))}"'
                )
            )
            text = f"""<body name="{name}_{link}" {place}>
<joint name="{name}_j{link}" type="hinge" axis="0 1 0" range="-50 50" stiffness="{number(stiffness)}"
 damping="{number(damping)}" armature="1e-6"/>
<geom type="capsule" fromto="{number(0.15 * pitch)} 0 0 {number(0.85 * pitch)} 0 0" size="{number(radius)}"
 mass="{number(mass)}"/>
<site name="{name}_up{link}" pos="{numbers((pitch / 2, 0, 0.8 * radius))}"/>
<site name="{name}_down{link}" pos="{numbers((pitch / 2, 0, -0.8 * radius))}"/>
{text}</body>
"""
        c, s = math.cos(yaw), math.sin(yaw)
        inner = 0.8 * hub
        robot += (
            "".join(
                f'<site name="{name}_{side}" pos="{numbers((inner * c, inner * s, sign * 0.8 * radius))}"/>'
                for side, sign in (("hub_up", 1), ("hub_down", -1))
            )
            + "\n"
            + text
        )
        for side in ("up", "down"):
            route = [f"{name}_hub_{side}", *(f"{name}_{side}{link}" for link in range(links))]
            tendons += (
                f'<spatial name="{name}_{side}">' + "".join(f'<site site="{r}"/>' for r in route) + "</spatial>\n"
            )
            actuators += (
                f'<motor name="{name}_{side}" tendon="{name}_{side}" gear="-1" ctrlrange="0 {number(pull)}"/>\n'
            )
        sensors += f'<tendonpos tendon="{name}_down"/>\n'
    body = (
        f'<body name="hub" pos="0 0 {number(height)}"><freejoint/>\n'
        f'<geom name="hub" type="cylinder" size="{numbers((0.75 * hub, radius))}" mass="{number(0.1 * size**3)}"/>\n'
        f"{robot}</body>\n"
    )
    sensors += '<framepos objtype="body" objname="hub"/><velocimeter site="leg0_hub_up"/>\n'
    family = "star" if flat else "crawler"
    return Written(family, _document(family, floor, body, tendons, actuators, sensors))


def _leg_axes(yaw: float, slope: float) -> tuple[float, ...]:
    """Return the axes of a leg's frame: x outwards and down along the leg, y horizontal."""
    c, s = math.cos(yaw), math.sin(yaw)
    return (c * math.cos(slope), s * math.cos(slope), -math.sin(slope), -s, c, 0.0)


def _worm(rng: np.random.Generator, size: float, floor: str) -> Written:
    """Write a row of ball joints, with three cables along the front half and three along the rear half."""
    count, pitch, radius = int(rng.integers(6, 10)), 0.04 * size, 0.014 * size
    mass = 0.03 * size**3
    stiffness = 9.81 * mass * count * pitch * rng.uniform(1.5, 3)
    damping = 0.06 * math.sqrt(size) * stiffness
    force = 0.25 * stiffness / (0.8 * radius)
    sides = {"left": (0.7, -0.4), "right": (-0.7, -0.4), "top": (0.0, 0.8)}
    text = ""
    for index in reversed(range(count)):
        joint = (
            f'<joint name="ball{index}" type="ball" stiffness="{number(stiffness)}" damping="{number(damping)}"'
            f' range="0 40"/>'
            if index
            else '<freejoint name="free"/>'
        )
        sites = "".join(
            f'<site name="{side}{index}" pos="{numbers((pitch / 2, y * radius, z * radius))}"/>'
            for side, (y, z) in sides.items()
        )
        place = f"{number(pitch)} 0 0" if index else f"0 0 {number(radius)}"
        text = (
            f'<body name="seg{index}" pos="{place}">{joint}\n'
            f'<geom type="capsule" fromto="{number(0.3 * pitch)} 0 0 {number(0.7 * pitch)} 0 0"'
            f' size="{number(radius)}" mass="{number(mass)}"/>\n{sites}\n{text}</body>\n'
        )
    halves = {"rear": range(count // 2 + 1), "front": range(count // 2, count)}
    tendons = actuators = sensors = ""
    for half, indices in halves.items():
        for side in sides:
            route = "".join(f'<site site="{side}{i}"/>' for i in indices)
            tendons += f'<spatial name="{side}_{half}">{route}</spatial>\n'
            actuators += (
                f'<motor name="m_{side}_{half}" tendon="{side}_{half}" gear="-{number(force)}" ctrlrange="0 1"/>\n'
            )
            sensors += f'<tendonpos tendon="{side}_{half}"/>\n'
    sensors += f'<framepos objtype="xbody" objname="seg{count - 1}"/>\n'
    return Written("worm", _document("worm", floor, text, tendons, actuators, sensors))


def _snake(rng: np.random.Generator, size: float, floor: str) -> Written:
    """Write a row of hinges that turn about the vertical, with a cable on each side of each third of the body."""
    count, pitch, radius = int(rng.choice([9, 12])), 0.03 * size, 0.012 * size
    mass = 0.02 * size**3
    stiffness = 9.81 * mass * count * pitch * rng.uniform(0.8, 1.6)
    damping = 0.06 * math.sqrt(size) * stiffness
    third = count // 3
    kp = 8.0 * stiffness / (0.8 * radius) ** 2 / third
    rest = third * pitch
    stroke = 0.45 * 0.8 * radius * third
    text = ""
    for index in reversed(range(count)):
        joint = (
            f'<joint name="yaw{index}" axis="0 0 1" stiffness="{number(stiffness)}" damping="{number(damping)}"'
            f' range="-0.7 0.7"/>'
            if index
            else '<joint type="free"/>'
        )
        sites = "".join(
            f'<site name="{side}{index}" pos="{numbers((pitch / 2, sign * 0.8 * radius, 0))}"/>'
            for side, sign in (("l", 1), ("r", -1))
        )
        place = f"{number(pitch)} 0 0" if index else f"0 0 {number(radius)}"
        text = (
            f'<body name="piece{index}" pos="{place}">{joint}\n'
            f'<geom type="box" size="{numbers((0.44 * pitch, radius, radius))}" pos="{number(pitch / 2)} 0 0"'
            f' mass="{number(mass)}"/>\n{sites}\n{text}</body>\n'
        )
    tendons = actuators = sensors = ""
    for part in range(3):
        indices = range(part * third, min(count, (part + 1) * third + 1))
        length = rest if len(indices) > third else rest - pitch
        for side in "lr":
            name = f"{side}_third{part}"
            tendons += f'<spatial name="{name}">' + "".join(f'<site site="{side}{i}"/>' for i in indices)
            tendons += "</spatial>\n"
            actuators += (
                f'<position name="{name}" tendon="{name}" kp="{number(kp)}" kv="{number(0.05 * kp)}"'
                f' ctrlrange="{numbers((length - stroke, length + stroke))}" forcerange="-1000 0"/>\n'
            )
            sensors += f'<tendonpos tendon="{name}"/>\n'
    sensors += f'<framepos objtype="body" objname="piece{count - 1}"/>\n'
    compiler = '<compiler angle="radian"/>'
    return Written("snake", _document("snake", floor, text, tendons, actuators, sensors, compiler))
