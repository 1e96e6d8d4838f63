"""Largest allowed overlap of two geoms in the reference pose; used by the validator and by the automatic fixes."""

from __future__ import annotations

OVERLAP_SHARE = 0.2
"""Largest allowed overlap / thickness of the thinner geom."""
OVERLAP_NOTICED = 0.002
"""Overlap / L below which `OVERLAP_SHARE` is not applied: such overlaps come from rounded coordinates."""
OVERLAP_LENGTH = 0.01
"""Largest allowed overlap / L, whatever the thickness of the geoms."""


def overlaps_too_much(depth_m: float, thickness_m: float, length_m: float) -> bool:
    """Return whether an overlap is too deep.

    Args:
        depth_m: Depth of the overlap [m].
        thickness_m: Smallest width of the thinner geom [m].
        length_m: The robot's characteristic length L [m].

    Source: our choice, placed between robots known to be good and robots known to be bad.
    """
    too_thick = depth_m > OVERLAP_SHARE * thickness_m and depth_m > OVERLAP_NOTICED * length_m
    return too_thick or depth_m > OVERLAP_LENGTH * length_m
