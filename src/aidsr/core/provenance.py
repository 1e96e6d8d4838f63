"""Provenance of a result: commit of the source code, package versions, processor."""

from __future__ import annotations

import contextlib
import platform
import subprocess
from collections.abc import Iterable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_CHECKOUT = Path(__file__).parents[3]
_CPU_INFO = Path("/proc/cpuinfo")


@cache
def commit(checkout: Path = _CHECKOUT) -> str:
    """Return the git commit, with "-dirty" if files under `src` differ from it; without git, the package version.

    Only `src` is compared, so that results that a benchmark writes into the checkout do not count as changes.

    Args:
        checkout: Root of the source checkout; it may be another folder if AID-SR was installed as a package.
    """

    def git(*words: str) -> str:
        command = ["git", "--no-optional-locks", "-C", str(checkout), *words]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=30).stdout.strip()

    if (checkout / ".git").exists():
        with contextlib.suppress(OSError, subprocess.SubprocessError):
            changed = git("status", "--porcelain", "--", "src")
            return git("describe", "--always", "--abbrev=12") + ("-dirty" if changed else "")
    return version("aidsr")


@cache
def processor() -> str:
    """Return the model name of the processor."""
    with contextlib.suppress(OSError):
        for line in _CPU_INFO.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def versions_of(packages: Iterable[str]) -> dict[str, str]:
    """Return the versions of Python and of packages; packages that are not installed are left out."""
    found = {"python": platform.python_version()}
    for package in packages:
        with contextlib.suppress(PackageNotFoundError):
            found[package] = version(package)
    return found
