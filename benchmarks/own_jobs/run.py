"""Run the built-in rules on a user's own jobs (environment and goal): what do their bodies reach without learning?

    python -m benchmarks.own_jobs.run                  # all jobs missing in results.jsonl, then results.md
    python -m benchmarks.own_jobs.run valve shelf      # these, again
    python -m benchmarks.own_jobs.run --only check     # one part of each
    python -m benchmarks.own_jobs.run --page           # results.md alone

Jobs are the examples of the package and the folders in `environments` beside this file, each with environment.xml,
goal.toml and objective.txt. A folder's name is the job's name. Each job is done as a user does it: `aidsr check`,
`aidsr design` with one concept, and `aidsr probe` of the design with another seed than the one by which it was chosen.
The same command continues with the parts that are missing. A job whose files have changed is not done again unless it
is named.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, get_args

from benchmarks.rows import append_row, read_rows

import aidsr
from aidsr.core.artifacts import Artifact
from aidsr.core.formatting import format_cell
from aidsr.core.provenance import commit
from aidsr.examples import examples
from aidsr.learn.openloop import ProbeReport
from aidsr.runs.folders import Run
from aidsr.runs.status import read_status
from aidsr.sim.assembly import assemble
from aidsr.studies.study import versions_now
from aidsr.tasks import GoalTask, goal_task, parse_goal
from aidsr.teams import rules
from aidsr.teams.fitting.check import EPISODES, Blind, check_goal, play_blind
from aidsr.validation import validate

RESULTS, PAGE, MORE = (Path(__file__).with_name(name) for name in ("results.jsonl", "results.md", "environments"))
HELD_OUT = ("gate", "shelf", "trace")
"""Examples on which nothing was tuned, drawn by random.Random(30).sample(names, 3) before any change."""
SEED = 1
"""Seed of the reported probe. Designs are chosen and judged with seed 0."""


BY_WORDS = ("valve", "shelf", "duct")
"""Jobs that are also designed by the words of the objective alone, as the built-in rules did before they measured."""

Part = Literal["check", "design", "words"]


class Row(Artifact):
    """Result of one part of a job."""

    job: str
    part: Part
    blind: Blind | None = None
    """Episodes that a body wins by doing nothing and by random actions. The body is the reference body of `aidsr check`
    (part "check") or the approved design (part "design")."""
    body: str = ""
    approved: bool = False
    sentence: str = ""
    """The Judge's last sentence, or how the design ended."""
    probe: ProbeReport | None = None
    """Probe of the approved design, with another seed than the one by which it was chosen."""
    commit: str
    versions: dict[str, str]


def jobs() -> dict[str, tuple[str, str, str, str]]:
    """Return all jobs by name: origin, objective, environment, goal."""
    found = {
        name: ("held out" if name in HELD_OUT else "tuned on", each.objective, each.environment, each.goal)
        for name, each in examples().items()
    }
    for folder in sorted(MORE.glob("*/environment.xml")):
        texts = [(folder.parent / name).read_text() for name in ("objective.txt", "environment.xml", "goal.toml")]
        found[folder.parent.name] = ("given", texts[0].strip(), texts[1], texts[2])
    return found


def do(name: str, part: Part, folder: Path) -> Row:
    """Do one part of a job in an empty folder, and return its row."""
    _, objective, environment, goal = jobs()[name]
    files = folder / "environment.xml", folder / "goal.toml"
    for file, text in zip(files, (environment, goal), strict=True):
        file.write_text(text)
    made = {"job": name, "part": part, "commit": commit(), "versions": versions_now()}
    if part == "check":
        checked = check_goal(*files)
        return Row(**made, blind=checked.blind, body=checked.reference)
    if part == "words":
        return _by_words(objective, environment, goal, made)
    runs = folder / "runs"
    run = aidsr.design(objective, environment=files[0], goal=files[1], concepts=1, model="builtin", runs=runs)
    approved = run.design(1).final_scene.read() is not None
    blind, report = _measured(run, goal_task(parse_goal(goal), environment)) if approved else (None, None)
    body = read_status(run).designs[0].concept
    return Row(**made, blind=blind, body=body, approved=approved, sentence=_sentence(run), probe=report)


def _by_words(objective: str, environment: str, goal: str, made: dict[str, Any]) -> Row:
    """Design a job with the rules that read words, with seed 0 as for the other designs; probe the robot unrepaired."""
    task = goal_task(parse_goal(goal), environment)
    brief = task.brief().model_copy(update={"task": "", "objective": objective})
    team = rules.team(seed=0)
    concept = team.designer.propose(brief, 1)[0]
    robot = team.coder.write(brief, concept)
    scene = assemble(robot, environment, team.integrator.place(brief, concept, robot), task.sensors)
    critique = team.judge.judge(brief, concept, robot, scene, validate(scene.mjcf, needs_contact=brief.needs_contact))
    report = aidsr.probe(scene.mjcf, task, groups=robot.actuator_groups, seed=SEED)
    told = {"approved": critique.passed, "sentence": concept.interpretation, "probe": report}
    return Row(**made, body=concept.name, **told)


def _measured(run: Run, task: GoalTask) -> tuple[Blind, ProbeReport]:
    design = run.design(1)
    report = aidsr.probe(design.path, seed=SEED)
    concept = next(each.concept.read() for each in reversed(design.iterations) if each.concept.read())
    groups = concept.actuator_groups if concept else ()
    scene = (design.final_scene.read() or b"").decode()
    return play_blind(scene, task, groups, EPISODES, 0), report


