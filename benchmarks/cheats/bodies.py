"""Bodies that win a task although they are not cable-driven soft robots, each with its exploit and its winning rule.

All are physically stable. `tail` is the decoration that made such a body pass as a continuum robot.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from benchmarks.cheats.parts import (
    Commands,
    FloatArray,
    MakeRule,
    Parts,
    Rule,
    chain,
    constant,
    idle,
    radial,
    tail,
    then,
)
from lxml import etree
from numpy.typing import NDArray

from aidsr.core.artifacts import Robot, Vec3
from aidsr.tasks import TASKS


@dataclass(frozen=True)
class Cheat:
    """A body, the task it is meant to win, and how it wins."""

    name: str
    exploits: str
    """What the body exploits, in words for the results page."""
    task: str
    """Name, without the category, of the task that the body is meant to win."""
    mjcf: str
    rule: MakeRule
    """Makes the rule that wins the task."""
    part: str = "root"
    """Name of the functional part."""
    offset_m: Vec3 = (0.0, 0.0, 0.0)
    """Position of the body in the mount's frame [m]."""
    edit: Callable[[etree._Element], None] | None = None
    """Changes the scene of the task, for a cheat that brings its own scene; None for all others."""

    only_own: bool = False
    """Whether it cheats only at that task, because elsewhere its scene, its start or its free joint is another."""
    held: bool = False
    """Whether the mount holds it at that task, although the task is for free robots."""

    @property
    def category(self) -> str:
        """Category of the task that the body is meant to win."""
        return next(name for name in TASKS if name.rpartition("/")[2] == self.task).partition("/")[0]

    @property
    def robot(self) -> Robot:
        """The body as a team would submit it."""
        return Robot(mjcf=self.mjcf, functional_part=self.part)


# --- on wheels ---

_WHEELS = 'type="cylinder" size="0.03 0.006" euler="90 0 0" density="600"'


def _cart(half_m: float, axles: tuple[float, ...], drive: Callable[[str], Parts], *, joint: str = "") -> Parts:
    """Return a left and a right wheel on each axle; `drive` returns the parts that drive a wheel of the given name."""
    parts = Parts()
    for number, x in enumerate(axles):
        for side, y in (("left", half_m), ("right", -half_m)):
            name = f"{side}_{number}"
            wheel = (
                f'<body name="wheel_{name}" pos="{x} {y} 0.03"><joint name="{name}" axis="0 1 0" damping="0.0005" '
                f'armature="1e-5" {joint}/><geom name="wheel_{name}" {_WHEELS}/></body>'
            )
            parts += Parts(bodies=wheel) + drive(name)
    return parts


_CHASSIS = '<geom name="chassis" type="box" size="0.05 0.025 0.008" pos="0 0 0.035"/>'


def _chassis(length_m: float = 0.05, half_m: float = 0.025) -> str:
    return f'<geom name="chassis" type="box" size="{length_m} {half_m} 0.008" pos="0 0 0.035"/>'


def _passive(name: str) -> Parts:
    del name
    return Parts()


def _motor(name: str) -> Parts:
    return Parts(
        actuators=f'<velocity name="{name}" joint="{name}" kv="0.02" ctrlrange="-10 10" forcerange="-0.1 0.1"/>'
    )


def _wheels(
    axles: tuple[float, ...], half_m: float = 0.035, length_m: float = 0.05, place: str = 'pos="0 0 0.043"'
) -> str:
    return (_cart(half_m, axles, _motor) + tail(place)).document(_chassis(length_m, half_m - 0.01))


def follow(speed: float = 0.6) -> Rule:
    """Return the rule of a cart in the tunnel: follow the tunnel's middle line, which turns half way."""

    def rule(time_s: float, seen: FloatArray) -> Commands:
        del time_s
        middle = np.tan(seen[:, 10]) * np.maximum(seen[:, 0] - 0.6, 0.0)
        turn = np.clip(
            6.0 * (seen[:, 1] - middle) + 3.0 * (seen[:, 4] - np.tan(seen[:, 10]) * (seen[:, 0] > 0.6) * 0.15),
            -0.4,
            0.4,
        )
        return {"left_*": speed + turn, "right_*": speed - turn}

    return rule


def steer(speed: float = 0.6, gain: float = 3.0) -> Rule:
    """Return the rule of a cart: turn the wheels faster on the side to which the cart has drifted."""

    def rule(time_s: float, seen: FloatArray) -> Commands:
        del time_s
        turn = np.clip(gain * (seen[:, 1] + seen[:, 4]), -0.4, 0.4)
        return {"left_*": speed + turn, "right_*": speed - turn}

    return rule


def _fixed_tendon(name: str) -> Parts:
    return Parts(
        tendons=f'<fixed name="belt_{name}"><joint joint="{name}" coef="1"/></fixed>',
        actuators=(
            f'<velocity name="{name}" tendon="belt_{name}" kv="0.02" ctrlrange="-10 10" forcerange="-0.1 0.1"/>'
        ),
    )


def _muscle(name: str) -> Parts:
    return Parts(
        tendons=f'<fixed name="belt_{name}"><joint joint="{name}" coef="1"/></fixed>',
        actuators=f'<motor name="{name}" tendon="belt_{name}" gear="1" ctrlrange="0 0.03"/>',
    )


def _crank_engine() -> str:
    """Three cables on the pin of a crank turn each rear wheel, as in a radial engine."""
    parts = _cart(0.04, (0.045,), _passive)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        y = sign * 0.04
        wheel = (
            f'<body name="wheel_{side}" pos="-0.045 {y} 0.03"><joint name="{side}" axis="0 1 0" damping="0.0008" '
            f'armature="1e-5"/><geom name="wheel_{side}" {_WHEELS}/>'
            f'<site name="pin_{side}" pos="0 {sign * 0.012} 0.012"/></body>'
        )
        anchors = tendons = actuators = sensors = ""
        for cable in range(3):
            angle = math.radians(120.0 * cable)
            x, z = -0.045 + 0.05 * math.cos(angle), 0.03 - 0.05 * math.sin(angle)
            anchors += f'<site name="anchor_{side}_{cable}" pos="{x:.5f} {y + sign * 0.012} {z:.5f}"/>'
            tendons += (
                f'<spatial name="{side}_{cable}"><site site="anchor_{side}_{cable}"/><site '
                f'site="pin_{side}"/></spatial>'
            )
            actuators += f'<motor name="{side}_{cable}" tendon="{side}_{cable}" gear="-1" ctrlrange="0 4"/>'
            sensors += f'<tendonpos name="{side}_{cable}_length" tendon="{side}_{cable}"/>'
        parts += Parts(bodies=anchors + wheel, tendons=tendons, actuators=actuators, sensors=sensors)
    return (parts + tail('pos="0 0 0.043"')).document(_chassis())


def crank(rad_s: float = 3.0) -> Rule:
    """Return the rule of a radial engine: the cables pull in turn, faster on the side that lags."""
    phase = {"left": 0.0, "right": 0.0}
    last = [0.0]

    def rule(time_s: float, seen: FloatArray) -> Commands:
        nonlocal phase
        turn = np.clip(3.0 * (seen[:, 1] + seen[:, 4]), -0.5, 0.5)
        step_s, last[0] = time_s - last[0], time_s
        commands = {}
        for side, sign in (("left", 1.0), ("right", -1.0)):
            phase[side] = phase[side] + step_s * rad_s * (1.0 + sign * turn)  # type: ignore[assignment]
            for cable in range(3):
                # the pin follows the pull; angles increase as the wheel turns forward
                commands[f"{side}_{cable}"] = 2.0 * np.maximum(np.cos(phase[side] - 2 * np.pi * cable / 3), 0.0) - 1.0
        return commands

    return rule


def _necks() -> str:
    """Crank engines whose wheels hang on short soft necks, so that wheels are joints of a soft chain."""
    parts = Parts()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for end, x in (("rear", -0.045), ("front", 0.045)):
            name, y = f"{side}_{end}", sign * 0.026
            driven = end == "rear"
            anchors = ""
            for cable in range(3 * driven):
                angle = math.radians(120.0 * cable)
                anchors += (
                    f'<site name="anchor_{side}_{cable}" pos="{0.05 * math.cos(angle):.5f} {sign * 0.022} '
                    f'{-0.05 * math.sin(angle):.5f}"/>'
                )
                parts += Parts(
                    tendons=f'<spatial name="{side}_{cable}"><site site="anchor_{side}_{cable}"/>'
                    f'<site site="pin_{side}"/></spatial>',
                    actuators=f'<motor name="{side}_{cable}" tendon="{side}_{cable}" gear="-1" ctrlrange="0 4"/>',
                    sensors=f'<tendonpos name="{side}_{cable}_length" tendon="{side}_{cable}"/>',
                )
            pin = f'<site name="pin_{side}" pos="0 {sign * 0.012} 0.012"/>' if driven else ""
            inner = (
                f'{anchors}<body name="wheel_{name}" pos="0 {sign * 0.01} 0"><joint name="{name}" axis="0 1 0" '
                f'damping="0.0008" armature="1e-5"/><geom name="wheel_{name}" {_WHEELS}/>{pin}</body>'
            )
            for link in reversed(range(3)):
                inner = (
                    f'<body name="neck_{name}_{link}" pos="{x if link == 0 else 0} '
                    f"{y if link == 0 else sign * 0.008} "
                    f'{0.03 if link == 0 else 0}"><joint name="neck_{name}_{link}" axis="1 0 0" range="-12 12" '
                    f'stiffness="6" damping="0.05" armature="1e-5" solreflimit="0.004 1"/>'
                    f'<geom name="neck_{name}_{link}" type="box" size="0.006 0.004 0.006" pos="0 {sign * 0.004} 0" '
                    f'density="1000"/>{inner}</body>'
                )
            parts += Parts(bodies=inner)
    return (parts + tail('pos="0 0 0.043"')).document(_CHASSIS)


def _weight_cart() -> str:
    """A falling weight drives the wheels through a gear, as in a clock."""

    def geared(name: str) -> Parts:
        return Parts(constraints=f'<joint joint1="{name}" joint2="drop" polycoef="0 -430 0 0 0" solref="0.01 1"/>')

    weight = (
        '<body name="weight" pos="0 0 0.15"><joint name="drop" type="slide" axis="0 0 1" range="-0.1 0" damping="60" '
        'solreflimit="0.004 1"/><geom name="weight" type="box" size="0.02 0.02 0.012" mass="0.5"/></body>'
        '<geom name="mast" type="box" size="0.004 0.004 0.06" pos="-0.03 0 0.1"/>'
    )
    parts = _cart(0.04, (-0.06, 0.06), geared) + Parts(bodies=weight) + tail('pos="0.07 0 0.035" euler="0 90 0"')
    return parts.document(_chassis(0.07))


