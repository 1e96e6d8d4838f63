"""Whole runs with scripted roles: what is asked of whom, what is written, and how designs end."""

import json
import re

import pytest

from aidsr.core.artifacts import ActuatorGroup, Critique, Decision, Keep, Outcome, ValidationReport
from aidsr.core.errors import IsolationError, ModelError, ReplyError, WorkerLostError
from aidsr.fixes import FixResult, leave_as_written
from aidsr.loop.runner import run_designs
from aidsr.runs import read_events, read_status
from aidsr.runs.events import NoPicture, Stopped
from aidsr.runs.events import Repaired as RepairedEvent
from aidsr.runs.stages import iteration_stages
from scripted import Script, Scripted, new_run, parts


def grow(tmp_path, *scripts: Script, changes=(), **config):
    scripted = Scripted(scripts or [Script()])
    run = new_run(tmp_path, concepts=len(scripted.scripts), **config)
    run_designs(run, parts(scripted, **dict(changes)))
    return run, scripted, read_status(run)


def roles(scripted: Scripted) -> list[str]:
    return [role for role, _, _ in scripted.asked]


def names(folder) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_good_concept_is_approved_at_once(tmp_path) -> None:
    run, scripted, status = grow(tmp_path)
    assert roles(scripted) == ["designer", "coder", "integrator", "judge"]
    assert status.state == "finished"
    assert status.designs[0].outcome.outcome == "approved"
    design = run.design(1)
    assert design.final_scene.read() == design.iteration(1).scene.xml.read()
    assert design.final_robot.read() == design.iteration(1).robot.xml.read()
    assert names(design.iteration(1).path) == {
        "concept.json",
        "robot.xml",
        "robot.json",
        "robot_report.json",
        "placement.json",
        "scene.xml",
        "scene.json",
        "scene_report.json",
        "preview.png",
        "critique.json",
        "motion.png",
    }
    assert run.summary.exists()


def test_faults_of_the_robot_go_back_to_the_coder(tmp_path) -> None:
    run, scripted, status = grow(tmp_path, Script(robots=["chatter", "underdamped", "ok"]))
    assert roles(scripted) == ["designer", "coder", "coder", "coder", "integrator", "judge"]
    feedback = scripted.asked[2][2]
    assert isinstance(feedback, ValidationReport)
    assert [found.code for found in feedback.faults] == ["chatter"]
    assert status.designs[0].iteration == 3
    assert not (run.design(1).iteration(1).path / "placement.json").exists()
    assert run.design(1).iteration(1).preview.read() is not None


def test_code_repairs_what_is_plain_without_a_call_or_an_iteration(tmp_path) -> None:
    run, scripted, status = grow(tmp_path, Script(robots=["misspelt"]))
    assert roles(scripted) == ["designer", "coder", "integrator", "judge"]
    assert (status.designs[0].iteration, status.designs[0].mechanical_repairs) == (1, 1)
    first = run.design(1).iteration(1)
    assert "misspelt" in first.robot_as_written.read().decode()
    assert "faults='ok'" in first.robot.read().mjcf
    assert first.repairs.read().notes == ("<robot>: renamed 'misspelt' 'ok'.",)
    told = [event for event in read_events(run.design(1).events) if isinstance(event, RepairedEvent)]
    assert [(event.iteration, event.counts) for event in told] == [(1, {"misspelt_attributes": 1})]
    assert run.design(1).final_robot.read() == first.robot.xml.read()


def test_a_coder_that_is_asked_again_sees_the_repaired_robot(tmp_path) -> None:
    seen = []

    class Watching(Scripted):
        def repair(self, brief, concept, robot, feedback):
            seen.append(robot.mjcf)
            return super().repair(brief, concept, robot, feedback)

    run = new_run(tmp_path)
    run_designs(run, parts(Watching([Script(robots=["misspelt+chatter", "ok"])])))
    assert [re.search("faults='(.*?)'", mjcf).group(1) for mjcf in seen] == ["ok+chatter"]


