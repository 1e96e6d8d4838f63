"""How deep two parts may overlap in the drawn pose; the validator and the fixes of a document share it."""

from __future__ import annotations

OVERLAP_SHARE = 0.2
"""Overlap / thickness of the thinner geom."""
OVERLAP_NOTICED = 0.002
"""Overlap / L below which the share of thickness does not matter: rounding in written coordinates."""
OVERLAP_LENGTH = 0.01
"""Overlap / L that is too much however thick the parts are."""


def overlaps_too_much(depth_m: float, thickness_m: float, length_m: float) -> bool:
    """Return whether an overlap is too deep.

    Args:
        depth_m: How deep one geom is inside the other [m].
        thickness_m: Smallest width of the thinner geom [m].
        length_m: The robot's characteristic length L [m].

    Source: our choice, placed between robots known to be good and robots known to be bad.
    """
    too_thick = depth_m > OVERLAP_SHARE * thickness_m and depth_m > OVERLAP_NOTICED * length_m
    return too_thick or depth_m > OVERLAP_LENGTH * length_m
