"""Kill commands, or only their workers, with SIGKILL at moments spread over their work, then run the command again."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.attacks.tries import WALL_S, Ended, Outcome, contents, end, run, start, workers_of

_TASK = "button_pushing"
_TRAIN = ("--task", _TASK, "--protocol", "paper", "--threads", "1", "--no-videos", "--no-evaluate", "--out", "trained")
_SLIP = "<!-- a -- b -->"


@dataclass(frozen=True)
class Command:
    """A command to kill, how to continue it and how to read its result."""

    words: tuple[str, ...]
    again: Callable[[Path], tuple[str, ...]]
    """Returns the command that continues or repeats the killed one."""
    result: Callable[[Path, Ended], Any]
    """Returns the result, which must equal that of the undisturbed command; None if there is none."""
    prepare: Callable[[Path], None] = lambda _home: None
    kills: int = 5


def _run_folder(home: Path) -> Path | None:
    return next(iter(sorted((home / "runs").glob("*/run.json"))), None)


def _resumed(home: Path) -> tuple[str, ...]:
    found = _run_folder(home)
    return ("resume", str(found.parent)) if found else _DESIGN


def _design_result(home: Path, _ended: Ended) -> Any:
    found = _run_folder(home)
    if found is None:
        return None
    return {path.name: path.read_text() for path in sorted((found.parent / "designs" / "1").glob("final*.xml"))}


def _file(name: str, *, without: tuple[str, ...] = ()) -> Callable[[Path, Ended], Any]:
    def read(home: Path, _ended: Ended) -> Any:
        path = home / name
        if not path.exists():
            return None
        text = path.read_text()
        if not without:
            return text
        value = json.loads(text)
        return {key: each for key, each in value.items() if key not in without}

    return read


def _policy(home: Path, _ended: Ended) -> Any:
    """Return a hash of the policy's weights, or "resumed" for a training that resumed, whose weights may differ."""
    import zipfile

    folder = home / "trained" / "001"
    if not (folder / "training.json").exists():
        return None
    if json.loads((folder / "training.json").read_text())["resumed"]:
        return "resumed"
    with zipfile.ZipFile(folder / "policy.zip") as archive:
        return hash(archive.read("policy.pth"))


def _export(home: Path, _ended: Ended) -> Any:
    return contents(home / "parts", without=("sheet.html",)) or None


def _study(home: Path, _ended: Ended) -> Any:
    report = home / "study" / "report.csv"
    if not report.exists():
        return None
    lines = [line.split(",") for line in report.read_text().splitlines()]
    timed = {lines[0].index(name) for name in ("latency_s", "training_s")}
    return [[cell for column, cell in enumerate(line) if column not in timed] for line in lines]


def _scene(home: Path) -> None:
    from scenes import small_arm, small_scene

    (home / "scene.xml").write_text(small_scene())
    (home / "arm.xml").write_text(small_arm().replace("<mujoco", f"{_SLIP}<mujoco", 1))


def _trained(home: Path) -> None:
    _scene(home)
    assert run(home, "train", "scene.xml", "--steps", "1024", *_TRAIN).code == 0


def _designed(home: Path) -> None:
    assert run(home, *_DESIGN).code == 0


def _unfinished(home: Path) -> None:
    """Leave a run that was killed while its design was being made."""
    process, began_s = start(home, _DESIGN), time.monotonic()
    while not (list(home.glob("runs/*/designs/1/01/robot.xml")) or process.poll() is not None):
        if time.monotonic() - began_s > WALL_S:
            end(process)
            raise TimeoutError(f"no robot was written within {WALL_S:.0f} s")
        time.sleep(0.05)
    end(process)
    process.communicate()


_DESIGN = ("design", "--task", _TASK, "--concepts", "1", "--seed", "1")
_STUDY = ("benchmark", "study", "--tasks", _TASK, "--designs", "1", "--concepts", "1", "--seeds", "0", "--jobs", "1")


def _same(*words: str) -> Callable[[Path], tuple[str, ...]]:
    return lambda _home: words


_LEARN = ("train", "scene.xml", "--steps", "40960", *_TRAIN)
"""Takes long enough to write checkpoints, so that some kills hit a training that can be resumed."""
_EVALUATE = ("evaluate", "trained/001", "--episodes", "20", "--no-videos", "--threads", "1")
_PROBE = ("probe", "scene.xml", "--task", _TASK, "--candidates", "16", "--max-steps", "3000", "--out", "probe.json")
_VALIDATE = ("validate", "arm.xml", "--json")
_FIX = ("fix", "arm.xml", "--in-place")
_PARTS = ("export", "RUN/designs/1", "--out", "parts")

COMMANDS: dict[str, Command] = {
    "design": Command(_DESIGN, _resumed, _design_result, kills=8),
    "resume": Command(("resume", "RUN"), _resumed, _design_result, _unfinished, kills=6),
    "train": Command(_LEARN, _same(*_LEARN), _policy, _scene, kills=7),
    "evaluate": Command(_EVALUATE, _same(*_EVALUATE), _file("trained/001/evaluation.json"), _trained),
    "probe": Command(_PROBE, _same(*_PROBE), _file("probe.json", without=("wall_s",)), _scene),
    "validate": Command(_VALIDATE, _same(*_VALIDATE), lambda _home, ended: ended.out, _scene, kills=6),
    "fix": Command(_FIX, _same(*_FIX), _file("arm.xml"), _scene),
    "export": Command(_PARTS, lambda home: _named(home, *_PARTS), _export, _designed, kills=6),
    "benchmark": Command(_STUDY, _same(*_STUDY), _study, kills=6),
}
"""Commands that are killed here. `requests` kills web and mcp."""


