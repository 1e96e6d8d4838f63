"""How many approved designs can be built, and which faults prevent the others.

    python benchmarks/fabrication/run.py runs --jobs 2
    python benchmarks/fabrication/run.py 'build/builtin-300000/runs/builtin/*/2' --jobs 2 --policy

Exports every approved design below a folder of runs or studies, or below all folders that match a pattern. Exports that
exist are kept, if they were made with the same options at the same commit, so that a stopped command can be continued.
"""

from __future__ import annotations

import argparse
import glob
import json
import platform
import shlex
import sys
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from aidsr.core.config import VERDICT_EPISODES
from aidsr.core.errors import AidsrError
from aidsr.core.provenance import commit
from aidsr.core.rates import wilson
from aidsr.fabrication.schema import MARK
from aidsr.loop.export import export
from aidsr.runs import DesignFolder, Run
from aidsr.runs.trainings import trainings_of

Row = dict[str, Any]
MADE = "made.json"
"""File in an export with the settings that it was made with and the time it took."""


def main() -> None:
    """Export all designs and write table.json and the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", help="a folder, or a pattern of folders in quotes")
    parser.add_argument("--out", type=Path, default=Path("build/fabrication"))
    parser.add_argument("--report", type=Path, help="Markdown to write; OUT/table.md unless named")
    parser.add_argument("--jobs", type=int, default=1, help="exports at once")
    parser.add_argument("--policy", action="store_true", help="try trained policies, where a design has one")
    parser.add_argument("--printer", default="fdm")
    parser.add_argument("--material", default=None)
    asked = parser.parse_args()
    tasks = [(design, asked.out, asked.printer, asked.material, asked.policy) for design in approved(asked.runs)]
    if not tasks:
        sys.exit(f"approved designs were expected below {asked.runs}, and there are none; name another folder")
    asked.out.mkdir(parents=True, exist_ok=True)
    rows = []
    with ProcessPoolExecutor(asked.jobs) as workers:
        for row in workers.map(_row, *zip(*tasks, strict=True)):
            rows.append(row)
            print(json.dumps(row), flush=True)  # noqa: T201
    (asked.out / "table.json").write_text(json.dumps(rows, indent=2) + "\n")
    text = account(rows, f"python {shlex.join(sys.argv)}")
    (asked.report or asked.out / "table.md").write_text(text)
    print(text)  # noqa: T201


def approved(runs: str) -> list[Path]:
    """Return the sorted folders of all approved designs, at any depth, below the folders that match a pattern."""
    found, homes = [], glob.glob(runs)  # noqa: PTH207 - Path.glob refuses absolute patterns
    for path in sorted(path for home in homes for path in Path(home).rglob("designs/*/outcome.json")):
        outcome = DesignFolder(path.parent).outcome.read()
        if outcome is not None and outcome.outcome == "approved":
            found.append(path.parent)
    return found


def _row(design: Path, out: Path, printer: str, material: str | None, policy: bool) -> Row:
    """Export one design, unless an export with the same settings exists, and return its row of the table."""
    run = design.parent.parent
    folder = out / f"{run.name}_{design.name}"
    concept = json.loads(sorted(design.glob("*/concept.json"))[-1].read_text())
    row = {"design": folder.name, "task": Run(run).brief().task, "family": concept["family"]}
    finished = [one for one in trainings_of(DesignFolder(design)) if one.result.path.exists()]
    evaluation = finished[-1].evaluation.read() if finished else None
    settings = settings_of(printer, material, policy=policy and bool(finished))
    if not exported_with(folder, settings):
        began = time.monotonic()
        try:
            export(design, folder, printer=printer, material=material, policy=settings["policy"])
        except AidsrError as error:
            return row | {"verdict": "not exported", "errors": [str(error)], "warnings": []}
        made = {"settings": settings, "took_s": round(time.monotonic() - began, 1)}
        (folder / MADE).write_text(json.dumps(made) + "\n")
    verdict = json.loads((folder / MARK).read_text())
    retest, reasons = verdict["retest"], [(fault["severity"], fault["code"]) for fault in verdict["reasons"]]
    return row | {
        "verdict": verdict["verdict"],
        "material": verdict["material"],
        "errors": sorted(code for severity, code in reasons if severity == "error"),
        "warnings": sorted(code for severity, code in reasons if severity == "warning"),
        "moving_mass_ratio": round(verdict["moving_built_g"] / verdict["moving_simulated_g"], 3),
        "reach_ratio": round(retest["reach_m"] / retest["designed_reach_m"], 3),
        "success": [retest["designed_success_share"], retest["success_share"]],
        "episodes": (len(evaluation.episodes) if evaluation else VERDICT_EPISODES) if settings["policy"] else None,
        "cost_usd": verdict["cost_usd"],
        "took_s": json.loads((folder / MADE).read_text())["took_s"],
    }


def settings_of(printer: str, material: str | None, *, policy: bool) -> dict[str, Any]:
    """Return the settings of an export, by which a later command knows whether it can keep it."""
    return {"printer": printer, "material": material, "policy": policy, "commit": commit()}


def exported_with(folder: Path, settings: dict[str, Any]) -> bool:
    """Return whether a folder holds an export that was made with these settings."""
    made = folder / MADE
    return (folder / MARK).exists() and made.exists() and bool(json.loads(made.read_text())["settings"] == settings)


def account(rows: Sequence[Row], command: str) -> str:
    """Return the report as Markdown: the share of designs that can be built, the faults of the others, each design."""
    good = sum(row["verdict"].startswith("buildable") for row in rows)
    share = wilson(good, len(rows))
    verdicts = Counter(row["verdict"] for row in rows)
    episodes = " or ".join(map(str, sorted({row["episodes"] for row in rows if row.get("episodes")}))) or "no"
    lines = [
        "# Approved designs that can be built",
        "",
        f"Command: `{command}`",
        "",
        f"{datetime.now(UTC):%Y-%m-%d}, AID-SR {version('aidsr')}, commit {commit()}, MuJoCo {version('mujoco')}, "
        f"manifold3d {version('manifold3d')}, Python {platform.python_version()}.",
        "",
        f"{good} of {len(rows)} can be built, with or without changes (95 % interval {share.low:.0%} to "
        f"{share.high:.0%}): " + ", ".join(f"{count} {name}" for name, count in verdicts.most_common()) + ".",
        "",
        f"What keeps the rest from it: {_counted(rows, 'errors')}. Warnings: {_counted(rows, 'warnings')}.",
        "",
        f"Mass (what moves) and reach: as built / as designed. Success: share of {episodes} held-out episodes with the "
        "trained policy, as designed and as built; blank where the design was not trained.",
        "",
        "| design | task | family | verdict | limbs | errors | warnings | mass | reach | success | USD |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
        *map(_line, rows),
    ]
    return "\n".join(lines) + "\n"


def _counted(rows: Sequence[Row], kind: str) -> str:
    counts = Counter(code for row in rows for code in set(row[kind]))
    return ", ".join(f"{code} {count}" for code, count in counts.most_common()) or "none"


def _line(row: Row) -> str:
    if row["verdict"] == "not exported":
        return f"| {row['design']} | {row['task']} | {row['family']} | not exported | | {row['errors'][0]} | | | | | |"
    before, after = row["success"]
    cells = [
        row["design"],
        row["task"],
        row["family"],
        row["verdict"],
        row["material"],
        ", ".join(row["errors"]),
        ", ".join(row["warnings"]),
        f"{row['moving_mass_ratio']:.2f}",
        f"{row['reach_ratio']:.2f}",
        "" if after is None else f"{'?' if before is None else f'{before:.0%}'} → {after:.0%}",
        f"{row['cost_usd']:.0f}",
    ]
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
