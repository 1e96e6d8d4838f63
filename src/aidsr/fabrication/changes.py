"""Differences between the robot as built and as simulated, in words, and the masses of both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from aidsr.fabrication.build import PrintedPart, RobotBuild
from aidsr.fabrication.hinges import Hinge
from aidsr.fabrication.materials import lines
from aidsr.fabrication.schema import Change

_NOTICED = 0.01
"""Relative difference above which a value is listed as changed. Our choice: the repeatability of a printer."""


_ROUND_TWIST = 0.7
"""Twisting / bending stiffness of a round section: G J / (E I) = 1 / (1 + nu), which is 0.67 for TPU (nu 0.5), 0.75 for
NiTi (0.33) and 0.78 for steel (0.29). Glass-fibre rods, which are stiff along their fibres alone, twist more easily."""

_AT_REST_RAD = math.radians(1.0)
"""Angle between a spring's rest and the initial pose, above which the spring is listed as preloaded. Our choice."""


def changes_of(build: RobotBuild) -> tuple[Change, ...]:
    """Return the differences between the robot as built and as simulated, in words."""
    found = [*_mass_changes(build), *_joint_changes(build)]
    gaps = [gap.length_mm for gap in build.skeleton.gaps]
    if gaps:
        least, most = f"{min(gaps):.1f}", f"{max(gaps):.1f}"
        width = least if least == most else f"{least} to {most}"
        found.append(
            Change(
                what="skin at the joints",
                simulated="closed from part to part",
                built=f"open for {width} mm between parts, so that they can bend",
            )
        )
    if build.shaping.ducts:
        of_cable = {winch.cable: winch.line.diameter_mm for winch in build.winches if winch.line}
        thinnest = lines()[0].diameter_mm
        play_mm = max(b.radius_mm - of_cable.get(cable, thinnest) / 2 for cable, b in enumerate(build.bores))
        found.append(
            Change(
                what="guides",
                simulated="points beside the body",
                built=f"ducts in walls along every part, holes of {2 * max(b.radius_mm for b in build.bores):.1f} mm: "
                f"a cable may lie {play_mm:.1f} mm off its line",
            )
        )
    if any(not cable.actuator and not cable.wraps for cable in build.anatomy.cables):
        found.append(
            Change(
                what="cables that nothing drives",
                simulated="with what springs, dampers and stops the file gives them",
                built="not strung: without these forces",
            )
        )
    resisting = [cable.tendon for cable in build.anatomy.cables if cable.actuator and cable.resists]
    if resisting:
        found.append(
            Change(
                what=f"springs, dampers and stops of cables, such as {resisting[0]}",
                simulated="as the file gives them",
                built="none: a line from a winch only pulls",
            )
        )
    if build.winches:
        found.append(
            Change(
                what="winches",
                simulated="without mass, at the first guide",
                built="on a board beside the robot, through sheaths that cost about 15 % of the pull; not simulated",
            )
        )
    if build.shaping.flange_mm:
        found.append(Change(what="foot", simulated="held by the world", built="a flange with four screws M4"))
    return tuple(found)


@dataclass(frozen=True)
class Masses:
    """Masses of the printed pieces with the rods in them [kg].

    Attributes:
        simulated_kg: As simulated.
        built_kg: As built.
        moving_simulated_kg: As simulated, without the pieces that are fixed to the world.
        moving_built_kg: As built, without the pieces that are fixed to the world.
    """

    simulated_kg: float
    built_kg: float
    moving_simulated_kg: float
    moving_built_kg: float


def masses_of(build: RobotBuild) -> Masses:
    """Return the masses of a robot's printed pieces, as simulated and as built."""

    def summed(pieces: Sequence[PrintedPart]) -> tuple[float, float]:
        simulated = sum(piece.weight.simulated_kg * len(piece.used_for) for piece in pieces)
        return simulated, sum(piece.weight.mass_kg * len(piece.used_for) for piece in pieces)

    return Masses(*summed(build.robot_parts), *summed(build.moving_parts))


def _mass_changes(build: RobotBuild) -> list[Change]:
    masses = masses_of(build)
    if abs(masses.built_kg - masses.simulated_kg) <= _NOTICED * masses.simulated_kg:
        return []

    def grams(all_kg: float, moving_kg: float) -> str:
        whole_g, moving_g = round(1000 * all_kg, 1), round(1000 * moving_kg, 1)
        parts = f": {moving_g:.1f} g move, {whole_g - moving_g:.1f} g are fixed"
        return f"{whole_g:.1f} g" + parts * (masses.simulated_kg > masses.moving_simulated_kg)

    simulated = grams(masses.simulated_kg, masses.moving_simulated_kg)
    built = f"{grams(masses.built_kg, masses.moving_built_kg)}; as near as the infill of each piece allows"
    return [Change(what="mass of all pieces", simulated=simulated, built=built)]


