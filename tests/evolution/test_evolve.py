"""Generations: each is told what was measured before it; stopped ones go on; the few best are trained."""

from importlib import import_module
from pathlib import Path
from typing import NoReturn

import pytest

import aidsr
from aidsr.apps.cli import main
from aidsr.core.artifacts import EpisodeResult, Evaluation, PlausibilityCheck
from aidsr.core.calls import Usage
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import AidsrError, BudgetError, ModelError, UserError
from aidsr.evolution import Evolution, Plan, begin, generations, run_generations
from aidsr.loop import runner
from aidsr.memory import Lesson
from aidsr.runs import Run
from aidsr.runs.origin import MARK, ForeignFolderError
from aidsr.tasks import load_task
from scripted import Script, Scripted, parts, tried

CONFIG = RunConfig(concepts=1, task_feedback=True)


@pytest.fixture
def designs(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, str]]:
    """Seed and memory of each generation that worked; a body comes farther by 0.3 with each generation, from 0.3."""
    worked: list[tuple[int, str]] = []

    def design(run: Run, _parts: object, _follow: object) -> Run:
        config = run.asked().config
        if not run.design(1).outcome.read():
            worked.append((config.seed, Path(config.memory).name))
            runner.run_designs(run, parts(Scripted([Script()] * config.concepts)))
            progress = min(0.3 * config.seed + 0.3, 0.9)
            run.design(1).iteration(1).task_report.write(tried(progress, decisive=progress > 0.5))
        return run

    monkeypatch.setattr(generations, "run_designs", design)
    return worked


def begun(folder: Path, **changes: object) -> Evolution:
    return begin(folder / "evolution", Plan(**{"task": "gap", "generations": 3, "config": CONFIG, **changes}))


def test_each_generation_is_told_what_the_ones_before_measured(tmp_path: Path, designs: list[tuple[int, str]]) -> None:
    evolution, lines = begun(tmp_path), []
    run_generations(evolution, lines.append)
    best = evolution.best
    assert designs == [(0, ""), (1, "archive.jsonl"), (2, "archive.jsonl")]
    assert best is not None
    assert best.progress == pytest.approx(0.9)
    told = [run.brief().lessons for run in evolution.generations().values()]
    assert [len(lessons) for lessons in told] == [0, 1, 1]  # all are of one family: the best of it is told
    assert "progress 0.60" in told[2][0]
    assert lines[-1] == "generation 3: concept 1 comes to 0.90"
    page = (evolution.path / "report.md").read_text()
    assert "| 2 | 1 | 0.60 | 0.60 | - | concept 1 |" in page
    assert "3 of at most 3 generations" in page


def test_one_that_was_stopped_goes_on_and_may_get_more_generations(
    tmp_path: Path, designs: list[tuple[int, str]]
) -> None:
    run_generations(begun(tmp_path, generations=1))
    run_generations(begun(tmp_path, generations=2))
    run_generations(begun(tmp_path, generations=2))
    assert [seed for seed, _ in designs] == [0, 1]
    with pytest.raises(UserError, match="another plan"):
        begun(tmp_path, train=1)


