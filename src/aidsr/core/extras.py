"""Optional libraries (extras of the installation), and the message if they are missing."""

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
"""Modules that AID-SR imports from each extra; pyproject.toml lists the packages that provide them."""


_SOURCE = Path(__file__).parents[3]
"""Root of the source checkout, if AID-SR was installed with `pip install -e`."""


def installing(extra: str, source: Path = _SOURCE) -> str:
    """Return how to install an extra for this Python: the complete command if AID-SR runs from a checkout.

    Otherwise the source of the installation is unknown, and the text has no complete command: AID-SR is on no package
    index, so a command with only its name would find nothing, or another package.
    """
    pip = f'"{sys.executable}" -m pip'
    if (source / "pyproject.toml").exists() and (source / "constraints.txt").exists():
        return f'{pip} install -c "{source / "constraints.txt"}" -e "{source}[{extra}]"'
    return f"install AID-SR again with [{extra}], from where you got it, by {pip}"


def missing_extra(extra: str, what: str) -> str:
    """Return a sentence with the missing module and how to install it; empty if nothing is missing.

    Args:
        extra: Name of the extra.
        what: Feature that needs the extra, as the subject of the sentence.
    """
    for module in EXTRAS[extra]:
        if find_spec(module) is None:
            return f'{what} needs the extra "{extra}", and module {module} is not installed: {installing(extra)}'
    return ""


def require_extra(extra: str, what: str) -> None:
    """Raise UserError if a module of an extra is not installed; the arguments are as in `missing_extra`."""
    lack = missing_extra(extra, what)
    if lack:
        raise UserError(lack)
