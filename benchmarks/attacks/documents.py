"""Hostile documents and replies: mutated robots, texts that once caused a hang, models that repeat such a reply."""

from __future__ import annotations

import random
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path

import numpy as np
from benchmarks.attacks.tries import LIMIT_S, WALL_S, Outcome, contents
from benchmarks.validator.fuzz import files_read, fingerprint, make_canary, mark_unread, reads_show, seeds
from benchmarks.validator.mutation import mutate

from aidsr import RunConfig, design
from aidsr.core.calls import CallRecord, Question
from aidsr.core.errors import AidsrError
from aidsr.fixes import fix
from aidsr.runs import read_status
from aidsr.validation import validate
from foreign_texts import PIECES, Answering
from hostile_text import DOCUMENTS, REPLIES
from scenes import small_arm

_MUTATED, _ANSWERED = 120, 80


def tries(place: Path) -> Iterator[tuple[str, Callable[[], Outcome]]]:
    """Yield the name and the function of each try: 120 documents and 80 replies."""
    for name in DOCUMENTS:
        yield f"document: {name}", partial(_document, place, name, DOCUMENTS[name])
    for number in range(_MUTATED - len(DOCUMENTS)):
        yield f"document: mutation {number}", partial(_document, place, f"mutation {number}", partial(_mutated, number))
    for name in REPLIES:
        yield f"reply: {name}", partial(_reply, place, name, REPLIES[name])
    for number in range(_ANSWERED - len(REPLIES)):
        later = number % 2 == 0
        name = f"{'later ' * later}mutation {number}"
        yield f"reply: {name}", partial(_reply, place, name, partial(_answer, number), later=later)


@cache
def _seeds() -> list[str]:
    return seeds()


def _mutated(number: int) -> str:
    return mutate(_seeds(), np.random.default_rng([28, number]), _canary().as_posix())


@cache
def _canary() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="aidsr-attacks-"))
    make_canary(folder)
    return folder


def _watched(outcome: Outcome) -> dict[str, str]:
    """Return the fingerprint of the canary folder and watch for reads from now on, where the file system shows them."""
    outcome.notes["reads"] = "watched" if _reads_show() else "not seen: the file system keeps no times of access"
    before = fingerprint(_canary())
    mark_unread(_canary())
    return before


def _touched(before: dict[str, str]) -> bool:
    """Return whether a file of the canary folder was read or written since `_watched`."""
    return bool(files_read(_canary())) or fingerprint(_canary()) != before


@cache
def _reads_show() -> bool:
    return reads_show()


def _answer(number: int) -> str:
    """Return a reply that contains a robot, with pieces inserted, left out and repeated."""
    chance = random.Random(number)
    text = '```json\n{"functional_part": "tip"}\n```\n```xml\n' + small_arm() + "\n```"
    for _ in range(chance.randint(1, 6)):
        start = chance.randrange(len(text))
        left_out = chance.choice([0, 0, 3, 50, 1000])
        text = text[:start] + chance.choice(PIECES) * chance.choice([1, 1, 3, 500]) + text[start + left_out :]
    return text


@cache
def _healthy() -> str:
    """Return the validator's report on a healthy robot; no hostile document may change it."""
    return validate(small_arm()).model_dump_json()


def _document(place: Path, name: str, text_of: Callable[[], str]) -> Outcome:
    outcome = Outcome("documents", name)
    before, healthy = _watched(outcome), _healthy()
    text = text_of()
    began_s = time.process_time()
    began_wall_s = time.monotonic()
    try:
        report = validate(text)
        outcome.notes["stable"] = report.stable
        fix(text)
    except AidsrError as error:
        outcome.notes["refused"] = type(error).__name__
    except Exception as error:
        outcome.failed = f"{type(error).__name__}: {str(error)[:200]}"
    outcome.hang = _late(began_s, began_wall_s)
    if _touched(before):
        outcome.failed = "a foreign file was read or written"
    if validate(small_arm()).model_dump_json() != healthy:
        outcome.changed = "the report on a healthy robot"
    if contents(place):
        outcome.failed = "files were left in the working directory"
    return outcome


class AnsweringLater(Answering):
    """Model that answers the Designer's questions well, and all other questions with the same text."""

    def ask(self, question: Question) -> CallRecord:
        """Return the record of a call with the answer."""
        record = super().ask(question)
        return record.model_copy(update={"reply": _CONCEPT}) if question.role == "designer" else record


_CONCEPT = """```json
{"interpretation": "reach", "concepts": [{"name": "a", "family": "arm", "morphology": "x", "actuation": "y",
"functional_part": "tip"}]}
```"""


def _reply(place: Path, name: str, text_of: Callable[[], str], *, later: bool = False) -> Outcome:
    outcome = Outcome("documents", f"reply: {name}")
    before = _watched(outcome)
    folder = Path(tempfile.mkdtemp(prefix="aidsr-attacks-"))
    text = text_of()
    began_s, began_wall_s = time.process_time(), time.monotonic()
    try:
        model = AnsweringLater(text) if later else Answering(text)
        run = design(task="button_pushing", model=model, config=RunConfig(concepts=1), runs=folder)
        outcome.notes["state"] = read_status(run).state
        asked = [*run.calls, *(call for one in run.designs for it in one.iterations for call in it.calls)]
        given = {text, _CONCEPT} if later else {text}
        if not asked or any(call.reply not in given for call in asked if call.finish == "stop"):
            outcome.lost = "a reply that was given"
    except AidsrError as error:
        outcome.notes["refused"] = f"{type(error).__name__}: {str(error)[:100]}"
    except Exception as error:
        outcome.failed = f"{type(error).__name__}: {str(error)[:200]}"
    outcome.hang = _late(began_s, began_wall_s)
    if _touched(before) or contents(place):
        outcome.failed = "a foreign file was read or written"
    return outcome


def _late(began_s: float, began_wall_s: float) -> str:
    took_s, passed_s = time.process_time() - began_s, time.monotonic() - began_wall_s
    return f"{took_s:.0f} s of processor, {passed_s:.0f} s" if took_s > LIMIT_S or passed_s > WALL_S else ""
