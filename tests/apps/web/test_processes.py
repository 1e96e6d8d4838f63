"""Processes that outlive the page: started, found again by another page, stopped, never mistaken for a stranger's."""

import ctypes
import json
import os
import time
from contextlib import chdir
from pathlib import Path
from types import SimpleNamespace

import pytest
from made import made_run

from aidsr.apps.web import processes
from aidsr.apps.web.processes import Processes
from aidsr.apps.web.site import Site
from aidsr.core.errors import UserError
from aidsr.runs import EventLog


def until(held: object, what: str) -> None:
    """Wait for something to hold."""
    end = time.monotonic() + 300
    while not held():  # type: ignore[operator]
        assert time.monotonic() < end, what
        time.sleep(0.05)


def test_a_process_is_found_again_and_stopped_by_a_page_started_later(tmp_path: Path) -> None:
    run = made_run(tmp_path, waiting=True, designs=1)
    Site.at(tmp_path).resume(run)
    later = Site.at(tmp_path)
    assert later.is_running(run)
    assert os.getpriority(os.PRIO_PROCESS, later.processes.pid(run.path.name)) >= 10, "pages come first"
    for act in (later.resume, lambda one: later.trash(one.path.name)):  # its log is not opened yet
        with pytest.raises(UserError, match="already running"):
            act(run)
    until(lambda: _waits(run.design(1).events), "it never waited")
    assert later.processes.stop(run.path.name)
    until(lambda: not later.is_running(run), "it never ended")
    assert "Interrupted. Finished work is kept" in later.processes.output_tail(run.path.name)
    assert later.view(run).shown == "stopped"
    assert later.processes.stop(run.path.name) is False


def _waits(log: Path) -> bool:
    return log.read_text().count('"kind":"waiting"') > 1


def test_what_a_process_says_before_it_fails_is_kept(tmp_path: Path) -> None:
    processes = Processes(tmp_path / "processes")
    (tmp_path / "queue.py").write_text("raise SystemExit('no module of ours')")
    with chdir(tmp_path):  # what lies where the page was started is not imported
        processes.start("nothing", ["resume", str(tmp_path / "nothing")])
    until(lambda: not processes.is_alive("nothing"), "it never ended")
    assert "is not a run folder" in processes.output_tail("nothing")


def test_a_run_whose_design_is_being_trained_is_not_thrown_away(tmp_path: Path) -> None:
    site, run, waiting = Site.at(tmp_path), made_run(tmp_path, designs=1), made_run(tmp_path, waiting=True, designs=1)
    name = site.training_name(run, 1)
    site.processes.start(name, ["resume", str(waiting.path)])  # anything that goes on until it is stopped
    with pytest.raises(UserError, match="design 1 has a running training; stop it first"):
        site.trash(run.path.name)
    site.processes.stop(name)
    until(lambda: not site.processes.is_alive(name), "it never ended")
    site.trash(run.path.name)
    assert not run.path.exists()


def test_a_process_number_alone_is_no_process(tmp_path: Path) -> None:
    processes = Processes(tmp_path)
    (tmp_path / "old.json").write_text(json.dumps({"pid": os.getpid()}))
    (tmp_path / "old.log").write_text("")
    assert processes.is_alive("old") is False
    assert processes.stop("old") is False


@pytest.mark.parametrize("note", ["", "{", "[]", "{}", '{"pid": "x", "command": 3}'])
def test_a_damaged_note_counts_as_none(tmp_path: Path, note: str) -> None:
    processes = Processes(tmp_path)
    (tmp_path / "training.json").write_text(note)
    with EventLog(tmp_path / "training.log"):  # held as long as the process lives
        assert (processes.command("training"), processes.pid("training")) == ((), None)
        assert processes.stop("training") is False
        assert processes.is_stopping("training") is False


def test_a_run_at_work_in_a_terminal_is_known_and_not_ours_to_stop(tmp_path: Path) -> None:
    run = made_run(tmp_path, waiting=True)
    site = Site.at(tmp_path)
    assert site.view(run).shown == "waiting"
    assert not site.is_running(run)
    with EventLog(run.events):
        assert site.is_running(run)
        assert site.processes.stop(run.path.name) is False


def test_a_process_that_is_saving_its_work_is_not_asked_again_to_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = list[int]()
    monkeypatch.setattr(os, "kill", lambda pid, kind: asked.append(pid) if kind else None)
    first, other_tab = Processes(tmp_path), Processes(tmp_path)
    (tmp_path / "training.json").write_text('{"pid": 7}')
    with EventLog(tmp_path / "training.log"):  # held as long as the process lives
        assert not other_tab.is_stopping("training")
        assert (first.stop("training"), other_tab.stop("training"), first.stop("training")) == (True, True, True)
        assert asked == [7]
        assert other_tab.is_stopping("training")
        (tmp_path / "training.json").write_text('{"pid": 8}')
        assert not first.is_stopping("training"), "another process was started since"
        assert first.stop("training")
        assert asked == [7, 8]
        long_ago_s = time.time() - 71
        os.utime(tmp_path / "training.stopping", (long_ago_s, long_ago_s))
        assert first.stop("training")
        assert asked == [7, 8, 8], "one that does not end is asked again"
    assert not first.is_stopping("training")


def test_whether_a_process_runs_is_asked_on_windows_without_a_signal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def exit_code(_process: int, code: object) -> int:
        code._obj.value = 259  # type: ignore[attr-defined]
        return 1

    opened = {7: 1}
    system = SimpleNamespace(
        OpenProcess=lambda _access, _inherit, pid: opened.get(pid, 0),
        GetExitCodeProcess=exit_code,
        CloseHandle=lambda _process: 1,
    )
    monkeypatch.setattr(processes, "sys", SimpleNamespace(platform="win32"))
    monkeypatch.setattr(processes, "at_work", lambda _path: None)
    monkeypatch.setattr(ctypes, "windll", SimpleNamespace(kernel32=system), raising=False)
    monkeypatch.setattr(os, "kill", lambda *_: pytest.fail("a signal was sent"))
    for pid, alive in ((7, True), (8, False)):
        (tmp_path / "run.json").write_text(f'{{"pid": {pid}}}')
        assert Processes(tmp_path).is_alive("run") == alive