def test_it_ends_when_a_policy_wins(
    tmp_path: Path, designs: list[tuple[int, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    trained = []

    def train(mjcf: str, **asked: object) -> Evaluation:
        trained.append((mjcf, asked["steps"], asked["task"]))
        episode = {"variation": 0, "progress": 1.0, "best_progress": 1.0, "reward": 1.0, "time_s": 1.0}
        episodes = tuple(EpisodeResult(ended=end, **episode) for end in ("succeeded", "out_of_time"))
        return Evaluation(task="gap", level="standard", benchmark_version=4, episodes=episodes, checks=())

    monkeypatch.setattr(import_module("aidsr.learn.rl.short_training"), "train_briefly", train)
    evolution = begun(tmp_path, train=1, steps=500)
    run_generations(evolution)
    best = evolution.best
    assert [seed for seed, _ in designs] == [0, 1]  # the first did not come far enough for a training
    assert [each[1:] for each in trained] == [(500, "gap")]
    assert best is not None
    assert (best.policy_success, best.evidence) == (0.5, evolution.archive.lessons()[-1].evidence)
    assert "| 50% |" in (evolution.path / "report.md").read_text()
    run_generations(evolution)
    assert len(trained) == 1


@pytest.mark.usefixtures("designs")
def test_it_goes_on_when_the_policy_that_wins_is_not_valid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def train(_mjcf: str, **_asked: object) -> Evaluation:
        checks = (
            PlausibilityCheck(name="needs_cables", passed=False, measured=0.9, limit=0.5, message="wins without"),
        )
        episode = EpisodeResult(variation=0, ended="succeeded", progress=1.0, best_progress=1.0, reward=1.0, time_s=1.0)
        return Evaluation(task="gap", level="standard", benchmark_version=4, episodes=(episode,), checks=checks)

    monkeypatch.setattr(import_module("aidsr.learn.rl.short_training"), "train_briefly", train)
    evolution, lines = begun(tmp_path, train=1), []
    run_generations(evolution, lines.append)
    assert list(evolution.generations()) == [1, 2, 3]
    assert not evolution.done
    assert "concept 1: a policy wins 100% of 1 development episodes, but not in a valid way" in lines
    assert {(each.policy_success, each.policy_valid) for each in evolution.archive.lessons()} == {
        (None, True),
        (1.0, False),
    }
    assert "100%" not in (evolution.path / "report.md").read_text()


@pytest.mark.usefixtures("designs")
def test_the_best_designs_are_trained_each_with_its_best_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    measured = {
        "objective": "", "base": "fixed", "family": "", "morphology": "", "actuation": "", "actuators": 1, "groups": 1,
        "found": "", "model": "", "least": 0.5, "most": 1, "searches": 2, "solved": True,
    }  # fmt: skip
    scenes = {"a/designs/1/01": 0.8, "a/designs/1/02": 0.9, "a/designs/2/01": 0.6, "a/designs/3/01": 0.5}
    lessons = tuple(
        Lesson(name=place, progress=progress, evidence=place, scene_sha256=place[2:].replace("/", ""), **measured)
        for place, progress in scenes.items()
    )
    trained: list[str] = []
    monkeypatch.setattr(generations, "lessons_of", lambda _run: lessons)
    monkeypatch.setattr(generations, "_train", lambda *about: trained.append(about[-1].evidence) or "")
    run_generations(begun(tmp_path, generations=1, train=2))
    assert trained == ["a/designs/1/02", "a/designs/2/01"]


@pytest.mark.parametrize(
    ("how", "searches", "train", "policy", "done"),
    [
        ("", 1, 0, {}, True),
        ("play: 9 s of development variation 0", 1, 0, {}, False),
        ("play: won 8 of 8", 8, 0, {}, True),
        ("play: won 8 of 8", 8, 1, {}, False),
        ("play: won 8 of 8", 8, 1, {"policy_success": 0.5}, True),
        ("play: won 8 of 8", 8, 1, {"policy_success": 1.0, "policy_valid": False}, False),
    ],
)
def test_neither_one_variation_nor_a_policy_that_is_not_valid_ends_it(
    how: str, searches: int, train: int, policy: dict[str, object], done: bool
) -> None:
    known = {
        "objective": "", "base": "fixed", "name": "", "family": "", "morphology": "", "actuation": "", "actuators": 1,
        "groups": 1, "found": "", "model": "", "evidence": "", "scene_sha256": "",
    }  # fmt: skip
    lesson = Lesson(progress=1, least=1, most=1, solved=True, searches=searches, how=how, **policy, **known)
    assert Plan(train=train, config=CONFIG).done_by(lesson) == done


@pytest.mark.usefixtures("designs")
def test_it_ends_with_any_robot_that_does_the_job_and_shows_the_best_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The best one by progress and policy together need not be one whose every search reached the goal."""
    measured = {
        "objective": "", "base": "fixed", "family": "", "morphology": "", "actuation": "", "actuators": 1, "groups": 1,
        "found": "", "model": "", "scene_sha256": "", "searches": 2, "solved": True, "most": 1,
    }  # fmt: skip
    best = Lesson(name="best", progress=0.9, least=0.8, policy_success=0.4, evidence="a/designs/1/01", **measured)
    done = Lesson(name="done", progress=1.0, least=1.0, evidence="a/designs/2/01", **measured)
    monkeypatch.setattr(generations, "lessons_of", lambda _run: (best, done))
    lines: list[str] = []
    evolution = begun(tmp_path)
    run_generations(evolution, lines.append)
    assert (evolution.best, evolution.done) == (best, True)
    assert lines == ["generation 1: best comes to 0.90"]
    with pytest.raises(SystemExit) as ended:
        main(["evolve", "--task", "gap", "--out", str(tmp_path / "command"), "--generations", "2"])
    assert ended.value.code == 0
    told = capsys.readouterr().out
    assert "Best result: best" in told
    assert told.startswith("The built-in rules read no lessons: each generation only searches with another seed. Name")


@pytest.mark.usefixtures("designs")
def test_a_language_model_is_not_told_that_it_reads_no_lessons(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["evolve", "--task", "gap", "--out", str(tmp_path / "o"), "--model", f"manual:{tmp_path}"])
    told = capsys.readouterr().out
    assert "generation 1: " in told
    assert "read no lessons" not in told


def test_the_budget_is_that_of_all_generations(
    tmp_path: Path, designs: list[tuple[int, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Spent:
        state = "finished"
        usage = Usage(input_tokens=300, output_tokens=300)

    monkeypatch.setattr(generations, "read_status", lambda _run: Spent)
    evolution, lines = begun(tmp_path, config=CONFIG.updated({"budget": Budget(tokens=1000)})), []
    run_generations(evolution, lines.append)
    assert [run.asked().config.budget.tokens for run in evolution.generations().values()] == [1000, 400]
    assert lines[-1] == "generation 3: the budget is spent"


def test_it_ends_where_the_next_call_could_exceed_the_budget(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Refused(Scripted):
        def propose(self, brief: object, count: int) -> NoReturn:
            raise BudgetError("600 of 1,000 tokens are spent.", "tokens")

    monkeypatch.setattr(
        generations, "parts_of", lambda run, **_how: parts(Refused() if run.asked().config.seed else Scripted())
    )
    lines: list[str] = []
    evolution = begun(tmp_path)
    for _ in range(2):  # it says so again when it is continued
        run_generations(evolution, lines.append)
        assert lines[-1] == "generation 2: the budget is spent. 600 of 1,000 tokens are spent."


def test_a_generation_whose_designs_stopped_is_continued_before_the_next_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    coder: list[str | Exception] = [ModelError("the server cannot be reached.")]
    monkeypatch.setattr(generations, "parts_of", lambda _run, **_how: parts(Scripted([Script(robots=coder)])))
    evolution = begun(tmp_path, generations=2)
    why = "generation 1 stopped: the server cannot be reached; repeat the command to continue"
    for _ in range(2):
        with pytest.raises(AidsrError, match=f"^{why}$"):
            run_generations(evolution)
    with pytest.raises(SystemExit) as ended:
        main(["evolve", "--task", "gap", "--out", str(evolution.path), "--generations", "2", "--concepts", "1"])
    assert ended.value.code == 1
    told = capsys.readouterr()
    assert why in told.err
    assert "Nothing was measured" not in told.out
    assert list(evolution.generations()) == [1]
    coder[:] = ["ok"]
    run_generations(evolution)
    assert list(evolution.generations()) == [1, 2]


def test_a_generation_that_is_continued_gets_what_the_others_left(
    tmp_path: Path, designs: list[tuple[int, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Earlier versions went on with the next generation when one had stopped."""
    plan = {"generations": 2, "config": CONFIG.updated({"budget": Budget(tokens=1000)})}
    evolution = begun(tmp_path, **plan)
    run_generations(evolution)
    first, second = evolution.generations().values()
    first.design(1).outcome.path.unlink()

    class Spent:
        usage = Usage(input_tokens=300, output_tokens=300)

        def __init__(self, run: Run) -> None:
            self.state = "finished" if run.design(1).outcome.read() else "stopped"

    monkeypatch.setattr(generations, "read_status", Spent)
    run_generations(evolution)
    assert (first.budget().tokens, second.budget().tokens) == (400, 1000)
    assert [seed for seed, _ in designs] == [0, 1, 0]


@pytest.mark.parametrize("model", [(), ("--model", "openai:gpt-5")])
def test_a_folder_from_elsewhere_does_not_choose_where_prompts_are_sent(
    model: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "never-used")
    evolution = begun(tmp_path, config=CONFIG.updated({"model": "m@http://127.0.0.1:9/v1"}))
    with pytest.raises(SystemExit) as ended:
        main(["evolve", "--task", "gap", "--out", str(evolution.path), "--generations", "3", "--concepts", "1", *model])
    assert ended.value.code == 2
    assert "holds an evolution with another plan (evolve.json)" in capsys.readouterr().err
    assert list(evolution.generations()) == []


def test_the_budget_of_a_run_from_elsewhere_is_not_touched(
    tmp_path: Path, designs: list[tuple[int, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Spent:
        state = "stopped"
        usage = Usage(input_tokens=300, output_tokens=300)

    monkeypatch.setenv("OPENAI_API_KEY", "never-used")
    config = CONFIG.updated({"model": "openai:gpt-5", "budget": Budget(tokens=1000)})
    evolution = begun(tmp_path, generations=2, config=config)
    run_generations(evolution)
    first, _ = evolution.generations().values()
    (first.path / MARK).unlink()
    monkeypatch.setattr(generations, "read_status", lambda _run: Spent)
    with pytest.raises(ForeignFolderError, match=r"was not made here, or run\.json was changed since"):
        run_generations(evolution)
    assert not first.larger_budget.exists()


def test_one_that_is_reopened_with_another_goal_or_environment_is_refused(tmp_path: Path) -> None:
    environment, goal = load_task("button_pushing").environment, tmp_path / "goal.toml"
    goal.write_text('kind = "reach"\ntarget = "button"\n')
    asked = {"environment": environment, "goal": goal}
    plan = Plan(objective="Press it.", config=CONFIG)
    first = begin(tmp_path / "evolution", plan, **asked)
    assert begin(first.path, plan, **asked) == begin(first.path, plan) == first
    with pytest.raises(UserError, match=r"another environment \(environment\.xml\); name another folder"):
        begin(first.path, plan, **{**asked, "environment": environment.replace("<worldbody>", "<worldbody> ")})
    goal.write_text('kind = "reach"\ntarget = "panel"\n')
    with pytest.raises(UserError, match=r"another goal \(goal\.toml\); name another folder"):
        begin(first.path, plan, **asked)


def test_from_python_it_is_one_call_and_its_folder_is_read_again(
    tmp_path: Path, designs: list[tuple[int, str]]
) -> None:
    lines: list[str] = []
    asked = {"task": "gap", "generations": 2, "out": str(tmp_path / "evolution"), "concepts": 1, "seed": 1}
    evolution = aidsr.evolve(**asked, listen=lines.append)
    assert designs == [(1, ""), (2, "archive.jsonl")]
    assert [line.partition(":")[0] for line in lines] == [
        "The built-in rules read no lessons",
        "generation 1",
        "generation 2",
    ]
    again = aidsr.Evolution(str(tmp_path / "evolution"))
    assert again == evolution
    assert again.best is not None
    assert again.best.progress == pytest.approx(0.9)
    assert not again.done
    assert aidsr.evolve(**{**asked, "generations": 3}, listen=lines.append) == evolution
    assert [seed for seed, _ in designs] == [1, 2, 3]


MISTAKES: list[tuple[dict[str, object], type[Exception], str]] = [
    ({"objective": "reach it"}, UserError, "an evolution requires a measure of success; name a task, or give a goal"),
    ({"task": "gap", "memory": "lessons.jsonl", "model": "test:x"}, UserError, "an evolution keeps a memory of its"),
    ({"task": "gap", "human": True}, UserError, "an evolution keeps a memory of its own and asks no person; leave out"),
    ({"task": "gap", "generations": 0}, UserError, "generations must be at least 1: 0"),
    ({"task": "gap", "train": 0.5}, TypeError, "train must be a whole number, not 0.5"),
    ({"task": "gap", "concept": 1}, UserError, "unknown setting: concept; did you mean concepts?"),
    ({"task": "gap", "out": 5}, TypeError, "out must be the path of a folder, not 5"),
    ({"task": "gpa"}, UserError, 'unknown task "gpa"; did you mean "locomotion/gap"?'),
    ({"task": "gap", "level": "easy"}, UserError, "invalid level"),
    ({"task": "gap", "generations": 2000}, UserError, "invalid generations"),
]


@pytest.mark.parametrize(("asked", "kind", "sentence"), MISTAKES)
def test_a_mistake_in_python_is_one_sentence_and_leaves_nothing(
    asked: dict[str, object], kind: type[Exception], sentence: str, tmp_path: Path
) -> None:
    with pytest.raises(kind) as caught:
        aidsr.evolve(**{"out": tmp_path / "evolution", **asked})
    assert str(caught.value).startswith(sentence)
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_evolved_is_refused_in_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(UserError, match="requires task_feedback"):
        begun(tmp_path, config=RunConfig())
    (tmp_path / "evolution").mkdir()
    (tmp_path / "evolution" / "mine.txt").touch()
    with pytest.raises(UserError, match=r"evolve\.json not found"):
        begun(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["evolve", "reach it"])
    assert ended.value.code == 2
    assert "an evolution requires a measure of success" in capsys.readouterr().err
