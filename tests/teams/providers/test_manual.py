"""A person as the model: every question a file, every reply a file, nothing asked twice and nothing lost."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from aidsr.core.calls import CallRecord, Message, Question
from aidsr.core.errors import ModelError, UserError
from aidsr.teams.providers import ManualModel, connect
from aidsr.teams.providers.manual import pending_prompts
from aidsr.teams.providers.tokens import estimate_tokens

NO_PROC = {"condition": not Path("/proc/self").is_dir(), "reason": "needs a directory that nobody can write"}


def question(text: str, role="coder") -> Question:
    turns = (("system", "You write robots."), ("user", "First."), ("assistant", "A try."), ("user", text))
    return Question(role=role, messages=tuple(Message(role=who, text=words) for who, words in turns))


def model(directory: Path) -> ManualModel:
    return ManualModel(directory, poll_s=0.002, settled_s=0.0)


def until_waiting(directory: Path, count: int) -> tuple:
    end = time.monotonic() + 20
    while len(found := pending_prompts(directory)) < count:
        assert time.monotonic() < end, "no prompt came"
        time.sleep(0.002)
    return found


def asked(manual: ManualModel, *questions: Question, replies: list[str]) -> list[CallRecord]:
    """Ask all at once, and answer each prompt, in the order of its number, with the next reply."""
    with ThreadPoolExecutor(max_workers=len(questions)) as pool:
        records = [pool.submit(manual.ask, each) for each in questions]
        directory = Path(manual.name.removeprefix("manual:"))
        for waiting, reply in zip(until_waiting(directory, len(questions)), replies, strict=True):
            waiting.reply.write_text(reply, encoding="utf-8")
        return [record.result(timeout=20) for record in records]


def test_a_prompt_holds_every_word_and_says_what_to_do(tmp_path: Path) -> None:
    asked(model(tmp_path), question("Make it 20 µm thick."), replies=["ok"])
    text = (tmp_path / "0001.prompt.md").read_text(encoding="utf-8")
    places = [text.index(words) for words in ("You write robots.", "First.", "A try.", "Make it 20 µm thick.")]
    assert places == sorted(places)
    assert "0001.reply.md" in text
    assert "20000 tokens" in text


def test_the_reply_is_the_file_with_estimated_tokens_and_no_price(tmp_path: Path) -> None:
    (record,) = asked(model(tmp_path), question("x"), replies=["µ" * 9])
    assert (record.reply, record.finish, record.question) == ("µ" * 9, "stop", question("x"))
    assert record.usage.tokens_estimated
    assert record.usage.output_tokens == 18 / 3
    assert record.usage.input_tokens == estimate_tokens("You write robots.\nFirst.\nA try.\nx")
    assert record.usage.cost_usd is None, "nobody knows what the person's product costs"


def test_several_wait_at_once_with_numbers_of_their_own(tmp_path: Path) -> None:
    questions = [question(str(number)) for number in range(8)]
    records = asked(model(tmp_path), *questions, replies=list("abcdefgh"))
    assert sorted(path.name for path in tmp_path.glob("*.prompt.md")) == [f"{n:04d}.prompt.md" for n in range(1, 9)]
    assert sorted(record.reply for record in records) == list("abcdefgh")
    for record in records:
        number = "abcdefgh".index(record.reply) + 1
        prompt = (tmp_path / f"{number:04d}.prompt.md").read_text()
        assert prompt.endswith(f"\n\n{record.question.messages[-1].text}\n"), "each reply went to its own question"


def test_identical_questions_are_asked_each(tmp_path: Path) -> None:
    records = asked(model(tmp_path), question("same"), question("same"), replies=["one", "two"])
    assert sorted(record.reply for record in records) == ["one", "two"]


@pytest.mark.parametrize("answered_meanwhile", [True, False])
def test_a_waiting_prompt_is_found_again_by_a_new_process(tmp_path: Path, answered_meanwhile: bool) -> None:
    first = model(tmp_path)
    with ThreadPoolExecutor() as pool:
        lost = pool.submit(first.ask, question("x"))
        (waiting,) = until_waiting(tmp_path, 1)
        first.interrupt()
        with pytest.raises(ModelError, match="interrupted while"):
            lost.result(timeout=20)
    if answered_meanwhile:
        waiting.reply.write_text("late")
        assert model(tmp_path).ask(question("x")).reply == "late"
    else:
        (record,) = asked(model(tmp_path), question("x"), replies=["later"])
        assert record.reply == "later"
    assert [path.name for path in tmp_path.glob("*.prompt.md")] == ["0001.prompt.md"]


def test_a_reply_that_is_kept_answers_no_second_question(tmp_path: Path) -> None:
    first = model(tmp_path)
    (record,) = asked(first, question("x"), replies=["one"])
    first.interrupt()
    second = model(tmp_path)
    assert second.ask(question("x")).reply == "one", "taken but never recorded: it is not lost"
    second.interrupt()
    first.mark_recorded(record)
    (again,) = asked(model(tmp_path), question("x"), replies=["two"])
    assert again.reply == "two"
    assert (tmp_path / "0002.prompt.md").exists()


def test_a_reply_that_still_grows_or_is_empty_is_not_taken(tmp_path: Path) -> None:
    manual = ManualModel(tmp_path, poll_s=0.002, settled_s=3600.0)
    with ThreadPoolExecutor() as pool:
        record = pool.submit(manual.ask, question("x"))
        (waiting,) = until_waiting(tmp_path, 1)
        waiting.reply.write_text("   \n")
        os.utime(waiting.reply, (1, 1))
        waiting.reply.with_suffix(".new").write_text("ha")
        time.sleep(0.02)
        assert not record.done()
        waiting.reply.with_suffix(".new").replace(waiting.reply)
        time.sleep(0.02)
        assert not record.done(), "written an instant ago"
        waiting.reply.write_text("half and half")
        os.utime(waiting.reply, (1, 1))
        assert record.result(timeout=20).reply == "half and half"


def test_latency_is_from_the_prompt_to_the_reply(tmp_path: Path) -> None:
    manual = model(tmp_path)
    with ThreadPoolExecutor() as pool:
        record = pool.submit(manual.ask, question("x"))
        (waiting,) = until_waiting(tmp_path, 1)
        os.utime(waiting.prompt, (1000, 1000))
        draft = tmp_path / "draft"
        draft.write_text("ok")
        os.utime(draft, (1090, 1090))
        draft.replace(waiting.reply)
        assert record.result(timeout=20).usage.latency_s == 90
        assert record.result().started == "1970-01-01T00:16:40.000+00:00"


def test_a_reply_that_is_no_text_is_said(tmp_path: Path) -> None:
    with ThreadPoolExecutor() as pool:
        record = pool.submit(model(tmp_path).ask, question("x"))
        (waiting,) = until_waiting(tmp_path, 1)
        waiting.reply.write_bytes(b"\xff\xfe\x00")
        with pytest.raises(UserError, match="UTF-8"):
            record.result(timeout=20)


def test_nothing_is_written_before_the_first_question(tmp_path: Path) -> None:
    assert connect(f"manual:{tmp_path / 'new'}").name == f"manual:{tmp_path / 'new'}"
    assert not (tmp_path / "new").exists()
    assert pending_prompts(tmp_path / "new") == ()


def test_a_name_without_a_directory_is_refused() -> None:
    with pytest.raises(UserError, match="lacks the directory"):
        connect("manual:")


def test_a_directory_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="name another directory"):
        model(tmp_path / "file").ask(question("x"))


@pytest.mark.parametrize("place", ["file", pytest.param("/proc", marks=pytest.mark.skipif(**NO_PROC))])
def test_a_directory_that_cannot_be_written_is_said_before_a_run_is_made(tmp_path: Path, place: str) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"cannot write prompts into .*; name another directory"):
        model(tmp_path / place).check_available()


def test_pictures_lie_beside_the_prompt_that_names_them(tmp_path: Path) -> None:
    shown = Message(role="user", text="Look.", pictures=(b"one", b"two"))
    (record,) = asked(model(tmp_path), Question(role="judge", messages=(shown,)), replies=["seen"])
    assert [(tmp_path / f"0001.picture_{n}.png").read_bytes() for n in (1, 2)] == [b"one", b"two"]
    assert "in order: `0001.picture_1.png`, `0001.picture_2.png`" in (tmp_path / "0001.prompt.md").read_text()
    assert record.usage.input_tokens == estimate_tokens("Look.") + 2 * 1600


def test_two_live_runs_in_one_directory_are_refused(tmp_path: Path) -> None:
    first, second = model(tmp_path), model(tmp_path)
    second.check_available()
    asked(first, question("x"), replies=["one"])
    for attempt in (second.check_available, lambda: second.ask(question("y"))):
        with pytest.raises(UserError, match="is locked by another run"):
            attempt()
    assert not (tmp_path / "0002.prompt.md").exists()
    first.interrupt()
    asked(second, question("y"), replies=["two"])
    with pytest.raises(ModelError, match="interrupted before"):
        first.ask(question("z"))


def test_a_directory_whose_run_was_killed_is_free_again(tmp_path: Path) -> None:
    code = (
        "import os, sys, pathlib; from aidsr.core.directory_lock import DirectoryLock;"
        "held = DirectoryLock(pathlib.Path(sys.argv[1]));"
        "os.kill(os.getpid(), 9)"
    )
    assert subprocess.run([sys.executable, "-c", code, tmp_path], check=False).returncode == -9
    model(tmp_path).check_available()


def test_interrupting_ends_every_wait(tmp_path: Path) -> None:
    manual = model(tmp_path)
    ended: list[str] = []

    def ask(text: str) -> None:
        try:
            manual.ask(question(text))
        except ModelError as error:
            ended.append(str(error))

    threads = [threading.Thread(target=ask, args=(text,)) for text in "abc"]
    for thread in threads:
        thread.start()
    until_waiting(tmp_path, 3)
    manual.interrupt()
    for thread in threads:
        thread.join(20)
    assert len(ended) == 3
