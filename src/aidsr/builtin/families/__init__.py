"""The morphology families of the built-in team, by the label a concept carries."""

from __future__ import annotations

from typing import Any

from aidsr.builtin.families.arm import ARM
from aidsr.builtin.families.crawler import CRAWLER
from aidsr.builtin.families.family import Family, Parameters, Texts
from aidsr.builtin.families.gripper import GRIPPER
from aidsr.builtin.families.ring import RING
from aidsr.builtin.families.tentacle import TENTACLE
from aidsr.builtin.families.worm import WORM

__all__ = ["FAMILIES", "Family", "Parameters", "Texts"]

FAMILIES: dict[str, Family[Any]] = {family.label: family for family in (ARM, TENTACLE, GRIPPER, CRAWLER, WORM, RING)}
