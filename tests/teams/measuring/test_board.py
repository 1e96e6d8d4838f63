"""What a session tells of its work so far: short however long it lasts, nothing lost, the same when it goes on."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from tests.scenes import small_arm
from tests.teams.measuring.test_toolbox import FAMILIES, toolbox
from tests.tools.test_statics import limb

from aidsr.core.calls import CallRecord, Message, Question, ToolCall
from aidsr.teams.measuring.board import Board
from aidsr.teams.measuring.records import Exchange, ToolRecord
from aidsr.teams.measuring.session import AT_ONCE, Session
from aidsr.teams.measuring.toolbox import Toolbox
from aidsr.tools.probing import MEAN_PROGRESS


class Nobody:
    name = "nobody"

    def ask(self, question: Question) -> CallRecord:
        raise AssertionError(question)


def asked(tool: str, /, **arguments: object) -> ToolCall:
    return ToolCall(id=f"call_{tool}", name=tool, arguments=json.dumps(arguments))


def carried_out(box: Toolbox, exchanges: Sequence[Exchange], *calls: ToolCall, said: str = "") -> Exchange:
    return Exchange(said, calls, Session(Nobody(), box)._results(calls, exchanges))


def of(call: ToolCall, text: str, seconds: float = 6.0, **figures: float) -> ToolRecord:
    """A result as a long measurement leaves it."""
    values = {"name": call.name, "arguments": call.arguments, "text": text, "figures": figures}
    return ToolRecord(**values, outcome="done", seconds=seconds)


def exchanged(*pairs: tuple[ToolCall, ToolRecord], said: str = "") -> Exchange:
    return Exchange(said, tuple(call for call, _ in pairs), tuple(result for _, result in pairs))


def begun(folder: Path) -> tuple[Toolbox, list[Exchange]]:
    """Four families, of which each has a sound robot, in one reply."""
    box = toolbox(folder, calls=60, minutes=600)
    bodies = (small_arm().replace("<worldbody>", f"<worldbody><!-- {each['name']} -->") for each in FAMILIES)
    written = (
        asked("validate", mjcf=mjcf, family=each["name"], mount="fixed")
        for mjcf, each in zip(bodies, FAMILIES, strict=True)
    )
    return box, [carried_out(box, [], asked("propose", families=FAMILIES), *written, said="Gravity is along x.")]


def probe(scene: str, progress: float, seed: int = 0) -> tuple[ToolCall, ToolRecord]:
    call = asked("probe", scene=scene, seeds=[seed])
    return call, of(call, f"{MEAN_PROGRESS} {progress}\n" + "a long story\n" * 40, **{MEAN_PROGRESS: progress})


def assembled(robot: str, scene: str) -> tuple[ToolCall, ToolRecord]:
    call = asked("assemble", robot=robot)
    return call, of(call, f"{scene}: stable; {robot} in the environment")


def told(box: Toolbox, exchanges: Sequence[Exchange], *, native: bool = False) -> tuple[Message, ...]:
    return Session(Nobody(), box).told("The job.", exchanges, native=native)


def size(messages: Sequence[Message]) -> int:
    return sum(len(message.model_dump_json()) for message in messages)


def test_a_question_stays_short_however_long_the_work_lasts(tmp_path: Path) -> None:
    box, exchanges = begun(tmp_path)
    exchanges.append(exchanged(*(assembled(f"robot_{n}", f"scene_{n}") for n in range(1, 5))))
    sizes = []
    for seed in range(30):
        exchanges.append(exchanged(*(probe(f"scene_{n}", n / 10, seed) for n in range(1, 5))))
        sizes.append(size(told(box, exchanges)))
    assert [message.role for message in told(box, exchanges)] == ["system", "user", "assistant", "user"]
    assert sizes[-1] < sizes[9] + 200, sizes
    assert told(box, exchanges)[-1].text.count("a long story") == 4 * 40, "older results are told in a line"


def test_the_board_has_every_body_with_its_best_figure_and_what_was_said(tmp_path: Path) -> None:
    box, exchanges = begun(tmp_path)
    exchanges.append(exchanged(*(assembled(f"robot_{n}", f"scene_{n}") for n in range(1, 5))))
    play = asked("play", scene="scene_2", script="a: 1\nb: -1", variations=[0, 3])
    exchanges.append(
        exchanged(probe("scene_1", 0.3), (play, of(play, "won 1 of 2", progress=0.8)), probe("scene_2", 0.5, 7))
    )
    keep = asked("keep", scene="scene_2", why="It comes farthest.")
    exchanges.append(exchanged((keep, of(keep, "kept scene_2", 0.0))))
    board = Board(exchanges, box, native=False).text()
    assert "11 of 60 calls are used.\n" in board
    assert "Families of which no body was measured yet: worm, ring." in board
    assert "Kept: scene_2, It comes farthest." in board
    assert "You noted: Gravity is along x." in board
    for number, family in enumerate(("arm", "claw", "worm", "ring"), 1):
        assert f"- robot_{number} ({family}): " in board
        assert f"placed as scene_{number} stable" in board
    assert f"  - probe scene_1 seeds [0]: {MEAN_PROGRESS} 0.3\n" in board
    assert "  - play scene_2 variations [0, 3]: won 1 of 2; script: a: 1 / b: -1\n" in board


def test_the_same_work_in_other_minutes_is_told_alike_until_half_of_them_are_used(tmp_path: Path) -> None:
    """Else a transcript could be replayed on a machine of the same speed alone."""
    box, exchanges = begun(tmp_path)

    def after(minutes: float) -> str:
        call = asked("probe", scene="scene_1")
        return Board([*exchanges, exchanged((call, of(call, "far", 60 * minutes)))], box, native=False).text()

    assert after(3) == after(280)
    assert "5 of 60 calls are used, and more than half of the 600 minutes.\n" in after(301)


def test_only_what_is_worked_on_is_told_as_mjcf(tmp_path: Path) -> None:
    box, exchanges = begun(tmp_path)
    assert Board(exchanges, box, native=False).worked_on() == (), "of four sound ones nothing says which is the best"
    assert "(kept as robot_3)" in told(box, exchanges)[2].text
    assert "<mujoco" not in told(box, exchanges)[2].text
    exchanges.append(exchanged(*(assembled(f"robot_{n}", f"scene_{n}") for n in range(1, 5))))
    exchanges.append(exchanged(*(probe(f"scene_{n}", n == 2) for n in range(1, 5))))
    assert Board(exchanges, box, native=False).worked_on() == ("robot_2",), "the last of a list is not being changed"
    exchanges.append(
        carried_out(box, exchanges, asked("edit", robot="robot_2", patch='<set sel="//joint" stiffness="0.3"/>'))
    )
    assert Board(exchanges, box, native=False).worked_on() == ("robot_5",), "what it came from is nearly the same"
    assert 'stiffness="0.3"' in told(box, exchanges)[-1].text
    assert box.call(asked("read", name="robot_1")).text.count("<mujoco") == 1, "the others can be had back"


def test_what_has_to_be_cured_is_told_as_mjcf_and_what_could_not_be_read_stays_in_the_reply(tmp_path: Path) -> None:
    box, exchanges = begun(tmp_path)
    texts = ("no document", "<mujoco><worldbody>", limb())
    calls = (asked("validate", mjcf=mjcf, family="arm") for mjcf in texts)
    exchanges.append(carried_out(box, exchanges, *calls))
    nothing, unread, faulty = exchanges[-1].results
    assert (nothing.outcome, unread.made, faulty.made) == ("failed", "robot_6", "robot_7")
    assert faulty.headline.startswith("robot_7: not stable")
    assert Board(exchanges, box, native=False).worked_on() == ("robot_6", "robot_7")
    _, _, said, brought = told(box, exchanges)
    assert "no document" in said.text
    assert "<mujoco><worldbody>\n```" in brought.text


def test_calls_and_results_stay_paired_and_the_board_is_the_same_for_tools_and_for_text(tmp_path: Path) -> None:
    box, exchanges = begun(tmp_path)
    *_, said, brought = told(box, exchanges, native=True)
    assert [call.id for call in said.tool_calls] == [output.id for output in brought.tool_outputs]
    assert len(said.tool_calls) == 5
    assert json.loads(said.tool_calls[1].arguments)["mjcf"] == "(kept as robot_1)"
    assert said.text == "Gravity is along x."
    in_text = told(box, exchanges)[-1].text
    assert in_text.endswith(brought.text)
    assert brought.text.startswith("# Where you stand")


def test_a_session_that_goes_on_is_told_the_same_though_its_later_results_are_there(tmp_path: Path) -> None:
    box, exchanges = begun(tmp_path)
    before = told(box, exchanges)
    carried_out(box, exchanges, asked("propose", families=[*FAMILIES[:3], {"name": "tree", "idea": "It grows."}]))
    carried_out(box, exchanges, asked("measure", what="bends", subject="robot_1"))
    again, first = begun(tmp_path)
    assert told(again, first) == before


def test_the_guide_is_told_while_first_bodies_are_written_and_can_be_had_back(tmp_path: Path) -> None:
    box, exchanges = begun(tmp_path)
    law, detail = "mu g L^3 / EI below 6", "**Closed loops.**"
    assert detail in told(box, exchanges)[0].text
    exchanges.append(exchanged(*(assembled(f"robot_{n}", f"scene_{n}") for n in range(1, 5))))
    exchanges.append(exchanged(*(probe(f"scene_{n}", 0.1) for n in range(1, 5))))
    later = told(box, exchanges)[0].text
    assert law in later
    assert "**In scope**" in later
    assert detail not in later
    assert detail in box.call(asked("read", name="guide")).text


def test_a_call_that_made_nothing_uses_its_name_up_and_the_others_go_on(tmp_path: Path) -> None:
    box = toolbox(tmp_path, calls=60)
    calls = (
        asked("propose", families=FAMILIES),
        asked("validate", mjcf=limb(), family="arm"),
        asked("validate", mjcf="no document", family="claw"),
        asked("validate", mjcf=limb(9.81), family="worm"),
        asked("measure", what="bends", subject="robot_3"),
        asked("measure", what="bends", subject="robot_2"),
    )
    first = carried_out(box, [], *calls)
    assert [one.outcome for one in first.results] == ["done", "done", "failed", "done", "done", "refused"]
    assert first.results[3].made == "robot_3"
    assert "robot_2 does not exist" in first.results[2].text
    assert "robot_2 does not exist" in first.results[5].text
    assert "robots: robot_1, robot_3" in carried_out(box, [first], asked("fix", robot="robot_9")).results[0].text


def test_a_session_that_goes_on_uses_no_other_names_up(tmp_path: Path) -> None:
    calls = (
        asked("propose", families=FAMILIES),
        asked("validate", mjcf="no document", family="claw"),
        asked("validate", mjcf=limb(9.81), family="worm"),
    )
    first = carried_out(toolbox(tmp_path, calls=60), [], *calls)
    again = carried_out(toolbox(tmp_path, calls=60), [], *calls, asked("validate", mjcf=limb(), family="arm"))
    assert again.results[:3] == first.results
    assert again.results[3].made == "robot_3"


def test_names_of_a_reply_are_not_followed_once_one_of_its_calls_repeats_another(tmp_path: Path) -> None:
    box = toolbox(tmp_path, calls=60)
    calls = (
        asked("propose", families=FAMILIES),
        asked("validate", mjcf=limb(), family="arm"),
        asked("validate", mjcf=limb(), family="arm"),
        asked("validate", mjcf=limb(9.81), family="worm"),
        asked("measure", what="bends", subject="robot_3"),
    )
    first = carried_out(box, [], *calls)
    assert [one.outcome for one in first.results] == ["done", "done", "done", "done", "refused"]
    assert "call 3, validate, was made before and brought robot_1 again" in first.results[4].text
    second = carried_out(box, [first], asked("measure", what="bends", subject="robot_2"))
    assert second.results[0].outcome == "done"


def test_names_of_a_reply_are_not_followed_once_one_of_its_calls_repeats_one_that_failed(tmp_path: Path) -> None:
    box = toolbox(tmp_path, calls=60)
    calls = (
        asked("propose", families=FAMILIES),
        asked("validate", mjcf="no document", family="claw"),
        asked("validate", mjcf="no document", family="claw"),
        asked("validate", mjcf=limb(9.81), family="worm"),
        asked("measure", what="bends", subject="robot_2"),
    )
    first = carried_out(box, [], *calls)
    assert [one.outcome for one in first.results] == ["done", "failed", "failed", "done", "refused"]
    assert "call 3, validate, failed before and uses up no other name" in first.results[4].text
    second = carried_out(box, [first], asked("measure", what="bends", subject="robot_2"))
    assert second.results[0].outcome == "done"


def test_at_most_so_many_calls_of_a_reply_are_carried_out(tmp_path: Path) -> None:
    box, exchanges = begun(tmp_path)
    many = [asked("measure", what="bends", subject="robot_1")] * (AT_ONCE + 1)
    *done, last = carried_out(box, exchanges, *many).results
    assert {one.outcome for one in done} == {"done"}
    assert (last.outcome, f"at most {AT_ONCE} calls in a reply" in last.text) == ("refused", True)
