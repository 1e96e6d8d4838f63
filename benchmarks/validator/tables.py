"""The corpus report as Markdown."""

from __future__ import annotations

import math
from typing import Any

from aidsr.core.rates import wilson

_HEAD = """# The validator measured on the corpus

Made by `COMMAND`; figures as JSON in `results.json`, what the words mean in `README.md`. The aims, on the
robots held out: at least 95 % of bad robots refused, 90 % with the right code, and at most 2 % of good ones refused.
"""


def markdown(figures: dict[str, Any]) -> str:
    """Return the report on one or several splits as Markdown."""
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
        *_kinds(split["kinds"], split["good_kinds"]),
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


def _kinds(bad: dict[str, dict[str, int]], good: dict[str, dict[str, int]]) -> list[str]:
    """Return the tables of bad and of good robots by kind, with Wilson intervals at 95 %."""
    lines = [
        "Refused: with any error. Right code: with the fault that was made, among the errors, or the warnings where "
        "the rule has no errors. Behind each count its share and Wilson's interval at 95 %.",
        "",
        "| bad robots by kind of fault | robots | refused | right code |",
        "|---|---|---|---|",
    ]
    for kind, counts in [*bad.items(), ("**all**", _total(bad))]:
        cells = (_interval(counts[name], counts["robots"]) for name in ("refused", "right_code"))
        lines.append(f"| {kind} | {counts['robots']} | {' | '.join(cells)} |")
    lines += ["", "| good robots by writer | robots | refused |", "|---|---|---|"]
    for kind, counts in [*good.items(), ("**all**", _total(good))]:
        lines.append(f"| {kind} | {counts['robots']} | {_interval(counts['refused'], counts['robots'])} |")
    return [*lines, ""]


def _total(kinds: dict[str, dict[str, int]]) -> dict[str, int]:
    return {name: sum(counts[name] for counts in kinds.values()) for name in ("robots", "refused", "right_code")}


def _interval(count: int, total: int) -> str:
    if not total:
        return "none"
    found = wilson(count, total)
    return f"{count}, {100 * count / total:.1f} % ({100 * found.low:.0f} to {100 * found.high:.0f} %)"


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
    found = wilson(count, total)
    interval = f"{100 * found.low:.0f} to {100 * found.high:.0f} %"
    return f"| {words} | {count} of {total} ({100 * count / total:.1f} %) | {interval} |"


def _near(rules: dict[str, Any]) -> tuple[int, int]:
    blamed, near = (sum(rule[name] for rule in rules.values()) for name in ("near_misses_blamed", "near_misses"))
    return blamed, near


def _times(severity: float | None) -> str:
    return "" if severity is None else f"; {severity:.3g} times the limit"


def _sum(put_aside: dict[str, int], ending: str) -> int:
    return sum(count for reason, count in put_aside.items() if reason.endswith(ending))
