"""A uniform elastic rod as a chain of hinges, by the schemes that docs/physics.md compares."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RodChain:
    """The rod of docs/physics.md's tables: E I 0.04 N m^2, 0.1 kg, 0.3 m, one cable at 18 mm."""

    segments: int
    joints_at: str = "middles"
    clamp_doubled: bool = False
    guides: tuple[float, ...] = (0.25, 0.75)
    armature: float = 0.0
    length_m: float = 0.3
    bending_stiffness_n_m2: float = 0.04
    mass_kg: float = 0.1
    offset_m: float = 0.018
    pull_n: float = 10.0
    damping_s: float = 0.05

    @property
    def pitch_m(self) -> float:
        return self.length_m / self.segments

    def joint(self, number: int) -> str:
        stiffness = self.bending_stiffness_n_m2 / self.pitch_m * (2 if self.clamp_doubled and number == 0 else 1)
        springs = f'stiffness="{stiffness:.12g}" damping="{stiffness * self.damping_s:.12g}" armature="{self.armature}"'
        return f'<joint name="j{number}" axis="0 1 0" {springs}/>'

    def skin(self, length_m: float, width: str = "0.002") -> str:
        return (
            f'<geom type="cylinder" size="{width}" fromto="0 0 0 0 0 {length_m:.12g}"'
            f' mass="{self.mass_kg * length_m / self.length_m:.12g}" contype="0" conaffinity="0"/>'
        )

    def mjcf(self) -> str:
        pitch, at = self.pitch_m, 0.5 if self.joints_at == "middles" else 0.0
        joints = [(number + at) * pitch for number in range(self.segments)]
        guides = [(number, (number + place) * pitch, place) for number in range(self.segments) for place in self.guides]
        inner = ""
        for number in reversed(range(self.segments)):
            end = joints[number + 1] if number + 1 < self.segments else self.length_m
            sites = "".join(
                f'<site name="g{segment}_{place}" pos="{self.offset_m} 0 {along - joints[number]:.12g}"/>'
                for segment, along, place in guides
                if (segment if place >= at else segment - 1) == number
            )
            before = joints[number - 1] if number else 0.0
            body = f'<body name="s{number}" pos="0 0 {joints[number] - before:.12g}">{self.joint(number)}'
            inner = f"{body}{self.skin(end - joints[number])}{sites}{inner}</body>"
        on_base = [f"g{segment}_{place}" for segment, _, place in guides if segment == 0 and place < at]
        base = "".join(
            f'<site name="{name}" pos="{self.offset_m} 0 {float(name[3:]) * pitch:.12g}"/>' for name in on_base
        )
        if self.joints_at == "starts":
            base += f'<site name="foot" pos="{self.offset_m} 0 0"/>'
        names = (["foot"] if self.joints_at == "starts" else []) + [
            f"g{segment}_{place}" for segment, _, place in guides
        ]
        path = "".join(f'<site site="{name}"/>' for name in names)
        return (
            f'<mujoco><option timestep="0.002" integrator="implicitfast"/>'
            f'<worldbody><body name="base">{base}{inner}</body></worldbody>'
            f'<tendon><spatial name="cable">{path}</spatial></tendon>'
            f'<actuator><motor name="winch" tendon="cable" gear="-1" ctrlrange="0 {self.pull_n}"/></actuator>'
            f"</mujoco>"
        )
