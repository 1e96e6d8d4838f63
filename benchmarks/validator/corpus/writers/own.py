"""Robots of this project's built-in team. They are a minority, because rules were developed with them in view."""

from __future__ import annotations

import numpy as np
from benchmarks.validator.corpus.writers.written import Written

from aidsr.tasks import TASKS_IN_SAMPLE, load_task
from aidsr.teams.rules import team


def write_own_robot(rng: np.random.Generator) -> Written:
    """Let the built-in team write a robot for a task of the benchmark."""
    brief = load_task(str(rng.choice(TASKS_IN_SAMPLE))).brief()
    roles = team(int(rng.integers(1000)))
    concepts = roles.designer.propose(brief, 3)
    concept = concepts[int(rng.integers(len(concepts)))]
    return Written(f"built-in {concept.family}", roles.coder.write(brief, concept).mjcf)
