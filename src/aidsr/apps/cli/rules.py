"""`aidsr rules`."""

from __future__ import annotations

from aidsr.apps.cli.flag import Flag


def rules(*codes: str, page: Flag = False) -> int:
    """List the rules of the validator, or describe rules in full.

    A description has the reason, the limit, the cure, and MJCF that fails and that passes. In a file or pipe it is
    Markdown.

        aidsr rules

        aidsr rules chatter

    Parameters
    ----------
    codes
        Fault codes, as in a report of `aidsr validate`; without one, all rules are listed.
    page
        Print the complete reference of the built-in rules as Markdown.
    """
    import re
    import sys

    from rich.markdown import Markdown
    from rich.table import Table

    from aidsr.apps.cli.terminal import make_console, write_document
    from aidsr.validation.registry import all_rules, builtin_rules, require_rule
    from aidsr.validation.rules_page import rule_section, rules_page

    if page:
        write_document(rules_page(builtin_rules()))
    elif codes:
        text = "\n".join(rule_section(require_rule(code)) for code in codes)
        if sys.stdout.isatty():
            make_console().print(Markdown(re.sub(r"\[([^]]+)\]\([^)]*\)", r"\1", text)))  # links do not work here
        else:
            write_document(text)
    else:
        table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), header_style="dim")
        for title in ("code", "stage", "finds"):
            table.add_column(title, overflow="fold", vertical="top")
        for rule in all_rules():
            table.add_row(f"[bold]{rule.code}[/]", rule.stage.title, rule.finds)
        make_console().print(table)
    return 0
