"""Train and evaluate the designs of runs that a language model answered, and compare the teams.

    aidsr design --task incline --model manual:desk --runs build/teams/four-roles      # and somebody answers
    aidsr design --task incline --model manual:desk --runs build/teams/measuring --team measuring --concepts 1
    python -m benchmarks.teams.run build/teams/*/*

The name of the folder that holds a run is its arm.

Each design gets a row in results.jsonl, also if it was not approved; the table made from the rows goes to results.md. A
policy plays the first 20 held-out episodes with the checks of an evaluation and, if it wins at least 3 of them, the
other 80 as well. The same command continues with the designs that are missing. `--write-only` only writes the table.
`--publish` copies the files that make the robots again (`aidsr design --model replay:RUN`) to transcripts/. `--floors`
plays untrained policies in the scenes of successful designs, of runs or of transcripts, and records their successes in
floors.jsonl. `--validate` asks this commit's validator about all designs of transcripts/ and records its verdicts in
validated.jsonl.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Literal

import numpy as np
from benchmarks.rows import append_row, read_rows
from benchmarks.tasks.floors import CONSTANTS, UNTRAINED, measure

from aidsr import validate
from aidsr.api import find_scene
from aidsr.core.artifacts import SUCCESSFUL_SHARE, Artifact, Brief, Evaluation
from aidsr.core.config import VERDICT_EPISODES, Method
from aidsr.core.provenance import commit
from aidsr.core.rates import Rate
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.plausibility import FEWEST_SUCCESSES
from aidsr.learn.episodes.rollout import EpisodeOutcomes, rollout
from aidsr.learn.rl.policy import one_torch_thread
from aidsr.learn.rl.recipe import recipe_of
from aidsr.learn.rl.trained import FinishedTraining, evaluate_training
from aidsr.learn.rl.training import train
from aidsr.runs import Run, read_status
from aidsr.runs.files import replace_file
from aidsr.runs.folders import DesignFolder
from aidsr.runs.trainings import Training
from aidsr.studies.tables import PAPER
from aidsr.tasks import BENCHMARK_VERSION, is_current
from aidsr.teams.providers.manual import prompts_directory

HOME = Path(__file__).parent
RESULTS = HOME / "results.jsonl"
FIRST = HOME / "first.jsonl"
"""Rows of designs that were trained again, and of all others of their arm, as they were after the first training. Those
of `four-roles` are the rows of commit 718c983d: 60,000 steps for all 54, version 4."""
FLOORS = HOME / "floors.jsonl"
VALIDATED = HOME / "validated.jsonl"
FLOOR_EPISODES = 20
FIRST_EPISODES = 20
"""Number of held-out episodes that are played first, with the evaluation's checks and the perturbed scenes."""
FEWEST_WON = 3
"""Successes in these episodes that are needed for the other 80 to be played. A policy that wins every second episode
has fewer successes once in five thousand times."""
_TESTED_SHARE = FEWEST_SUCCESSES / FIRST_EPISODES
"""Share of episodes won from which an evaluation tests whether cables and soft body do the work."""
PAPER_TOKENS_A_SUCCESS = PAPER.tokens / PAPER.successful
"""Tokens per successful design. Source: the AID-SR paper, 151,000 tokens per design, 26.7 % successful."""
_FEWEST_TASKS = 6
"""Number of tasks from which they are resampled. Our choice."""
_DRAWS = 10_000
UNVALIDATED: tuple[Method, ...] = ("direct", "no_validation", "no_feedback")
"""Methods that approve every robot as it was written; this program validates their robots."""
_KEPT = ("run.json", "brief.json", "environment.xml", "concepts.json")
"""Files of a run that are published, beside its recorded calls."""
_FINAL = ("final.xml", "final_robot.xml", "outcome.json")
"""Files of each design that are published."""


