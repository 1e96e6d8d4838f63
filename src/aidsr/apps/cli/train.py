"""`aidsr train`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.core.config import Protocol


def train(
    scene: Path,
    /,
    *,
    task: str | None = None,
    level: Literal["standard", "hard"] | None = None,
    goal: Path | None = None,
    protocol: Protocol = "best",
    steps: Annotated[int, Parameter(validator=Number(gte=1))] = 300_000,
    minutes: Annotated[float | None, Parameter(validator=Number(gt=0))] = None,
    seeds: Annotated[int, Parameter(validator=Number(gte=1, lte=100))] = 1,
    first_seed: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    out: Path | None = None,
    grouping: Literal["auto", "off"] = "auto",
    from_probe: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    smoothing: Annotated[float, Parameter(validator=Number(gte=0, lt=1))] = 0.0,
    randomize: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    stop_hopeless: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    script: str = "own",
    threads: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    tensorboard: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    evaluate: bool = True,
    videos: bool = True,
    again: Annotated[bool, Parameter(negative="", show_default=False)] = False,
) -> int:
    """Train a policy for a robot by reinforcement learning, and evaluate it.

    Exit code 0 means that at least one policy is successful (or that none was to be evaluated), 1 that none is, 2 a
    mistake in the command, 130 an interruption. The same command continues where an earlier one stopped; what that one
    finished is not trained again, only printed.

        aidsr train runs/2026-01-31_1002_button_pushing_7f3a/designs/1

        aidsr train scene.xml --task button_pushing --seeds 3 --out learned

        aidsr train scene.xml --goal goal.toml

    Parameters
    ----------
    scene
        Folder of an approved design, or MJCF of a robot placed in the environment of a task.
    task
        Task to learn; a design knows its own.
    level
        Level of the task.
    goal
        Goal in a file, instead of a task, for an environment of your own.
    protocol
        "best" is soft actor-critic on held actions; "paper" is PPO, for comparison.
    steps
        Budget of control steps for each seed; training ends earlier when success is saturated.
    minutes
        Budget of wall time for each seed as well. What it cuts short, the same seed does not repeat step by step.
    seeds
        How many policies to train, one after the other.
    first_seed
        Seed of the first; the others follow it.
    out
        Where folders 001, 002 … are made: training/ in the design's folder, or here, unless named.
    grouping
        "auto" lets actuators act together as the design says or as symmetric limbs do; "off" gives each an action.
    from_probe
        With protocol "paper": search an open-loop motion first, as `aidsr probe` does; where one succeeds, the policy
        begins with it.
    smoothing
        Share of the previous action that is kept in the next, 0 to below 1. Try 0.7 for a soft body that trembles
        at its goal; a crawler may need quick strokes.
    randomize
        Let each training episode differ from the model as a real robot may: parameters off by up to 20 %, actions
        40 ms late in half of the episodes, cables that rub at their guides.
    stop_hopeless
        End a training in which no episode has succeeded after 70 % of its steps. With protocol "best".
    script
        Motion that the policy begins with and corrects: "own" is that with which the design's author saw it do the job,
        where there is one, else a short probe searches a motion that learning has to beat; "none" does without any of
        them; else a file. With protocol "best".
    threads
        Native threads for physics; 0 takes all processors. Results do not depend on it.
    tensorboard
        Also write logs for TensorBoard.
    evaluate
        Evaluate each policy on held-out variations.
    videos
        Draw the best and the median of those episodes.
    again
        Train again, into the next folders, whatever earlier commands have left.
    """
    from aidsr.core.extras import require_extra

    require_extra("rl", "training")
    from aidsr.api import find_scene
    from aidsr.apps.cli.terminal import make_console
    from aidsr.apps.cli.training import Trainer
    from aidsr.core.errors import about
    from aidsr.learn.openloop.script import read_script
    from aidsr.learn.rl.recipe import recipe_of

    given = read_script(Path(script)) if script not in ("own", "none") else ""
    recipe = recipe_of(
        protocol,
        from_probe=from_probe,
        smoothing=smoothing,
        randomize=randomize,
        stop_hopeless=stop_hopeless,
        script=given,
    )
    found = find_scene(scene, task or "", level=level, goal=goal or "")
    console = make_console()
    if script == "none" and protocol == "best":
        recipe = recipe.from_nothing()
    if script == "own" and protocol == "best" and found.script:
        recipe = recipe.beginning_with(found.script)
        console.print("The policy begins with the script of the design's author; --script none trains from nothing")
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
        with about(scene):
            successful = trainer.train(found, out if out is not None else found.home / "training", grouping)
    except KeyboardInterrupt:
        same = "the same command without --again" if again else "the same command"
        console.print(f"\nInterrupted. What was learned is kept; {same} continues", soft_wrap=True)
        return 130
    return 0 if successful else 1
