"""What a person watching sees, in a terminal and without one."""

import io
import shutil
import time
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from aidsr.apps.cli import main
from aidsr.apps.cli.progress import Lines, Panel, follow_run, how_to_resume
from aidsr.apps.cli.reporting import print_introduction, print_status
from aidsr.apps.cli.review_prompt import ReviewPrompt, parse_answer
from aidsr.apps.cli.training import TrainingBar, evaluating, print_evaluations
from aidsr.core.artifacts import Decision, EpisodeResult, Evaluation
from aidsr.core.calls import Usage
from aidsr.core.errors import ModelError, UserError
from aidsr.core.formatting import counted, format_cost, format_duration, format_time_left
from aidsr.learn.episodes.policy_checks import EvaluationPoint
from aidsr.learn.rl.callbacks import CurvePoint
from aidsr.learn.rl.recipe import PROTOCOLS, recipe_of
from aidsr.loop import runner
from aidsr.loop.human import DecisionFile
from aidsr.loop.runner import run_designs
from aidsr.runs import Library, read_status
from aidsr.runs.events import EventLog, StepDone, StepStarted, Tried, Waiting
from scripted import Script, Scripted, new_run, parts, tried


def terminal(width: int = 80) -> Console:
    return Console(file=io.StringIO(), force_terminal=True, width=width, color_system=None)


def test_time_left_goes_by_the_present_speed() -> None:
    assert format_time_left(9000, 50.0) == "about 3 min 0 s left"
    assert format_time_left(-10, 50.0) == "about 0.0 s left"
    assert format_time_left(9000, 0.0) == "–"


def test_a_training_shows_success_and_the_time_left_in_a_terminal_and_in_a_file() -> None:
    point = CurvePoint(
        steps=1000, wall_s=20.0, episodes=40, success_share=0.25, progress=0.5, reward=1.0, diverged=0, steps_per_s=50.0
    )
    for console in (terminal(120), Console(file=io.StringIO(), width=120)):
        with TrainingBar(console, "seed 0", 10_000, PROTOCOLS["best"]) as bar:
            bar.listen(point)
        told = console.file.getvalue()
        assert "1000 steps" in told
        assert "success 25%" in told
        assert "about 3 min 0 s left" in told


def test_an_evaluation_says_that_its_progress_is_that_of_the_best_moments(tmp_path) -> None:
    """A policy without a success may come far for a moment; `aidsr probe` uses the same title."""
    episodes = tuple(
        EpisodeResult(variation=k, ended="out_of_time", progress=0.1, best_progress=best, reward=0.0, time_s=1.0)
        for k, best in enumerate((0.5, 0.75))
    )
    console = Console(file=io.StringIO(), width=120)
    evaluation = Evaluation(task="gap", level="standard", benchmark_version=4, episodes=episodes, checks=())
    print_evaluations(console, {tmp_path: evaluation})
    titles, values = console.file.getvalue().splitlines()[:2]
    assert "   mean best progress   " in titles
    assert values.split()[-3] == "0.62"


@pytest.mark.parametrize(
    ("recipe", "won", "budget", "told"),
    [
        (PROTOCOLS["best"], 0, 10_000, True),
        (PROTOCOLS["best"], 1, 10_000, False),
        (PROTOCOLS["best"], 0, 9_999, False),  # too small a budget to tell
        (PROTOCOLS["paper"], 0, 10_000, False),
        (recipe_of("best", stop_hopeless=True), 0, 10_000, False),
    ],
)
def test_a_training_without_a_success_after_most_of_its_steps_says_so_once(recipe, won, budget, told) -> None:
    console = Console(file=io.StringIO(), width=120)
    with TrainingBar(console, "seed 0", budget, recipe) as bar:
        for steps in (6_900, 7_000, 9_000):
            bar.listen(CurvePoint(steps, 20.0, 40, 0.0, 0.5, 1.0, 0, 50.0, won))
        if told:
            assert "no episode has succeeded" in console.file.getvalue()
    assert console.file.getvalue().count("no episode has succeeded") == int(told)


