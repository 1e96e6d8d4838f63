"""Check of which joints can be built as elastic hinges, independent of the material."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aidsr.core.artifacts import Fault, Vec3
from aidsr.fabrication.anatomy import Anatomy, Joint
from aidsr.fabrication.skeleton import Gap, Skeleton

_SAME_STIFFNESS = 0.1
"""Largest relative difference of the stiffnesses about two axes that are built with one round rod. Our choice."""
_MOST_ALONG = 0.26
"""Largest cosine of the angle between the axis of a hinge and the limb, for an axis 15 deg off the perpendicular. Our
choice: a hinge across the limb then bends about this axis with 1 - 0.26^2 = 93 % of its stiffness."""


def elastic_faults(anatomy: Anatomy, skeleton: Skeleton) -> Iterator[Fault]:
    """Yield a fault for the joints that no elastic hinge can replace, whatever its material."""
    reasons: dict[str, list[str]] = {}
    for joint, gap in zip(anatomy.joints, skeleton.gaps, strict=True):
        reason = unsupported_reason(joint, gap)
        if reason:
            reasons.setdefault(reason, []).extend(joint.names)
    for reason, names in reasons.items():
        yield Fault(
            code="joint_not_elastic",
            layer="realizability",
            severity="error",
            names=tuple(names),
            message=reason,
            cure=(
                "Use one hinge, or two crossed hinges of equal stiffness through one point, each with a stiffness and "
                "an axis perpendicular to the limb."
            ),
        )


def unsupported_reason(joint: Joint, gap: Gap) -> str:
    """Return why no rod or neck can replace a joint; "" where one can.

    Args:
        joint: The joint.
        gap: The gap at this joint, which has the directions of the limb.
    """
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
    if joint.kind == "hinge" and any(_twists(axis, gap) for axis in joint.axes):
        return "twists its limb, or does so in part; rods and necks bend, and their stiffness in twist cannot be chosen"
    low, high = min(joint.stiffness_n_m_rad), max(joint.stiffness_n_m_rad)
    return "" if high <= (1 + _SAME_STIFFNESS) * low else "has axes of different stiffness"


def _twists(axis: Vec3, gap: Gap) -> bool:
    """Whether a hinge turns a limb about its own direction, before and after the gap, rather than bends it."""
    return min(abs(float(np.dot(axis, along))) for along in (gap.before, gap.after)) > _MOST_ALONG
