"""How many approved designs could be built, and what keeps the rest from it.

    python benchmarks/fabrication/run.py build/studies/builtin --out build/fabrication

Exports every approved design under a folder of runs, and writes a table beside the exports. What is there is kept, so
that a stopped command goes on.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from pathlib import Path
from typing import Any

from aidsr.errors import AidsrError
from aidsr.fabrication.package import MARK
from aidsr.pipeline.exporting import export
from aidsr.runs import DesignFolder


def main() -> None:
    """Export all designs and write table.json and table.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", type=Path)
    parser.add_argument("--out", type=Path, default=Path("build/fabrication"))
    parser.add_argument("--printer", default="fdm")
    parser.add_argument("--material", default=None)
    asked = parser.parse_args()
    rows = []
    for path in sorted(asked.runs.rglob("designs/*/outcome.json")):
        outcome = DesignFolder(path.parent).outcome.read()
        if outcome is None or outcome.outcome != "approved":
            continue
        rows.append(_row(path.parent, asked.out, asked.printer, asked.material))
        print(json.dumps(rows[-1]), flush=True)  # noqa: T201
    asked.out.mkdir(parents=True, exist_ok=True)
    (asked.out / "table.json").write_text(json.dumps(rows, indent=2) + "\n")
    (asked.out / "table.md").write_text(_table(rows))
    print(_table(rows))  # noqa: T201


def _row(design: Path, out: Path, printer: str, material: str | None) -> dict[str, Any]:
    """Export one design, unless that was done, and return what came of it."""
    run = design.parent.parent
    folder = out / f"{run.name}_{design.name}"
    if not (folder / MARK).exists():
        began = time.monotonic()
        try:
            export(design, folder, printer=printer, material=material)
        except AidsrError as error:
            return {"design": folder.name, "verdict": "not exported", "errors": [str(error)], "warnings": []}
        (folder / "took_s.txt").write_text(f"{time.monotonic() - began:.1f}\n")
    verdict = json.loads((folder / MARK).read_text())
    concept = json.loads(sorted(design.glob("*/concept.json"))[-1].read_text())
    reasons = [(fault["severity"], fault["code"]) for fault in verdict["reasons"]]
    return {
        "design": folder.name,
        "family": concept["family"],
        "verdict": verdict["verdict"],
        "material": verdict["material"],
        "errors": sorted(code for severity, code in reasons if severity == "error"),
        "warnings": sorted(code for severity, code in reasons if severity == "warning"),
        "moving_mass_ratio": round(verdict["moving_built_g"] / verdict["moving_simulated_g"], 3),
        "reach_ratio": round(verdict["retest"]["reach_m"] / verdict["retest"]["designed_reach_m"], 3),
        "cost_usd": verdict["cost_usd"],
        "took_s": float((folder / "took_s.txt").read_text()) if (folder / "took_s.txt").exists() else None,
    }


def _table(rows: list[dict[str, Any]]) -> str:
    """Return the rows as Markdown, with counts below."""
    lines = [
        "| design | family | verdict | limbs | errors | warnings | mass | reach | USD |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        cells = [
            row["design"],
            row.get("family", ""),
            row["verdict"],
            row.get("material", ""),
            ", ".join(row["errors"]),
            ", ".join(row["warnings"]),
            f"{row.get('moving_mass_ratio', float('nan')):.2f}",
            f"{row.get('reach_ratio', float('nan')):.2f}",
            f"{row.get('cost_usd', float('nan')):.0f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    verdicts = Counter(row["verdict"] for row in rows)
    reasons = Counter(code for row in rows for code in set(row["errors"]))
    lines += ["", f"{len(rows)} designs: " + ", ".join(f"{count} {name}" for name, count in verdicts.most_common())]
    lines.append("Reasons: " + (", ".join(f"{code} {count}" for code, count in reasons.most_common()) or "none") + ".")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
