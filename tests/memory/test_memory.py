"""Lessons: collected from runs, kept once, told for the likest jobs."""

from pathlib import Path

import pytest

from aidsr.apps.cli import main
from aidsr.core.artifacts import EpisodeResult, Evaluation, PlausibilityCheck
from aidsr.core.calls import CallRecord, Question, Usage
from aidsr.core.errors import UserError
from aidsr.loop.run import create_run
from aidsr.loop.runner import run_designs
from aidsr.memory import Lesson, Memory, elites
from aidsr.memory.collecting import lessons_of
from aidsr.memory.lesson import designer_of
from aidsr.runs import RecordedModel
from aidsr.teams.llm.prompts import render
from scripted import Script, Scripted, brief, new_run, parts, tried


def lesson(**changes: object) -> Lesson:
    values = {
        "objective": "crawl through a tunnel", "base": "free", "name": "Worm", "family": "worm", "morphology": "a worm",
        "actuation": "four cables", "actuators": 4, "groups": 2, "progress": 0.5, "least": 0.4, "most": 0.6,
        "searches": 2, "solved": False, "found": "It stops.", "model": "builtin", "scene_sha256": "0",
        "evidence": "a/1/01",
    }  # fmt: skip
    return Lesson(**{**values, **changes})


def kept(path: Path, *lessons: Lesson) -> Memory:
    memory = Memory(path / "lessons.jsonl")
    memory.add(lessons)
    return memory


class Answering:
    """A model with one reply."""

    name = "answering"

    def ask(self, question: Question) -> CallRecord:
        return CallRecord(
            question=question, model=self.name, reply="Hm.", finish="stop", usage=Usage(calls=1), started="2026-01-01"
        )


def test_a_lesson_is_what_a_trial_measured_of_a_scene_and_the_attempt_before(tmp_path: Path) -> None:
    run = new_run(tmp_path)
    run_designs(run, parts(Scripted([Script(robots=("shaky", "ok"))])))
    design = run.design(1)
    assert lessons_of(run) == ()
    design.iteration(2).task_report.write(tried(0.3, decisive=False))
    (found,) = lessons_of(run)
    assert (found.progress, found.least, found.most) == pytest.approx((0.3, 0.2, 0.4))
    assert (found.searches, found.solved) == (2, False)
    assert (found.family, found.objective, found.model) == ("arm", "reach", "builtin")
    assert found.evidence == f"{run.path.name}/designs/1/02"
    assert "progress 0.30 (0.20 to 0.40 in 2 searches), decisive stage not reached" in found.text()
    assert "\n" not in found.text()


@pytest.mark.parametrize(
    ("model", "designer"),
    [
        ("builtin", "builtin"),
        ("openai:gpt-5", "openai"),
        ("manual:/home/me/prompts", "manual"),
        ("llama@http://localhost:8000/v1", "llama"),
        ("qwen3:8b@https://host:11434/v1", "qwen3:8b"),
    ],
)
def test_a_lesson_names_its_designer_without_paths_and_addresses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, model: str, designer: str
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "none")
    assert designer_of(model) == designer
    run = new_run(tmp_path, model=model)
    run_designs(run, parts(Scripted([Script()])))
    run.design(1).iteration(1).task_report.write(tried(0.3, decisive=False))
    (found,) = lessons_of(run)
    assert (found.model, found.design_and_iteration) == (designer, (1, 1))


def test_what_was_measured_again_counts_and_a_later_attempt_says_what_changed(tmp_path: Path) -> None:
    run = new_run(tmp_path)
    trials = [tried(0.2, decisive=False), tried(0.9, decisive=True)]
    script = Scripted([Script(verdicts=("coder", "pass"))])
    run_designs(run, parts(script))
    for number, report in enumerate(trials, 1):
        run.design(1).iteration(number).task_report.write(report)
    run.design(1).iteration(1).measured_again.write(tried(0.4, decisive=False))
    first, second = lessons_of(run)
    assert first.progress == 0.4
    assert (second.progress_before, second.step) == (0.4, pytest.approx(0.5))
    assert second.changed
    assert "The attempt before came to 0.40" in second.text()


