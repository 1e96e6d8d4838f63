"""From where a picture looks."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class View:
    """From where to look; what is None is chosen."""

    azimuth_deg: float | None = None
    elevation_deg: float | None = None
    closeness: float = 1.0
    """Above 1 the camera comes nearer."""
    authored: bool = False
    """From where the MJCF itself says to look (`visual/global`, `statistic`), for a place without a robot."""
    shown: tuple[str, ...] = ()
    """Bodies and sites that must be in the picture, and in sight from where there is a side from which they are."""
