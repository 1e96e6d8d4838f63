"""Whole runs of the measuring team: over a server that speaks tool calls, and by hand, with real tools."""

from __future__ import annotations

import io
import json
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from test_language_model_runs import arm

import aidsr
from aidsr.api import find_scene
from aidsr.apps.cli.reporting import print_result
from aidsr.core.artifacts import Decision, Keep
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import UserError
from aidsr.loop.run import create_run, make_brief, parts_of
from aidsr.loop.runner import run_designs
from aidsr.memory.collecting import lessons_of
from aidsr.runs import Run
from aidsr.runs.files import JsonFile
from aidsr.teams.measuring.exploration import Exploration
from aidsr.teams.measuring.records import ToolRecord
from aidsr.teams.providers.manual import pending_prompts
from loopback import Act, Fail, Loopback, Received, Say

TASK = "reaching/button_pushing"
FAMILIES = [{"name": name, "idea": "It pulls."} for name in ("arm", "claw", "ring", "worm")]
PLACEMENT = {"mount": "mount", "base": "fixed"}
ROUNDS: list[list[tuple[str, dict[str, Any]]]] = [
    [("propose", {"families": FAMILIES})],
    [("validate", {"mjcf": arm(), "functional_part": "tip", "family": one["name"]}) for one in FAMILIES],
    [
        ("assemble", {"robot": "robot_1", "placement": PLACEMENT}),
        *(("measure", {"what": "bends", "subject": f"robot_{number}"}) for number in (2, 3, 4)),
    ],
    [("keep", {"scene": "scene_1", "why": "the only one"})],
    [
        ("play", {"scene": "scene_1", "script": "m0: t=0 -1, t=1 1", "seconds": 0.4, "variation": number})
        for number in range(3)
    ],
    [("finish", {"scene": "scene_1", "summary": "An arm that bends to the side."})],
]
"""What the model calls in each reply."""


class Measuring:
    """Calls the tools of some rounds, in order; fails once it has answered so often."""

    def __init__(self, answers: int = 99, rounds: list[list[tuple[str, dict[str, Any]]]] = ROUNDS) -> None:
        self.answers, self.rounds = answers, iter(rounds)

    def __call__(self, received: Received) -> Act:
        if self.answers <= 0:
            return Fail(401, "the key is not known")
        self.answers -= 1
        return Say("", calls=tuple(next(self.rounds)), input_tokens=15_000, output_tokens=200)


def designed(server: Loopback, folder: Path, **settings: Any) -> Run:
    return aidsr.design(task=TASK, model=f"m@{server.url}/v1", team="measuring", concepts=1, runs=folder, **settings)


@pytest.fixture(autouse=True)
def _key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "none")


def results(run: Run) -> dict[str, bytes]:
    folder = run.design(1).path / "01" / "tools"
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_a_model_with_tools_designs_and_measures(tmp_path: Path) -> None:
    with Loopback(Measuring()) as server:
        run = designed(server, tmp_path)
    outcome = run.design(1).outcome.read()
    assert outcome is not None
    assert outcome.outcome == "approved", outcome.reason
    printed = io.StringIO()
    print_result(Console(file=printed), run)
    assert (
        "Design 1, approved: Passed by its designer, who measured it. It finished before its budget ended. An arm that "
        "bends to the side. Families proposed: arm, claw, ring, worm.\n"
    ) in printed.getvalue()
    assert len(server.requests) == len(ROUNDS)
    offered = {tool["function"]["name"] for tool in server.requests[0].body["tools"]}
    assert {"propose", "play", "sweep", "train", "finish"} <= offered
    assert "look" not in offered
    (lesson,) = lessons_of(run)
    assert (lesson.family, lesson.name, lesson.morphology, lesson.actuators) == ("arm", "robot_1", "It pulls.", 3)
    assert lesson.evidence == f"{run.path.name}/designs/1/01/work/scene_1"
    assert lesson.how.startswith("play: 0.4 s of development variation")
    assert 0.0 < lesson.progress < 1.0
    assert not lesson.solved
    assert lesson.found == "the only one"
    assert [name.partition("_")[2] for name in results(run)] == [
        f"{name}.json" for calls in ROUNDS for name, _ in calls
    ]
    told = [turn for turn in server.requests[-1].body["messages"] if turn["role"] == "tool"]
    assert [turn["tool_call_id"] for turn in told] == ["call_1", "call_2", "call_3"], "of the last reply alone"
    assert "Ended: all that was to be played was played" in told[-1]["content"].splitlines()[0]
    roles = [turn["role"] for turn in server.requests[-1].body["messages"]]
    assert roles == ["system", "user", "assistant", "tool", "tool", "tool", "user"]
    board = server.requests[-1].body["messages"][-1]["content"]
    assert "11 of 80 calls" in board
    assert "Kept: scene_1, the only one" in board
    record = {"name": "train", "arguments": '{"scene": "scene_1"}', "text": "", "outcome": "done", "seconds": 1.0}
    trained = ToolRecord(**record, figures={"success": 0.8, "valid": 0.0})
    JsonFile(run.design(1).path / "01" / "tools" / "99_train.json", ToolRecord).write(trained)
    (lesson,) = lessons_of(run)
    assert (lesson.policy_success, lesson.policy_valid) == (0.8, False)


