"""Run by test_kill.py as a program of its own: kill a small run at every point, resume it, report as JSON lines.

Each life of the run is a forked child. A point is an audit event of the interpreter (a file opened to be written, or
renamed, or a folder made) or a moment inside a call to the model, counted over all threads; at the given one the child
kills itself with SIGKILL, as a power cut would, between two system calls.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import signal
import sys
from pathlib import Path

from aidsr.core.artifacts import Critique, CritiqueIssue
from aidsr.core.calls import CallRecord, Message, Question, Usage
from aidsr.core.roles import Team
from aidsr.loop.human import approve
from aidsr.loop.parts import Parts
from aidsr.loop.runner import run_designs
from aidsr.runs import RecordedModel, Run, read_status, write_summary
from scripted import Script, Scripted, assemble, new_run, repair, validate

POINTS = {"os.rename", "os.mkdir", "os.truncate", "os.remove"}


class Life:
    """Counts the points passed, one byte each in a file beside the run, and ends at the last.

    A point where an answer is on its way to the disk is a "c", any other a ".".
    """

    def __init__(self, last: int | None, folder: Path) -> None:
        self.last = last
        self.folder = str(folder)
        self.passed = itertools.count(1)
        self.file = os.open(folder.with_suffix(".points"), os.O_WRONLY | os.O_CREAT | os.O_APPEND)

    def pass_point(self, kind: bytes = b".") -> None:
        os.write(self.file, kind)
        if next(self.passed) == self.last:
            os.kill(os.getpid(), signal.SIGKILL)

    def watch(self, event: str, arguments: tuple[object, ...]) -> None:
        writes = event in POINTS or (event == "open" and arguments[2] & (os.O_WRONLY | os.O_RDWR))
        if writes and str(arguments[0]).startswith(self.folder):
            self.pass_point(b"c" if "/calls" in str(arguments[0]) else b".")


class LoggedModel:
    """Answers every question, and logs that it was asked before it does."""

    name = "logged"

    def __init__(self, log: Path, life: Life) -> None:
        self.log, self.life = log, life

    def ask(self, question: Question) -> CallRecord:
        with self.log.open("a") as file:
            file.write(fingerprint(question) + "\n")
        self.life.pass_point()
        usage = Usage(calls=1, input_tokens=100, output_tokens=10, cost_usd=0.01)
        return CallRecord(question=question, model=self.name, reply="ok", finish="stop", usage=usage, started="2026")


class AskingTeam(Scripted):
    """The scripted roles, each of which also asks the model, as agents do: one bad robot, one bad critique."""

    def __init__(self, model: RecordedModel) -> None:
        super().__init__([Script(), Script()])
        self.model = model

    def _ask(self, role: str, text: str) -> None:
        self.model.ask(Question(role=role, messages=(Message(role="user", text=text),)))

    def propose(self, brief, count):
        self._ask("designer", brief.objective)
        return super().propose(brief, count)

    def write(self, brief, concept):
        self._ask("coder", f"write {concept.name}")
        return (
            super()
            .write(brief, concept)
            .model_copy(update={"mjcf": f"<mujoco><robot faults='chatter' {concept.name}/></mujoco>"})
        )

    def repair(self, brief, concept, robot, feedback):
        # the same question twice, as a role that re-asks word for word does
        self._ask("coder", f"repair {robot.mjcf}")
        self._ask("coder", f"repair {robot.mjcf}")
        return robot.model_copy(update={"mjcf": robot.mjcf.replace("'chatter'", "'misspelt'") + "<!-- repaired -->"})

    def place(self, brief, concept, robot):
        self._ask("integrator", f"place {robot.mjcf}")
        return super().place(brief, concept, robot).model_copy(update={"mount": "ok"})

    def judge(self, brief, concept, robot, scene, report):
        self._ask("judge", f"judge {scene.mjcf}")
        if robot.mjcf.count("repaired") < 2:
            return Critique(passed=False, issues=(CritiqueIssue(blame="coder", component="tip", problem="Thin."),))
        return Critique(passed=True)


def fingerprint(question: Question) -> str:
    return hashlib.sha256(question.model_dump_json().encode()).hexdigest()[:16]


def live(run: Run, log: Path, last: int | None) -> int:
    """Work on the run in a child process; return the signal that ended it, 0 for none."""
    child = os.fork()
    if child == 0:
        life = Life(last, run.path)
        sys.addaudithook(life.watch)
        model = LoggedModel(log, life)

        def team(folder: Path) -> Team:
            roles = AskingTeam(RecordedModel(model, folder))
            return Team(designer=roles, coder=roles, integrator=roles, judge=roles)

        run_designs(run, Parts(team, repair, validate, assemble, str.encode, str.encode, approve))
        os._exit(0)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return os.WTERMSIG(status)
    assert os.WEXITSTATUS(status) == 0, "the child failed; its traceback is on stderr"
    return 0


def recorded(run: Run) -> list[str]:
    calls = itertools.chain(run.calls, *(it.calls for design in run.designs for it in design.iterations))
    return [fingerprint(call.question) for call in calls]


def tell(folder: Path, last: int | None) -> dict[str, object]:
    """One story: killed at point `last`, looked at, resumed."""
    run, log = new_run(folder, concepts=2), folder / f"asked_{last}.log"
    log.touch()
    ended_by = live(run, log, last)
    points = run.path.with_suffix(".points").stat().st_size
    status = read_status(run)
    before, recorded_before = log.read_text().split(), recorded(run)
    live(run, log, None)
    return {
        "last": last,
        "points": points,
        "ended_by": ended_by,
        "state_after_kill": status.state,
        "asked_before": before,
        "recorded_before": recorded_before,
        "asked_after": log.read_text().split()[len(before) :],
        "recorded_after": sorted(recorded(run)),
        "state": read_status(run).state,
        "cost_usd": read_status(run).usage.cost_usd,
        "files": {
            path.relative_to(run.path).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(run.path.rglob("*"))
            if path.is_file()
            and path.suffix not in (".jsonl", ".html", ".tmp")
            and path.name not in ("run.json", ".origin")
        },
    }


if __name__ == "__main__":
    place, wanted = Path(sys.argv[1]), int(sys.argv[2])
    write_summary(new_run(place))  # compiles the template once, for all children
    undisturbed = tell(place, None)
    print(json.dumps(undisturbed), flush=True)  # noqa: T201 - the test reads it
    for last in range(1, undisturbed["points"], max(1, undisturbed["points"] // wanted)):
        print(json.dumps(tell(place, last)), flush=True)  # noqa: T201
