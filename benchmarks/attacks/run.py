"""Attack every command and write the results: kills, servers, documents and replies, foreign folders, requests.

    make attacks

Each try is a line of results.jsonl with the commit of the code. A try that is already there is not repeated, unless
--again gives the beginning of its name. results.md is made from these lines.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from benchmarks.attacks import documents, folders, kills, requests, servers  # noqa: E402 - they import from tests/
from benchmarks.attacks.tries import LIMIT_S, WALL_S, Outcome  # noqa: E402

from aidsr.core.provenance import commit  # noqa: E402

RESULTS, PAGE = HERE / "results.jsonl", HERE / "results.md"
ATTACKS = {
    "kills": "`kill -9` of a command, or of its workers alone, at moments spread over its work; then the same command",
    "servers": "a language model's server, hostile or broken, under a design",
    "documents": "hostile MJCF and replies",
    "folders": "runs, studies and trainings from strangers",
    "requests": "requests to the web app and messages to the MCP server",
}
Try = tuple[str, Callable[[], Outcome]]


def main() -> None:
    """Run the tries that are missing, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=tuple(ATTACKS), help="one kind of attack")
    parser.add_argument("--again", default="", help="repeat the tries whose names begin so")
    parser.add_argument("--write-only", action="store_true", help="write the page of what is there, do nothing else")
    options = parser.parse_args()
    rows = {row["try"]: row for row in _kept() if not (options.again and row["try"].startswith(options.again))}
    place = Path(tempfile.mkdtemp(prefix="aidsr-attacks-"))
    os.environ["XDG_CONFIG_HOME"] = str(place / "settings")
    os.chdir(_empty(place))
    warnings.simplefilter("ignore")
    for name, attempt in _tries(place, options.only):
        if name in rows or options.write_only:
            continue
        outcome = _made(attempt)
        if outcome.notes.get("killed") == 0 and not outcome.hang:
            continue  # the command ended before it could be killed; the next run tries again
        rows[name] = {"try": name, **outcome.row(), "commit": commit()}
        with RESULTS.open("a", encoding="utf-8") as file:
            file.write(json.dumps(rows[name]) + "\n")
        _say(f"{name}: {'survived' if rows[name]['survived'] else rows[name]}")
    planned = [name for name, _ in _tries(place, None)]
    PAGE.write_text(page(list(rows.values()), len(planned)), encoding="utf-8")
    shutil.rmtree(place, ignore_errors=True)


def _empty(place: Path) -> Path:
    folder = place / "documents"
    folder.mkdir()
    return folder


def _tries(place: Path, only: str | None) -> Iterator[Try]:
    kinds: dict[str, Callable[[], Iterator[Try]]] = {
        "requests": lambda: requests.tries(place / "requests"),
        "folders": lambda: folders.tries(place / "folders"),
        "servers": lambda: servers.tries(place / "servers"),
        "documents": lambda: documents.tries(place / "documents"),
        "kills": lambda: chain(kills.tries(place / "kills"), requests.killed_tries(place / "kills")),
    }
    for kind, of in kinds.items():
        if only in (None, kind):
            yield from of()


def _made(attempt: Callable[[], Outcome]) -> Outcome:
    began_s = time.monotonic()
    outcome = attempt()
    outcome.seconds = round(time.monotonic() - began_s, 1)
    return outcome


def _kept() -> list[dict[str, Any]]:
    if not RESULTS.exists():
        return []
    rows = {row["try"]: row for row in map(json.loads, RESULTS.read_text(encoding="utf-8").splitlines())}
    return list(rows.values())


def page(rows: list[dict[str, Any]], planned: int) -> str:
    """Return the page of results as Markdown.

    Args:
        rows: Tries that were made.
        planned: Number of all tries.
    """
    commits = ", ".join(sorted({row["commit"] for row in rows}))
    lines = [
        "# Attacks\n",
        f"`make attacks` made {len(rows)} of {planned} tries ({commits}). A try survives where nothing finished was",
        "lost, nothing hung, no result changed without saying so, and there was no traceback, no foreign file read or",
        "written, no key sent or kept, and no exit code but 0, 1 and 2.\n",
        "| attack | what is done | tries | survived | lost | hangs | results changed | otherwise failed |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    for attack, what in [*ATTACKS.items(), ("all", "")]:
        own = [row for row in rows if attack in ("all", row["attack"])]
        counts = [sum(bool(row[name]) for row in own) for name in ("survived", "lost", "hang", "changed", "failed")]
        lines.append(f"| {attack} | {what} | {len(own)} | {' | '.join(map(str, counts))} |")
    resumed = sum(bool(row["notes"].get("resumed")) for row in rows)
    lines += [
        "",
        f"A hang is more than {LIMIT_S:.0f} s of processor for a command on a folder or a server, and for a",
        "document or a reply (its workers, which have limits of their own, not counted); for every try",
        f"{WALL_S:.0f} s without an end; for the web app {2 * LIMIT_S:.0f} s until the next page. A command that is",
        f"killed and continued may take as long as its work. {resumed} trainings killed while learning resumed,",
        "and their `training.json` says so: such a policy is another than that of an undisturbed training.\n",
    ]
    lines += _blind(rows)
    failed = [row for row in rows if not row["survived"]]
    lines += ["## What did not survive\n", *(f"- {_problem(row)}" for row in failed)] if failed else []
    replies = [row for row in rows if row["try"].startswith("reply: ")]
    if replies:
        early = sum("refused" in row["notes"] for row in replies)
        lines.append(
            f"Of the documents {len(replies)} are replies of a model; {early} of them ended the design at the\n"
            "Designer's question, so that nothing behind it met them.\n"
        )
    return "\n".join(lines)


def _blind(rows: list[dict[str, Any]]) -> list[str]:
    """Return a paragraph on the tries that could not see a read or damage; empty if all could."""
    unread = sum(row["attack"] == "documents" and row["notes"].get("reads") != "watched" for row in rows)
    uncompared = sum(row["name"].endswith("%") and not row["notes"].get("compared") for row in rows)
    if not unread + uncompared:
        return []
    return [
        f"{unread} tries with documents did not see reads of foreign files, only changes (an earlier program, or a",
        f"file system without times of access). {uncompared} kills compared results, but of other files saw only",
        "whether they were missing, not whether they were damaged (an earlier program).\n",
    ]


def _problem(row: dict[str, Any]) -> str:
    words = [f"{name}: {row[name]}" for name in ("lost", "hang", "changed", "failed") if row[name]]
    return f"{row['try']}: {'; '.join(words)}".replace("\n", " ")


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
