"""What the measuring team's conversations cost, as they were recorded and with prompts as they are built now.

    python -m benchmarks.teams.prompt_size

Replies and results are those of the transcripts; only the prompts are built anew, by the code of a session. So this is
what the same replies cost today, not what a model that reads the shorter prompts would reply. Tokens are those of the
project's own estimate, bytes / 3; replies count as recorded.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from statistics import fmean

from aidsr.core.artifacts import Robot
from aidsr.core.calls import CallRecord, Message, Question, ToolCall
from aidsr.teams.llm.patch import apply_patch
from aidsr.teams.measuring.calls import calls_in_text, prose_of
from aidsr.teams.measuring.records import Exchange, ToolRecord
from aidsr.teams.measuring.session import Session
from aidsr.teams.measuring.toolbox import Toolbox, ToolBudget
from aidsr.teams.providers.tokens import estimate_input_tokens
from aidsr.tools import Workspace
from aidsr.tools.probing import MEAN_PROGRESS

TRANSCRIPTS = Path(__file__).parent / "transcripts" / "measuring-before"
_BUDGET = ToolBudget(calls=80, minutes=60)
_RESULT = re.compile(r"^## \d+\. \w+\n\n(.*?)(?=\n\n## \d+\. \w+\n\n|\Z)", re.MULTILINE | re.DOTALL)
_USED = re.compile(r"\n\[\d+ of \d+ calls, (\d+) of \d+ minutes\]$")
"""A line that results had."""


@dataclass(frozen=True)
class Cost:
    """Tokens of one design."""

    task: str
    calls: int
    recorded: int
    """As they were recorded."""
    replies: int
    prompts: tuple[int, ...]
    """Of each prompt as it is built now."""

    @property
    def now(self) -> int:
        """With prompts as they are built now."""
        return self.replies + sum(self.prompts)


def cost(folder: Path) -> Cost:
    """Return what the calls of a run cost.

    Args:
        folder: Of one run of the measuring team with one design.
    """
    paths = sorted(folder.glob("designs/1/01/calls/*.json"))
    records = [CallRecord.model_validate_json(path.read_bytes()) for path in paths]
    with tempfile.TemporaryDirectory() as made:
        prompts = tuple(_prompts(records, Path(made)))
    return Cost(
        task=folder.name,
        calls=len(records),
        recorded=sum(record.usage.input_tokens + record.usage.output_tokens for record in records),
        replies=sum(record.usage.output_tokens for record in records),
        prompts=prompts,
    )


def questions(records: Sequence[CallRecord], folder: Path) -> list[tuple[Message, ...]]:
    """Return the conversation before each recorded reply, as a session builds it now.

    Args:
        records: Of one session, in order.
        folder: Where its bodies are kept.
    """
    session = Session(_NoModel(), Toolbox(Workspace(folder / "work"), folder, _BUDGET))
    start, exchanges = records[0].question.messages[1].text, list[Exchange]()
    told = [session.told(start, exchanges, native=False)]
    for record, following in pairwise(records):
        answer = following.question.messages[-1]
        calls = calls_in_text(record.reply) if answer.text.startswith("## 1. ") else ()
        if calls:
            results = _results(calls, answer.text, session.toolbox.workspace)
            exchanges.append(Exchange(prose_of(record.reply), calls, results))
            told.append(session.told(start, exchanges, native=False))
        else:
            told.append((*told[-1], Message(role="assistant", text=record.reply), answer))
    return told


class _NoModel:
    name = "none"

    def ask(self, question: Question) -> CallRecord:
        raise NotImplementedError(question.role)


def _prompts(records: Sequence[CallRecord], folder: Path) -> list[int]:
    return [
        estimate_input_tokens(Question(role="designer", messages=messages)) for messages in questions(records, folder)
    ]


def _results(calls: Sequence[ToolCall], text: str, workspace: Workspace) -> tuple[ToolRecord, ...]:
    """Return what calls brought, as it stands in the recorded message; keep the bodies that they made."""
    results = []
    for call, told in zip(calls, _RESULT.findall(text), strict=True):
        found = _USED.sub("", told)
        outcome = "failed" if found.startswith("failed: ") else "done"
        outcome = "refused" if found.startswith("not carried out: ") else outcome
        one = ToolRecord(
            name=call.name, arguments=call.arguments, text=found, outcome=outcome, seconds=0.0, figures=_figures(found)
        )
        if one.made.startswith("robot_") and not (workspace.folder / one.made).is_dir():
            mjcf = one.values.get("mjcf")
            kept = workspace.add_robot(Robot(mjcf=mjcf or _changed(workspace, one), functional_part=""))
            if kept != one.made:
                raise ValueError(f"{kept} is {one.made} in the transcript")
        results.append(one)
    return tuple(results)


def _changed(workspace: Workspace, one: ToolRecord) -> str:
    """Return the MJCF of a robot that was edited; one that code fixed is told as it was."""
    before, patch = workspace.robot(one.values["robot"]).mjcf, str(one.values.get("patch", ""))
    if not patch:
        return before
    return apply_patch(before, patch if "<patch" in patch else f"<patch>{patch}</patch>")


def _figures(text: str) -> dict[str, float]:
    """Return how far a scene came, as it stands in a result."""
    if found := re.search(rf"^{MEAN_PROGRESS} ([\d.]+)", text) or re.search(r"^progress: best ([\d.]+)", text, re.M):
        return {MEAN_PROGRESS: float(found[1])}
    rows = re.findall(r"^\d+ \| ([\d.]+) \|", text, re.MULTILINE) if text.startswith("variation | ") else []
    return {"progress": fmean(map(float, rows))} if rows else {}


def table(costs: Sequence[Cost]) -> str:
    """Return the table of all designs."""
    lines = ["| task | calls | tokens recorded | tokens now | of these replies | first prompt now | last prompt now |"]
    lines.append("|---|---|---|---|---|---|---|")
    lines += [
        f"| {one.task} | {one.calls} | {one.recorded:,} | {one.now:,} | {one.replies:,} | {one.prompts[0]:,} "
        f"| {one.prompts[-1]:,} |"
        for one in costs
    ]
    means = [fmean(values) for values in zip(*((c.calls, c.recorded, c.now, c.replies) for c in costs), strict=True)]
    lines.append(f"| mean | {means[0]:.1f} | {means[1]:,.0f} | {means[2]:,.0f} | {means[3]:,.0f} | | |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(table([cost(folder) for folder in sorted(TRANSCRIPTS.iterdir())]))
