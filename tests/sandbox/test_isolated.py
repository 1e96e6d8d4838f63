"""Isolation: what a call may do to its process, and what it may not do to ours."""

from __future__ import annotations

import os
import signal
import site
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import misbehaving
import pytest
from misbehaving import Parcel

from aidsr.core.errors import IsolationError, MjcfError, ReplyError, UserError, WorkerLostError
from aidsr.sandbox.access import Access
from aidsr.sandbox.child import Child
from aidsr.sandbox.environment import child_environment
from aidsr.sandbox.guarantees import guarantees, try_guarantees
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.pool import module_path

HERE = Access(modules=frozenset([str(Path(__file__).parent), *module_path()]))

linux = pytest.mark.skipif(sys.platform != "linux", reason="a limit of Linux")


@pytest.fixture
def child() -> Iterator[Child]:
    one = Child(HERE)
    yield one
    one.close()


def request(name: str, *arguments: Any, cpu_s: float = 60) -> dict[str, Any]:
    limits = {"cpu_s": cpu_s, "memory_mib": 4096}
    here = str(Path(__file__).parent)
    return {"function": f"misbehaving:{name}", "arguments": arguments, "limits": limits, "path": [here]}


@pytest.mark.parametrize("enabled", [True, False, None])
def test_a_worker_finds_what_is_installed_for_the_user_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, enabled: bool | None
) -> None:
    monkeypatch.setattr(site, "ENABLE_USER_SITE", enabled)
    given = child_environment(tmp_path)
    assert given["HOME"] == str(tmp_path)
    assert given.get("PYTHONUSERBASE") == (site.getuserbase() if enabled else None)


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def gone(pid: int) -> bool:
    """Wait until a process that should end has ended; the deadline only ends a failing test."""
    deadline = time.monotonic() + 30
    while alive(pid) and time.monotonic() < deadline:
        time.sleep(0.01)
    return not alive(pid)


def test_values_travel_there_and_back_and_the_worker_stays_warm() -> None:
    parcel = Parcel("text", (1.0, float("inf")))
    first = misbehaving.process()
    assert misbehaving.echo(parcel, more=b"\xff\x00") == (parcel, b"\xff\x00")
    assert misbehaving.echo() == (Parcel(), b"")
    assert first == misbehaving.process() != os.getpid()


def test_a_relative_path_means_the_callers_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    box = misbehaving.Box((Path("nested.json"), tmp_path / "absolute.json"))
    expected = tuple(tmp_path / name for name in ("goal.json", "nested.json", "absolute.json"))
    assert misbehaving.absolute(Path("goal.json"), box) == expected


def test_a_decorated_function_keeps_its_name_and_signature() -> None:
    assert misbehaving.sleep.__name__ == "sleep"
    assert misbehaving.sleep.__doc__ == "Wait without using the processor."
    with pytest.raises(TypeError, match="seconds"):
        misbehaving.sleep()  # type: ignore[call-arg]


def test_stray_prints_do_not_become_replies() -> None:
    assert misbehaving.chatter()


def test_only_decorated_functions_of_a_module_are_run(child: Child) -> None:
    asked = request("echo") | {"function": "os:getcwd"}
    assert "os:getcwd is not decorated with @isolated" in child.call(asked, 60)["bug"]


def test_a_function_that_a_worker_could_not_find_is_refused() -> None:
    def inner() -> None: ...

    with pytest.raises(TypeError, match="module level"):
        isolated(inner)


def test_faults_travel_back_as_they_were() -> None:
    with pytest.raises(MjcfError) as caught:
        misbehaving.refuse("mjcf")
    (fault,) = caught.value.faults
    assert (fault.code, fault.names, fault.line) == ("bad_value", ("a",), 3)


def test_a_users_mistake_travels_back_as_it_was() -> None:
    with pytest.raises(UserError, match=r"^on purpose$"):
        misbehaving.refuse("user")


@pytest.mark.parametrize(
    ("call", "kind"),
    [(lambda: misbehaving.refuse("bug"), "LookupError: on purpose"), (misbehaving.lie, "Unable to serialize")],
)
def test_a_bug_keeps_the_traceback_of_the_child(call: Callable[[], object], kind: str) -> None:
    with pytest.raises(RuntimeError, match="failed in its worker") as caught:
        call()
    assert "Traceback" in caught.value.__notes__[0]
    assert kind in caught.value.__notes__[0]
    assert misbehaving.echo() == (Parcel(), b"")


@pytest.mark.parametrize(
    ("call", "kind"),
    [
        (misbehaving.crash, "crash"),
        (lambda: misbehaving.die_by("SIGABRT"), "crash"),
        (misbehaving.sleep_too_long, "time"),
        (misbehaving.hang, "time"),
    ],
)
def test_the_pool_survives_the_end_of_a_worker(call: Callable[[], None], kind: str) -> None:
    before = misbehaving.process()
    with pytest.raises(IsolationError) as caught:
        call()
    assert caught.value.kind == kind
    assert misbehaving.process() != before
    assert not alive(before)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize("name", ["SIGKILL", "SIGTERM"])