def _joint_changes(build: RobotBuild) -> list[Change]:
    found, joints = [], build.anatomy.joints
    softer = [
        hinge
        for hinge in build.hinges.hinges.values()
        if abs(hinge.stiffness_n_m_rad / min(joints[hinge.joint].stiffness_n_m_rad) - 1) > _NOTICED
    ]
    if softer:
        worst = max(softer, key=lambda h: abs(h.stiffness_n_m_rad / min(joints[h.joint].stiffness_n_m_rad) - 1))
        asked = min(joints[worst.joint].stiffness_n_m_rad)
        name = joints[worst.joint].names[0]
        built = f"{worst.stiffness_n_m_rad:.3f} N m/rad, as thicknesses are rounded to 0.05 mm"
        found.append(Change(what=f"stiffness, most at {name}", simulated=f"{asked:.3f} N m/rad", built=built))
    found += _twist_changes(build)
    found += _preload_changes(build)
    found += _range_changes(build)
    bent = [h for h in build.hinges.hinges.values() if build.skeleton.gaps[h.joint].bend_rad > h.linear_rad]
    if bent:
        angle = min(hinge.linear_rad for hinge in bent)
        found.append(
            Change(
                what="springs",
                simulated="of constant stiffness",
                built=f"NiTi, softer beyond {math.degrees(angle):.0f} deg a joint; not simulated",
            )
        )
    return found


def _twist_changes(build: RobotBuild) -> Iterator[Change]:
    """Yield the joints with the softest twist; a rod or neck twists about as easily as it bends."""
    joints, hinges = build.anatomy.joints, build.hinges.hinges.values()
    for kind, simulated in (("hinge", "rigid"), ("ball", "as stiff as bending")):
        twisting = [hinge for hinge in hinges if joints[hinge.joint].kind == kind]
        if twisting:
            softest = min(twisting, key=lambda hinge: _twist_share(hinge) * hinge.stiffness_n_m_rad)
            share, name = _twist_share(softest), joints[softest.joint].names[0]
            stiffness = f"{share * softest.stiffness_n_m_rad:.3f} N m/rad"
            yield Change(
                what=f"twist about the limb, in {_joints(len(twisting))}",
                simulated=simulated,
                built=f"about {stiffness} at {name}, {share:.1f} of its bending stiffness; not simulated",
            )


def _twist_share(hinge: Hinge) -> float:
    """Return the twisting stiffness of a hinge about the limb / its bending stiffness.

    Source: Saint-Venant torsion with isotropic elasticity, G = E / (2 (1 + nu)). A round section has J = 2 I, a thin
    strip J = w t^3 / 3 = 4 I. Each of two rods, clamped at both ends and at a distance y from the axis, also bends
    sideways with 12 E I / g^3.
    """
    match hinge.kind:
        case "flat":
            return 2 * _ROUND_TWIST
        case "pair":
            return _ROUND_TWIST + 12 * (hinge.width_mm / 2 / hinge.free_mm) ** 2
        case _:
            return _ROUND_TWIST


def _preload_changes(build: RobotBuild) -> Iterator[Change]:
    """Yield the springs that are loaded in the initial pose, in which rods and necks are at rest."""
    hinged = [build.anatomy.joints[index] for index in build.hinges.hinges]
    springs = [
        (abs(stiffness * rest), rest, name)
        for joint in hinged
        for name, stiffness, rest in zip(joint.names, joint.stiffness_n_m_rad, joint.spring_rest_rad, strict=False)
        if abs(rest) > _AT_REST_RAD
    ]
    if springs:
        torque, rest, name = max(springs, key=lambda spring: spring[0])
        yield Change(
            what=f"preload of {_joints(len(springs))}, most at {name}",
            simulated=f"{torque:.2f} N m, at rest at {math.degrees(rest):.0f} deg",
            built="none: rods and necks are at rest in the initial pose",
        )


def _range_changes(build: RobotBuild) -> Iterator[Change]:
    """Yield the joints whose faces touch before the simulated limit, and those without a stop at that limit."""
    gaps = [(gap.touch_rad, build.anatomy.joints[gap.joint].limits_rad) for gap in build.skeleton.gaps]
    stopped = [(touch, limits) for touch, limits in gaps if touch < np.abs(limits).max()]
    free = [(touch, limits) for touch, limits in gaps if touch > np.abs(limits).min()]
    if stopped:
        angle, limits = min(stopped)
        where = f"at the tightest of {_joints(len(stopped))}, where walls touch"
        yield Change(what="range of joints", simulated=_format_limits(limits), built=f"{_both(angle)} {where}")
    if free:
        angle, limits = max(free)
        where = f"at the widest of {_joints(len(free))}: no stop is built before walls touch"
        yield Change(what="stops of joints", simulated=_format_limits(limits), built=f"{_both(angle)} {where}")


def _joints(count: int) -> str:
    return "1 joint" if count == 1 else f"{count} joints"


def _both(angle_rad: float) -> str:
    return f"{-math.degrees(angle_rad):.0f} to {math.degrees(angle_rad):.0f} deg"


def _format_limits(limits: tuple[tuple[float, float], ...]) -> str:
    low, high = min(limits, key=lambda both: float(np.abs(both).min()))
    return f"{math.degrees(low):.0f} to {math.degrees(high):.0f} deg" if math.isfinite(high - low) else "without limit"
