"""Whether a reply that a provider was paid for is ever lost: faults of every kind, and kill -9, against a real server.

    PYTHONPATH=tests python tests/loop/losing.py --faults 200 --kills 50

A reply counts as paid when the server sent it to its last byte. It is lost when no file of the run holds it. Only the
language model's server, the validator and the pictures are stand-ins; provider client, retries, agents, loop and run
folder are the real ones.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import signal
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from killing import AskingTeam, Life

from aidsr.core.artifacts import EnvironmentSummary, MountSummary, Scene, ValidationReport
from aidsr.core.calls import CallRecord, Question
from aidsr.core.config import RunConfig
from aidsr.core.errors import AidsrError, MjcfError
from aidsr.core.roles import Team
from aidsr.loop.human import approve
from aidsr.loop.parts import Parts
from aidsr.loop.run import create_run, parts_of
from aidsr.loop.runner import run_designs
from aidsr.mjcf.read import parse_document
from aidsr.runs import RecordedModel, Run, read_status
from aidsr.teams.providers import RetryPolicy, connect
from loopback import Act, Cut, Drop, Fail, Hang, Loopback, Raw, Received, Say
from scripted import PNG, assemble, brief, new_run, repair, validate

FORKS = multiprocessing.get_context("forkserver")
FORKS.set_forkserver_preload(["pydantic_ai.models.openai", "aidsr.loop.runner", "aidsr.fixes"])

RETRY = RetryPolicy(first_wait_s=0.0, longest_wait_s=0.0, attempt_timeout_s=20.0)
TOKENS_A_REPLY = 120
ROBOT = (
    '<mujoco><worldbody><body name="base"><geom size="0.01"/><site name="tip" pos="0 0 0.1"/>'
    "</body></worldbody></mujoco>"
)
CONCEPTS = [
    {
        "name": f"{family} {place}",
        "family": family,
        "morphology": words,
        "actuation": words[::-1],
        "functional_part": "tip",
    }
    for place, (family, words) in enumerate([("arm", "one long chain"), ("hand", "three fingers on a palm")])
]

BEFORE_A_REPLY: dict[str, Callable[[], Act]] = {
    "429": lambda: Fail(429, "slow down", {"Retry-After": "0"}),
    "500": lambda: Fail(500),
    "503": lambda: Fail(503, "busy"),
    "529": lambda: Fail(529, "overloaded"),
    "connection dropped": Drop,
    "no reply in time": Hang,
    "reply cut off on the wire": lambda: Cut(Say("half")),
    "bytes that are no reply": lambda: Raw(b"\x00\xff<garbage"),
    "a page of HTML": lambda: Raw(b"<html><body>Bad gateway</body></html>", "text/html"),
}
"""Faults that bring no reply; the client tries again."""
IN_A_REPLY = ("truncated", "refused", "empty", "invalid XML or JSON", "beside the point")
"""Faults of a reply that was paid for; the role asks again."""


class Faulty:
    """Plays all roles; a part of its answers are faults, every kind of them in turn and in random order."""

    def __init__(self, seed: int, share: float = 0.5) -> None:
        self.injected: Counter[str] = Counter()
        self._rng = np.random.default_rng(seed)
        self._share = share
        self._waiting: list[str] = []
        self._in_a_row = 0
        self._count = 0
        self._lock = threading.Lock()

    def __call__(self, received: Received) -> Act:
        with self._lock:
            self._count += 1
            good = Say(f"Reply {self._count}.\n{answer(received)}")
            # six attempts a call: a fifth fault in a row would say nothing new, and a seventh ends the design
            if self._in_a_row >= 4 or self._rng.random() > self._share:
                self._in_a_row = 0
                return good
            self._in_a_row += 1
            kind = self._next()
            self.injected[kind] += 1
        return BEFORE_A_REPLY[kind]() if kind in BEFORE_A_REPLY else spoilt(good, kind)

    def _next(self) -> str:
        if not self._waiting:
            kinds = [*BEFORE_A_REPLY, *IN_A_REPLY] * 3
            kinds = [kind for place, kind in enumerate(kinds) if kind != "no reply in time" or place < len(kinds) / 3]
            self._waiting = [str(kind) for kind in self._rng.permutation(kinds)]
        return self._waiting.pop()


def spoilt(good: Say, kind: str) -> Say:
    """Return a reply with a fault."""
    match kind:
        case "truncated":
            return replace(good, text=good.text[: len(good.text) // 2], finish="length")
        case "refused":
            return replace(good, text=good.text.split("\n")[0] + " I cannot help with that.", finish="refusal")
        case "empty":
            return replace(good, text="")
        case "invalid XML or JSON":
            return replace(good, text=good.text.replace('"', "", 1).replace("</body>", "", 1))
        case _:
            return replace(good, text=good.text.split("\n")[0] + " It is a nice day for tendons.")


def answer(received: Received) -> str:
    """Return what a good model answers; every first robot is sent back by the validator."""
    system, *turns = [turn["content"] for turn in received.body["messages"]]
    role = system.split("\n", 1)[0]
    if "Designer" in role:
        return json.dumps({"interpretation": "Reach.", "concepts": CONCEPTS})
    if "Integrator" in role:
        return '{"mount": "mount", "base": "fixed", "reason": "It hangs."}'
    if "Judge" in role:
        return '{"passed": true, "summary": "It can reach."}'
    name = "mended" if "What is wrong" in turns[0] else "first"
    return f'{{"functional_part": "tip"}}\n```xml\n{ROBOT.replace("base", name)}\n```'


def looked_at(mjcf: str, **_: object) -> ValidationReport:
    """Report what cannot be read, and that a first robot chatters."""
    try:
        parse_document(mjcf)
    except MjcfError as error:
        return ValidationReport(stable=False, faults=error.faults)
    return validate("faults='chatter'" if '"first"' in mjcf else "faults='ok'")


def placed(robot, environment, placement) -> Scene:
    return Scene(mjcf=robot.mjcf, placement=placement)


def calls(run: Run) -> list:
    """Return all calls of a run, those with unusable replies included."""
    return [*run.calls, *(call for design in run.designs for it in design.iterations for call in it.calls)]


# --- faults ----------------------------------------------------------------------------------------------------------


def designed(folder: Path, url: str) -> None:
    """Make a run and work on it until it is finished, resuming it where the Designer gave up."""
    os.environ |= {f"AIDSR_{name}".upper(): str(value) for name, value in RETRY.model_dump().items()}
    mount = MountSummary(name="mount", position_m=(0, 0, 0), z_axis=(0, 0, 1), x_axis=(1, 0, 0), moved_by=())
    job = brief().model_copy(update={"summary": brief().summary.model_copy(update={"mounts": (mount,)})})
    assert isinstance(job.summary, EnvironmentSummary)
    run = create_run(job, RunConfig(model=f"loop@{url}/v1", concepts=2), runs=folder)
    stand_ins = {"validate": looked_at, "assemble": placed, "picture": lambda _: PNG, "filmstrip": lambda _: PNG}
    for _ in range(10):
        with suppress(AidsrError):
            run_designs(run, replace(parts_of(run), **stand_ins))
        if read_status(run).state == "finished":
            return


def with_faults(folder: Path, wanted: int, seed: int = 1) -> dict[str, Any]:
    """Make runs until so many faults were injected, and account for every reply."""
    faulty, runs = Faulty(seed), 0
    with Loopback(faulty) as server:
        while faulty.injected.total() < wanted:
            runs += 1
            child = FORKS.Process(target=designed, args=(folder / str(runs), server.url))
            child.start()
            child.join()
    found = [Run(path.parent) for path in sorted(folder.glob("*/*/run.json"))]
    kept = [call for run in found for call in calls(run)]
    paid, recorded = Counter(server.sent), Counter(call.reply for call in kept)
    return {
        "runs": runs,
        "finished": sum(read_status(run).state == "finished" for run in found),
        "approved": sum(read_status(run).approved for run in found),
        "designs": 2 * runs,
        "injected": dict(faulty.injected),
        "paid": paid.total(),
        "lost": (paid - recorded).total(),
        "never_sent": (recorded - paid).total(),
        "without_a_reply": sum(faulty.injected[kind] for kind in BEFORE_A_REPLY),
        "failed_attempts": sum(len(call.failed_attempts) for call in kept),
        "tokens_paid": TOKENS_A_REPLY * paid.total(),
        "tokens_recorded": sum(call.usage.input_tokens + call.usage.output_tokens for call in kept),
    }


# --- kill -9 ---------------------------------------------------------------------------------------------------------


class Asking(Life):
    """A life that marks every point as "c" while a call is under way, from its question to its file."""

    calls = 0

    def pass_point(self, kind: bytes = b".") -> None:
        super().pass_point(b"c" if self.calls else kind)


class Watched(RecordedModel):
    """The recording model, which tells when it is asking."""

    life: Asking

    def ask(self, question: Question) -> CallRecord:
        self.life.calls += 1
        try:
            return super().ask(question)
        finally:
            self.life.calls -= 1


def live(run: Path, url: str, last: int | None) -> None:
    """Work on a run; end at a point of the interpreter, if one is given."""
    life = Asking(last, run)
    Watched.life = life
    sys.addaudithook(life.watch)
    model = connect(f"loop@{url}/v1", retry=RETRY)

    def team(folder: Path) -> Team:
        roles = AskingTeam(Watched(model, folder))
        return Team(designer=roles, coder=roles, integrator=roles, judge=roles)

    run_designs(Run(run), Parts(team, repair, validate, assemble, str.encode, str.encode, approve))


class Killer:
    """Answers, with a fault before every third reply, and kills who asks at one request: before or amid the reply."""

    def __init__(self, at: int | None = None, amid: bool = False) -> None:
        self.victim = 0
        self.requests = 0
        self._at, self._amid = at, amid

    def __call__(self, received: Received) -> Act:
        self.requests += 1
        reply = Say(f"reply {self.requests}")
        if self.requests == self._at:
            if self._amid:
                return Cut(reply, self._kill)
            self._kill()
            return Drop()
        return Fail(503) if self.requests % 3 == 2 else reply

    def _kill(self) -> None:
        os.kill(self.victim, signal.SIGKILL)


def told(folder: Path, killer: Killer, last: int | None) -> dict[str, Any]:
    """One story: killed, resumed, and every reply accounted for."""
    run = new_run(folder, concepts=1)
    with Loopback(killer) as server:
        ends, marks = [], list[str]()
        for point in (last, None):
            child = FORKS.Process(target=live, args=(run.path, server.url, point))
            child.start()
            killer.victim = child.pid
            child.join()
            ends.append(child.exitcode)
            marks.append(run.path.with_suffix(".points").read_text())
    paid, recorded = Counter(server.sent), Counter(call.reply for call in calls(run))
    return {
        "ends": ends,
        "points": marks[0],
        "requests": killer.requests,
        "finished": read_status(run).state == "finished",
        "paid": paid.total(),
        "lost": (paid - recorded).total(),
        "never_sent": (recorded - paid).total(),
    }


def with_kills(folder: Path, wanted: int) -> dict[str, Any]:
    """Kill runs at points spread evenly over a run's life; those in the instant of writing a reply are told apart."""
    undisturbed = told(folder, Killer(), None)
    marks, requests = undisturbed["points"], undisturbed["requests"]
    points = [place for place, mark in enumerate(marks, start=1) if mark == "."]
    instants = [place for place, mark in enumerate(marks, start=1) if mark == "c"]
    at_requests = [(request, amid) for request in range(1, requests + 1) for amid in (False, True)]
    at_points = [*spread(points, wanted - wanted // 3), *spread(instants, max(2, wanted // 5))]
    killed = [told(folder, Killer(*where), None) for where in spread(at_requests, wanted // 3)]
    writing = list[dict[str, Any]]()
    for last in at_points:
        story = told(folder, Killer(), last)
        # threads share the counting, so what was under way is read from the life that was ended
        (writing if story["points"].endswith("c") else killed).append(story)
    return {"undisturbed": undisturbed, "killed": killed, "writing_a_reply": writing}


def spread(values: Sequence, wanted: int) -> Iterator:
    """Yield so many of the values, evenly spread."""
    return (values[index] for index in np.linspace(0, len(values) - 1, min(wanted, len(values))).round().astype(int))


def account(faults: dict[str, Any], kills: dict[str, Any]) -> str:
    """Return what was found, as Markdown."""
    killed, writing = kills["killed"], kills["writing_a_reply"]
    kinds = "\n".join(f"| {kind} | {number} |" for kind, number in sorted(faults["injected"].items()))
    finished, paid, lost = (total(killed, what) for what in ("finished", "paid", "lost"))
    return f"""\
| fault | injected |
|---|---:|
{kinds}
| **in all** | **{sum(faults["injected"].values())}** |

- Faults: {faults["runs"]} runs, {faults["finished"]} finished; {faults["approved"]} of {faults["designs"]} designs
  approved. {faults["paid"]} replies paid for, **{faults["lost"]} lost**. {faults["without_a_reply"]} faults brought no
  reply, and {faults["failed_attempts"]} failed attempts are on record. {faults["tokens_paid"]:,} tokens paid, and
  {faults["tokens_recorded"]:,} in the accounts.
- kill -9 and resume: {len(killed)} runs, {finished} finished; {paid} replies paid for, **{lost} lost**.
- kill -9 on purpose between a question and the file of its reply: {len(writing)} runs, {total(writing, "finished")}
  finished; {total(writing, "paid")} replies paid for, {total(writing, "lost")} lost, one call in flight a kill at most.
"""


def total(stories: list[dict[str, Any]], what: str) -> int:
    return sum(int(story[what]) for story in stories)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faults", type=int, default=200)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        faults = with_faults(Path(place) / "faults", options.faults)
        kills = with_kills(Path(place) / "kills", options.kills)
    print(json.dumps({"faults": faults, "kills": kills}) if options.json else account(faults, kills))  # noqa: T201


if __name__ == "__main__":
    main()
