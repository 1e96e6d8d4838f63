"""A shortened robot shows every pattern once and says truly what it leaves out."""

from __future__ import annotations

import re

from lxml import etree

from aidsr.mjcf.condense import condense

SIDES = (("left", 1), ("right", -1))
FRONT_AND_REAR = (("front", 1), ("rear", -1))


def limb(name: str, links: int = 6, stiffness: str = "0.2", place: str = "0 0 0") -> str:
    text = ""
    for i in range(links, 0, -1):
        text = (
            f'<body name="{name}_{i}" pos="0 0 0.02"><joint name="{name}_bend_{i}" stiffness="{stiffness}"/>'
            f'<geom name="{name}_skin_{i}" size="0.01"/>{text}</body>'
        )
    return f'<body name="{name}" pos="{place}">{text}</body>'


def robot(*limbs: str, rest: str = "") -> str:
    return f"<mujoco><worldbody><body name='palm'>{''.join(limbs)}</body></worldbody>{rest}</mujoco>"


def comments(text: str) -> list[str]:
    return [" ".join(found.split()) for found in re.findall(r"<!--(.*?)-->", text, re.DOTALL)]


def test_links_like_the_first_are_told_by_name() -> None:
    text = condense(robot(limb("arm")))
    assert comments(text) == ["5 more, arm_2, arm_3 … arm_6: each inside the one before and like arm_1"]
    assert [body.get("name") for body in etree.fromstring(text).iter("body")] == ["palm", "arm", "arm_1"]


def test_numbers_that_differ_are_told() -> None:
    text = condense(robot(limb("arm").replace('bend_4" stiffness="0.2"', 'bend_4" stiffness="0.1"')))
    (said,) = comments(text)
    assert said.endswith("like arm_1, but joint arm_bend_1 stiffness 0.2 | 0.2 | 0.1 | 0.2 | 0.2")


def test_a_taper_is_told_by_its_ends() -> None:
    tapered = limb("arm")
    for i in range(1, 7):
        tapered = tapered.replace(f'skin_{i}" size="0.01"', f'skin_{i}" size="{0.02 - 0.002 * i:.3f}"')
    (said,) = comments(condense(robot(tapered)))
    assert said.endswith("like arm_1, but geom arm_skin_1 size 0.016 … 0.008")


def test_what_stands_after_a_chain_is_kept() -> None:
    pad = (
        '<geom name="arm_skin_6" size="0.01"/><body name="pad"><geom name="pad_shell" type="box" size="1 1 1"/></body>'
    )
    text = condense(robot(limb("arm").replace('<geom name="arm_skin_6" size="0.01"/>', pad)))
    assert "pad_shell" in text
    assert "arm_6" in comments(text)[0]


def test_what_only_some_links_have_is_quoted_once() -> None:
    footed = limb("arm", links=8)
    for i in (3, 5, 7):
        skin = f'<geom name="arm_skin_{i}" size="0.01"/>'
        footed = footed.replace(skin, f'{skin}<geom name="foot_{i}" type="box" size="{i} 1 1"/>')
    (said,) = comments(condense(robot(footed)))
    assert said == (
        "7 more, arm_2, arm_3 … arm_8: each inside the one before and like arm_1; arm_3, arm_5, arm_7 also have "
        '<geom name="foot_3" type="box" size="3 1 1"/> (foot_3, foot_5 … foot_7), but its own size 5 1 1 | 7 1 1'
    )


def test_links_that_have_something_of_their_own_each_are_shown() -> None:
    made = limb("arm")
    for i, kind in ((2, "box"), (3, "sphere"), (4, "cylinder")):
        skin = f'<geom name="arm_skin_{i}" size="0.01"/>'
        made = made.replace(skin, f'{skin}<geom name="lump_{i}" type="{kind}" size="1 1 1"/>')
    text = condense(robot(made))
    assert all(f'name="lump_{i}"' in text for i in (2, 3, 4))
    assert 'name="arm_3"' in text


