"""Reading MJCF from strangers: each hostile or broken text ends in a clear fault, at once, with nothing left behind."""

from __future__ import annotations

import re
from dataclasses import asdict
from pathlib import Path

import mujoco
import pytest

from aidsr.core.errors import MjcfError, UserError
from aidsr.mjcf.read import canonical, open_mjcf, read_mjcf
from aidsr.mjcf.schema import mjcf_schema
from aidsr.mjcf.size_limits import SizeLimits

GOOD = '<mujoco>\n<worldbody>\n<body name="a"><geom size="0.1"/></body>\n</worldbody>\n</mujoco>'


def world(inside: str, sections: str = "") -> str:
    return f"<mujoco>\n<worldbody>\n{inside}\n</worldbody>\n{sections}\n</mujoco>"


def faults(text: str) -> list[tuple[str, int | None]]:
    with pytest.raises(MjcfError) as caught:
        read_mjcf(text)
    return [(fault.code, fault.line) for fault in caught.value.faults]


def message(text: str) -> str:
    with pytest.raises(MjcfError) as caught:
        read_mjcf(text)
    return "\n".join(f"{fault.message} {fault.cure}" for fault in caught.value.faults)


def nested(tag: str, times: int, inside: str) -> str:
    return f"<{tag}>" * times + inside + f"</{tag.split(maxsplit=1)[0]}>" * times


ROD = '<default><default class="rod"><geom fromto="0 0 0 0 0 1"/></default></default>'

BILLION_LAUGHS = (
    '<!DOCTYPE m [<!ENTITY a "ha">'
    + "".join(f'<!ENTITY {b} "&{a};&{a};&{a};&{a};&{a};">' for a, b in zip("abcdefgh", "bcdefghi", strict=True))
    + ']>\n<mujoco model="&i;"/>'
)

