"""Libraries that come with an extra of the installation, and the message where they are missing."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

from aidsr.core.errors import UserError

EXTRAS: dict[str, tuple[str, ...]] = {
    "rl": ("gymnasium", "stable_baselines3", "torch"),
    "web": ("nicegui",),
    "ray": ("ray",),
    "mcp": ("mcp",),
    "search": ("cma",),
    "fabrication": ("manifold3d",),
    "cad": ("OCP",),
}
"""Modules that our code imports from each extra; pyproject.toml lists the packages that bring them."""


_SOURCE = Path(__file__).parents[3]
"""The checkout that AID-SR runs from, where it was installed with `pip install -e`."""


def installing(extra: str, source: Path = _SOURCE) -> str:
    """Return how this Python gets an extra: the command, where AID-SR runs from a checkout.

    Otherwise where it came from is unknown: it is on no index, so a command that names it alone would find nothing, or
    somebody else's package.
    """
    pip = f'"{sys.executable}" -m pip'
    if (source / "pyproject.toml").exists() and (source / "constraints.txt").exists():
        return f'{pip} install -c "{source / "constraints.txt"}" -e "{source}[{extra}]"'
    return f"install AID-SR again with [{extra}], from where you got it, by {pip}"


def missing_extra(extra: str, what: str) -> str:
    """Return what is missing and how to install it as a sentence; empty where nothing is missing.

    Args:
        extra: Name of the extra.
        what: What needs it, as the subject of the sentence.
    """
    for module in EXTRAS[extra]:
        if find_spec(module) is None:
            return f'{what} needs the extra "{extra}", and module {module} is not installed: {installing(extra)}'
    return ""


def require_extra(extra: str, what: str) -> None:
    """Raise UserError where a module of an extra is not installed; the arguments are those of `missing_extra`."""
    lack = missing_extra(extra, what)
    if lack:
        raise UserError(lack)
