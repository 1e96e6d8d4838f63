"""Write docs/policies.md: pictures of the best policy of each task in studies.

    python benchmarks/builtin/films.py build/builtin-60000 build/builtin-300000
    python benchmarks/builtin/films.py build/builtin-300000 --tasks reaching/pipe_inserting

The best design is the one that wins most held-out episodes. The page shows its best episode; for a task without a
success this is the episode that came furthest. The page's sections on other tasks stay as they are.
"""

from __future__ import annotations

import argparse
import io
import re
from pathlib import Path

import numpy as np
from PIL import Image

from aidsr.render.pictures import filmstrip
from aidsr.studies.gallery import Card, gallery
from aidsr.studies.outcomes import read_outcomes
from aidsr.studies.study import Study, StudyPlan, open_study
from aidsr.tasks import TASKS_IN_SAMPLE

DOCS = Path(__file__).parents[2] / "docs"
_MOMENTS, _WIDTH, _HEIGHT, _FINER = 4, 220, 165, 2
"""Number of moments of a strip, width and height of each [px], and the factor by which they are drawn larger first, so
that edges are smooth."""
_SECTION = re.compile(r"^## (\S+)\n(.*?\n)(?=\n## |\Z)", re.DOTALL | re.MULTILINE)
_HEAD = """# What good policies do

Each strip shows moments of a design's best held-out episode, from the first on the left to the last on the right. The
robots are designs of the built-in rules. The camera follows a robot that travels; the picture shows the time and the
distance from the start. `python benchmarks/builtin/films.py STUDY …` makes this page from the design with the highest
success rate in the given studies, so the tables in `benchmarks/builtin` may contain better ones. Each caption names the
version of the benchmark; designs of an older version were judged by its rules. The films themselves (`best.mp4`) are in
the folders of the studies.
"""


def main() -> None:
    """Write the page and its pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("studies", type=Path, nargs="+")
    parser.add_argument(
        "--tasks", nargs="+", choices=TASKS_IN_SAMPLE, default=TASKS_IN_SAMPLE, help="whose films to renew"
    )
    asked = parser.parse_args()
    studies = [open_study(path) for path in asked.studies]
    page = DOCS / "policies.md"
    said = dict(_SECTION.findall(page.read_text(encoding="utf-8")))
    for task in asked.tasks:
        found = [_best(study, task) for study in studies if task in study.plan.tasks]
        shown = max(filter(None, found), key=lambda one: one[0], default=None)
        if shown is not None:
            said[task] = _section(task, *shown[1:])
    page.write_text(_HEAD + "".join(f"\n## {task}\n{said[task]}" for task in TASKS_IN_SAMPLE if task in said), "utf-8")


def _section(task: str, card: Card, plan: StudyPlan) -> str:
    """Draw a design's motion; return the text below the task's heading."""
    picture = DOCS / "images" / "policies" / f"{task.rpartition('/')[2]}.jpg"
    picture.parent.mkdir(parents=True, exist_ok=True)
    _draw(card, picture)
    told = f"{card.what}, trained for at most {plan.steps:,} control steps"
    told += f" in version {plan.benchmark_version} of the benchmark: {card.how_well}."
    return f"\n{told}\n\n![{task}](images/policies/{picture.name})\n"


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