class Row(Artifact):
    """Result of one design."""

    task: str
    arm: str
    """Method of the design: the name of the folder that holds the run."""
    run: str
    """Name of the run's folder."""
    design: int
    concept: str
    outcome: str
    """Outcome in the design's outcome.json, or "not stable", see `UNVALIDATED`."""
    first_stable: bool
    """Whether the first written robot is sound and in scope, after fixes by code."""
    iterations: int
    calls: int
    tokens: int
    """Visible tokens, read and written; the Designer's are shared evenly among the designs."""
    latency_s: float | None = None
    """Wall time of the design [s]; None for a run that was made again from its transcript."""
    valid: bool = False
    successful: bool = False
    success_share: float = 0.0
    progress: float = 0.0
    """Mean, over the held-out episodes, of the best progress of each."""
    episodes: int = 0
    kept_perturbed: float | None = None
    """Share of success kept if parameters, delays and friction differ from the model, in 20 episodes of each kind (100
    in the first 37 rows); None if the design is not successful."""
    penalized_share: float | None = None
    """Share of the time of successful episodes in which the task's penalty applied, for example because of too large a
    force; None in older rows and if no episode is won."""
    failed_checks: tuple[str, ...] = ()
    script: str = ""
    """Motion script with which training began; its designer saw it win at least half of some variations. "" if none."""
    motion: bool = False
    """Whether the policy is a motion that a probe found and learning did not beat; False in rows older than this
    search."""
    steps: int = 0
    most_steps: int = 0
    training_s: float = 0.0
    commit: str = ""
    """Commit of the source that evaluated."""
    scene_sha256: str = ""
    benchmark_version: int = BENCHMARK_VERSION


@dataclass(frozen=True)
class Asked:
    """Settings of trainings and evaluations."""

    steps: int
    perturbed: bool


class Validated(Artifact):
    """Verdict of one commit's validator on a published design, alone and in its scene."""

    arm: str
    task: str
    design: int
    stable: bool
    commit: str


class Floor(Artifact):
    """Successes of untrained policies in one scene."""

    scene_sha256: str
    wins: dict[str, int]
    """Number of held-out episodes won, by the name of the policy."""
    episodes: int
    commit: str


