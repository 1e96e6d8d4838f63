"""The bodies that are measured: designs of the built-in team, made with the first seed that proposes the family."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path

from plain import PlainButton, PlainEnv, PlainGround

import aidsr
from aidsr.teams import rules as builtin


@dataclass(frozen=True)
class Body:
    """A body that is measured, and its task."""

    name: str
    """Family of the built-in team's design."""
    task: str
    plain: type[PlainEnv]
    success: float


BODIES = (
    Body("arm", "reaching/button_pushing", PlainButton, 0.8),
    Body("crawler", "locomotion/flat_ground", PlainGround, 0.5),
)


def made(body: Body, folder: Path) -> Path:
    """Let the built-in team design the body; return the path of its scene."""
    brief = aidsr.load_task(body.task).brief()
    seeds = (seed for seed in itertools.count() if builtin.team(seed).designer.propose(brief, 1)[0].family == body.name)
    run = aidsr.design(task=body.task, concepts=1, seed=next(seeds), runs=folder)
    return run.design(1).final_scene.path
