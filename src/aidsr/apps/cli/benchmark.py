"""`aidsr benchmark`, `report`, `compare`, `submit` and `leaderboard`: studies of many runs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.apps.cli.flag import Flag
from aidsr.apps.cli.plan_options import PlanOptions
from aidsr.apps.cli.spending import StudyLimits


def benchmark(
    study: Path,
    /,
    *,
    options: PlanOptions | None = None,
    limits: StudyLimits | None = None,
    jobs: Annotated[int, Parameter(validator=Number(gte=1, lte=512))] = 2,
    ray: str | None = None,
    resume: Flag = False,
    trust: Flag = False,
    dry_run: Flag = False,
) -> int:
    """Run a study: design, train and evaluate robots for many tasks, and write the report.

    A study is a folder with a fixed plan. To resume it, repeat the command, or use --resume without the other options.

        aidsr benchmark studies/first --tasks button_pushing flat_ground --designs 3 --steps 50000

        aidsr benchmark studies/first --resume --jobs 4

        aidsr benchmark studies/second --tasks gap --model openai:gpt-5 --max-cost 20

    Exit code 0: all jobs are done. 1: some jobs failed (see failures.jsonl) or did not fit in the cost or token limit.
    130: interrupted.

    Parameters
    ----------
    study
        Folder of the study.
    jobs
        Number of parallel jobs on this machine; each uses one core.
    ray
        Address of a Ray cluster that runs the jobs, or "auto" for the cluster that runs here; requires the extra "ray".
    resume
        Resume the study with the plan in its folder.
    trust
        Allow a study that was not made here to send its prompts and your API keys to the addresses in its study.toml.
    dry_run
        Print the estimated cost and exit.
    """
    from aidsr.apps.cli.studies import StudyTable, print_forecast, print_unfinished
    from aidsr.apps.cli.terminal import make_console
    from aidsr.apps.cli.trust import confirmed
    from aidsr.core.errors import UserError
    from aidsr.studies.benchmark import check_machine, find_study, run_jobs
    from aidsr.studies.budget import check_budget, read_budget
    from aidsr.studies.report import write_report
    from aidsr.studies.study import require_study_is_ours

    console, asked = make_console(), options or PlanOptions()
    if resume and asked.given:
        raise UserError(
            f"--resume cannot be combined with {', '.join(asked.given)}: the plan is read from {study / 'study.toml'}"
        )
    found = find_study(study, None if resume else asked.plan())
    limit = (limits or StudyLimits()).changed(read_budget(found))
    check_budget(found, limit)
    print_forecast(console, found, jobs=0 if ray else jobs, limit=limit)
    check_machine(found, ray or "")
    if dry_run:
        return 0
    confirmed(partial(require_study_is_ours, found), trust)
    try:
        with StudyTable(console, found) as table:
            progress = run_jobs(found, limit, jobs=jobs, ray=ray or "", listen=table.listen)
    except KeyboardInterrupt:
        resuming = f"aidsr benchmark {found.quoted_path} --resume"
        console.print(f"\nInterrupted. Resume with {resuming}", markup=False, soft_wrap=True)
        return 130
    console.print(f"Report: {write_report(found)}", markup=False, soft_wrap=True)
    if progress.unpaid:
        print_unfinished(console, found, progress.refused)
    return 1 if progress.failed or progress.unpaid else 0


def report(study: Path, /) -> int:
    """Write the report of a study in its current state: report.html, .md, .csv and .json in its folder.

    `aidsr benchmark` writes it at its end; this command also works while the study is in progress.

        aidsr report studies/first

    Parameters
    ----------
    study
        Folder of the study.
    """
    from aidsr.apps.cli.terminal import write
    from aidsr.studies.report import write_report
    from aidsr.studies.study import open_study

    write(f"{write_report(open_study(study))}\n")
    return 0


def compare(one: Path, other: Path, /) -> int:
    """Test whether the difference between two studies is statistically significant.

    Designs are paired by task, run and number; the first arm of each study is compared.

        aidsr compare studies/before studies/after

    Parameters
    ----------
    one
        Folder of the first study.
    other
        Folder of the second study.
    """
    from aidsr.apps.cli.studies import print_comparison
    from aidsr.apps.cli.terminal import make_console
    from aidsr.studies.study import open_study

    return print_comparison(make_console(), open_study(one), open_study(other))


def submit(study: Path, /, *, out: Path | None = None) -> int:
    """Write the results of a study to one small file that others can verify and merge.

    `aidsr leaderboard` reads such files.

        aidsr submit studies/first --out first.json

    Parameters
    ----------
    study
        Folder of the study.
    out
        Output file; default: submission.json in the study's folder.
    """
    from aidsr.apps.cli.terminal import write
    from aidsr.studies.study import open_study
    from aidsr.studies.submission import read_submission
    from aidsr.studies.submission import submit as write_submission

    path = out if out is not None else study / "submission.json"
    write_submission(open_study(study), path)
    found = read_submission(path)
    write(f"{path}: {len(found.designs)} designs, sha256 {found.sha256}\n")
    return 0


def leaderboard(submissions: list[Path], /, *, study: Path | None = None) -> int:
    """Verify submitted result files and merge them into one table.

    The results of each file are recomputed from its raw outcomes. A file that was damaged or edited by accident is
    refused; a forged one is not recognized.

        aidsr leaderboard ours.json theirs.json > leaderboard.md

    Parameters
    ----------
    submissions
        Files written by `aidsr submit`.
    study
        Study folder from which the first file was made; also check that it contains exactly the submitted scenes.
    """
    from aidsr.apps.cli.terminal import write, write_document
    from aidsr.studies.leaderboard import check_scenes
    from aidsr.studies.leaderboard import leaderboard as merged
    from aidsr.studies.study import open_study

    write_document(merged(submissions))
    if study is not None:
        count = check_scenes(submissions[0], open_study(study))
        write(f"\n{submissions[0]}: all {count} scenes match those in {study}.\n")
    return 0