def test_names_used_outside_the_mjcf_are_kept(tmp_path) -> None:
    kept = []

    class Grouping(Scripted):
        def write(self, brief, concept):
            groups = (ActuatorGroup(name="close", actuators=("m0", "m1")),)
            return super().write(brief, concept).model_copy(update={"actuator_groups": groups})

    def watch(mjcf, *, kept_names=(), keep=()):
        kept.append(set(kept_names))
        return FixResult(mjcf=mjcf)

    run_designs(new_run(tmp_path), parts(Grouping(), repair=watch))
    assert kept == [{"tip", "m0", "m1"}]


def test_without_repairs_the_robot_stays_as_written(tmp_path) -> None:
    run, _, status = grow(
        tmp_path, Script(robots=["misspelt"]), changes={"repair": leave_as_written}, iterations=0, repairs=False
    )
    assert status.designs[0].outcome.outcome == "invalid"
    assert status.designs[0].mechanical_repairs == 0
    assert not {"repairs.json", "robot_as_written.xml"} & names(run.design(1).iteration(1).path)
    assert json.loads((run.path / "run.json").read_text())["config"]["repairs"] is False


def test_faults_of_the_scene_go_to_whoever_can_cure_them(tmp_path) -> None:
    script = Script(robots=["ok"], placements=["initial_penetration@robot/tip@table", "chatter@robot/tip", "ok"])
    _, scripted, status = grow(tmp_path, script)
    # the environment is named: Integrator; only the robot is named: Coder, whose new robot keeps its placement
    assert roles(scripted)[:5] == ["designer", "coder", "integrator", "integrator", "coder"]
    assert status.designs[0].outcome.outcome == "invalid"
    assert status.designs[0].faults == ("chatter",)


def test_what_cannot_be_assembled_is_a_report_for_the_integrator(tmp_path) -> None:
    run, scripted, status = grow(tmp_path, Script(placements=["nowhere", "ok"]))
    assert roles(scripted) == ["designer", "coder", "integrator", "integrator", "judge"]
    first = run.design(1).iteration(1)
    assert first.scene.read() is None
    assert [found.code for found in first.scene_report.read().faults] == ["undefined_reference"]
    assert status.approved == 1


def test_a_placing_fault_that_stays_goes_to_the_coder(tmp_path) -> None:
    _, scripted, _ = grow(tmp_path, Script(placements=["free_fall@robot/tip"]), iterations=3)
    assert roles(scripted) == ["designer", "coder", "integrator", "integrator", "coder", "integrator"]


def test_a_judge_blames_each_role(tmp_path) -> None:
    script = Script(verdicts=["coder", "integrator", "coder+integrator", "coder+designer", "pass"])
    run, scripted, status = grow(tmp_path, script)
    assert roles(scripted) == [
        *("designer", "coder", "integrator", "judge"),
        *("coder", "judge"),
        *("integrator", "judge"),
        *("coder", "integrator", "judge"),
        *("designer", "coder", "integrator", "judge"),
    ]
    assert status.designs[0].outcome == status.designs[0].outcome.model_copy(update={"iteration": 5})
    assert status.designs[0].concept == "concept 1'"
    both = [feedback for _, _, feedback in scripted.asked[8:10]]
    assert all(isinstance(feedback, Critique) for feedback in both)
    assert [[issue.blame for issue in feedback.issues] for feedback in both] == [["coder"], ["integrator"]]
    assert "Too short" in scripted.asked[11][2]
    assert names(run.design(1).iteration(3).path) == {
        "placement.json",
        "scene.xml",
        "scene.json",
        "scene_report.json",
        "preview.png",
        "critique.json",
    }


@pytest.mark.parametrize("iterations", [0, 2, 8])
def test_attempts_are_one_and_the_repairs_allowed(tmp_path, iterations: int) -> None:
    run, scripted, status = grow(tmp_path, Script(robots=["chatter"]), iterations=iterations)
    assert roles(scripted).count("coder") == 1 + iterations
    assert len(run.design(1).iterations) == 1 + iterations
    outcome = status.designs[0].outcome
    assert (outcome.outcome, outcome.iteration) == ("invalid", 1 + iterations)
    assert "chatter was seen" in outcome.reason
    assert run.design(1).final_scene.read() is None


