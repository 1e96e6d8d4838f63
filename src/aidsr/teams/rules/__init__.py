"""The built-in team: the four roles as fixed rules. It needs no key, costs nothing, and states that it is rules."""

from __future__ import annotations

from aidsr.core.roles import Team

__all__ = ["team"]


def team(seed: int) -> Team:
    """Return the team that works by rules.

    Args:
        seed: Seed; the same seed and brief give the same designs, byte for byte.
    """
    from aidsr.teams.rules.coder import RuleCoder
    from aidsr.teams.rules.designer import RuleDesigner
    from aidsr.teams.rules.integrator import RuleIntegrator
    from aidsr.teams.rules.judge import RuleJudge

    return Team(RuleDesigner(seed), RuleCoder(), RuleIntegrator(), RuleJudge())
