"""`aidsr train`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.apps.cli.flag import Flag
from aidsr.core.config import BUDGET_STEPS, Protocol
from aidsr.core.progress_lines import INTERRUPTED


def train(
    design: Path,
    /,
    *,
    task: str | None = None,
    level: Literal["standard", "hard"] | None = None,
    goal: Path | None = None,
    protocol: Protocol = "best",
    steps: Annotated[int, Parameter(validator=Number(gte=1))] = BUDGET_STEPS,
    minutes: Annotated[float | None, Parameter(validator=Number(gt=0, lt=math.inf))] = None,
    seeds: Annotated[int, Parameter(validator=Number(gte=1, lte=100))] = 1,
    first_seed: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    out: Path | None = None,
    grouping: Literal["auto", "off"] = "auto",
    from_probe: Flag = False,
    smoothing: Annotated[float, Parameter(validator=Number(gte=0, lt=1))] = 0.0,
    randomize: Flag = False,
    stop_hopeless: Flag = False,
    script: str = "own",
    threads: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    tensorboard: Flag = False,
    evaluate: bool = True,
    videos: bool = True,
    again: Flag = False,
) -> int:
    """Train a policy for a robot by reinforcement learning, and evaluate it.

    Exit code 0: at least one policy is successful (or --no-evaluate was given). 1: none is. 2: a mistake in the
    command. 130: interrupted. To continue a stopped training, repeat the command; finished policies are not trained
    again, their results are only printed.

        aidsr train runs/2026-01-31_1002_button_pushing_7f3a/designs/1

        aidsr train scene.xml --task button_pushing --seeds 3 --out learned

        aidsr train scene.xml --goal goal.toml

    Parameters
    ----------
    design
        Folder of an approved design, or MJCF of a scene: a robot placed in the environment of a task.
    task
        Benchmark task; not needed for a design, which records its task.
    level
        Level of the task; default: that of the design, for a scene "standard".
    goal
        TOML file that defines how success is measured in your own environment, instead of a task.
    protocol
        Algorithm and its settings. "best" is soft actor-critic, each action held for three control steps; "paper" is
        PPO, for comparison.
    steps
        Maximum control steps (actions) for each policy; training ends earlier when the success rate is saturated.
    minutes
        Maximum wall time for each policy in minutes; default: none. A training that it ends cannot be repeated step by
        step.
    seeds
        Number of policies to train, one after the other.
    first_seed
        Seed of the first policy; the others use the seeds that follow.
    out
        Folder for the folders 001, 002 …; default: training/ in the design's folder, or in the current folder.
    grouping
        "auto" groups actuators as in the design, or by symmetric limbs; "off" gives each actuator its own action.
    from_probe
        With --protocol paper: first search an open-loop motion, as `aidsr probe` does; if one succeeds, the policy
        starts from it.
    smoothing
        Share of the previous action that is kept in the next one, from 0 to below 1. Try 0.7 for a soft robot that
        trembles at its goal; a crawler may need fast strokes.
    randomize
        Vary the model in each training episode as a real robot may differ from it: parameters changed by up to 20 %,
        actions delayed by 40 ms in half of the episodes, cable friction at the guides.
    stop_hopeless
        Stop a training of 10,000 steps or more in which no episode has succeeded after 70 % of them. Requires
        --protocol best.
    script
        Motion that the policy starts from and corrects. "own": the motion with which the design's author saw it do the
        task; if there is none, a short probe searches a motion that learning has to beat. "none": no motion. Otherwise
        a file with a motion script (docs/tools.md), which requires --protocol best.
    threads
        Native threads for physics; 0 uses all processors. Results do not depend on it.
    tensorboard
        Also write logs for TensorBoard.
    evaluate
        Evaluate each policy on held-out variations.
    videos
        Write videos of the best and the median of those episodes.
    again
        Train again into the next folders, even if earlier trainings are finished or stopped.
    """
    from aidsr.core.extras import require_extra

    require_extra("rl", "training")
    from aidsr.api import find_scene
    from aidsr.apps.cli.terminal import make_console
    from aidsr.apps.cli.training import Trainer
    from aidsr.core.errors import with_source
    from aidsr.learn.openloop.script import read_script
    from aidsr.learn.rl.recipe import NAMED_SCRIPTS, recipe_of

    motion = script if script in NAMED_SCRIPTS else read_script(Path(script))
    recipe = recipe_of(
        protocol,
        from_probe=from_probe,
        smoothing=smoothing,
        randomize=randomize,
        stop_hopeless=stop_hopeless,
        script=motion,
    )
    found = find_scene(design, task or "", level=level, goal=goal or "")
    console = make_console()
    recipe = recipe.starting_from(motion, found.script)
    if motion == "own" and recipe.script:
        console.print("The policy starts from the script of the design's author; --script none trains without it")
    trainer = Trainer(
        console,
        steps,
        range(first_seed, first_seed + seeds),
        recipe,
        minutes=minutes,
        threads=threads,
        tensorboard=tensorboard,
        evaluate=evaluate,
        videos=videos,
        again=again,
    )
    try:
        with with_source(design):
            successful = trainer.train(found, out if out is not None else found.trainings, grouping)
    except KeyboardInterrupt:
        same = "the same command without --again" if again else "the same command"
        console.print(f"\n{INTERRUPTED}; repeat {same} to continue", soft_wrap=True)
        return 130
    return 0 if successful else 1
