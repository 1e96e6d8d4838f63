"""The tools that measure robots and scenes: play, probe, measure, sweep, train, evaluate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import fmean
from typing import Annotated, Literal
from xml.sax.saxutils import quoteattr

from pydantic import Field

from aidsr.core.artifacts import Artifact, EpisodeResult, Vec3
from aidsr.core.config import LEAST_EPISODES, VERDICT_EPISODES
from aidsr.core.ends import evaluation_in_words, rules_in_words
from aidsr.core.errors import AidsrError, ReplyError, UserError
from aidsr.core.extras import require_extra
from aidsr.core.formatting import format_check
from aidsr.core.numbered import numbered_in
from aidsr.learn.openloop.film import film
from aidsr.learn.openloop.script import GRAMMAR
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.runs.trainings import Training, learning_in_words
from aidsr.sim.functional_part import FUNCTIONAL_SITE
from aidsr.tasks import Split
from aidsr.teams.llm.patch import apply_patch
from aidsr.tools.building import SceneName, Subject, place, unstable
from aidsr.tools.gaits import MOST_GAITS, random_gaits
from aidsr.tools.measured import Measured
from aidsr.tools.playing import play_policy, play_variations
from aidsr.tools.probing import VARIATIONS_SOLVED, probe_motions
from aidsr.tools.recording import Recording, validity_in_words
from aidsr.tools.scene import MeasuredScene
from aidsr.tools.statics import bends, clearances, load
from aidsr.tools.tool import Result, shortened
from aidsr.tools.workspace import Workspace

_MOST_VARIATIONS = 8
What = Literal["bends", "load", "clearances", "gaits", "play", "probe"]
Pairs = Annotated[
    tuple[tuple[str, str], ...],
    Field(description="Pairs of sites (points), geoms or bodies (surfaces) whose distance is measured, in mm."),
]
Several = Annotated[
    tuple[Annotated[int, Field(ge=0)], ...],
    Field(
        max_length=_MOST_VARIATIONS,
        description=f"Several development variations of a script, at most {_MOST_VARIATIONS}, a row for each.",
    ),
]
Seed = Annotated[int, Field(ge=0)]
_MOST_VALUES = 12
_MOST_EPISODES = 1000
_MOMENTS = 5
"""Number of frames of a motion in a picture."""
_TRAININGS = "training"
"""Name of the folder of a scene's trainings, in the folder of the scene."""
_MOST_STEPS = 50_000_000
"""Largest number of physics steps of one search. Our choice: this takes an hour for a small robot."""
_LARGEST_FORCE_N = 1e4
"""Largest force of a load. Our choice: the weight of a tonne."""


class How(Artifact):
    """Details of a measurement; each has a default."""

    part: Annotated[str, Field(description="Body or site that is loaded; the functional part unless given.")] = ""
    force_n: Annotated[float, Field(gt=0, le=_LARGEST_FORCE_N, description="Size of the load, in N.")] = 0.5
    direction: Annotated[
        Vec3, Field(description="Of the load, in world axes; in those of its root for a robot alone.")
    ] = (0.0, 0.0, -1.0)
    distances: Pairs = ()
    gaits: Annotated[int, Field(ge=1, le=MOST_GAITS, description="How many random gaits.")] = 12
    seconds: Annotated[
        float,
        Field(
            ge=0,
            description="Of each gait, script or motion, in s; 4 for gaits, else by the job's time.",
        ),
    ] = 0.0
    script: Annotated[str, Field(description="The script that is played.")] = ""
    variation: Annotated[
        int, Field(ge=0, description="The development variation of gaits or a script, any number from 0.")
    ] = 0
    variations: Several = ()
    seeds: Annotated[
        tuple[Seed, ...], Field(min_length=1, description="Of as many searches; gaits take the first.")
    ] = (0,)


_DEFAULT = How()