def _limit_cart() -> str:
    """A slide joint that starts outside its range drives the wheels as its soft limit brings it there."""

    def geared(name: str) -> Parts:
        return Parts(constraints=f'<joint joint1="{name}" joint2="slide" polycoef="0 -1300 0 0 0" solref="0.01 1"/>')

    bolt = (
        '<body name="bolt" pos="0 0 0.05"><joint name="slide" type="slide" axis="1 0 0" range="-0.06 -0.04" '
        'armature="400" '
        'solreflimit="0.1 8"/><geom name="bolt" type="box" size="0.008 0.008 0.006"/></body>'
    )
    parts = _cart(0.04, (-0.06, 0.06), geared) + Parts(bodies=bolt) + tail('pos="0.07 0 0.035" euler="0 90 0"')
    return parts.document(_chassis(0.07))


def _spring_wheels(joint: str) -> str:
    return (_cart(0.04, (-0.05, 0.05), _passive, joint=joint) + tail('pos="0 0 0.043"')).document(_chassis())


def _whegs() -> str:
    """Six wheels of four spokes each."""
    parts = Parts()
    for number, x in enumerate((-0.09, 0.0, 0.09)):
        for side, y in (("left", 0.05), ("right", -0.05)):
            name = f"{side}_{number}"
            spokes = "".join(
                f'<geom name="spoke_{name}_{k}" type="capsule" size="0.006" fromto="0 0 0 {0.04 * math.cos(a):.5f} 0 '
                f'{0.04 * math.sin(a):.5f}"/>'
                for k, a in enumerate(math.radians(90.0 * k) for k in range(4))
            )
            body = (
                f'<body name="wheg_{name}" pos="{x} {y} 0.046"><joint name="{name}" axis="0 1 0" '
                f'damping="0.001" armature="1e-5"/>{spokes}</body>'
            )
            actuator = f'<velocity name="{name}" joint="{name}" kv="0.1" ctrlrange="-8 8" forcerange="-0.6 0.6"/>'
            parts += Parts(bodies=body, actuators=actuator)
    chassis = '<geom name="chassis" type="box" size="0.11 0.03 0.008" pos="0 0 0.05"/>'
    return (parts + tail('pos="0 0 0.058"')).document(chassis)


def _legs() -> str:
    """Four rigid legs with two motor joints each."""
    parts = Parts()
    for end, x in (("front", 0.06), ("rear", -0.06)):
        for side, y in (("left", 0.045), ("right", -0.045)):
            name = f"{end}_{side}"
            leg = (
                f'<body name="thigh_{name}" pos="{x} {y} 0.095"><joint name="hip_{name}" axis="0 1 0" range="-50 50" '
                f'damping="0.01" armature="1e-4" solreflimit="0.004 1"/><geom name="thigh_{name}" '
                f'type="capsule" size="0.007" '
                f'fromto="0 0 0 0 0 -0.04"/><body name="shin_{name}" pos="0 0 -0.045"><joint name="knee_{name}" '
                f'axis="0 1 0" range="-60 60" damping="0.01" armature="1e-4" solreflimit="0.004 1"/><geom '
                f'name="shin_{name}" '
                f'type="capsule" size="0.007" fromto="0 0 0 0 0 -0.042"/></body></body>'
            )
            actuators = "".join(
                f'<position name="{joint}_{name}" joint="{joint}_{name}" kp="3" kv="0.05" ctrlrange="-0.7 0.7" '
                f'forcerange="-1 1"/>'
                for joint in ("hip", "knee")
            )
            parts += Parts(bodies=leg, actuators=actuators)
    return (parts + tail('pos="0 0 0.115"')).document(
        '<geom name="trunk" type="box" size="0.08 0.035 0.012" pos="0 0 0.1"/>'
    )


def trot(hertz: float = 1.5) -> Rule:
    """Return the rule of a trot: hips swing, and knees lift the feet that move forward."""

    def rule(time_s: float, seen: FloatArray) -> Commands:
        turn = np.clip(3.0 * (seen[:, 1] + seen[:, 4]), -0.3, 0.3)
        commands: dict[str, FloatArray] = {}
        for name, phase in (("front_left", 0.0), ("rear_right", 0.0), ("front_right", np.pi), ("rear_left", np.pi)):
            angle = 2 * np.pi * hertz * time_s + phase
            size = 0.5 * (1.0 + (turn if "left" in name else -turn))
            commands[f"hip_{name}"] = size * np.sin(angle)
            commands[f"knee_{name}"] = 0.7 * max(np.cos(angle + np.pi), 0.0) * np.ones(len(seen))
        return commands

    return rule


def _jet() -> str:
    """A weightless puck with thrusters."""
    parts = Parts(
        actuators='<general name="thrust" site="nozzle" gear="1 0 0 0 0 0" ctrlrange="0 0.5"/>'
        '<general name="aside" site="nozzle" gear="0 1 0 0 0 0" ctrlrange="-0.5 0.5"/>',
    )
    root = (
        '<geom name="puck" type="cylinder" size="0.03 0.015" pos="0 0 0.016" mass="1"/><site name="nozzle" '
        'pos="0 0 0.016"/>'
    )
    body = (parts + tail('pos="0 0 0.031"')).document(root, attributes='gravcomp="1"')
    return body.replace("<body ", '<body gravcomp="1" ').replace(
        '<body gravcomp="1" name="root" gravcomp="1"', '<body name="root" gravcomp="1"'
    )


def fly(speed_m_s: float = 0.08) -> Rule:
    """Return the rule of a puck with thrusters: keep a forward speed [m/s] and stay in the middle of the lane."""

    def rule(time_s: float, seen: FloatArray) -> Commands:
        del time_s
        ahead, aside = 40.0 * (speed_m_s - seen[:, 3]), -20.0 * (seen[:, 1] + 2.0 * seen[:, 4])
        x, y = seen[:, 6], seen[:, 7]
        return {"thrust": np.clip(ahead * x - aside * y, -1, 1), "aside": np.clip(ahead * y + aside * x, -1, 1)}

    return rule


def _stacked_wheels() -> str:
    """Each wheel ends a stack of ten hinges about its axle, which turn as far as hinges may: 7.4 turns in all.

    The anchors zigzag, so that no two hinges are about exactly one line, and a fixed tendon over a stack pulls only.
    """
    parts, discs = Parts(), 10
    for number, x in enumerate((-0.05, 0.05)):
        for side, sign in (("left", 1.0), ("right", -1.0)):
            name = f"{side}_{number}"
            text = ""
            for disc in reversed(range(discs)):
                shape = (
                    _WHEELS if disc == discs - 1 else 'type="cylinder" size="0.006 0.0032" euler="90 0 0" density="600"'
                )
                at = f"0 {sign * 0.008:g} {0.0005 * (-1) ** disc:g}" if disc else f"{x} {sign * 0.02:g} 0.03"
                text = (
                    f'<body name="{name}_{disc}" pos="{at}"><joint name="{name}_{disc}" axis="0 1 0" range="-134 134" '
                    f'ref="-134" damping="0.002" armature="1e-6" solreflimit="0.004 1"/><geom {shape}/>{text}</body>'
                )
            joints = "".join(f'<joint joint="{name}_{disc}" coef="1"/>' for disc in range(discs))
            parts += Parts(
                bodies=text,
                tendons=f'<fixed name="{name}">{joints}</fixed>',
                actuators=f'<motor name="{name}" tendon="{name}" ctrlrange="0 0.3"/>',
                sensors=f'<tendonpos name="{name}_turn" tendon="{name}"/>',
            )
    return (parts + tail('pos="0 0 0.043"')).document(_chassis())


def _flywheel() -> str:
    """A closed drum; a motor inside turns an off-centre weight and pushes against the weight's inertia."""
    rim = '<geom name="drum" type="cylinder" size="0.05 0.04" pos="0 0 0.05" euler="90 0 0" mass="0.1"/>'
    rotor = (
        '<body name="rotor" pos="0 0 0.05"><joint name="spin" axis="0 1 0" damping="0.0005" armature="1e-5"/>'
        '<geom name="rotor" type="box" size="0.008 0.02 0.008" pos="0 0 -0.03" mass="0.6" contype="0" '
        'conaffinity="0"/></body>'
    )
    parts = Parts(
        bodies=rotor,
        actuators='<velocity name="spin" joint="spin" kv="0.05" ctrlrange="-10 10" forcerange="-0.12 0.12"/>',
    )
    return (parts + chain("tail", 'pos="0 0.041 0.05" euler="-90 0 0"', link_m=0.012, radius_m=0.004)).document(rim)


def _eccentric_hoop() -> str:
    """A hoop with one heavy side that starts at the top, so that the hoop rolls by itself."""
    hoop = '<geom name="hoop" type="cylinder" size="0.2 0.03" pos="0 0 0.2" euler="90 0 0" density="40"/>'
    weight = '<geom name="weight" type="sphere" size="0.02" pos="0.03 0 0.37" mass="0.8" contype="0" conaffinity="0"/>'
    return chain("tail", 'pos="0 0.031 0.2" euler="-90 0 0"', link_m=0.012, radius_m=0.004).document(hoop + weight)