def test_a_verdict_that_never_passes_ends_invalid_with_its_reason(tmp_path) -> None:
    _, _, status = grow(tmp_path, Script(verdicts=["coder"]), iterations=1)
    assert status.designs[0].outcome.outcome == "invalid"
    assert "Too short" in status.designs[0].outcome.reason


def test_unusable_replies_end_the_design_and_not_the_run(tmp_path) -> None:
    _, _, status = grow(tmp_path, Script(robots=[ReplyError("no <mujoco> found")]), Script())
    assert [design.outcome.outcome for design in status.designs] == ["invalid", "approved"]
    assert "no <mujoco> found" in status.designs[0].outcome.reason


def test_a_bug_in_one_design_is_recorded_and_the_others_go_on(tmp_path) -> None:
    run, _, status = grow(tmp_path, Script(), Script(verdicts=[ZeroDivisionError("by zero")]), Script())
    assert [design.state for design in status.designs] == ["finished", "stopped", "finished"]
    stopped = status.designs[1].stopped
    assert stopped.cause == "bug"
    assert "ZeroDivisionError" in stopped.traceback
    assert "scripted.py" in stopped.traceback
    assert status.state == "stopped"
    run_designs(run, parts(Scripted([Script()] * 3)))
    assert read_status(run).state == "finished"


def test_an_unreachable_model_leaves_the_design_to_be_resumed(tmp_path) -> None:
    run, _, status = grow(tmp_path, Script(placements=[ModelError("no answer from x")]))
    assert status.designs[0].stopped.cause == "error"
    assert status.designs[0].stopped.message == "no answer from x"
    again = Scripted()
    run_designs(run, parts(again))
    assert roles(again) == ["integrator", "judge"]
    assert read_status(run).approved == 1


def test_a_designer_that_cannot_be_asked_stops_the_run(tmp_path) -> None:
    class Unreachable(Scripted):
        def propose(self, brief, count):
            raise ModelError("no answer from x")

    run = new_run(tmp_path)
    with pytest.raises(ModelError):
        run_designs(run, parts(Unreachable()))
    status = read_status(run)
    assert (status.state, status.stopped.message) == ("stopped", "no answer from x")
    run_designs(run, parts(Scripted()))
    assert read_status(run).approved == 1


def test_pictures_are_optional(tmp_path) -> None:
    def overloaded(_mjcf):
        raise IsolationError("time", "drawing took longer than 20 s")

    run, _, status = grow(tmp_path, changes={"picture": overloaded})
    assert status.approved == 1
    assert any(isinstance(event, NoPicture) for event in read_events(run.design(1).events))


def test_secrets_stay_out_of_recorded_errors(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "canary-0123456789")
    error = RuntimeError("header Authorization: Bearer canary-0123456789")
    run, _, _ = grow(tmp_path, Script(robots=[error]), Script(robots=[ModelError("canary-0123456789")]))
    for path in run.path.rglob("*"):
        assert path.is_dir() or b"canary" not in path.read_bytes(), path
    assert "[OPENAI_API_KEY]" in read_status(run).designs[0].stopped.message


def test_run_json_says_what_was_asked(tmp_path) -> None:
    run, _, _ = grow(tmp_path, seed=7)
    content = json.loads((run.path / "run.json").read_text())
    assert content["config"]["seed"] == 7
    assert content["objective"] == "reach"
    assert {"aidsr", "python", "mujoco"} <= content["versions"].keys()


def test_events_reach_the_listener_in_order_and_in_the_calling_thread(tmp_path) -> None:
    import threading

    heard = []
    run = new_run(tmp_path, concepts=2)
    run_designs(
        run, parts(Scripted([Script()] * 2)), lambda number, event: heard.append((number, event, threading.get_ident()))
    )
    assert {thread for _, _, thread in heard} == {threading.get_ident()}
    for number in (1, 2):
        assert [event for n, event, _ in heard if n == number] == list(read_events(run.design(number).events))
    assert [event for n, event, _ in heard if n == 0] == list(read_events(run.events))