def test_the_script_by_which_it_wins_goes_along_with_the_robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Exploration, "script_for", lambda _, scene: f"m0: 1  # {scene}")
    with Loopback(Measuring()) as server:
        run = designed(server, tmp_path)
    assert find_scene(run.design(1)).script == "m0: 1  # scene_1"


def test_all_families_are_written_placed_and_measured_in_one_reply(tmp_path: Path) -> None:
    first = [call for calls in ROUNDS[:3] for call in calls]
    with Loopback(Measuring(rounds=[first, *ROUNDS[3:]])) as server:
        run = designed(server, tmp_path)
    assert len(server.requests) == 4
    outcome = run.design(1).outcome.read()
    assert outcome is not None
    assert outcome.outcome == "approved", outcome.reason


def test_a_run_goes_on_without_asking_or_measuring_again(tmp_path: Path) -> None:
    with Loopback(Measuring(answers=5)) as server:
        run = designed(server, tmp_path)
    assert run.design(1).outcome.read() is None
    before = results(run)
    assert len(before) == 13
    record = run.record.path
    made_by_a_killed_call = run.design(1).path / "01" / "work" / "scene_2"
    made_by_a_killed_call.mkdir()
    with Loopback(Measuring(rounds=ROUNDS[5:])) as server:
        text = record.read_text()
        old = json.loads(text)["config"]["model"]
        record.write_text(text.replace(old, f"m@{server.url}/v1"))
        aidsr.resume(run, trust=True)
    assert len(server.requests) == 1, "only the last reply was missing"
    after = results(run)
    assert {name: after[name] for name in before} == before
    assert list(after)[13:] == ["0014_finish.json"]
    assert not made_by_a_killed_call.exists(), "the call is carried out again, under the same name"
    outcome = run.design(1).outcome.read()
    assert outcome is not None
    assert outcome.outcome == "approved"


def test_a_run_is_replayed_without_measuring_again(tmp_path: Path) -> None:
    with Loopback(Measuring()) as server:
        run = designed(server, tmp_path)
    again = aidsr.design(task=TASK, model=f"replay:{run.path}", team="measuring", concepts=1, runs=tmp_path / "again")
    assert results(again) == results(run)
    assert again.design(1).final_scene.read() == run.design(1).final_scene.read()
    asked, replayed = (one.design(1).iteration(1).calls for one in (run, again))
    assert [call.reply for call in replayed] == [call.reply for call in asked]
    assert [call.question.messages for call in replayed] == [call.question.messages for call in asked]


@pytest.mark.parametrize("change", [{"task": "reaching/pipe_inserting"}, {"tool_calls": 5}])
def test_a_replay_whose_prompts_differ_stops(tmp_path: Path, change: dict[str, Any]) -> None:
    with Loopback(Measuring()) as server:
        run = designed(server, tmp_path)
    settings = {"task": TASK, "team": "measuring", "concepts": 1, **change}
    again = aidsr.design(model=f"replay:{run.path}", runs=tmp_path / "again", **settings)
    (design,) = aidsr.read_status(again).designs
    assert (design.state, design.outcome) == ("stopped", None)
    assert design.stopped is not None
    assert "the prompt of the designer differs from every one that" in design.stopped.message


def test_what_was_kept_is_the_result_when_the_budget_ends(tmp_path: Path) -> None:
    with Loopback(Measuring()) as server:
        run = designed(server, tmp_path, budget=Budget(tokens=70_000), max_output_tokens=2000)
    outcome = run.design(1).outcome.read()
    assert outcome is not None
    assert len(server.requests) < len(ROUNDS), "the budget did not end before it finished"
    assert outcome.outcome == "approved", outcome.reason
    assert "The run may use 70,000 tokens; " in outcome.reason
    assert "Kept, not measured again: the only one. Families" in outcome.reason


THICKER = [
    [("propose", {"families": FAMILIES})],
    [
        ("validate", {"mjcf": changed, "functional_part": "tip", "family": "arm"})
        for changed in (
            arm().replace(
                'name="m0" tendon="t0" gear="-1" ctrlrange="0 12"', 'name="m0" tendon="t0" gear="-1" ctrlrange="0 9"'
            ),
            arm().replace('size="0.006"', 'size="0.0065"'),
        )
    ],
    [("assemble", {"robot": f"robot_{number}", "placement": PLACEMENT}) for number in (2, 3)],
    [
        ("play", {"scene": "scene_2", "script": "m0: t=0 -1, t=1 1", "seconds": 0.4, "variation": number})
        for number in range(3)
    ],
    [("finish", {"scene": "scene_2", "summary": "A thicker arm."})],
]
"""A session after the first one: one robot with a weaker cable, one with thicker segments."""