def _piston_sled(kind: str) -> str:
    """Two blocks joined by a slide joint, on wheels with pawls that fold one way only. `kind`: "motor" or "cable"."""

    def block(name: str) -> str:
        text = f'<geom name="block_{name}" type="box" size="0.03 0.025 0.01" pos="0 0 0.035" density="500"/>'
        for side, y in (("left", 0.036), ("right", -0.036)):
            text += (
                f'<body name="wheel_{name}_{side}" pos="0 {y} 0.02"><joint name="wheel_{name}_{side}" axis="0 1 0" '
                f'damping="0.00002" armature="1e-6"/><geom name="wheel_{name}_{side}" type="cylinder" '
                f'size="0.02 0.005" '
                f'euler="90 0 0"/></body><body name="pawl_{name}_{side}" pos="-0.012 {y / 2} 0.025"><joint '
                f'name="pawl_{name}_{side}" axis="0 1 0" range="0 80" stiffness="0.0005" springref="-20" '
                f'damping="0.00005" '
                f'armature="1e-6" solreflimit="0.004 1"/><geom name="pawl_{name}_{side}" type="capsule" size="0.003" '
                f'fromto="0 0 0 -0.008 0 -0.0228"/></body>'
            )
        return text

    spring = 'stiffness="100"' if kind == "cable" else ""
    slider = (
        f'<body name="slider" pos="0.11 0 0"><joint name="stroke" type="slide" axis="1 0 0" range="-0.04 0.01" '
        f"{spring} "
        f'damping="4" solreflimit="0.004 1"/>{block("front")}<site name="pull_front" pos="-0.03 0 0.035"/></body>'
    )
    drive = Parts(
        actuators='<position name="pull" joint="stroke" kp="300" kv="5" ctrlrange="-0.04 0.01" forcerange="-20 20"/>'
    )
    if kind == "cable":
        drive = Parts(
            tendons='<spatial name="pull"><site site="pull_rear"/><site site="pull_front"/></spatial>',
            actuators='<motor name="pull" tendon="pull" gear="-1" ctrlrange="0 10"/>',
        )
    root = f'{block("rear")}<site name="pull_rear" pos="0.03 0 0.035"/>'
    return (drive + Parts(bodies=slider) + tail('pos="0 0 0.045"')).document(root)


def beat(hertz: float, pattern: str) -> Rule:
    """Return the rule that switches the actuators of a name pattern between the two ends of their range."""
    return lambda time_s, _seen: {pattern: 1.0 if (time_s * hertz) % 1.0 < 0.5 else -1.0}


def _riser() -> str:
    """A block that is placed at the goal, with a jack that lifts most of its weight."""
    jack = (
        '<body name="head" pos="0 0 0.03"><joint name="jack" type="slide" axis="0 0 1" range="0 0.12" damping="5" '
        'solreflimit="0.004 1"/><geom name="head" type="box" size="0.03 0.03 0.008" density="1500"/></body>'
    )
    parts = Parts(
        bodies=jack,
        actuators='<position name="jack" joint="jack" kp="300" kv="10" ctrlrange="0 0.12" forcerange="-40 40"/>',
    )
    return (parts + chain("tail", 'pos="-0.045 0 0.01" euler="0 -90 0"', link_m=0.015)).document(
        '<geom name="block" type="box" size="0.04 0.04 0.01" pos="0 0 0.01"/>'
    )


def _plain_worm() -> str:
    """A soft chain with cables that lies on the ground: only its start position is a cheat."""
    return chain("worm", 'pos="-0.06 0 0.012" euler="0 90 0"', links=6, radius_m=0.01).document(
        '<geom name="plate" type="box" size="0.012 0.012 0.01" pos="-0.075 0 0.012"/>'
    )


def _coil(ahead_m: float = 0.0, *, links: int = 10, stiffness: float = 0.03, pull_n: float = 5.0) -> str:
    """A soft chain on the ground that its cables coil up over the plate in front of it.

    `ahead_m` is how far the whole body is drawn ahead of its own origin [m].
    """
    front_m = ahead_m + 0.025 * links
    return chain(
        "worm",
        f'pos="{front_m} 0 0.013" euler="0 -90 0"',
        links=links,
        radius_m=0.009,
        stiffness=stiffness,
        pull_n=pull_n,
        damping=max(0.02, 0.1 * stiffness),
    ).document(f'<geom name="plate" type="box" size="0.01 0.05 0.009" pos="{front_m + 0.011} 0 0.013"/>')


COIL = constant({"worm_front": 1.0, "worm_back": -1.0})


def _inertial_worm(inertial: str = "", plate: str = "") -> str:
    """A soft worm on a plate with an <inertial> of its own, or further attributes of the plate."""
    worm = chain("worm", 'pos="0.03 0 0.009" euler="0 90 0"', links=6, link_m=0.03, radius_m=0.008, stiffness=0.15)
    return worm.document(f'{inertial}<geom name="plate" type="box" size="0.03 0.03 0.008" pos="0 0 0.009" {plate}/>')


# --- on a mount ---

_TAIL_UP = 'pos="0.03 0 0" euler="0 90 0"'
"""Pose of a tail that points sideways from the mount."""


def _jaws(
    drive: str,
    *,
    hinge_m: float = 0.12,
    end_m: float = 0.24,
    half_m: float = 0.062,
    free_m: float = 0.003,
    limb: Parts | None = None,
    spatial: bool = True,
) -> str:
    """Two rigid jaws, each on a hinge. `drive`: "motor", "cable", "fixed" (fixed tendon), "spring" or "coupled"."""
    parts = Parts()
    root = (
        f'<geom name="stem" type="cylinder" size="0.01 {hinge_m / 2}" pos="0 0 {hinge_m / 2}"/>'
        f'<geom name="palm" type="box" size="0.02 {half_m} 0.005" pos="0 0 {hinge_m}"/>'
    )
    for side, sign in (("left", 1.0), ("right", -1.0)):
        spring = 'stiffness="0.6" damping="0.02"' if drive == "cable" else 'damping="0.02"'
        if drive == "spring":
            spring = 'stiffness="3" springref="60" damping="20"'
        length = end_m - hinge_m
        root += f'<site name="pull_{side}" pos="0 {sign * 0.01:g} {hinge_m + 0.006:g}"/>'
        body = (
            f'<body name="jaw_{side}" pos="0 {sign * half_m:g} {hinge_m + 0.006:g}"><joint name="{side}" '
            f'axis="{sign:g} 0 0" '
            f'range="-10 24" armature="1e-4" solreflimit="0.004 1" {spring}/><geom name="jaw_{side}" type="box" '
            f'size="0.025 0.004 {(length - 0.003 - free_m) / 2:g}" pos="0 0 {(length - 0.003 + free_m) / 2:g}"/>'
            f'<site name="jaw_{side}" pos="0 {-sign * 0.005:g} {0.45 * length:g}"/></body>'
        )
        parts += Parts(bodies=body)
        if drive == "motor":
            parts += Parts(actuators=f'<motor name="{side}" joint="{side}" ctrlrange="-0.5 0.7"/>')
        if drive == "fixed":
            parts += Parts(
                tendons=f'<fixed name="belt_{side}"><joint joint="{side}" coef="1"/></fixed>',
                actuators=f'<motor name="{side}" tendon="belt_{side}" ctrlrange="-0.5 0.7"/>',
            )
        if drive == "cable":
            parts += Parts(
                tendons=f'<spatial name="{side}"><site site="pull_{side}"/><site site="jaw_{side}"/></spatial>'
                if spatial
                else "",
                actuators=f'<motor name="{side}" tendon="{side}" gear="-1" ctrlrange="0 25"/>',
            )
    root += f'<site name="grip" pos="0 0 {end_m - 0.02:g}"/>'
    return (parts + (limb or tail(_TAIL_UP))).document(root)


CLOSE = constant({"left": 1.0, "right": 1.0})
OPEN_CLOSE = then({"left": -1.0, "right": -1.0}, 1.3, {"left": 1.0, "right": 1.0})


def scoop(time_s: float, seen: FloatArray) -> Commands:
    """Open the jaws, close them around the ball, then raise the base."""
    del seen
    if time_s < 1.5:
        return {"left": -1.0, "right": -1.0}
    return {"left": 1.0, "right": 1.0, "base_z": 0.0 if time_s < 3.0 else 1.0}


# --- moved by the mount alone ---

_PIN_RADIUS_M = 0.06
"""Radius of the circle on which the crank's pin moves [m]."""


def _crank_rod() -> str:
    """Return a rigid rod along the mount's axis, with a tail behind it."""
    rod = '<geom name="rod" type="capsule" size="0.005" fromto="0 0 0.01 0 0 0.215"/>'
    end = '<site name="rod_end" pos="0 0 0.215"/>'
    return tail('pos="0 0 0.01" euler="180 0 0"').document(rod + end)


def circle() -> Rule:
    """Return the rule of a rod at the crank: move behind the pin, then push it around with the mount."""
    pushing: list[NDArray[np.bool_]] = []

    def rule(time_s: float, seen: FloatArray) -> Commands:
        del time_s
        angle, way = np.arctan2(seen[:, 4], seen[:, 3]), np.sign(seen[:, 6])
        pin_y, pin_z = -_PIN_RADIUS_M * np.sin(angle), _PIN_RADIUS_M * np.cos(angle)
        tip_y, tip_z = pin_y - seen[:, 1], pin_z - seen[:, 2]
        ahead = way * ((np.arctan2(-tip_y, tip_z) - angle + np.pi) % (2 * np.pi) - np.pi)
        behind = (ahead < -0.15) & (ahead > -0.9) & (np.hypot(tip_y, tip_z) > 0.045)
        pushing[:] = [behind | pushing[0] if pushing else behind]
        start = angle - 0.45 * way
        wanted_y = np.where(pushing[0], pin_y - 0.02 * way * np.cos(angle), -_PIN_RADIUS_M * np.sin(start))
        wanted_z = np.where(pushing[0], pin_z - 0.02 * way * np.sin(angle), _PIN_RADIUS_M * np.cos(start))
        return {
            "base_y": np.clip(20.0 * (wanted_y - tip_y), -1.0, 1.0),
            "base_z": np.clip(20.0 * (wanted_z - tip_z), -1.0, 1.0),
        }

    return rule


def _knuckles() -> str:
    """Fingers of five links that bend almost only in the first hinge: rigid jaws that look like soft fingers."""
    parts = Parts()
    root = (
        '<geom name="stem" type="cylinder" size="0.01 0.06" pos="0 0 0.06"/><geom name="palm" type="box" '
        'size="0.02 0.062 0.005" pos="0 0 0.12"/>'
    )
    for side, sign in (("left", 1.0), ("right", -1.0)):
        turn = 90.0 if sign > 0 else -90.0
        finger = chain(
            f"finger_{side}",
            f'pos="0 {sign * 0.062} 0.127" euler="0 0 {turn}"',
            links=5,
            link_m=0.024,
            radius_m=0.007,
            stiffness=(0.4, 60.0, 60.0, 60.0, 60.0),
            pull_n=30.0,
            sides=("back",),
            geom='density="900"',
            end=f'<geom name="pad_{side}" type="box" size="0.004 0.022 0.012" pos="-0.006 0 0.012" density="400"/>',
        )
        parts += finger
    return parts.document(root + '<site name="grip" pos="0 0 0.22"/>')


