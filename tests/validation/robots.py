"""Good robots of several families, written from a few numbers, from which the tests make bad ones."""

from __future__ import annotations

import math
from dataclasses import dataclass

GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class Limb:
    """A limb of equal segments with tendons evenly around it."""

    segments: int = 12
    tendons: int = 4
    length_m: float = 0.3
    mass_kg: float = 0.1
    radius_m: float = 0.011
    sag: float = 1.0
    """Weight against bending stiffness, w L^3 / (E I)."""
    bend_rad: float = 1.4
    """Bend of the whole limb at full pull."""
    offset_share: float = 0.8
    """Distance of the tendons from the axis / radius."""
    damping_s: float = 0.05
    """Joint damping / joint stiffness."""

    @property
    def pitch_m(self) -> float:
        return self.length_m / self.segments

    @property
    def offset_m(self) -> float:
        return self.offset_share * self.radius_m

    @property
    def bending_stiffness_n_m2(self) -> float:
        return self.mass_kg * GRAVITY_M_S2 * self.length_m**2 / self.sag

    @property
    def stiffness_n_m_rad(self) -> float:
        return self.bending_stiffness_n_m2 / self.pitch_m

    @property
    def force_n(self) -> float:
        return self.bend_rad * self.bending_stiffness_n_m2 / (self.offset_m * self.length_m)


def _sites(limb: Limb, prefix: str, label: str, heights: tuple[float, ...]) -> str:
    lines = []
    for tendon in range(limb.tendons):
        angle = 2 * math.pi * tendon / limb.tendons
        x, y = limb.offset_m * math.cos(angle), limb.offset_m * math.sin(angle)
        lines += [
            f'<site name="{prefix}t{tendon}_{label}{"abc"[k]}" pos="{x:.6g} {y:.6g} {height:.6g}"/>'
            for k, height in enumerate(heights)
        ]
    return "".join(lines)


def limb_bodies(limb: Limb, prefix: str = "", first: str = 'pos="0 0 0"') -> str:
    """Nested segments; the sites of the base belong to the parent and come from `base_sites`."""
    pitch, text = limb.pitch_m, ""
    stiffness = limb.stiffness_n_m_rad
    for index in reversed(range(limb.segments)):
        k = stiffness * (2 if index == 0 else 1)
        place = first if index == 0 else f'pos="0 0 {pitch:.6g}"'
        tip = f'<site name="{prefix}tip" pos="0 0 {pitch:.6g}"/>' if index == limb.segments - 1 else ""
        springs = f'stiffness="{k:.6g}" damping="{k * limb.damping_s:.6g}" armature="1e-5"'
        joints = "".join(
            f'<joint name="{prefix}j{index}{axis}" axis="{vector}" {springs} range="-45 45"/>'
            for axis, vector in (("x", "1 0 0"), ("y", "0 1 0"))
        )
        text = (
            f'<body name="{prefix}s{index}" {place}>{joints}'
            f'<geom name="{prefix}g{index}" type="cylinder" size="{limb.radius_m:.6g} {pitch * 0.45:.6g}"'
            f' pos="0 0 {pitch / 2:.6g}" mass="{limb.mass_kg / limb.segments:.6g}"/>'
            f"{_sites(limb, prefix, str(index), (0.25 * pitch, 0.75 * pitch))}{tip}{text}</body>"
        )
    return text


def base_sites(limb: Limb, prefix: str = "") -> str:
    return _sites(limb, prefix, "base", (0.0,))


def tendon_lines(limb: Limb, prefix: str = "") -> str:
    lines = []
    for tendon in range(limb.tendons):
        path = [f"{prefix}t{tendon}_basea"]
        path += [f"{prefix}t{tendon}_{index}{half}" for index in range(limb.segments) for half in "ab"]
        sites = "".join(f'<site site="{name}"/>' for name in path)
        lines.append(f'<spatial name="{prefix}t{tendon}" width="0.001">{sites}</spatial>')
    return "".join(lines)


