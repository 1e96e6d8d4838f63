"""Every parser of foreign text as a target of fuzzing: real texts to start from, and how they are read.

The texts are those of a run and a study that version 0.1.0 wrote; a mutation puts hostile values and pieces into them.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from aidsr.core.calls import CallRecord, Question, Usage
from aidsr.core.errors import AidsrError
from aidsr.runs import Run
from aidsr.runs.trainings import Training, trainings_of

_WRITTEN = Path(__file__).parent / "data" / "written_by_0_1_0"
_MARK = "the value that is replaced"
VALUES = (
    "null", "true", "-1", "0", "1e999", "NaN", "-Infinity", "1" + "0" * 400, "9" * 5000, "1e308", "0.5",
    '""', '"x"', '"\\u001b[2J"', '"\\ud800"', '"\\u0000"', '"../../x"', '"<script>"', '"[/]"', '"$x^{$"', '"²"',
    '"2026-01-31T10:00:00"', '"' + "x" * 5000 + '"', "[]", "{}", "[null]", '{"a": {"b": [1]}}',
    "[" * 150 + "]" * 150, "[" * 5000 + "]" * 5000, '{"a":' * 3000 + "1" + "}" * 3000,
)  # fmt: skip
"""JSON values that are wrong somewhere: numbers past all bounds, texts with controls, nesting."""
PIECES = (
    "<mujoco>", "</mujoco>", "<!--", "-->", "]]>", "<![CDATA[", "```", "```xml", "```json", "{", "}", "[", "]", "[[a]]",
    '"', "'", '"""', "\\", "\n", "\r", "\x00", "\x1b[2J", "\ufeff", "\u2028", "é", "NaN", "1e999", "9" * 5000, "=", ",",
    "<patch>", "</patch>", '<add sel="//*">', "<remove sel='/'/>", "a.b.c", "${x}", "{{ x }}", "²", "-", "",
)  # fmt: skip
TOML_VALUES = (
    "-1", "1e999", "nan", "inf", "9" * 5000, '""', "''", "true", "[]", "[[[]]]", "{}", "{a = {b = 1}}", "1979-05-27",
    "0xffffffffffffffffffffff", '"../.."', '"\\u001b"', "[" * 3000, "{a=" * 3000, "[1, 'a', {}]",
    '"' + "x" * 5000 + '"',
)  # fmt: skip


@dataclass(frozen=True)
class Target:
    """A parser of foreign text."""

    texts: Sequence[str] = field(repr=False)
    """What it was made to read."""
    read: Callable[[str, Path], Any]
    """Reads a text, with a folder of its own at hand."""
    form: str = "text"
    """ "json" and "toml" also have single values replaced."""

    def mutations(self) -> st.SearchStrategy[str]:
        """Return texts that are nearly what the parser reads."""
        text = st.sampled_from(self.texts)
        spliced = text.flatmap(_spliced)
        if self.form == "json":
            return st.one_of(text.flatmap(_with_other_values), text.flatmap(_with_other_values), spliced)
        if self.form == "toml":
            return st.one_of(text.flatmap(_with_other_lines), spliced)
        return spliced


@st.composite
def _with_other_values(draw: st.DrawFn, text: str) -> str:
    """The lines of JSON, one value of which is another."""
    try:
        value = json.loads(text)
    except ValueError:  # a line of several
        lines = text.splitlines(keepends=True)
        index = draw(st.integers(0, len(lines) - 1))
        lines[index] = draw(_with_other_values(lines[index])) + "\n"
        return "".join(lines)
    places = list(_places(value))
    holder, key = draw(st.sampled_from(places))
    if draw(st.booleans()) or not isinstance(holder, dict):
        holder[key] = _MARK
    else:
        del holder[key]
    return json.dumps(value).replace(json.dumps(_MARK), draw(st.sampled_from(VALUES)))


def _places(value: Any) -> Any:
    for key, inner in list(value.items() if isinstance(value, dict) else enumerate(value)):
        yield value, key
        if isinstance(inner, dict | list):
            yield from _places(inner)


@st.composite
def _with_other_lines(draw: st.DrawFn, text: str) -> str:
    lines = text.splitlines()
    index = draw(st.sampled_from([number for number, line in enumerate(lines) if "=" in line]))
    key = lines[index].partition("=")[0]
    lines[index] = f"{key}= {draw(st.sampled_from(TOML_VALUES))}" if draw(st.booleans()) else ""
    return "\n".join(lines)


@st.composite
def _spliced(draw: st.DrawFn, text: str) -> str:
    """A text with pieces put in, left out and repeated."""
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.sampled_from([0, 0, 1, 7, 200, 10_000])))
        text = text[:start] + draw(st.sampled_from(PIECES)) * draw(st.sampled_from([0, 1, 1, 2, 300])) + text[end:]
    return text


