"""One body in many dialects: sizes from 2 cm to 1 m, four integrators, four kinds of actuators, nested classes.

Source: the limb is an Euler-Bernoulli beam (`physique`), so that all dialects describe the same robot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from benchmarks.validator.corpus.physique import Physique, draw_physique
from benchmarks.validator.corpus.writers.written import Written, around, number, numbers

_INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast")
_ACTUATORS = ("motor", "general", "position", "muscle")
_JOINTS = ("universal", "ball", "planar", "coupled")


@dataclass(frozen=True)
class Dialect:
    """The way in which a robot is written.

    Attributes:
        joints: "universal" (two hinges in a body), "ball", "planar" (one hinge), or "coupled" (planar; every second
            hinge turns by the angle of the one before it).
        limbs: Number of limbs around a hub.
        radians: Whether angles are in radians; otherwise they are in degrees.
        nested: Whether elements use nested default classes; otherwise every element has all attributes.
    """

    limb: Physique
    integrator: str
    actuator: str
    joints: str
    limbs: int
    radians: bool
    nested: bool
    hanging: bool

    @property
    def offset_m(self) -> float:
        """Distance of the cables from the backbone [m]."""
        return 0.8 * self.limb.radius_m

    @property
    def planar(self) -> bool:
        """Whether limbs bend in one plane."""
        return self.joints in ("planar", "coupled")

    @property
    def cables(self) -> list[tuple[float, float]]:
        """Positions of the cables in a cross-section of the limb [m]."""
        if self.planar:
            return [(self.offset_m, 0.0), (-self.offset_m, 0.0)]
        return around(3 if self.joints == "ball" else 4, self.offset_m)

    @property
    def timestep_s(self) -> float:
        """Time step [s]. Runge-Kutta needs small steps, because it treats damping explicitly."""
        if self.integrator == "RK4":
            return 0.00025
        return 0.0005 if self.limb.length_m < 0.1 else 0.001

    @property
    def armature(self) -> float:
        """Inertia about each joint with which Runge-Kutta can follow the damping: dt c / I is at most 1.5."""
        return self.limb.damping_n_m_s_rad * self.timestep_s / 1.5 if self.integrator == "RK4" else 0.0

    def document(self) -> str:
        """Return the robot's MJCF."""
        limb = self.limb
        hub = max(3.5 * limb.radius_m * (self.limbs > 1), 1.3 * limb.radius_m)
        places = around(self.limbs, 3.5 * limb.radius_m) if self.limbs > 1 else [(0.0, 0.0)]
        bodies = tendons = actuators = sensors = equalities = excludes = ""
        for index, place in enumerate(places):
            name = f"l{index}"
            bodies += self._anchors(name, place) + self._bodies(name, place)
            tendons += self._tendons(name)
            actuators += self._actuators(name)
            sensors += (
                f'<framepos objtype="site" objname="{name}_tip"/><framequat objtype="site" objname="{name}_tip"/>\n'
            )
            excludes += f'<exclude body1="hub" body2="{name}_0"/>\n'
            equalities += self._equalities(name)
        below = number(-1.05 * limb.radius_m)
        turn = {True: "0 1 0 0", False: "1 0 0 0"}[self.hanging]
        return f"""<mujoco model="dialect">
<compiler angle="{"radian" if self.radians else "degree"}" autolimits="true"/>
<option integrator="{self.integrator}" timestep="{number(self.timestep_s)}"/>
{self._defaults()}
<worldbody>
<body name="hub" pos="0 0 {number(1.5 * limb.length_m)}" quat="{turn}">
<geom name="hub" type="cylinder" size="{numbers((1.5 * hub, limb.radius_m))}" pos="0 0 {below}"/>
{bodies}</body>
</worldbody>
<contact>
{excludes}</contact>
<tendon>
{tendons}</tendon>
<equality>
{equalities}</equality>
<actuator>
{actuators}</actuator>
<sensor>
{sensors}</sensor>
</mujoco>
"""

    def _spring(self) -> str:
        limb = self.limb
        reach = 1.6 * limb.bend_rad / limb.segments + 0.15
        angle = reach if self.radians else np.degrees(reach)
        limits = f"0 {number(angle)}" if self.joints == "ball" else f"{number(-angle)} {number(angle)}"
        return (
            f'stiffness="{number(limb.stiffness_n_m_rad)}" damping="{number(limb.damping_n_m_s_rad)}" range="{limits}"'
            f' solreflimit="0.004 1" armature="{number(self.armature)}"'
        )

    def _shape(self) -> str:
        limb = self.limb
        half = number(0.47 * limb.pitch_m)
        mass = number(limb.mass_kg / limb.segments)
        return f'type="cylinder" size="{number(limb.radius_m)} {half}" mass="{mass}"'

    def _defaults(self) -> str:
        if not self.nested:
            return ""
        return f"""<default>
<default class="limb"><joint {self._spring()}/>
<default class="vertebra"><geom {self._shape()} rgba="0.8 0.7 0.6 1"/>
<default class="guide"><site size="{number(0.1 * self.limb.radius_m)}"/></default></default></default>
</default>"""

    def _anchors(self, name: str, place: tuple[float, float]) -> str:
        return "".join(
            f'<site name="{name}_a_{c}" pos="{numbers((place[0] + x, place[1] + y, -0.5 * self.limb.pitch_m))}"/>\n'
            for c, (x, y) in enumerate(self.cables)
        )

    def _bodies(self, name: str, place: tuple[float, float]) -> str:
        text, pitch = "", self.limb.pitch_m
        spring = 'class="limb"' if self.nested else self._spring()
        shape = 'class="vertebra"' if self.nested else self._shape()
        guide = 'class="guide"' if self.nested else f'size="{number(0.1 * self.limb.radius_m)}"'
        for index in reversed(range(self.limb.segments)):
            joint = f'<joint name="{name}_j{index}'
            joints = {
                "universal": f'{joint}x" axis="1 0 0" {spring}/>{joint}y" axis="0 1 0" {spring}/>',
                "ball": f'{joint}" type="ball" {spring}/>',
            }.get(self.joints, f'{joint}" axis="0 1 0" {spring}/>')
            sites = "".join(
                f'<site {guide} name="{name}_{index}_{c}" pos="{numbers((x, y, pitch / 2))}"/>'
                for c, (x, y) in enumerate(self.cables)
            )
            tip = f'<site name="{name}_tip" pos="0 0 {number(pitch)}"/>' if not text else ""
            pos = (0.0, 0.0, pitch) if index else (*place, 0.0)
            text = (
                f'<body name="{name}_{index}" pos="{numbers(pos)}">{joints}\n'
                f'<geom {shape} pos="0 0 {number(pitch / 2)}"/>{sites}{tip}\n{text}</body>\n'
            )
        return text

    def _tendons(self, name: str) -> str:
        return "".join(
            f'<spatial name="{name}_c{c}"><site site="{name}_a_{c}"/>'
            + "".join(f'<site site="{name}_{index}_{c}"/>' for index in range(self.limb.segments))
            + "</spatial>\n"
            for c in range(len(self.cables))
        )

    def _actuators(self, name: str) -> str:
        force, length = self.limb.force_n(self.offset_m), self.limb.length_m
        pull = number(force)
        stroke = self.limb.bend_rad * self.offset_m
        stiff = number(2 * force / stroke)
        attributes = {
            "motor": f'motor {{}} gear="-1" ctrlrange="0 {pull}"',
            "general": f'general {{}} gainprm="-{pull}" ctrlrange="0 1" dyntype="filterexact" dynprm="0.03"',
            "position": f'position {{}} kp="{stiff}" kv="{number(0.02 * 2 * force / stroke)}" forcerange="-{pull} 0"'
            f' ctrlrange="{number(length - 1.2 * stroke)} {number(length + 1.2 * stroke)}"',
            "muscle": f'muscle {{}} ctrlrange="0 1" force="{pull}"'
            f' lengthrange="{number(0.6 * length)} {number(1.3 * length)}" range="0.6 1.3"',
        }[self.actuator]
        return "".join(
            "<" + attributes.format(f'name="{name}_m{c}" tendon="{name}_c{c}"') + "/>\n"
            for c in range(len(self.cables))
        )

    def _equalities(self, name: str) -> str:
        if self.joints != "coupled":
            return ""
        return "".join(
            f'<joint joint1="{name}_j{index + 1}" joint2="{name}_j{index}" solref="0.005 1"/>\n'
            for index in range(0, self.limb.segments - 1, 2)
        )


def write_dialect(rng: np.random.Generator) -> Written:
    """Write one to four limbs of any size in any dialect."""
    limbs = int(rng.choice([1, 1, 1, 2, 3, 4]))
    limb = draw_physique(
        rng, length_m=(0.02, 1.0), segments=(5, 12) if limbs == 1 else (4, 7), sag=(0.15, 0.6), bend_rad=(0.9, 1.8)
    )
    dialect = Dialect(
        limb=limb,
        integrator=str(rng.choice(_INTEGRATORS)),
        actuator=str(rng.choice(_ACTUATORS)),
        joints=str(rng.choice(_JOINTS)),
        limbs=limbs,
        radians=bool(rng.random() < 0.5),
        nested=bool(rng.random() < 0.5),
        hanging=bool(rng.random() < 0.5),
    )
    return Written(f"{dialect.joints}, {dialect.actuator}, {dialect.integrator}", dialect.document())
