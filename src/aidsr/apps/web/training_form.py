"""The form that starts a training of a design, with what `aidsr train` can be told."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, get_args

from nicegui import app, ui

from aidsr.apps.web.form_values import whole_number, whole_number_field
from aidsr.apps.web.live import as_action
from aidsr.apps.web.measure_form import measure_arguments, measure_field
from aidsr.apps.web.site import Site
from aidsr.apps.web.widgets import box, button, text
from aidsr.core.config import BUDGET_STEPS, Protocol
from aidsr.core.errors import UserError
from aidsr.core.formatting import format_duration
from aidsr.learn.rl.recipe import LEAST_TELLING, recipe_of
from aidsr.runs import DesignFolder, Run
from aidsr.runs.trainings import Training, trainings_of

_DEFAULTS: dict[str, Any] = {
    "steps": BUDGET_STEPS,
    "seeds": 1,
    "first_seed": 0,
    "protocol": "best",
    "task": "",
    "films": True,
}
"""Defaults of `aidsr train`."""
_STEPS: dict[str, Any] = {"title": "Maximum steps", "least": 1}
_SEEDS: dict[str, Any] = {"title": "Policies (trained in sequence)", "least": 1, "most": 100}
_FIRST_SEED: dict[str, Any] = {"title": "First seed", "least": 0}
"""Title and bounds of each number field; the bounds are those of `aidsr train`."""


def training_form(site: Site, run: Run, design: DesignFolder, name: str, *, is_first: bool) -> None:
    """Show the form of a training; `is_first` says whether starting it is the first thing to do."""
    choices: dict[str, Any] = app.storage.user.setdefault("training", {})
    for key, value in _DEFAULTS.items():
        choices.setdefault(key, value)

    def start() -> None:
        words = ["--steps", str(whole_number(value=choices["steps"], **_STEPS))]
        words += ["--seeds", str(whole_number(value=choices["seeds"], **_SEEDS))]
        words += ["--first-seed", str(whole_number(value=choices["first_seed"], **_FIRST_SEED))]
        words += ["--protocol", str(choices["protocol"])]
        words += [*measure_arguments(site, run, choices, name), *([] if choices["films"] else ["--no-videos"])]
        site.processes.start(name, ["train", str(design.path), *words])

    def follow() -> None:
        hint.set_text(_hint(steps.value))
        hint.set_visibility(bool(hint.text))
        estimate.set_text(_estimate(design, choices))

    with box("sheet stack"):
        text("Train this design", tag="h2")
        text(
            "Trains a policy with reinforcement learning, then evaluates it on held-out variations of the task.",
            "soft",
            "p",
        )
        with box("form"):
            steps = whole_number_field(**_STEPS, step=1000).bind_value(choices, "steps")
            seeds = whole_number_field(**_SEEDS).bind_value(choices, "seeds")
        hint = ui.label().classes("small soft")
        measure_field(run, choices)
        ui.switch("Record videos of the best and the median held-out episode").bind_value(choices, "films")
        with ui.expansion("More settings").props("dense dense-toggle").classes("full"), box("stack"):
            with box("form"):
                whole_number_field(**_FIRST_SEED).bind_value(choices, "first_seed")
            with box("row"):
                text("Training protocol", "small")
                protocol = ui.toggle(list(get_args(Protocol)))
                protocol.props('dense unelevated no-caps role=group aria-label="protocol"')
                protocol.bind_value(choices, "protocol")
                text('"best" is soft actor-critic; "paper" is PPO, for comparison.', "small soft")
        with box("row"):
            button("Start training", as_action(start), "primary" if is_first else "quiet", "play_arrow")
            estimate = ui.label().classes("small soft")
        for field in (steps, seeds, protocol):
            field.on_value_change(follow)
        follow()


def continues(command: Sequence[str], training: Training) -> bool:
    """Return whether a command, made by the form, is one that continues a training: its steps, a seed, its protocol."""
    options = dict(pairwise(command))
    config = training.config.read() or {}
    try:
        steps, first = int(options["--steps"]), int(options["--first-seed"])
        seeds, algorithm = int(options["--seeds"]), recipe_of(options["--protocol"]).algorithm  # type: ignore[arg-type]
    except (KeyError, ValueError, UserError):
        return False
    recipe = config.get("recipe") or {}
    return (
        config.get("steps") == steps
        and config.get("seed") in range(first, first + seeds)
        and recipe.get("algorithm", algorithm) == algorithm
    )


def _estimate(design: DesignFolder, choices: dict[str, Any]) -> str:
    """Return how long learning takes at the speed of the design's last training; empty without such a training."""
    algorithm = recipe_of(choices["protocol"]).algorithm
    for training in reversed(trainings_of(design)):
        recipe, result = (training.config.read() or {}).get("recipe") or {}, training.result.read() or {}
        if recipe.get("algorithm") == algorithm and result.get("steps"):
            step_s = result["wall_s"] / result["steps"]
            left_s = step_s * (choices["steps"] or 0) * (choices["seeds"] or 0)
            return f"At most about {format_duration(left_s)} of learning, at the speed of training {training.number}"
    return ""


def _hint(steps: float | None) -> str:
    """Return what a budget of so few steps is good for; empty where it is large enough to tell something."""
    return (
        "So few steps only show how training works, not whether the robot learns."
        if (steps or 0) < LEAST_TELLING
        else ""
    )