def play(
    workspace: Workspace,
    scene: SceneName,
    script: Annotated[str, Field(description=GRAMMAR)],
    variation: Annotated[
        int, Field(ge=0, description="Which development variation of the job, any number from 0.")
    ] = 0,
    seconds: Annotated[float, Field(ge=0, description="How long, in s; the job's time unless given.")] = 0.0,
    distances: Pairs = (),
    variations: Several = (),
) -> Result:
    """Play a motion script and tell path, heading, contacts, distances, limits exceeded and what ended it.

    The script may branch on what is observed.
    """
    subject = workspace.subject(scene)
    how = How(script=script, variation=variation, variations=variations, seconds=seconds, distances=distances)
    played = _play_all(subject, how)
    if len(played) > 1:
        rows = [(str(one.variation), _measured(one)) for one in played]
        lines = [validity_in_words(played), *_table("variation", rows), *played[0].commands]
    else:
        lines = [*played[0].text().splitlines()]
        lines += [f"every control step: read {workspace.add_file(played[0].csv(), 'csv')}"]
    figures = {
        "progress": fmean(one.best_progress for one in played),
        "success": fmean(one.succeeded for one in played),
        "episodes": float(len(played)),
    }
    return Result(text="\n".join([lines[0], *unstable(workspace, scene), *lines[1:]]), figures=figures)


def probe(
    workspace: Workspace,
    scene: SceneName,
    seeds: Annotated[tuple[Seed, ...], Field(description="Of as many searches.")] = (0, 1),
    variations: Annotated[int, Field(ge=1, le=8, description="Development variations, each searched for itself.")] = 1,
    seconds: Annotated[
        float, Field(ge=0, description="How long each motion is tried, in s; at most 15 unless given.")
    ] = 0.0,
    max_steps: Annotated[
        int,
        Field(ge=0, le=_MOST_STEPS, description="Physics steps of each search; by the job's time unless given."),
    ] = 0,
) -> Result:
    """Search hundreds of open-loop motions by several seeds and play the best again with figures; takes minutes."""
    subject = workspace.subject(scene)
    measured = probe_motions(subject, seeds=seeds, variations=variations, max_steps=max_steps, seconds=seconds)
    figures = {figure.name: figure.value for figure in measured.figures}
    figures |= {"success": figures[VARIATIONS_SOLVED], "episodes": float(variations)}
    strip: tuple[bytes, ...] = ()
    if workspace.draws:
        played = film(subject.mjcf, subject.success_task(), measured.best, groups=subject.groups)
        strip = (played.strip(_MOMENTS),)
    first, *others = measured.text.splitlines()
    told = "\n".join([first, *unstable(workspace, scene), *others])
    return Result(text=shortened(told, workspace), pictures=strip, figures=figures)


def measure(
    workspace: Workspace,
    what: Annotated[
        Literal["bends", "load", "clearances", "gaits"],
        Field(
            description="bends: tip, angle, force and what is touched under each actuator alone. load: sag of a part, "
            "and how far it gives under a force. clearances: distances between named things, as drawn and at rest. "
            "gaits: heading drift, velocity and first touch under random gaits, of a scene only."
        ),
    ],
    subject: Subject,
    how: Annotated[How, Field(description="Details.")] = _DEFAULT,
) -> Result:
    """Measure one property of a robot or a scene."""
    measurement = _measure(_with_part(workspace, subject, how), what)
    return Result(text=shortened(measurement(workspace.subject(subject)).text, workspace))


def sweep(
    workspace: Workspace,
    subject: Subject,
    values: Annotated[
        tuple[str, ...],
        Field(min_length=1, max_length=_MOST_VALUES, description='As in MJCF: ["0.2", "0.4"] or ["0 0 1", "0 1 0"].'),
    ],
    what: Annotated[What, Field(description="What is measured for each value; see measure, play and probe.")],
    select: Annotated[
        str,
        Field(
            description="XPath of the elements, such as //body/joint or //joint[@name='bend_1']; names "
            'as in the robot\'s MJCF, with "robot/" before them or without.'
        ),
    ] = "",
    attribute: Annotated[
        str,
        Field(
            description='The MJCF attribute, such as "stiffness". Without one the values go where how.script has {x}.'
        ),
    ] = "",
    how: Annotated[How, Field(description="Details.")] = _DEFAULT,
) -> Result:
    """Measure the same for several values of an MJCF attribute, or of a number in a script; keeps no robot."""
    if not attribute and "{x}" not in how.script:
        raise UserError("nothing to vary: give select and attribute, or write {x} in how.script where the values go")
    details = _with_part(workspace, subject, how)
    _measure(details, what)
    rows: list[tuple[str, Measured | AidsrError]] = []
    for value in values:
        one = details.model_copy(update={"script": details.script.replace("{x}", value)})
        try:
            made = _changed(workspace, subject, select, attribute, value) if attribute else workspace.subject(subject)
            if what == "play" and details.variations:
                rows += [(f"{value}, variation {each.variation}", _measured(each)) for each in _play_all(made, one)]
            else:
                rows.append((value, _measure(one, what)(made)))
        except AidsrError as error:
            rows.append((value, error))
    varied = f"{attribute} of {select}" if attribute else "{x} of the script"
    if all(isinstance(found, AidsrError) for _, found in rows):
        raise UserError("\n".join([f"every value of {varied} failed", *_table(varied, rows, what)]))
    return Result(text="\n".join([_compared(varied, rows), *_table(varied, rows, what)]))


