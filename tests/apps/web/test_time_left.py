"""How long a run at work will take, by what designs took before."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from made import made_run

from aidsr.apps.web.site import DesignView, RunView, Site
from aidsr.apps.web.time_left import left_s, usual_s

NOW = datetime(2026, 2, 1, 12, tzinfo=UTC)


def view_of(runs: Path, *designs: dict[str, object], since_s: float = 0.0) -> RunView:
    """Return a run whose designs differ from finished ones in some fields of their status."""
    site = Site.at(runs)
    view = site.view(made_run(runs, designs=len(designs)))
    since = (NOW - timedelta(seconds=since_s)).isoformat()
    made = zip(view.designs, designs, strict=True)
    changed: tuple[DesignView, ...] = tuple(
        replace(each, status=each.status.model_copy(update=fields), since=since) for each, fields in made
    )
    return replace(view, designs=changed, since=since)


def test_a_run_takes_as_long_as_designs_before_it(tmp_path: Path) -> None:
    before = view_of(tmp_path, {"latency_s": 100.0}, {"latency_s": 300.0}, {"latency_s": 400.0, "round": 2})
    usual = usual_s([before])
    assert list(usual.values()) == [200.0]
    working = {"outcome": None, "state": "running"}
    one = view_of(tmp_path, {**working, "latency_s": 50.0}, {**working, "latency_s": 90.0}, {}, since_s=30.0)
    assert left_s(one, usual, NOW) == pytest.approx(200 - 50 - 30)


def test_nothing_is_told_of_what_is_unknown_or_takes_longer(tmp_path: Path) -> None:
    working = {"outcome": None, "state": "running", "latency_s": 50.0}
    first = view_of(tmp_path, working)
    assert left_s(first, usual_s([first]), NOW) is None, "no design was finished before"
    usual = usual_s([view_of(tmp_path, {"latency_s": 60.0})])
    assert left_s(view_of(tmp_path, working, since_s=30.0), usual, NOW) is None, "it takes longer than usual"
    waiting = view_of(tmp_path, {**working, "state": "waiting"})
    assert left_s(waiting, usual, NOW) is None, "it is a person's turn"
    other = {(*key[:2], True, key[3]): value for key, value in usual.items()}
    assert left_s(view_of(tmp_path, working), other, NOW) is None, "tried on its task a design takes longer"
