"""The human step by file."""

import threading
import time

import pytest

from aidsr.core.artifacts import Decision, Keep
from aidsr.loop.human import DecisionFile, PresetFeedback
from aidsr.loop.runner import run_designs
from aidsr.runs import Run, read_events, read_status
from aidsr.runs.events import Decided, DecisionUnreadable, Waiting
from scripted import Scripted, new_run, parts

PERSON = DecisionFile(poll_s=0.01)


class Editor:
    """Answers each time somebody waits, by writing the file as an editor would: in place, and not always right."""

    def __init__(self, run: Run, *texts: str) -> None:
        self.run, self.texts = run, list(texts)

    def __call__(self, number: int, event) -> None:
        if isinstance(event, Waiting | DecisionUnreadable):
            assert read_status(self.run).state == "waiting"
            path = self.run.design(number).iteration(event.iteration).decision.path
            path.write_text(self.texts.pop(0))


def kinds(run: Run) -> list[type]:
    events = (type(event) for event in read_events(run.design(1).events))
    return [kind for kind in events if kind in (Waiting, DecisionUnreadable, Decided)]


def test_waits_for_the_file_and_goes_on(tmp_path) -> None:
    run = new_run(tmp_path, human=True)
    run_designs(run, parts(Scripted(), person=PERSON), Editor(run, '{"verdict": "approve"}'))
    assert read_status(run).approved == 1
    assert kinds(run) == [Waiting, Decided]


def test_a_file_that_cannot_be_read_is_reported_and_waited_for(tmp_path) -> None:
    run = new_run(tmp_path, human=True)
    answers = Editor(run, '{"verdict": "refine"}', '{"verdict": "yes"}', '{"verdict": "quit"}')
    run_designs(run, parts(Scripted(), person=PERSON), answers)
    assert kinds(run) == [Waiting, DecisionUnreadable, DecisionUnreadable, Decided]
    assert "text that says what to change" in read_events(run.design(1).events)[-4].reason
    assert read_status(run).designs[0].outcome.outcome == "quit"


class WithFinger(Scripted):
    """Writes robots that have a body named "finger"."""

    def _robot(self, concept, feedback):
        robot = super()._robot(concept, feedback)
        return robot.model_copy(update={"mjcf": robot.mjcf.replace("<mujoco>", "<mujoco><body name='finger'/>")})


def test_a_part_to_keep_that_the_robot_lacks_is_reported_and_waited_for(tmp_path) -> None:
    run, scripted = new_run(tmp_path, human=True), WithFinger()
    asked = '{"verdict": "refine", "text": "softer", "keep": [{"name": "%s"}]}'
    answers = Editor(run, asked % "fingr", asked % "finger", '{"verdict": "approve"}')
    run_designs(run, parts(scripted, person=PERSON), answers)
    assert kinds(run) == [Waiting, DecisionUnreadable, Decided, Waiting, Decided]
    (problem,) = [event for event in read_events(run.design(1).events) if isinstance(event, DecisionUnreadable)]
    assert 'keep names "fingr", which the robot does not have; it has finger; correct decision.json' in problem.reason
    assert [brief.keep for brief in scripted.briefs] == [(), (Keep(name="finger"),)]
    assert read_status(run).approved == 1


def test_refine_then_approve(tmp_path) -> None:
    run, scripted = new_run(tmp_path, human=True), Scripted()
    answers = Editor(run, '{"verdict": "refine", "text": "softer"}', '{"verdict": "approve"}')
    run_designs(run, parts(scripted, person=PERSON), answers)
    assert ("designer", "concept 1", "softer") in scripted.asked
    assert read_status(run).designs[0].round == 2


def test_an_answer_given_while_nobody_was_at_work_counts(tmp_path) -> None:
    def interrupted(iteration, log, halt):
        log.write(Waiting(iteration=iteration.number))
        raise RuntimeError("the machine is switched off")

    run = new_run(tmp_path, human=True)
    run_designs(run, parts(Scripted(), person=interrupted))
    run.design(1).iteration(1).decision.write(Decision(verdict="approve"))
    run_designs(run, parts(Scripted(), person=PERSON))
    assert read_status(run).approved == 1


def test_an_interrupt_ends_the_waiting(tmp_path) -> None:
    def press_control_c(_number, event) -> None:
        if isinstance(event, Waiting):
            raise KeyboardInterrupt

    run = new_run(tmp_path, human=True)
    with pytest.raises(KeyboardInterrupt):
        run_designs(run, parts(Scripted(), person=PERSON), press_control_c)
    assert not [thread for thread in threading.enumerate() if thread.name == "design 1"]
    assert read_status(run).state == "stopped"
    assert read_status(run).designs[0].stopped.cause == "interrupted"
    page = run.summary.read_text()
    assert '<span class="badge stopped">stopped</span>' in page
    assert "http-equiv" not in page, "the page of a run at work reloads itself"


def test_an_empty_file_is_one_that_is_being_written(tmp_path) -> None:
    run, asked = new_run(tmp_path, human=True), []

    def person(iteration, log, halt) -> Decision:
        return PERSON(iteration, log, lambda: asked.append(iteration) or halt())

    def slow_editor(number: int, event) -> None:
        if isinstance(event, Waiting):
            path = run.design(number).iteration(event.iteration).decision.path
            path.touch()
            before, deadline = len(asked), time.monotonic() + 30.0
            while len(asked) < before + 2:  # between two of these the file was looked at
                assert time.monotonic() < deadline, "nobody waits for the file"
                time.sleep(PERSON.poll_s)
            path.write_text('{"verdict": "approve"}')

    run_designs(run, parts(Scripted(), person=person), slow_editor)
    assert kinds(run) == [Waiting, Decided]


def test_what_was_said_beforehand_is_one_round_and_then_approved(tmp_path) -> None:
    run, team = new_run(tmp_path), Scripted()
    run_designs(run, parts(team, person=PresetFeedback("Longer.")))
    assert run.design(1).iteration(1).decision.read() == Decision(verdict="refine", text="Longer.")
    assert read_status(run).designs[0].round == 2
    assert read_status(run).designs[0].outcome.outcome == "approved"
    assert ("designer", "Longer.") in [(role, feedback) for role, _, feedback in team.asked]
