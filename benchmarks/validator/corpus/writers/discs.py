"""A thin backbone with routing discs and joints in the middle of segments; filtered winches; one or two sections."""

from __future__ import annotations

import numpy as np
from benchmarks.validator.corpus.physique import Physique, draw_physique
from benchmarks.validator.corpus.writers.written import Written, around, number, numbers


def write_disc_robot(rng: np.random.Generator) -> Written:
    """Write an arm of one or two sections, standing or hanging, some of them tapered like a trunk."""
    limb = draw_physique(
        rng, length_m=(0.2, 0.6), segments=(10, 16), sag=(0.3, 0.9), slenderness=(10, 14), bend_rad=(1.0, 1.8)
    )
    spine = _Spine(
        limb=limb,
        sections=int(rng.choice([1, 2])),
        cables=3 if rng.random() < 0.6 else 4,
        taper=float(rng.choice([1.0, 0.6])),
        hanging=bool(rng.random() < 0.5),
        filtered=bool(rng.random() < 0.6),
    )
    family = "trunk" if spine.taper < 1 else f"{spine.sections}-section disc arm"
    return Written(family, spine.document())


class _Spine:
    def __init__(
        self, limb: Physique, *, sections: int, cables: int, taper: float, hanging: bool, filtered: bool
    ) -> None:
        self.limb, self.sections, self.cables = limb, sections, cables
        self.taper, self.hanging, self.filtered = taper, hanging, filtered
        self.radii = [limb.radius_m * (1 + (taper - 1) * i / (limb.segments - 1)) for i in range(limb.segments)]

    def last_disc(self, section: int) -> int:
        """Return the index of the disc at which the cables of a section end."""
        return (section + 1) * self.limb.segments // self.sections - 1

    def holes(self, section: int, radius: float) -> list[tuple[float, float]]:
        """Return the places of a section's cables; those of the second section are between those of the first."""
        return around(self.cables, 0.8 * radius, first_rad=section * np.pi / self.cables)

    def routes(self) -> list[tuple[str, list[str]]]:
        routes = []
        for section in range(self.sections):
            for cable in range(self.cables):
                name = f"s{section}c{cable}"
                discs = range(self.last_disc(section) + 1)
                sites = [f"flange_{name}"] + [f"d{i}{side}_{name}" for i in discs for side in ("b", "t")]
                routes.append((f"cable_{name}", sites))
        return routes

    def sites(self, label: str, radius: float, height: float, sections: range) -> str:
        return "".join(
            f'<site name="{label}_s{section}c{cable}" pos="{numbers((x, y, height))}"/>'
            for section in sections
            for cable, (x, y) in enumerate(self.holes(section, radius))
        )

    def vertebrae(self) -> str:
        """Return the bodies. Each joint is half a pitch before its disc; the first is half a pitch from the flange."""
        limb, text = self.limb, ""
        pitch, total = limb.pitch_m, sum(radius**2 for radius in self.radii)
        for index in reversed(range(limb.segments)):
            radius = self.radii[index]
            share = radius**2 / total
            k = limb.stiffness_n_m_rad * (radius / limb.radius_m) ** 3
            passing = range(sum(index > self.last_disc(s) for s in range(self.sections)), self.sections)
            place = f"0 0 {number(pitch if index else pitch / 2)}"
            spring = f'stiffness="{number(k)}" damping="{number(k * limb.damping_s)}"'
            low, high = 0.25 * pitch, 0.75 * pitch
            tip = f'<site name="tip" pos="0 0 {number(pitch)}"/>' if not text else ""
            text = f"""<body name="vertebra{index}" pos="{place}">
  <joint name="v{index}x" axis="1 0 0" {spring}/><joint name="v{index}y" axis="0 1 0" {spring}/>
  <geom class="backbone" size="{number(0.2 * radius)}" fromto="0 0 0 0 0 {number(pitch)}"
   mass="{number(0.4 * share * limb.mass_kg)}"/>
  <geom class="disc" size="{numbers((radius, 0.1 * pitch))}" pos="0 0 {number(pitch / 2)}"
   mass="{number(0.6 * share * limb.mass_kg)}"/>
  {self.sites(f"d{index}b", radius, low, passing)}
  {self.sites(f"d{index}t", radius, high, passing)}{tip}
{text}</body>
"""
        return text

    def winches(self) -> str:
        text = ""
        for section in range(self.sections):
            # a cable that ends half way bends only half of the limb
            reach = (self.last_disc(section) + 1) / self.limb.segments
            force = self.limb.force_n(0.8 * self.limb.radius_m * (1 + self.taper) / 2) * (0.6 + 0.4 * reach)
            for cable in range(self.cables):
                name = f"s{section}c{cable}"
                dynamics = 'dyntype="filterexact" dynprm="0.05"' if self.filtered else ""
                text += (
                    f'<general name="winch_{name}" tendon="cable_{name}" {dynamics} gainprm="{number(force)}"'
                    f' biastype="none" gear="-1" ctrlrange="0 1" ctrllimited="true"/>\n'
                )
        return text

    def document(self) -> str:
        cables = "".join(
            f'<spatial name="{name}" width="0.0008" frictionloss="0.01">'
            + "".join(f'<site site="{site}"/>' for site in sites)
            + "</spatial>\n"
            for name, sites in self.routes()
        )
        lengths = "".join(f'<tendonpos tendon="{name}"/>' for name, _ in self.routes())
        turn = 'euler="180 0 0"' if self.hanging else ""
        radius = self.radii[0]
        return f"""<mujoco model="disc_arm">
<option timestep="0.002" integrator="implicitfast"/>
<default>
  <site size="0.001"/>
  <default class="backbone"><geom type="capsule" contype="0" conaffinity="0"/></default>
  <default class="disc"><geom type="cylinder" rgba="0.2 0.2 0.2 1" solref="0.004 1"/></default>
</default>
<worldbody>
<body name="flange" pos="0 0 1" {turn}>
<geom type="cylinder" size="{numbers((1.5 * radius, 0.005))}" pos="0 0 -0.006" mass="0.3"/>
{self.sites("flange", radius, 0.0, range(self.sections))}
{self.vertebrae()}</body>
</worldbody>
<tendon>
{cables}</tendon>
<actuator>
{self.winches()}</actuator>
<sensor>
{lengths}
<framepos name="tip_pos" objtype="site" objname="tip"/><frameangvel objtype="site" objname="tip"/>
</sensor>
</mujoco>
"""
