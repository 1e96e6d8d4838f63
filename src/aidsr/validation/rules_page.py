"""The documentation of the rules, made from their records: docs/rules.md.

aidsr rules --page > docs/rules.md
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path

from aidsr.validation.rule import Example, Rule

EXAMPLE_ARM = (Path(__file__).parent / "examples" / "arm.xml").read_text(encoding="utf-8")
"""MJCF of a robot without a fault, of which every example changes something."""

_HEAD = """# Rules

What `aidsr validate` looks for, one section for each fault. `aidsr validate --select CODE,… --ignore CODE,…` chooses
rules by code; `aidsr rules CODE` prints a section. [Validation](validation.md) says how a robot is tested,
[Add a rule](add_a_rule.md) how your own package adds one. This page is made from the records in
`aidsr/validation/rules/` by `aidsr rules --page > docs/rules.md`; a test compares the two and runs every example.
"""
_TAIL = f"""## The example arm

Has no fault. "Fails" and "passes" above are what differs from it.

```xml
{EXAMPLE_ARM.rstrip()}
```
"""


def rules_page(rules: Iterable[Rule]) -> str:
    """Return the page of all rules as Markdown."""
    rules = list(rules)
    return "\n".join([_HEAD, *_index(rules), "", *map(rule_section, rules), _TAIL])


def _index(rules: Iterable[Rule]) -> Iterator[str]:
    """A table of the codes, by stage."""
    yield "| | |\n|---|---|"
    for title, group in groupby(rules, key=lambda rule: rule.stage.title):
        yield f"| {title} | {', '.join(_link(rule.code) for rule in group)} |"


def rule_section(rule: Rule) -> str:
    """Return the section on one rule as Markdown."""
    severity = "" if rule.severity == "error" else ", a warning"
    parts = [f"## {rule.code}\n\n{rule.stage.title}{severity}.", f"**{rule.finds}** {rule.why}"]
    parts.append(f"*Limit:* {rule.limit}.")
    if rule.cure:
        parts.append(f"*Cure:* {rule.cure}")
    if rule.blame == "integrator":
        parts.append("*In a scene* whose robot is stable alone, the Scene Integrator repairs it, not the Coder.")
    if rule.explains:
        parts.append(f"*Explains*, as an error: {', '.join(map(_link, rule.explains))}.")
    if rule.example is not None:
        parts += _example(rule.example)
    return "\n\n".join(parts) + "\n"


def _example(example: Example) -> Iterator[str]:
    given = ", ".join(f"`{name}={value}`" for name, value in example.arguments.items())
    failing, passing = ([pair[side] for pair in example.changes] for side in (1, 0))
    yield f"Fails{f' with {given}' if given else ''}:\n\n{_xml(failing)}"
    yield f"Passes:\n\n{_xml(passing)}"


def _xml(snippets: Iterable[str]) -> str:
    """Snippets of MJCF as a block, without the indentation they share."""
    lines = [line for snippet in snippets for line in (_dedented(snippet) or "<!-- nothing -->").splitlines()]
    return "```xml\n" + "\n".join(lines) + "\n```"


def _dedented(snippet: str) -> str:
    lines = [line for line in snippet.splitlines() if line.strip()]
    shared = min((len(line) - len(line.lstrip()) for line in lines[1:]), default=0)
    own = min((len(line) - len(line.lstrip()) for line in lines), default=0)
    first = [line.strip() for line in lines[:1]]
    return "\n".join([*first, *(line[min(shared, own or shared) :] for line in lines[1:])])


def _link(code: str) -> str:
    return f"[`{code}`](#{code})"
