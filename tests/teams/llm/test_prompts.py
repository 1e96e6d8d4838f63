"""Every text that reaches a model, byte for byte. AIDSR_REWRITE_SNAPSHOTS=1 rewrites the files; read the difference."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest
from agent_samples import BRIEF, CONCEPT, CRITIQUE, PLACEMENT, REPORT, ROBOT, SCENE, SUMMARY

from aidsr.core.artifacts import Critique, EnvironmentSummary, Keep, Placement
from aidsr.core.calls import CallRecord, Question, ToolCall, Usage
from aidsr.core.errors import ReplyError
from aidsr.core.roles import Team
from aidsr.teams.llm import JudgeAgent, direct_team, prompts, team
from aidsr.teams.llm.coder import _Reader as CoderReader
from aidsr.teams.llm.describe_environment import describe_environment
from aidsr.teams.llm.designer import _Reader as DesignerReader
from aidsr.teams.llm.patch import apply_patch, extract_patch
from aidsr.teams.llm.prompts import render
from aidsr.teams.llm.replies import fenced_blocks, parse_json, validate_as
from aidsr.teams.measuring import ToolBudget, measuring_team
from aidsr.teams.measuring.records import Exchange, ToolRecord
from aidsr.teams.measuring.session import Session
from aidsr.teams.measuring.toolbox import Toolbox
from aidsr.tools import Workspace
from aidsr.validation.rules.winches import TENSION_NOTICED_N, TENSION_TO_WEIGHT

SNAPSHOTS = Path(__file__).parent / "snapshots"
FREE = BRIEF.model_copy(update={"base": "free", "needs_contact": False, "starting_robot": ROBOT.mjcf})
ANY = BRIEF.model_copy(update={"base": "any"})
UNREADABLE = ROBOT.model_copy(update={"mjcf": ROBOT.mjcf.replace("</body>", "")})
LIMB = ROBOT.model_copy(
    update={"mjcf": next(block.text for block in fenced_blocks(render("coder")) if block.language == "xml")}
)
"""A robot long enough to be shown shortened."""
MEASURED = REPORT.model_copy(
    update={
        "measurements": {
            "characteristic_length_m": 0.12,
            "moving_mass_kg": 0.0497,
            "chains": [8],
            "tendons": 2,
            "functional_part_m": [0.0, -0.0, 0.3725],
            "functional_part_at_rest_m": [0.0004, -0.0, 0.36949],
            "functional_part_pulled_m": {
                "robot/pull_a": [[0.012, 0.0, 0.355], [0.081, 0.0, 0.302]],
                "robot/pull_b": [[0.012, 0.0, 0.355], [0.081, 0.0, 0.302]],
                "robot/pull_c": [[-0.024, 0.001, 0.351], [-0.08, 0.0, 0.301]],
            },
            "free_bodies_at_rest_m": {"ball": [0.1, 0.0, 0.021]},
            "effect_over_length": {"robot/pull_a": 0.913, "robot/pull_b": 0.913, "robot/pull_c": 0.913},
            "motors": {
                actuator: {"tension_n": 10.0, "stroke_m": 0.0213, "power_w": 1.3}
                for actuator in ("robot/pull_a", "robot/pull_b")
            },
        }
    }
)
SMALLER = SCENE.model_copy(update={"placement": PLACEMENT.model_copy(update={"scale": 0.9})})
MOVING = BRIEF.model_copy(update={"base": "moving"})


@dataclass
class Listener:
    """A model that keeps what it is asked and says nothing of use."""

    name: str = "listener"
    heard: list[Question] = field(default_factory=list)

    def ask(self, question: Question) -> CallRecord:
        self.heard.append(question)
        return CallRecord(
            question=question, model=self.name, reply="Hm.", finish="stop", usage=Usage(calls=1), started="2026-01-01"
        )


def heard_from(job: Callable[[Team], object], reasks: int = 0, made: Callable[..., Team] = team) -> list[Question]:
    listener = Listener()
    with pytest.raises(ReplyError):
        job(made(listener, reasks=reasks))
    return listener.heard


KEEPING = FREE.model_copy(update={"keep": (Keep(name="pull_a"), Keep(name="base", but=("mass", "size")))})
JOBS: dict[str, Callable[[Team], object]] = {
    "designer_propose": lambda t: t.designer.propose(BRIEF, 3),
    "designer_propose_one_free_from_own_robot": lambda t: t.designer.propose(FREE, 1),
    "designer_propose_any_base": lambda t: t.designer.propose(ANY, 2),
    "designer_propose_with_lessons": lambda t: t.designer.propose(TAUGHT, 3),
    "designer_revise": lambda t: t.designer.revise(BRIEF, CONCEPT, ROBOT, "Make it thinner.\n"),
    "designer_revise_limb": lambda t: t.designer.revise(BRIEF, CONCEPT, LIMB, "Make it thinner."),
    "designer_revise_before_robot": lambda t: t.designer.revise(BRIEF, CONCEPT, None, "Make it thinner."),
    "coder_write": lambda t: t.coder.write(BRIEF, CONCEPT),
    "coder_write_from_own_robot": lambda t: t.coder.write(FREE, CONCEPT),
    "coder_write_keeping": lambda t: t.coder.write(KEEPING, CONCEPT),
    "coder_edit_keeping": lambda t: t.coder.repair(KEEPING, CONCEPT, ROBOT, REPORT),
    "coder_repair_faults": lambda t: t.coder.repair(BRIEF, CONCEPT, UNREADABLE, REPORT),
    "coder_edit_faults": lambda t: t.coder.repair(BRIEF, CONCEPT, ROBOT, REPORT),
    "coder_edit_critique": lambda t: t.coder.repair(FREE, CONCEPT, LIMB, CRITIQUE),
    "integrator_place": lambda t: t.integrator.place(MOVING, CONCEPT, ROBOT),
    "integrator_adjust_faults": lambda t: t.integrator.adjust(BRIEF, CONCEPT, ROBOT, PLACEMENT, REPORT),
    "integrator_place_limb": lambda t: t.integrator.place(BRIEF, CONCEPT, LIMB),
    "judge_scene_limb": lambda t: t.judge.judge(BRIEF, CONCEPT, LIMB, SCENE, MEASURED),
    "judge_scene": lambda t: t.judge.judge(BRIEF, CONCEPT, ROBOT, SCENE, REPORT),
    "judge_scene_scaled": lambda t: t.judge.judge(BRIEF, CONCEPT, ROBOT, SMALLER, REPORT),
    "judge_scene_tried": lambda t: t.judge.judge(BRIEF, CONCEPT, ROBOT, SCENE, TRIED),
    "judge_scene_seen": lambda t: seeing(t.judge).judge(BRIEF, CONCEPT, ROBOT, SCENE, REPORT),
}
TAUGHT = BRIEF.model_copy(
    update={"lessons": ("Curling arm (arm, 3 actuators in 2 groups): … Measured: progress 0.45 …", "Job: Reach. …")}
)
TRIED = REPORT.model_copy(
    update={"measurements": {"trial": 'No search reaches "pressed".\n- 40 motions: progress 0.45'}}
)
PICTURES = {"The scene as it stands.": b"\x89PNG 1", "It moves.": b"\x89PNG 2"}


def seeing(judge: JudgeAgent) -> JudgeAgent:
    return replace(judge, pictures=lambda _scene: PICTURES)


def agrees(name: str, text: str) -> None:
    """Compare a text with its snapshot; the validator's account belongs to the validator's own tests."""
    text = text.replace(REPORT.account(), "<the validator's account>")
    path = SNAPSHOTS / f"{name}.md"
    if os.environ.get("AIDSR_REWRITE_SNAPSHOTS") == "1":
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    assert path.exists(), f"no snapshot {path.name}; AIDSR_REWRITE_SNAPSHOTS=1 writes it"
    assert path.read_bytes() == text.encode(), f"{path.name} differs; if that is wanted, AIDSR_REWRITE_SNAPSHOTS=1"


@pytest.mark.parametrize("name", JOBS)
def test_what_a_role_is_told_for_one_job(name: str) -> None:
    (question,) = heard_from(JOBS[name])
    assert [message.role for message in question.messages] == ["system", "user"]
    assert question.role == name.partition("_")[0]
    assert question.max_output_tokens == 20_000
    agrees(name, question.messages[1].text)


@pytest.mark.parametrize(
    ("role", "jobs"),
    [
        ("designer", "designer_"),
        ("coder", ("coder_write", "coder_repair")),
        ("coder_editor", "coder_edit"),
        ("integrator", "integrator_"),
        ("judge", "judge_"),
    ],
)
def test_what_a_role_is_always_told(role: str, jobs: str | tuple[str, ...]) -> None:
    agrees(role, render(role))
    told = {heard_from(job)[0].messages[0].text for name, job in JOBS.items() if name.startswith(jobs)}
    assert told == {render(role)}, "a prefix that changes cannot be cached by a provider"


def test_what_a_role_is_told_when_its_reply_is_of_no_use() -> None:
    first, second, third = heard_from(JOBS["judge_scene"], reasks=2)
    assert second.messages[:2] == first.messages
    assert third.messages[:4] == second.messages
    assert [message.role for message in third.messages] == ["system", "user", "assistant", "user", "assistant", "user"]
    agrees("reask", third.messages[-1].text)


def test_pictures_stand_after_the_words_that_speak_of_them_also_when_it_is_asked_again() -> None:
    asked = heard_from(JOBS["judge_scene_seen"], reasks=2)
    for question in asked:
        shown = [message.pictures for message in question.messages]
        assert shown == [(), tuple(PICTURES.values()), *[()] * (len(shown) - 2)]
    assert "1. The scene as it stands.\n2. It moves.\n" in asked[0].messages[1].text


@pytest.mark.parametrize("prompt", ["designer", "coder", "coder_editor", "measuring"])
def test_the_greatest_pull_is_that_of_the_validator(prompt: str) -> None:
    told = (SNAPSHOTS / f"{prompt}.md").read_text(encoding="utf-8")
    assert f"above {TENSION_NOTICED_N:g} N at most {TENSION_TO_WEIGHT:g} times the weight" in " ".join(told.split())


def test_what_direct_prompting_says() -> None:
    (question,) = heard_from(lambda t: t.coder.write(BRIEF, t.designer.propose(BRIEF, 2)[1]), made=direct_team)
    assert [message.role for message in question.messages] == ["system", "user"]
    agrees("direct_system", question.messages[0].text)
    agrees("direct", question.messages[1].text)


def measuring_heard(folder: Path, job: Callable[[Team], object]) -> list[Question]:
    listener = Listener()
    with pytest.raises(ReplyError, match="called no tool in 3 replies"):
        job(measuring_team(listener, folder, budget=ToolBudget(80, 60)))
    return listener.heard


def test_what_the_measuring_team_is_told(tmp_path: Path) -> None:
    numbered = CONCEPT.model_copy(update={"name": "Measured design 1 of 3", "rationale": ""})
    first, second, _ = measuring_heard(tmp_path, lambda t: t.coder.write(BRIEF, numbered))
    agrees("measuring", first.messages[0].text)
    agrees("measuring_start", first.messages[1].text)
    assert [message.role for message in second.messages] == ["system", "user", "assistant", "user"]
    agrees("measuring_no_call", second.messages[3].text)


def test_what_it_is_told_once_every_family_was_measured(tmp_path: Path) -> None:
    """The last reply and its results, the board with a body that is worked on, and the laws without the guide."""

    def result(tool: str, text: str, figures: dict[str, float] | None = None, **arguments: object) -> ToolRecord:
        values = {"name": tool, "arguments": json.dumps(arguments), "text": text, "figures": figures or {}}
        return ToolRecord(**values, outcome="done", seconds=30.0)

    box = Toolbox(Workspace(tmp_path), tmp_path, ToolBudget(80, 60))
    robot = box.workspace.add_robot(ROBOT)
    families = [{"name": "arm", "idea": "It bends."}, {"name": "claw", "idea": "It closes."}]
    made = result("validate", f"{robot}: stable\nlength 120 mm", mjcf=ROBOT.mjcf, family="arm")
    script = "a: mean 0.5\nb: -1"
    rounds = [
        [result("propose", "noted: arm, claw", families=families), made],
        [result("assemble", "scene_1: stable; robot_1 in the environment", robot=robot)],
        [result("play", "won 3 of 8", {"progress": 0.6}, scene="scene_1", script=script, variations=[0, 1, 2])],
        [result("keep", "kept scene_1", scene="scene_1", why="It won 3 of 8.")],
    ]
    exchanges = [
        Exchange(
            "Long arms sag." if number == 0 else "",
            tuple(ToolCall(id=str(i), name=one.name, arguments=one.arguments) for i, one in enumerate(each, 1)),
            tuple(each),
        )
        for number, each in enumerate(rounds)
    ]
    session = Session(Listener(), box)
    early, later = (session.told("The job.", exchanges[:count], native=False) for count in (1, 4))
    assert "Families of which no body was measured yet: arm, claw." in early[3].text
    assert "(kept as robot_1)" in early[2].text, "the MJCF stands once"
    box.explore = False
    system, _, _, last = session.told("The job.", exchanges, native=False)
    agrees("measuring_later", system.text)
    agrees("measuring_board", last.text)
    assert len(later) == 4


def test_what_it_is_told_of_a_robot_that_came_back(tmp_path: Path) -> None:
    asked = CONCEPT.model_copy(update={"name": "Measured design 1 of 3", "rationale": "Make it thinner."})
    first, *_ = measuring_heard(tmp_path, lambda t: t.coder.repair(BRIEF, asked, ROBOT, CRITIQUE))
    agrees("measuring_start_again", first.messages[1].text)


def test_every_text_of_the_room_is_in_a_snapshot() -> None:
    """A line of a prompt's file that no snapshot shows would be a text that nobody looks at."""
    shown = "\n".join(path.read_text(encoding="utf-8") for path in SNAPSHOTS.glob("*.md"))
    for path in Path(prompts.__file__).parent.glob("*.md"):
        for line in path.read_text(encoding="utf-8").splitlines():
            if line.strip() and "{" not in line:
                assert line in shown, f"{path.name}: {line}"


