"""Patches of an MJCF document, for a model that has seen it in condensed form: a few lines instead of the whole file.

A patch is a small XML document modelled on RFC 5261 (XML Patch Operations Framework): each operation selects elements
by XPath. Unlike in the RFC, a selection may have several elements, and `set` writes attributes:

    <patch>
      <set sel="//default[@class='finger']/joint" stiffness="0.4" damping="0.012"/>
      <add sel="//body[starts-with(@name,'link_')]"><site name="{name}_mark"/></add>
      <replace sel="//spatial[@name='flex']"><spatial name="flex">…</spatial></replace>
      <remove sel="//exclude[@body1='base']"/>
    </patch>
"""

from __future__ import annotations

import copy
import re

from lxml import etree

from aidsr.core.errors import IsolationError, MjcfError, ReplyError
from aidsr.core.suggestions import close_names
from aidsr.mjcf.elements import Element, attributes, elements
from aidsr.mjcf.read import parse_document
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.teams.llm.replies import MAX_CHARACTERS, fenced_blocks, find_documents

_OPERATIONS = ("set", "add", "replace", "remove")
_PLACES = ("last", "first", "before", "after")
_MAX_SELECTION = 300
"""Maximum length of a selection [characters]. Our choice: enough for any name and condition, too short for an XPath
that takes long to evaluate."""
_FUNCTIONS = {"starts-with", "contains", "not", "last", "position", "and", "or"}
_MAX_SEARCHES = 2
"""Maximum number of "//" in a selection. Our choice: each one searches everything below the elements found so far."""
_SIMPLER = (
    "use a path such as //joint[@name='bend_3'] or //body[starts-with(@name,'link_')]/joint, with conditions on "
    "attributes only."
)
_NAMED = re.compile(r"@(?:name|class|site|tendon|joint|body1|body2)\s*[=,]\s*['\"]([^'\"]+)['\"]")


def extract_patch(reply: str) -> str | None:
    """Return the only patch in a reply, fenced or not, with or without prose around it; None if there is none.

    Raises:
        ReplyError: The reply has several patches.
    """
    fenced = [block.text for block in fenced_blocks(reply) if block.text.lstrip().startswith("<patch")]
    found = [patch for text in fenced or [reply] for patch in find_documents(text, "patch")]
    if len(found) > 1 or (found and found[0].count("<patch") > 1):
        raise ReplyError("It has several <patch> blocks; put all operations into one.")
    return found[0] if found else None


def apply_patch(mjcf: str, patch: str) -> str:
    """Return the document with all operations of a patch carried out, in their order.

    Raises:
        ReplyError: An operation cannot be carried out, the operations take too long or make the document too large, or
            nothing would change.
    """
    try:
        return _patched(mjcf, patch)
    except IsolationError:
        raise ReplyError(f"The <patch> takes too long to carry out; {_SIMPLER}") from None


@isolated(limits=Limits(wall_s=5.0, memory_mib=2048))
def _patched(mjcf: str, patch: str) -> str:
    """Do the work of `apply_patch` within limits: XPath can take long, and copies of copies can grow without end."""
    root = copy.deepcopy(parse_document(mjcf).root)
    before = etree.tostring(root)
    for operation in _parse(patch):
        _apply(root, operation)
    if etree.tostring(root) == before:
        raise ReplyError("The <patch> changes nothing: every value in it is the one that was there.")
    etree.indent(root)
    text = str(etree.tostring(root, encoding="unicode")) + "\n"
    if len(text) > MAX_CHARACTERS:
        raise ReplyError(
            f"The <patch> makes the document {len(text):,} characters long; at most {MAX_CHARACTERS:,} are read. "
            "Add less."
        )
    return text


def _parse(patch: str) -> list[Element]:
    try:
        # the patch is as untrusted as the document, and gets the same bounds on size and entities
        root = parse_document(f"<mujoco>{patch}</mujoco>").root[0]
    except MjcfError as error:
        raise ReplyError(f"The <patch> is not well-formed XML: {error.faults[0].message}") from None
    operations = list(root.iterchildren(etree.Element))
    if not operations:
        raise ReplyError("The <patch> is empty; it needs at least one operation.")
    return operations


