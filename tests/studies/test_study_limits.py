"""The limit of a whole study: shared among jobs side by side, never passed, and raised to go on."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from aidsr.apps.cli import main
from aidsr.core.calls import CallRecord, Question, Usage
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import AidsrError, BudgetError, UserError
from aidsr.loop.run import make_brief
from aidsr.runs import RunRecord, new_run
from aidsr.runs.files import JsonFile
from aidsr.studies.budget import StudyBudget, check_budget, read_budget, set_budget
from aidsr.studies.jobs import Job, pending_in, run_job
from aidsr.studies.outcomes import read_outcomes
from aidsr.studies.pool import EndedJob
from aidsr.studies.runner import read_failures, run_study
from aidsr.studies.study import Arm, Cell, Study, StudyPlan, create_study, open_study
from loopback import Loopback, Received, Say

TASK = "reaching/button_pushing"
CONCEPT = {"name": "Rod", "family": "arm", "morphology": "A rod.", "actuation": "None.", "functional_part": "tip"}
ROD = '<mujoco><worldbody><body name="tip"><joint type="hinge"/><geom size="0.01"/></body></worldbody></mujoco>'


def paid(model: str = "openai:gpt-5", **changed: object) -> Arm:
    config = RunConfig(model=model, concepts=1, iterations=0, max_output_tokens=1000)
    return Arm(**{"name": "paid", "config": config, **changed})


def study_of(path: Path, *arms: Arm, runs: int = 3) -> Study:
    return create_study(
        path / "s", StudyPlan(tasks=(TASK,), arms=arms or (paid(),), runs=runs, seeds=0, protocol="best", probe=False)
    )


def designing(study: Study) -> list[Job]:
    return [Job(cell, "design") for cell in study.cells]


def pay(study: Study, cell: Cell, cost_usd: float | None) -> None:
    """Leave a run behind in which the Designer was asked once."""
    record = RunRecord(
        objective="",
        task=TASK,
        level="standard",
        config=paid().config,
        started="2026-01-31T10:02:00+00:00",
        versions={},
    )
    run = study.run(cell) or new_run(study.home(cell), record, make_brief(task=TASK))
    usage = Usage(calls=1, input_tokens=1000, output_tokens=100, cost_usd=cost_usd)
    question = Question(role="designer", messages=())
    call = CallRecord(question=question, model="gpt-5", reply="", finish="stop", usage=usage, started=record.started)
    JsonFile(run.path / "calls" / f"{len(run.calls) + 1:04d}_designer.json", CallRecord).write(call)


def test_jobs_side_by_side_set_aside_what_each_may_spend(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    one, two, three = designing(study)
    budget = StudyBudget(study, Budget(cost_usd=10))
    begun = [budget.begin(one, 2), budget.begin(two, 1)]
    assert [job.most_usd for job in begun] == [5, 5]
    assert begun == [one, two], "what a job may spend is no part of which job it is"
    assert budget.begin(three, 1) is None
    pay(study, one.cell, 4.0)
    budget.end(one, exhausted_limits=())
    assert budget.begin(three, 1).most_usd == pytest.approx(1.0)
    budget.end(two, exhausted_limits=())
    pay(study, two.cell, 0.5)
    assert StudyBudget(study, Budget(cost_usd=10)).paid_usd == pytest.approx(4.5)
    assert StudyBudget(study, Budget(cost_usd=4.5)).begin(three, 2) is None, "the limit is reached"


def test_a_share_is_as_much_as_a_run_takes_however_many_workers_there_are(tmp_path: Path) -> None:
    study = study_of(tmp_path, runs=20)
    budget = StudyBudget(study, Budget(cost_usd=10))
    shares = [job.most_usd for each in designing(study) if (job := budget.begin(each, 1000))]
    assert shares[0] == pytest.approx(0.73), "the published cost, before there is one of its own"
    assert sum(shares) <= 10
    assert len(shares) == 14
    pay(study, designing(study)[0].cell, 2.0)
    assert StudyBudget(study, Budget(cost_usd=10)).begin(designing(study)[1], 1000).most_usd == pytest.approx(2.0)


def test_a_share_that_was_too_small_for_a_call_is_not_tried_again(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    one, two, _ = designing(study)
    budget = StudyBudget(study, Budget(tokens=300_000))
    assert budget.begin(one, 2).most_tokens == 151_000
    budget.end(one, exhausted_limits=["tokens"])
    assert budget.begin(one, 2).most_tokens == 300_000
    pay(study, one.cell, 0.1)
    budget.end(one, exhausted_limits=["tokens"])
    assert budget.tokens == 1100
    assert budget.begin(two, 2).most_tokens == 298_900
    budget.end(two, exhausted_limits=["tokens"])
    assert budget.begin(two, 2) is None


def test_of_two_limits_only_the_one_that_refused_is_short(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    one, two, three = designing(study)
    budget = StudyBudget(study, Budget(cost_usd=0.73, tokens=300_000))
    assert budget.begin(one, 1).most_usd == pytest.approx(0.73)
    budget.end(one, exhausted_limits=["tokens"])
    assert budget.begin(two, 1) is None
    assert budget.refusing == {"tokens"}
    pay(study, one.cell, 0.1)
    fresh = StudyBudget(study, Budget(cost_usd=0.73, tokens=300_000))
    assert fresh.begin(two, 2).most_usd == pytest.approx(0.365, abs=0.1)
    fresh.end(two, exhausted_limits=["tokens"])
    again = fresh.begin(three, 1)
    assert again is not None, "money was never short"
    assert again.most_tokens == 298_900
    assert fresh.refusing == set()


def test_a_refusal_names_each_limit_that_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "never-used")
    study = study_of(tmp_path, runs=2)
    one, two = designing(study)
    for job, limits in (
        (replace(one, most_tokens=10, most_usd=10.0), ("tokens",)),
        (replace(two, most_tokens=10, most_usd=1e-6), ("tokens", "cost_usd")),
    ):
        with pytest.raises(BudgetError) as refused:
            run_job(study.path, job)
        assert refused.value.limits == limits
        assert ("may use 10 tokens" in str(refused.value), "may cost $" in str(refused.value)) == (
            True,
            "cost_usd" in limits,
        )


def test_only_what_asks_a_language_model_needs_money(tmp_path: Path) -> None:
    rules = Arm(name="rules", config=RunConfig(concepts=1))
    again = paid(name="again", after="paid", feedback={TASK: "Longer."})
    study = study_of(tmp_path, paid(), again, paid(name="alone", after="paid", grouping="off"), rules, runs=1)
    first, second, free, rule = designing(study)
    pay(study, first.cell, 1.0)
    pay(study, second.cell, 1.0)  # the copied call
    pay(study, second.cell, 0.25)
    budget = StudyBudget(study, Budget(cost_usd=1.25))
    assert budget.paid_usd == pytest.approx(1.25), "what was copied was paid once"
    assert budget.begin(second, 1) is None
    assert budget.begin(free, 1) is free
    assert budget.begin(rule, 1) is rule
    assert budget.begin(Job(first.cell, "train", 1), 1) == Job(first.cell, "train", 1)


def test_a_call_without_a_price_counts_at_list_prices(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    cell = next(study.cells)
    pay(study, cell, None)
    listed = StudyBudget(study, Budget(cost_usd=1)).paid_usd
    assert 0 < listed < 0.1
    pay(study, cell, 5.0)
    assert StudyBudget(study, Budget(cost_usd=10)).paid_usd == pytest.approx(listed + 5), (
        "what is known counts as it is"
    )


def test_a_limit_that_cannot_be_kept_is_refused(tmp_path: Path) -> None:
    local = study_of(tmp_path / "a", paid("m@http://localhost:1/v1"))
    with pytest.raises(UserError, match="is unknown"):
        check_budget(local, Budget(cost_usd=1))
    check_budget(local, Budget(tokens=1))
    limited = paid(config=RunConfig(model="openai:gpt-5", budget=Budget(cost_usd=1)))
    with pytest.raises(UserError, match='the arm "paid" both have a limit'):
        check_budget(study_of(tmp_path / "b", limited), Budget(tokens=1))


class Here:
    """A pool that does jobs at once, in this process."""

    def __init__(self, study: Study) -> None:
        self.study, self.begun = study, list[Job]()
        self.free = 1

    def begin(self, job: Job) -> None:
        self.begun.append(Job.of(json.loads(json.dumps(job.as_dict()))))
        self.free = 0

    def wait(self) -> EndedJob:
        self.free = 1
        try:
            run_job(self.study.path, self.begun[-1])
        except BudgetError as error:
            return EndedJob(self.begun[-1], str(error), 1.0, exhausted_limits=error.limits)
        except AidsrError as error:
            return EndedJob(self.begun[-1], str(error), 1.0)
        return EndedJob(self.begun[-1], "", 1.0)

    def close(self) -> None:
        self.free = 1


def answer(received: Received) -> Say:
    """A concept, and a robot that cannot be one."""
    if "designer" in received.body["messages"][0]["content"].split("\n", 1)[0].lower():
        return Say(
            json.dumps({"interpretation": "Reach.", "concepts": [CONCEPT]}), input_tokens=3000, output_tokens=900
        )
    return Say(f'{{"functional_part": "tip"}}\n```xml\n{ROD}\n```', input_tokens=3000, output_tokens=900)


def test_a_study_ends_at_its_limit_and_goes_on_with_a_higher_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AIDSR_API_KEY", "none")
    with Loopback(answer) as server:
        study = study_of(tmp_path, paid(f"loop@{server.url}/v1"))
        set_budget(study, Budget(tokens=20_000))
        stopped = run_study(study, Here(study))
        assert 7_800 <= StudyBudget(study, read_budget(study)).tokens <= 20_000
        assert 1 <= len(stopped.unpaid) < 3
        assert (stopped.failed, read_failures(study)) == ((), [])
        assert stopped.unpaid == tuple(job for cell in study.cells for job in pending_in(study, cell))
        outcomes = [row.outcome for row in read_outcomes(study)]
        assert outcomes.count("unfinished") == len(stopped.unpaid)
        assert outcomes.count("invalid") == 3 - len(stopped.unpaid)
        set_budget(study, Budget(tokens=10**6))
        assert read_budget(study) == Budget(tokens=10**6)
        assert run_study(study, Here(study)).unpaid == ()
        assert [row.outcome for row in read_outcomes(study)] == ["invalid"] * 3
        asked = [request.body["messages"][-1]["content"] for request in server.requests]
        assert len(asked) == 3 * len(set(asked)), "each run asked the same once, and nothing was paid twice"


def test_the_command_ends_in_a_sentence_that_says_how_to_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "never-used")
    words = ["benchmark", str(tmp_path / "my s"), "--tasks", "button_pushing", "--designs", "3", "--seeds", "0"]
    words += ["--model", "openai:gpt-5", "--jobs", "1", "--max-cost", "0.01", "--method", "full", "no_groups"]
    with pytest.raises(SystemExit) as tried:
        main([*words, "--dry-run"])
    assert tried.value.code == 0
    assert "Above the limit: $2.19 in total, $0.01 allowed; the study would stop" in capsys.readouterr().out
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(SystemExit) as ended:
        main(words)
    said = capsys.readouterr().out
    assert ended.value.code == 1
    assert "$0.00 of $0.01 spent; the remaining budget (cost) is not enough for the next call" in said
    named = "openai-gpt-5/reaching.button_pushing/1, openai-gpt-5.no_groups/reaching.button_pushing/1"
    assert f"2 runs are unfinished ({named})" in said, "what waits for an unpaid run is unpaid too"
    assert "The run may cost" not in said, "a share that was too small is no failure"
    assert f"aidsr benchmark '{tmp_path / 'my s'}' --resume --max-cost 3" in said
    assert "cost $0.00 of $0.01" in said
    assert "failed 0" in said
    with pytest.raises(SystemExit):
        main(["benchmark", str(tmp_path / "my s"), "--resume", "--jobs", "1", "--max-tokens", "1000000"])
    said = capsys.readouterr().out
    assert "$0.00 of $0.01 spent and 0 of 1,000,000 tokens used; the remaining budget (cost) is not enough" in said
    assert "--max-tokens" not in said.partition("By the estimate")[2], "only the limit that refused has to be raised"
    assert read_budget(open_study(tmp_path / "my s")) == Budget(cost_usd=0.01, tokens=1_000_000), "both hold"


def test_an_arm_whose_own_budget_is_too_small_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AIDSR_API_KEY", "none")
    with Loopback(answer) as server:
        config = RunConfig(model=f"loop@{server.url}/v1", concepts=1, max_output_tokens=1000, budget=Budget(tokens=10))
        study = study_of(tmp_path, paid(config=config), runs=1)
        ended = run_study(study, Here(study))
    assert [job.name for job in ended.failed] == [f"design paid/{TASK.replace('/', '.')}/1"]
    assert ["may use 10 tokens" in str(each["error"]) for each in read_failures(study)] == [True] * 3
    assert (ended.unpaid, server.requests) == ((), [])