def test_the_policy_of_a_scene_that_was_measured_again_stays_with_it(tmp_path: Path) -> None:
    run = new_run(tmp_path)
    run_designs(run, parts(Scripted([Script()])))
    episodes = tuple(
        EpisodeResult(variation=0, ended=end, progress=1.0, best_progress=1.0, reward=1.0, time_s=1.0)
        for end in ("succeeded", "out_of_time")
    )
    policy = Evaluation(task="gap", level="standard", benchmark_version=4, episodes=episodes, checks=())
    iteration = run.design(1).iteration(1)
    iteration.task_report.write(tried(0.3, decisive=False).model_copy(update={"policy": policy}))
    iteration.measured_again.write(tried(0.4, decisive=False))
    (found,) = lessons_of(run)
    assert (found.progress, found.policy_success, found.policy_valid) == (0.4, 0.5, True)
    assert "A short training won 50% of its development episodes. It comes to 0.4" in found.text()
    failed = PlausibilityCheck(name="needs_cables", passed=False, measured=0.9, limit=0.5, message="wins without")
    policy = policy.model_copy(update={"checks": (failed,)})
    iteration.task_report.path.unlink()
    iteration.task_report.write(tried(0.3, decisive=False).model_copy(update={"policy": policy}))
    (found,) = lessons_of(run)
    assert (found.policy_success, found.policy_valid, found.worth) == (0.5, False, 0.4)
    assert "A short training won 50% of its development episodes, but not in a valid way. It comes" in found.text()


def test_the_same_evidence_is_kept_once_as_it_was_last_collected(tmp_path: Path) -> None:
    memory = kept(tmp_path, lesson(progress=0.5))
    assert memory.add([lesson(progress=0.6), lesson(evidence="b/1/01")]) == 1
    assert [each.progress for each in memory.lessons()] == [0.6, 0.5]


@pytest.mark.parametrize("separator", ["\u2028", "\u2029", "\x85", "\r", "\n"])
def test_a_name_with_a_line_separator_leaves_the_memory_readable(tmp_path: Path, separator: str) -> None:
    memory = kept(tmp_path, lesson(name=f"Worm{separator}2"), lesson(evidence="b/1/01"))
    assert [each.name for each in memory.lessons()] == [f"Worm{separator}2", "Worm"]


def test_where_there_are_lessons_of_one_job_alone_it_fills_them_all(tmp_path: Path) -> None:
    bodies = [lesson(evidence=f"a/{number}/01", family=f"worm {number}", progress=number / 20) for number in range(12)]
    assert len(kept(tmp_path, *bodies).recall("crawl through a tunnel", "free")) == 8


def test_the_likest_job_is_told_first_the_best_and_what_warns(tmp_path: Path) -> None:
    memory = kept(
        tmp_path,
        lesson(objective="lift a ball off a table", base="fixed", evidence="g/1/01", family="claw", progress=0.9),
        lesson(evidence="a/1/01", progress=0.2),
        lesson(evidence="a/2/01", name="Trotter", family="crawler", progress=1.0),
        lesson(evidence="a/2/02", family="crawler", progress=0.6, progress_before=1.0, changed=("legs",)),
    )  # fmt: skip
    told = [each.evidence for each in memory.recall("creep through a narrow tunnel", "free", 4)]
    assert told == ["a/2/01", "a/2/02", "a/1/01", "g/1/01"]
    assert told != [each.evidence for each in memory.recall("lift a block off a table", "fixed", 4)]
    assert memory.recall("lift a block off a table", "fixed", 4)[0].evidence == "g/1/01"
    texts = memory.tell("crawl through a tunnel", "free", 4)
    assert texts[0].startswith("Trotter (crawler, 4 actuators in 2 groups)")
    assert texts[-1].startswith("Job: lift a ball off a table Worm (claw")


def test_a_lesson_of_another_level_of_the_task_says_so(tmp_path: Path) -> None:
    memory = kept(tmp_path, lesson(task="locomotion/tunnel", level="standard"))
    objective = lesson().objective
    assert memory.tell(objective, "free", level="hard")[0].startswith("At level standard: Worm")
    assert memory.tell(objective, "free", level="standard")[0].startswith("Worm")


