"""The corpus report as Markdown."""

from __future__ import annotations

import math
from typing import Any

__all__ = ["markdown"]

_HEAD = """# The validator measured on the corpus

Made by `COMMAND`; figures as JSON in `report.json`, what the words mean in `README.md`.
"""


def markdown(figures: dict[str, Any]) -> str:
    """Return the report on one or both splits."""
    return "\n".join([_HEAD, *(_split(name, split) for name, split in figures.items())])


def _split(name: str, split: dict[str, Any]) -> str:
    versions = ", ".join(f"{package} {version}" for package, version in split["versions"].items())
    blamed, warned = split["good_with_errors"], split["good_with_warnings"]
    lines = [
        f"## {name.capitalize()} robots",
        "",
        f"{split['good']} good robots of {len(split['families'])} families, {split['bad']} bad ones ({versions}).",
        "",
        "| | |",
        "|---|---|",
        f"| recall over all bad robots | {100 * split['recall']:.1f} % of {split['bad']} |",
        f"| good robots with errors | {len(blamed)} of {split['good']} ({100 * split['false_alarm_share']:.1f} %) |",
        f"| good robots with warnings of stability | {len(warned)} of {split['good']} |",
        "",
        *(f"- error: {robot}: {codes}" for robot, codes in blamed.items()),
        *(f"- warning: {robot}: {codes}" for robot, codes in warned.items()),
        "",
        "| rule | bad | found | recall | precision | near misses blamed | band blamed | also there | not there |",
        "|---|---|---|---|---|---|---|---|---|",
        *(_row(code, rule) for code, rule in split["rules"].items()),
        "",
        "Reported instead, where a fault was missed:",
        "",
        *(
            [f"- {code}: {what} ({n})" for code, r in split["rules"].items() for what, n in r["instead"].items()]
            or ["- none"]
        ),
        "",
        "Families: " + ", ".join(f"{family} {n}" for family, n in sorted(split["families"].items())) + ".",
        "",
        "Put aside while the corpus was made, because the oracle found something else than was meant: "
        + str(sum(split["put_aside"].values()))
        + " attempts.",
        "",
    ]
    return "\n".join(lines)


def _row(code: str, rule: dict[str, Any]) -> str:
    cells = [
        f"`{code}`",
        str(rule["bad"]),
        str(rule["found"]),
        _percent(rule["recall"]),
        _percent(rule["precision"]),
        f"{rule['near_misses_blamed']} of {rule['near_misses']}",
        f"{rule['band_blamed']} of {rule['band']}",
        str(rule["also_there"]),
        str(len(rule["also_said_and_not_there"]) + len(rule["good_blamed"])),
    ]
    return "| " + " | ".join(cells) + " |"


def _percent(share: float) -> str:
    return "" if math.isnan(share) else f"{100 * share:.0f} %"
