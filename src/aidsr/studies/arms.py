"""Named arms of a study. Each arm is only a configuration of existing settings; none has code of its own."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args

from pydantic import ValidationError

from aidsr.core.config import Method, Protocol, RunConfig, StudyMethod, checked_config
from aidsr.core.errors import UserError
from aidsr.core.suggestions import closest_name
from aidsr.core.text_files import parse_toml, read_text_file
from aidsr.studies.file_errors import first_error
from aidsr.studies.study import Arm, StudyPlan, versions_now
from aidsr.tasks import load_task, task_names

_WITH_A_PERSON = ("human", "human_only")
_SAME_DESIGNS = ("human", "no_groups", "from_probe")
"""Methods that continue the designs of the full method."""
_CONFIG: dict[StudyMethod, dict[str, Any]] = {
    "human_only": {"method": "no_feedback", "iterations": 0},
    "no_repairs": {"repairs": False},
    "task_feedback": {"task_feedback": True},
    "measuring": {"team": "measuring"},
}


Baseline = Literal["reference", "search"]
"""Baseline arms: robots designed by hand, one for each task, and CMA-ES over the parameters of a built-in family
(`aidsr.teams.baselines`)."""


_BASELINES: dict[Baseline, Arm] = {
    "reference": Arm(name="reference", runs=1, config=RunConfig(model="reference", concepts=1, iterations=0)),
    "search": Arm(name="search", config=RunConfig(model="search", concepts=1, early_stop=False)),
}


def _baseline(name: Baseline, search_robots: int) -> Arm:
    arm = _BASELINES[name]
    if name != "search":
        return arm
    return arm.model_copy(update={"config": arm.config.updated({"search_robots": search_robots})})


def make_plan(
    tasks: Sequence[str],
    models: Sequence[str],
    ways: Sequence[StudyMethod],
    *,
    level: Literal["standard", "hard"] = "standard",
    feedback: Path | None = None,
    baselines: Sequence[Baseline] = (),
    search_robots: int = _BASELINES["search"].config.search_robots,
    designs: int,
    concepts: int,
    seeds: int,
    steps: int,
    probe: bool,
    protocol: Protocol = "best",
    perturbed: bool = False,
) -> StudyPlan:
    """Return the plan of a study; see `StudyPlan` and `make_arms` for what the arguments mean.

    Args:
        tasks: Names of the tasks, or only "all".
        models: See `make_arms`.
        ways: See `make_arms`.
        level: Level of the tasks.
        feedback: File with a person's feedback on the designs of each task.
        baselines: See `make_arms`.
        search_robots: See `make_arms`.
        designs: Number of designs of each task and arm, a multiple of `concepts`.
        concepts: Number of concepts of each run.
        seeds: Number of policies trained for each approved design.
        steps: Training budget of each policy in control steps.
        probe: Whether each approved design is also probed with open-loop motions.
        protocol: Training protocol of the policies.
        perturbed: Whether successful policies are also evaluated in perturbed scenes.

    Raises:
        UserError: A name is unknown, or the options are inconsistent.
    """
    if designs % concepts:
        whole = designs // concepts * concepts
        near = " or ".join(str(each) for each in (whole, whole + concepts) if each > 0)
        raise UserError(
            f"{designs} designs per task is not a multiple of {concepts} concepts per run; use {near} designs, or "
            f"set concepts to {designs if designs <= 20 else 1}"
        )
    chosen = task_names() if list(tasks) == ["all"] else tuple(load_task(name).name for name in tasks)
    said = read_feedback(feedback, chosen) if feedback else {}
    arms = make_arms(models, ways, concepts=concepts, feedback=said, baselines=baselines, search_robots=search_robots)
    try:
        return StudyPlan(
            tasks=chosen,
            level=level,
            arms=arms,
            runs=designs // concepts,
            seeds=seeds,
            steps=steps,
            protocol=protocol,
            probe=probe,
            perturbed=perturbed,
            versions=versions_now(),
        )
    except ValidationError as error:
        raise UserError(first_error(error)) from None


def make_arms(
    models: Sequence[str],
    ways: Sequence[StudyMethod],
    *,
    concepts: int,
    feedback: Mapping[str, str],
    baselines: Sequence[Baseline] = (),
    search_robots: int = _BASELINES["search"].config.search_robots,
) -> tuple[Arm, ...]:
    """Return one arm for each model and method, with names that are valid folder names.

    Args:
        models: Names of models.
        ways: Variants of the method.
        concepts: Number of concepts of each run.
        feedback: A person's feedback by task, for the methods that need it.
        baselines: Baselines, one arm each.
        search_robots: Number of robots that the search tries for each design, a multiple of eight.

    Raises:
        UserError: A name is unknown, a number is out of bounds, or a method needs another method, or a person's
            feedback, that was not given.
    """
    _require_known("method", ways, get_args(StudyMethod))
    _require_known("baseline", baselines, get_args(Baseline))
    lacking = [way for way in ways if way in _SAME_DESIGNS]
    if lacking and "full" not in ways[: ways.index(lacking[0])]:
        raise UserError(
            f'"{lacking[0]}" continues the designs of "full"; list "full" first: --method full {lacking[0]}'
        )
    spoken = [way for way in ways if way in _WITH_A_PERSON]
    if spoken and not feedback:
        raise UserError(f'"{spoken[0]}" requires the feedback of a person on each task; give it with --feedback FILE')
    designed = [_arm(model, way, concepts, feedback) for model in models for way in ways]
    return (*designed, *(_baseline(name, search_robots) for name in baselines))


def _arm(model: str, way: StudyMethod, concepts: int, feedback: Mapping[str, str]) -> Arm:
    name = re.sub(r"[^a-z0-9._-]+", "-", model.lower()).strip("-.")
    changed = {"method": way} if way in get_args(Method) else _CONFIG.get(way, {})
    return Arm(
        name=name if way == "full" else f"{name}.{way}",
        after=name if way in _SAME_DESIGNS else "",
        feedback=dict(feedback) if way in _WITH_A_PERSON else {},
        grouping="off" if way == "no_groups" else "auto",
        from_probe=way == "from_probe",
        # the paper counts iterations, so a design must not end before they are used up
        config=checked_config({"model": model, "concepts": concepts, "early_stop": False, **changed}),
    )


def _require_known(kind: str, names: Sequence[str], known: Sequence[str]) -> None:
    for name in names:
        if name not in known:
            near = closest_name(name, known)
            raise UserError(f"no such {kind}: {name}; {f'did you mean {near}?' if near else ', '.join(known)}")


_MAX_BYTES = 2**20


def read_feedback(path: Path, tasks: Sequence[str]) -> dict[str, str]:
    """Return a person's feedback on the designs of each task, from a TOML file with one text per task.

    Raises:
        UserError: The file cannot be read, or has no text for a task.
    """
    try:
        found = parse_toml(read_text_file(path, max_bytes=_MAX_BYTES))
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise UserError(
            f"{path} cannot be read as a person's feedback: {why}; give a TOML file as docs/studies.md shows"
        ) from None
    texts = {load_task(name).name: str(text).strip() for name, text in found.items()}
    silent = [task for task in tasks if not texts.get(task)]
    if silent:
        raise UserError(
            f"{path} has no feedback on {', '.join(silent)}; add a line for each task, such as: "
            f'{silent[0].rpartition("/")[2]} = "Longer."'
        )
    return {task: texts[task] for task in tasks}
