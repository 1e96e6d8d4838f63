"""Replies as models write them, good and bad, and what is said about each."""

from __future__ import annotations

import json

import pytest
from agent_samples import BRIEF, PLACEMENT, ROBOT

from aidsr.core.artifacts import Critique, Placement
from aidsr.core.errors import ReplyError
from aidsr.teams.llm.coder import _Reader
from aidsr.teams.llm.designer import _Reader as DesignerReader
from aidsr.teams.llm.integrator import _check_placement
from aidsr.teams.llm.replies import element_names, extract_mjcf, parse_json, validate_as

PLACE = '{"mount": "mount", "base": "fixed", "reason": "It {hangs}."}'
MJCF = ROBOT.mjcf.strip()
HEADER = '{"functional_part": "tip"}'


@pytest.mark.parametrize(
    "reply",
    [
        pytest.param(PLACE, id="bare"),
        pytest.param(f"```json\n{PLACE}\n```", id="fenced"),
        pytest.param(f"```\n{PLACE}\n```", id="fenced without a language"),
        pytest.param(f"```JSON\n{PLACE}\n```\n", id="fenced in capitals"),
        pytest.param(f"Gladly {{here}} it is:\n\n```json\n{PLACE}\n```\nDone {{now}}.", id="prose around a fence"),
        pytest.param(f"Using {{mounts}}:\n{PLACE}\nas asked.", id="prose around it bare"),
        pytest.param(f"The placement: {PLACE}", id="behind prose on one line"),
        pytest.param(f"With {{mounts}} the placement: {PLACE}", id="behind braces on one line"),
        pytest.param(f"```json\n{PLACE}", id="fence never closed"),
        pytest.param(f"  ```json\n  {PLACE}\n  ```", id="indented"),
        pytest.param(f"```python\nprint(1)\n```\n```json\n{PLACE}\n```", id="other code before"),
        pytest.param(PLACE.replace("It {", "It\n{"), id="line break inside a string"),
    ],
)
def test_json_is_found_wherever_it_stands(reply: str) -> None:
    assert validate_as(Placement, parse_json(reply)).mount == "mount"


@pytest.mark.parametrize(
    ("reply", "complaint"),
    [
        ("I think the mount is right.", "It has no JSON object; one was asked for in a fenced block."),
        (f"```json\n{PLACE}\n```\n```json\n{PLACE}\n```", "It has 2 JSON objects; exactly one was asked for."),
        (f"{PLACE}\n{PLACE}", "It has 2 JSON objects; exactly one was asked for."),
        (f"{PLACE} {PLACE}", "It has 2 JSON objects; exactly one was asked for."),
        ('{"mount": "mount", "base": ', "The JSON is not well-formed: Expecting value at line 1, column 28 of it."),
        (
            '```json\n{"mount": "mount"\n "base": "fixed"}\n```',
            "The JSON is not well-formed: Expecting ',' delimiter at line 2, column 2 of it.",
        ),
        (
            '{"mount": "mount", "base": "fixed", "scale": NaN}',
            "The JSON has NaN, which is not a JSON number.",
        ),
        ('{"base": "fixed"}', 'The field "mount" is missing.'),
        (
            '{"mount": "mount", "base": "fixed", "position": [0, 0, 0]}',
            'The field "position" is not known. Known are mount, base, position_m, rotation_deg, scale, '
            "functional_part, intended_contacts, reason.",
        ),
        (
            '{"mount": "mount", "base": "floating"}',
            "The field \"base\" is wrong: Input should be 'fixed' or 'free', found \"floating\".",
        ),
        (
            '{"mount": "mount", "base": "fixed", "position_m": [0, "high", 0]}',
            'The field "position_m[1]" is wrong: Input should be a valid number, unable to parse string as a number, '
            'found "high".',
        ),
        (
            '{"mount": "mount", "base": "fixed", "scale": 3}',
            'The field "scale" is wrong: Input should be less than or equal to 2, found 3.',
        ),
        (
            json.dumps({"mount": ["x" * 300], "base": "fixed"}),
            'The field "mount" is wrong: Input should be a valid string, found ["' + "x" * 58 + "….",
        ),
    ],
)
def test_what_is_wrong_is_said_exactly(reply: str, complaint: str) -> None:
    with pytest.raises(ReplyError) as caught:
        validate_as(Placement, parse_json(reply))
    assert str(caught.value) == complaint