class Answering:
    """A language model that answers every question with the same text."""

    name = "answering"

    def __init__(self, reply: str) -> None:
        self.reply = reply

    def ask(self, question: Question) -> CallRecord:
        usage = Usage(calls=1, input_tokens=1, output_tokens=1)
        return CallRecord(question=question, model="x", reply=self.reply, finish="stop", usage=usage, started="2026")


def unpack(folder: Path) -> tuple[Run, Path]:
    """Return the run and the study of version 0.1.0, unpacked into a folder."""
    for name in ("run.zip", "study.zip"):
        with zipfile.ZipFile(_WRITTEN / name) as archive:
            archive.extractall(folder)
    (run,) = (path.parent for path in folder.glob("*/run.json"))
    record = (run / "run.json").read_text()
    (run / "run.json").write_text(record.replace("/lab/desk", (folder / "desk").as_posix()))
    return Run(run), folder / "study"


def targets(folder: Path) -> dict[str, Target]:
    """Return all parsers of foreign text, by name.

    Args:
        folder: Of their own.
    """
    run, study = unpack(folder)
    replies = {call.question.role: call.reply for call in _calls(run)}
    coded = [call.reply for call in _calls(run) if call.question.role == "coder"]
    goals = [
        'kind = "reach"\ntarget = "ball"\nwithin_m = 0.02\nhold_s = 0.5\ntime_limit_s = 10\nvary_m = [0, 0.1, 0]\n',
        'kind = "travel"\ntarget = "ball"\ndistance_m = 0.1\ndirection = [1, 0, 0]\n',
        'kind = "touch"\ntarget = "ball"\nforce_n = 0.1\nat_most_n = 1\npart = "robot"\n',
    ]
    return {
        "MJCF": Target([(run.path / "environment.xml").read_text(), replies["coder"]], _read_mjcf),
        "replies of the Designer": Target([replies["designer"]], _designer(run)),
        "replies of the Coder": Target(coded, _coder(run)),
        "replies of the Integrator": Target([replies["integrator"]], _integrator(run)),
        "replies of the Judge": Target([replies["judge"]], _judge(run)),
        "goals": Target(goals, _read_goal, "toml"),
        "study plans": Target([(study / "study.toml").read_text()], _read_study, "toml"),
        "submissions": Target([(study / "submission.json").read_text()], _read_submission, "json"),
        "replies of a provider": Target([json.dumps(reply) for reply in _wire_replies()], _read_wire, "json"),
        "decisions": Target(['{"verdict": "refine", "text": "longer"}'], _decision(run), "json"),
        **{
            f"file {name}": Target([_text(run.path / name)], _file(run, name), "json")
            for name in sorted(path.relative_to(run.path).as_posix() for path in run.path.rglob("*"))
            if name.endswith((".json", ".jsonl", ".csv")) and "/export/" not in name
        },
    }


def _text(path: Path) -> str:
    return path.read_text("utf-8")


def _calls(run: Run) -> list[CallRecord]:
    return [*run.calls, *(call for design in run.designs for it in design.iterations for call in it.calls)]


def _read_mjcf(text: str, _folder: Path) -> None:
    from aidsr.fixes import fix
    from aidsr.mjcf.read import read_mjcf

    fix(text)
    read_mjcf(text)


def _designer(run: Run) -> Callable[[str, Path], Any]:
    from aidsr.teams.llm import team

    return lambda text, _: team(Answering(text)).designer.propose(run.brief(), 1)


def _coder(run: Run) -> Callable[[str, Path], Any]:
    from aidsr.teams.llm import team

    first, brief = run.design(1).iterations[0], run.brief()
    concept, robot = _present(first.concept.read()), _present(first.robot.read())
    report = _present(first.robot_report.read())

    def read(text: str, _folder: Path) -> None:
        coder = team(Answering(text)).coder
        _try(lambda: coder.write(brief, concept))
        coder.repair(brief, concept, robot, report)

    return read


def _integrator(run: Run) -> Callable[[str, Path], Any]:
    from aidsr.teams.llm import team

    second, brief = run.design(1).iterations[1], run.brief()
    concept, robot = _present(run.design(1).iterations[0].concept.read()), _present(second.robot.read())
    return lambda text, _: team(Answering(text)).integrator.place(brief, concept, robot)


def _judge(run: Run) -> Callable[[str, Path], Any]:
    from aidsr.teams.llm import team

    second, brief = run.design(1).iterations[1], run.brief()
    concept, robot = _present(run.design(1).iterations[0].concept.read()), _present(second.robot.read())
    scene, report = _present(second.scene.read()), _present(second.scene_report.read())
    return lambda text, _: team(Answering(text)).judge.judge(brief, concept, robot, scene, report)


