"""Write docs/policies.md: moments of the best policy of each task of a study.

    python benchmarks/builtin/films.py build/builtin-60000

Best is the design that wins most held-out episodes; what is shown is its best episode, so a task at which nobody
succeeds shows how far the best one came.
"""

from __future__ import annotations

import argparse
import base64
from pathlib import Path

from aidsr.benchmark.gallery import gallery
from aidsr.benchmark.outcomes import read_outcomes
from aidsr.benchmark.study import open_study

DOCS = Path(__file__).parents[2] / "docs"
_KINDS = {"data:image/jpeg;base64": "jpg", "data:image/png;base64": "png"}
_HEAD = """# What the best policies do

Moments of the best held-out episode of the best design of each task, the first on the left and the last on the right:
robots of the built-in team, {steps:,} control steps of training at most. Made by `python benchmarks/builtin/films.py`
from the study whose table is `benchmarks/builtin/results.md`; the films themselves (`best.mp4`) are in its folders.
Tasks of which no design has been trained yet are missing.
"""


def main() -> None:
    """Write the page and its pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path)
    study = open_study(parser.parse_args().study)
    cards = gallery(study, [row for row in read_outcomes(study) if row.evaluations])
    folder = DOCS / "images" / "policies"
    folder.mkdir(parents=True, exist_ok=True)
    lines = [_HEAD.format(steps=study.plan.steps)]
    for task in study.plan.tasks:
        best = next((card for card in cards if card.task == task), None)
        if best is None:
            continue
        kind, _, content = best.url.partition(",")
        picture = folder / f"{task.rpartition('/')[2]}.{_KINDS[kind]}"
        picture.write_bytes(base64.b64decode(content))
        lines += [
            f"## {task}",
            "",
            f"{best.what}: {best.how_well}.",
            "",
            f"![{task}](images/policies/{picture.name})",
            "",
        ]
    (DOCS / "policies.md").write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