def main() -> None:
    """Do the remaining designs, then write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", type=Path, help="run folders")
    parser.add_argument("--steps", type=int, default=60_000, help="control steps a policy, at most")
    parser.add_argument(
        "--perturbed", action="store_true", help="judge successful policies in perturbed scenes as well"
    )
    parser.add_argument("--write-only", action="store_true", help="write the table of what is there")
    parser.add_argument(
        "--floors", action="store_true", help="measure what untrained policies win, and do nothing else"
    )
    parser.add_argument(
        "--validate", action="store_true", help="validate all of transcripts/ anew, and do nothing else"
    )
    parser.add_argument("--publish", action="store_true", help="copy the runs' recorded calls to transcripts/")
    parser.add_argument(
        "--again", nargs="+", default=[], metavar="ARM/TASK/DESIGN", help="train again what transcripts/ hold"
    )
    given = parser.parse_args()
    asked = Asked(given.steps, given.perturbed)
    for name in given.again:
        train_again(name, asked)
    done = {(row.run, row.design) for row in read_rows(RESULTS, Row)}
    if given.floors:
        measure_floors([folder for run in map(Run, given.runs) for folder in run.designs])
    if given.validate:
        replace_file(VALIDATED, "".join(each.model_dump_json() + "\n" for each in validated()).encode())
    for run in [] if given.floors or given.validate else map(Run, given.runs):
        if given.publish:
            publish(run, HOME / "transcripts" / run.path.resolve().parent.name / run.asked().task.rpartition("/")[2])
        if given.write_only:
            continue
        for folder in run.designs:
            if (run.name, folder.number) not in done and folder.outcome.read() is not None:
                _note(row_of(run, folder, asked))
    page = table(
        read_rows(RESULTS, Row), read_rows(FLOORS, Floor), read_rows(FIRST, Row), read_rows(VALIDATED, Validated)
    )
    replace_file(HOME / "results.md", page.encode())


def validated() -> Iterator[Validated]:
    """Validate all published designs that were approved, alone and in their scenes."""
    for path in sorted((HOME / "transcripts").glob("*/*")):
        run = Run(path)
        for design in run.designs:
            if design.final_scene.path.exists():
                robot, scene = (
                    file.path.read_text(encoding="utf-8") for file in (design.final_robot, design.final_scene)
                )
                stable = _is_stable(run.brief(), robot, scene)
                task = run.asked().task
                yield Validated(arm=path.parent.name, task=task, design=design.number, stable=stable, commit=commit())


def measure_floors(folders: Iterable[DesignFolder]) -> None:
    """Play untrained policies in those scenes of successful designs that have no record in floors.jsonl yet."""
    known = {floor.scene_sha256 for floor in read_rows(FLOORS, Floor)}
    wanted = {row.scene_sha256 for row in read_rows(RESULTS, Row) if row.successful} - known
    for folder in folders:
        if not folder.final_scene.path.exists():
            continue
        scene = find_scene(folder).for_learning("auto")
        if scene.fingerprint not in wanted:
            continue
        wanted.discard(scene.fingerprint)
        found = measure(scene, UNTRAINED, FLOOR_EPISODES, threads=1)
        wins = {each.policy: int(each.outcomes.success.sum()) for each in found}
        floor = Floor(scene_sha256=scene.fingerprint, wins=wins, episodes=FLOOR_EPISODES, commit=commit())
        with FLOORS.open("a", encoding="utf-8") as file:
            file.write(floor.model_dump_json() + "\n")


def _note(row: Row) -> None:
    append_row(RESULTS, row)
    sys.stdout.write(line_of(row) + "\n")
    sys.stdout.flush()


def row_of(run: Run, folder: DesignFolder, asked: Asked) -> Row:
    """Return the row of a design; train it and evaluate its policy if it was approved."""
    state = read_status(run).design(folder.number)
    first = folder.iterations[0].robot_report.read() if folder.iterations else None
    row = Row(
        task=run.asked().task,
        arm=run.path.resolve().parent.name,
        run=run.name,
        design=folder.number,
        concept=state.concept,
        outcome=state.outcome.outcome if state.outcome else "unfinished",
        first_stable=bool(first and first.stable),
        iterations=state.iteration,
        calls=state.usage.calls,
        tokens=state.usage.input_tokens + state.usage.output_tokens,
        latency_s=None if run.asked().config.model.startswith("replay:") else round(state.latency_s, 1),
        most_steps=asked.steps,
    )
    if row.outcome != "approved":
        return row
    if run.asked().config.method in UNVALIDATED and not _stable(run, folder):
        return row.model_copy(update={"outcome": "not stable", "first_stable": False})
    return trained(row, folder, folder.path / "training" / f"best-{asked.steps}", asked)


def trained(row: Row, folder: DesignFolder, home: Path, asked: Asked) -> Row:
    """Train a design in a folder, evaluate its policy, and return its row with these results."""
    found = find_scene(folder)
    script = found.script or row.script  # a transcript does not hold it
    recipe = recipe_of("best", script=script)
    training = train(found.for_learning("auto"), home, steps=asked.steps, recipe=recipe, threads=1)
    verdict = Training(home).evaluation.read() or evaluate_training(
        home, episodes=FIRST_EPISODES, threads=1, videos=False, perturbed="successful" if asked.perturbed else False
    )
    won = [episode.ended == "succeeded" for episode in verdict.episodes]
    progress = [episode.best_progress for episode in verdict.episodes]
    if sum(won) >= FEWEST_WON:
        outcomes = _others(home)
        won, progress = won + outcomes.success.tolist(), progress + outcomes.best_progress.tolist()
    successful = verdict.valid and fmean(won) >= SUCCESSFUL_SHARE
    return row.model_copy(
        update={
            "valid": verdict.valid,
            "successful": successful,
            "success_share": round(fmean(won), 4),
            "progress": round(fmean(progress), 3),
            "episodes": len(won),
            "kept_perturbed": _kept(verdict) if successful else None,
            "penalized_share": None if verdict.penalized_share is None else round(verdict.penalized_share, 4),
            "failed_checks": tuple(check.name for check in verdict.checks if not check.passed),
            "script": script,
            "motion": Training(home).plays_the_motion,
            "benchmark_version": BENCHMARK_VERSION,
            "steps": training.steps,
            "most_steps": asked.steps,
            "training_s": round(training.wall_s, 1),
            "commit": verdict.commit,
            "scene_sha256": verdict.scene_sha256,
        }
    )


def train_again(name: str, asked: Asked) -> None:
    """Train a design again from its transcript, and replace the results of training in its row.

    Args:
        name: Name of the design, ARM/TASK/DESIGN.
        asked: Settings of the training and the evaluation.
    """
    arm, task, number = name.split("/")
    run = Run(HOME / "transcripts" / arm / task)
    rows = read_rows(RESULTS, Row)
    alike = [row for row in rows if (row.arm, row.task.rpartition("/")[2], row.design) == (arm, task, int(number))]
    old = max(alike, key=lambda row: row.benchmark_version)
    new = trained(old, run.design(int(number)), Path("build/teams/again", name, f"best-{asked.steps}"), asked)
    if not any((row.arm, row.task, row.design) == (old.arm, old.task, old.design) for row in read_rows(FIRST, Row)):
        append_row(FIRST, old)
    lines = [(new if row is old else row).model_dump_json() + "\n" for row in rows]
    replace_file(RESULTS, "".join(lines).encode())
    sys.stdout.write(line_of(new) + "\n")


def _others(home: Path) -> EpisodeOutcomes:
    """Play the held-out episodes after the first `FIRST_EPISODES`."""
    training = FinishedTraining.load(home)
    task = training.scene.task
    variations = [task.variation("held_out", index) for index in range(FIRST_EPISODES, VERDICT_EPISODES)]
    episodes = Episodes(training.scene.model, task, training.scene.actions, variations, threads=1)
    with one_torch_thread():
        return rollout(episodes, training.policy)


def _stable(run: Run, folder: DesignFolder) -> bool:
    """Whether a robot that was approved without validation is sound and in scope, alone and in its scene."""
    robot, scene = folder.iterations[-1].robot.read(), folder.iterations[-1].scene.read()
    return robot is not None and scene is not None and _is_stable(run.brief(), robot.mjcf, scene.mjcf)


def _is_stable(brief: Brief, robot: str, scene: str) -> bool:
    """Whether a robot is sound and in scope, alone and in its scene; both are MJCF."""
    mount: Literal["free", "fixed"] = "free" if brief.base == "free" else "fixed"
    alone = validate(robot, mount=mount, needs_contact=brief.needs_contact, environment=brief.environment)
    return alone.stable and validate(scene, needs_contact=brief.needs_contact).stable


def _kept(verdict: Evaluation) -> float | None:
    shares = [each.kept_share for each in verdict.perturbed if each.kept_share is not None]
    return round(fmean(shares), 3) if shares else None


def table(
    rows: Sequence[Row],
    floors: Sequence[Floor] = (),
    first: Sequence[Row] = (),
    verdicts: Sequence[Validated] = (),
) -> str:
    """Return the page as Markdown. Successes from before a task changed do not count, except those of `first`.

    Args:
        rows: Newest row of each design.
        floors: What untrained policies win.
        first: Rows of first trainings of designs that were trained again; an arm that has all its designs there gets a
            line of its own.
        verdicts: Verdicts of one commit's validator.
    """
    arms = _unique(row.arm for row in rows)
    firsts = {arm: [row for row in first if row.arm == arm] for arm in arms}
    whole = {arm: of for arm, of in firsts.items() if len(of) == sum(row.arm == arm for row in rows)}
    rows = [row.model_copy(update={"successful": row.successful and _is_current(row)}) for row in rows]
    floor_of = {floor.scene_sha256: floor for floor in floors}
    steps = sorted({row.most_steps for row in rows})
    versions = " or ".join(str(each) for each in sorted({row.benchmark_version for row in rows}))
    lines = [
        "# Teams compared, played by a language model",
        "",
        f"Made by `python -m benchmarks.teams.run build/teams/*/*`; see README.md for who answered and what was seen. "
        f"Trained by protocol `best` for at most {' or '.join(f'{each:,}' for each in steps)} control steps (the "
        f"benchmark's budget is 300,000), one seed, judged by version {versions} of the benchmark on 100 "
        f"held-out episodes, or {FIRST_EPISODES} where fewer than {FEWEST_WON} are won. *Valid*: no check "
        "failed. *Untested*: valid, but so few episodes are won that nothing could be tested on whether cables "
        "and soft body do the work. *Successful*: valid, and at least half of them won. Tokens are visible "
        "ones, by bytes / 3. "
        "Intervals: Wilson, 95 %. *Steps*: the budget of the training; designs that fail with 60,000 may be trained "
        f"again with more (`--again`). *Floor*: the most that idling, the best of {CONSTANTS} constant actions or "
        f"random actions win in the scene of a successful design, of {FLOOR_EPISODES} held-out episodes (`--floors`). "
        "*Penalized*: the share of the time of won episodes in which the task's penalty applied, for example because "
        "of too large a force; success does not test it unless the task says so. *Perturbed, kept*: successes in "
        "perturbed scenes (`--perturbed`) relative to those without; above 100 % where lost variations are won. "
        "*Motion*: the policy "
        "begins with the script by which its designer saw the robot win, and corrects it, or it is a motion of a probe "
        "that learning did not beat; README.md says for which rows one was searched. *Version N*: of before the task "
        "changed; a success of then does not count. Empty: not measured, or none.",
        "",
        "| arm | tasks | designs | first robot stable | approved | stable today | valid | untested | successful | "
        "the same, tasks resampled | tokens a design | calls a design | tokens a successful design |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
        *(_summary(arm, [row for row in rows if row.arm == arm], verdicts) for arm in arms),
        *(_summary(f"{arm}, first training", of) for arm, of in whole.items()),
        "",
        "The designs of one task come from one run and are not independent, which Wilson's interval assumes. *Tasks "
        f"resampled*: the interval of {_DRAWS:,} draws of tasks, empty below {_FEWEST_TASKS} tasks. *First training*: "
        "the same designs before any of them was trained again, by the version of the benchmark of that day. All other "
        "lines count the newest training of each design; for a design that had failed, this is a second try. *Stable "
        f"today*: by the validator of commit {_commit_of(verdicts)}, alone and in the scene. A design that an earlier "
        "validator approved may have a fault that only a later one finds.",
        "",
        "For reference, the paper reports 151,000 tokens a design and 26.7 % successful: "
        f"{PAPER_TOKENS_A_SUCCESS:,.0f} tokens a successful design, on tasks that are not public.",
        "",
        "## Successful designs by task",
        "",
        *_matrix(rows),
        "",
        "## Every design",
        "",
        "| task | arm | concept | outcome | steps | valid | successful | episodes won | progress | penalized | "
        "perturbed, kept | floor | motion | iterations | calls | tokens | designing, wall s |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|",
        *(
            line_of(row, floor_of.get(row.scene_sha256))
            for row in sorted(rows, key=lambda row: (row.task, row.arm, row.run, row.design))
        ),
    ]
    return "\n".join(lines) + "\n"


def _is_current(row: Row) -> bool:
    return is_current(row.task, row.benchmark_version)


def _unique(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))


def _commit_of(verdicts: Sequence[Validated]) -> str:
    return " or ".join(_unique(each.commit for each in verdicts)) or "none"


def _summary(arm: str, rows: Sequence[Row], verdicts: Sequence[Validated] = ()) -> str:
    tokens, won = sum(row.tokens for row in rows), sum(row.successful for row in rows)
    stable = [each.stable for each in verdicts if each.arm == arm]
    cells = [
        arm,
        str(len({row.task for row in rows})),
        str(len(rows)),
        _rate(row.first_stable for row in rows),
        _rate(row.outcome == "approved" for row in rows),
        f"{sum(stable)} of {len(stable)}" if stable else "",
        _rate(row.valid for row in rows),
        str(sum(row.valid and row.success_share < _TESTED_SHARE for row in rows)),
        _rate(row.successful for row in rows),
        _resampled(rows),
        f"{tokens / len(rows):,.0f}",
        f"{fmean(row.calls for row in rows):.1f}",
        f"{tokens / won:,.0f}" if won else "none succeeded",
    ]
    return f"| {' | '.join(cells)} |"


def _resampled(rows: Sequence[Row]) -> str:
    """Return the interval of the share of successful designs when tasks are resampled; empty for too few tasks.

    Source: percentile bootstrap, Efron and Tibshirani, An Introduction to the Bootstrap (1993).
    """
    shares = [fmean(row.successful for row in rows if row.task == task) for task in sorted({row.task for row in rows})]
    if len(shares) < _FEWEST_TASKS:
        return ""
    draws = np.random.default_rng(0).choice(shares, (_DRAWS, len(shares))).mean(axis=1)
    low, high = np.percentile(draws, (2.5, 97.5))
    return f"{low:.0%} to {high:.0%}"


def _matrix(rows: Sequence[Row]) -> list[str]:
    """Return a table with the number of successful designs of each task, by arm."""
    arms = _unique(row.arm for row in rows)
    lines = [f"| task | {' | '.join(arms)} |", "|---" * (1 + len(arms)) + "|"]
    for task in sorted({row.task for row in rows}):
        won = [[row.successful for row in rows if (row.task, row.arm) == (task, arm)] for arm in arms]
        lines.append(f"| {task} | {' | '.join(f'{sum(each)} of {len(each)}' if each else '' for each in won)} |")
    return lines


def _rate(values: Iterable[bool]) -> str:
    found = list(values)
    rate = Rate(sum(found), len(found))
    return f"{rate.hits} of {rate.of} ({rate.interval.low:.0%} to {rate.interval.high:.0%})"


def line_of(row: Row, floor: Floor | None = None) -> str:
    """Return the table row of one design."""
    changed = "" if _is_current(row) else f" (version {row.benchmark_version})"
    words = [row.task + changed, row.arm, row.concept, row.outcome]
    words += [f"{row.most_steps:,}" if row.steps else "", _yes(row.valid), _yes(row.successful)]
    words += [f"{row.success_share:.0%}", f"{row.progress:.2f}"]
    words += ["" if row.penalized_share is None else f"{row.penalized_share:.0%}"]
    words += ["" if row.kept_perturbed is None else f"{row.kept_perturbed:.0%}"]
    words += [f"{max(floor.wins.values()) / floor.episodes:.0%}" if floor else "", _motion(row)]
    words += [str(row.iterations), str(row.calls)]
    words += [f"{row.tokens:,}", "" if row.latency_s is None else f"{row.latency_s:.0f}"]
    return "| " + " | ".join(words) + " |"


def _motion(row: Row) -> str:
    """Return the origin of the policy's motion in words, "" without a motion."""
    return "of the probe" if row.motion else "script" if row.script else ""


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _robot_of(design: DesignFolder) -> tuple[Path, ...]:
    """Return the files of the approved robot, which hold its actuator groups; none without an approved robot."""
    robots = [iteration.robot for iteration in design.leading_to() if iteration.robot.xml.path.exists()]
    return (robots[0].json.path, robots[0].xml.path) if robots and design.final_scene.path.exists() else ()


def publish(run: Run, target: Path) -> None:
    """Copy the files that `replay:` needs, and the final robots and scenes.

    The path of the directory in which prompts were exchanged is replaced by "desk".
    """
    desk = str(prompts_directory(run.asked().config.model) or "")
    shutil.rmtree(target, ignore_errors=True)
    names = [name for name in _KEPT if (run.path / name).exists()]
    found = [run.path / name for name in names]
    found += [path for path in run.path.rglob("*.json") if "calls" in path.relative_to(run.path).parts]
    found += [path for name in _FINAL for path in run.path.glob(f"designs/*/{name}")]
    found += [path for design in run.designs for path in _robot_of(design)]
    for path in found:
        copy = target / path.relative_to(run.path)
        copy.parent.mkdir(parents=True, exist_ok=True)
        text = path.read_text(encoding="utf-8")
        copy.write_text(text.replace(desk, "desk") if desk else text, encoding="utf-8")


if __name__ == "__main__":
    main()
