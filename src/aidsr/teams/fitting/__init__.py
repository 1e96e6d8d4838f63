"""The built-in team for a user's own goal: the rules' families, chosen by measurements of the probe, not by words."""

from __future__ import annotations

from aidsr.teams.fitting.team import fitting_team

__all__ = ["fitting_team"]
