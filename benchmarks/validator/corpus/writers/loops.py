"""Closed rings: a chain whose end is connected to its beginning."""

from __future__ import annotations

import math

import numpy as np
from benchmarks.validator.corpus.writers.written import Written, number, numbers


def write_loop(rng: np.random.Generator) -> Written:
    """Write a ring that stands free on the ground, or a hoop held at its top."""
    count = int(rng.choice([10, 12, 14]))
    radius = rng.uniform(0.06, 0.2)
    thick = radius / rng.uniform(9, 12)
    pitch = 2 * radius * math.sin(math.pi / count)
    free = bool(rng.random() < 0.7)
    mass = 700 * math.pi * thick**2 * pitch
    stiffness = 9.81 * mass * count * radius * rng.uniform(1.0, 2.0)
    damping = 0.04 * math.sqrt(radius / 0.1) * stiffness
    force = 0.3 * stiffness / radius * count / 4
    turn = 2 * math.pi / count
    text = ""
    for index in reversed(range(count)):
        joint = f'<joint name="bend{index}" type="hinge" axis="0 1 0" stiffness="{number(stiffness)}"'
        joint += f' damping="{number(damping)}" range="-0.9 0.9"/>'
        if index:
            place = f'pos="{number(pitch)} 0 0" quat="{numbers((math.cos(turn / 2), 0, -math.sin(turn / 2), 0))}"'
        else:
            # the first link is horizontal: at the bottom of a free ring, or at the top of a hanging one
            start = (-pitch / 2, 0.0, thick + 0.001)
            place = f'pos="{numbers(start)}"' if free else f'pos="{number(pitch / 2)} 0 0.5" euler="0 {math.pi:.6g} 0"'
            joint = "<freejoint/>" if free else ""
        text = f"""<body name="link{index}" {place}>
{joint}
<geom type="capsule" size="{number(thick)}" fromto="{number(1.1 * thick)} 0 0 {number(pitch - 1.1 * thick)} 0 0"
 mass="{number(mass)}" solref="0.004 1"/>
<site name="inner{index}" pos="{numbers((pitch / 2, 0, 0.8 * thick))}"/>
{text}</body>
"""
    chords = [(k, (k + count // 2) % count) for k in range(0, count // 2, 2)]
    tendons = "".join(
        f'<spatial name="chord{k}"><site site="inner{a}"/><site site="inner{b}"/></spatial>\n'
        for k, (a, b) in enumerate(chords)
    )
    motors = "".join(
        f'<motor name="pull{k}" tendon="chord{k}" ctrllimited="true" ctrlrange="0 1" gear="{number(-force)}"/>\n'
        for k in range(len(chords))
    )
    sensors = "".join(f'<tendonpos tendon="chord{k}"/>\n' for k in range(len(chords)))
    mjcf = f"""<mujoco model="ring">
<compiler angle="radian"/>
<option timestep="0.002" integrator="implicitfast"/>
<worldbody>
{'<geom type="plane" size="0 0 1"/>' if free else ""}
{text}</worldbody>
<equality><connect body1="link{count - 1}" body2="link0" anchor="{number(pitch)} 0 0" solref="0.004 1"/></equality>
<tendon>
{tendons}</tendon>
<actuator>
{motors}</actuator>
<sensor>
{sensors}<framepos objtype="body" objname="link{count // 2}"/>
</sensor>
</mujoco>
"""
    return Written("ring" if free else "hoop", mjcf)
