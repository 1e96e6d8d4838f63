"""Runs, studies and trainings from strangers: links, pipes, devices, changed records, records that name a server."""

from __future__ import annotations

import os
import shutil
import socket
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from benchmarks.attacks.servers import KEY
from benchmarks.attacks.tries import Outcome, contents, environment, run

from foreign_texts import unpack
from loopback import Loopback, Say

_SECRET = "what a stranger may neither read nor change"
Change = Callable[[Path, Path, Path, str], None]
"""Function that changes the folders of a run and of a study, given the path of a foreign file and the URL of a foreign
server."""


def _link(name: str) -> Change:
    def change(run: Path, study: Path, foreign: Path, _url: str) -> None:
        for folder in (run, study):
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.is_dir():
                shutil.rmtree(path)
                path.symlink_to(foreign.parent)
            else:
                path.unlink(missing_ok=True)
                path.symlink_to(foreign)

    return change


def _special(name: str, make: Callable[[Path], object]) -> Change:
    def change(run: Path, study: Path, _foreign: Path, _url: str) -> None:
        for folder in (run, study):
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.is_dir():
                shutil.rmtree(path)
            path.unlink(missing_ok=True)
            make(path)

    return change


def _socket(path: Path) -> None:
    before = Path.cwd()
    os.chdir(path.parent)  # the address of a socket is short
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
    finally:
        os.chdir(before)


def _replaced(*pairs: tuple[str, str]) -> Change:
    def change(run: Path, study: Path, foreign: Path, url: str) -> None:
        for file in (run / "run.json", study / "study.toml"):
            text = file.read_text()
            for old, new in pairs:
                text = text.replace(old, new.replace("URL", url).replace("OUTSIDE", str(foreign.parent)))
            file.write_text(text)

    return change


def _model(name: str) -> Change:
    def change(run: Path, study: Path, foreign: Path, url: str) -> None:
        desk = f"manual:{run.parent / 'desk'}"
        _replaced((desk, name), ('"builtin"', f'"{name}"'))(run, study, foreign, url)
        (run / "designs" / "1" / "outcome.json").unlink()  # so that there is work left
        shutil.rmtree(run / "designs" / "1" / "02")

    return change


def _written(name: str, content: bytes) -> Change:
    def change(run: Path, study: Path, _foreign: Path, _url: str) -> None:
        for folder in (run, study):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)

    return change


CHANGES: dict[str, Change] = {
    **{f"a link for {name}": _link(name) for name in (
        "run.json", "events.jsonl", "designs/1/events.jsonl", "designs/1/final.xml", "designs/1/02/robot.xml",
        "designs/1/02", "designs/2", "calls", "summary.html", "environment.xml", "study.toml", "submission.json",
        "report.html", "designs/1/training/001/policy.zip", "designs/1/training/001",
    )},
    **{f"a pipe for {name}": _special(name, os.mkfifo) for name in (
        "run.json", "events.jsonl", "designs/1/final.xml", "designs/1/02/decision.json", "study.toml", ".origin",
        "designs/1/training/001/normalisation.json",
    )},
    "a socket": _special("notes.json", _socket),
    "a socket for the summary": _special("summary.html", _socket),
    "a loop of links": _special("again", lambda path: path.symlink_to(path.parent)),
    "a link to a device": _special("designs/1/02/motion.png", lambda path: path.symlink_to("/dev/zero")),
    "a server of the stranger's": _model("m@URL"),
    "a server of the stranger's, by name": _model("openai:m@URL"),
    "a model of another provider": _model("anthropic:claude"),
    "a directory of prompts elsewhere": _model("manual:OUTSIDE"),
    "a replay of another folder": _model("replay:/etc"),
    "a mark that is none": _written(".origin", b"made here"),
    "a record that is empty": _written("run.json", b""),
    "a record that is no text": _written("run.json", b"\xff\xfe\x00"),
    "a record of another version": _replaced(('"objective"', '"goal"')),
    "terminal codes in the objective": _replaced(("Press", "\\u001b]0;owned\\u0007Press")),
    "a folder named with a digit that is none": _written("designs/\u00b2/events.jsonl", b""),
    "a thousand designs": lambda run, *_: [(run / "designs" / str(n)).mkdir() for n in range(2, 1000)] and None,
    "events of 5 MB": _written("designs/1/events.jsonl", b'{"kind": "started", "time": "x"}\n' * 150_000),
    "an XML that is empty": _written("designs/1/final.xml", b""),
}  # fmt: skip
COMMANDS = (
    ("show", "RUN"), ("resume", "RUN"), ("view", "RUN/designs/1"), ("export", "RUN/designs/1"),
    ("evaluate", "RUN/designs/1/training/001", "--no-videos"), ("report", "STUDY"), ("submit", "STUDY"),
    ("benchmark", "STUDY", "--resume"), ("leaderboard", "STUDY/submission.json"),
)  # fmt: skip
"""Commands that are run on changed folders. Each change is tried with `show` and mostly with one other command; each
command is tried on several changes."""


def tries(place: Path) -> Iterator[tuple[str, Callable[[], Outcome]]]:
    """Yield the name and the function of each try."""
    for number, (name, change) in enumerate(CHANGES.items()):
        yield f"folder: {name}", partial(_attempt, place, number, name, change)


def _attempt(place: Path, number: int, name: str, change: Change) -> Outcome:
    outcome = Outcome("folders", name)
    home = place / str(number)
    outside = home / "outside"
    outside.mkdir(parents=True)
    (outside / "secret.txt").write_text(_SECRET)
    found, study = unpack(home)
    before = contents(outside)
    with Loopback(lambda _: Say("hello")) as server:
        change(found.path, study, outside / "secret.txt", f"{server.url}/v1")
        env = environment(home, OPENAI_API_KEY=KEY, ANTHROPIC_API_KEY=KEY, AIDSR_ATTEMPTS="1", AIDSR_DEADLINE_S="5")
        chosen = [COMMANDS[1 if "server" in name or "model" in name else number % len(COMMANDS)], COMMANDS[0]]
        for words in dict.fromkeys(chosen):
            filled = [word.replace("RUN", str(found.path)).replace("STUDY", str(study)) for word in words]
            ended = run(home, *filled, env=env)
            hang, failed = ended.problem()
            outcome.hang, outcome.failed = outcome.hang or hang, outcome.failed or failed
            if _SECRET in ended.out + ended.error or any(code in ended.out + ended.error for code in "\x1b\x07"):
                outcome.failed = "a foreign file or terminal codes in the output"
            outcome.notes[words[0]] = ended.code
        if server.requests:
            outcome.failed = f"{len(server.requests)} requests reached the stranger's server"
    if contents(outside) != before:
        outcome.lost = "a foreign file was changed"
    return outcome