def _threaded_jaws() -> str:
    """Rigid jaws whose cables run along a heavy tail first, so that each cable also acts on a soft limb."""
    heavy = chain("tail", _TAIL_UP, radius_m=0.007, stiffness=0.4, geom='density="2700"')
    routes = {"left": "front", "right": "back"}
    tendons = "".join(
        f'<spatial name="{jaw}">'
        + "".join(f'<site site="tail_{side}_{link}"/>' for link in reversed(range(5)))
        + f'<site site="tail_{side}_base"/><site site="pull_{jaw}"/><site site="jaw_{jaw}"/></spatial>'
        for jaw, side in routes.items()
    )
    sensors = "".join(f'<tendonpos name="{jaw}_length" tendon="{jaw}"/>' for jaw in routes)
    plain = Parts(bodies=heavy.bodies, tendons=tendons, sensors=sensors)
    return _jaws("cable", limb=plain, spatial=False)


def _geared_jaws() -> str:
    """Rigid jaws without an actuator, each coupled to the first joint of a heavy cable limb that points away."""
    limbs = Parts()
    for side, turn in (("left", 90), ("right", -90)):
        name = f"decoy_{side}"
        place = f'pos="{turn / 3000:g} 0 0" euler="0 {turn} 0"'
        limbs += chain(name, place, links=6, radius_m=0.009, stiffness=0.5, pull_n=40.0, geom='density="2500"') + Parts(
            constraints=f'<joint joint1="{side}" joint2="{name}_0_0" polycoef="0 0.6 0 0 0" solref="0.004 1"/>'
        )
    return _jaws("coupled", limb=limbs)


_HINGE_M, _END_M, _HALF_M = 0.12, 0.24, 0.062
"""Heights of the hinges and of the ends of two jaws above the mount, and half the distance of the hinges [m]."""
_PALM = (
    f'<geom name="stem" type="cylinder" size="0.01 {_HINGE_M / 2}" pos="0 0 {_HINGE_M / 2}"/>'
    f'<geom name="palm" type="box" size="0.02 {_HALF_M} 0.005" pos="0 0 {_HINGE_M}"/>'
    f'<site name="grip" pos="0 0 {_END_M - 0.02:g}"/>'
)


def _jaws_on_limbs(how: str) -> str:
    """Two rigid jaws that the first links of soft limbs turn. The limbs point away and hold nothing.

    `how`: "part" for jaws that are part of these links, otherwise the kind of the equality, "connect" or "weld", that
    joins jaws on hinges of their own to them.
    """
    parts, at_m, long_m = Parts(), _HINGE_M + 0.012, _END_M - _HINGE_M - 0.016
    for side, sign in (("left", 1.0), ("right", -1.0)):
        name = f"limb_{side}"
        limb = chain(
            name,
            f'pos="0 {sign * _HALF_M:g} {at_m}" euler="{-sign * 90:g} 0 90"',
            radius_m=0.006 if how == "part" else 0.007,
            links=5 if how == "part" else 6,
            stiffness=0.4,
            pull_n=30.0,
            geom=f'density="{400 if how == "part" else 1500}"',
        )
        middle_m = long_m / 2 + 0.003
        if how == "part":
            jaw = (
                f'<geom name="jaw_{side}" type="box" size="{long_m / 2:g} 0.025 0.004" pos="{-sign * middle_m:g} 0 0"/>'
            )
            parts += replace(limb, bodies=limb.bodies.replace(f'<geom name="{name}_0"', f'{jaw}<geom name="{name}_0"'))
            continue
        jaw = (
            f'<body name="jaw_{side}" pos="0 {sign * _HALF_M:g} {at_m}"><joint name="{side}" axis="{sign:g} 0 0" '
            f'range="-10 24" armature="1e-4" damping="0.02" solreflimit="0.004 1"/><geom name="jaw_{side}" type="box" '
            f'size="0.025 0.004 {long_m / 2:g}" pos="0 0 {middle_m:g}"/></body>'
        )
        pin = f'anchor="0 {sign * 0.02:g} 0"' if how == "connect" else ""
        parts += limb + Parts(
            bodies=jaw,
            constraints=f'<{how} body1="jaw_{side}" body2="{name}_0" {pin} solref="0.004 1"/>',
            contacts=f'<exclude body1="jaw_{side}" body2="{name}_0"/>',
        )
    return parts.document(_PALM)


CLOSE_BY_LIMBS = then({}, 1.3, {"limb_left_back": 1.0, "limb_right_front": 1.0})


def _latched_jaws(
    spring: str,
    *,
    force_n: float = 5.0,
    stiffness: float = 200.0,
    jaw: str = "",
    density: float = 3500.0,
    bend: float = 0.5,
    pull_n: float = 30.0,
) -> str:
    """Rigid jaws that springs close. A bar at the end of a soft limb keeps them open until cables bend the limb away.

    `spring`: "tendon" for springs of tendons without an actuator, "curved" for springs of the hinges whose stiffness
    grows with the square of their deflection. `force_n` and `stiffness` are those of the tendons [N, N/m], `jaw`
    further attributes of the jaws after a space, and the rest density [kg/m^3], stiffness [N m/rad] and tension [N] of
    the limb.
    """
    parts, root, slippery = Parts(), _PALM, 'friction="0.1 0.001 0.0001"'
    at_m, long_m = _HINGE_M + 0.012, _END_M - _HINGE_M
    for side, sign in (("left", 1.0), ("right", -1.0)):
        root += f'<site name="pull_{side}" pos="0 {sign * 0.01:g} {at_m}"/>'
        wound = 'stiffness="0.001 0 0.35" springref="60"' if spring == "curved" else ""
        parts += Parts(
            bodies=(
                f'<body name="jaw_{side}" pos="0 {sign * _HALF_M:g} {at_m}"><joint name="{side}" axis="{sign:g} 0 0" '
                f'range="-10 24" armature="1e-4" damping="0.05" {wound} solreflimit="0.004 1"/>'
                f'<geom name="jaw_{side}" type="box" size="0.025 0.004 {(long_m - 0.016) / 2:g}" '
                f'pos="0 0 {(long_m - 0.01) / 2:g}" {slippery}{jaw}/>'
                f'<site name="jaw_{side}" pos="0 {-sign * 0.005:g} {0.45 * long_m:g}"/></body>'
            )
        )
        length_m = math.hypot(_HALF_M - 0.015, 0.45 * long_m)
        if spring == "tendon":
            parts += Parts(
                tendons=(
                    f'<spatial name="shut_{side}" stiffness="{stiffness}" damping="1" '
                    f'springlength="{length_m - force_n / stiffness:.5f}"><site site="pull_{side}"/>'
                    f'<site site="jaw_{side}"/></spatial>'
                )
            )
    up_m = _HINGE_M + 0.045
    root += '<geom name="beam" type="capsule" size="0.006" fromto="0 0 0.03 0.19 0 0.03"/>'
    root += f'<geom name="post" type="capsule" size="0.006" fromto="0.19 0 0.03 0.19 0 {up_m}"/>'
    limb = chain(
        "limb",
        f'pos="0.172 0 {up_m}" euler="0 -90 0"',
        links=6,
        radius_m=0.007,
        stiffness=bend,
        pull_n=pull_n,
        geom=f'density="{density:g}"',
        damping=0.03,
        end=f'<geom name="bar" type="box" size="0.006 {_HALF_M - 0.0055:g} 0.004" pos="0 0 0.025" {slippery}/>',
    )
    return (parts + limb).document(root)


RELEASE = then({}, 1.5, {"limb_back": 1.0})


def _heavy_spring_jaws() -> str:
    """Spring jaws beside a soft limb so heavy that the springs' energy is small relative to the robot's weight."""
    limb = chain(
        "tail", 'pos="0 0 -0.01" euler="180 0 0"', links=8, link_m=0.03, radius_m=0.014, stiffness=2.5, pull_n=40.0,
        geom='density="4000"',
    )  # fmt: skip
    return (
        _jaws("spring", limb=limb)
        .replace('stiffness="3" springref="60"', 'stiffness="2.2" springref="45"')
        .replace('damping="20"', 'damping="9"')
    )


def _margin_arm() -> str:
    """An arm too short for the button. The ball at its tip has a contact margin of 90 mm and presses from afar."""
    arm = chain(
        "arm",
        'pos="0 0 0.01"',
        links=8,
        radius_m=0.008,
        stiffness=0.25,
        pull_n=12.0,
        sides=("front", "back", "left", "right"),
        end='<geom name="ball" type="sphere" size="0.01" pos="0 0 0.028" margin="0.09"/>',
    )
    own = "".join(f'<exclude body1="arm_7" body2="{name}"/>' for name in ("root", *(f"arm_{k}" for k in range(6))))
    return (arm + Parts(contacts=own)).document('<geom name="plate" type="cylinder" size="0.02 0.004"/>')


def _adhesion(reach_m: float, travel_m: float) -> str:
    """A pad on a weak spring, with an adhesion actuator that makes it stick to what it touches."""
    pad = (
        f'<body name="pad" pos="0 0 {reach_m}"><joint name="give" type="slide" axis="0 0 1" range="{-travel_m} 0" '
        'stiffness="10" damping="1" solreflimit="0.004 1"/><geom name="pad" type="cylinder" size="0.025 0.004" '
        'margin="0.002"/></body>'
    )
    stem = reach_m - travel_m - 0.012
    parts = Parts(bodies=pad, actuators='<adhesion name="stick" body="pad" gain="15" ctrlrange="0 1"/>')
    return (parts + tail(_TAIL_UP)).document(
        f'<geom name="stem" type="cylinder" size="0.006 {stem / 2:g}" pos="0 0 {stem / 2:g}"/>'
    )


def _basket() -> str:
    """A rigid cup at the place where the ball arrives."""
    walls = '<geom name="bottom" type="cylinder" size="0.062 0.004" pos="0 0 0.07"/>'
    for k in range(12):
        a = math.radians(30.0 * k)
        walls += (
            f'<geom name="wall_{k}" type="box" size="0.004 0.018 0.032" pos="{0.064 * math.cos(a):.4f} '
            f'{0.064 * math.sin(a):.4f} 0.102" euler="0 0 {30 * k}"/>'
        )
    stem = '<geom name="stem" type="cylinder" size="0.01 0.03" pos="0 0 0.03"/>'
    return tail('pos="0.02 0 0.01" euler="0 90 0"').document(stem + walls + '<site name="cup" pos="0 0 0.12"/>')


