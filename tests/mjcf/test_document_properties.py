"""What holds for every document, whatever is in it."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree

from aidsr.core.artifacts import Fault
from aidsr.core.errors import MjcfError, UserError
from aidsr.mjcf.forbidden import FORBIDDEN_ELEMENTS
from aidsr.mjcf.read import canonical, check_document, check_safety, open_mjcf, parse_document, read_mjcf
from aidsr.mjcf.schema import ElementSchema, mjcf_schema

PROPERTY = settings(
    deadline=None,  # tests do not depend on time
    derandomize=True,
    database=None,
    max_examples=50,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
ANY_TEXT = st.text(max_size=300)
PIECES = (
    "<mujoco>", "</mujoco>", "<body ", "/>", ">", "<!--", "-->", "<![CDATA[", "]]>", "<!DOCTYPE x>", "<?xml?>", "```",
    "&a;", "&lt;", '"', "'", "name=", "pos='1 2 3'", "\n", "\x00", "\ufeff", "é", "\ud800", "worldbody", "geom",
)  # fmt: skip
MARKUP = st.lists(st.sampled_from(PIECES), max_size=40).map("".join)
NAMES = st.sampled_from(["a", "b", "s1", "s2", "s10", "tip", "Größe", "x" * 40, "a b", "&", "<", '"', "'"])
VALUES = st.one_of(
    NAMES,
    st.floats().map(repr),
    st.lists(st.floats(width=32), max_size=8).map(lambda numbers: " ".join(map(str, numbers))),
    st.sampled_from(["", "true", "hinge", "1,2,3", "0x1", "nan", "-inf 1", "1e999"]),
)


@st.composite
def trees(draw: st.DrawFn, depth: int = 4) -> str:
    """Documents that are well-formed, of elements and attributes that MJCF knows, and some it does not."""
    return _element(draw, "mujoco", mjcf_schema(), depth)


def _element(draw: st.DrawFn, tag: str, schema: ElementSchema, depth: int) -> str:
    known = [*sorted(schema.attributes), "nonsense"]
    attributes = draw(st.dictionaries(st.sampled_from(known), VALUES, max_size=3))
    children = sorted(schema.children)
    inside = ""
    if children and depth:
        for child in draw(st.lists(st.sampled_from(children), max_size=3)):
            inside += _element(draw, child, schema.children[child], depth - 1)
    written = "".join(f" {name}={quoteattr(value)}" for name, value in attributes.items())
    return f"<{tag}{written}>{inside}</{tag}>"


def faults_of(text: str) -> tuple[Fault, ...]:
    """Return the faults of a document, nothing for one without."""
    try:
        read_mjcf(text)
    except MjcfError as error:
        return error.faults
    return ()


@given(st.one_of(ANY_TEXT, MARKUP))
@PROPERTY
def test_any_text_is_a_document_or_has_faults(text: str) -> None:
    assert all(fault.message and fault.layer == "load" for fault in faults_of(text))


@given(trees())
@PROPERTY
def test_faults_of_any_tree_lie_in_its_lines(text: str) -> None:
    lines = text.count("\n") + 1
    assert all(fault.line is None or 1 <= fault.line <= lines for fault in faults_of(text))


@given(trees())
@PROPERTY
def test_what_mujoco_gets_means_the_same(text: str) -> None:
    """Written anew with one tag to a line, a document has the same elements, attributes and faults."""
    root = parse_document(text).root
    written, owners = canonical(root)
    again = parse_document(written).root
    assert [(e.tag, dict(e.attrib)) for e in again.iter()] == [(e.tag, dict(e.attrib)) for e in root.iter()]
    assert written.count("\n") + 1 == len(owners)
    codes = [Counter(fault.code for fault in check_document(parse_document(each))) for each in (text, written)]
    assert codes[0] == codes[1]


@given(trees(), st.sampled_from(sorted(FORBIDDEN_ELEMENTS)), st.integers(0, 10**6))
@PROPERTY
def test_what_reaches_outside_is_seen_wherever_it_stands(text: str, tag: str, place: int) -> None:
    root = parse_document(text).root
    every = list(root.iter())
    holder = every[place % len(every)]
    etree.SubElement(holder, tag).set("file", "/etc/passwd")
    changed = etree.tostring(root, encoding="unicode")
    assert "forbidden" in {fault.code for fault in check_safety(parse_document(changed))}


@given(trees(), st.sampled_from(["", "Here is your robot:\n", "```xml\n", "# Robot\n\n```\n"]))
@PROPERTY
def test_what_stands_around_a_document_changes_only_its_lines(text: str, before: str) -> None:
    around = before + text + ("\n```\nDone." if "```" in before else "\n")
    assert [f.code for f in faults_of(around)] == [f.code for f in faults_of(text)]


@given(st.binary(max_size=200))
@PROPERTY
def test_any_file_is_text_or_the_users_to_change(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "robot.xml"
    path.write_bytes(content)
    try:
        expected = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        with pytest.raises(UserError):
            open_mjcf(path)
    else:
        assert open_mjcf(path) == expected
