"""Isolation: what a call may do to its process, and what it may not do to ours."""

from __future__ import annotations

import os
import signal
import site
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from aidsr.core.errors import IsolationError, MjcfError, UserError
from aidsr.sandbox import isolation
from aidsr.sandbox.child import Child, child_environment
from aidsr.sandbox.isolation import Limits
from aidsr.sandbox.self_test import try_isolation

TRIALS = "aidsr.sandbox.self_test"
LIMITS = {"cpu_s": 60, "memory_mib": 4096}

linux = pytest.mark.skipif(sys.platform != "linux", reason="a limit of Linux")


def trial(name: str, limits: Limits | None = None, **argument: Any) -> dict[str, Any]:
    return isolation.call(f"{TRIALS}:{name}", argument, limits)


@pytest.fixture
def child() -> Iterator[Child]:
    one = Child()
    yield one
    one.close()


def request(name: str, **argument: Any) -> dict[str, Any]:
    return {"function": f"{TRIALS}:{name}", "argument": argument, "limits": LIMITS}


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
    argument = {"text": "Grüße", "numbers": [1, 2.5, float("inf")], "nothing": None}
    first = trial("echo", **argument)
    second = trial("echo", **argument)
    assert first["argument"] == argument
    assert first["pid"] == second["pid"] != os.getpid()


def test_stray_prints_do_not_become_answers() -> None:
    assert trial("chatter") == {"done": True}


def test_only_functions_of_aidsr_are_run() -> None:
    with pytest.raises(RuntimeError, match=r'expected "aidsr\.module:function", found \'os:getcwd\''):
        isolation.call("os:getcwd", {})


def test_faults_travel_back_as_they_were() -> None:
    with pytest.raises(MjcfError) as caught:
        trial("refuse", error="mjcf")
    (fault,) = caught.value.faults
    assert (fault.code, fault.names, fault.line) == ("bad_value", ("a",), 3)


def test_a_users_mistake_travels_back_as_it_was() -> None:
    with pytest.raises(UserError, match=r"^on purpose$"):
        trial("refuse", error="user")


@pytest.mark.parametrize(
    ("name", "kind"), [("refuse", "LookupError: on purpose"), ("unspeakable", "TypeError: Object")]
)
def test_a_bug_keeps_the_traceback_of_the_child(name: str, kind: str) -> None:
    with pytest.raises(RuntimeError, match=kind) as caught:
        trial(name, error="bug")
    assert "Traceback" in caught.value.__notes__[0]
    assert trial("echo")["argument"] == {}


@pytest.mark.parametrize(
    ("name", "argument", "limits", "kind"),
    [
        ("crash", {}, None, "crash"),
        ("abort", {"signal": "SIGABRT"}, None, "crash"),
        ("abort", {"signal": "SIGKILL"}, None, "memory"),
        ("sleep", {"seconds": 600}, Limits(wall_s=0.2), "time"),
        ("hang", {"seconds": 600}, Limits(wall_s=0.2), "time"),
    ],
)
def test_the_pool_survives_the_end_of_a_worker(
    name: str, argument: dict[str, Any], limits: Limits | None, kind: str
) -> None:
    before = trial("echo")["pid"]
    with pytest.raises(IsolationError) as caught:
        trial(name, limits, **argument)
    assert caught.value.kind == kind
    assert trial("echo")["pid"] != before
    assert not alive(before)


def test_a_crash_says_what_the_process_last_printed() -> None:
    with pytest.raises(IsolationError, match=r"(?s)SIGSEGV.*Segmentation fault.*in crash"):
        trial("crash")


@linux
def test_memory_is_limited_for_a_call_and_given_back() -> None:
    with pytest.raises(IsolationError, match="more than 1024 MiB") as caught:
        trial("allocate", Limits(memory_mib=1024), mib=2048)
    assert caught.value.kind == "memory"
    assert trial("allocate", mib=64) == {"bytes": 64 * 2**20}


@linux
def test_processor_time_is_limited_for_a_call(child: Child) -> None:
    spin = request("spin") | {"limits": {"cpu_s": 0.1, "memory_mib": 4096}}
    assert child.ask(spin, 60) == {"time": "cpu"}
    assert not child.usable


def test_calls_run_side_by_side() -> None:
    both_inside = threading.Barrier(2)
    pids: list[int] = []

    def one() -> None:
        both_inside.wait()
        trial("sleep", seconds=0.3)
        pids.append(trial("echo")["pid"])

    threads = [threading.Thread(target=one) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(pids) == 2


def test_no_key_reaches_a_child(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("OPENAI_API_KEY", "ANTHROPIC_API_KEY", "MY_TOKEN", "HTTPS_PROXY"):
        monkeypatch.setenv(name, "secret")
    child = Child()
    variables = child.ask(request("surroundings"), 60)["result"]["variables"]
    child.close()
    assert not [name for name in variables if "KEY" in name or "TOKEN" in name or "PROXY" in name]
    assert "PATH" in variables


def test_files_are_left_in_a_private_folder_that_goes_away(
    child: Child, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = Path(child.ask(request("surroundings"), 60)["result"]["folder"])
    assert (folder / "MUJOCO_LOG.TXT").exists()
    child.close()
    assert not folder.exists()
    assert list(tmp_path.iterdir()) == []


def test_a_child_without_its_folder_is_still_closed(child: Child) -> None:
    child.close()
    assert not child.usable


PARENT = """
import sys, threading
from aidsr.sandbox import isolation
first = isolation.call("aidsr.sandbox.self_test:echo", {})
folder = isolation.call("aidsr.sandbox.self_test:surroundings", {})["folder"]
print(first["pid"], folder, flush=True)
if sys.argv[1] == "wait":
    isolation.call("aidsr.sandbox.self_test:sleep", {"seconds": 600}, isolation.Limits(wall_s=900))
"""


def start_parent(folder: Path, what: str) -> subprocess.Popen[str]:
    """Start a plain script, which has no `if __name__ == "__main__"`."""
    script = folder / "script.py"
    script.write_text(PARENT)
    return subprocess.Popen([sys.executable, str(script), what], stdout=subprocess.PIPE, text=True, cwd=folder)


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
    assert trial("echo")["pid"] == os.getpid()


def test_the_parent_needs_no_mujoco() -> None:
    code = "import sys, aidsr.sandbox.isolation, aidsr.mjcf.read, aidsr.render.pictures, aidsr.render.viewer; "
    code += "print([name for name in ('mujoco', 'numpy', 'av', 'PIL') if name in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_guarantees_are_those_of_this_platform() -> None:
    holds = {guarantee.name: guarantee.holds for guarantee in isolation.guarantees()}
    assert holds["own process"]
    assert holds["memory"] == (sys.platform == "linux")


def test_what_is_promised_is_kept_when_it_is_tried() -> None:
    promised = {guarantee.name: guarantee.holds for guarantee in isolation.guarantees()}
    tried = {guarantee.name: guarantee.holds for guarantee in try_isolation()}
    assert tried == {name: promised[name] for name in tried}


def test_the_documentation_lists_every_guarantee() -> None:
    page = (Path(__file__).parents[2] / "docs" / "safety.md").read_text(encoding="utf-8")
    assert [guarantee.name for guarantee in isolation.guarantees() if f"| {guarantee.name} |" not in page] == []
