"""Text of strangers that is made to take long is read, or refused, at once."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import hostile_text

_LIMIT_S = 100.0
"""For all texts, on a busy machine; each of them took minutes before it was read in a time proportional to it."""


def test_no_text_takes_long() -> None:
    try:
        done = subprocess.run(
            [sys.executable, str(Path(hostile_text.__file__))], capture_output=True, text=True, timeout=_LIMIT_S
        )
    except subprocess.TimeoutExpired as late:
        read = (late.stdout or b"").decode().splitlines()
        raise AssertionError(f"took too long: {read[-1] if read else 'starting'}") from None
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == len(hostile_text.CASES)
