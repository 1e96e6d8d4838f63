"""Write docs/policies.md: pictures of the best policy of each task in studies, and today's results beside them.

    python benchmarks/builtin/films.py build/builtin-60000 build/builtin-300000
    python benchmarks/builtin/films.py build/builtin-300000 --tasks reaching/pipe_inserting
    python benchmarks/builtin/films.py

The best design is the one that wins most held-out episodes. The page shows its best episode; for a task without a
success this is the episode that came furthest. Pictures and captions of other tasks stay as they are. Today's results
are those of the table of today's version of the benchmark beside this file; without a study only they are renewed.
"""

from __future__ import annotations

import argparse
import io
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from aidsr.render.pictures import filmstrip
from aidsr.studies.gallery import Card, gallery
from aidsr.studies.outcomes import read_outcomes
from aidsr.studies.study import Study, StudyPlan, open_study
from aidsr.tasks import BENCHMARK_VERSION, TASKS_IN_SAMPLE, TASKS_OUT_OF_SAMPLE, is_current

DOCS = Path(__file__).parents[2] / "docs"
TODAY = max(Path(__file__).parent.glob("results-version?.jsonl"))
"""The newest table; its rows count where their task has not changed since."""
_MOMENTS, _WIDTH, _HEIGHT, _FINER = 4, 220, 165, 2
"""Number of moments of a strip, width and height of each [px], and the factor by which they are drawn larger first, so
that edges are smooth."""
_CAPTION = re.compile(r"^## (\S+)\n\n(.+)\n", re.MULTILINE)
_VERSION = re.compile(r" in version (\d+) of the benchmark")
_HEAD = """# What good policies do{of}
{superseded}
Each strip shows moments of a design's best held-out episode, from the first on the left to the last on the right. The
robots are designs of the built-in rules. The camera follows a robot that travels; the picture shows the time and the
distance from the start. `python benchmarks/builtin/films.py STUDY …` makes this page from the design with the highest
success rate in the given studies, so the tables in `benchmarks/builtin` may contain better ones. The films themselves
(`best.mp4`) are in the folders of the studies. There is no picture of these tasks:
{without}.
"""
_SUPERSEDED = """
**Superseded**: pictures and captions of {versions} show policies that were judged by the rules of their time.
[Today's version](tasks.md#reasons-for-some-choices) is {today}, which no longer accepts some of the ways in which tasks
were won. Each section therefore names today's result of the built-in designs of its task, from
[{table}](../benchmarks/builtin/{table}); figures of the two are not comparable.
"""


def main() -> None:
    """Write the page and its pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("studies", type=Path, nargs="*", metavar="STUDY")
    parser.add_argument(
        "--tasks", nargs="+", choices=TASKS_IN_SAMPLE, default=TASKS_IN_SAMPLE, help="whose films to renew"
    )
    asked = parser.parse_args()
    studies = [open_study(path) for path in asked.studies]
    page = DOCS / "policies.md"
    captions = dict(_CAPTION.findall(page.read_text(encoding="utf-8")))
    for task in asked.tasks:
        found = [_best(study, task) for study in studies if task in study.plan.tasks]
        shown = max(filter(None, found), key=lambda one: one[0], default=None)
        if shown is not None:
            captions[task] = _caption(*shown[1:])
            picture = DOCS / _picture(task)
            picture.parent.mkdir(parents=True, exist_ok=True)
            _draw(shown[1], picture)
    sections = [_section(task, captions[task]) for task in TASKS_IN_SAMPLE if task in captions]
    page.write_text(_head(captions) + "".join(sections), "utf-8")


def _head(captions: Mapping[str, str]) -> str:
    """Return the text before the sections: which versions of the benchmark the captions are of, and what is missing."""
    shown = {(task, int(version)) for task, caption in captions.items() for version in _VERSION.findall(caption)}
    superseded = sorted({version for task, version in shown if not is_current(task, version)})
    versions = f"version{'s' * (len(superseded) > 1)} " + " and ".join(map(str, superseded))
    table = TODAY.with_suffix(".md").name
    return _HEAD.format(
        of=f", {versions} of the benchmark" if superseded else "",
        superseded=_SUPERSEDED.format(versions=versions, today=BENCHMARK_VERSION, table=table) if superseded else "",
        without=", ".join(_name(task) for task in (*TASKS_IN_SAMPLE, *TASKS_OUT_OF_SAMPLE) if task not in captions),
    )


def _section(task: str, caption: str) -> str:
    """Return the section on a task: caption, today's result and picture."""
    return f"\n## {task}\n\n{caption}\n\n{_today(task)}\n\n![{task}]({_picture(task)})\n"


def _caption(card: Card, plan: StudyPlan) -> str:
    """Return what is said of a picture."""
    told = f"{card.what}, trained for at most {plan.steps:,} control steps"
    return told + f" in version {plan.benchmark_version} of the benchmark: {card.how_well}."


def _today(task: str) -> str:
    """Return the result of a task's best built-in design in today's version of the benchmark."""
    rows: list[dict[str, Any]] = [json.loads(line) for line in TODAY.read_text(encoding="utf-8").splitlines()]
    own = [row for row in rows if row["task"] == task and is_current(task, row["benchmark_version"])]
    if not own:
        return f"Today, version {BENCHMARK_VERSION}: not measured yet."
    best = max(own, key=lambda row: row["success_share"])
    word = "successful" if best["successful"] else "valid, not successful" if best["valid"] else "not valid"
    which = f"{best['family']}, design {best['design']}" + (f", the best of {len(own)}" if len(own) > 1 else "")
    return f"Today, version {BENCHMARK_VERSION}: {which}: {word}, {100 * best['success_share']:.0f} % of episodes won."


def _name(task: str) -> str:
    return task.rpartition("/")[2]


def _picture(task: str) -> str:
    """Return the path of a task's picture beside the page."""
    return f"images/policies/{_name(task)}.jpg"


def _draw(card: Card, picture: Path) -> None:
    """Draw moments of the motion that a training recorded."""
    with np.load(card.motion) as motion:
        drawn = filmstrip(
            str(motion["mjcf"]),
            qpos=motion["qpos"],
            frames_per_s=1.0 / float(motion["frame_s"]),
            count=_MOMENTS,
            width=_FINER * _WIDTH,
            height=_FINER * _HEIGHT,
        )
    Image.open(io.BytesIO(drawn)).resize((_MOMENTS * _WIDTH, _HEIGHT)).save(picture, quality=85)


def _best(study: Study, task: str) -> tuple[float, Card, StudyPlan] | None:
    """Return the share of episodes that a study's best design wins, its card and the study's plan; None without one."""
    rows = [row for row in read_outcomes(study) if row.task == task and row.evaluations]
    cards = [card for card in gallery(study, rows) if card.motion]
    return (max(row.episodes_share for row in rows), cards[0], study.plan) if cards else None


if __name__ == "__main__":
    main()
