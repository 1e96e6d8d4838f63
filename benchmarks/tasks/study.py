"""Are the tasks good tasks? Measure what wins without a designed policy, and how far open-loop motions come.

    make tasks-study                                                        # everything, hours
    python -m benchmarks.tasks.study --tasks button_pushing --try           # one task, a minute; nothing is kept

A task is too easy if a body wins it by idling, by a constant action or by random actions: more than 5 % of the held-out
episodes is marked. Bodies are the built-in team's designs of seeds 0, 1 and 2 for the task. Each body plays

- idle: controls nearest to 0;
- constant: the best of 27 constant actions, -1, 0 or 1 for each group of actuators;
- random 25 Hz, random 0.5 s: uniform random actions, a new one 25 times a second or every half second;
- rule: the best of a family with two parameters. Reaching: pull a set of groups within 2 s, with a strength. Grasping:
  pull a set of groups at a time. Locomotion, manipulation: sinusoids with a period and a lag from group to group.

The best of a family is chosen on development variations; its successes are counted on held-out ones. Without
--only-floors each body is also probed: open-loop motions are searched for single development variations. Measurements
are kept in results.jsonl, one line for each task, level, body and policy, and are not repeated while task, version,
scene and number of episodes are the same; results.md is made from them. For a quick look use --try with --only-floors,
--levels standard, --bodies 1, --episodes 20 or --policies idle constant: this prints the table and writes nothing.
"""

from __future__ import annotations

import argparse
import fcntl
import hashlib
import inspect
import json
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
from benchmarks.tasks.floors import POLICIES, UNTRAINED, Measured, measure

import aidsr
from aidsr.api import find_scene
from aidsr.core.provenance import commit
from aidsr.learn.episodes.scene import TaskScene
from aidsr.tasks import BENCHMARK_VERSION, Task, is_current, load_task, task_names

HERE = Path(__file__).parent
FACTS, TABLE = HERE / "results.jsonl", HERE / "results.md"
MOST_SHARE = 0.05
"""Largest share of episodes that a trivial policy may win. Our choice: one episode in twenty."""

Fact = dict[str, Any]
Keep = Callable[[Fact], None]


@dataclass(frozen=True)
class Body:
    """A design for a task, in its environment."""

    name: str
    concept: str
    scene: TaskScene