def _petals() -> str:
    """A cup of passive petals with three hinges each, whose ends form a ring that keeps the ball from bouncing out."""
    parts = Parts()
    for k in range(8):
        a = 45.0 * k
        text = ""
        for link in reversed(range(3)):
            where = 'pos="0.02 0 0.07" euler="0 80 0"' if link == 0 else 'pos="0 0 0.031" euler="0 -34 0"'
            joint = (
                f'<joint name="petal_{k}_{link}" axis="0 1 0" range="-40 40" stiffness="0.4" damping="0.03" '
                'armature="1e-5" solreflimit="0.004 1"/>'
            )
            text = (
                f'<body name="petal_{k}_{link}" {where}>{joint}<geom name="petal_{k}_{link}" type="box" '
                f'size="0.003 {(0.007, 0.015, 0.02)[link]} 0.014" pos="0 0 0.016"/>{text}</body>'
            )
        parts += Parts(bodies=f'<body name="stalk_{k}" euler="0 0 {a}">{text}</body>')
    stem = '<geom name="stem" type="cylinder" size="0.02 0.034" pos="0 0 0.034"/><site name="cup" pos="0 0 0.12"/>'
    return (parts + tail('pos="0.02 0 0.01" euler="0 90 0"')).document(stem)


def _rod() -> str:
    """A straight rigid rod."""
    root = '<geom name="rod" type="capsule" size="0.008" fromto="0 0 0.01 0 0 0.27"/><site name="tip" pos="0 0 0.278"/>'
    return tail(_TAIL_UP).document(root)


def _rope() -> str:
    """A limp chain that hangs down: gravity bends it."""
    text = ""
    for link in reversed(range(14)):
        where = 'pos="0 0 0.02"' if link else 'pos="0 0 0.005"'
        joints = "".join(
            f'<joint name="rope_{link}_{k}" axis="{axis}" range="-60 60" damping="0.006" stiffness="0.004" '
            'armature="1e-6" solreflimit="0.004 1"/>'
            for k, axis in enumerate(("1 0 0", "0 1 0"))
        )
        end = '<site name="tip" pos="0 0 0.02"/>' if link == 13 else ""
        text = (
            f'<body name="rope_{link}" {where}>{joints}<geom name="rope_{link}" type="capsule" size="0.006" '
            f'fromto="0 0 0.004 0 0 0.016" density="3000"/>{end}{text}</body>'
        )
    return (Parts(bodies=text) + tail(_TAIL_UP)).document('<geom name="plate" type="cylinder" size="0.02 0.004"/>')


DOWN = constant({"feed": 1.0})


def _ghost_arm(beside: Parts | None = None) -> str:
    """An arm of which only a ball at its tip collides, and what is on its plate beside it."""
    arm = chain(
        "arm",
        'pos="0 0 0.01"',
        links=12,
        link_m=0.025,
        radius_m=0.008,
        stiffness=0.25,
        pull_n=4.5,
        geom='density="500" contype="0" conaffinity="0"',
        end='<geom name="ball" type="sphere" size="0.009" pos="0 0 0.028"/>',
    )
    both = arm + beside if beside else arm
    return both.document('<geom name="plate" type="cylinder" size="0.02 0.004" contype="0" conaffinity="0"/>')


def _stack() -> Parts:
    """A small limb of which each link has 15 shapes that collide, all in one place."""
    limb = chain("stack", 'pos="-0.02 0 0.006" euler="0 -90 0"', radius_m=0.004)
    shape = re.compile(r'<geom name="(stack_\d+)" ([^>]*)/>')
    bodies = shape.sub(lambda one: "".join(f'<geom name="{one[1]}_{k}" {one[2]}/>' for k in range(15)), limb.bodies)
    return replace(limb, bodies=bodies)


def _ghost_tip() -> str:
    """A short soft arm whose functional part is a point far below it."""
    arm = chain(
        "arm",
        'pos="0 0 0.01"',
        links=6,
        radius_m=0.008,
        stiffness=0.25,
        pull_n=12.0,
        sides=("front", "back", "left", "right"),
        end='<site name="far" pos="0 0 0.45"/>',
    )
    return arm.document('<geom name="plate" type="cylinder" size="0.02 0.004"/>')


def swing() -> Rule:
    """Return the rule that bends the arm towards the branch; the robot's y axis is the world's -y."""

    def rule(time_s: float, seen: FloatArray) -> Commands:
        pull = min(time_s / 10.0, 1.0)
        x, y = pull * seen[:, 6], -pull * seen[:, 7]
        ways = {"front": x, "back": -x, "left": y, "right": -y}
        return {f"*{side}": 2 * np.maximum(way, 0.0) - 1 for side, way in ways.items()}

    return rule


def lean() -> Rule:
    """Return the rule that bends the arm towards the side of the surface."""

    def rule(time_s: float, seen: FloatArray) -> Commands:
        pull = min(time_s / 12.0, 1.0)
        right = seen[:, 3] < 0.0  # the surface faces -x, so it stands at +x
        return {"*front": np.where(right, 2 * pull - 1, -1.0), "*back": np.where(right, -1.0, 2 * pull - 1)}

    return rule


def _fingers13(drive: str, *, ballast: bool = False) -> str:
    """Thirteen fingers spread over the half circle in which the button can be. `drive`: "cable" or "spring".

    With `ballast` they stand on a body of their own, the hub, beside a limb that is heavier than all of them.
    """
    parts = Parts()
    for k in range(13):
        angle = -radial(k, 13, 180.0, -90.0)  # the mount faces down: the robot's +y is the world's -y
        place = (
            f'pos="{0.06 * math.cos(math.radians(angle)):.5f} {0.06 * math.sin(math.radians(angle)):.5f} '
            f'0.01" euler="0 0 {angle:.3f}"'
        )
        if drive == "cable":
            parts += chain(
                f"finger_{k}",
                place,
                links=4,
                link_m=0.065,
                radius_m=0.005,
                stiffness=0.35,
                pull_n=14.0,
                sides=("front",),
            )
            continue
        body = (
            f'<body name="stalk_{k}" {place}><body name="finger_{k}"><joint name="finger_{k}" axis="0 1 0" '
            f'range="0 50" '
            'stiffness="0.35" springref="75" damping="0.25" armature="1e-5" solreflimit="0.004 1"/><geom '
            f'name="finger_{k}" type="capsule" size="0.006" fromto="0 0 0.012 0 0 0.265"/></body></body>'
        )
        parts += Parts(bodies=body)
    if drive == "spring":
        parts += tail('pos="-0.07 0 0" euler="0 -90 0"')
    plate = '<geom name="plate" type="cylinder" size="0.07 0.004"/><site name="hub" pos="0 0 0.26"/>'
    if not ballast:
        return parts.document(plate)
    hub = replace(parts, bodies=f'<body name="hub_plate">{plate}{parts.bodies}</body>')
    heavy = chain(
        "ballast",
        'pos="-0.075 0 0.01" euler="0 -90 0"',
        radius_m=0.012,
        stiffness=2.0,
        pull_n=40.0,
        geom='density="2500"',
    )
    return (hub + heavy).document('<geom name="block" type="box" size="0.006 0.01 0.004" pos="-0.07 0 0"/>')


def _pointer(drive: str, rest: float = 80.0) -> str:
    """A rigid rod on two motor hinges at one point or, with drive "cable", an arm that bends mostly in one joint.

    `rest` is the stiffness of the arm's other joints [N m/rad].
    """
    if drive == "cable":
        arm = chain(
            "arm",
            'pos="0 0 0.01"',
            links=6,
            link_m=0.05,
            radius_m=0.008,
            stiffness=(0.4, *5 * (rest,)),
            pull_n=40.0,
            sides=("front", "back", "left", "right"),
            geom='density="300"',
        )
        return arm.document('<geom name="plate" type="cylinder" size="0.03 0.004"/>')
    rod = (
        '<body name="rod" pos="0 0 0.01"><joint name="about_y" axis="0 1 0" range="-60 60" damping="0.05" '
        'armature="1e-4" '
        'solreflimit="0.004 1"/><joint name="about_x" axis="1 0 0" range="-60 60" damping="0.05" '
        'armature="1e-4" solreflimit="0.004 1"/>'
        '<geom name="rod" type="capsule" size="0.008" fromto="0 0 0.015 0 0 0.282"/><site name="tip" pos="0 0 '
        '0.29"/></body>'
    )
    servos = "".join(
        f'<position name="{name}" joint="{name}" kp="8" kv="0.3" ctrlrange="-1 1" forcerange="-2 2"/>'
        for name in ("about_y", "about_x")
    )
    return (Parts(bodies=rod, actuators=servos) + tail('pos="0.045 0 0" euler="0 90 0"')).document(
        '<geom name="plate" type="cylinder" size="0.03 0.004"/>'
    )


def _wound_pointer(attributes: str) -> str:
    """The arm that bends mostly in one joint, with actuators whose activation ends at 40 N."""
    general = f'gear="-1" gainprm="1" biastype="none" actlimited="true" actrange="0 40" {attributes}'
    return re.sub(
        r'<motor (name="arm_\w+" tendon="arm_\w+") gear="-1" ctrlrange="0 40.0"/>',
        rf"<general \1 {general}/>",
        _pointer("cable"),
    )


def _stiffened_pointer(attributes: str = "", *, tendon: str = "", gears: str = "") -> str:
    """An arm of six joints with equally stiff springs, of which something else holds all but the first.

    Args:
        attributes: Attributes of these joints in place of stiffness and damping; "" leaves them.
        tendon: Attributes of a fixed tendon over each of these joints; "" for no tendons.
        gears: Kind of the equality by which each of these joints turns by a twentieth of the first, "joint" or
            "tendon"; "" for none.
    """
    text, held = _pointer("cable", 0.4), [(link, axis) for link in range(1, 6) for axis in range(2)]
    if attributes:
        joint = r'(<joint name="arm_[1-5]_\d" [^>]*)stiffness="0.4" damping="0.02"'
        text = re.sub(joint, rf"\1{attributes}", text)
    belts = [*held, (0, 0), (0, 1)] if gears == "tendon" else held if tendon else []
    fixed = "".join(
        f'<fixed name="belt_{link}_{axis}" {tendon}><joint joint="arm_{link}_{axis}" coef="1"/></fixed>'
        for link, axis in belts
    )
    name = "belt" if gears == "tendon" else "arm"
    equal = "".join(
        f'<{gears} {gears}1="{name}_{link}_{axis}" {gears}2="{name}_0_{axis}" polycoef="0 0.05 0 0 0" '
        'solref="0.004 1"/>'
        for link, axis in held
        if gears
    )
    text = text.replace("</tendon>", f"{fixed}</tendon>")
    return text.replace("<actuator>", f"<equality>{equal}</equality><actuator>") if equal else text