def _compared(varied: str, rows: Sequence[tuple[str, Measured | AidsrError]]) -> str:
    """Return one line with the first figure of each row that has figures."""
    first = [(value, found.figures[0]) for value, found in rows if isinstance(found, Measured) and found.figures]
    if not first:
        return f"{varied}: no figures"
    return f"{varied}, {first[0][1].name}: " + "; ".join(f"{value}: {each.text}" for value, each in first)


def _table(varied: str, rows: Sequence[tuple[str, Measured | AidsrError]], what: str = "") -> list[str]:
    """Return a header line and a line for each measurement; a failed measurement has its error message."""
    head, lines = what, []
    for value, found in rows:
        if isinstance(found, AidsrError):
            lines.append(f"{value} | failed: {found}")
            continue
        titles = [f"{each.name} {each.unit}".strip() for each in found.figures]
        setting, remark = ([words] if words else [] for words in (found.setting, found.remark))
        head = " | ".join([*(["what differs"] if setting else []), *titles, *(["came to"] if remark else [])])
        lines.append(" | ".join([value, *setting, *(each.cell for each in found.figures), *remark]))
    return [f"{varied} | {head}", *lines]


def _play_all(subject: MeasuredScene, how: How) -> list[Recording]:
    """Play a script in each of the requested variations and return the recordings."""
    variations = how.variations or (how.variation,)
    played = play_variations(subject, how.script, variations=variations, seconds=how.seconds, distances=how.distances)
    return list(played)


def _measured(played: Recording) -> Measured:
    return Measured(figures=played.figures, remark=played.phase, setting=played.variation_text)


def train(
    workspace: Workspace,
    scene: SceneName,
    steps: Annotated[int, Field(ge=2000, le=500_000, description="Control steps.")] = 50_000,
    script: Annotated[
        str,
        Field(
            description="Motion to begin with, as for play, with branches or without; the policy then changes its "
            "actions by at most 0.3."
        ),
    ] = "",
) -> Result:
    """Train a policy and say how it learned, what it wins, whether it is valid, and what it does.

    Takes many minutes from nothing, less with a script that wins already: where that wins nearly always, training ends
    there. Valid means: the physics is plausible, with slack cables or a locked soft body the policy loses, and without
    the robot's other actuators it still wins.
    """
    require_extra("rl", "training")
    from aidsr.learn.rl.isolated_learning import train_in_child
    from aidsr.learn.rl.recipe import recipe_of

    subject = workspace.subject(scene)
    subject.require_job()
    home = workspace.folder_of(scene) / _TRAININGS
    home.mkdir(exist_ok=True)
    folder = train_in_child(
        subject.mjcf,
        subject.success_task(),
        subject.level,
        subject.groups,
        "auto",
        home=home,
        number="",
        steps=steps,
        seed=0,
        recipe=recipe_of("best", script=script),
        minutes=None,
        threads=1,
        tensorboard=False,
        again=False,
        listen=lambda _point: None,
    )
    taken = (Training(folder).result.read() or {}).get("steps", steps)  # fewer where the policy won early
    found, episodes = _judged(subject, folder, LEAST_EPISODES, "development", f"after {taken:,} steps: ")
    shown = next((one for one in episodes if one.ended != "succeeded"), episodes[0])
    played = play_policy(folder, shown.variation)
    how = "won" if played.succeeded else "lost"
    told = [f"one episode that it {how}, played again (no training has its variation; play takes the number):"]
    told += played.account()
    return found.model_copy(update={"text": "\n".join([found.text, *learning_in_words(Training(folder)), *told])})


