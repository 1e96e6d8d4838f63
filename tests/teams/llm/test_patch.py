"""A patch does what it says to everything it selects, or nothing with a sentence for its author."""

from __future__ import annotations

import pytest
from lxml import etree

from aidsr.core.errors import ReplyError
from aidsr.teams.llm.patch import apply_patch, extract_patch

ROBOT = """<mujoco>
  <worldbody>
    <body name="link_1"><joint name="bend_1" stiffness="1"/><geom name="skin_1" size="0.01"/>
      <body name="link_2"><joint name="bend_2" stiffness="1"/><geom name="skin_2" size="0.01"/></body>
    </body>
  </worldbody>
</mujoco>"""


def patched(*operations: str) -> etree._Element:
    return etree.fromstring(apply_patch(ROBOT, f"<patch>{''.join(operations)}</patch>"))


def test_set_writes_to_all_that_is_selected_and_removes_what_is_empty() -> None:
    root = patched("""<set sel="//joint[starts-with(@name,'bend_')]" stiffness="" damping="0.1"/>""")
    assert [dict(joint.attrib) for joint in root.iter("joint")] == [
        {"name": "bend_1", "damping": "0.1"},
        {"name": "bend_2", "damping": "0.1"},
    ]


def test_add_names_after_what_it_adds_to() -> None:
    root = patched("""<add sel="//body" at="first"><site name="{name}_mark"/></add>""")
    assert [body[0].get("name") for body in root.iter("body")] == ["link_1_mark", "link_2_mark"]


def test_add_beside_keeps_the_order() -> None:
    root = patched("""<add sel="//geom[@name='skin_1']" at="after"><site name="a"/><site name="b"/></add>""")
    assert [child.get("name") for child in root.find("worldbody/body")] == ["bend_1", "skin_1", "a", "b", "link_2"]


def test_replace_and_remove_in_order() -> None:
    root = patched(
        """<replace sel="//body[@name='link_2']"><body name="tip"><geom name="ball" size="1"/></body></replace>""",
        """<remove sel="//body[@name='tip']/geom"/>""",
    )
    assert [body.get("name") for body in root.iter("body")] == ["link_1", "tip"]
    assert not root.findall(".//body[@name='tip']/geom")


@pytest.mark.parametrize(
    ("operation", "said"),
    [
        ("<move sel='//joint'/>", "<move> is not an operation"),
        ("<set stiffness='1'/>", "needs an XPath"),
        ("<set sel='//joint['  stiffness='2'/>", "is not an XPath"),
        ("<set sel=\"//joint[@name='bend_3']\" stiffness='2'/>", "Names that come near: bend_"),
        ("<set sel='//joint'/>", "has no attribute to set"),
        ("<set sel='//joint' stiffness='1'/>", "changes nothing"),
        ("<add sel='//joint'/>", "has no element inside"),
        ("<add sel='//joint' at='under'><site/></add>", 'at="under"'),
        ("<remove sel='/mujoco'/>", "reply with a whole <mujoco>"),
        ("<remove sel='//*//*//*'/>", "too involved"),
        ("<remove sel='//body[count(//body) > 1]'/>", "too involved"),
        ("<remove sel='//joint/ancestor::body'/>", "too involved"),
        ("", "is empty"),
    ],
)
def test_what_cannot_be_done_is_said(operation: str, said: str) -> None:
    with pytest.raises(ReplyError) as refused:
        patched(operation)
    assert said in str(refused.value)


def test_a_patch_that_is_not_xml_is_refused() -> None:
    with pytest.raises(ReplyError, match="not well-formed"):
        apply_patch(ROBOT, "<patch><set sel=//joint/></patch>")


PATCH = "<patch><remove sel='//a'/></patch>"


@pytest.mark.parametrize(
    "reply",
    [
        f"Here: {PATCH} done",
        f"```xml\n{PATCH}\n```",
        f"The `<patch>` below softens it:\n```xml\n{PATCH}\n```",
        f"```xml\n{PATCH}\n```\nAll stands between <patch> and </patch>.",
        f"```xml\n<joint/>\n```\n```\n{PATCH}",
        f"The `<patch>` below softens it:\n{PATCH}\nAll stands between <patch> and </patch>.",
    ],
)
def test_a_patch_is_found_wherever_it_stands(reply: str) -> None:
    assert extract_patch(reply) == PATCH


@pytest.mark.parametrize("between", [" and ", "\n", "\n```\n```xml\n"])
def test_one_patch_to_a_reply(between: str) -> None:
    assert extract_patch("<mujoco/>") is None
    for reply in (f"{PATCH}{between}{PATCH}", f"```xml\n{PATCH}{between}{PATCH}\n```"):
        with pytest.raises(ReplyError, match="several"):
            extract_patch(reply)


def test_a_patch_that_never_ends_is_refused() -> None:
    copies = '<add sel="//joint"><joint/></add>' * 30
    with pytest.raises(ReplyError, match=r"takes too long to carry out|characters long; at most"):
        apply_patch(ROBOT, f"<patch>{copies}</patch>")