HOSTILE = {
    "empty": ("", "xml_syntax", "the text is empty"),
    "only_spaces": (" \n\t ", "xml_syntax", "the text is empty"),
    "prose": ("I cannot help with that.", "xml_syntax", "not well-formed XML at line 1, column 1"),
    "cut_short": (GOOD[:60], "xml_syntax", "line 3, column"),
    "mismatched": (world("<body></geom>"), "xml_syntax", "Opening and ending tag mismatch"),
    "null_byte": (world("\x00"), "xml_syntax", "not well-formed XML at line 3"),
    "lone_surrogate": (world('<body name="\ud800"/>'), "xml_syntax", "not Unicode"),
    "urdf": ('<robot name="r"/>', "unknown_element", "the root element is <robot> (this is URDF)"),
    "other_root": ("<worldbody/>", "unknown_element", "the root element is <worldbody>, expected <mujoco>"),
    "namespace": ('<mujoco xmlns="urn:x"/>', "unknown_element", "expected <mujoco>"),
    "entities": (BILLION_LAUGHS, "forbidden", "<!DOCTYPE> is not allowed"),
    "outside_entity": (
        '<!DOCTYPE m [<!ENTITY x SYSTEM "file:///etc/passwd">]><mujoco model="&x;"/>',
        "forbidden",
        "<!DOCTYPE> is not allowed",
    ),
    "undeclared_entity": ('<mujoco model="&x;"/>', "xml_syntax", "Entity 'x' not defined"),
    "include": ('<mujoco><include file="/etc/passwd"/></mujoco>', "forbidden", "<include>: not allowed"),
    "mesh_file": (
        '<mujoco><asset><mesh name="m" file="/etc/passwd"/></asset></mujoco>',
        "forbidden",
        "<mesh> 'm': attribute 'file'",
    ),
    "texture_file": ('<mujoco><asset><texture fileup="a.png"/></asset></mujoco>', "forbidden", "attribute 'fileup'"),
    "height_file": ('<mujoco><asset><hfield name="h" file="a"/></asset></mujoco>', "forbidden", "attribute 'file'"),
    "skin_file": ('<mujoco><asset><skin file="a.skn"/></asset></mujoco>', "forbidden", "attribute 'file'"),
    "flex_file": (world('<flexcomp name="f" type="gmsh" file="a.msh"/>'), "forbidden", "attribute 'file'"),
    "other_model": ('<mujoco><asset><model name="m" file="a"/></asset></mujoco>', "forbidden", "<model> 'm': not"),
    "folder": ('<mujoco><compiler meshdir="/etc"/></mujoco>', "forbidden", "attribute 'meshdir'"),
    "decoder": ('<mujoco><asset><mesh content_type="x"/></asset></mujoco>', "forbidden", "attribute 'content_type'"),
    "extension": ('<mujoco><extension><plugin plugin="p"/></extension></mujoco>', "forbidden", "<extension>: not"),
    "plugin": (world('<body><plugin plugin="p"/></body>'), "forbidden", "<plugin>: not allowed"),
    "attach": (world('<attach model="m"/>'), "forbidden", "<attach>: not allowed"),
    "replicas": (
        world(nested('replicate count="100"', 3, '<geom size="1"/>')),
        "forbidden",
        "geoms, joints, sites and other parts: 1000000, at most 20000",
    ),
    "replicated_bodies": (
        world(nested('replicate count="1000"', 2, '<body><geom size="1"/></body>')),
        "forbidden",
        "bodies: 1000000, at most 2000 allowed",
    ),
    "flexible_sheet": (world('<flexcomp name="f" count="400 400 1"/>'), "forbidden", "bodies: 160000"),
    "composite": (world('<composite type="cable" count="100000 1 1"/>'), "forbidden", "bodies: 100000"),
    "infinite_count": (world('<replicate count="inf"><geom size="1"/></replicate>'), "forbidden", "parts: inf"),
    "deep": (world(nested("body", 210, "")), "forbidden", "elements inside each other: 212, at most 200"),
    "very_deep": (world(nested("body", 5000, "")), "forbidden", "elements inside each other"),
    "many": (world('<site name="s"/>' * 30_000), "forbidden", "elements: 30002, at most 20000"),
    "long_list": (
        f'<mujoco><asset><mesh name="m" vertex="{"0 " * 60_000}"/></asset></mujoco>',
        "forbidden",
        "values in 'vertex': 60000",
    ),
    "keyframes": ("<mujoco><keyframe>" + "<key/>" * 200 + "</keyframe></mujoco>", "forbidden", "keyframes: 200"),
    "reserved_keyframes": ('<mujoco><size nkey="100000000"/></mujoco>', "forbidden", "'nkey': 100000000"),
    "memory": ('<mujoco><size memory="900G"/></mujoco>', "forbidden", "'memory' in MiB: 921600, at most 1024"),
    "memory_in_bytes": (f'<mujoco><size memory="{"9" * 40}"/></mujoco>', "forbidden", "'memory' in MiB"),
    "texture": (
        '<mujoco><asset><texture name="t" builtin="flat" width="100000" height="1"/></asset></mujoco>',
        "forbidden",
        "'width': 100000, at most 4096",
    ),
    "picture": ('<mujoco><visual><global offwidth="65536"/></visual></mujoco>', "forbidden", "'offwidth': 65536"),
    "history": ('<mujoco><sensor><clock nsample="1e9"/></sensor></mujoco>', "forbidden", "'nsample': 1e+09"),
    "nan": (world('<geom size="nan"/>'), "bad_value", '<geom>: size="nan" is not a finite number'),
    "infinity": (world('<geom size="1" pos="inf 0 0"/>'), "bad_value", 'pos="inf 0 0" is not a finite number'),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_texts_end_in_a_clear_fault(name: str) -> None:
    text, code, words = HOSTILE[name]
    assert faults(text)[0][0] == code
    assert words in message(text)


def test_50_mb_are_refused_before_they_are_parsed(tmp_path: Path) -> None:
    huge = "<mujoco>" + "<a>" * 17_000_000
    assert faults(huge) == [("forbidden", None)]
    assert "51,000,008 characters, at most 4,194,304 are read" in message(huge)
    file = tmp_path / "huge.xml"
    with file.open("wb") as sparse:
        sparse.truncate(50 * 2**20)
    with pytest.raises(MjcfError, match="52,428,800 characters"):
        open_mjcf(file)


def test_bounds_can_be_narrowed() -> None:
    with pytest.raises(MjcfError, match="elements: 4, at most 3"):
        read_mjcf(GOOD, SizeLimits(elements=3))


def test_open_ends_of_ranges_may_be_infinite() -> None:
    read_mjcf(world('<body><joint name="j"/><geom size="1"/></body>', ACTUATOR_WITHOUT_LIMIT))


ACTUATOR_WITHOUT_LIMIT = '<actuator><motor joint="j" forcerange="-inf inf"/></actuator>'


@pytest.mark.parametrize(
    ("text", "first_line", "put_aside"),
    [
        (GOOD, 1, False),
        (f"\ufeff{GOOD}\n", 1, False),
        (f'<?xml version="1.0" encoding="utf-16"?>\n<!-- <mujoco> of mine -->\n{GOOD}\n<!-- end -->', 3, False),
        (f"Here is the robot:\n\n```xml\n{GOOD}\n```\nIt bends.", 4, True),
        (f"```\n{GOOD}\n```", 2, True),
        (f"```xml\n{GOOD}", 2, True),
        (f"A <mujoco> model:\n```xml\n<geom/>\n```\n```xml\n{GOOD}\n```", 6, True),
        (f"{GOOD}\nThe <mujoco> element holds it all.", 1, True),
    ],
)
def test_what_stands_around_the_document_is_put_aside(text: str, first_line: int, put_aside: bool) -> None:
    document = read_mjcf(text)
    assert document.root.sourceline == first_line
    assert bool(document.notes) == put_aside
    assert "mujoco" in document.text


def test_lines_count_from_the_beginning_of_the_text() -> None:
    text = "Here:\n```xml\n" + GOOD.replace('size="0.1"', 'sizze="0.1"') + "\n```"
    assert faults(text) == [("unknown_attribute", 5)]


def test_a_syntax_error_has_line_and_column() -> None:
    assert "at line 3, column 24" in message(world('<body name="a" name="b"/>'))
    assert faults(world('<body name="a" name="b"/>')) == [("xml_syntax", 3)]


def test_all_faults_come_at_once_with_their_lines() -> None:
    text = world(
        '<body name="a" mass="1">\n<jiont/>\n<geom name="g" size="1" fromto="0 0 0 1 0 0"/>\n'
        '<geom name="g" size="1"/>\n<motor/>\n</body>\n<include file="x"/>',
        '<tendon><spatial name="t"><site site="s1"/></spatial></tendon>',
    )
    assert faults(text) == [
        ("forbidden", 9),
        ("unknown_attribute", 3),
        ("unknown_element", 4),
        ("wrong_for_type", 5),
        ("duplicate_name", 6),
        ("unknown_element", 7),
        ("undefined_reference", 11),
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (world('<body><joint stifness="1"/></body>'), "did you mean 'stiffness'?"),
        (world('<body><joint ctrl_range="0 1"/></body>'), "'ctrlrange' belongs to <"),
        (world('<camera orthographic="true"/>'), 'write projection="orthographic" for true'),
        (world('<body mass="1"/>'), "'mass' belongs to <flexcomp>, <geom>, <inertial>"),
        (world("<body><jiont/></body>"), "did you mean <joint>?"),
        (world("<body><motor/></body>"), "cannot stand in <body>"),
        (world('<frame eulr="0 0 1"/>'), "did you mean 'euler'?"),
        (world('<replicate count="2" ofset="1 0 0"/>'), "did you mean 'offset'?"),
        (world('<body><inertial mass="1" pos="0 0 0"/><inertial mass="1" pos="0 0 0"/></body>'), "more than once"),
        (
            world('<site name="s1"/><site name="s2"/>', '<sensor><touch site="s3"/></sensor>'),
            "names a site that does not exist: s3 the series runs from s1 to s2",
        ),
        (world('<site name="grip"/>', '<sensor><touch site="gripp"/></sensor>'), "did you mean 'grip'?"),
        (world('<site name="x"/>', '<sensor><touch site="tip"/></sensor>'), "the document has sites: x"),
        (world("", '<sensor><framepos objtype="xbody" objname="b"/></sensor>'), "names a body that does not exist: b"),
        (world('<geom size="1" material="steel"/>'), "names a material that does not exist: steel"),
        (world('<geom size="1" class="soft"/>'), "names a default class that does not exist: soft"),
        (
            world(
                '<geom class="rod" size="1"/>',
                ROD,
            ),
            "has fromto (from default class 'rod') and is a sphere, which has no two ends",
        ),
        (
            world(
                '<body childclass="rod"><geom size="1" pos="0 0 1" type="capsule"/></body>',
                ROD,
            ),
            "has both fromto (from default class 'rod') and pos",
        ),
    ],
)
def test_a_fault_says_what_would_be_right(text: str, words: str) -> None:
    assert words in message(text)