def evaluate(
    workspace: Workspace,
    scene: SceneName,
    episodes: Annotated[
        int, Field(ge=LEAST_EPISODES, le=_MOST_EPISODES, description="Held-out variations.")
    ] = VERDICT_EPISODES,
) -> Result:
    """Score the last trained policy of a scene on held-out variations, by which nothing is to be designed.

    Says how many it wins and whether it is valid, which means what it means for train.
    """
    require_extra("rl", "evaluating a policy")
    subject = workspace.subject(scene)
    begun = numbered_in(workspace.folder_of(scene) / _TRAININGS)
    finished = [path for path in begun if Training(path).result.path.is_file()]
    if not finished:
        raise UserError(f"{scene} has no trained policy; train it first")
    return _judged(subject, finished[-1], episodes, "held_out", "")[0]


def _judged(
    subject: MeasuredScene, folder: Path, episodes: int, split: Split, head: str
) -> tuple[Result, Sequence[EpisodeResult]]:
    """Evaluate a trained policy on variations of a split; return the result, which begins with `head`, and episodes."""
    from aidsr.learn.rl.isolated_learning import run_evaluation

    found = run_evaluation(folder, episodes, None, split, 1, False, False, lambda _point: None)
    rate = found.success_rate
    progress = sum(one.best_progress for one in found.episodes) / len(found.episodes)
    low, high = rate.interval.low, rate.interval.high
    task = subject.success_task()
    lines = [
        f"{head}success in {rate.share:.0%} of {len(found.episodes)} {split.replace('held_out', 'held-out')} "
        f"variations (Wilson {low:.0%} to {high:.0%}), best progress {progress:.2f} on average, "
        f"{'' if found.valid else 'not '}valid",
        rules_in_words(found.episodes, time_limit_s=task.time_limit_s, failure=task.criteria.failure),
        *evaluation_in_words(found),
        *(f"not plausible: {check.message}: {format_check(check)}" for check in found.checks if not check.passed),
    ]
    figures = {"success": rate.share, "valid": float(found.valid), "progress": progress, "episodes": float(episodes)}
    return Result(text="\n".join(lines), figures=figures), found.episodes


def _measure(how: How, what: What) -> Callable[[MeasuredScene], Measured]:
    """Return the function that makes a measurement of a robot or a scene.

    Raises:
        UserError: A required detail is missing.
    """
    if what == "play" and not how.script:
        raise UserError('play needs a script: "how": {"script": "…"}')
    measurements: dict[What, Callable[[MeasuredScene], Measured]] = {
        "bends": bends,
        "load": lambda subject: load(subject, how.part, force_n=how.force_n, direction=how.direction),
        "clearances": lambda subject: clearances(subject, how.distances),
        "gaits": lambda subject: random_gaits(
            subject, gaits=how.gaits, seconds=how.seconds or 4.0, seed=how.seeds[0], variation=how.variation
        ),
        "play": lambda subject: _measured(_play_all(subject, how)[0]),
        "probe": lambda subject: probe_motions(subject, seeds=how.seeds, seconds=how.seconds),
    }
    return measurements[what]


def _with_part(workspace: Workspace, subject: str, how: How) -> How:
    """Return the details, with the functional part as the part if none is named."""
    if how.part:
        return how
    own = FUNCTIONAL_SITE if subject.startswith("scene") else workspace.robot(subject).functional_part
    return how.model_copy(update={"part": own})


def _changed(workspace: Workspace, subject: str, select: str, attribute: str, value: str) -> MeasuredScene:
    """Return a robot or a scene with a changed attribute of the robot.

    Raises:
        UserError: No element is selected, or the name of the attribute is invalid.
        MjcfError: The changed robot cannot be loaded.
    """
    is_scene = subject.startswith("scene")
    name = workspace.record(subject).robot if is_scene else subject
    robot = workspace.robot(name)
    select = select.replace(ROBOT_PREFIX, "")  # names have this prefix in a scene and in results
    if not attribute.isidentifier():
        raise UserError(f'"{attribute}" is not the name of an attribute')
    try:
        mjcf = apply_patch(robot.mjcf, f"<patch><set sel={quoteattr(select)} {attribute}={quoteattr(value)}/></patch>")
    except ReplyError as error:
        if "changes nothing" not in str(error):
            raise UserError(str(error)) from None
        mjcf = robot.mjcf
    changed = robot.model_copy(update={"mjcf": mjcf})
    if not is_scene:
        return workspace.subject(subject).model_copy(update={"mjcf": mjcf})
    record = workspace.record(subject)
    _, _, task = workspace.task_of(record.task, record.level)
    made = place(workspace, changed, workspace.placement(subject), task, stand=record.stand)
    return workspace.subject(subject).model_copy(update={"mjcf": made.scene.mjcf})
