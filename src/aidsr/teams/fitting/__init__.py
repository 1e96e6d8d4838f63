"""The built-in team for a goal of one's own: the rules' families, chosen by what the probe measures, not by words."""

from __future__ import annotations

from aidsr.teams.fitting.team import fitting_team

__all__ = ["fitting_team"]
