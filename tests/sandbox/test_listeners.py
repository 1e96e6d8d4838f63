"""A function in a child process tells its caller how far it is, and saves its work when it is interrupted."""

from __future__ import annotations

import sys
from pathlib import Path

import misbehaving
import pytest
from misbehaving import Parcel

from aidsr.core.errors import IsolationError


def test_progress_is_heard_while_the_function_runs(tmp_path: Path) -> None:
    """The limit of time holds from one word to the next: all of them together take longer than it."""
    heard: list[tuple[int, Parcel]] = []
    assert misbehaving.count_to(3, tmp_path, lambda *told: heard.append(told)) == "up to 3"
    assert heard == [(1, Parcel("1")), (2, Parcel("2")), (3, Parcel("3"))]


def test_silence_beyond_the_limit_ends_the_function(tmp_path: Path) -> None:
    heard: list[int] = []
    with pytest.raises(IsolationError, match="stopped after 8 s"):
        misbehaving.count_to(5, tmp_path, lambda number, _: heard.append(number))
    assert heard == [1, 2, 3, 4, 5]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signal")
def test_an_interrupted_function_saves_its_work(tmp_path: Path) -> None:
    def impatient(number: int, _parcel: Parcel) -> None:
        if number == 17:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        misbehaving.count_to(1000, tmp_path, impatient)
    assert (tmp_path / "kept").read_text() == "17"


def test_a_listener_that_fails_ends_the_function(tmp_path: Path) -> None:
    def failing(_number: int, _parcel: Parcel) -> None:
        raise LookupError("on purpose")

    with pytest.raises(LookupError, match="on purpose"):
        misbehaving.count_to(1000, tmp_path, failing)
    assert misbehaving.echo() == (Parcel(), b"")