def test_a_worker_that_is_always_ended_from_outside_is_nobodys_fault(name: str) -> None:
    with pytest.raises(WorkerLostError, match=f"lost 3 times, the last time because it was ended by {name}"):
        misbehaving.die_by(name)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_a_call_whose_worker_was_killed_is_made_again(tmp_path: Path) -> None:
    assert misbehaving.die_until(tmp_path, 3) == 3


def test_a_crash_says_what_the_process_last_printed() -> None:
    with pytest.raises(IsolationError, match=r"(?s)SIGSEGV.*Segmentation fault.*in crash"):
        misbehaving.crash()


@linux
def test_memory_is_limited_for_a_call_and_given_back() -> None:
    with pytest.raises(IsolationError, match="allocate_in_a_gigabyte needed more than 1024 MiB") as caught:
        misbehaving.allocate_in_a_gigabyte(2048)
    assert caught.value.kind == "memory"
    assert misbehaving.allocate(64) == 64 * 2**20


@linux
def test_processor_time_is_limited_for_a_call(child: Child) -> None:
    assert child.call(request("spin", cpu_s=0.1), 60) == {"time": "cpu"}
    assert not child.usable


def test_calls_run_side_by_side() -> None:
    both_inside = threading.Barrier(2)
    pids: list[int] = []

    def one() -> None:
        both_inside.wait()
        misbehaving.sleep(0.3)
        pids.append(misbehaving.process())

    threads = [threading.Thread(target=one) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(pids) == 2


def test_no_key_reaches_a_child(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("OPENAI_API_KEY", "ANTHROPIC_API_KEY", "MY_TOKEN", "HTTPS_PROXY"):
        monkeypatch.setenv(name, "secret")
    child = Child(HERE)
    ((_, variables),) = child.call(request("surroundings"), 60)["result"]
    child.close()
    assert not [name for name in variables if "KEY" in name or "TOKEN" in name or "PROXY" in name]
    assert "PATH" in variables


def test_files_are_left_in_a_private_folder_that_goes_away(
    child: Child, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = Path(child.call(request("surroundings"), 60)["result"][0][0])
    assert (folder / "MUJOCO_LOG.TXT").exists()
    child.close()
    assert not folder.exists()
    assert list(tmp_path.iterdir()) == []


def test_a_child_without_its_folder_is_still_closed(child: Child) -> None:
    child.close()
    assert not child.usable


PARENT = """
import sys
sys.path.append(sys.argv[2])
import misbehaving
print(misbehaving.process(), misbehaving.surroundings()[0], flush=True)
if sys.argv[1] == "wait":
    misbehaving.sleep_long()
"""


def start_parent(folder: Path, what: str) -> subprocess.Popen[str]:
    """Start a plain script, which has no `if __name__ == "__main__"`."""
    script = folder / "script.py"
    script.write_text(PARENT)
    command = [sys.executable, str(script), what, str(Path(__file__).parent)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=folder)


def test_workers_end_with_the_script_that_used_them(tmp_path: Path) -> None:
    with start_parent(tmp_path, "end") as parent:
        output, _ = parent.communicate(timeout=120)
    pid, folder = output.split()
    assert parent.returncode == 0
    assert gone(int(pid))
    assert not Path(folder).exists()
    assert [file.name for file in tmp_path.iterdir()] == ["script.py"]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_a_worker_leaves_when_its_parent_is_killed(tmp_path: Path) -> None:
    with start_parent(tmp_path, "wait") as parent:
        assert parent.stdout is not None
        pid, folder = parent.stdout.readline().split()
        parent.send_signal(signal.SIGKILL)
    assert gone(int(pid))
    assert not Path(folder).exists()


def test_a_call_inside_a_worker_runs_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AIDSR_INSIDE_WORKER", "anything")
    assert misbehaving.process() == os.getpid()


def test_the_parent_needs_no_mujoco() -> None:
    code = "import sys, aidsr.validation, aidsr.mjcf.read, aidsr.render.viewer, aidsr.sim.measure; "
    code += "print([name for name in ('mujoco', 'numpy', 'av', 'PIL') if name in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_guarantees_are_those_of_this_platform() -> None:
    holds = {guarantee.name: guarantee.holds for guarantee in guarantees()}
    assert holds["own process"]
    assert holds["memory"] == (sys.platform == "linux")


def test_what_is_promised_is_kept_when_it_is_tried() -> None:
    promised = {guarantee.name: guarantee.holds for guarantee in guarantees()}
    tried = {guarantee.name: guarantee.holds for guarantee in try_guarantees()}
    assert tried == {name: promised[name] for name in tried}


def test_the_documentation_lists_every_guarantee() -> None:
    page = (Path(__file__).parents[2] / "docs" / "safety.md").read_text(encoding="utf-8")
    assert [guarantee.name for guarantee in guarantees() if f"| {guarantee.name} |" not in page] == []


def test_a_reply_that_cannot_be_used_is_reported_as_such() -> None:
    with pytest.raises(ReplyError, match="It has no <patch>"):
        misbehaving.refuse_reply()
