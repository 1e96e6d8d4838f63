"""The documentation of the rules, docs/rules.md, generated from their records.

aidsr rules --page > docs/rules.md
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from difflib import SequenceMatcher
from itertools import groupby
from pathlib import Path
from textwrap import dedent

from aidsr.fixes import FIXES
from aidsr.validation.rule import Example, Rule

EXAMPLE_ARM = (Path(__file__).parent / "examples" / "arm.xml").read_text(encoding="utf-8")
"""MJCF of the example arm, a robot without a fault; the example of every rule changes something in it."""

_MAX_PLACES = 3
_GAP = "\n<!-- … -->\n"
_HEAD = """# Rules

What `aidsr validate` looks for, one section for each fault. `aidsr validate --select CODE,… --ignore CODE,…` chooses
rules by code; `aidsr rules CODE` prints a section. [Validation](validation.md) says how a robot is tested,
[Add a rule](add_a_rule.md) how your own package adds one. This page is made from the records in
`aidsr/validation/rules/` by `aidsr rules --page > docs/rules.md`; a test compares the two and runs every example.
"""
_TAIL = f"""## The example arm

Has no fault. Above, "fails" and "passes" are the lines in which a robot with the fault and this one differ.

```xml
{EXAMPLE_ARM.rstrip()}
```
"""


def rules_page(rules: Iterable[Rule]) -> str:
    """Return the page of all rules as Markdown."""
    rules = list(rules)
    return "\n".join([_HEAD, *_index(rules), "", *map(rule_section, rules), _TAIL])


def _index(rules: Iterable[Rule]) -> Iterator[str]:
    """Yield the lines of a table of the codes, grouped by stage."""
    yield "| | |\n|---|---|"
    for title, group in groupby(rules, key=lambda rule: rule.stage.title):
        yield f"| {title} | {', '.join(_link(rule.code) for rule in group)} |"


def rule_section(rule: Rule) -> str:
    """Return the section on one rule as Markdown."""
    severity = "" if rule.severity == "error" else ", a warning"
    parts = [f"## {rule.code}\n\n{rule.stage.title}{severity}.", f"**{_with_code(rule.finds)}** {_with_code(rule.why)}"]
    parts.append(f"*Limit:* {_with_code(rule.limit)}.")
    if rule.cure:
        parts.append(f"*Cure:* {_with_code(rule.cure)}")
    if fixes := [f"`{fix.name}`{' (safe)' if fix.safe else ''}" for fix in FIXES if rule.code in fix.cures]:
        parts.append(f"*[Fixed by code](validation.md#automatic-fixes):* {', '.join(fixes)}.")
    if rule.blame == "integrator":
        parts.append("*In a scene* whose robot is stable alone, the Scene Integrator repairs it, not the Coder.")
    if rule.explains:
        parts.append(f"*Explains*, as an error: {', '.join(map(_link, rule.explains))}.")
    if rule.example is not None:
        parts += _example(rule.example)
    return "\n\n".join(parts) + "\n"


def _example(example: Example) -> Iterator[str]:
    given = ", ".join(f"`{name}={value}`" for name, value in example.arguments.items())
    fails, passes = _differing_lines(example.fails(EXAMPLE_ARM))
    yield f"Fails{f' with {given}' if given else ''}:\n\n{fails}"
    yield f"Passes:\n\n{passes}"


def _differing_lines(failing: str) -> tuple[str, str]:
    """Return the lines in which a robot and the example arm differ, as two Markdown blocks: the robot's, the arm's.

    Only the first `_MAX_PLACES` differences are shown.
    """
    ours, theirs = ([line for line in text.splitlines() if line.strip()] for text in (failing, EXAMPLE_ARM))
    places = [each for each in SequenceMatcher(None, ours, theirs, autojunk=False).get_opcodes() if each[0] != "equal"]
    blocks: tuple[list[str], list[str]] = ([], [])
    for tag, *ends in places[:_MAX_PLACES]:
        around = 1 if tag in ("insert", "delete") else 0  # context lines around inserted or deleted lines
        for block, lines, first, last in zip(blocks, (ours, theirs), ends[::2], ends[1::2], strict=True):
            block.append(dedent("\n".join(lines[max(0, first - around) : last + around])))
    end = [""] if len(places) > _MAX_PLACES else []
    fails, passes = (f"```xml\n{_GAP.join([*block, *end]).rstrip()}\n```" for block in blocks)
    return fails, passes


def _with_code(text: str) -> str:
    """Return the text with MJCF elements marked as code, because Markdown would treat them as HTML."""
    return re.sub(r"((?:<[a-z][^<>]*>)+)", r"`\1`", text)


def _link(code: str) -> str:
    return f"[`{code}`](#{code})"