def _sentence(run: Run) -> str:
    """Return the Judge's last summary or, without one, how the design ended."""
    judged = [each.critique.read() for each in run.design(1).iterations if each.critique.read()]
    if judged and judged[-1]:
        return judged[-1].summary
    outcome = run.design(1).outcome.read()
    return outcome.reason if outcome else ""


def newest_rows() -> dict[tuple[str, str], Row]:
    """Return the newest row of each job and part."""
    return {(row.job, row.part): row for row in read_rows(RESULTS, Row)}


def page(rows: dict[tuple[str, str], Row]) -> str:
    """Return the page as Markdown."""
    all_jobs = jobs()
    made = {name: rows[name, "design"] for name in all_jobs if (name, "design") in rows}
    versions = sorted({f"{name} {number}" for row in rows.values() for name, number in row.versions.items()})
    lines = [
        "# Jobs of one's own",
        "",
        "`python -m benchmarks.own_jobs.run`: each job checked, designed by the built-in rules with one concept, and",
        f"the approved design probed with seed {SEED} (it was chosen and judged by seed 0), two variations.",
        f"Idle and noise: of {EPISODES} episodes, those won by doing nothing and anything, by the reference body of",
        "`aidsr check` and by the approved design. While the search was written (b4c29c5) the valve was looked at with",
        f"seed {SEED}: in its row that seed is tuned on as well.",
        f"Commits {', '.join(sorted({row.commit for row in rows.values()}))}; {', '.join(versions)}.",
        "",
    ]
    for origin in dict.fromkeys(origin for origin, *_ in all_jobs.values()):
        names = [name for name, job in all_jobs.items() if job[0] == origin]
        mine = [made[name] for name in names if name in made]
        solved = sum(row.probe is not None and row.probe.success_share > 0 for row in mine)
        left = [name for name in names if name not in made]
        lines.append(
            f"- {origin}: {sum(row.approved for row in mine)} of {len(names)} approved, {solved} of them solved by the "
            f"probe; designs that were not finished, of which nothing is known: {', '.join(left) or 'none'}"
        )
    lines += [
        "",
        "| job | goal | | idle, noise | of the design | body | approved | probe: progress, won | commit | the Judge |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [_line(name, all_jobs[name], rows) for name in all_jobs if name in {job for job, _ in rows}]
    before = [name for name in BY_WORDS if (name, "words") in rows]
    if before:
        lines += [
            "",
            "## Before the rules measured",
            "",
            "`python -m benchmarks.own_jobs.run --only words`: one concept of the rules that read the words of the",
            f"objective alone, probed with seed {SEED} as it stands on its mount, unrepaired; beside it the design",
            "of the table above. A body that was not approved has the progress that the Judge told of, with seed 0.",
            "",
            "| job | by words: body | their Judge passed | progress, won | measured: body | approved | the same |",
            "|---|---|---|---|---|---|---|",
        ]
        lines += [_compared(name, rows) for name in before]
    return "\n".join(lines) + "\n"


def _compared(name: str, rows: dict[tuple[str, str], Row]) -> str:
    cells = [name]
    for row in (rows[name, "words"], rows.get((name, "design"))):
        cells += [row.body, "yes" if row.approved else "no", _reached(row)] if row else ["–"] * 3
    return f"| {' | '.join(format_cell(cell) for cell in cells)} |"


def _reached(row: Row) -> str:
    if row.probe is None:
        told = re.search(r"progress (\d\.\d+)", row.sentence)
        return f"{told.group(1)}, none" if told else "–"
    count = len(row.probe.variations)
    return f"{row.probe.progress:.2f}, {round(row.probe.success_share * count)} of {count}"


def _line(name: str, job: tuple[str, str, str, str], rows: dict[tuple[str, str], Row]) -> str:
    def won(row: Row | None) -> str:
        return f"{row.blind.idle}, {row.blind.noise}" if row and row.blind else "–"

    checked, designed = rows.get((name, "check")), rows.get((name, "design"))
    probe = _reached(designed) if designed and designed.probe else "–"
    approved = "–" if designed is None else "yes" if designed.approved else "no"
    told = (designed.body, designed.commit[:7], designed.sentence) if designed else ("–", "–", "–")
    cells = (name, parse_goal(job[3]).kind, job[0], won(checked), won(designed), told[0], approved, probe, *told[1:])
    return f"| {' | '.join(format_cell(cell) for cell in cells)} |"


def main() -> None:
    """Do the missing or named parts, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("jobs", nargs="*", help="to be done again; all that are missing unless named")
    parser.add_argument("--only", choices=get_args(Part), help="this part of each")
    parser.add_argument("--page", action="store_true", help="write results.md alone")
    given = parser.parse_args()
    parts = [(name, part) for name in given.jobs or jobs() for part in get_args(Part) if given.only in (None, part)]
    parts = [(name, part) for name, part in parts if part != "words" or name in BY_WORDS]
    wanted = [] if given.page else [part for part in parts if given.jobs or part not in newest_rows()]
    for name, part in wanted:
        with TemporaryDirectory() as folder:
            row = do(name, part, Path(folder))
        append_row(RESULTS, row)
        line = _compared(name, newest_rows()) if part == "words" else _line(name, jobs()[name], newest_rows())
        print(line, flush=True)  # noqa: T201
    PAGE.write_text(page(newest_rows()))


if __name__ == "__main__":
    main()