@pytest.mark.parametrize("value", ["9" * 5_000, "[" * 100_000 + "]" * 100_000], ids=["digits", "depth"])
@pytest.mark.parametrize("reply", ['{{"scale": {}}}', '```json\n{{"scale": {}}}\n```'], ids=["bare", "fenced"])
def test_json_beyond_what_is_read_is_a_mistake_of_the_reply(reply: str, value: str) -> None:
    with pytest.raises(ReplyError, match="a number too long, or brackets nested too deep"):
        parse_json(reply.format(value))


def test_a_critique_that_contradicts_itself_is_asked_again() -> None:
    with pytest.raises(ReplyError, match="A passing critique has no issues and a failing one at least one"):
        validate_as(Critique, parse_json('{"passed": false, "summary": "bad"}'))


def test_many_problems_are_counted_not_listed() -> None:
    concept = dict.fromkeys(("name", "family", "morphology", "actuation", "functional_part"), 1)
    reply = json.dumps({"interpretation": "i", "concepts": [concept, concept]})
    with pytest.raises(ReplyError) as caught:
        DesignerReader(2).read(reply)
    assert 'The field "concepts[0].name" is wrong: Input should be a valid string, found 1.' in str(caught.value)
    assert str(caught.value).endswith("And 4 more of the kind.")


def test_the_number_of_concepts_is_kept() -> None:
    idea = dict.fromkeys(("name", "family", "morphology", "actuation", "functional_part"), "x")
    reply = json.dumps({"interpretation": "far away", "concepts": [idea, idea | {"family": "y"}]})
    assert [concept.interpretation for concept in DesignerReader(2).read(reply)] == ["far away", "far away"]
    with pytest.raises(ReplyError, match="It has 2 concepts; exactly 3 asked for"):
        DesignerReader(3).read(reply)


@pytest.mark.parametrize(
    "reply",
    [
        pytest.param(f"```json\n{HEADER}\n```\n```xml\n{MJCF}\n```", id="as asked"),
        pytest.param(f"```xml\n{MJCF}\n```\n```json\n{HEADER}\n```", id="the other way round"),
        pytest.param(f"Here.\n{HEADER}\n\n{MJCF}\nDone.", id="bare with prose"),
        pytest.param(f"Under one <mujoco>:\n{HEADER}\n{MJCF}\nAll stands before </mujoco>.", id="bare beside its tags"),
        pytest.param(f"{HEADER}\n```mjcf\n{MJCF}\n```", id="bare header"),
        pytest.param(f"```json\n{HEADER}\n```\n```xml\n{MJCF}", id="fence never closed"),
        pytest.param(f'```json\n{HEADER}\n```\n```xml\n<?xml version="1.0"?>\n{MJCF}\n```', id="with a declaration"),
    ],
)
def test_robots_are_found_wherever_they_stand(reply: str) -> None:
    robot = _Reader(BRIEF).read(reply)
    assert robot.functional_part == "tip"
    assert robot.mjcf.endswith(MJCF + "\n")


PATCH = "<patch><set sel=\"//general[@name='pull_a']\" gear='2'/></patch>"


@pytest.mark.parametrize(
    ("words", "notes"),
    [
        ("Done.", ROBOT.notes),
        ("The `<patch>` below makes it softer.", ROBOT.notes),
        (r"With $k = \frac{EI}{l}$ it is too stiff.", ROBOT.notes),
        ("New sites are called `{name}_mark`; the header stays.", ROBOT.notes),
        ('```json\n{"functional_part": "tip", "notes": "new"}\n```', "new"),
        ('As {name}:\n{"functional_part": "tip", "notes": "new"}', "new"),
        (r'With $k = \frac{EI}{l}$ the header is {"functional_part": "tip", "notes": "new"}.', "new"),
    ],
)
def test_a_header_holds_until_another_one_is_sent(words: str, notes: str) -> None:
    robot = _Reader(BRIEF, ROBOT).read(f"{words}\n```xml\n{PATCH}\n```")
    assert 'gear="2"' in robot.mjcf
    assert (robot.functional_part, robot.notes) == ("tip", notes)


@pytest.mark.parametrize(
    "header",
    [
        '```json\n{"functional_part": "tip",\n```',
        '```jsonc\n// as before\n{"functional_part": "tip"}\n```',
        "{'functional_part': 'tip'}",
        '{functional_part: "tip"}',
        'The header: {"functional_part": }',
    ],
)
def test_a_header_that_cannot_be_read_is_not_taken_for_none(header: str) -> None:
    with pytest.raises(ReplyError, match="the JSON header alone is enough now"):
        _Reader(BRIEF, ROBOT).read(f"{header}\n```xml\n{PATCH}\n```")