def test_the_order_of_guides_in_a_link_does_not_matter() -> None:
    def guides(i: int) -> str:
        sites = [f'<site name="{side}_{i}a" pos="{x} 0 0"/>' for side, x in (("top", 1), ("left", 2))]
        return "".join(sites if i % 3 else reversed(sites))

    made = limb("arm")
    for i in range(1, 7):
        skin = f'<geom name="arm_skin_{i}" size="0.01"/>'
        made = made.replace(skin, skin + guides(i))
    assert comments(condense(robot(made))) == [
        "5 more, arm_2, arm_3 … arm_6: each inside the one before and like arm_1"
    ]


def test_limbs_of_one_build_are_shown_once() -> None:
    text = condense(robot(limb("finger_a"), limb("finger_b", place="1 0 0"), limb("finger_c", place="0 1 0")))
    likewise = "and likewise in the parts that are like these"
    assert comments(text)[-1] == f"finger_b, finger_c: like finger_a, but its own pos 1 0 0 | 0 1 0, {likewise}"
    assert "finger_c_1" not in text


def test_limbs_of_two_sides_are_shown_once_each() -> None:
    def leg(name: str, side: int, place: str) -> str:
        sites = "".join(f'<site name="{name}_guide_{i}" pos="0 {side * (i + 1)} {i}"/>' for i in range(12))
        return f'<body name="{name}" pos="{place}"><geom name="{name}_skin" size="0.01"/>{sites}</body>'

    legs = [leg(f"{side}_{end}", sign, f"{x} {sign} 0") for end, x in FRONT_AND_REAR for side, sign in SIDES]
    text = condense(robot(*legs))
    assert [body.get("name") for body in etree.fromstring(text).iter("body")] == ["palm", "left_front"]
    said = [said for said in comments(text) if "like left_front" in said]
    assert [one.split(", but")[0] for one in said] == [
        "right_front, right_rear: like left_front",
        "left_rear: like left_front",
    ]
    assert "site left_front_guide_11 pos 0 -12 11" in said[0]


def test_a_limb_that_differs_within_says_so() -> None:
    text = condense(robot(limb("finger_a"), limb("finger_b", stiffness="0.3")))
    assert "finger_a_bend_1 stiffness 0.3" in comments(text)[-1]


def test_limbs_told_apart_by_a_letter_are_shown_once() -> None:
    fingers = [
        limb("a0").replace('"a0', f'"{letter}0').replace('pos="0 0 0"', f'pos="{place} 0 0"')
        for place, letter in enumerate("abcdefghi")
    ]
    text = condense(robot(*fingers))
    assert comments(text)[-1].startswith("b0, c0 … i0: like a0, but its own pos 1 0 0 … 8 0 0")
    assert len(list(etree.fromstring(text).iter("joint"))) == 1


def test_a_shape_that_its_class_describes_is_shown() -> None:
    plain = "<default><geom rgba='1 0 0 1'/></default>"
    text = condense(robot('<body name="link"><geom/><geom rgba="0 1 0 1"/></body>', rest=plain))
    assert text.count("<geom/>") == 2
    assert "rgba" not in text


def test_limbs_of_different_builds_are_both_shown() -> None:
    text = condense(robot(limb("finger_a"), limb("finger_b", links=4)))
    assert "finger_b_1" in text


def test_rows_keep_their_first_and_last() -> None:
    sites = "".join(f'<site site="way_{i}"/>' for i in range(1, 8))
    text = condense(robot(rest=f'<tendon><spatial name="flex">{sites}</spatial></tendon>'))
    assert comments(text) == ["5 more: way_2, way_3 … way_6"]
    assert [site.get("site") for site in etree.fromstring(text).iter("site")] == ["way_1", "way_7"]


def test_looks_are_left_out_and_a_robot_that_cannot_be_read_is_not_shortened() -> None:
    assert "rgba" not in condense(robot('<geom name="g" size="1" rgba="1 0 0 1"/>'))
    assert condense("<mujoco><body></mujoco>") is None
