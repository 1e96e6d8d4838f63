"""Whole conversations with a scripted server: what is asked again, with which words, and when a role gives up."""

from __future__ import annotations

import json

import pytest
from agent_samples import BRIEF, CONCEPT, PLACEMENT, REPORT, ROBOT, SCENE

from aidsr.core.artifacts import Keep
from aidsr.core.calls import CallRecord, Question, Usage
from aidsr.core.errors import ReplyError
from aidsr.core.roles import Team
from aidsr.teams.llm import team
from aidsr.teams.llm.conversation import _describe_cutoff
from aidsr.teams.providers import Clock, connect
from loopback import Act, Fail, Loopback, Received, Say

IDEA = {name: f"some {name}" for name in ("name", "family", "morphology", "actuation", "functional_part")}
PROPOSAL = json.dumps(
    {"interpretation": "reach down", "concepts": [IDEA, IDEA | {"family": "other", "morphology": "rings"}]}
)
HEADER = '{"functional_part": "tip"}'
MJCF = ROBOT.mjcf


def team_at(server: Loopback, reasks: int = 2) -> Team:
    clock = Clock(now=lambda: 0.0, sleep=lambda _: None)
    return team(connect(f"m@{server.url}/v1", environ={}, clock=clock), reasks=reasks)


def turns(received: Received) -> list[tuple[str, str]]:
    return [(message["role"], message["content"]) for message in received.body["messages"]]


def test_a_whole_design_with_everything_that_can_go_wrong_on_the_way() -> None:
    script: list[Act] = [
        Say(f"Here:\n```json\n{PROPOSAL}\n```"),
        Fail(503),
        Say(f'{{"functional_part": "hand"}}\n```xml\n{MJCF}```'),
        Say(HEADER),
        Say('{"mount": "ceiling", "base": "fixed"}'),
        Say(PLACEMENT.model_dump_json()),
        Say('{"passed": true, "summary": "It can work."}'),
    ]
    with Loopback(script) as server:
        roles = team_at(server)
        concepts = roles.designer.propose(BRIEF, 2)
        robot = roles.coder.write(BRIEF, concepts[0])
        placement = roles.integrator.place(BRIEF, concepts[0], robot)
        critique = roles.judge.judge(BRIEF, concepts[0], robot, SCENE, REPORT)
    assert len(server.requests) == len(script)
    assert [concept.family for concept in concepts] == ["some family", "other"]
    assert (robot.mjcf, robot.functional_part) == (MJCF, "tip")
    assert placement == PLACEMENT
    assert critique.passed
    for received in server.requests:
        roles_in_turn = [role for role, _ in turns(received)]
        assert roles_in_turn[0] == "system"
        assert roles_in_turn[1:] == ["user", "assistant", "user"][: len(roles_in_turn) - 1]
        assert received.body["max_tokens"] == 20_000
    header_again, mount_again = turns(server.requests[3]), turns(server.requests[5])
    assert 'functional_part names "hand"' in header_again[-1][1]
    assert header_again[-2] == ("assistant", script[2].text)  # type: ignore[union-attr]
    assert 'There is no mount "ceiling"; there is mount, mount_carriage, world.' in mount_again[-1][1]


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (Say("", finish="stop"), "The reply was empty."),
        (Say("I cannot help with robots.", finish="refusal"), "The reply was a refusal."),
        *[
            (Say("<mujoco> and so on", finish="length", output_tokens=tokens), f"The reply was cut off {said}. Reply")
            for tokens, said in (
                (20_000, "at its limit of 20000 tokens"),
                (19_990, "at its limit of 20000 tokens"),
                (0, "at its limit of 20000 tokens"),
                (
                    300,
                    "after 300 tokens, before its limit of 20000: with a question of 100 tokens the model's context "
                    "was full, or its server has a limit of its own",
                ),
            )
        ],
    ],
)
def test_a_reply_that_is_none_is_asked_for_again_without_repeating_it(bad: Say, words: str) -> None:
    with Loopback([bad, bad, Say(f"{HEADER}\n{MJCF}")]) as server:
        assert team_at(server).coder.write(BRIEF, CONCEPT).mjcf == MJCF
    first, second, third = (turns(received) for received in server.requests)
    assert [role for role, _ in third] == ["system", "user"]
    assert second[1][1].startswith(first[1][1])
    assert third[1][1].startswith(second[1][1]), "each question differs, so a recorded one is never mistaken for it"
    assert words in second[1][1]
    assert third[1][1].count(words) == 2


def test_an_estimate_says_nothing_of_where_a_reply_was_cut_off() -> None:
    record = CallRecord(
        question=Question(role="coder", messages=()),
        model="m",
        reply="half a rob",
        finish="length",
        usage=Usage(output_tokens=300, tokens_estimated=True),
        started="2026-01-31T10:00:00Z",
    )
    assert _describe_cutoff(record) == "at its limit of 20000 tokens"