@pytest.mark.parametrize(
    ("reply", "complaint"),
    [
        (f"```json\n{HEADER}\n```", "It has no MJCF"),
        ("", "It has no MJCF"),
        (f"```xml\n{MJCF}\n```\n```xml\n{MJCF}\n```", "It has 2 XML blocks"),
        (f"```json\n{HEADER}\n```\n```xml\n{MJCF[:-20]}", "does not end with </mujoco>"),
        (f"```xml\n{MJCF}\n```", "It has no JSON object; one was asked for in a fenced block. The MJCF has arrived"),
        (f'{{"functional_part": "hand"}}\n{MJCF}', "no body or site of the MJCF has that name; it has base, tip."),
        (
            '{"functional_part": "tip", "actuator_groups": [{"name": "g", "actuators": ["pull_z"]}]}\n' + MJCF,
            "no actuator of the MJCF has that name; it has pull_a, pull_b.",
        ),
        (
            '{"functional_part": "tip", "actuator_groups": [{"name": "g", "actuators": ["pull_a", "pull_a"]}]}\n'
            + MJCF,
            'The actuator "pull_a" is in two places',
        ),
        (
            '{"functional_part": "tip", "actuator_groups": [{"name": "g", "actuators": []}]}\n' + MJCF,
            'The field "actuator_groups[0].actuators" is wrong',
        ),
    ],
)
def test_robots_that_cannot_be_used(reply: str, complaint: str) -> None:
    with pytest.raises(ReplyError) as caught:
        _Reader(BRIEF).read(reply)
    assert complaint in str(caught.value)


@pytest.mark.parametrize("kind", ["pid", "orientation", "dcmotor"])
def test_a_header_may_group_any_actuator_of_mjcf(kind: str) -> None:
    header = '{"functional_part": "tip", "actuator_groups": [{"name": "g", "actuators": ["turn"]}]}'
    turned = MJCF.replace("<actuator>", f'<actuator><{kind} name="turn"/>')
    assert _Reader(BRIEF).read(f"{header}\n{turned}").actuator_groups[0].actuators == ("turn",)


def test_a_wrong_header_is_put_right_by_a_header_alone() -> None:
    reader = _Reader(BRIEF)
    with pytest.raises(ReplyError, match="the JSON header alone is enough now"):
        reader.read(f'{{"functional_part": "hand"}}\n{MJCF}')
    assert reader.read(HEADER).mjcf == MJCF + "\n"


def test_a_broken_document_still_reaches_the_validator() -> None:
    """What is wrong inside the MJCF is for the validator to say, with line and place."""
    broken = MJCF.replace("</body>", "")
    assert _Reader(BRIEF).read(f"{HEADER}\n```xml\n{broken}\n```").mjcf == broken + "\n"


def test_names_are_read_without_comments_and_of_the_kind_asked() -> None:
    mjcf = "<mujoco><!-- <body name='old'/> --><body\n pos='0 0 0' name='new'><site name=\"s\"/></body></mujoco>"
    assert element_names(mjcf, "body", "site") == {"new", "s"}
    assert element_names(mjcf, "body") == {"new"}


def test_mjcf_that_is_not_there() -> None:
    assert extract_mjcf("no robot today") is None


@pytest.mark.parametrize(
    ("base", "placement", "complaint"),
    [
        ("fixed", {}, None),
        ("fixed", {"mount": "ceiling"}, 'There is no mount "ceiling"; there is mount, mount_carriage, world.'),
        ("fixed", {"mount": "world"}, 'not "world": mount, mount_carriage.'),
        ("fixed", {"base": "free"}, 'The job wants base "fixed", found "free".'),
        ("moving", {}, 'The job wants a mount that the environment moves: mount_carriage; "mount" stands still.'),
        ("moving", {"mount": "mount_carriage"}, None),
        ("free", {}, 'The job wants base "free", found "fixed".'),
        ("free", {"base": "free", "mount": "world"}, None),
        ("any", {"mount": "world"}, None),
        ("any", {"base": "free"}, None),
        (
            "fixed",
            {"intended_contacts": ("buton",)},
            "intended_contacts names buton; the bodies are button, housing, world.",
        ),
        (
            "fixed",
            {"functional_part": "hand"},
            'The robot has no body or site "hand"; leave functional_part empty to keep "tip".',
        ),
        ("fixed", {"functional_part": "base"}, None),
    ],
)
def test_a_placement_agrees_with_the_job(base: str, placement: dict[str, object], complaint: str | None) -> None:
    brief = BRIEF.model_copy(update={"base": base})
    found = _check_placement(PLACEMENT.model_copy(update=placement), brief, ROBOT)
    assert [text for text in found if complaint is None or complaint not in text] == []
    assert len(found) == (0 if complaint is None else 1)