def test_no_snapshot_is_left_over() -> None:
    names = {
        *JOBS,
        "measuring",
        "measuring_start",
        "measuring_start_again",
        "measuring_no_call",
        "measuring_later",
        "measuring_board",
        "direct",
        "direct_system",
        "designer",
        "coder",
        "coder_editor",
        "integrator",
        "judge",
        "reask",
    }
    assert {path.stem for path in SNAPSHOTS.glob("*.md")} == names


def test_no_placeholder_is_left_open() -> None:
    for path in SNAPSHOTS.glob("*.md"):
        assert not re.search(r"\{\{|\{%|\bNone\b|Undefined", path.read_text(encoding="utf-8")), path.name


def test_the_job_comes_first_so_that_calls_share_it() -> None:
    write, repair = (heard_from(JOBS[name])[0].messages[1].text for name in ("coder_write", "coder_repair_faults"))
    job_and_concept = write.partition("# What to reply")[0]
    assert CONCEPT.rationale in job_and_concept
    assert repair.startswith(job_and_concept)


def test_the_patch_that_is_shown_can_be_carried_out() -> None:
    patch = extract_patch(render("coder_editor"))
    with_old = LIMB.mjcf.replace(
        "</sensor>", '<framepos name="old_position" objtype="site" objname="flex_1a"/></sensor>'
    )
    assert 'name="pad_touch"' in apply_patch(with_old, patch)