def main() -> None:
    """Make the missing measurements, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", nargs="+", default=list(task_names()), help="all unless named")
    parser.add_argument("--levels", nargs="+", default=["standard", "hard"])
    parser.add_argument("--bodies", type=int, default=3, help="designs of the built-in team, of seeds 0, 1, …")
    parser.add_argument("--policies", nargs="+", choices=list(POLICIES), default=list(POLICIES), metavar="POLICY")
    parser.add_argument("--episodes", type=int, default=40, help="held-out ones of each body and policy")
    parser.add_argument("--only-floors", action="store_true", help="no probe")
    parser.add_argument("--threads", type=int, default=0, help="native threads for physics; 0 takes all processors")
    parser.add_argument("--try", dest="scratch", action="store_true", help="print the table, keep nothing")
    parser.add_argument(
        "--table-only", action="store_true", help="write the table of what was measured, measure nothing"
    )
    asked = parser.parse_args()
    found: list[Fact] = []
    keep = found.append if asked.scratch else append
    known = [] if asked.scratch else facts()
    for name in () if asked.table_only else asked.tasks:
        for level in asked.levels:
            study(load_task(name, level), asked, known, keep)
    if asked.scratch:
        sys.stdout.write("\n" + table(found))
    else:
        compact()
        TABLE.write_text(table(facts()), encoding="utf-8")


def study(task: Task, asked: argparse.Namespace, known: list[Fact], keep: Keep) -> None:
    """Make the missing measurements of one task at one level."""
    for seed in range(asked.bodies):
        began = time.monotonic()
        body, outcome = built_in(task, seed)
        if body is None:
            keep({**_about(task), "kind": "body", "body": f"seed {seed}", "outcome": outcome})
            continue
        say(f"{task.name} {task.level}, {body.name}: {body.concept} ({time.monotonic() - began:.0f} s)")
        mine = [fact for fact in known if _is_of(fact, task, body)]
        there = {fact["policy"] for fact in mine if fact["kind"] == "floor" and fact["episodes"] >= asked.episodes}
        began = time.monotonic()
        for found in measure(
            body.scene, [name for name in asked.policies if name not in there], asked.episodes, asked.threads
        ):
            fact = floor(task, body, found, time.monotonic() - began)
            say(f"  {fact['policy']}: {fact['wins']} of {fact['episodes']} {fact['chosen']} ({fact['wall_s']:.0f} s)")
            keep(fact)
            began = time.monotonic()
        if not asked.only_floors and not any(fact["kind"] == "probe" for fact in mine):
            fact = probe(task, body, asked.threads)
            say(f"  probe: {fact['success_share']:.0%}, progress {fact['progress']:.2f}")
            keep(fact)


def built_in(task: Task, seed: int) -> tuple[Body | None, str]:
    """Return the first design of the built-in team for a task, or None and the outcome of the failed design."""
    with tempfile.TemporaryDirectory() as folder:
        run = aidsr.design(task=task.name, level=task.level, seed=seed, concepts=1, runs=folder)
        (design,) = run.designs
        if not design.final_scene.path.exists():
            outcome = design.outcome.read()
            return None, str(outcome and outcome.model_dump(mode="json", exclude_none=True))
        concepts = run.concepts.read()
        return Body(f"seed {seed}", concepts[0].name if concepts else "", find_scene(design).for_learning("auto")), ""


def floor(task: Task, body: Body, found: Measured, wall_s: float) -> Fact:
    """Return the record of a policy."""
    outcomes = found.outcomes
    return {
        **_about(task, body),
        "kind": "floor",
        "policy": found.policy,
        "tried": found.tried,
        "chosen": found.chosen,
        "development_wins": found.development_wins,
        "development_episodes": found.development_episodes,
        "episodes": int(outcomes.success.size),
        "wins": int(outcomes.success.sum()),
        "diverged": int(outcomes.diverged.sum()),
        "progress": round(float(outcomes.best_progress.mean()), 3),
        "best_progress": round(float(outcomes.best_progress.max()), 3),
        "wall_s": round(wall_s, 1),
    }


def probe(task: Task, body: Body, threads: int) -> Fact:
    """Probe a body with the default settings, and return the record."""
    own = [group for group in body.scene.actions.groups if group.name not in task.policy_actuators]
    found = aidsr.probe(body.scene.mjcf, task, groups=own, threads=threads)
    names = ("success_share", "same_motion_share", "progress", "reached", "motions", "max_steps", "ended_by")
    report = found.model_dump(mode="json")
    return {
        **_about(task, body),
        "kind": "probe",
        "policy": "probe",
        "episodes": len(found.variations),
        **{name: report[name] for name in names},
    }


def _about(task: Task, body: Body | None = None) -> Fact:
    common = {"task": task.name, "level": task.level, "version": BENCHMARK_VERSION, "task_sha256": digest(task)}
    made = {"commit": commit(), "mujoco": mujoco.__version__}
    if body is None:
        return {**common, **made}
    scene = {"scene_sha256": body.scene.fingerprint[:12], "groups": body.scene.actions.size}
    return {**common, "body": body.name, "concept": body.concept, **scene, **made}


def _is_of(fact: Fact, task: Task, body: Body) -> bool:
    now = _about(task, body)
    return all(fact.get(key) == now[key] for key in (*_TASK, "body", "scene_sha256"))


_TASK = ("task", "level", "version", "task_sha256")


def digest(task: Task) -> str:
    """Return a hash of a task's modules (its own and those of its base classes) and XML; facts depend on these too."""
    modules = {module for cls in type(task).__mro__ if (module := inspect.getmodule(cls)) and cls is not object}
    texts = sorted(inspect.getsource(module) for module in modules if module.__name__.startswith("aidsr."))
    return hashlib.sha256("\0".join([*texts, task.environment]).encode()).hexdigest()[:12]