def test_a_pos_of_zeros_beside_fromto_is_what_mujoco_takes_it_for() -> None:
    """Nothing: MuJoCo compiles the document, and fromto holds."""
    capsule = '<geom type="capsule" size="0.01" fromto="0 0 0 0 0 1" pos="{}"/>'
    text = world(f"<body>{capsule.format('0 0 0')}</body>")
    assert read_mjcf(text).text == text
    assert mujoco.MjModel.from_xml_string(text).geom_pos[0].tolist() == [0, 0, 0.5]
    assert "has both fromto and pos" in message(world(f"<body>{capsule.format('0 0 1e-9')}</body>"))


def test_missing_names_of_a_kind_make_one_fault() -> None:
    sites = "".join(f'<site site="s{number}"/>' for number in range(1, 41))
    with pytest.raises(MjcfError) as caught:
        read_mjcf(world("", f'<tendon><spatial name="t">{sites}</spatial></tendon>'))
    (fault,) = caught.value.faults
    assert fault.names == tuple(f"s{number}" for number in range(1, 41))
    assert "s1, s2" in fault.message
    assert "and 28 more" in fault.message


def test_names_that_mujoco_makes_up_are_left_to_mujoco() -> None:
    read_mjcf(
        world(
            '<replicate count="3" offset="1 0 0"><body><site name="s"/><geom size="1"/></body></replicate>',
            '<tendon><spatial><site site="s0"/><site site="s2"/></spatial></tendon>',
        )
    )


