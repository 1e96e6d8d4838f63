"""Runs with a model that asks within a budget, that is replayed, and whose Designer first says nothing of use."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest
from killing import AskingTeam

import aidsr
from aidsr.apps.cli import main
from aidsr.core.artifacts import Outcome
from aidsr.core.calls import CallRecord, Message, Question, Usage
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import BudgetError, ModelError, ReplyError, UserError
from aidsr.core.roles import Team
from aidsr.loop.budget import Budgeted, Ledger, check_prices
from aidsr.loop.estimate import estimate
from aidsr.loop.human import approve
from aidsr.loop.parts import Parts
from aidsr.loop.run import parts_of, replace_budget, resume
from aidsr.loop.runner import run_designs
from aidsr.loop.teams import price_of
from aidsr.runs import EventLog, RecordedModel, Run, read_status
from aidsr.runs.answered_calls import set_calls_aside
from aidsr.teams.providers import absolute_name, price_usd
from aidsr.teams.providers.replay import ReplayedModel
from aidsr.teams.providers.tokens import estimate_tokens
from loopback import Act, Fail, Loopback, Received
from scripted import assemble, brief, new_run, repair, validate


def price(input_tokens: int, output_tokens: int) -> float:
    return 1e-4 * (input_tokens + output_tokens)


class Paid:
    """Answers with the number of the question, at 10 tokens and list price."""

    name = "paid"

    def __init__(self) -> None:
        self.count = 0

    def ask(self, question: Question) -> CallRecord:
        self.count += 1
        tokens = estimate_tokens(question.messages[0].text)
        usage = Usage(calls=1, input_tokens=tokens, output_tokens=10, cost_usd=price(tokens, 10))
        return CallRecord(
            question=question, model=self.name, reply=str(self.count), finish="stop", usage=usage, started="2026"
        )


def parts(team_for: Callable[[Path], Team]) -> Parts:
    return Parts(team_for, repair, validate, assemble, str.encode, str.encode, approve)


def asking(model_for: Callable[[Path], object]) -> Parts:
    def team(folder: Path) -> Team:
        roles = AskingTeam(RecordedModel(model_for(folder), folder))
        return Team(designer=roles, coder=roles, integrator=roles, judge=roles)

    return parts(team)


def always(model: object) -> Callable[[Path], object]:
    return lambda _folder: model


def within(run: Run, model: object) -> Parts:
    ledger = Ledger(run, run.budget(), run.asked().config.concepts, price)
    return asking(lambda folder: _Capped(Budgeted(model, ledger, folder)))


class _Capped:
    name = "paid"

    def __init__(self, model: Budgeted) -> None:
        self.model = model

    def ask(self, question: Question) -> CallRecord:
        return self.model.ask(question.model_copy(update={"max_output_tokens": 20}))


def question(text: str, role="coder", cap: int = 20) -> Question:
    return Question(role=role, messages=(Message(role="user", text=text),), max_output_tokens=cap)


@pytest.mark.parametrize(
    "budget",
    [Budget(tokens=150), Budget(cost_usd=0.015), Budget(tokens_per_design=70), Budget(cost_per_design_usd=0.007)],
)
def test_a_run_out_of_budget_ends_as_that_and_goes_on_with_a_larger_one(tmp_path: Path, budget: Budget) -> None:
    run, model = new_run(tmp_path, concepts=2, budget=budget), Paid()
    status = read_status(run_designs(run, within(run, model)))
    assert status.state == "finished"
    assert {design.outcome.outcome for design in status.designs} == {"out_of_budget"}
    assert "next call could" in status.designs[0].outcome.reason
    assert status.usage.calls == model.count < 14
    assert status.usage.input_tokens + status.usage.output_tokens <= (budget.tokens or 10_000)
    assert status.usage.cost_usd <= (budget.cost_usd or 10)
    asked_before = model.count
    run.larger_budget.write_text(Budget(tokens=10**6).model_dump_json())
    for design in run.designs:
        design.reopen()
    after = read_status(run_designs(run, within(run, model)))
    assert [design.outcome.outcome for design in after.designs] == ["approved", "approved"]
    assert after.usage.calls == model.count > asked_before
    assert (run.path / "designs" / "1" / "outcome_before_1.json").exists()


ENDINGS = {
    "cheap": "it was answered: 2",
    "as dear as it may be": "$0.0120 is spent",
    "failed": "it was answered: 1",
    "interrupted": "it was answered: 1",
    "asked to stop": "interrupted before the call was made",
}
"""What becomes of a call in flight, and of one for which there is no room beside it."""


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_call_without_room_beside_one_in_flight_waits_until_that_has_ended(tmp_path: Path, ending: str) -> None:
    run, both_asked, paid = new_run(tmp_path), threading.Event(), Paid()
    threads: set[int] = set()

    def watched_price(input_tokens: int, output_tokens: int) -> float:
        """Tell once two threads hold the ledger to ask; it lets the first one's call end only when the other waits."""
        threads.add(threading.get_ident())
        if len(threads) == 2:
            both_asked.set()
        return price(input_tokens, output_tokens)

    ledger = Ledger(run, Budget(cost_usd=0.0239), 1, watched_price)
    asked = question("x" * 300)
    assert price(estimate_tokens("x" * 300), 20) == pytest.approx(0.012)

    class InFlight(Paid):
        def ask(self, question: Question) -> CallRecord:
            second.append(pool.submit(ledger.ask, paid, run.path / "designs" / "2" / "01", asked))
            assert both_asked.wait(20)
            match ending:
                case "failed":
                    raise ModelError("no reply")
                case "interrupted":
                    raise KeyboardInterrupt
                case "asked to stop":
                    ledger.interrupt()
                    with pytest.raises(ModelError, match="interrupted"):
                        second[0].result(timeout=20)
            record = paid.ask(question)
            dear = record.usage.model_copy(update={"cost_usd": 0.012})
            return record.model_copy(update={"usage": dear}) if ending.startswith("as dear") else record

    second: list[Future[CallRecord]] = []
    with ThreadPoolExecutor(1) as pool:
        try:
            with suppress(ModelError, KeyboardInterrupt):
                ledger.ask(InFlight(), run.path / "designs" / "1" / "01", asked)
            error = second[0].exception(timeout=20)
        finally:
            ledger.interrupt()
    assert ENDINGS[ending] in (str(error) if error else f"it was answered: {second[0].result().reply}")


