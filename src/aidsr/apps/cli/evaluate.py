"""`aidsr evaluate`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.apps.cli.flag import Flag
from aidsr.core.config import LEAST_EPISODES, VERDICT_EPISODES


def evaluate(
    training: Path,
    /,
    *,
    episodes: Annotated[int, Parameter(validator=Number(gte=LEAST_EPISODES))] = VERDICT_EPISODES,
    level: Literal["standard", "hard"] | None = None,
    split: Literal["held_out", "development"] = "held_out",
    threads: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    videos: bool = True,
    perturbed: Flag = False,
    json: Flag = False,
) -> int:
    """Evaluate a trained policy on held-out variations of its task.

    Writes evaluation.json, curve.png and two videos beside the policy. At another level or on another split it writes
    only a separate file, such as evaluation_hard.json. Exit code 0: the policy is successful. 1: it is not. 2: a
    mistake in the command.

        aidsr evaluate runs/2026-01-31_1002_button_pushing_7f3a/designs/1/training/001

    Parameters
    ----------
    training
        Folder of a finished training.
    episodes
        Number of variations to evaluate, one episode each, at least 20; a verdict of the benchmark has 100.
    level
        Level of the task; default: the level of the training.
    split
        "held_out" are the variations that score the policy; "development" are those that may be used while designing.
    threads
        Native threads for physics; 0 uses all processors. Results do not depend on it.
    videos
        Write videos of the best and the median episode.
    perturbed
        Repeat the same variations with model parameters changed by up to 20 %, with actions delayed by 40 ms and with
        cable friction, and report the share of the success rate that is kept. This takes nine times as many episodes;
        the verdict does not change.
    json
        Print the complete evaluation as JSON.
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
