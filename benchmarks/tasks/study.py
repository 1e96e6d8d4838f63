"""Are the tasks good tasks? What idling, a goal reached by hand, and open-loop motions come to at each of them.

    make tasks-study

A task is wrong whose idle body succeeds, whose goal cannot be held, whose variations do not matter, or at which no body
gets anywhere. What was measured is kept in results.jsonl, one line for each task, level and design, and is not measured
again; results.md is made of it. With nothing measured before, it takes some hours on two cores.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from aidsr import probe
from aidsr.core.artifacts import ActuatorGroup
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.motion import GroupMotion, Motion, Motions, OpenLoopPolicy
from aidsr.sim.assembly import assemble
from aidsr.tasks import BENCHMARK_VERSION, TASKS, Task, load_task
from aidsr.teams import rules as builtin

HERE = Path(__file__).parent
FACTS, TABLE = HERE / "results.jsonl", HERE / "results.md"
VARIATIONS = 20

HANDS = HERE.parents[1] / "tests" / "tasks"
"""Where the hands are that play a task to its goal."""

Fact = dict[str, Any]


def main() -> None:
    """Measure what is not measured yet, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", nargs="+", default=list(TASKS))
    parser.add_argument("--levels", nargs="+", default=["standard", "hard"])
    parser.add_argument("--designs", type=int, default=3, help="built-in designs of each task")
    parser.add_argument("--max-steps", type=int, default=2_000_000, help="physics steps of the probe of a design")
    parser.add_argument("--candidates", type=int, default=128, help="motions tried for each design and variation")
    parser.add_argument("--variations", type=int, default=2, help="each is searched for itself")
    parser.add_argument("--idle", type=int, default=10, help="held-out episodes in which a body does nothing")
    parser.add_argument("--threads", type=int, default=0)
    options = parser.parse_args()
    known = {(fact["task"], fact["level"], fact["design"]) for fact in facts()}
    for name in options.tasks:
        for level in options.levels:
            task = load_task(name, level)
            for number in range(options.designs + 1):
                if (task.name, level, number) in known:
                    continue
                fact = by_hand(task) if number == 0 else by_design(task, number, options)
                with FACTS.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(fact) + "\n")
    TABLE.write_text(table(), encoding="utf-8")


def facts() -> list[Fact]:
    """Return what was measured so far for this version of the benchmark."""
    lines = FACTS.read_text(encoding="utf-8").splitlines() if FACTS.exists() else []
    return [fact for line in lines if (fact := json.loads(line))["version"] == BENCHMARK_VERSION]


def by_hand(task: Task) -> Fact:
    """Return what a goal reached by hand comes to, and how the first sight of the task varies (as design 0)."""
    sys.path.insert(0, str(HANDS))
    import goals
    from stick import Episode

    episode = getattr(goals, task.name.rpartition("/")[2])(task)
    seen = []
    for index in range(VARIATIONS):
        fresh = Episode(task, index=index)
        seen.append(task.observe(fresh.look(), fresh.state.task_state)[0])
    differ = int((np.ptp(np.array(seen), axis=0) > 1e-6).sum())
    facts = {"goal_held": episode.won, "features": len(seen[0]), "features_differ": differ}
    return {"task": task.name, "level": task.level, "version": BENCHMARK_VERSION, "design": 0, **facts}


def by_design(task: Task, number: int, options: argparse.Namespace) -> Fact:
    """Return what a built-in design, as its author first wrote it, comes to when idle and by open-loop motions."""
    concept, mjcf, groups = design(task, number)
    scene = TaskScene.of(mjcf, task, groups=groups)
    idle = idling(scene, options.idle, options.threads)
    given = {name: getattr(options, name) for name in ("candidates", "variations", "max_steps", "threads")}
    found = probe(mjcf, task, groups=groups, **given)
    return {
        "task": task.name,
        "level": task.level,
        "version": BENCHMARK_VERSION,
        "design": number,
        "concept": concept,
        "mujoco": mujoco.__version__,
        "idle_episodes": options.idle,
        "idle_successes": int(idle.success.sum()),
        "idle_progress": round(float(idle.best_progress.max()), 3),
        "diverged_idle": int(idle.diverged.sum()),
        "probe": found.model_dump(mode="json"),
    }


def design(task: Task, number: int) -> tuple[str, str, tuple[ActuatorGroup, ...]]:
    """Return the concept, the scene and the groups of a design of the built-in team, seed 1."""
    brief, rules = task.brief(), builtin.team(1)
    concept = rules.designer.propose(brief, max(3, number))[number - 1]
    robot = rules.coder.write(brief, concept)
    scene = assemble(robot, brief.environment, rules.integrator.place(brief, concept, robot), task.sensors)
    return concept.name, scene.mjcf, robot.actuator_groups


