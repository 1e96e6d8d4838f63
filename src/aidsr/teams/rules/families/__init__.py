"""The morphology families of the built-in team, by the label a concept carries."""

from __future__ import annotations

from typing import Any

from aidsr.teams.rules.families.arm import ARM
from aidsr.teams.rules.families.crawler import CRAWLER
from aidsr.teams.rules.families.family import Family, Parameters, Texts
from aidsr.teams.rules.families.gripper import GRIPPER
from aidsr.teams.rules.families.ring import RING
from aidsr.teams.rules.families.tentacle import TENTACLE
from aidsr.teams.rules.families.worm import WORM

__all__ = ["FAMILIES", "Family", "Parameters", "Texts"]

FAMILIES: dict[str, Family[Any]] = {family.label: family for family in (ARM, TENTACLE, GRIPPER, CRAWLER, WORM, RING)}