def say(line: str) -> None:
    """Print a line without buffering."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


# --- the records ---


def facts() -> list[Fact]:
    """Return the latest record of each task, level, body and policy."""
    lines = FACTS.read_text(encoding="utf-8").splitlines() if FACTS.exists() else []
    return _latest(json.loads(line) for line in lines)


def _latest(found: Iterable[Fact]) -> list[Fact]:
    return list(
        {(*(fact[key] for key in ("task", "level", "body")), fact.get("policy")): fact for fact in found}.values()
    )


def append(fact: Fact) -> None:
    """Append a record to the file; several processes may measure at the same time."""
    with FACTS.open("a", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.write(json.dumps(fact) + "\n")


def compact() -> None:
    """Drop records that newer ones replace, and sort the rest by task."""
    with FACTS.open("a", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        places = {name: place for place, name in enumerate(task_names())}
        rank = {name: place for place, name in enumerate(POLICIES)}
        order = sorted(
            facts(),
            key=lambda f: (
                places.get(f["task"], len(places)),
                f["level"] != "standard",
                f["body"],
                rank.get(f.get("policy", ""), len(rank)),
            ),
        )
        FACTS.write_text("".join(json.dumps(fact) + "\n" for fact in order), encoding="utf-8")


# --- the page ---

_HEAD = """# Are the tasks good tasks?

What wins without a designed policy. Made by `make tasks-study`; `python -m benchmarks.tasks.study --help` explains the
policies, and results.jsonl has every body and policy. A cell is the largest share of one body, and in brackets wins and
held-out episodes of all bodies. **Bold**: an idle body, a constant action or random actions win more than {most:.0%}.
*Probe*: development variations for which an open-loop motion was found that wins ([probe](../../docs/learning.md)), of
those of all bodies, and the best body's mean progress.

| task | level | bodies | {policies} | probe | version | commit |
|---|---|---|{lines}|---|---|---|
"""


def table(known: list[Fact]) -> str:
    """Return the page on records as Markdown."""
    head = _HEAD.format(most=MOST_SHARE, policies=" | ".join(POLICIES), lines="|".join(["---"] * len(POLICIES)))
    return head + "".join(f"{row}\n" for row in _rows(known)) + _winners(known)


def _rows(known: list[Fact]) -> Iterator[str]:
    for task, level in dict.fromkeys((fact["task"], fact["level"]) for fact in known):
        mine = [fact for fact in known if (fact["task"], fact["level"]) == (task, level)]
        bodies = dict.fromkeys(fact["body"] for fact in mine)
        standing = [body for body in bodies if any(f["body"] == body and f["kind"] != "body" for f in mine)]
        count = str(len(bodies)) if len(standing) == len(bodies) else f"{len(standing)} of {len(bodies)}"
        cells = [_cell([f for f in mine if f["kind"] == "floor" and f["policy"] == policy]) for policy in POLICIES]
        made = [", ".join(dict.fromkeys(str(fact[key]) for fact in mine)) for key in ("version", "commit")]
        if not all(is_current(task, fact["version"]) for fact in mine):
            made[0] += ", before the task changed"
        probes = [fact for fact in mine if fact["kind"] == "probe"]
        yield "| " + " | ".join([task, level, count, *cells, _probed(probes), *made]) + " |"


def _cell(found: list[Fact]) -> str:
    if not found:
        return ""
    wins, episodes = (sum(fact[key] for fact in found) for key in ("wins", "episodes"))
    most = max(_share(fact) for fact in found)
    share = f"**{most:.0%}**" if any(_marked(fact) for fact in found) else f"{most:.0%}"
    return f"{share} ({wins}/{episodes})"


def _share(fact: Fact) -> float:
    return float(fact["wins"] / fact["episodes"])


def _marked(fact: Fact) -> bool:
    return fact["policy"] in UNTRAINED and _share(fact) > MOST_SHARE


def _probed(found: list[Fact]) -> str:
    if not found:
        return ""
    solved = round(sum(fact["success_share"] * fact["episodes"] for fact in found))
    return f"{solved}/{sum(fact['episodes'] for fact in found)}, {max(fact['progress'] for fact in found):.2f}"


def _winners(known: list[Fact]) -> str:
    """Return a table of the bodies and policies that win more than `MOST_SHARE`; empty if there is none."""
    marked = [fact for fact in known if fact["kind"] == "floor" and _share(fact) > MOST_SHARE]
    if not marked:
        return ""
    rows = "".join(
        f"| {f['task']} | {f['level']} | {f['concept']} ({f['body']}) | {f['policy']} | {f['chosen'] or '-'} | "
        f"{f['wins']}/{f['episodes']} |\n"
        for f in sorted(marked, key=lambda f: not _marked(f))
    )
    return f"""
## What wins more than {MOST_SHARE:.0%}

| task | level | body | policy | chosen of its family | wins |
|---|---|---|---|---|---|
{rows}"""


if __name__ == "__main__":
    main()