def point(kind: str) -> Callable[[], Rule]:
    """Return the function that makes the rule for a pointer: turn towards the button and press on.

    The rule integrates the remaining distance. `kind`: "motor" or "cable".
    """

    def make() -> Rule:
        sums: list[FloatArray] = []

        def rule(time_s: float, seen: FloatArray) -> Commands:
            del time_s
            aim = seen[:, :2] + 0.02 * seen[:, 3:5]
            sums[:] = [np.clip((sums[0] if sums else 0.0) + 0.15 * aim, -1.0, 1.0)]
            x, y = sums[0][:, 0], sums[0][:, 1]
            if kind == "motor":
                return {"about_y": x, "about_x": y}
            pulls = {"*front": x, "*back": -x, "*left": -y, "*right": y}
            return {name: 2.0 * np.clip(pull, 0.0, 1.0) - 1.0 for name, pull in pulls.items()}

        return rule

    return make


def _hook() -> str:
    """A rigid hook for a mount with its own drives."""
    root = (
        '<geom name="rod" type="capsule" size="0.004" fromto="0 0 0 0 0 0.235"/>'
        '<geom name="finger" type="capsule" size="0.004" fromto="0 0 0.235 0.032 0 0.235"/><site name="tip" '
        'pos="0.02 0 0.235"/>'
    )
    return tail('pos="-0.03 0 0.0" euler="0 -90 0"').document(root)


def hook() -> Rule:
    """Return the rule of the hook: move over the bar, behind it, down, and pull back; push forward; leave upwards."""
    phase: list[list[str]] = []
    wanted: list[FloatArray] = []

    def one(row: FloatArray, state: str) -> tuple[str, float, float]:
        x, z, shut, opened = -row[0], -row[2], row[5] < 0, row[3]  # position of the tip relative to the handle
        if state == "leave":  # first up over the bar, then back
            if z < 0.034 and x > -0.03:
                return state, 0.0, 1.0
            return ("travel" if x < -0.045 else state), -1.0, 0.0
        if state == "travel":
            return ("over" if abs(z - 0.028) < 0.003 else state), 0.0, 20.0 * (0.028 - z)
        if state == "over":
            return ("down" if x > 0.016 else state), 15.0 * (0.019 - x), 20.0 * (0.028 - z)
        if state == "down":
            return ("hooked" if abs(z) < 0.004 else state), 20.0 * (0.018 - x), 20.0 * (0.0 - z)
        if shut:
            return state, 1.0 if opened > 0.1 else 0.3, 0.0
        return state, -1.0, 0.0

    def rule(time_s: float, seen: FloatArray) -> Commands:
        del time_s
        if not phase:
            phase.append(["travel"] * len(seen))
            wanted.append(seen[:, 2].copy())
        speeds = np.zeros((len(seen), 2))
        for k, row in enumerate(seen):
            if phase[0][k] == "hooked" and row[5] > 0 and abs(row[2] - wanted[0][k]) > 0.05:
                phase[0][k] = "rise"  # the target is now another drawer
            if phase[0][k] == "rise":
                moved = seen[k, 7] - started[k]
                speeds[k] = (0.0, 1.0) if moved < 0.027 else (-1.0, 0.0)
                if -row[0] < -0.045:
                    phase[0][k] = "travel"
            else:
                started[k] = seen[k, 7]
                phase[0][k], *speeds[k] = one(row, phase[0][k])
            wanted[0][k] = row[2]
        speeds = np.clip(speeds, -1, 1)
        return {"base_x": speeds[:, 0], "base_z": speeds[:, 1]}

    started: dict[int, float] = {}
    return rule


def _brush() -> str:
    """A pin that a soft spring presses against the wall with nearly the same force at every distance of the wall."""
    pin = (
        '<body name="pin" pos="0 0 0.205"><joint name="give" type="slide" axis="0 0 1" range="-0.01 0.075" '
        'stiffness="3.5" '
        'springref="0.24" damping="3" solreflimit="0.004 1"/><geom name="pin" type="capsule" size="0.006" '
        'fromto="0 0 -0.15 0 0 0.0"/></body>'
    )
    stem = '<geom name="stem" type="cylinder" size="0.009 0.02" pos="0 0 0.02"/>'
    return (Parts(bodies=pin) + tail('pos="-0.03 0 0" euler="0 -90 0"')).document(stem)


def sweep() -> Rule:
    """Return the rule of a brush on a moving mount: go to the target cell."""
    return lambda _time_s, seen: {
        "base_x": np.clip(20.0 * seen[:, 0], -0.6, 0.6),
        "base_z": np.clip(20.0 * seen[:, 2], -0.6, 0.6),
    }


def _tall_limb() -> str:
    """A limb of 1.6 m that stands on a small foot."""
    limb = chain(
        "limb",
        'pos="0 0 0.03"',
        links=10,
        link_m=0.16,
        radius_m=0.012,
        stiffness=90.0,
        pull_n=60.0,
        damping=4.5,
        geom='density="300"',
    )
    return limb.document('<geom name="foot" type="box" size="0.05 0.05 0.01" pos="0 0 0.01" density="800"/>')


def _plain_arm() -> str:
    """A soft arm with cables on a plate: only its scene is a cheat."""
    arm = chain("arm", 'pos="0 0 0.01"', links=6, link_m=0.02, radius_m=0.008, stiffness=0.3, pull_n=6.0)
    return arm.document('<geom name="plate" type="cylinder" size="0.02 0.004"/>')


def _force_field() -> str:
    """Cable-driven jaws with a contact margin: their contacts act 10 mm before they touch."""
    return (
        _jaws("cable", free_m=0.016)
        .replace('<geom name="jaw_left"', '<geom name="jaw_left" margin="0.01"')
        .replace('<geom name="jaw_right"', '<geom name="jaw_right" margin="0.01"')
    )


# --- changed scenes ---


def _section(root: etree._Element, tag: str) -> etree._Element:
    found = root.find(tag)
    return found if found is not None else etree.SubElement(root, tag)


def _tilted(root: etree._Element) -> None:
    _section(root, "option").set("gravity", "0.6 0 -9.8")


def _welded(root: etree._Element) -> None:
    weld = {"body1": "robot/root", "body2": "object", "solref": "0.05 1", "relpose": "0 0 0.215 0 1 0 0"}
    etree.SubElement(_section(root, "equality"), "weld", weld)


def _belted(root: etree._Element) -> None:
    belt = etree.SubElement(_section(root, "tendon"), "fixed", name="belt", damping="2")
    etree.SubElement(belt, "joint", joint="crank", coef="1")
    etree.SubElement(belt, "joint", joint="robot/arm_2_0", coef="-5")


def _geared(root: etree._Element) -> None:
    etree.SubElement(_section(root, "equality"), "joint", joint1="crank", joint2="robot/arm_2_0", polycoef="0 5 0 0 0")


def _sticky(root: etree._Element) -> None:
    """Add contact pairs with huge friction between the object and the robot."""
    contact = _section(root, "contact")
    for side in ("left", "right"):
        attributes = {"geom1": f"robot/jaw_{side}", "geom2": "object", "condim": "6", "friction": "50 50 5 5 5"}
        etree.SubElement(contact, "pair", attributes)


def _own_motor(root: etree._Element) -> None:
    """Add an actuator of the robot that lifts the object."""
    attributes = {"name": "robot/lift", "joint": "object_free", "gear": "0 0 1 0 0 0", "ctrlrange": "0 5"}
    etree.SubElement(_section(root, "actuator"), "motor", attributes)


def levitate() -> Rule:
    """Return the rule that lifts the object while the carriage rises."""

    def rule(time_s: float, seen: FloatArray) -> Commands:
        low = -0.215 - seen[:, 8]  # how far the object is below the place where a grip would hold it [m]
        lift_n = 0.3 + 10.0 * low + 1.0 * (0.1 * (3.0 < time_s < 4.5) - seen[:, 5])
        return {"lift": np.where(time_s > 3.0, np.clip(lift_n / 2.5 - 1.0, -1.0, 1.0), -1.0)}

    return rule