def motor_lines(limb: Limb, prefix: str = "") -> str:
    return "".join(
        f'<motor name="{prefix}m{tendon}" tendon="{prefix}t{tendon}" gear="-1" ctrlrange="0 {limb.force_n:.6g}"/>'
        for tendon in range(limb.tendons)
    )


def sensor_lines(limb: Limb, prefix: str = "") -> str:
    tendons = "".join(f'<tendonpos name="{prefix}l{i}" tendon="{prefix}t{i}"/>' for i in range(limb.tendons))
    return f'{tendons}<framepos name="{prefix}tip_pos" objtype="site" objname="{prefix}tip"/>'


def document(world: str, tendons: str, actuators: str, sensors: str, extra: str = "", timestep_s: float = 0.002) -> str:
    return (
        f'<mujoco model="robot"><option timestep="{timestep_s:.6g}" integrator="implicitfast"/>'
        f'<default><joint solreflimit="0.004 1"/><geom solref="0.004 1"/></default>'
        f"<worldbody>{world}</worldbody><tendon>{tendons}</tendon><actuator>{actuators}</actuator>"
        f"<sensor>{sensors}</sensor>{extra}</mujoco>"
    )


def arm(limb: Limb = Limb(), timestep_s: float = 0.002) -> str:
    """A limb standing on its base."""
    world = (
        f'<body name="base"><geom name="base" type="cylinder" size="{2 * limb.radius_m:.6g} 0.01" pos="0 0 -0.0105"'
        f' density="1500"/>{base_sites(limb)}{limb_bodies(limb)}</body>'
    )
    return document(world, tendon_lines(limb), motor_lines(limb), sensor_lines(limb), timestep_s=timestep_s)


def gripper(
    limb: Limb = Limb(segments=8, tendons=2, length_m=0.12, mass_kg=0.03, radius_m=0.006), fingers: int = 3
) -> str:
    """Fingers around a palm, each with a flexor and an extensor."""
    palm_m = 0.04
    bodies = tendons = actuators = sensors = ""
    for finger in range(fingers):
        angle, prefix = 360 * finger / fingers, f"f{finger}_"
        x, y = palm_m * math.cos(math.radians(angle)), palm_m * math.sin(math.radians(angle))
        mount = f'<body name="{prefix}mount" pos="{x:.6g} {y:.6g} 0.011" euler="0 0 {angle:.6g}">'
        bodies += f"{mount}{base_sites(limb, prefix)}{limb_bodies(limb, prefix)}</body>"
        tendons += tendon_lines(limb, prefix)
        actuators += motor_lines(limb, prefix)
        sensors += sensor_lines(limb, prefix)
    palm = '<geom name="palm" type="cylinder" size="0.05 0.01" mass="0.2"/>'
    return document(f'<body name="palm">{palm}{bodies}</body>', tendons, actuators, sensors)


def crawler(
    limb: Limb = Limb(segments=6, tendons=2, length_m=0.12, mass_kg=0.03, radius_m=0.008), legs: int = 4
) -> str:
    """Legs pointing outwards from a free body on the ground."""
    bodies = tendons = actuators = sensors = ""
    for leg in range(legs):
        angle, prefix = 360 * (leg + 0.5) / legs, f"l{leg}_"
        x, y = 0.055 * math.cos(math.radians(angle)), 0.055 * math.sin(math.radians(angle))
        outwards = f'<body name="{prefix}out" euler="0 90 0">'
        mount = f'<body name="{prefix}mount" pos="{x:.6g} {y:.6g} 0" euler="0 0 {angle:.6g}">{outwards}'
        bodies += f"{mount}{base_sites(limb, prefix)}{limb_bodies(limb, prefix)}</body></body>"
        tendons += tendon_lines(limb, prefix)
        actuators += motor_lines(limb, prefix)
        sensors += sensor_lines(limb, prefix)
    trunk = '<geom name="trunk" type="cylinder" size="0.05 0.012" mass="0.2"/>'
    world = f'<body name="trunk" pos="0 0 0.03"><freejoint name="root"/>{trunk}{bodies}</body>'
    return document(world, tendons, actuators, sensors + '<framepos name="where" objtype="body" objname="trunk"/>')