def test_nothing_is_asked_of_a_finished_run(tmp_path) -> None:
    run, _, _ = grow(tmp_path)
    before = {path: path.read_bytes() for path in run.path.rglob("*.*") if path.suffix not in (".jsonl", ".html")}
    again = Scripted()
    run_designs(run, parts(again))
    assert again.asked == []
    assert all(path.read_bytes() == content for path, content in before.items())


class Answers:
    """A person with prepared decisions."""

    def __init__(self, *decisions: Decision) -> None:
        self.decisions = list(decisions)

    def __call__(self, iteration, log, halt) -> Decision:
        decision = self.decisions.pop(0)
        iteration.decision.write(decision)
        return decision


def test_refining_opens_a_new_round_with_the_designer(tmp_path) -> None:
    person = Answers(Decision(verdict="refine", text="make it longer"), Decision(verdict="approve"))
    script = Script(robots=["ok", "chatter", "ok"])
    run, scripted, status = grow(tmp_path, script, changes={"person": person}, iterations=1)
    assert scripted.asked[4] == ("designer", "concept 1", "make it longer")
    assert status.designs[0].round == 2
    assert status.designs[0].iteration == 3
    assert status.approved == 1
    assert run.design(1).iteration(2).concept.read().name == "concept 1'"


def test_a_round_with_parts_to_keep_starts_from_the_robot_that_has_them(tmp_path) -> None:
    keep = (Keep(name="finger"),)
    person = Answers(
        Decision(verdict="refine", text="softer", keep=keep),
        Decision(verdict="refine", text="another palm"),
        Decision(verdict="approve"),
    )
    run, scripted, _ = grow(tmp_path, changes={"person": person})
    first, keeping, free = scripted.briefs
    assert (keeping.keep, keeping.starting_robot) == (keep, run.design(1).iteration(1).robot.read().mjcf)
    assert (free.keep, free.starting_robot) == (first.keep, first.starting_robot) == ((), "")


def test_automatic_fixes_are_told_what_to_keep_and_what_they_left_out_is_recorded(tmp_path) -> None:
    told, left = [], "Left out inverted_ranges, which would change a part to keep."

    def watch(mjcf, *, kept_names=(), keep=()):
        told.append(keep)
        return FixResult(mjcf=mjcf, notes=(left,) if keep else ())

    keep = (Keep(name="finger"),)
    person = Answers(Decision(verdict="refine", text="softer", keep=keep), Decision(verdict="approve"))
    run, _, status = grow(tmp_path, changes={"person": person, "repair": watch})
    assert told == [(), keep]
    second = run.design(1).iteration(2)
    assert second.repairs.read().notes == (left,)
    assert second.robot_as_written.read() is None
    assert status.designs[0].mechanical_repairs == 0
    assert "automatic fix" not in str(iteration_stages(run.design(1), status.designs[0]))


def test_quitting_ends_the_design(tmp_path) -> None:
    run, _, status = grow(tmp_path, changes={"person": Answers(Decision(verdict="quit", text="enough"))})
    assert status.designs[0].outcome == Outcome(outcome="quit", reason="enough", iteration=1)
    assert run.design(1).final_scene.read() is None


def test_stopped_event_is_written_for_each_stop(tmp_path) -> None:
    run, _, _ = grow(tmp_path, Script(robots=[ModelError("gone")]))
    assert [type(event) for event in read_events(run.design(1).events)].count(Stopped) == 1


def test_a_lost_worker_stops_a_design_without_a_verdict(tmp_path) -> None:
    run = new_run(tmp_path)

    def lost(*_: object, **__: object) -> ValidationReport:
        raise WorkerLostError("examine could not be run")

    run_designs(run, parts(Scripted(), validate=lost))
    status = read_status(run)
    assert status.state == "stopped"
    assert status.designs[0].stopped.message == "examine could not be run"
    assert status.designs[0].outcome is None
    run_designs(run, parts(Scripted()))
    assert read_status(run).approved == 1
