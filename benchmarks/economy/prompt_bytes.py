"""How many bytes a Coder's repair sends to a model: as a patch of a shortened view, and with the whole file.

The robots are those of the built-in team, made worse in a way that is common in robots of language models (joints too
soft and undamped), so that the validator reports its usual faults. No model is called: the program counts the bytes
that would be sent.

    python benchmarks/economy/prompt_bytes.py
"""

from __future__ import annotations

import contextlib
import platform
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from statistics import median

from aidsr.core.calls import CallRecord, Question, Usage
from aidsr.core.errors import ReplyError
from aidsr.tasks import load_task
from aidsr.teams import llm as agents
from aidsr.teams import rules as builtin
from aidsr.validation import validate

HERE = Path(__file__).parent
TASKS = ("button_pushing", "simple_grasping", "flat_ground", "drawer_opening")


@dataclass
class Counter:
    """Model that counts the bytes it is sent and gives a useless answer."""

    name: str = "counter"
    sent: int = 0

    def ask(self, question: Question) -> CallRecord:
        """Count a question's bytes."""
        self.sent = sum(len(message.text.encode()) for message in question.messages)
        usage = Usage(calls=1)
        return CallRecord(question=question, model=self.name, reply="-", finish="stop", usage=usage, started="")


def sent_for_repair(task: str, number: int) -> tuple[str, int, int, int]:
    """Return the family, the bytes of the robot's MJCF, and the bytes that its repair sends: whole file, and patch."""
    brief = load_task(task).brief()
    rules = builtin.team(seed=1)
    concept = rules.designer.propose(brief, 3)[number]
    robot = rules.coder.write(brief, concept)
    worse = re.sub(r'(stiffness|damping)="([^"]+)"', lambda m: f'{m[1]}="{float(m[2]) / 30:.4g}"', robot.mjcf)
    robot = robot.model_copy(update={"mjcf": worse})
    report = validate(robot.mjcf, needs_contact=brief.needs_contact, environment=brief.environment)
    sent = []
    for edits in (False, True):
        counter = Counter()
        with contextlib.suppress(ReplyError):  # the counter gives no usable answer
            agents.team(counter, reasks=0, edits=edits).coder.repair(brief, concept, robot, report)
        sent.append(counter.sent)
    return concept.family, len(worse.encode()), *sent


def main() -> None:
    """Count the bytes and write results.md."""
    lines, ratios = [], []
    for task in TASKS:
        for number in range(3):
            family, size, whole, patched = sent_for_repair(task, number)
            ratios.append(patched / whole)
            lines.append(f"| {task} | {family} | {size:,} | {whole:,} | {patched:,} | {patched / whole:.0%} |")
    table = "\n".join(lines)
    text = f"""# Bytes of one Coder repair

`python benchmarks/economy/prompt_bytes.py`: robots of the built-in team with joints 30 times too soft and too little
damped, their faults as the validator reports them, and all that would be sent for one repair.
aidsr {version("aidsr")}, Python {platform.python_version()}, {datetime.now(UTC):%Y-%m-%d}.

| task | family | MJCF | whole file | patch | ratio |
|---|---|---:|---:|---:|---:|
{table}

Median ratio {median(ratios):.0%}, largest {max(ratios):.0%}. The reply shrinks as well: a patch is a few lines, a whole
file is as long as the MJCF column says.
"""
    (HERE / "results.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
