"""`aidsr doctor`."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

from aidsr.apps.cli.flag import Flag

_PACKAGES = ("aidsr", "mujoco", "numpy", "pydantic", "lxml", "pydantic-ai-slim", "av")


@dataclass(frozen=True)
class Check:
    """Result of one check of the installation; one line of the output."""

    topic: str
    result: Literal["ok", "absent", "problem"]
    """"absent": an optional part is missing, which is only reported. "problem": AID-SR does not work here."""
    text: str


def doctor(*, test_isolation: Flag = False) -> int:
    """Check this installation: versions, graphics, isolation, plug-ins, API keys.

    Prints which API keys are set, never their values. Exit code 0: AID-SR works here. 1: there is a problem.

        aidsr doctor

        aidsr doctor --test-isolation

    Parameters
    ----------
    test_isolation
        Also crash, stall and overfill child processes on purpose, to check that their limits work on this machine.
    """
    from rich.markup import escape
    from rich.table import Table

    from aidsr.apps.cli.terminal import make_console

    table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), show_header=False)
    marks = {"ok": "[green]ok[/]", "absent": "[yellow]–[/]", "problem": "[bold red]problem[/]"}
    found = checks(test_isolation=test_isolation)
    for check in found:
        table.add_row(marks[check.result], f"[bold]{check.topic}[/]", escape(check.text))
    make_console().print(table)
    return 1 if any(check.result == "problem" for check in found) else 0


def checks(*, test_isolation: bool = False) -> tuple[Check, ...]:
    """Run all checks and return their results."""
    tested = (_tested_isolation(),) if test_isolation else ()
    return (*_versions(), _extras(), *_machine(), *_isolation(), *tested, *_plugins(), *_keys())


def _versions() -> tuple[Check, ...]:
    enough = sys.version_info >= (3, 11)
    found = {package: _version(package) for package in _PACKAGES}
    missing = [package for package, number in found.items() if number is None]
    text = ", ".join(f"{package} {number}" for package, number in found.items() if number)
    return (
        Check(
            "Python", "ok" if enough else "problem", f"{platform.python_version()} on {platform.platform(terse=True)}"
        ),
        Check(
            "packages", "problem" if missing else "ok", text + (f"; missing: {', '.join(missing)}" if missing else "")
        ),
    )


def _extras() -> Check:
    from aidsr.core.extras import EXTRAS, installing, missing_extra

    present = [extra for extra in EXTRAS if not missing_extra(extra, "")]
    text = ", ".join(present) if present else f"none; for training: {installing('rl')}"
    return Check("extras", "ok" if present else "absent", text)


def _machine() -> tuple[Check, ...]:
    from aidsr.core.formatting import counted
    from aidsr.render.pictures import gl_status

    threads = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    try:
        with tempfile.TemporaryFile(dir=Path.cwd()):
            writable = Check("files", "ok", f"runs can be written under {Path.cwd()}")
    except OSError as error:
        writable = Check("files", "problem", f"{Path.cwd()} is not writable ({error.strerror}); use --runs")
    return (
        Check("processor", "ok", f"{counted(threads, 'thread')} for simulation"),
        Check("graphics", "ok", gl_status()),
        writable,
    )


def _isolation() -> tuple[Check, ...]:
    from aidsr.sandbox.guarantees import guarantees

    all_of_them = guarantees()
    held = ", ".join(guarantee.name for guarantee in all_of_them if guarantee.holds)
    missing = ", ".join(guarantee.name for guarantee in all_of_them if not guarantee.holds)
    found = (Check("isolation", "ok", f"models are loaded in child processes: {held}"),)
    return (*found, Check("isolation", "absent", f"not available on this platform: {missing}")) if missing else found


def _tested_isolation() -> Check:
    from aidsr.sandbox.guarantees import guarantees, try_guarantees

    promised = {guarantee.name: guarantee.holds for guarantee in guarantees()}
    tried = try_guarantees()
    broken = [f"{guarantee.name} ({guarantee.how})" for guarantee in tried if not guarantee.holds]
    if any(promised[guarantee.name] and not guarantee.holds for guarantee in tried):
        return Check("isolation", "problem", f"test failed: {', '.join(broken)}")
    return Check("isolation", "ok", f"test passed: {', '.join(each.name for each in tried if each.holds)}")


def _plugins() -> tuple[Check, ...]:
    """Return a check that lists the plug-ins of other packages, and one for each entry point that cannot be loaded."""
    from aidsr.core.errors import UserError
    from aidsr.core.plugins import PluginGroup
    from aidsr.tasks import PLUGINS as TASKS
    from aidsr.teams.providers.registry import PLUGINS as PROVIDERS
    from aidsr.teams.rules.families import PLUGINS as FAMILIES
    from aidsr.validation.registry import PLUGINS as RULES

    groups: tuple[PluginGroup[Any], ...] = (TASKS, RULES, FAMILIES, PROVIDERS)
    loaded, broken = [], []
    for group in groups:
        for entry in group.entries():
            try:
                loaded.append(f"{group.noun} {entry.name} from {group.load(entry).package}")
            except UserError as error:
                broken.append(Check("plug-ins", "problem", str(error)))
    return (Check("plug-ins", "ok", ", ".join(loaded)), *broken) if loaded else tuple(broken)


def _keys() -> tuple[Check, ...]:
    from aidsr.core.errors import UserError
    from aidsr.teams.providers.registry import BUILT_IN, providers

    try:
        known = providers()
    except UserError:  # reported with the plug-ins
        known = BUILT_IN
    variables = dict.fromkeys(variable for provider in known for variable in provider.key_variables)
    present = [variable for variable in variables if os.environ.get(variable, "").strip()]
    if present:
        return (Check("keys", "ok", f"set: {', '.join(present)}; used only when you name a model of that provider"),)
    return (Check("keys", "absent", "none set; --model builtin needs none"),)


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