def _named(home: Path, *words: str) -> tuple[str, ...]:
    found = _run_folder(home)
    return tuple(word.replace("RUN", str(found.parent) if found else "RUN") for word in words)


def tries(place: Path) -> Iterator[tuple[str, Callable[[], Outcome]]]:
    """Yield the name and the function of each try; a command's first try also makes its undisturbed result."""
    for name, command in COMMANDS.items():
        made: dict[str, Any] = {}
        for number in range(command.kills):
            whom = "parent" if number % 2 == 0 else "workers"
            part = (number + 0.5) / command.kills

            attempt = partial(_tried, place / name, name, command, whom, part, made)
            yield f"kill {whom} of {name} at {part:.0%}", attempt


def _tried(place: Path, name: str, command: Command, whom: str, part: float, made: dict[str, Any]) -> Outcome:
    if not made:
        made.update(_undisturbed(place, command))
    return _attempt(place, name, command, whom, part, made)


def _undisturbed(place: Path, command: Command) -> dict[str, Any]:
    home = place / "prepared"
    home.mkdir(parents=True)
    command.prepare(home)
    whole = Path(shutil.copytree(home, place / "whole"))
    ended = run(whole, *_named(whole, *command.words))
    assert ended.code in (0, 1), (command.words, ended)
    result, files = command.result(whole, ended), contents(whole)
    return {"home": home, "result": result, "files": files, "wall_s": ended.wall_s, "code": ended.code}


def _attempt(place: Path, name: str, command: Command, whom: str, part: float, made: dict[str, Any]) -> Outcome:
    outcome = Outcome("kills", f"{whom} of {name} at {part:.0%}")
    home = Path(shutil.copytree(made["home"], place / f"{whom}{part:.2f}"))
    process = start(home, _named(home, *command.words))
    began_s = time.monotonic()
    killed = 0
    limit_s = WALL_S + part * made["wall_s"]
    while process.poll() is None and not killed and time.monotonic() - began_s < limit_s:
        if time.monotonic() - began_s < part * made["wall_s"]:
            time.sleep(0.02)
        elif whom == "parent":
            end(process)
            killed = 1
        else:
            killed = _kill_workers(process.pid)
            time.sleep(0.05)
    try:
        out, error = process.communicate(timeout=max(1.0, limit_s - (time.monotonic() - began_s)))
    except subprocess.TimeoutExpired:
        outcome.hang = f"no end after {time.monotonic() - began_s:.0f} s"
        end(process)
        out, error = process.communicate()
    before = contents(home)
    outcome.notes = {"killed": killed, "code": process.returncode, "compared": True}
    ended = Ended(process.returncode, out, error, 0.0, time.monotonic() - began_s)
    if whom == "parent" or process.returncode not in (0, 1):
        ended = run(home, *command.again(home))
        outcome.notes["again"] = ended.code
        hang, outcome.failed = ended.problem()
        outcome.hang = outcome.hang or (hang if ended.code is None else "")  # the work may take longer than the limit
    elif "Traceback" in out + error:
        outcome.failed = f"traceback: {error[-200:]}"
    outcome.lost = lost(before, contents(home), made["files"])
    result = command.result(home, ended)
    if result == "resumed":
        outcome.notes["resumed"] = True
    elif result != made["result"]:
        outcome.changed = f"result differs: {str(result)[:100]}"
    shutil.rmtree(home)
    return outcome


def _kill_workers(pid: int) -> int:
    found = workers_of(pid)
    for worker in found:
        try:
            os.kill(worker, signal.SIGKILL)
        except ProcessLookupError:
            continue
    return len(found)


_REWRITTEN = ("summary.html", "events.jsonl", "curve.csv", "run.log", "report")
"""Beginnings of the names of files that are computed again or grow."""


def lost(before: dict[str, str], after: dict[str, str], undisturbed: dict[str, str]) -> str:
    """Return at most five finished files of a run, study or training that are missing or damaged afterwards.

    A file is damaged if it has changed, unless the undisturbed command leaves it like that.

    Args:
        before: Hashes of the files after the kill.
        after: Hashes after the command went on.
        undisturbed: Hashes after the undisturbed command.
    """
    gone = [name for name in before if name not in after and _is_kept(name)]
    damaged = [
        f"{name} (damaged)"
        for name in before
        if name in after and after[name] not in (before[name], undisturbed.get(name)) and _is_kept(name)
    ]
    return ", ".join([*gone, *damaged][:5])


def _is_kept(name: str) -> bool:
    """Return whether a file stays as it is once it is written."""
    temporary = any(part in name for part in ("checkpoint", ".tmp", "unfinished", "/jobs/"))
    return not temporary and "/." not in f"/{name}" and not name.rpartition("/")[2].startswith(_REWRITTEN)
