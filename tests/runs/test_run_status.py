"""Status is a pure function of the files, whatever part of them is there."""

from datetime import UTC, datetime, timedelta

import pytest

from aidsr.core.artifacts import (
    Brief,
    Concept,
    Critique,
    Decision,
    EnvironmentSummary,
    Fault,
    Outcome,
    ValidationReport,
)
from aidsr.core.calls import CallRecord, Message, Question, Usage
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.runs import EventLog, RecordedModel, Run, RunRecord, new_run, read_status
from aidsr.runs.events import Event, Finished, Started, StepDone, StepStarted, Stopped, Tried, Waiting
from aidsr.runs.stages import iteration_stages

CONCEPT = Concept(name="arm", interpretation="i", morphology="m", actuation="a", functional_part="tip", family="arm")
SUMMARY = EnvironmentSummary(
    gravity_m_s2=(0, 0, -9.81), timestep_s=0.002, mounts=(), bodies=(), sites=(), sensors=(), actuators=()
)
FAULT = Fault(code="chatter", layer="simulate", severity="error", message="It chatters.")


@pytest.fixture
def run(tmp_path) -> Run:
    record = RunRecord(
        objective="Reach the Button!", config=RunConfig(concepts=3), started="2026-01-31T10:02:59+01:00", versions={}
    )
    brief = Brief(objective="Reach the Button!", environment="<mujoco/>", summary=SUMMARY, starting_robot="<mujoco />")
    return new_run(tmp_path, record, brief)


def call(number: int, **usage) -> CallRecord:
    question = Question(role="designer", messages=(Message(role="user", text=str(number)),))
    return CallRecord(
        question=question, model="m", reply="r", finish="stop", usage=Usage(calls=1, **usage), started="now"
    )


class Prepared:
    """A model with one answer."""

    name = "prepared"

    def __init__(self, record: CallRecord) -> None:
        self.record = record

    def ask(self, question: Question) -> CallRecord:
        return self.record


def with_concepts(run: Run, count: int = 3) -> None:
    run.concepts.write((CONCEPT,) * count)
    for number in range(1, count + 1):
        run.design(number).iteration(1).concept.write(CONCEPT)


def test_a_new_run_is_named_after_its_moment_and_objective(run) -> None:
    assert run.path.name.startswith("2026-01-31_1002_reach_the_button_")
    assert run.brief().objective == "Reach the Button!"
    assert run.brief().starting_robot == "<mujoco />"


def test_no_designs_yet(run) -> None:
    status = read_status(run)
    assert (status.state, status.designs, status.approved) == ("running", (), 0)


def test_a_folder_that_is_no_run(tmp_path) -> None:
    with pytest.raises(UserError, match=r"run\.json"):
        read_status(Run(tmp_path))


def test_designs_not_yet_begun_are_running(run) -> None:
    with_concepts(run)
    status = read_status(run)
    assert [design.state for design in status.designs] == ["running"] * 3
    assert [design.stable for design in status.designs] == [None] * 3
    assert status.state == "running"


def test_the_newest_report_and_verdict_count(run) -> None:
    with_concepts(run, 1)
    design = run.design(1)
    design.iteration(1).robot_report.write(ValidationReport(stable=True))
    design.iteration(1).scene_report.write(ValidationReport(stable=False, faults=(FAULT, FAULT)))
    assert read_status(run).designs[0].stable is False
    assert read_status(run).designs[0].faults == ("chatter",)
    design.iteration(2).scene_report.write(ValidationReport(stable=True))
    design.iteration(2).critique.write(Critique(passed=True))
    status = read_status(run).designs[0]
    assert (status.stable, status.judged, status.iteration) == (True, True, 2)


def test_states_of_a_run_follow_from_those_of_its_designs(run) -> None:
    with_concepts(run)
    for number in (1, 2):
        run.design(number).outcome.write(Outcome(outcome="approved", reason="good", iteration=1))
    with EventLog(run.design(3).events) as log:
        log.write(Started())
        log.write(StepStarted(step="critique", iteration=1))
        assert (read_status(run).state, read_status(run).designs[2].doing) == ("running", "critique")
        assert read_status(run).why_unfinished == "the run is running"
        log.write(Waiting(iteration=1))
        assert read_status(run).state == "waiting"
        log.write(Stopped(cause="error", message="no network"))
        assert (read_status(run).state, read_status(run).why_unfinished) == ("stopped", "no network")
        assert read_status(run).designs[2].stopped.message == "no network"
    run.design(3).outcome.write(Outcome(outcome="invalid", reason="never stable"))
    assert (read_status(run).state, read_status(run).approved) == ("finished", 2)


BEGIN = datetime(2026, 1, 31, 10, tzinfo=UTC)
PROPOSED = ((0, Started()), (0, StepStarted(step="concepts")), (5, StepDone(step="concepts")))
GROWN = ((5, Started()), (5, StepStarted(step="robot", iteration=1)), (25, StepDone(step="robot", iteration=1)))
TRIED = Tried(name="an arm", number=1, most=24, progress=0.3, succeeded=False, seconds=1)