def test_asking_a_run_to_stop_reaches_calls_that_wait_for_each_other(tmp_path: Path) -> None:
    told: list[str] = []

    def answer(_: Received) -> Act:
        """Ask while a call is in flight, of a run that was asked to stop."""
        parts.interrupt()
        thread = threading.Thread(target=ask_too, daemon=True)
        thread.start()
        thread.join(20)
        return Fail(400)

    def ask_too() -> None:
        try:
            parts.team_for(run.design(2).iteration(1).path).designer.propose(brief(), 1)
        except ModelError as error:
            told.append(str(error))

    with Loopback(answer) as server:
        run = new_run(tmp_path, model=f"m@{server.url}/v1", max_output_tokens=100_000, budget=Budget(tokens=150_000))
        parts = parts_of(run)
        with pytest.raises(ModelError, match="HTTP 400"):
            parts.team_for(run.path).designer.propose(brief(), 1)
    assert told == ["interrupted before the call was made"]


@pytest.mark.parametrize("budget", [Budget(), Budget(tokens=1)])
def test_no_call_begins_after_a_run_was_asked_to_stop(tmp_path: Path, budget: Budget) -> None:
    run, model = new_run(tmp_path, budget=budget), Paid()
    ledger = Ledger(run, budget, 1, price)
    ledger.interrupt()
    with pytest.raises(ModelError, match="interrupted before the call was made"):
        ledger.ask(model, run.design(1).iteration(1).path, question("one"))
    assert model.count == 0


class Unpriced(Paid):
    """Does not say what its answers cost."""

    def ask(self, question: Question) -> CallRecord:
        record = super().ask(question)
        return record.model_copy(update={"usage": record.usage.model_copy(update={"cost_usd": None})})


def test_a_call_without_a_price_is_still_paid_when_a_run_goes_on(tmp_path: Path) -> None:
    run = new_run(tmp_path)

    def ask(text: str) -> None:
        """Ask as a new process would."""
        ledger = Ledger(run, Budget(cost_usd=0.025), 1, price)
        RecordedModel(Budgeted(Unpriced(), ledger, run.path), run.path).ask(question(text))

    ask("a" * 300)
    ask("b" * 300)
    with pytest.raises(BudgetError, match=r"\$0\.0220 is spent"):
        ask("c" * 300)


