"""Whether results in the folder of a study are those that its plan asks for.

`aidsr train` and `aidsr probe` write into the same folders of a design, with any settings; such results do not count.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aidsr.core.artifacts import Robot
from aidsr.core.errors import UserError
from aidsr.runs import DesignFolder
from aidsr.runs.files import JsonFile
from aidsr.runs.trainings import Training
from aidsr.studies.study import Cell, Study
from aidsr.tasks import BENCHMARK_VERSION, load_task

if TYPE_CHECKING:
    from aidsr.learn.rl.recipe import Recipe

PROBE_SEED = 0
"""Seed of the probes of a study."""
_RECIPE = ("algorithm", "script", "smoothing", "randomize", "stop_hopeless")
"""Compared fields of a recipe: those that a protocol or an option of `aidsr train` sets. The other fields are not
compared, because a protocol's values may change from version to version, and finished studies stay readable."""


def training_folder_of(design: DesignFolder, seed: int) -> Path:
    """Return the training folder of a design's policy; 001 belongs to seed 0."""
    return design.trainings / f"{seed + 1:03d}"


def robot_of(design: DesignFolder) -> Robot:
    """Return the robot of a design's final scene."""
    return next(robot for it in design.leading_to() if (robot := it.robot.read()))


def planned_recipe(study: Study, cell: Cell, design: DesignFolder) -> Recipe:
    """Return the recipe with which a study trains the policies of a design."""
    from aidsr.learn.rl.recipe import recipe_of

    script = robot_of(design).script if study.plan.protocol == "best" else ""
    return recipe_of(study.plan.protocol, from_probe=study.arm(cell.arm).from_probe, script=script)


def unplanned_settings(study: Study, cell: Cell, design: DesignFolder, seed: int) -> tuple[str, ...]:
    """Return the settings in which the training in the folder of a policy differs from the study's plan.

    Empty for a folder without a training. A setting that config.json does not contain, as of earlier versions, does not
    differ.

    Args:
        study: The study.
        cell: The run.
        design: A design of that run.
        seed: Seed of the policy.

    Raises:
        UserError: config.json cannot be read.
    """
    config: dict[str, Any] = Training(training_folder_of(design, seed)).config.read() or {}
    plan = study.plan
    planned = {"task": cell.task, "level": plan.level, "steps": plan.steps, "seed": seed, "minutes": None}
    differing = [name for name, value in planned.items() if config.get(name, value) != value]
    if study.arm(cell.arm).grouping == "off" and config.get("groups_from", "none") != "none":
        differing.append("groups_from")
    found = config.get("recipe")
    if isinstance(found, dict):
        recipe = planned_recipe(study, cell, design).as_asked().model_dump()
        if found.get("from_probe"):
            found = {**found, "script": ""}  # a motion that the training found, see `Recipe.as_asked`
        compared = (*_RECIPE, "from_probe") if plan.protocol == "paper" else _RECIPE
        differing += [name for name in compared if found.get(name, recipe[name]) != recipe[name]]
    return tuple(differing)


def planned_seeds(study: Study, cell: Cell, design: DesignFolder) -> tuple[int, ...]:
    """Return the seeds of a design's policies, without those whose folder holds another training than planned.

    Raises:
        UserError: A config.json cannot be read.
    """
    return tuple(seed for seed in range(study.plan.seeds) if not unplanned_settings(study, cell, design, seed))


def unplanned_probe(study: Study, cell: Cell, design: DesignFolder) -> tuple[str, ...]:
    """Return the settings in which the probe of a design differs from the probes of a study; see `unplanned_settings`.

    Raises:
        UserError: probe.json cannot be read.
    """
    report = read_probe(design)
    planned = {"task": cell.task, "level": study.plan.level, "seed": PROBE_SEED}
    if report.get("benchmark_version") == BENCHMARK_VERSION and report.get("max_steps"):
        planned["max_steps"] = _usual_steps(cell.task, study.plan.level) or report["max_steps"]
    return tuple(name for name, value in planned.items() if report.get(name, value) != value)


def read_probe(design: DesignFolder) -> dict[str, Any]:
    """Return the fields of the report of a design's probe; empty where there is none.

    Raises:
        UserError: probe.json cannot be read.
    """
    return JsonFile(design.probe, dict[str, Any]).read() or {}


@lru_cache(maxsize=100)
def _usual_steps(task: str, level: Any) -> int:
    """Return the default physics steps of a probe of a task; 0 where the package of the task is not installed."""
    from aidsr.learn.openloop.probe_scene import budget_for

    try:
        return budget_for(load_task(task, level))[1]
    except UserError:
        return 0
