"""How every cheating body is refused at every task, as a table.

    make cheats
    make cheats STATIC=1

Each cell (a body at a task) is decided by the cheapest test that refuses it: first the placement and the validator,
then the checks of the evaluation that need no episode, then simple rules on 4 episodes. A rule that wins one of them is
evaluated on 20. results.jsonl keeps a line for each cell with the commit of the code; decided cells are not decided
again without `--again`. results.md is made from results.jsonl. `--static` stops before playing.
"""

from __future__ import annotations

import argparse
import functools
import json
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.cheats.bodies import CHEATS, Cheat
from benchmarks.cheats.honest import FOUND, refusals
from benchmarks.cheats.parts import Player
from benchmarks.cheats.playing import is_own, place, play, rules
from benchmarks.cheats.wins import BEFORE, FOUND_LATER, fingerprint, read_rows

from aidsr import validate
from aidsr.core.artifacts import PlausibilityCheck, ValidationReport
from aidsr.core.errors import MjcfError, UserError
from aidsr.core.provenance import commit
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.evaluation import evaluate
from aidsr.tasks import BENCHMARK_VERSION, TASKS, Task, is_current, load_task

HERE = Path(__file__).parent
RESULTS, PAGE = HERE / "results.jsonl", HERE / "results.md"
TRIED = 4
"""Number of episodes on which a rule is tried first; a rule that wins none of them is dropped."""
PLAYED = 20
"""Number of episodes on which a rule is evaluated. A verdict has 100 episodes, but here 20 must do: a body that wins
fewer than half of them is not tried on more."""

WAYS = {
    "placement": "it cannot be placed",
    "scope": "the validator: it is out of scope",
    "physics": "the validator: its physics does not hold",
    "scene": "its scene is not one of the task",
    "start": "a check of the evaluation that needs no episode",
    "evaluation": "it wins, and the evaluation does not believe it",
    "unsuccessful": "none of its rules wins half of the episodes",
    "undecided": "not played",
    "NOT REFUSED": "valid and successful",
}
"""Ways in which a body can be refused, with the words of the page."""

Row = dict[str, Any]