def _apply(root: Element, operation: Element) -> None:
    if operation.tag not in _OPERATIONS:
        raise ReplyError(f"<{operation.tag}> is not an operation of a <patch>; there are {', '.join(_OPERATIONS)}.")
    selected = _select(root, operation)
    content = [child for child in operation if isinstance(child.tag, str)]
    if operation.tag in ("add", "replace") and not content:
        raise ReplyError(f"{_label(operation)} has no element inside to put there.")
    for element in selected:
        match operation.tag:
            case "set":
                _set(element, operation)
            case "add":
                _add(element, content, operation)
            case "replace":
                _add(element, content, operation, place="before")
                _remove(element, operation)
            case "remove":
                _remove(element, operation)


def _select(root: Element, operation: Element) -> list[Element]:
    """Return the elements that an operation selects.

    Raises:
        ReplyError: The selection is missing, too long or too complex, is not an XPath, or selects no element.
    """
    selection = operation.get("sel", "")
    if not selection or len(selection) > _MAX_SELECTION:
        raise ReplyError(f"{_label(operation)} needs an XPath of at most {_MAX_SELECTION} characters in `sel`.")
    _check_cost(operation, selection)
    try:
        found = root.xpath(selection)
    except etree.XPathError as error:
        raise ReplyError(f"{_label(operation)} is not an XPath: {error}.") from None
    chosen = [each for each in found if isinstance(each, etree._Element)] if isinstance(found, list) else []
    if not chosen:
        raise ReplyError(f"{_label(operation)} selects no element.{_nearest(root, selection)}")
    return chosen


def _check_cost(operation: Element, selection: str) -> None:
    """Refuse selections that could take long to evaluate; a model wrote the text.

    Raises:
        ReplyError: The selection is more than a path with conditions on attributes.
    """
    functions = set(re.findall(r"([\w-]+)\s*\(", selection))
    conditions = "".join(re.findall(r"\[[^\]]*\]", selection))
    if (
        functions - _FUNCTIONS
        or "::" in selection
        or "/" in re.sub(r"'[^']*'|\"[^\"]*\"", "", conditions)
        or selection.count("//") > _MAX_SEARCHES
    ):
        raise ReplyError(f"{_label(operation)} is too involved; {_SIMPLER}")


def _nearest(root: Element, selection: str) -> str:
    """Return a sentence with the names in the document most similar to those in a selection; "" if there are none."""
    known = sorted(
        {value for element in elements(root) for key, value in attributes(element) if key in ("name", "class")}
    )
    near = [each for name in _NAMED.findall(selection) for each in close_names(name, known, most=4, cutoff=0.5)]
    return f" Names that come near: {', '.join(near)}." if near else ""


def _set(element: Element, operation: Element) -> None:
    given = [(key, value) for key, value in attributes(operation) if key != "sel"]
    if not given:
        raise ReplyError(f"{_label(operation)} has no attribute to set.")
    for key, value in given:
        if value:
            element.set(key, value)
        else:
            element.attrib.pop(key, "")


def _add(element: Element, content: list[Element], operation: Element, place: str = "") -> None:
    place = place or operation.get("at", "last")
    if place not in _PLACES:
        raise ReplyError(f'{_label(operation)} has at="{place}"; there are {", ".join(_PLACES)}.')
    if place in ("before", "after") and element.getparent() is None:
        raise ReplyError(f"{_label(operation)} selects the whole document; nothing can stand beside it.")
    new = [_instantiate(element, child) for child in content]
    match place:
        case "last":
            element.extend(new)
        case "first":
            element[:0] = new
        case "before":
            for child in new:
                element.addprevious(child)
        case _:
            for child in reversed(new):
                element.addnext(child)


def _instantiate(element: Element, content: Element) -> Element:
    """Return a copy of the content to add, with {name} replaced by the name of the element to which it is added."""
    made = copy.deepcopy(content)
    made.tail = None
    for each in elements(made):
        for key, value in attributes(each):
            each.set(key, value.replace("{name}", element.get("name", "")))
    return made


def _remove(element: Element, operation: Element) -> None:
    parent = element.getparent()
    if parent is None:
        raise ReplyError(f"{_label(operation)} selects the whole document; reply with a whole <mujoco> instead.")
    parent.remove(element)


def _label(operation: Element) -> str:
    return f'<{operation.tag} sel="{operation.get("sel", "")[:_MAX_SELECTION]}">'
