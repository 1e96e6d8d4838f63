"""Teams that ask no language model: fixed rules, reference robots, and a search over the rules' parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from aidsr.core.config import BUILTIN
from aidsr.teams.providers.provider import Provider

if TYPE_CHECKING:
    from aidsr.core.config import RunConfig
    from aidsr.core.roles import Team
    from aidsr.runs import Run
    from aidsr.teams.baselines.generations import Generation


def _rules_team(run: Run, config: RunConfig) -> Team:
    if run.goal.path.exists():
        from aidsr.tasks import read_goal
        from aidsr.teams.fitting import fitting_team

        return fitting_team(read_goal(run.goal.path), config.seed)
    from aidsr.teams import rules

    return rules.team(config.seed)


def _reference_team(run: Run, config: RunConfig) -> Team:
    from aidsr.teams.baselines import reference

    del run, config
    return reference.team()


def _search_team(run: Run, config: RunConfig) -> Team:
    """Return the team of the search; generations measured before an interruption are read from the run's folder."""
    from aidsr.teams.baselines.generations import read_search, write_search
    from aidsr.teams.baselines.search import team

    known = list(read_search(run))

    def record(generation: Generation) -> None:
        known.append(generation)
        write_search(run, known)

    level = run.asked().level or "standard"
    return team(config.seed, level, config.search_robots, known=tuple(known), on_generation=record)


RULES = Provider(
    prefix=BUILTIN,
    title="Built-in rules",
    doc="Fixed rules written by people. No API key, no cost: a task of the benchmark takes seconds, a goal of your "
    "own half a minute to some minutes.",
    team=_rules_team,
)

REFERENCE = Provider(
    prefix="reference",
    title="Reference robots",
    doc="One robot for each benchmark task, designed by hand.",
    team=_reference_team,
)

SEARCH = Provider(
    prefix="search",
    title="Search",
    doc="CMA-ES over the parameters of the built-in rules' robots.",
    team=_search_team,
    extra="search",
)