def test_the_examples_in_the_prompts_are_replies_that_can_be_used() -> None:
    assert len(DesignerReader(1).read(render("designer"))) == 1
    assert validate_as(Placement, parse_json(render("integrator"))).scale == 0.9
    assert not validate_as(Critique, parse_json(render("judge"))).passed


def test_the_header_and_the_limb_of_the_guide_make_a_robot() -> None:
    header = fenced_blocks(render("coder"))[0]
    limb = next(block for block in fenced_blocks(render("coder")) if block.language == "xml")
    robot = CoderReader(BRIEF).read(f"```json\n{header.text}```\n```xml\n{limb.text}```")
    assert robot.functional_part == "fingertip"


def test_an_empty_environment_leaves_no_empty_headings() -> None:
    empty = EnvironmentSummary(
        gravity_m_s2=(0, 0, 0), timestep_s=0.001, mounts=(), bodies=(), sites=(), sensors=(), actuators=()
    )
    assert describe_environment(empty) == (
        "Gravity 0 0 0 m/s2, time step 0.001 s. Lengths in metres; positions in world coordinates at the start. "
        "Friction 1 unless stated otherwise; at contacts it replaces the robot's own."
    )


def test_numbers_are_short_and_never_minus_zero() -> None:
    text = describe_environment(SUMMARY)
    assert "-0 " not in text
    assert "0.2523," in text


def test_the_judge_is_told_of_every_actuator_and_in_short() -> None:
    actuators = [f"robot/pull_section_{number}" for number in range(16)]
    measurements = {
        **MEASURED.measurements,
        "effect_over_length": {name: 0.5 + number / 100 for number, name in enumerate(actuators)},
        "motors": {name: {"tension_n": 10.25, "stroke_m": 0.02125} for name in actuators},
        "functional_part_pulled_m": {
            name: [[0.0123, number / 100, 0.3456], [0.0456, number / 100, 0.2345]]
            for number, name in enumerate(actuators)
        },
    }
    long = MEASURED.model_copy(update={"measurements": measurements})
    said, bare = (
        heard_from(lambda t, report=report: t.judge.judge(BRIEF, CONCEPT, ROBOT, SCENE, report))[0].messages[-1].text
        for report in (long, REPORT)
    )
    assert 500 < len(said.encode()) - len(bare.encode()) < 2400
    (places,) = (line for line in said.splitlines() if "one actuator alone is half of its pull" in line)
    assert all(name in places for name in actuators)
