"""Event logs: one writer, torn lines, time worked, nothing secret."""

from datetime import UTC, datetime, timedelta

import pytest

from aidsr.core.artifacts import Outcome
from aidsr.core.errors import UserError
from aidsr.runs.events import (
    Decided,
    EventLog,
    Finished,
    Started,
    StepDone,
    StepStarted,
    Stopped,
    Waiting,
    read_events,
    without_secrets,
    working_time_s,
)

NOON = datetime(2026, 1, 31, 12, tzinfo=UTC)


class Clock:
    """Gives the prepared seconds after noon, one after the other."""

    def __init__(self, *seconds: float) -> None:
        self.seconds = iter(seconds)

    def __call__(self) -> datetime:
        return NOON + timedelta(seconds=next(self.seconds))


def write(path, *events, seconds=None) -> None:
    with EventLog(path, now=Clock(*(seconds or range(len(events))))) as log:
        for event in events:
            log.write(event)


def test_events_read_back_in_order(tmp_path) -> None:
    path = tmp_path / "events.jsonl"
    events = [
        Started(),
        StepStarted(step="robot", iteration=1),
        StepDone(step="robot", iteration=1, summary="ok"),
        Stopped(cause="bug", message="m", traceback="t\nt"),
        Finished(outcome=Outcome(outcome="quit", reason="r")),
    ]
    write(path, *events)
    assert [event.model_copy(update={"time": ""}) for event in read_events(path)] == events
    assert len(path.read_text().splitlines()) == len(events)


def test_no_log_is_no_events(tmp_path) -> None:
    assert read_events(tmp_path / "events.jsonl") == ()


@pytest.mark.parametrize("torn", [b"{", b'{"time":"2026-01-31T12:00:00.000+00:00","kind":"done","st', b'{"a": "\xc3'])
def test_a_torn_last_line_is_left_out_then_cut_off(tmp_path, torn: bytes) -> None:
    path = tmp_path / "events.jsonl"
    write(path, Started(), StepStarted(step="robot"))
    with path.open("ab") as file:
        file.write(torn)
    assert len(read_events(path)) == 2
    write(path, Started())
    assert [type(event) for event in read_events(path)] == [Started, StepStarted, Started]


def test_a_log_that_is_one_torn_line(tmp_path) -> None:
    path = tmp_path / "events.jsonl"
    path.write_bytes(b'{"time":')
    assert read_events(path) == ()
    write(path, Started())
    assert len(read_events(path)) == 1


def test_a_damaged_line_is_named(tmp_path) -> None:
    path = tmp_path / "events.jsonl"
    write(path, Started())
    path.write_bytes(path.read_bytes() + b"nonsense\n")
    with pytest.raises(UserError, match="line 2 of"):
        read_events(path)


def test_a_second_writer_is_refused_until_the_first_closes(tmp_path) -> None:
    path = tmp_path / "events.jsonl"
    with EventLog(path), pytest.raises(UserError, match="another process is at work"):
        EventLog(path)
    with EventLog(path):
        pass


def test_the_listener_hears_what_was_written(tmp_path) -> None:
    heard = []
    with EventLog(tmp_path / "events.jsonl", heard.append) as log:
        log.write(Started())
    assert tuple(heard) == read_events(tmp_path / "events.jsonl")


def test_time_worked_leaves_out_pauses_and_waiting(tmp_path) -> None:
    path = tmp_path / "events.jsonl"
    events = [
        Started(),
        StepStarted(step="robot"),
        Started(),
        Waiting(iteration=1),
        Decided(iteration=1, verdict="quit"),
    ]
    write(path, *events, Finished(), seconds=[0, 2, 1000, 1003, 9000, 9000.5])
    assert working_time_s(read_events(path)) == pytest.approx(2 + 3 + 0.5)


def test_time_worked_goes_on_while_a_step_is_at_work(tmp_path) -> None:
    path = tmp_path / "events.jsonl"
    write(path, Started(), StepStarted(step="robot"), seconds=[0, 2])
    assert working_time_s(read_events(path), NOON + timedelta(seconds=10)) == pytest.approx(10)
    write(path, Waiting(iteration=1), seconds=[12])
    assert working_time_s(read_events(path), NOON + timedelta(seconds=99)) == pytest.approx(12)


def test_values_of_secret_variables_are_replaced(monkeypatch) -> None:
    monkeypatch.setenv("MY_API_TOKEN", "tok-abcdefgh")
    monkeypatch.setenv("SHORT_KEY", "on")
    assert without_secrets("on: tok-abcdefgh!") == "on: [MY_API_TOKEN]!"


@pytest.mark.parametrize("time", ["", "yesterday", "2026-01-31T10:00:00", "2026-13-01T00:00:00+00:00", "²"])
def test_a_line_whose_time_is_none_is_named(tmp_path, time) -> None:
    path = tmp_path / "events.jsonl"
    path.write_text(f'{{"kind": "started", "time": "{time}"}}\n')
    with pytest.raises(UserError, match=r"line 1 of .* is not an event"):
        read_events(path)