def test_a_run_at_another_level_is_told_the_level_of_its_lessons(tmp_path: Path) -> None:
    asked = brief()
    memory = kept(tmp_path, lesson(objective=asked.objective, level="standard"))
    config = new_run(tmp_path).asked().config.updated({"memory": str(memory.path)})
    run = create_run(asked, config, level="hard", runs=tmp_path)
    assert run.brief().lessons[0].startswith("At level standard: ")


def test_lessons_of_the_task_itself_can_be_left_out(tmp_path: Path) -> None:
    memory = kept(tmp_path, lesson(task="locomotion/tunnel"), lesson(task="locomotion/gap", evidence="b/1/01"))
    found = memory.recall("crawl through a tunnel", without=["locomotion/tunnel"])
    assert [each.task for each in found] == ["locomotion/gap"]


def test_an_archive_has_the_best_of_each_family_and_number_of_actuators() -> None:
    best, other = lesson(progress=0.7, evidence="b"), lesson(actuators=6, progress=0.1, evidence="c")
    assert elites([lesson(), best, other]) == (best, other)
    trained = lesson(progress=0.6, policy_success=0.3, evidence="d")
    assert elites([best, trained, other])[0] == trained


def test_a_run_tells_its_designer_and_keeps_what_it_told(tmp_path: Path) -> None:
    memory = kept(tmp_path, lesson(objective="reach", task=""))
    run = create_run(brief(), new_run(tmp_path).asked().config.updated({"memory": str(memory.path)}), runs=tmp_path)
    assert run.brief().lessons == memory.tell("reach")
    prompt = render("designer_propose", brief=run.brief(), environment="", count=3)
    assert f"- {lesson().text()}" in prompt
    assert "What earlier designs measured" not in render("designer_propose", brief=brief(), environment="", count=3)


def test_a_replay_is_told_what_the_recorded_run_was(tmp_path: Path) -> None:
    memory = kept(tmp_path, lesson(objective="reach"))
    config = new_run(tmp_path / "a").asked().config.updated({"memory": str(memory.path)})
    recorded = create_run(brief(), config, runs=tmp_path / "b")
    RecordedModel(Answering(), recorded.path).ask(Question(role="designer", messages=()))
    memory.add([lesson(objective="reach", evidence="c/1/01", family="arm")])
    replay = create_run(brief(), config.updated({"model": f"replay:{recorded.path}"}), runs=tmp_path / "c")
    assert replay.brief().lessons == recorded.brief().lessons
    assert len(create_run(brief(), config, runs=tmp_path / "d").brief().lessons) == 2


@pytest.mark.parametrize(
    ("content", "said"), [(None, "does not exist"), ("{}\n", "is not a memory: line 1 is no lesson")]
)
def test_a_run_refuses_what_is_no_memory(content: str | None, said: str, tmp_path: Path) -> None:
    file = tmp_path / "other.jsonl"
    if content is not None:
        file.write_text(content)
    with pytest.raises(UserError, match=said):
        create_run(brief(), new_run(tmp_path).asked().config.updated({"memory": str(file)}), runs=tmp_path)


def test_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = new_run(tmp_path / "runs")
    run_designs(run, parts(Scripted([Script()])))
    file = str(tmp_path / "lessons.jsonl")

    def aidsr(*words: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as ended:
            main(["memory", *words])
        told = capsys.readouterr()
        return int(ended.value.code or 0), told.out + told.err

    code, said = aidsr("add", file, str(run.path))
    assert code == 1
    assert "no measurements" in said
    run.design(1).iteration(1).task_report.write(tried(0.3, decisive=False))
    assert aidsr("add", file, str(run.path)) == (0, f"{file}: 1 new, 1 in total\n")
    assert "progress 0.30" in aidsr("show", file)[1]
    assert "progress 0.30" in aidsr("show", file, "--task", "tunnel")[1]
    assert aidsr("show", str(tmp_path / "none"))[0] == 2