def _present(value: Any) -> Any:
    assert value is not None
    return value


def _try(step: Callable[[], object]) -> None:
    try:
        step()
    except AidsrError:
        return


def _read_goal(text: str, _folder: Path) -> None:
    from aidsr.tasks import goal_task
    from aidsr.tasks.goals import parse_goal

    goal_task(
        parse_goal(text),
        '<mujoco><worldbody><body name="ball"><freejoint/><geom size="0.03"/></body></worldbody></mujoco>',
    )


def _read_study(text: str, folder: Path) -> None:
    from aidsr.studies.outcomes import read_outcomes
    from aidsr.studies.study import open_study

    (folder / "plan").mkdir(exist_ok=True)
    (folder / "plan" / "study.toml").write_text(text, "utf-8")
    plan = open_study(folder / "plan")
    if plan.plan.runs * len(plan.plan.arms) < 100:
        read_outcomes(plan)


def _read_submission(text: str, folder: Path) -> None:
    from aidsr.studies.leaderboard import leaderboard
    from aidsr.studies.submission import Submission, with_hash

    path = folder / "submission.json"
    path.write_text(text, "utf-8")
    _try(lambda: leaderboard([path]))
    try:
        found = Submission.model_validate_json(text)
    except ValueError:
        return
    path.write_text(with_hash(found).model_dump_json())
    leaderboard([path])


def _wire_replies() -> list[dict[str, Any]]:
    from loopback import Say, reply_of

    say = Say("```json\n{}\n```", cost_usd=0.1)
    return [
        reply_of(path, say) for path in ("/chat/completions", "/responses", "/messages", "/models/x:generateContent")
    ]


def _read_wire(text: str, _folder: Path) -> None:
    from aidsr.core.calls import Message
    from aidsr.teams.providers import RetryPolicy, connect
    from loopback import Loopback, Raw

    question = Question(role="coder", messages=(Message(role="user", text="Write it."),), max_output_tokens=100)
    with Loopback(lambda _: Raw(text.encode("utf-8", "replace"))) as server:
        environ = {
            "OPENAI_API_KEY": "sk-loop",
            "ANTHROPIC_API_KEY": "sk-loop",
            "GOOGLE_API_KEY": "sk-loop",
            "OPENAI_BASE_URL": f"{server.url}/v1",
            "ANTHROPIC_BASE_URL": server.url,
            "GOOGLE_BASE_URL": server.url,
        }
        for name in ("openai:gpt-5", "anthropic:claude-opus-4-8", "google:gemini-2.5-pro", f"x@{server.url}/v1"):
            model = connect(name, environ=environ, retry=RetryPolicy(attempts=1))
            _try(lambda model=model: model.ask(question).model_dump_json())


def _decision(run: Run) -> Callable[[str, Path], Any]:
    from aidsr.runs.status import decided

    iteration = run.design(1).iteration(2)

    def read(text: str, _folder: Path) -> None:
        iteration.decision.path.write_text(text, "utf-8")
        try:
            decided(iteration)
            _view(run)
        finally:
            iteration.decision.path.unlink()

    return read


def _file(run: Run, name: str) -> Callable[[str, Path], Any]:
    def read(text: str, _folder: Path) -> None:
        path = run.path / name
        before = path.read_bytes()
        path.write_text(text, "utf-8")
        try:
            if "/training/" in name:
                _view_training(trainings_of(run.design(1))[0])
            else:
                _view(run)
        finally:
            path.write_bytes(before)

    return read


def _view(run: Run) -> None:
    """Read what commands and the web app show of a run."""
    from aidsr.runs import read_status, write_summary
    from aidsr.teams.providers.replay import ReplayedModel

    _try(lambda: read_status(run))
    _try(lambda: write_summary(run))
    _try(lambda: ReplayedModel(run.path))


def _view_training(training: Training) -> None:
    from aidsr.learn.rl.policy import TrainedPolicy
    from aidsr.learn.rl.training_config import TrainingConfig
    from aidsr.learn.rl.training_folder import TrainingFolder, TrainingResult
    from aidsr.runs.trainings import read_curve, verdict_in_words

    home = TrainingFolder(training.path)

    def load() -> None:
        config = home.read("config.json", TrainingConfig)
        TrainedPolicy.load(training.path, config.recipe, len(config.groups))

    for step in (
        lambda: verdict_in_words(training),
        lambda: read_curve(training),
        lambda: home.read("training.json", TrainingResult),
        load,
    ):
        _try(step)