def test_a_refinement_starts_from_the_robot_and_keeps_what_is_to_be_kept(tmp_path: Path) -> None:
    keep = (Keep(name="m0"),)
    decisions = [Decision(verdict="refine", text="Make it thicker.", keep=keep), Decision(verdict="approve")]

    def person(*_: object) -> Decision:
        return decisions.pop(0)

    with Loopback(Measuring(rounds=[*ROUNDS, *THICKER])) as server:
        config = RunConfig(model=f"m@{server.url}/v1", team="measuring", concepts=1)
        run = create_run(make_brief(task=TASK), config, level="standard", runs=tmp_path)
        run_designs(run, replace(parts_of(run, trust=True), person=person))
        told = server.requests[len(ROUNDS)].body["messages"][1]["content"]
    assert "You have made this robot before, kept as `robot_1`. It came back: Make it thicker." in told
    folder = run.design(1).path / "02"
    assert (folder / "work" / "robot_1" / "robot.xml").read_text() == run.design(1).iteration(1).robot.read().mjcf
    refused = ToolRecord.model_validate_json((folder / "tools" / "0004_assemble.json").read_bytes())
    assert refused.outcome == "refused"
    assert "Of \"m0\", which is to be kept, <motor> 'm0' changed: ctrlrange was 0 12 and is 0 9." in refused.text
    final = run.design(1).final_robot.read()
    assert final is not None
    assert b'size="0.0065"' in final
    assert b'ctrlrange="0 12"' in final


def in_text(calls: list[tuple[str, dict[str, Any]]]) -> str:
    blocks = []
    for name, arguments in calls:
        rest = {key: value for key, value in arguments.items() if key != "mjcf"}
        blocks.append(f"```tool {name}\n{json.dumps(rest)}\n```")
        if "mjcf" in arguments:
            blocks.append(f"```argument mjcf\n{arguments['mjcf']}\n```")
    return "\n".join(blocks)


def test_by_hand_tools_are_called_in_text(tmp_path: Path) -> None:
    prompts, asked = tmp_path / "prompts", list[str]()
    over = threading.Event()

    def answer() -> None:
        while not over.is_set():
            for pending in pending_prompts(prompts):
                asked.append(pending.prompt.read_text(encoding="utf-8"))
                text = in_text(ROUNDS[len(asked) - 2]) if len(asked) > 1 else "I think."
                pending.reply.write_text(text, encoding="utf-8")
            time.sleep(0.05)

    person = threading.Thread(target=answer, daemon=True)
    person.start()
    run = aidsr.design(task=TASK, model=f"manual:{prompts}", team="measuring", concepts=1, runs=tmp_path)
    over.set()
    person.join()
    outcome = run.design(1).outcome.read()
    assert outcome is not None
    assert outcome.outcome == "approved", outcome.reason
    assert "**sweep**:" in asked[0]
    assert "No tool was called." in asked[1]
    assert "## 3. play" in asked[-1]
    assert len(asked) == 1 + len(ROUNDS)


def test_a_server_without_tools_is_told_of_them_in_words(tmp_path: Path) -> None:
    rounds = iter(ROUNDS)

    def words(received: Received) -> Act:
        return Say(in_text(next(rounds)))

    with Loopback(words) as server:
        run = designed(server, tmp_path, text_tools=True)
    outcome = run.design(1).outcome.read()
    assert outcome is not None
    assert outcome.outcome == "approved", outcome.reason
    assert not any("tools" in request.body for request in server.requests)


def test_one_that_calls_nothing_or_gives_up_ends_invalid(tmp_path: Path) -> None:
    with Loopback(lambda _: Say("I would rather talk.")) as server:
        talking = designed(server, tmp_path / "talking").design(1).outcome.read()
    assert talking is not None
    assert talking.outcome == "invalid"
    assert "called no tool in 3 replies" in talking.reason
    assert len(server.requests) == 3
    give_up = [ROUNDS[0], [("finish", {"scene": "", "summary": "No cable reaches it."})]]
    with Loopback(Measuring(rounds=give_up)) as server:
        given_up = designed(server, tmp_path / "given_up").design(1).outcome.read()
    assert given_up is not None
    assert (given_up.outcome, "gave up: No cable reaches it." in given_up.reason) == ("invalid", True)


def test_rules_and_ablations_are_no_measuring_team(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="the built-in rules cannot call tools"):
        aidsr.design(task=TASK, team="measuring", runs=tmp_path)
    with pytest.raises(UserError, match='the ablation "direct" applies to the four roles'):
        aidsr.design(task=TASK, model="m@http://127.0.0.1:9/v1", team="measuring", method="direct", runs=tmp_path)