def test_colours_are_not_taken_for_names() -> None:
    read_mjcf('<mujoco><visual><rgba joint="1 0 0 1" camera="0 1 0 1"/></visual></mujoco>')


def test_mujoco_gets_what_was_checked_and_nothing_else() -> None:
    text = '<mujoco><!-- <geom size="1"/> --><worldbody>stray<body\n name="a&amp;&quot;"/>' + "</worldbody></mujoco>"
    written, owners = canonical(read_mjcf(text).root)
    assert written == '<mujoco>\n<worldbody>\n<body name="a&amp;&quot;"/>\n</worldbody>\n</mujoco>'
    assert [owner.tag for owner in owners] == ["mujoco", "worldbody", "body", "worldbody", "mujoco"]


def test_a_file_that_is_no_text_is_the_users_to_change(tmp_path: Path) -> None:
    file = tmp_path / "robot.xml"
    file.write_bytes(b"\xff\xfe<\x00")
    with pytest.raises(UserError, match="is not UTF-8 text"):
        open_mjcf(file)
    with pytest.raises(UserError, match=r"cannot read the MJCF file .*: No such file"):
        open_mjcf(tmp_path / "absent.xml")
    file.write_text(GOOD, encoding="utf-8-sig")
    assert open_mjcf(file) == GOOD


def test_the_grammar_is_that_of_the_installed_mujoco() -> None:
    root = mjcf_schema()
    assert {"worldbody", "tendon", "actuator", "sensor", "default"} <= set(root.children)
    body = root.children["worldbody"].children["body"]
    assert body.children["body"] is body
    assert body.children["frame"].children["replicate"].children["geom"] is body.children["geom"]
    assert body.children["inertial"].once
    assert "stiffness" in body.children["joint"].attributes
    assert not root.children["visual"].attributes
    assert len(list(root.walk())) > 150


def test_the_documentation_states_every_bound() -> None:
    page = (Path(__file__).parents[2] / "docs" / "safety.md").read_text(encoding="utf-8")
    limits = [value for value in asdict(SizeLimits()).values() if not re.search(rf"\| {value:,}( MiB)? \|", page)]
    assert limits == []


def test_a_name_of_many_digits_is_no_number_of_a_series() -> None:
    """Python refuses to read numbers of more than 4,300 digits."""
    used = f'<contact><exclude body1="b{"1" * 490}" body2="b1"/></contact>'
    with pytest.raises(MjcfError, match="names a body that does not exist"):
        read_mjcf(f'<mujoco><worldbody><body name="b1"/></worldbody>{used}</mujoco>')
    with pytest.raises(MjcfError, match="characters in 'body1': 5001, at most 500 allowed"):
        read_mjcf(f'<mujoco><worldbody><body name="b1"/></worldbody>{used.replace("1" * 490, "1" * 5000)}</mujoco>')


def test_of_thousands_of_faults_of_a_kind_the_first_are_reported() -> None:
    with pytest.raises(MjcfError) as caught:
        read_mjcf("<mujoco><worldbody>" + '<geom sise="1"/>' * 5000 + "</worldbody></mujoco>")
    assert len(caught.value.faults) == 200


@pytest.mark.parametrize("mass", ["nan", "nan(1)", "nan(0x1)", "nan()", "-NaN(abc)", "infinity", "1e999", "0x1p99999"])
def test_numbers_that_are_none_in_any_spelling_of_c(mass: str) -> None:
    with pytest.raises(MjcfError, match="is not a finite number"):
        read_mjcf(f'<mujoco><worldbody><body><geom size="1" mass="{mass}"/></body></worldbody></mujoco>')


@pytest.mark.parametrize(
    "asks",
    [
        '<worldbody><replicate count="1000000000"/></worldbody>',
        '<worldbody><replicate count="100000"><replicate count="100000"/></replicate></worldbody>',
        '<size memory="+99999G"/>',
        '<asset><texture type="2d" builtin="flat" width="0x100000" height="1"/></asset>',
    ],
)
def test_what_asks_for_too_much_in_another_spelling(asks: str) -> None:
    with pytest.raises(MjcfError, match=r"at most \d+ allowed"):
        read_mjcf(f"<mujoco>{asks}</mujoco>")