def test_money_cannot_be_limited_where_no_price_is_known() -> None:
    check_prices(Budget(tokens=1), "m", lambda _in, _out: None)
    with pytest.raises(UserError, match='price of "m" is unknown'):
        check_prices(Budget(cost_per_design_usd=1), "m", lambda _in, _out: None)


def test_a_reserved_price_includes_writing_the_prompt_to_the_cache() -> None:
    """Anthropic's price of a prompt that is cached is 1.25 times the other; OpenAI's is the same."""
    for name, surcharge in (("anthropic:claude-sonnet-4-5", 1.25), ("openai:gpt-4o", 1.0)):
        plain = price_usd(name, 100_000, 0, environ={})
        assert plain is not None
        assert price_of(name)(100_000, 0) == pytest.approx(surcharge * plain)


def test_a_larger_budget_needs_a_known_price_too(tmp_path: Path) -> None:
    run = new_run(tmp_path, model=f"manual:{tmp_path / 'p'}")
    with pytest.raises(UserError, match="is unknown"):
        replace_budget(run, Budget(cost_usd=5))
    replace_budget(run, Budget(tokens=5))
    assert run.budget() == Budget(tokens=5)


def test_a_run_at_work_is_given_no_other_budget(tmp_path: Path) -> None:
    run = new_run(tmp_path, budget=Budget(tokens=60))
    run.design(1).outcome.write(Outcome(outcome="out_of_budget", reason="60 tokens", iteration=1))
    with EventLog(run.events), pytest.raises(UserError, match="another process is at work"):
        replace_budget(run, Budget(tokens=10**6))
    assert run.budget() == Budget(tokens=60)
    assert run.design(1).outcome.read() is not None
    replace_budget(run, Budget(tokens=10**6))
    assert run.budget() == Budget(tokens=10**6)
    assert run.design(1).outcome.read() is None


def test_a_run_whose_price_is_no_longer_known_does_not_go_on(tmp_path: Path) -> None:
    run = new_run(tmp_path, model="m@http://localhost:1/v1")
    run.larger_budget.write_text(Budget(cost_usd=5).model_dump_json())
    with pytest.raises(UserError, match="is unknown, so a cost limit cannot be enforced"):
        parts_of(run)


def test_a_run_replays_itself_free_and_to_the_same_files(tmp_path: Path) -> None:
    first = run_designs(new_run(tmp_path / "a", concepts=2), asking(always(Paid())))
    replayed = ReplayedModel(first.path)
    second = run_designs(new_run(tmp_path / "b", concepts=2), asking(lambda _folder: replayed))
    for design in (1, 2):
        assert second.design(design).final_robot.read() == first.design(design).final_robot.read() is not None
    usage = read_status(second).usage
    assert usage.cost_usd == 0
    assert usage.replayed_cost_usd == pytest.approx(read_status(first).usage.cost_usd)


def test_a_changed_prompt_is_told_with_its_difference_and_never_answered(tmp_path: Path) -> None:
    run = new_run(tmp_path)
    kept = RecordedModel(Paid(), run.path)
    for text in ("one\ntwo\nthree", "something else", "one\ntwo\nthree"):
        kept.ask(question(text))
    model = ReplayedModel(run.path)
    assert [model.ask(question(text, cap=9)).reply for text in ("something else", "one\ntwo\nthree")] == ["2", "1"]
    with pytest.raises(ModelError, match="differs from every one") as caught:
        model.ask(question("one\n2\nthree"))
    assert {"-two", "+2"} <= set(str(caught.value).splitlines())
    assert model.ask(question("one\ntwo\nthree")).reply == "3"
    with pytest.raises(ModelError, match="no more replies to this question"):
        model.ask(question("one\ntwo\nthree"))
    with pytest.raises(ModelError, match="no call of the judge"):
        model.ask(question("one", "judge"))


def test_replies_that_were_set_aside_are_not_replayed(tmp_path: Path) -> None:
    run, model = new_run(tmp_path), Paid()
    RecordedModel(model, run.path).ask(question("concepts?"))
    set_calls_aside(run.path)
    RecordedModel(model, run.path).ask(question("concepts?"))
    assert ReplayedModel(run.path).ask(question("concepts?")).reply == "2"


