"""The corpus report as Markdown."""

from __future__ import annotations

import math
from typing import Any

_HEAD = """# The validator measured on the corpus

Made by `COMMAND`; figures as JSON in `results.json`, what the words mean in `README.md`. The aims are recall of at
least 98 % and at most 2 % of good robots blamed.
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
        "| | | Wilson 95 % |",
        "|---|---|---|",
        _share("bad robots found", split["found"], split["bad"]),
        _share("good robots with errors", len(blamed), split["good"]),
        _share("near misses blamed for what they nearly have", *_near(split["rules"])),
        f"| good robots with warnings of stability | {len(warned)} of {split['good']} | |",
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
        *(
            f"- missed: {robot['robot']}: {robot['change']}{_times(robot['severity'])}"
            for r in split["rules"].values()
            for robot in r["missed"]
        ),
        "",
        "Families: " + ", ".join(f"{family} {n}" for family, n in sorted(split["families"].items())) + ".",
        "",
        f"Put aside while the corpus was made, because the oracle found something else than was meant: "
        f"{sum(split['put_aside'].values())} attempts, of which {_sum(split['put_aside'], ': diverges')} diverge and "
        f"{_sum(split['put_aside'], 'both time steps')} have their fault at one of two time steps only.",
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


def _share(words: str, count: int, total: int) -> str:
    if not total:
        return f"| {words} | none looked at | |"
    low, high = _wilson(count, total)
    return f"| {words} | {count} of {total} ({100 * count / total:.1f} %) | {100 * low:.0f} to {100 * high:.0f} % |"


def _wilson(count: int, total: int, z: float = 1.96) -> tuple[float, float]:
    """Interval of a share at 95 %. Source: Wilson (1927), the score interval of a binomial share."""
    share = count / total
    middle = (share + z**2 / (2 * total)) / (1 + z**2 / total)
    half = z / (1 + z**2 / total) * math.sqrt(share * (1 - share) / total + z**2 / (4 * total**2))
    return max(0.0, middle - half), min(1.0, middle + half)


def _near(rules: dict[str, Any]) -> tuple[int, int]:
    blamed, near = (sum(rule[name] for rule in rules.values()) for name in ("near_misses_blamed", "near_misses"))
    return blamed, near


def _times(severity: float | None) -> str:
    return "" if severity is None else f"; {severity:.3g} times the limit"


def _sum(put_aside: dict[str, int], ending: str) -> int:
    return sum(count for reason, count in put_aside.items() if reason.endswith(ending))
