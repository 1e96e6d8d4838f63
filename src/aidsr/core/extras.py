"""Libraries that come with an extra of the installation, and the message where they are missing."""

from __future__ import annotations

from importlib.util import find_spec

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


def missing_extra(extra: str, what: str) -> str:
    """Return what is missing and how to install it as a sentence; empty where nothing is missing.

    Args:
        extra: Name of the extra.
        what: What needs it, as the subject of the sentence.
    """
    for module in EXTRAS[extra]:
        if find_spec(module) is None:
            return (
                f'{what} needs the extra "{extra}", and module {module} is not installed: pip install "aidsr[{extra}]"'
            )
    return ""


def require_extra(extra: str, what: str) -> None:
    """Raise UserError where a module of an extra is not installed; the arguments are those of `missing_extra`."""
    lack = missing_extra(extra, what)
    if lack:
        raise UserError(lack)