def test_an_evaluation_shows_how_far_it_has_come() -> None:
    console = terminal(120)
    with evaluating(console, videos=False) as listen:
        listen(EvaluationPoint(episodes=100, ended=40, succeeded=30, simulated_s=2.0, time_limit_s=8.0))
        time.sleep(0.2)
        listen(EvaluationPoint(episodes=100, ended=100, succeeded=70, simulated_s=8.0, time_limit_s=8.0))
        time.sleep(0.2)
    told = console.file.getvalue()
    assert "40 of 100 episodes ended, 30 succeeded" in told
    assert "100 of 100 episodes ended, 70 succeeded; checking" in told


def test_an_evaluation_in_a_log_file_has_a_line_for_each_quarter_and_none_before_it_begins() -> None:
    console = Console(file=io.StringIO(), width=120)
    with evaluating(console, videos=True) as listen:
        assert console.file.getvalue() == "", "there may be nothing to evaluate"
        for ended, simulated_s in ((0, 0.04), (0, 2.0), (10, 2.04), (50, 4.0), (100, 5.0), (100, 5.0)):
            listen(EvaluationPoint(100, ended, ended // 2, simulated_s, 8.0))
    first, *lines = console.file.getvalue().splitlines()
    assert first == "evaluating 100 episodes and writing videos …"
    assert [line.partition(";")[0] for line in lines] == [
        "0 of 100 episodes ended, 0 succeeded",
        "50 of 100 episodes ended, 25 succeeded",
        "100 of 100 episodes ended, 50 succeeded",
    ]
    assert lines[-1].endswith("checking plausibility")


def test_a_run_that_is_stopped_by_an_error_says_how_to_resume(tmp_path, capsys) -> None:
    run = new_run(tmp_path, concepts=1, iterations=0)
    broken = parts(Scripted([Script(robots=["good"])]))

    def no_team(_path):
        raise UserError("the server is not there")

    with pytest.raises(UserError, match="the server is not there"):
        follow_run(run, replace(broken, team_for=no_team))
    assert f"resume with aidsr resume {run.path}" in capsys.readouterr().out.replace("\n", "")


def test_a_server_on_this_machine_is_not_said_to_cost_money(tmp_path) -> None:
    for model, said in (
        ("qwen3@http://localhost:8000/v1", "Its server runs on this machine."),
        ("qwen3@https://example.org/v1", "Every call may cost money."),
    ):
        console = Console(file=io.StringIO(), width=200)
        print_introduction(console, new_run(tmp_path / said[:3], model=model))
        assert said in console.file.getvalue()


def test_a_run_is_reported_in_lines(tmp_path, capsys) -> None:
    run = new_run(tmp_path, concepts=2, iterations=0)
    assert follow_run(run, parts(Scripted([Script(robots=["misspelt"]), Script(robots=["chatter"])]))) == 0
    said = capsys.readouterr().out
    story = [
        "builtin",
        "not a language model",
        "concepts: concept 1; concept 2",
        "design 2  iteration 1  robot: 1 fault: chatter",
        "design 1  iteration 1  1 automatic fix: misspelt_attributes",
        "design 1  iteration 1  Judge: passed",
        "design 1  approved",
        "design 2  invalid: Faults remain after 1 attempt: chatter: chatter was seen.",
        "summary.html",
    ]
    assert all(line in said.replace("\n", " ") or line in said for line in story)
    assert "\x1b" not in said


def test_lines_say_when_a_trial_begins_because_it_takes_minutes(tmp_path, capsys) -> None:
    trial = parts(Scripted([Script()]), try_on_task=lambda _robot, _scene: tried(0.9, decisive=True))
    follow_run(new_run(tmp_path), trial)
    said = capsys.readouterr().out.splitlines()
    began = said.index("design 1  iteration 1  the scene is tried on its task")
    assert said[began - 1] == "design 1  iteration 1  scene: stable"
    assert said[began + 1].startswith("design 1  iteration 1  tried on its task: ")


def test_an_error_that_ends_a_run_is_left_to_the_caller(tmp_path, capsys) -> None:
    """The command prints it on stderr; once is enough."""

    class Unable(Scripted):
        def propose(self, _brief, _count):
            raise UserError("cannot read designer.md; write it")

    with pytest.raises(UserError, match=r"cannot read designer\.md"):
        follow_run(new_run(tmp_path), parts(Unable()))
    said = capsys.readouterr().out
    assert "designer.md" not in said
    assert "aidsr resume" in said


def test_an_interrupted_design_with_training_says_how_to_train(tmp_path, capsys, monkeypatch) -> None:
    def interrupted(self, *_):
        raise KeyboardInterrupt

    monkeypatch.setattr(runner._Runner, "run_all", interrupted)
    place = str(tmp_path / "my runs")
    with pytest.raises(SystemExit) as ended:
        main(["design", "--task", "button_pushing", "--train", "--steps", "100", "--seeds", "2", "--runs", place])
    assert ended.value.code == 130
    (run,) = Library(Path(place)).runs()
    said = capsys.readouterr().out.replace("\n", "")
    assert f"then aidsr train '{run.path}/designs/N' --steps 100 --seeds 2 for each approved design N" in said


def test_commands_to_view_and_to_resume_can_be_pasted(tmp_path) -> None:
    run = new_run(tmp_path / "my runs")
    console = Console(file=io.StringIO(), width=200)
    print_status(console, run, read_status(run))
    assert f"aidsr resume '{run.path}'" in console.file.getvalue()
    ReviewPrompt(console, run, nullcontext, typing=False)._ask(1, run.design(1).iteration(1))
    assert f"aidsr view '{run.path}/designs/1/01/scene.xml'" in console.file.getvalue()


def test_follow_run_fails_when_nothing_is_approved(tmp_path, capsys) -> None:
    run = new_run(tmp_path)
    assert follow_run(run, parts(Scripted([Script(robots=[ModelError("no answer from x")])]))) == 1
    said = capsys.readouterr().out
    assert "no answer from x" in said
    assert "aidsr resume" in said


def test_follow_run_shows_the_traceback_of_a_bug(tmp_path, capsys) -> None:
    run = new_run(tmp_path)
    assert follow_run(run, parts(Scripted([Script(verdicts=[ZeroDivisionError("by zero")])]))) == 1
    assert "ZeroDivisionError: by zero" in capsys.readouterr().out.split("Traceback")[1]


def test_panel_has_two_lines_for_each_design_and_fits(tmp_path) -> None:
    run = new_run(tmp_path, concepts=2)
    run_designs(run, parts(Scripted([Script(), Script()])))
    console = terminal(60)
    panel = Panel(console, run)
    panel.on_event(0, StepStarted(step="concepts"))
    console.print(panel)
    assert "the Designer proposes concepts" in console.file.getvalue()
    panel.on_event(1, StepDone(step="robot_report", iteration=2, summary="9 faults: " + "initial_penetration, " * 9))
    panel.on_event(1, StepStarted(step="robot", iteration=3))
    panel.on_event(2, StepDone(step="critique", iteration=1, summary="passed"))
    console.file = io.StringIO()
    console.print(panel)
    lines = console.file.getvalue().rstrip("\n").split("\n")
    assert len(lines) == 4
    assert all(len(line) <= 60 for line in lines)
    assert "concept 1   iteration 3" in lines[0]
    assert "the Coder writes the robot" in lines[1]
    assert "Judge: passed" in lines[3]


def test_panel_knows_a_design_by_its_number(tmp_path) -> None:
    run, console = new_run(tmp_path, concepts=2, model="ollama:made"), terminal()
    run_designs(run, parts(Scripted([Script(), Script()])))
    shutil.rmtree(run.design(1).path)
    panel = Panel(console, run)
    panel.on_event(2, StepDone(step="critique", iteration=1, summary="passed"))
    console.print(panel)
    assert "2  concept 2   iteration 1   $0" in console.file.getvalue()


@pytest.mark.parametrize("model", ["builtin", "reference"])
def test_panel_shows_no_cost_where_no_model_is_called(model, tmp_path) -> None:
    run, console = new_run(tmp_path, model=model), terminal()
    run_designs(run, parts(Scripted()))
    panel = Panel(console, run)
    panel.on_event(1, StepDone(step="critique", iteration=1, summary="passed"))
    console.print(panel)
    assert "$" not in console.file.getvalue()


@pytest.mark.parametrize(
    ("line", "decision"),
    [
        ("a\n", Decision(verdict="approve")),
        ("Approve", Decision(verdict="approve")),
        ("q", Decision(verdict="quit")),
        ("r make it longer\n", Decision(verdict="refine", text="make it longer")),
        ("refine softer", Decision(verdict="refine", text="softer")),
        ("r", None),
        ("", None),
        ("yes", None),
    ],
)
def test_answers_that_can_be_typed(line: str, decision: Decision | None) -> None:
    assert parse_answer(line) == decision


def ask(tmp_path, *typed: str, typing: bool = True):
    """Run one design with a person who types these lines."""
    run, console = new_run(tmp_path, human=True), Console(file=io.StringIO(), width=200)
    lines = list(typed)
    prompt = ReviewPrompt(
        console, run, Lines(console).aside, lambda _wait_s: lines.pop(0) if lines else None, typing=typing
    )
    with prompt:
        run_designs(run, parts(Scripted(), person=DecisionFile(poll_s=0.01)), prompt.on_event)
    return read_status(run).designs[0], console.file.getvalue()


def test_typed_answers_become_decision_files(tmp_path) -> None:
    design, said = ask(tmp_path, "hm\n", "r make it longer\n", "a\n")
    assert design.outcome.outcome == "approved"
    assert design.round == 2
    assert said.count("passed by the Judge") == 2
    assert 'Type "a", "q", or "r"' in said
    assert "preview.png" in said


def test_quit_can_be_typed(tmp_path) -> None:
    design, _ = ask(tmp_path, "q\n")
    assert design.outcome.outcome == "quit"


def test_a_terminal_that_goes_away_leaves_the_file(tmp_path) -> None:
    run, console = new_run(tmp_path, human=True), Console(file=io.StringIO(), width=200)

    def gone(_wait_s: float) -> str:
        return ""

    class Waiter(DecisionFile):
        def __call__(self, iteration, log, halt) -> Decision:
            log.write(Waiting(iteration=iteration.number))
            deadline = time.monotonic() + 30.0
            while "write" not in console.file.getvalue():
                assert time.monotonic() < deadline, "the file was never explained"
                time.sleep(0.01)
            return Decision(verdict="approve")

    with ReviewPrompt(console, run, Lines(console).aside, gone, typing=True) as prompt:
        run_designs(run, parts(Scripted(), person=Waiter()), prompt.on_event)
    assert console.file.getvalue().count('{"verdict": "approve"}') == 1


def test_without_a_terminal_the_file_is_explained(tmp_path) -> None:
    run, console = new_run(tmp_path, human=True), Console(file=io.StringIO(), width=200)
    decision = run.design(1).iteration(1).decision
    with ReviewPrompt(console, run, Lines(console).aside, typing=False) as prompt:

        def answer(number, event) -> None:
            prompt.on_event(number, event)
            if event.kind == "waiting":
                decision.write(Decision(verdict="approve"))

        run_designs(run, parts(Scripted(), person=DecisionFile(poll_s=0.01)), answer)
    assert '{"verdict": "approve"}' in console.file.getvalue()
    assert str(decision.path) in console.file.getvalue()


def test_words_for_money_and_time() -> None:
    assert format_cost(Usage()) == "$0"
    assert format_cost(Usage(calls=1, cost_usd=None)) == "unknown"
    assert format_cost(Usage(calls=2, cost_usd=0.0123)) == "$0.0123"
    assert [format_duration(s) for s in (0.04, 59.4, 60, 3723)] == ["0.0 s", "59.4 s", "1 min 0 s", "1 h 2 min"]


def test_a_noun_follows_its_number() -> None:
    told = [counted(1, "fix"), counted(0, "fix"), counted(2, "policy"), counted(3, "search"), counted(2, "task")]
    assert told == ["1 fix", "0 fixes", "2 policies", "3 searches", "2 tasks"]


def test_an_interrupted_search_over_bodies_is_said_to_start_again(tmp_path):
    run = new_run(tmp_path / "my runs")
    assert how_to_resume(run).startswith("Finished work is kept; resume with [bold]aidsr resume '")
    assert how_to_resume(run, "aidsr train N").endswith("'[/], then [bold]aidsr train N[/] for each approved design N")
    with EventLog(run.events) as log:
        log.write(Tried(name="an arm", number=1, most=24, progress=0.3, succeeded=False, seconds=1))
    assert "but not the search over bodies, which starts again" in how_to_resume(run)
    run.concepts.write(())
    assert "starts again" not in how_to_resume(run)