def idling(scene: TaskScene, count: int, threads: int) -> Any:
    """Return how held-out episodes go in which the body does nothing."""
    rest = tuple(
        GroupMotion(group=group.name, first=value, last=value)
        for group, value in zip(scene.actions.groups, scene.actions.rest.tolist(), strict=True)
    )
    still = Motion(begin_s=0.0, ramp_s=1.0, frequency_hz=1.0, groups=rest)
    drawn = [scene.task.variation("held_out", index) for index in range(count)]
    episodes = Episodes(scene.model, scene.task, scene.actions, drawn, threads=threads)
    return rollout(episodes, OpenLoopPolicy(Motions.of([still] * count), scene.task.control_dt_s))


def table() -> str:
    """Return all that was measured as a page."""
    known = facts()
    bodies = [fact for fact in known if fact["design"]]
    if not bodies:
        return f"# Are the tasks good tasks?\n\nNothing was measured in version {BENCHMARK_VERSION} yet.\n"
    return _head(bodies) + "\n".join(_rows(known)) + "\n"


def _head(bodies: list[Fact]) -> str:
    versions = sorted({fact["mujoco"] for fact in bodies})
    motions = sorted(fact["probe"]["motions"] for fact in bodies)
    steps = " or ".join(f"{most:,}" for most in sorted({fact["probe"]["max_steps"] for fact in bodies}))
    return f"""# Are the tasks good tasks?

Made with MuJoCo {", ".join(versions)}, version {BENCHMARK_VERSION} of the benchmark, by

{_commands(bodies)}

Bodies are those of the built-in team as first written, seed 1, {len(bodies)} in all; motions are open-loop
([probe](../../docs/learning.md)): at most {steps} physics steps a body, which was room
for {motions[0]} to {motions[-1]} motions. So few say what is possible, not what is impossible.
results.jsonl has all that was measured.

- *goal*: a stick or the object is pulled to the goal by hand, and that succeeds.
- *idle*: successes among held-out episodes in which the bodies do nothing, and their largest progress.
- *differ*: how many of the task's features differ between the first moments of {VARIATIONS} variations; friction and
  mass cannot be seen there.
- *solved*: variations in which some motion of the best body succeeds; *alike*: in which one and the same motion does.
- *PPO*: success on held-out variations of the best design in [benchmarks/builtin](../builtin/results.md); empty where
  it was not trained yet.

| task | level | goal | idle | differ | best body | solved | alike | progress | it came so far | PPO |
|---|---|---|---|---|---|---|---|---|---|---|
"""


def _commands(bodies: list[Fact]) -> str:
    """Return the commands by which bodies were probed, one for each way."""
    ways: dict[tuple[str, int, int], int] = {}
    for one in bodies:
        way = (one["level"], one["probe"]["max_steps"], one["probe"]["candidates"])
        ways[way] = max(ways.get(way, 0), one["design"])
    return "\n".join(
        f"    python benchmarks/tasks/study.py --levels {level} --designs {designs} --max-steps {steps} "
        f"--candidates {count}"
        for (level, steps, count), designs in ways.items()
    )


def _rows(known: list[Fact]) -> Iterator[str]:
    for name in TASKS:
        for level in ("standard", "hard"):
            mine = [fact for fact in known if (fact["task"], fact["level"]) == (name, level)]
            hand = next((fact for fact in mine if fact["design"] == 0), None)
            bodies = [fact for fact in mine if fact["design"]]
            if hand is None:
                continue
            held = "yes" if hand["goal_held"] else "**no**"
            cells = [name, level, held, _idle(bodies), f"{hand['features_differ']} of {hand['features']}"]
            cells += _best(bodies) if bodies else [""] * 5
            yield "| " + " | ".join([*cells, trained(name, level)]) + " |"


def _idle(bodies: list[Fact]) -> str:
    if not bodies:
        return ""
    successes, episodes = (sum(one[f"idle_{key}"] for one in bodies) for key in ("successes", "episodes"))
    return f"{successes} of {episodes}, {max(one['idle_progress'] for one in bodies):.2f}"


def _best(bodies: list[Fact]) -> list[str]:
    best = max(bodies, key=lambda one: (one["probe"]["success_share"], one["probe"]["progress"]))
    found = best["probe"]
    count = len(found["variations"])
    shares = [f"{round(found[key] * count)} of {count}" for key in ("success_share", "same_motion_share")]
    return [best["concept"], *shares, f"{found['progress']:.2f}", found["reached"]]


def trained(task: str, level: str) -> str:
    """Return the success share of the best policy of benchmarks/builtin, where it stands in its results."""
    results = HERE.parent / "builtin" / "results.jsonl"
    lines = results.read_text(encoding="utf-8").splitlines() if results.exists() else []
    rows = [row for line in lines if (row := json.loads(line))["task"] == task and row["level"] == level]
    shares = [row["success_share"] for row in rows if row["benchmark_version"] == BENCHMARK_VERSION]
    return f"{max(shares):.0%}" if shares else ""


if __name__ == "__main__":
    main()
