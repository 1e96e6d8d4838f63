"""The robot families of the built-in team: six built-in ones, one file each, and those of other packages.

A package adds a family through the entry-point group "aidsr.families": the entry's name is the name of the family, its
value is the `Family` record.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aidsr.core.plugins import PluginGroup
from aidsr.teams.rules.families.arm import ARM
from aidsr.teams.rules.families.crawler import CRAWLER
from aidsr.teams.rules.families.family import (
    Description,
    Family,
    Is,
    Parameters,
    Preference,
    Suits,
)
from aidsr.teams.rules.families.gripper import GRIPPER
from aidsr.teams.rules.families.ring import RING
from aidsr.teams.rules.families.tentacle import TENTACLE
from aidsr.teams.rules.families.worm import WORM
from aidsr.teams.rules.job_kinds import JobKindName, words_in

__all__ = [
    "BUILT_IN",
    "PLUGINS",
    "Description",
    "Families",
    "Family",
    "Is",
    "Parameters",
    "Preference",
    "Suits",
    "load_families",
    "preferred_family",
    "variants_for",
]

Families = Mapping[str, Family[Any]]
"""Families by name."""

BUILT_IN: Families = {family.name: family for family in (ARM, TENTACLE, GRIPPER, CRAWLER, WORM, RING)}

PLUGINS = PluginGroup[Family[Any]](group="aidsr.families", noun="family", kind=Family, builtin=lambda: BUILT_IN.keys())


def load_families() -> Families:
    """Return all families: the built-in ones, then those of other packages by name.

    Raises:
        UserError: A family of another package cannot be loaded, or its name is taken.
    """
    return dict(BUILT_IN) | {plugin.name: plugin.value for plugin in PLUGINS.load_all()}


def variants_for(kind: JobKindName, families: Families) -> dict[str, tuple[str, ...]]:
    """Return the variants of each family that suits a kind of job, by family, in order of rank."""
    suited = sorted((family.jobs[kind].rank, name) for name, family in families.items() if kind in family.jobs)
    return {name: families[name].jobs[kind].variants for _, name in suited}


def preferred_family(kind: JobKindName, objective: str, families: Families) -> tuple[str, str] | None:
    """Return the family to propose first, and why; None if no family is known to be better than the others."""
    matching = [
        (preference.rank, name, preference.because)
        for name, family in families.items()
        if kind in family.jobs
        for preference in family.jobs[kind].preferred
        if not preference.words or words_in(objective, preference.words)
    ]
    return min(matching)[1:] if matching else None