def test_a_replay_that_goes_on_gets_each_reply_once(tmp_path: Path) -> None:
    recorded, model = new_run(tmp_path / "a"), Paid()
    for number in (1, 2):
        RecordedModel(model, recorded.design(number).iteration(1).path).ask(question("same"))
    run = new_run(tmp_path / "b", model=f"replay:{recorded.path}")
    first, second = (run.design(number).iteration(1).path for number in (1, 2))
    assert RecordedModel(ReplayedModel(recorded.path), first).ask(question("same")).reply == "1"
    resumed = ReplayedModel(recorded.path)
    resumed.leave_out_replies_in(run)
    assert RecordedModel(resumed, first).ask(question("same")).reply == "1"
    assert RecordedModel(resumed, second).ask(question("same")).reply == "2"
    with pytest.raises(ModelError, match="no more replies to this question"):
        resumed.ask(question("same"))


@pytest.mark.parametrize(
    "begin",
    [
        lambda name: aidsr.design(task="button_pushing", model=name),
        lambda name: main(["design", "--task", "button_pushing", "--model", name]),
    ],
)
def test_a_run_goes_on_from_another_directory_with_the_same_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begin: Callable[[str], object]
) -> None:
    earlier = new_run(tmp_path / "earlier")
    RecordedModel(Paid(), earlier.path).ask(question("one"))
    monkeypatch.chdir(tmp_path)
    with pytest.raises((ModelError, SystemExit)):
        begin(f"replay:earlier/{earlier.path.name}")
    (record,) = tmp_path.glob("runs/*/run.json")
    monkeypatch.chdir(tmp_path / "earlier")
    with pytest.raises(ModelError, match="no call of the designer"):
        resume(record.parent)


@pytest.mark.parametrize("name", ["builtin", "openai:gpt-5", "m@http://localhost:8000/v1", "manual:", "manual:/there"])
def test_a_model_without_a_relative_folder_keeps_its_name(name: str) -> None:
    assert absolute_name(name) == name
    assert absolute_name("manual:letters") == f"manual:{Path.cwd() / 'letters'}"


def test_a_run_without_calls_cannot_be_replayed(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no calls to replay"):
        ReplayedModel(new_run(tmp_path).path)


def test_a_designer_whose_replies_were_unusable_is_asked_anew_after_resuming(tmp_path: Path) -> None:
    run, model = new_run(tmp_path), Paid()

    class Mumbling(AskingTeam):
        def propose(self, brief, count):
            if int(self.model.ask(question("concepts?", "designer")).reply) == 1:
                raise ReplyError("No usable reply.")
            return super().propose(brief, count)

    def team(folder: Path) -> Team:
        roles = Mumbling(RecordedModel(model, folder))
        return Team(designer=roles, coder=roles, integrator=roles, judge=roles)

    with pytest.raises(ReplyError, match="ask the Designer again"):
        run_designs(run, parts(team))
    status = read_status(run_designs(run, parts(team)))
    assert status.approved == 1
    assert sorted(path.name for path in (run.path / "calls").iterdir()) == [
        "0001_designer.unusable.json",
        "0002_designer.json",
        "0003_designer.json",
    ]
    assert status.usage.calls == model.count


def test_estimates_say_what_they_rest_on(tmp_path: Path) -> None:
    config = RunConfig(model="anthropic:claude-sonnet-5-5", concepts=2)
    guess = estimate(config, tmp_path)
    assert guess.usage.calls == 12
    assert guess.usage.cost_usd > 0
    assert "rule of thumb" in guess.basis
    run = run_designs(new_run(tmp_path, concepts=2), asking(always(Paid())))
    record = json.loads(run.record.path.read_text())
    record["config"]["model"] = config.model
    run.record.path.write_text(json.dumps(record))
    found = estimate(config, tmp_path)
    assert found.usage.calls == read_status(run).usage.calls
    assert "the mean of 2 earlier designs" in found.basis
    assert estimate(RunConfig(), tmp_path).usage.calls == 0
    measuring = estimate(config.updated({"team": "measuring"}), tmp_path)
    assert "8 calls per design" in measuring.basis, "designs of another team say nothing of its cost"
    assert measuring.usage.input_tokens == 73_000 * config.concepts