def worm(segments: int = 8, pitch_m: float = 0.05) -> str:
    """Ball joints in a row on the ground; three tendons for the front half and three for the rear."""
    stiffness, radius_m = 0.5, 0.02
    text = ""
    for index in reversed(range(segments)):
        joint = f'<joint name="b{index}" type="ball" range="0 45" stiffness="{stiffness}" damping="{0.1 * stiffness}"/>'
        place = f"{pitch_m} 0 0" if index else f"0 0 {radius_m}"
        sites = "".join(
            f'<site name="{name}{index}" pos="{pitch_m / 2} {y} {z}"/>'
            for name, y, z in (("u", 0.016, -0.008), ("v", -0.016, -0.008), ("w", 0, 0.018))
        )
        text = (
            f'<body name="w{index}" pos="{place}">{joint if index else "<freejoint/>"}'
            f'<geom type="capsule" fromto="0.006 0 0 {pitch_m - 0.006} 0 0" size="{radius_m}" mass="0.05"/>'
            f"{sites}{text}</body>"
        )
    halves = {"front": range(segments // 2, segments), "rear": range(segments // 2 + 1)}
    names = [(side, half) for side in "uvw" for half in halves]
    tendons = "".join(
        f'<spatial name="{side}_{half}">{"".join(f"""<site site="{side}{i}"/>""" for i in halves[half])}</spatial>'
        for side, half in names
    )
    motors = "".join(
        f'<motor name="m_{side}_{half}" tendon="{side}_{half}" gear="-1" ctrlrange="0 12"/>' for side, half in names
    )
    sensors = '<framepos objtype="body" objname="w0"/><gyro site="u0"/>'
    return document(text, tendons, motors, sensors)


def ring(segments: int = 12, radius_m: float = 0.1) -> str:
    """A loop standing on the ground, closed by a constraint, with four tendons across."""
    pitch_m = 2 * radius_m * math.sin(math.pi / segments)
    text = ""
    for index in reversed(range(segments)):
        joint = f'<joint name="h{index}" axis="0 1 0" stiffness="1" damping="0.05" armature="1e-5"/>'
        place = f'pos="{pitch_m:.8g} 0 0" euler="0 {-360 / segments} 0"' if index else f'pos="0 0 {radius_m + 0.012}"'
        text = (
            f'<body name="r{index}" {place}>{joint if index else "<freejoint/>"}'
            f'<geom type="capsule" fromto="0.012 0 0 {pitch_m - 0.012:.6g} 0 0" size="0.01" mass="0.02"/>'
            f'<site name="i{index}" pos="{pitch_m / 2:.6g} 0 0.01"/>{text}</body>'
        )
    spans = [(k, (k + segments // 3) % segments) for k in range(0, segments, segments // 4)]
    tendons = "".join(
        f'<spatial name="t{k}"><site site="i{a}"/><site site="i{b}"/></spatial>' for k, (a, b) in enumerate(spans)
    )
    motors = "".join(f'<motor name="m{k}" tendon="t{k}" gear="-1" ctrlrange="0 6"/>' for k in range(len(spans)))
    sensors = '<framepos objtype="body" objname="r0"/>' + "".join(
        f'<tendonpos tendon="t{k}"/>' for k in range(len(spans))
    )
    loop = f'<connect body1="r{segments - 1}" body2="r0" anchor="{pitch_m:.8g} 0 0" solref="0.004 1"/>'
    return document(text, tendons, motors, sensors, extra=f"<equality>{loop}</equality>")