def test_a_run_that_was_interrupted_leaves_no_design_running(run) -> None:
    with_concepts(run)
    for number in (1, 2, 3):
        run.design(number).iteration(1).concept.write(CONCEPT)
    for number, last in ((1, StepStarted(step="robot", iteration=1)), (2, Waiting(iteration=1))):
        with EventLog(run.design(number).events) as log:
            log.write(last)
    with EventLog(run.events) as log:
        log.write(Stopped(cause="interrupted", message="interrupted by the user"))
    status = read_status(run)
    assert [design.state for design in status.designs] == ["stopped", "waiting", "stopped"]
    assert status.designs[0].stopped.message == "interrupted by the user"
    assert status.designs[0].doing == ""
    with EventLog(run.events) as log:
        log.write(Started())
    assert [design.state for design in read_status(run).designs] == ["running", "waiting", "running"]


PAUSE = Stopped(cause="interrupted", message="by the person")


@pytest.mark.parametrize(
    ("proposing", "growing", "now_s", "worked_s"),
    [
        (PROPOSED[:2], (), 4, 4),
        ((*PROPOSED[:2], (3, PAUSE)), (), 9000, 3),
        ((*PROPOSED[:2], (1, TRIED), (2, TRIED)), (), 4, 4),
        ((*PROPOSED[:2], (1, TRIED), (3, TRIED), PROPOSED[2], (25, Finished())), (*GROWN, (25, Finished())), 9000, 25),
        ((*PROPOSED[:2], (3, PAUSE), (9000, Started()), (9000, StepStarted(step="concepts")),
          (9002, StepDone(step="concepts"))), (), 9900, 5),
        (PROPOSED, (*GROWN, (25, Waiting(iteration=1))), 43225, 25),
        ((*PROPOSED, (43225, PAUSE)), (*GROWN, (25, Waiting(iteration=1)), (43225, PAUSE)), 90000, 25),
        ((*PROPOSED, (30, PAUSE)), (*GROWN, (30, PAUSE)), 90000, 30),
        ((*PROPOSED, (30, PAUSE), (900, Started()), (910, Finished())),
         (*GROWN, (30, PAUSE), (900, Started()), (910, Finished())), 90000, 40),
    ],
)  # fmt: skip
def test_only_work_counts_as_worked_and_once(
    run: Run,
    proposing: tuple[tuple[int, Event], ...],
    growing: tuple[tuple[int, Event], ...],
    now_s: int,
    worked_s: int,
) -> None:
    clock = [BEGIN]
    for log_of, story in ((run.events, proposing), (run.design(1).events, growing)):
        with EventLog(log_of, now=lambda: clock[0]) as log:
            for second, event in story:
                clock[0] = BEGIN + timedelta(seconds=second)
                log.write(event)
    status = read_status(run, now=BEGIN + timedelta(seconds=now_s))
    assert status.latency_s == worked_s
    assert [design.latency_s for design in status.designs] == [worked_s]


def test_a_refinement_opens_a_round(run) -> None:
    with_concepts(run, 1)
    run.design(1).iteration(1).decision.write(Decision(verdict="refine", text="longer"))
    assert read_status(run).designs[0].round == 1
    run.design(1).iteration(2).concept.write(CONCEPT)
    assert read_status(run).designs[0].round == 2


@pytest.mark.parametrize(
    "written", ['{"verdict": "approve"}', '{"verdict": "quit"}', '{"verdict": "appr', '{"verdict": "refine"}']
)
def test_no_other_decision_opens_a_round_where_a_later_iteration_fell_short(run, written: str) -> None:
    with_concepts(run, 1)
    design = run.design(1)
    for number in (2, 3):
        design.iteration(number).concept.write(CONCEPT)
    design.iteration(2).decision.path.write_text(written)
    (status,) = read_status(run).designs
    assert status.round == 1
    assert [iteration.round for iteration in iteration_stages(design, status)] == [1, 1, 1]


def test_the_designers_call_is_split_evenly_and_completely(run) -> None:
    usage = {"input_tokens": 1001, "output_tokens": 500, "cost_usd": 0.3, "latency_s": 6.0}
    record = call(0, **usage)
    RecordedModel(Prepared(record), run.path).ask(record.question)
    assert read_status(run).usage.input_tokens == 1001
    with_concepts(run)
    own = call(1, input_tokens=10, cost_usd=0.5)
    RecordedModel(Prepared(own), run.design(2).iteration(1).path).ask(own.question)
    designs = [design.usage for design in read_status(run).designs]
    assert [design.input_tokens for design in designs] == [334, 334 + 10, 333]
    assert [design.calls for design in designs] == [1, 1, 0]
    assert [design.cost_usd for design in designs] == pytest.approx([0.1, 0.6, 0.1])
    assert read_status(run).usage.input_tokens == 1011


def test_an_unknown_price_stays_unknown(run) -> None:
    record = call(0, cost_usd=None)
    RecordedModel(Prepared(record), run.path).ask(record.question)
    with_concepts(run)
    assert {design.usage.cost_usd for design in read_status(run).designs} == {None}
