"""Arms as language models usually write them: hinges at the start of segments, degrees, a site per segment, motors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from benchmarks.validator.corpus.physique import Physique, draw_physique
from benchmarks.validator.corpus.writers.written import Written, around, number, numbers

_POSES = {"standing": "0 0 0", "hanging": "180 0 0", "lying": "0 90 0"}


@dataclass(frozen=True)
class HingeArms:
    """Arms of one kind on a plate.

    Attributes:
        pairs: Whether each body has two hinges; otherwise it has one, alternately about x and y.
        shape: Type of the geoms.
        motor: Convention of the pull command.
        high: Whether sites are near the far end of each segment instead of in its middle.
    """

    limb: Physique
    arms: int = 1
    pose: str = "standing"
    pairs: bool = True
    shape: str = "cylinder"
    tendons: int = 4
    motor: str = "gear -1"
    high: bool = False
    timestep_s: float = 0.002

    def document(self) -> str:
        """Return the robot's MJCF."""
        limb = self.limb
        spread = 3 * limb.radius_m if self.arms > 1 else 0.0
        places = around(self.arms, spread) if self.arms > 1 else [(0.0, 0.0)]
        prefixes = [f"arm{index}_" if self.arms > 1 else "" for index in range(self.arms)]
        bodies = tendons = actuators = sensors = excludes = ""
        for prefix, (x, y) in zip(prefixes, places, strict=True):
            sites = "".join(
                f'<site name="{prefix}base_site_{t}" pos="{numbers((x + dx, y + dy, 0))}" size="0.002"/>\n'
                for t, (dx, dy) in enumerate(around(self.tendons, 0.85 * limb.radius_m))
            )
            bodies += sites + self._segment(prefix, 0, (x, y, 0.0))
            tendons += self._tendons(prefix)
            actuators += self._actuators(prefix)
            sensors += self._sensors(prefix)
            excludes += f'<exclude body1="base" body2="{prefix}segment_0"/>\n'
        plate = max(2 * limb.radius_m, 1.6 * spread)
        return f"""<mujoco model="continuum_arm">
<compiler angle="degree"/>
<option timestep="{number(self.timestep_s)}" gravity="0 0 -9.81" integrator="implicitfast"/>
<worldbody>
<light pos="0 0 2"/>
<body name="base" pos="0 0 {number(0.5 + limb.length_m)}" euler="{_POSES[self.pose]}">
<geom name="base_geom" type="cylinder" size="{numbers((plate, 0.01))}" pos="0 0 -0.01" rgba="0.3 0.3 0.3 1"/>
{bodies}</body>
</worldbody>
<contact>
{excludes}</contact>
<tendon>
{tendons}</tendon>
<actuator>
{actuators}</actuator>
<sensor>
{sensors}</sensor>
</mujoco>
"""

    def _segment(self, prefix: str, index: int, pos: tuple[float, float, float]) -> str:
        limb, pitch = self.limb, self.limb.pitch_m
        bends_per_joint = limb.bend_rad / limb.segments * (1 if self.pairs else 2)
        reach = number(np.degrees(bends_per_joint) * 1.6 + 8)
        axes = {"x": "1 0 0", "y": "0 1 0"}
        if not self.pairs:
            axes = {"y": "0 1 0"} if index % 2 else {"x": "1 0 0"}
        # with half as many joints in each plane, each joint is half as stiff
        stiffness = limb.stiffness_n_m_rad * (1 if self.pairs else 0.5)
        spring = f'stiffness="{number(stiffness)}" damping="{number(stiffness * limb.damping_s)}"'
        joints = "".join(
            f'<joint name="{prefix}joint_{index}_{name}" type="hinge" axis="{axis}" {spring} range="-{reach} {reach}"'
            f' limited="true" solreflimit="0.004 1"/>\n'
            for name, axis in axes.items()
        )
        mass, radius = number(limb.mass_kg / limb.segments), limb.radius_m
        geom = {
            "capsule": f'type="capsule" fromto="0 0 {number(radius / 2)} 0 0 {number(pitch - radius / 2)}"'
            f' size="{number(radius)}"',
            "cylinder": f'type="cylinder" pos="0 0 {number(pitch / 2)}" size="{numbers((radius, 0.46 * pitch))}"',
            "box": f'type="box" pos="0 0 {number(pitch / 2)}" size="{numbers((radius, radius, 0.46 * pitch))}"',
        }[self.shape]
        height = pitch * (0.9 if self.high else 0.5)
        sites = "".join(
            f'<site name="{prefix}site_{index}_{t}" pos="{numbers((x, y, height))}" size="0.002"/>\n'
            for t, (x, y) in enumerate(around(self.tendons, 0.85 * radius))
        )
        last = index == limb.segments - 1
        inner = f'<site name="{prefix}tip" pos="0 0 {number(pitch)}"/>\n' if last else ""
        if not last:
            inner = self._segment(prefix, index + 1, (0, 0, pitch))
        return f"""<body name="{prefix}segment_{index}" pos="{numbers(pos)}">
{joints}<geom name="{prefix}geom_{index}" {geom} mass="{mass}"/>
{sites}{inner}</body>
"""

    def _tendons(self, prefix: str) -> str:
        limb = self.limb
        text = ""
        for t in range(self.tendons):
            sites = f'<site site="{prefix}base_site_{t}"/>\n'
            sites += "".join(f'<site site="{prefix}site_{i}_{t}"/>\n' for i in range(limb.segments))
            text += f'<spatial name="{prefix}tendon_{t}" width="0.001" rgba="1 0 0 1">\n{sites}</spatial>\n'
        return text

    def _actuators(self, prefix: str) -> str:
        limb = self.limb
        force = limb.force_n(0.85 * limb.radius_m)
        attributes = {
            "gear -1": f'gear="-1" ctrlrange="0 {number(force)}"',
            "negative ctrl": f'gear="1" ctrllimited="true" ctrlrange="-{number(force)} 0"',
            "normalized": f'gear="-{number(force)}" ctrllimited="true" ctrlrange="0 1"',
        }[self.motor]
        return "".join(
            f'<motor name="{prefix}motor_{t}" tendon="{prefix}tendon_{t}" {attributes}/>\n' for t in range(self.tendons)
        )

    def _sensors(self, prefix: str) -> str:
        limb = self.limb
        lengths = "".join(
            f'<tendonpos name="{prefix}length_{t}" tendon="{prefix}tendon_{t}"/>\n' for t in range(self.tendons)
        )
        middle = limb.segments // 2
        axis = "x" if self.pairs or middle % 2 == 0 else "y"
        return (
            f"{lengths}"
            f'<jointpos name="{prefix}middle" joint="{prefix}joint_{middle}_{axis}"/>\n'
            f'<framepos name="{prefix}tip_position" objtype="site" objname="{prefix}tip"/>\n'
        )


def write_hinge_robot(rng: np.random.Generator) -> Written:
    """Write one arm, two arms beside each other, or three arms around a plate."""
    arms = int(rng.choice([1, 1, 1, 2, 3]))
    pose = str(rng.choice(list(_POSES)))
    segments = (6, 16) if arms == 1 else (4, 8)
    limb = draw_physique(rng, segments=segments, sag=(0.2, 0.6) if pose == "lying" else (0.3, 1.2))
    robot = HingeArms(
        limb=limb,
        arms=arms,
        pose=pose,
        pairs=bool(rng.random() < 0.7),
        shape=str(rng.choice(["capsule", "cylinder", "box"])),
        tendons=int(rng.choice([3, 4])),
        motor=str(rng.choice(["gear -1", "negative ctrl", "normalized"])),
        high=bool(rng.random() < 0.5),
        timestep_s=0.001 if limb.length_m < 0.2 else 0.002,
    )
    return Written({1: f"{pose} arm", 2: "two arms", 3: "three arms"}[arms], robot.document())
