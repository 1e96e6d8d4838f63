"""Check of which joints can be built as elastic hinges, independent of the material."""

from __future__ import annotations

from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.fabrication.anatomy import Anatomy, Joint

_SAME_STIFFNESS = 0.1
"""Largest relative difference of the stiffnesses about two axes that are built with one round rod. Our choice."""


def elastic_faults(anatomy: Anatomy) -> Iterator[Fault]:
    """Yield a fault for the joints that no elastic hinge can replace, whatever its material."""
    reasons: dict[str, list[str]] = {}
    for joint in anatomy.joints:
        reason = unsupported_reason(joint)
        if reason:
            reasons.setdefault(reason, []).extend(joint.names)
    for reason, names in reasons.items():
        yield Fault(
            code="joint_not_elastic",
            layer="realizability",
            severity="error",
            names=tuple(names),
            message=reason,
            cure="Use one hinge, or two crossed hinges of equal stiffness through one point, each with a stiffness.",
        )


def unsupported_reason(joint: Joint) -> str:
    """Return why no rod or neck can replace a joint; "" where one can."""
    if joint.kind == "other":
        return "slides or has more than turning joints; rods and necks only bend"
    if joint.parent < 0:
        return "joins the robot to the world, where there is no part to hold a hinge"
    if min(joint.stiffness_n_m_rad) <= 0:
        return "turns without a spring; rods and necks always have stiffness"
    if joint.offset_mm > 1.0:
        return "has axes that do not meet in one point"
    if len(joint.names) > 2 and joint.kind == "hinge":
        return "has more than two hinges; a rod or neck bends both ways, but its stiffness in twist cannot be chosen"
    low, high = min(joint.stiffness_n_m_rad), max(joint.stiffness_n_m_rad)
    return "" if high <= (1 + _SAME_STIFFNESS) * low else "has axes of different stiffness"
