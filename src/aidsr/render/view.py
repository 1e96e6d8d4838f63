"""Viewing direction of a picture."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class View:
    """Viewing direction and other options of a picture; angles that are None are chosen automatically."""

    azimuth_deg: float | None = None
    elevation_deg: float | None = None
    closeness: float = 1.0
    """Factor by which the camera is closer than by default."""
    authored: bool = False
    """Whether to use the free camera that the MJCF itself defines (`visual/global`, `statistic`), for an environment
    without a robot."""
    shown: tuple[str, ...] = ()
    """Names of bodies and sites that must be in the picture, and not hidden if there is such a viewing direction."""