CHEATS: tuple[Cheat, ...] = (
    Cheat(
        "four_wheels",
        "Four motor wheels carry it; the tail with its two cables hangs idle on top.",
        "flat_ground",
        _wheels((-0.05, 0.05)),
        steer,
    ),
    Cheat(
        "six_wheels",
        "Three pairs of motor wheels: one of them may hang over the gap. The tail is idle.",
        "gap",
        _wheels((-0.09, 0.0, 0.09), length_m=0.1),
        steer,
    ),
    Cheat(
        "six_wheels_incline",
        "The same cart drives up the slope. The tail is idle.",
        "incline",
        _wheels((-0.09, 0.0, 0.09), length_m=0.1),
        steer,
    ),
    Cheat(
        "narrow_wheels",
        "A narrow cart on motor wheels that slides along the walls. The tail is idle.",
        "tunnel",
        _wheels((-0.032, 0.032), 0.028, 0.035, 'pos="-0.07 0 0.035" euler="0 -90 0"'),
        follow,
    ),
    Cheat(
        "spoked_wheels",
        "Six motor wheels of four spokes each step over edges. The tail is idle.",
        "stairs",
        _whegs(),
        lambda: steer(0.8),
    ),
    Cheat(
        "spoked_wheels_obstacles",
        "The same spoked motor wheels drive over what the task wants passed.",
        "obstacles",
        _whegs(),
        lambda: steer(0.8),
    ),
    Cheat(
        "belt_wheels",
        "A fixed tendon over the joint of one wheel is a motor with another name, and makes its actuator one "
        "that pulls on "
        "a tendon.",
        "flat_ground",
        (_cart(0.04, (-0.05, 0.05), _fixed_tendon) + tail('pos="0 0 0.043"')).document(_chassis()),
        steer,
    ),
    Cheat(
        "pull_only_wheels",
        "Fixed tendons again, with commands that only pull, as a muscle does: on a joint without limits that is "
        "a motor.",
        "flat_ground",
        (_cart(0.04, (-0.05, 0.05), _muscle) + tail('pos="0 0 0.043"')).document(_chassis()),
        lambda: steer(-0.6),
    ),
    Cheat(
        "stacked_wheels",
        "Each wheel ends a stack of ten hinges with ranges of 268 degrees, and a fixed tendon that only pulls turns "
        "all of them by the same angle: evenly bent joints in series, as in a limb.",
        "flat_ground",
        _stacked_wheels(),
        lambda: steer(-0.9, 1.0),
    ),
    Cheat(
        "crank_engine",
        "Three cables pull on a crank pin of each rear wheel in turn, as in a radial engine. All actuators are "
        "cables and "
        "the cables do the work; what they drive is rigid.",
        "flat_ground",
        _crank_engine(),
        crank,
    ),
    Cheat(
        "wheels_on_necks",
        "The crank engine again, each wheel at the end of a soft neck of three hinges: now the wheels belong to soft "
        "chains, and whoever locks those chains stops the wheels as well.",
        "flat_ground",
        _necks(),
        crank,
    ),
    Cheat(
        "weight_clock",
        "A falling weight drives the wheels through a joint equality, as in a clock. Energy stored in the "
        "initial pose does "
        "the work.",
        "flat_ground",
        _weight_cart(),
        lambda: idle,
    ),
    Cheat(
        "wound_wheels",
        "Wheels on wound-up springs: springref is hundreds of turns away, so a spring is a motor that needs no "
        "command.",
        "flat_ground",
        _spring_wheels('stiffness="0.00012" springref="20000"'),
        lambda: idle,
    ),
    Cheat(
        "limit_cart",
        "A slide joint that starts outside its range is geared to the wheels: its soft limit is a motor.",
        "flat_ground",
        _limit_cart(),
        lambda: idle,
    ),
    Cheat(
        "rigid_legs",
        "Four rigid legs with a servo in each hip and knee trot. The tail is idle.",
        "flat_ground",
        _legs(),
        trot,
    ),
    Cheat(
        "jet_puck",
        "A puck without weight (gravcomp) that two thrusters at a site push along. The tail is idle.",
        "flat_ground",
        _jet(),
        fly,
    ),
    Cheat(
        "jet_over_gap",
        "The weightless puck with thrusters does not need the ground at all.",
        "gap",
        _jet(),
        fly,
        offset_m=(0.0, 0.0, 0.03),
    ),
    Cheat(
        "flywheel_drum",
        "A closed drum with a motor and an off-centre weight inside rolls; nothing outside moves against it.",
        "flat_ground",
        _flywheel(),
        lambda: constant({"spin": -0.5}),
    ),
    Cheat(
        "heavy_hoop",
        "A hoop whose heavy side starts at the top rolls one turn by itself: energy stored in an unstable pose.",
        "gap",
        _eccentric_hoop(),
        lambda: idle,
    ),
    Cheat(
        "piston_sled",
        "A slide joint with a servo is a piston; passive pawls beside its wheels make its strokes a walk.",
        "flat_ground",
        _piston_sled("motor"),
        lambda: beat(1.0, "pull"),
    ),
    Cheat(
        "cable_piston_sled",
        "The same sled whose piston is pulled by a cable and pushed back by a spring: all actuators are cables, "
        "and no "
        "soft chain takes part.",
        "flat_ground",
        _piston_sled("cable"),
        lambda: beat(1.0, "pull"),
    ),
    Cheat(
        "starts_behind_the_gap",
        "A worm that its placement puts on the far side: it has crossed before it moves.",
        "gap",
        _plain_worm(),
        lambda: idle,
        offset_m=(1.4, 0.0, 0.0),
    ),
    Cheat(
        "starts_behind_the_tunnel",
        "A worm that its placement puts behind the far end of the tunnel.",
        "tunnel",
        _plain_worm(),
        lambda: idle,
        offset_m=(1.2, 0.0, 0.0),
    ),
    Cheat(
        "coils_behind_the_gap",
        "A soft chain that is placed with its tail over the gap and coils up: cables and a soft body do what is left.",
        "gap",
        _coil(),
        lambda: COIL,
        offset_m=(1.05, 0.0, 0.0),
    ),
    Cheat(
        "drawn_behind_the_gap",
        "The same chain placed where the task starts, and drawn a metre ahead of its own origin.",
        "gap",
        _coil(1.05),
        lambda: COIL,
    ),
    Cheat(
        "coils_behind_the_tunnel",
        "A soft chain that is placed at the far end of the tunnel and coils up.",
        "tunnel",
        _coil(),
        lambda: COIL,
        offset_m=(0.9, 0.0, 0.0),
    ),
    Cheat(
        "rears_up_on_the_stairs",
        "A soft chain that is placed on the last step and rears up: its centre of mass rises by what the stairs ask.",
        "stairs",
        _coil(links=20, stiffness=0.4, pull_n=12.0),
        lambda: COIL,
        offset_m=(0.82, 0.0, 0.075),
    ),
    Cheat(
        "gyro_worm",
        "A worm whose plate has the moment of inertia of a truck and the weight of a plate: it cannot pitch or roll, "
        "and slides over the gap without falling in.",
        "gap",
        _inertial_worm('<inertial pos="0 0 0.009" mass="0.05" diaginertia="100 100 0.001"/>'),
        lambda: COIL,
        only_own=True,
    ),
    Cheat(
        "keel_worm",
        "The same worm, its plate's mass 0.3 m below the plate, where nothing of the robot is: it cannot be tipped.",
        "obstacles",
        _inertial_worm('<inertial pos="0 0 -0.3" mass="0.05" diaginertia="1e-5 1e-5 1e-5"/>'),
        lambda: COIL,
        only_own=True,
    ),
    Cheat(
        "falling_limb",
        "A limb 1.6 m tall leans forward, falls over and lies past the first obstacle.",
        "obstacles",
        _tall_limb(),
        lambda: constant({"limb_front": 1.0, "limb_back": -1.0}),
        only_own=True,
    ),
    Cheat(
        "damped_worm",
        "The same worm, whose free joint is damped: it floats as in honey, and does not fall into the gap.",
        "gap",
        _inertial_worm().replace('<geom name="plate"', '<joint type="free" damping="5"/><geom name="plate"'),
        lambda: COIL,
        only_own=True,
    ),
    Cheat(
        "conveyor_worm",
        "The same worm, whose plate has a surface that runs backwards like a conveyor belt.",
        "flat_ground",
        _inertial_worm(plate='surfacevel="-0.1 0 0 0 0 0"'),
        lambda: idle,
    ),
    Cheat(
        "sticky_worm",
        "The same worm, whose plate sticks to the slope.",
        "incline",
        _inertial_worm(plate='adhesion="5"'),
        lambda: COIL,
    ),
    Cheat(
        "held_over_the_obstacles",
        "A robot that the mount holds in a task for free robots: it need not travel, only lean over the lane.",
        "obstacles",
        _plain_arm(),
        lambda: constant({"arm_front": 1.0}),
        held=True,
        only_own=True,
    ),
    Cheat(
        "riser_on_top",
        "A block placed on the last step that lifts most of its weight with a jack: it has climbed by what its "
        "centre of "
        "mass rises.",
        "stairs",
        _riser(),
        lambda: then({"jack": -1.0}, 1.0, {"jack": 1.0}),
        offset_m=(1.1, 0.0, 0.075),
    ),
    Cheat(
        "motor_jaws",
        "Two rigid jaws with a motor in the hinge of each. The tail is idle.",
        "simple_grasping",
        _jaws("motor"),
        lambda: OPEN_CLOSE,
        part="grip",
    ),
    Cheat(
        "motor_scoop",
        "The same jaws, longer, close around the ball in its bowl, and the mount raises them.",
        "ball_from_bowl",
        _jaws("motor", hinge_m=0.16, end_m=0.285),
        lambda: scoop,
        part="grip",
    ),
    Cheat(
        "rod_on_mount",
        "A rigid rod that the mount's own drives move in a circle turns the crank. The tail is idle.",
        "crank_turning",
        _crank_rod(),
        circle,
        part="rod_end",
    ),
    Cheat(
        "belt_jaws",
        "Rigid jaws, each on a fixed tendon over its one hinge: a motor with another name.",
        "simple_grasping",
        _jaws("fixed"),
        lambda: OPEN_CLOSE,
        part="grip",
    ),
    Cheat(
        "cable_jaws",
        "Rigid jaws, each pulled shut by a real cable. No soft chain takes part in the grip.",
        "simple_grasping",
        _jaws("cable"),
        lambda: then({}, 1.3, {"left": 1.0, "right": 1.0}),
        part="grip",
    ),
    Cheat(
        "knuckle_jaws",
        "Jaws of five links of which only the first hinge is soft and the others are 150 times stiffer: rigid jaws "
        "on cables that count as soft chains.",
        "simple_grasping",
        _knuckles(),
        lambda: then({}, 1.3, {"finger_*": 1.0}),
        part="grip",
    ),
    Cheat(
        "spring_jaws",
        "Jaws on preloaded springs and strong dampers that close while the carriage comes down, and need no command.",
        "simple_grasping",
        _jaws("spring"),
        lambda: idle,
        part="grip",
    ),
    Cheat(
        "threaded_jaws",
        "Rigid jaws whose cables run along a heavy soft tail before they reach the jaws, so that each acts on a soft "
        "limb and cables move most of the mass.",
        "simple_grasping",
        _threaded_jaws(),
        lambda: then({}, 1.3, {"left": 1.0, "right": 1.0}),
        part="grip",
    ),
    Cheat(
        "geared_jaws",
        "Rigid jaws that joint equalities gear to two heavy soft limbs: cables bend only these limbs, which point away "
        "and hold nothing.",
        "simple_grasping",
        _geared_jaws(),
        lambda: then({"*back": 0.0}, 1.3, {"*front": 1.0}),
        part="grip",
    ),
    Cheat(
        "heavy_spring_jaws",
        "Spring jaws beside a soft limb so heavy that the energy in the springs is little for the robot's weight.",
        "simple_grasping",
        _heavy_spring_jaws(),
        lambda: idle,
        part="grip",
    ),
    Cheat(
        "first_link_jaws",
        "Each jaw is part of the first link of a soft limb that points away: cables bend the limb evenly, and only its "
        "first hinge turns the jaw.",
        "simple_grasping",
        _jaws_on_limbs("part"),
        lambda: CLOSE_BY_LIMBS,
        part="grip",
    ),
    Cheat(
        "pinned_jaws",
        "Jaws on hinges of their own, each pinned by a connect constraint to the first link of a soft limb that points "
        "away.",
        "simple_grasping",
        _jaws_on_limbs("connect"),
        lambda: CLOSE_BY_LIMBS,
        part="grip",
    ),
    Cheat(
        "welded_jaws",
        "The same, welded.",
        "simple_grasping",
        _jaws_on_limbs("weld"),
        lambda: CLOSE_BY_LIMBS,
        part="grip",
    ),
    Cheat(
        "latched_jaws",
        "Rigid jaws that springs of tendons without an actuator close. A bar on a soft limb keeps them open until a "
        "cable bends it away: without the cable nothing is held, and the springs do the work.",
        "simple_grasping",
        _latched_jaws("tendon"),
        lambda: RELEASE,
        part="grip",
    ),
    Cheat(
        "curved_latched_jaws",
        "The same, with springs in the hinges whose stiffness is a polynomial: its constant term is nearly zero.",
        "simple_grasping",
        _latched_jaws("curved"),
        lambda: RELEASE,
        part="grip",
    ),
    Cheat(
        "weak_latched_jaws",
        "The same with heavy jaws and tendon springs so weak that they might only carry these jaws: enough for a light "
        "object.",
        "delicate_grasping",
        _latched_jaws(
            "tendon", force_n=2.0, stiffness=30.0, jaw=' density="2000"', density=9000.0, bend=1.0, pull_n=60.0
        ),
        lambda: RELEASE,
        part="grip",
    ),
    Cheat(
        "force_field",
        "Cable jaws whose contacts have a margin of 10 mm: they press without touching.",
        "simple_grasping",
        _force_field(),
        lambda: then({}, 1.3, {"left": 1.0, "right": 1.0}),
        part="grip",
    ),
    Cheat(
        "sticky_pad",
        "An adhesion actuator holds the object. The tail is idle.",
        "simple_grasping",
        _adhesion(0.21, 0.05),
        lambda: constant({"stick": 1.0}),
        part="pad",
    ),
    Cheat(
        "sticky_pad_in_space",
        "An adhesion actuator holds the ball where nothing has weight.",
        "zero_gravity_grasping",
        _adhesion(0.075, 0.05),
        lambda: constant({"stick": 1.0}),
        part="pad",
    ),
    Cheat(
        "gentle_jaws",
        "Rigid motor jaws with little torque: at a fragile object they need no softness, only a small command.",
        "delicate_grasping",
        _jaws("motor", half_m=0.045),
        lambda: then({"left": -1.0, "right": -1.0}, 1.3, {"left": -0.04, "right": -0.04}),
        part="grip",
    ),
    Cheat(
        "basket",
        "A rigid cup stands where the ball comes down. Nothing is driven.",
        "dynamic_catching",
        _basket(),
        lambda: idle,
        part="cup",
    ),
    Cheat(
        "passive_petals",
        "A cup of soft petals without a cable: the ball is caught by springs alone.",
        "dynamic_catching",
        _petals(),
        lambda: idle,
        part="cup",
    ),
    Cheat("rigid_rod", "A straight rigid rod goes down the pipe.", "pipe_inserting", _rod(), lambda: DOWN, part="tip"),
    Cheat(
        "limp_rope",
        "A limp chain hangs into the pipe: gravity bends it around the corner, and no cable does.",
        "pipe_inserting",
        _rope(),
        lambda: DOWN,
        part="tip",
    ),
    Cheat(
        "ghost_rope",
        "A limp chain that touches nothing goes through the walls of the pipe.",
        "pipe_inserting",
        _rope().replace('density="3000"', 'density="3000" contype="0" conaffinity="0"'),
        lambda: DOWN,
        part="tip",
    ),
    Cheat(
        "ghost_tip",
        "A short arm above the pipe whose functional part is a point far below it: a small bend swings it through "
        "the walls into the branch.",
        "pipe_inserting",
        _ghost_tip(),
        swing,
        part="far",
    ),
    Cheat(
        "ghost_arm",
        "An arm of which only a ball at the tip collides: what cannot touch does not count, so the ball is all "
        "of the body that has to lie on the surface.",
        "surface_adapting",
        _ghost_arm(),
        lean,
        part="arm_tip",
    ),
    Cheat(
        "stacked_ghost_arm",
        "The same arm beside a small limb whose links have 15 colliding shapes each, all in one place: of the length "
        "of all shapes, those that collide with nothing are a small part.",
        "surface_adapting",
        _ghost_arm(_stack()),
        lean,
        part="arm_tip",
    ),
    Cheat(
        "thirteen_fingers",
        "Thirteen fingers spread over all places where the button may be: pulling all of them always presses it.",
        "button_pushing",
        _fingers13("cable"),
        lambda: constant({"finger_*": 1.0}),
    ),
    Cheat(
        "thirteen_fingers_with_ballast",
        "The same fingers on a hub, the functional part, beside a limb that has over half of the moving mass. They "
        "wait for the signal.",
        "button_pushing",
        _fingers13("cable", ballast=True),
        lambda: then({"finger_*": -1.0}, 1.6, {"finger_*": 1.0}),
        part="hub",
        only_own=True,
    ),
    Cheat(
        "spring_umbrella",
        "Thirteen rigid ribs on preloaded springs open by themselves and press the button wherever it is.",
        "button_pushing",
        _fingers13("spring"),
        lambda: idle,
    ),
    Cheat(
        "motor_pointer",
        "A rigid rod on two motor hinges turns towards the button. The tail is idle.",
        "button_pushing",
        _pointer("motor"),
        point("motor"),
        part="tip",
    ),
    Cheat(
        "one_hinge_arm",
        "An arm of six links of which only the first joint is soft and the others are 200 times stiffer: a "
        "rigid rod on "
        "cables that counts as a soft chain.",
        "button_pushing",
        _pointer("cable"),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "integrator_arm",
        "The same arm. Its actuators integrate commands of up to 800, and their activation ends at 40 N: by their "
        "control range they pull 20 times as hard as they do.",
        "button_pushing",
        _wound_pointer('dyntype="integrator" ctrlrange="-80 800"'),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "clipped_filter_arm",
        "The same arm, with filters for integrators.",
        "button_pushing",
        _wound_pointer('dyntype="filter" dynprm="0.1" ctrlrange="0 800"'),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "one_soft_hinge_arm",
        "The same arm, its other joints only 30 times stiffer: each bends just enough to count as soft, and nearly all "
        "of the bending is in one place.",
        "button_pushing",
        _pointer("cable", 12.0),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "spring_belt_arm",
        "An arm of six joints with equal springs. Fixed tendons without an actuator, 200 times stiffer than "
        "these springs, hold all but the first: a rigid rod on cables that counts as a soft chain.",
        "button_pushing",
        _stiffened_pointer(tendon='stiffness="80" damping="1"'),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "stopped_belt_arm",
        "The same, with tendons that end after a fifth of a degree.",
        "button_pushing",
        _stiffened_pointer(tendon='range="-0.003 0.003" solreflimit="0.004 1"'),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "damped_belt_arm",
        "The same, with tendons that give way only in minutes.",
        "button_pushing",
        _stiffened_pointer(tendon='damping="100"'),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "curved_spring_arm",
        "The same arm without these tendons. The stiffness of its springs is a polynomial: as soft as the "
        "first at rest, and many times stiffer after a degree.",
        "button_pushing",
        _stiffened_pointer('stiffness="0.4 0 30000" damping="0.5"'),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "early_stop_arm",
        "The same arm, with limits that act 44.7 degrees before the ends of a range of 45.",
        "button_pushing",
        _stiffened_pointer('stiffness="0.4" damping="0.02" margin="0.78"'),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "geared_arm",
        "The same arm, all joints but the first geared to turn by a twentieth of it.",
        "button_pushing",
        _stiffened_pointer(gears="joint"),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "geared_belt_arm",
        "The same, with tendon equalities for gears.",
        "button_pushing",
        _stiffened_pointer(gears="tendon"),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "margin_arm",
        "An honest arm that is too short, whose tip has a contact margin of 90 mm: it presses the button from afar.",
        "button_pushing",
        _margin_arm(),
        point("cable"),
        part="arm_tip",
    ),
    Cheat(
        "rigid_hook",
        "A rigid hook: the moving mount does all the work, and the robot none.",
        "drawer_opening",
        _hook(),
        hook,
        part="tip",
    ),
    Cheat(
        "spring_pin",
        "A pin on a soft preloaded spring presses with the same force wherever the wall is; the moving mount "
        "does the rest.",
        "force_controlled_brushing",
        _brush(),
        sweep,
        part="pin",
    ),
    Cheat(
        "tilted_world",
        "A cart on wheels without motors, and a scene of its own whose gravity points a little down the lane.",
        "flat_ground",
        (_cart(0.04, (-0.05, 0.05), _passive) + tail('pos="0 0 0.043"')).document(_chassis()),
        lambda: idle,
        edit=_tilted,
    ),
    Cheat(
        "welded_object",
        "Its scene welds the object to the robot: a magnet made of an equality constraint.",
        "delicate_grasping",
        _jaws("cable"),
        lambda: idle,
        part="grip",
        edit=_welded,
    ),
    Cheat(
        "belted_crank",
        "An honest arm, and a scene of its own whose fixed tendon is a damped belt from a joint of the arm to the "
        "crank.",
        "crank_turning",
        _plain_arm(),
        lambda: constant({"arm_front": 1.0}),
        edit=_belted,
        only_own=True,
    ),
    Cheat(
        "geared_crank",
        "The same, with a joint equality for a belt.",
        "crank_turning",
        _plain_arm(),
        lambda: constant({"arm_front": 1.0}),
        edit=_geared,
        only_own=True,
    ),
    Cheat(
        "glued_jaws",
        "Its scene has contact pairs with a friction of 50 between jaws and object, which overrule those of the task.",
        "simple_grasping",
        _jaws("cable"),
        lambda: then({}, 1.3, {"left": -0.2, "right": -0.2}),
        part="grip",
        edit=_sticky,
    ),
    Cheat(
        "lifts_the_object",
        "Its scene has an actuator of the robot that acts on the object itself.",
        "delicate_grasping",
        _jaws("cable"),
        levitate,
        part="grip",
        edit=_own_motor,
    ),
)
"""All cheats, grouped by the kind of task that they are meant to win; those with a changed scene come last."""
