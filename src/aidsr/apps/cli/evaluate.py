"""`aidsr evaluate`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number


def evaluate(
    training: Path,
    /,
    *,
    episodes: Annotated[int, Parameter(validator=Number(gte=20))] = 100,
    level: Literal["standard", "hard"] | None = None,
    split: Literal["held_out", "development"] = "held_out",
    threads: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    videos: bool = True,
    perturbed: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    json: Annotated[bool, Parameter(negative="", show_default=False)] = False,
) -> int:
    """Evaluate a trained policy on variations of its task that it has never seen.

    Writes evaluation.json, curve.png and two videos beside the policy; at another level or on another split only a file
    of its own, such as evaluation_hard.json. Exit code 0 means a successful policy, 1 another one, 2 a mistake in the
    command.

        aidsr evaluate runs/2026-01-31_1002_button_pushing_7f3a/designs/1/training/001

    Parameters
    ----------
    training
        Folder of a finished training.
    episodes
        How many variations; a verdict has 100.
    level
        Level of the task; that of the training unless given.
    split
        Variations that score the policy, or those that may be looked at while designing.
    threads
        Native threads for physics; 0 takes all processors.
    videos
        Draw the best and the median episode.
    perturbed
        Play the same variations again with parameters of the model off by up to 20 %, with actions 40 ms late and with
        friction of cables, and report what share of the success is kept. Takes nine times as many episodes; the verdict
        stays the same.
    json
        Print the whole evaluation as JSON.
    """
    from aidsr import api
    from aidsr.apps.cli.terminal import make_console, write_document
    from aidsr.apps.cli.training import evaluating, print_evaluation

    asked = partial(
        api.evaluate,
        training,
        episodes=episodes,
        level=level,
        split=split,
        threads=threads,
        videos=videos,
        perturbed=perturbed,
    )
    if json:
        evaluation = asked()
        write_document(evaluation.model_dump_json(indent=2) + "\n")
    else:
        console = make_console()
        films = videos and level is None and split == "held_out"
        with evaluating(console, episodes, videos=films, perturbed=perturbed) as listen:
            evaluation = asked(listen=listen)
        print_evaluation(console, training, evaluation)
    return 0 if evaluation.successful else 1
