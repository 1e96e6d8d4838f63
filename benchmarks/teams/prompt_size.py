"""Count the tokens of the measuring team's conversations, as recorded and with prompts as they are built today.

    python -m benchmarks.teams.prompt_size

Replies and results are taken from the transcripts; only the prompts are built again, by the code of a session. The
figures show what the same replies would cost today. A model that reads the shorter prompts might reply differently.
Tokens are the project's own estimate, bytes / 3; replies count as recorded.
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
"""Last line of recorded results, which states the spent budget; today's results do not have it."""


@dataclass(frozen=True)
class Cost:
    """Tokens of one design's conversation."""

    task: str
    calls: int
    recorded: int
    """Tokens of prompts and replies as recorded."""
    replies: int
    prompts: tuple[int, ...]
    """Tokens of each prompt as it is built today."""

    @property
    def now(self) -> int:
        """Tokens of replies as recorded and of prompts as they are built today."""
        return self.replies + sum(self.prompts)


def cost(folder: Path) -> Cost:
    """Return the tokens of a run's calls.

    Args:
        folder: Folder of a run of the measuring team with one design.
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
    """Return the conversation before each recorded reply, as a session builds it today.

    Args:
        records: Recorded calls of one session, in order.
        folder: Folder for the session's bodies.
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
    """Return the results of tool calls from the recorded message, and add the bodies that they made to the workspace.

    Raises:
        ValueError: A body gets another name in the workspace than in the transcript.
    """
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
    """Return the MJCF of an edited robot. For one that was fixed by code, return the MJCF before the fix."""
    before, patch = workspace.robot(one.values["robot"]).mjcf, str(one.values.get("patch", ""))
    if not patch:
        return before
    return apply_patch(before, patch if "<patch" in patch else f"<patch>{patch}</patch>")


def _figures(text: str) -> dict[str, float]:
    """Return the progress of a scene that a result's text states; empty if it states none."""
    if found := re.search(rf"^{MEAN_PROGRESS} ([\d.]+)", text) or re.search(r"^progress: best ([\d.]+)", text, re.M):
        return {MEAN_PROGRESS: float(found[1])}
    rows = re.findall(r"^\d+ \| ([\d.]+) \|", text, re.MULTILINE) if text.startswith("variation | ") else []
    return {"progress": fmean(map(float, rows))} if rows else {}


def table(costs: Sequence[Cost]) -> str:
    """Return the table of all designs as Markdown."""
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