def main() -> None:
    """Decide the undecided cells, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", nargs="+", default=[name.rpartition("/")[2] for name in TASKS])
    parser.add_argument("--bodies", nargs="+", default=[cheat.name for cheat in CHEATS])
    parser.add_argument("--static", action="store_true", help="do not play what the validator lets pass")
    parser.add_argument("--again", action="store_true", help="decide also what is decided")
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    known = set() if asked.again else {key(row) for row in current()}
    todo = [
        (
            cheat.name,
            [
                name
                for name in asked.tasks
                if (cheat.name, fingerprint(cheat), name) not in known and tried_at(cheat, name)
            ],
            asked.static,
        )
        for cheat in CHEATS
        if cheat.name in asked.bodies
    ]
    with ProcessPoolExecutor(asked.jobs) as workers:
        for rows in workers.map(cells, *zip(*todo, strict=True)):
            with RESULTS.open("a", encoding="utf-8") as file:
                file.writelines(json.dumps(row) + "\n" for row in rows)
    PAGE.write_text(page(), encoding="utf-8")


def tried_at(cheat: Cheat, task: str) -> bool:
    """Return whether a body is tried at a task."""
    return not cheat.only_own or task == cheat.task


def key(row: Row) -> tuple[str, str, str]:
    """Return the key of a cell: body, its fingerprint, and task."""
    return row["body"], row["sha256"], row["task"]


def current() -> list[Row]:
    """Return the rows that hold for today's version of the benchmark and today's bodies, without undecided cells."""
    bodies = {(cheat.name, fingerprint(cheat)) for cheat in CHEATS}
    return [
        row
        for row in read_rows(RESULTS)
        if is_current(row["task"], row["benchmark_version"])
        and (row["body"], row["sha256"]) in bodies
        and row["how"] != "undecided"
    ]


def cells(body: str, names: Sequence[str], static: bool = False) -> list[Row]:
    """Return the rows of a body at the named tasks."""
    cheat = next(one for one in CHEATS if one.name == body)
    facts = {"body": body, "sha256": fingerprint(cheat), "benchmark_version": BENCHMARK_VERSION, "commit": commit()}
    return [{**facts, "task": name, **refusal(cheat, load_task(name), static)} for name in names]


def refusal(cheat: Cheat, task: Task, static: bool) -> Row:
    """Return how a body is refused at a task: the way, the codes or checks, a sentence, and the episodes won."""
    own = is_own(cheat, task)
    report = _alone(cheat, task.environment if own else "", task.base == "free" and not (own and cheat.held))
    if not report.stable:
        return _by_validator(report)
    try:
        mjcf = place(cheat, task)
    except MjcfError as error:
        return {
            "how": "placement",
            "codes": [fault.code for fault in error.faults],
            "sentence": error.faults[0].message,
        }
    report = validate(mjcf, needs_contact=task.needs_contact)
    if not report.stable:
        return _by_validator(report)
    try:
        scene = TaskScene.of(mjcf, task, grouping="off")
    except UserError as error:
        return {"how": "scene", "codes": [], "sentence": str(error)}
    if codes := list(refusals(scene)):
        return {"how": "start", "codes": codes, "sentence": "refused before an episode is played"}
    return {"how": "undecided", "codes": [], "sentence": ""} if static else _by_playing(cheat, task, scene)


@functools.cache
def _alone(cheat: Cheat, environment: str, free: bool) -> ValidationReport:
    return validate(cheat.mjcf, mount="free" if free else "fixed", environment=environment)


def _by_validator(report: ValidationReport) -> Row:
    """Return the refusal by the validator: errors of scope if there are any, otherwise all errors."""
    scope = [fault for fault in report.errors if fault.layer == "scope"]
    faults = scope or report.errors
    codes = list(dict.fromkeys(fault.code for fault in faults))
    sentence = f"{', '.join(faults[0].names[:3])} {faults[0].message}".strip()
    return {"how": "scope" if scope else "physics", "codes": codes, "sentence": sentence}


def _by_playing(cheat: Cheat, task: Task, scene: TaskScene) -> Row:
    """Return the result of playing simple rules: the first that wins half of the episodes, otherwise the best one."""
    best: Row = {"how": "unsuccessful", "codes": [], "wins": 0, "episodes": TRIED, "rule": ""}
    for name, make in rules(cheat, task, scene):
        if not play(scene, make, TRIED).success.any():
            continue
        evaluation, _ = evaluate(scene, Player(scene, make), episodes=PLAYED, threads=1)
        wins, failed = round(PLAYED * evaluation.success_share), [one for one in evaluation.checks if not one.passed]
        found = {
            "codes": [one.name for one in failed],
            "wins": wins,
            "episodes": len(evaluation.episodes),
            "rule": name,
        }
        if evaluation.successful:
            sentence = f"{name} wins {wins} of {len(evaluation.episodes)} episodes, and every check passes"
            return {"how": "NOT REFUSED", "sentence": sentence, **found}
        if evaluation.success_share >= 0.5:
            return {"how": "evaluation", "sentence": _sentence(failed), **found}
        best = max(best, {**best, **found}, key=lambda row: row["wins"] / row["episodes"])
    rule = f" by {best['rule']}" if best["rule"] else ""
    return {**best, "sentence": f"wins {best['wins']} of {best['episodes']} episodes{rule}"}


def _sentence(failed: Sequence[PlausibilityCheck]) -> str:
    """Return a sentence on the most telling failed check, with its measurement."""
    check = next((one for one in failed if one.name.startswith(("starts", "functional", "needs"))), failed[0])
    if check.measured is None or check.name.startswith("needs"):
        return check.message
    return f"{check.message}: {check.measured:.2g} {check.unit}, {check.bound} {check.limit:g}"


# --- the page ---


def page() -> str:
    """Return the page on all decided cells as Markdown."""
    rows = {(row["body"], row["task"]): row for row in current()}
    if not rows:
        return f"# Bodies that cheat\n\nNothing was decided in version {BENCHMARK_VERSION} yet.\n"
    return "\n".join([*_head(list(rows.values())), "", *_own(rows), "", *_grid(rows), "", *_notes()]) + "\n"


def _head(rows: Sequence[Row]) -> list[str]:
    counts = Counter(row["how"] for row in rows)
    commits = ", ".join(sorted({row["commit"] for row in rows}))
    return [
        "# Bodies that cheat",
        "",
        f"{len(CHEATS)} bodies that could win a task without being a cable-driven soft robot, at "
        f"{len(TASKS)} tasks: version {BENCHMARK_VERSION} of the benchmark, commit {commits}, by",
        "",
        "    make cheats",
        "",
        f"{counts['NOT REFUSED']} of {len(rows)} decided cells are valid and successful. The rules that refuse were "
        "written with these bodies in view, so this is no estimate for others. How they are refused:",
        "",
        "| by | cells |",
        "|---|---|",
        *(f"| {words} | {counts[how]} |" for how, words in WAYS.items() if counts[how]),
        "",
        *_honest(),
    ]


def _honest() -> list[str]:
    found = read_rows(FOUND)
    refused = sum(bool(row["refused_by"]) for row in found)
    faulty = [row for row in found if row["physics"]]
    tasks = ", ".join(sorted({row["task"] for row in faulty}))
    told = f" ({tasks}: {', '.join(sorted({code for row in faulty for code in row['physics']}))})" if faulty else ""
    commits = ", ".join(sorted({row["commit"] for row in found}))
    return [
        f"Of {len(found)} built-in designs, the first of each task and seed, {refused} are refused as out of "
        f"scope or by a check that needs no episode, and {len(faulty)} by the validator for their physics, before any "
        f"repair{told} (`python -m benchmarks.cheats.honest`, commit {commits})."
    ]


def _own(rows: dict[tuple[str, str], Row]) -> list[str]:
    before = {row["body"]: row for row in read_rows(BEFORE)}
    later = ", ".join(name for name, row in before.items() if row["commit"] == FOUND_LATER)
    lines = [
        "## Each at the task it is meant to win",
        "",
        "*before*: episodes won of 20 with the code of commit 2a7e353, from before such bodies were refused, and "
        "what that code found wrong with it (`python -m benchmarks.cheats.wins`). ball_from_bowl, incline and "
        "crank_turning came later: their bodies were played with the code of this page, whose verdict stands there. "
        f"Bodies of the tasks of then that were found later ({later}) were played with the code of commit "
        f"{FOUND_LATER}, the last to accept them.",
        "",
        "| body | task | before | refused by | why |",
        "|---|---|---|---|---|",
    ]
    for cheat in CHEATS:
        row, old = rows.get((cheat.name, cheat.task)), before.get(cheat.name)
        was = f"{old['wins']} of {old['episodes']}, {_called(old)}" if old else ""
        how, why = (f"{row['how']}: {', '.join(row['codes'])}".rstrip(": "), row["sentence"]) if row else ("", "")
        lines.append(f"| {cheat.name} | {cheat.task} | {was} | {how} | {why} |")
    return lines


def _called(row: Row) -> str:
    faults = [*row["errors"], *row["failed_checks"]]
    return "valid" if not faults else f"but {', '.join(faults)}"


def _grid(rows: dict[tuple[str, str], Row]) -> list[str]:
    names = [name.rpartition("/")[2] for name in TASKS]
    marks = {"start": "e", "evaluation": "e", "unsuccessful": "u", "NOT REFUSED": "**!**"}
    marks |= {"scope": "s", "physics": "p", "placement": "o", "scene": "o"}
    lines = [
        "## All at all tasks",
        "",
        "s: the validator, out of scope; p: the validator, physics; o: it cannot be placed, or its scene is not one of "
        "the task; e: the evaluation; u: no rule wins half of the episodes; !: not refused; empty: not tried.",
        "",
        "| body | " + " | ".join(name.replace("_", " ") for name in names) + " |",
        "|---|" + "---|" * len(names),
    ]
    for cheat in CHEATS:
        cells = [marks[rows[cheat.name, name]["how"]] if (cheat.name, name) in rows else "" for name in names]
        lines.append(f"| {cheat.name} | " + " | ".join(cells) + " |")
    return lines


def _notes() -> list[str]:
    return ["## What each exploits", "", *(f"- **{cheat.name}**: {cheat.exploits}" for cheat in CHEATS)]


if __name__ == "__main__":
    main()
