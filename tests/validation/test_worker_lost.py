"""A worker that is ended from outside, as where memory runs out, never becomes a fault of a robot."""

from __future__ import annotations

from typing import Any

import pytest

from aidsr.core.errors import WorkerLostError
from aidsr.sandbox import isolated, pool
from aidsr.validation import validate

ARM = """
<mujoco>
  <worldbody><body name="a"><joint name="j"/><geom name="g" size="0.01" mass="0.1"/></body></worldbody>
</mujoco>"""


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolated, "_PAUSES_S", (0.0, 0.0, 0.0))


def lose(monkeypatch: pytest.MonkeyPatch, times: int) -> list[int]:
    """Lose the next workers, so many of them; return the list that counts the tries."""
    tries: list[int] = []

    def call(request: dict[str, Any], *rest: Any) -> dict[str, Any]:
        tries.append(len(tries))
        if len(tries) <= times:
            return {"lost": "it was ended by SIGKILL"}
        return pool.call_in_worker(request, *rest)

    monkeypatch.setattr(isolated, "call_in_worker", call)
    return tries


def test_a_verdict_is_the_same_after_lost_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    undisturbed = validate(ARM)
    tries = lose(monkeypatch, 2)
    assert validate(ARM) == undisturbed
    assert len(tries) == 3


def test_there_is_no_verdict_where_all_workers_are_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    lose(monkeypatch, 99)
    with pytest.raises(WorkerLostError, match=r"ended by SIGKILL\. Free memory"):
        validate(ARM)