@pytest.mark.parametrize("reasks", [0, 1, 2])
def test_a_role_gives_up_after_so_many_replies(reasks: int) -> None:
    no_use = pytest.raises(ReplyError, match="The last one: It has no JSON object")
    with Loopback(lambda _: Say("No JSON today.")) as server, no_use:
        team_at(server, reasks).judge.judge(BRIEF, CONCEPT, ROBOT, SCENE, REPORT)
    assert len(server.requests) == 1 + reasks


def test_a_repair_is_a_patch_and_keeps_the_header() -> None:
    patch = '<patch><add sel="//body[@name=\'base\']"><geom name="shell" size="0.01"/></add></patch>'
    with Loopback([Say(f"```xml\n{patch}\n```")]) as server:
        mended = team_at(server).coder.repair(BRIEF, CONCEPT, ROBOT, REPORT)
    (_, (_, user)) = turns(server.requests[0])
    assert REPORT.account() in user
    assert '<geom name="shell" size="0.01"/>' in mended.mjcf
    assert mended.model_copy(update={"mjcf": ROBOT.mjcf}) == ROBOT


def test_a_patch_that_cannot_be_carried_out_is_asked_for_again_with_names_that_come_near() -> None:
    wrong = "<patch><remove sel=\"//general[@name='pull_aa']\"/></patch>"
    right = '<patch><set sel="//general[@name=\'pull_a\']" gear="2"/></patch>'
    with Loopback([Say(wrong), Say(right)]) as server:
        mended = team_at(server).coder.repair(BRIEF, CONCEPT, ROBOT, REPORT)
    assert "selects no element. Names that come near: pull_a, pull_b." in turns(server.requests[1])[-1][1]
    assert 'gear="2"' in mended.mjcf


def test_a_patch_may_come_with_a_new_header_or_be_a_whole_robot() -> None:
    patch = '<patch><set sel="//body[@name=\'base\']" name="root"/></patch>'
    header = '{"functional_part": "root"}'
    with Loopback([Say(f"{header}\n{patch}"), Say(f"{HEADER}\n{MJCF}")]) as server:
        coder = team_at(server).coder
        assert coder.repair(BRIEF, CONCEPT, ROBOT, REPORT).functional_part == "root"
        assert coder.repair(BRIEF, CONCEPT, ROBOT, REPORT).mjcf == MJCF


def test_what_a_person_wants_to_keep_is_compared() -> None:
    asked = BRIEF.model_copy(update={"starting_robot": MJCF, "keep": (Keep(name="pull_a"),)})
    changed = MJCF.replace('name="pull_a"', 'name="pull_a" gear="2"')
    with Loopback([Say(f"{HEADER}\n{changed}"), Say(f"{HEADER}\n{MJCF}")]) as server:
        assert team_at(server).coder.write(asked, CONCEPT).mjcf == MJCF
    assert "gear was not set and is 2" in turns(server.requests[1])[-1][1]


def test_a_robot_that_cannot_be_read_is_mended_whole() -> None:
    broken = ROBOT.model_copy(update={"mjcf": "<mujoco><body></mujoco>"})
    with Loopback([Say(f"{HEADER}\n{MJCF}")]) as server:
        team_at(server).coder.repair(BRIEF, CONCEPT, broken, REPORT)
    assert broken.mjcf in turns(server.requests[0])[-1][1]


@pytest.mark.parametrize("alike", [IDEA | {"name": "twin"}, IDEA | {"name": "twin", "family": "other"}])
def test_concepts_that_are_alike_are_asked_for_again_once(alike: dict[str, str]) -> None:
    twins = json.dumps({"interpretation": "reach down", "concepts": [IDEA, alike]})
    with Loopback([Say(twins), Say(twins)]) as server:
        concepts = team_at(server).designer.propose(BRIEF, 2)
    assert '"some name" and "twin" are nearly the same robot.' in turns(server.requests[1])[-1][1]
    assert [concept.name for concept in concepts] == ["some name", "twin"]


def test_a_revision_stays_one_concept() -> None:
    one = json.dumps({"interpretation": "reach down", "concepts": [IDEA]})
    with Loopback([Say(PROPOSAL), Say(one)]) as server:
        revised = team_at(server).designer.revise(BRIEF, CONCEPT, ROBOT, "Thinner.")
    assert revised.interpretation == "reach down"
    assert "It has 2 concepts; exactly 1 asked for." in turns(server.requests[1])[-1][1]


def test_a_reply_that_is_too_long_is_asked_for_again_without_it() -> None:
    with Loopback([Say("x" * 1_000_001), Say('{"passed": true, "summary": "It can work."}')]) as server:
        assert team_at(server).judge.judge(BRIEF, CONCEPT, ROBOT, SCENE, REPORT).passed
    last = turns(server.requests[1])[-1][1]
    assert "The reply has 1,000,001 characters; at most 1,000,000 are read." in last
    assert len(server.requests[1].body["messages"]) == 2
