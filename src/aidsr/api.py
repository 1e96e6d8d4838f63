"""The Python API for one design: assemble, probe, film, train, evaluate and export.

Each function takes plain values, a path, a text or an object, and does not depend on the others. The command line calls
the same functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from aidsr.core.arguments import check_type, check_whole_number
from aidsr.core.artifacts import ActuatorGroup, Evaluation, Placement, Robot, Scene
from aidsr.core.config import BUDGET_STEPS, VERDICT_EPISODES
from aidsr.core.errors import UserError
from aidsr.core.extras import require_extra
from aidsr.core.numbered import is_number
from aidsr.core.plain_tree import require_plain_tree, require_regular_file
from aidsr.runs.folders import DesignFolder
from aidsr.runs.status import newest
from aidsr.runs.trainings import Training, trainings_of

if TYPE_CHECKING:
    from aidsr.core.config import Protocol
    from aidsr.learn.episodes.actions import Grouping
    from aidsr.learn.episodes.policy_checks import EvaluationPoint
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.learn.openloop import ProbeReport
    from aidsr.learn.openloop.film import Film
    from aidsr.learn.openloop.probe_scene import ProbePoint
    from aidsr.learn.rl.curve_point import CurvePoint
    from aidsr.learn.rl.recipe import Recipe
    from aidsr.loop.export import Exported
    from aidsr.tasks import Level, Split, Task

Design = str | Path | DesignFolder | Scene
"""A design of a run or the folder of a design; or a scene as an object, as MJCF text or as the path of an MJCF file."""


def probe(
    design: Design,
    task: str | Task = "",
    *,
    level: Level | None = None,
    goal: str | Path = "",
    groups: Sequence[ActuatorGroup] | None = None,
    grouping: Grouping = "auto",
    candidates: int | None = None,
    variations: int = 2,
    max_steps: int | None = None,
    seed: int = 0,
    threads: int = 0,
    listen: Callable[[ProbePoint], None] = lambda _point: None,
) -> ProbeReport:
    """Measure how far a robot gets on its task without learning, with open-loop motions.

    Nothing is written. `aidsr probe` also keeps the report as probe.json in the design's folder, with a picture that
    `aidsr.api.film` draws.

        report = aidsr.probe(run.design(1))
        report = aidsr.probe("scene.xml", "button_pushing", candidates=512)
        print(report.progress, report.reached)

    Args:
        design: A design, its folder, or a scene.
        task: Task to try; not needed for a design, which records its task.
        level: Level of the task.
        goal: Goal file for an environment of your own, instead of a task.
        groups: Groups of actuators that act together; default: the groups of the design.
        grouping: "auto" groups actuators as in `groups`, or by symmetric limbs; "off" moves each actuator
            independently.
        candidates: Number of motions tried for each variation, in whole generations of 16. Default: 128; with a goal,
            256. At least 16.
        variations: Number of development variations of the task; each is searched separately.
        max_steps: Maximum physics steps of all simulations together. Default: 5,000 for each variation and second of
            the task's time limit, at least 300,000; with a goal, at least 1,000,000.
        seed: Seed of the search; the same seed tries the same motions.
        threads: Native threads for physics; 0 uses all processors. Results do not depend on it.
        listen: Called with the progress of the search after each generation of motions.

    Raises:
        TypeError: An argument has the wrong type.
        UserError: The design or the task does not exist, or a number is out of range.
        MjcfError: The scene cannot be loaded.
    """
    for name, number in (("candidates", candidates), ("variations", variations), ("max_steps", max_steps)):
        if number is not None:
            check_whole_number(name, number, least=1)
    _check_seed_and_threads(seed, threads)
    from aidsr.sandbox.pool import warm_up

    warm_up(1, ["aidsr.learn.openloop.isolated_probe"])  # a worker process starts during the remaining imports
    from aidsr.learn.openloop import probe as probe_task

    found = find_scene(design, task, level=level, goal=goal)
    return probe_task(
        found.scene,
        found.task,
        level=found.level,
        groups=found.groups if groups is None else groups,
        grouping=grouping,
        candidates=candidates,
        variations=variations,
        max_steps=max_steps,
        seed=seed,
        threads=threads,
        listen=listen,
    )


def film(
    design: Design,
    report: ProbeReport,
    task: str | Task = "",
    *,
    level: Level | None = None,
    goal: str | Path = "",
    groups: Sequence[ActuatorGroup] | None = None,
) -> Film:
    """Replay the best motion of a probe and return it as positions over time; the other arguments are as in `probe`.

        report = aidsr.probe(design)
        Path("best.png").write_bytes(aidsr.api.film(design, report).strip())

    Raises:
        UserError: The design or the task does not exist, or the report is one of another robot.
        MjcfError: The scene cannot be loaded.
    """
    from aidsr.learn.episodes.scene import read_mjcf_text
    from aidsr.learn.openloop.film import film as film_motion

    found = find_scene(design, task, level=level, goal=goal)
    return film_motion(
        read_mjcf_text(found.scene),
        found.task,
        report.best,
        level=found.level,
        groups=tuple(found.groups if groups is None else groups),
    )


def train(
    design: Design,
    task: str | Task = "",
    *,
    level: Level | None = None,
    goal: str | Path = "",
    protocol: Protocol = "best",
    steps: int = BUDGET_STEPS,
    minutes: float | None = None,
    seed: int = 0,
    out: str | Path = "",
    grouping: Grouping = "auto",
    from_probe: bool = False,
    smoothing: float = 0.0,
    randomize: bool = False,
    stop_hopeless: bool = False,
    script: str = "own",
    threads: int = 0,
    tensorboard: bool = False,
    again: bool = False,
    listen: Callable[[CurvePoint], None] = lambda _point: None,
) -> Training:
    """Train a policy by reinforcement learning and return its folder. Requires the extra "rl".

    Repeat the same call to continue a stopped training. A finished training is returned unchanged.

        training = aidsr.train(run.design(1), steps=60_000)
        training = aidsr.train("scene.xml", "button_pushing", out="learned")
        print(training.path, training.result.read())

    Args:
        design: A design, its folder, or a scene.
        task: Task to learn; not needed for a design, which records its task.
        level: Level of the task.
        goal: Goal file for an environment of your own, instead of a task.
        protocol: "best" is soft actor-critic with held actions; "paper" is PPO, for comparison.
        steps: Maximum control steps; training ends earlier when the success rate is saturated.
        minutes: Maximum wall time [min], in addition to `steps`; None for no limit.
        seed: Seed of the network, of exploration and of the variations drawn.
        out: Folder in which the folders 001, 002 … are created; default: training/ in the design's folder, or in the
            current folder.
        grouping: As in `probe`.
        from_probe: With protocol "paper": first search an open-loop motion, as `probe` does; if one succeeds, the
            policy starts from it.
        smoothing: Share of the previous action that is kept in the next one, from 0 to below 1.
        randomize: Vary the model in each training episode as a real robot may differ from it: parameters, action delay,
            cable friction.
        stop_hopeless: Stop a training of 10,000 steps or more in which no episode has succeeded after 70 % of them;
            requires protocol "best".
        script: Motion that the policy starts from and corrects. "own": the motion with which the design's author saw it
            do the task; if there is none, a short probe searches a motion that learning has to beat. "none": no motion.
            Otherwise the text of a motion script, see `aidsr.learn.openloop.script.GRAMMAR`, which requires protocol
            "best".
        threads: Native threads for physics; 0 uses all processors. Results do not depend on it.
        tensorboard: Whether to also write logs for TensorBoard.
        again: Train from scratch, into the next folder, even if earlier calls left a finished or stopped training.
        listen: Called with every point of the learning curve.

    Raises:
        TypeError: An argument has the wrong type.
        UserError: The design or the task does not exist, a number is out of range, the extra "rl" is missing, or
            another process runs the same training.
        MjcfError: The scene cannot be loaded.
    """
    check_whole_number("steps", steps, least=1)
    _check_seed_and_threads(seed, threads)
    check_type(smoothing, (int, float), "smoothing must be a number")
    check_type(script, str, 'script must be "own", "none" or the text of a motion script')
    if not script.strip():
        raise UserError('script is empty; give "own", "none" or the text of a motion script')
    if not 0 <= smoothing < 1:
        raise UserError(f"smoothing must be from 0 to below 1: {smoothing:g}")
    require_extra("rl", "training")
    from aidsr.learn.rl.recipe import recipe_of

    if minutes is not None:
        check_type(minutes, (int, float), "minutes must be a number")
        if not 0 < minutes < math.inf:
            raise UserError(f"minutes must be above 0 and finite: {minutes:g}; leave it out for no limit")
    recipe = recipe_of(
        protocol,
        from_probe=from_probe,
        smoothing=smoothing,
        randomize=randomize,
        stop_hopeless=stop_hopeless,
        script=script,
    )
    found = find_scene(design, task, level=level, goal=goal)
    return train_policy(
        found,
        Path(out) if out else found.trainings,
        grouping=grouping,
        steps=steps,
        seed=seed,
        recipe=recipe.starting_from(script, found.script),
        minutes=minutes,
        threads=threads,
        tensorboard=tensorboard,
        again=again,
        listen=listen,
    )


def train_policy(
    scene: DesignedScene,
    home: Path,
    *,
    grouping: Grouping = "auto",
    number: str = "",
    steps: int,
    seed: int,
    recipe: Recipe,
    minutes: float | None = None,
    threads: int = 0,
    tensorboard: bool = False,
    again: bool = False,
    listen: Callable[[CurvePoint], None] = lambda _point: None,
) -> Training:
    """Train a policy in a numbered folder (001, 002 …) of `home`, and return the training.

    The folder is the last one that holds the same training, or else the next new one; `number` names it instead. The
    policy is trained in an isolated child process, which keeps its progress on Control-C. A task whose class is defined
    in a script or a notebook is trained in this process. The other arguments are as in `train`.

    Raises:
        UserError: Another process runs the same training.
        IsolationError: The scene exceeded the limits of time or memory, or crashed MuJoCo.
    """
    from aidsr.core.storage_errors import storage_errors
    from aidsr.learn.rl.isolated_learning import run_training, train_in_child
    from aidsr.tasks.travelling_task import can_travel

    with storage_errors(home):
        home.mkdir(parents=True, exist_ok=True)
    run = train_in_child if can_travel(scene.task) else run_training
    folder = run(
        *scene.as_text(),
        grouping=grouping,
        home=home,
        number=number,
        steps=steps,
        seed=seed,
        recipe=recipe,
        minutes=minutes,
        threads=threads,
        tensorboard=tensorboard,
        again=again,
        listen=listen,
    )
    return Training(folder)


def _check_seed_and_threads(seed: int, threads: int) -> None:
    check_whole_number("seed", seed, least=0)
    check_whole_number("threads", threads, least=0)


def evaluate(
    training: str | Path | Training | DesignFolder,
    *,
    episodes: int = VERDICT_EPISODES,
    level: Level | None = None,
    split: Split = "held_out",
    threads: int = 0,
    videos: bool = True,
    perturbed: bool | Literal["successful"] = False,
    listen: Callable[[EvaluationPoint], None] = lambda _point: None,
) -> Evaluation:
    """Evaluate a trained policy on variations of its task that it never saw. Requires the extra "rl".

    The verdict, the learning curve, two motions and two videos are also written into the training's folder. An
    evaluation at another level or on another split is not a verdict and is written to a separate file.

        evaluation = aidsr.evaluate(training)
        print(evaluation.success_share, evaluation.successful)

    Args:
        training: A finished training, its folder, or a design, whose last finished training is evaluated.
        episodes: Number of variations to evaluate, at least 20.
        level: "standard" or "hard"; default: the level of the training.
        split: "held_out", or "development" for the variations that may be used while designing.
        threads: Native threads for physics; 0 uses all processors. Results do not depend on it.
        videos: Whether to record the best and the median episode as videos; skipped if there is no OpenGL.
        perturbed: Whether to repeat the same variations with model parameters changed by up to 20 %, with delayed
            actions and with cable friction; the results are in `Evaluation.perturbed`. The verdict does not change.
            "successful": only if the policy is successful.
        listen: Called with the progress of the episodes after every control step.

    Raises:
        TypeError: An argument has the wrong type.
        UserError: No training is finished, another process trains, evaluates or films in its folder, there are too few
            episodes, or the extra "rl" is missing.
    """
    check_type(training, (str, Path, Training, DesignFolder), "training must be a training, its folder, or a design")
    check_whole_number("episodes", episodes, least=1)
    check_whole_number("threads", threads, least=0)
    require_extra("rl", "evaluating a policy")
    from aidsr.learn.rl.isolated_learning import run_evaluation

    if isinstance(training, DesignFolder):
        finished = [each for each in trainings_of(training) if each.result.path.exists()]
        if not finished:
            raise UserError(f"{training.path} has no finished training; train it first")
        training = finished[-1]
    folder = training.path if isinstance(training, Training) else Path(training)
    return run_evaluation(folder, episodes, level, split, threads, videos, perturbed, listen)


def export(
    design: str | Path | DesignFolder,
    out: str | Path = "",
    *,
    printer: Literal["fdm", "sla"] = "fdm",
    material: str | None = None,
    policy: bool = False,
    step: bool = False,
) -> Exported:
    """Turn a design into parts to print, buy and assemble, and report what cannot be built.

    Requires the extra "fabrication".

        exported = aidsr.export(run.design(1))
        print(exported.verdict.verdict, exported.folder / "sheet.html")

    Args:
        design: An approved design, its folder, or the MJCF file of a robot.
        out: Output folder; default: export/ in the design's folder, or NAME_export beside the file. An earlier export
            in it is replaced.
        printer: Type of 3D printer: "fdm" prints filament, "sla" prints resin.
        material: Material of the limbs, for example "tpu95a"; default: the first material that the printer can print.
        policy: Also run the design's last trained policy on the robot as built; requires the extra "rl".
        step: Also write each part as a STEP file; requires the extra "cad".

    Raises:
        TypeError: `design` has another type.
        UserError: There is nothing to export, an extra is missing, or the output folder holds other files.
        MjcfError: The robot cannot be loaded.
    """
    check_type(design, (str, Path, DesignFolder), "design must be a design, its folder, or the file of a robot")
    from aidsr.mjcf.read import is_mjcf_text

    if is_mjcf_text(design):
        raise UserError("a robot to export must be a file, not MJCF text; save the text and give the file's path")
    require_extra("fabrication", "making parts")
    from aidsr.sandbox.pool import warm_up

    warm_up()  # a worker process starts during the remaining imports
    from aidsr.loop.export import export as export_design

    path = design.path if isinstance(design, DesignFolder) else Path(design)
    target = Path(out) if out else None
    return export_design(path, target, printer=printer, material=material, policy=policy, cad=step)


def assemble(
    robot: str | Path | Robot,
    environment: str | Path | Task,
    placement: Placement | None = None,
    *,
    functional_part: str = "",
) -> Scene:
    """Place a robot in an environment.

        scene = aidsr.assemble("robot.xml", aidsr.load_task("button_pushing"), functional_part="tip")
        report = aidsr.validate(scene.mjcf)

    Args:
        robot: The robot alone: an object, MJCF text, or the path of an MJCF file.
        environment: MJCF text of the environment or the path of its file; or a task, whose sensors are added as well.
        placement: Mount and pose of the robot; default: on the first mount, with a free base if the task requires it or
            if there is no mount.
        functional_part: Body or site of the robot that does the work; used only if `robot` is not a `Robot`.

    Raises:
        TypeError: An argument has the wrong type.
        UserError: A file cannot be read.
        MjcfError: The robot or the environment cannot be loaded, or the two cannot become one model.
        IsolationError: Assembly exceeded its limits of time or memory.
    """
    from aidsr.loop.ablations import default_placement
    from aidsr.loop.run import make_brief, mjcf_text
    from aidsr.sim.assembly import assemble as assemble_scene
    from aidsr.tasks import Task

    if not isinstance(robot, Robot):
        robot = Robot(mjcf=mjcf_text(robot, "robot"), functional_part=functional_part)
    if isinstance(environment, Task):
        brief, sensors = environment.brief(), environment.sensors
    else:
        brief, sensors = make_brief("assemble", environment=environment), ()
    placement = placement or default_placement(brief)
    return assemble_scene(robot, brief.environment, placement, sensors)


@dataclass(frozen=True)
class DesignedScene:
    """A scene, its task, and what its run records about it."""

    scene: str | Path
    """MJCF text, or the path of an MJCF file."""
    task: str | Task
    level: Level
    groups: tuple[ActuatorGroup, ...]
    """Groups of actuators that act together."""
    home: Path
    """Folder in which training/ is created."""
    script: str = ""
    """Motion with which the author saw the robot do this job; "" for none."""

    @property
    def trainings(self) -> Path:
        """Folder of its trainings."""
        return DesignFolder(self.home).trainings

    def as_text(self) -> tuple[str, str | Task, Level, tuple[ActuatorGroup, ...]]:
        """Return MJCF text, task, level and groups, in the form that is passed to a child process.

        Raises:
            UserError: The file of the scene does not exist.
        """
        from aidsr.learn.episodes.scene import read_mjcf_text

        return read_mjcf_text(self.scene), self.task, self.level, self.groups

    def for_learning(self, grouping: Grouping) -> TaskScene:
        """Return the scene, loaded for its task in this process.

        Raises:
            UserError: The scene does not belong to this task.
            MjcfError: The scene cannot be loaded.
        """
        from aidsr.learn.episodes.scene import TaskScene

        return TaskScene.of(self.scene, self.task, level=self.level, groups=self.groups, grouping=grouping)


def find_scene(
    design: Design, task: str | Task = "", *, level: Level | None = None, goal: str | Path = ""
) -> DesignedScene:
    """Return the scene of a design, or the given scene, with the task or goal that measures success in it.

    Args:
        design: A design, its folder, or a scene.
        task: Task named by the user; not needed for a design, which records its task.
        level: Level of the task.
        goal: Goal file, instead of a task; default for a design: the goal file of its run, if the run has no task.

    Raises:
        TypeError: An argument has the wrong type.
        UserError: There is no scene, or neither a task nor a goal measures success.
    """
    from aidsr.tasks import Task

    check_type(design, (str, Path, DesignFolder, Scene), "design must be a design, its folder, or a scene")
    check_type(task, (str, Task), "task must be a task or its name")
    if task and goal:
        raise UserError("both a task and a goal given; give only one of them")
    path = design.path if isinstance(design, DesignFolder) else design
    if isinstance(path, str) and "<" not in path:
        path = Path(path)
    if isinstance(path, Path) and not path.exists():
        raise UserError(f"{path} does not exist; give a design's folder or a scene")
    if isinstance(path, Path) and path.is_dir():
        return _scene_of_design(DesignFolder(path), task, level, goal)
    scene = path.mjcf if isinstance(path, Scene) else path
    if not (task or goal):
        name = scene if isinstance(scene, Path) else "the scene"
        raise UserError(f"{name} has no task; name one (aidsr tasks lists them), or give a goal")
    return DesignedScene(scene, _measure(scene, task, level, goal), level or "standard", (), Path())


def _scene_of_design(design: DesignFolder, task: str | Task, level: Level | None, goal: str | Path) -> DesignedScene:
    scene = design.final_scene.path
    if not scene.exists():
        outcome = design.outcome.read() if is_number(design.path.name) else None
        if outcome is not None:
            raise UserError(
                f"{design.path} was not approved ({outcome.outcome}): {outcome.reason.rstrip('.')}. Only an approved "
                "design is tried; design again, or give the file of a scene with a task or a goal"
            )
        raise UserError(
            f"{design.path} is not an approved design: final.xml not found; give the folder of one, as "
            "runs/…/designs/1, or the file of a scene"
        )
    run = design.run
    require_plain_tree(design.path)
    require_regular_file(run.record.path)
    design.require_whole()
    record = run.record.read()
    known_task, known_level = (record.task, record.level) if record and record.task else ("", "")
    is_own_job = not goal and task in ("", known_task, known_task.rpartition("/")[2]) and level in (None, known_level)
    if not (task or goal or known_task):
        goal = run.goal.path
        if not goal.exists():
            raise UserError(
                f"{design.path} was designed for an objective in words, which has no measure of success; give a "
                "goal (docs/goals.md), or name a task"
            )
    robot = newest(it.robot.read() for it in design.leading_to())
    groups = robot.actuator_groups if robot else ()
    measure = _measure(scene, task or known_task, level, goal)
    script = robot.script if robot and is_own_job else ""
    return DesignedScene(scene, measure, level or known_level or "standard", groups, design.path, script)


def _measure(scene: str | Path, task: str | Task, level: Level | None, goal: str | Path) -> str | Task:
    """Return the task, or a task made from the goal file and the scene.

    Raises:
        UserError: The goal file cannot be used, or a level was given with a goal.
    """
    if not goal:
        return task
    if level:
        raise UserError(f"a level requires a task, and success is measured by the goal {goal}; leave the level out")
    from aidsr.learn.episodes.scene import read_mjcf_text
    from aidsr.tasks import goal_task, read_goal

    return goal_task(read_goal(goal), read_mjcf_text(scene))
