"""All rules, those of this package and those of other packages, in the order in which they are applied.

A package adds rules through the entry-point group "aidsr.rules": the name of an entry is the code, its value the
`Rule`.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cache
from graphlib import CycleError, TopologicalSorter
from importlib import import_module

from aidsr.core.artifacts import Fault
from aidsr.core.errors import UserError
from aidsr.core.plugins import Plugin, PluginGroup
from aidsr.core.suggestions import closest_name
from aidsr.validation import rules
from aidsr.validation.rule import Rule, Stage


@cache
def builtin_rules() -> tuple[Rule, ...]:
    """Return the rules of `aidsr.validation.rules`, in the order of application."""
    modules = (import_module(f"{rules.__name__}.{found.name}") for found in pkgutil.iter_modules(rules.__path__))
    found = [value for module in modules for value in vars(module).values() if isinstance(value, Rule)]
    return _ordered([*dict.fromkeys(found)])


PLUGINS = PluginGroup[Rule](
    group="aidsr.rules",
    noun="rule",
    kind=Rule,
    name_attribute="code",
    builtin=lambda: {rule.code for rule in builtin_rules()},
)


@cache
def all_rules() -> tuple[Rule, ...]:
    """Return all rules in the order of application: by stage, and within a stage causes before consequences.

    Raises:
        UserError: A rule of another package cannot be loaded or has a code that is in use, or rules explain each other
            in a cycle.
    """
    added = [plugin.value for plugin in _added_rules()]
    return _ordered([*builtin_rules(), *added]) if added else builtin_rules()


@cache
def packages_with_rules() -> dict[str, str]:
    """Return the version of each package that adds rules, by name of the package."""
    return {plugin.package: plugin.version for plugin in _added_rules()}


def find_rule(code: str) -> Rule | None:
    """Return the rule with a code, or None if no rule has it."""
    return _by_code().get(code)


def require_rule(code: str) -> Rule:
    """Return the rule with a code.

    Raises:
        UserError: No rule has this code.
    """
    rule = find_rule(code)
    if rule is None:
        near = closest_name(code, _by_code())
        hint = f"did you mean {near}?" if near else "aidsr rules lists all codes"
        raise UserError(f"no such rule: {code}; {hint}")
    return rule


def select_rules(select: Collection[str] = (), ignore: Collection[str] = ()) -> tuple[Rule, ...]:
    """Return the rules to apply, in order.

    Args:
        select: Codes of the only rules to apply; none for all.
        ignore: Codes of rules not to apply.

    Raises:
        UserError: A code does not exist, or a code to ignore is that of a fault of the document, which cannot be tested
            until that fault is cured.
    """
    for code in (*select, *ignore):
        require_rule(code)
    for code in ignore:
        if require_rule(code).stage is Stage.DOCUMENT:
            raise UserError(f"{code} cannot be ignored: a document that does not load cannot be tested")
    return tuple(
        rule
        for rule in all_rules()
        if rule.stage is Stage.DOCUMENT or ((not select or rule.code in select) and rule.code not in ignore)
    )


def is_explained(code: str, faults: Iterable[Fault]) -> bool:
    """Return whether an error already found explains a fault, so that the fault needs no check of its own.

    Args:
        code: Code of the fault.
        faults: Faults found so far; warnings explain nothing.
    """
    return any(code in _consequences().get(fault.code, ()) for fault in faults if fault.severity == "error")


def without_consequences(faults: Sequence[Fault], refuted: Collection[tuple[str, str]] = ()) -> tuple[Fault, ...]:
    """Return the faults that no error explains, in the order given; a warning explains nothing.

    Args:
        faults: Faults that the rules found.
        refuted: Explanations that a counterfactual simulation refuted, as (code of the cause, code of the consequence).
    """
    explained = {
        consequence
        for fault in faults
        if fault.severity == "error"
        for consequence in _consequences().get(fault.code, ())
        if (fault.code, consequence) not in refuted
    }
    return tuple(fault for fault in faults if fault.code not in explained)


@cache
def _by_code() -> dict[str, Rule]:
    return {rule.code: rule for rule in all_rules()}


@cache
def _consequences() -> dict[str, frozenset[str]]:
    """Return the codes that each code explains."""
    return {
        rule.code: frozenset(rule.explains) | {other.code for other in all_rules() if rule.code in other.explained_by}
        for rule in all_rules()
    }


@cache
def _added_rules() -> tuple[Plugin[Rule], ...]:
    return tuple(PLUGINS.load_all())


def _ordered(found: Sequence[Rule]) -> tuple[Rule, ...]:
    """Sort rules by stage and, within a stage, causes before consequences, otherwise in the order given.

    Raises:
        UserError: Rules explain each other in a cycle.
    """
    causes = {rule.code: set(rule.explained_by) for rule in found}
    for rule in found:
        for consequence in rule.explains:
            causes.setdefault(consequence, set()).add(rule.code)
    try:
        TopologicalSorter(causes).prepare()
    except CycleError as error:
        raise UserError(f"rules explain each other: {', '.join(error.args[1][:-1])}") from error
    ordered: list[Rule] = []
    for stage in Stage:
        waiting = [rule for rule in found if rule.stage is stage]
        while waiting:
            ready = next(group for group in _by_check(waiting) if not _wait(group, waiting, causes))
            ordered += ready
            waiting = [rule for rule in waiting if rule not in ready]
    return tuple(ordered)


def _by_check(rules: Sequence[Rule]) -> list[list[Rule]]:
    """Return groups of rules that share a check and are therefore applied together."""
    groups: dict[object, list[Rule]] = {}
    for rule in rules:
        groups.setdefault(rule.check or rule, []).append(rule)
    return list(groups.values())


def _wait(group: Sequence[Rule], waiting: Sequence[Rule], causes: Mapping[str, set[str]]) -> bool:
    """Return whether a cause of a group of rules has not been applied yet."""
    others = {rule.code for rule in waiting} - {rule.code for rule in group}
    return any(causes[rule.code] & others for rule in group)
