"""Reading of untrusted MJCF text: the only XML parser of this package, and the checks that need no compiler.

No entity is expanded and no file is opened. A text that is too large is refused before it is parsed or compiled. All
faults that these checks find are reported at once.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import TypeGuard

from lxml import etree

from aidsr.core.arguments import check_type
from aidsr.core.artifacts import Fault, Robot, Scene
from aidsr.core.errors import MjcfError, UserError
from aidsr.core.text_files import read_text_file
from aidsr.mjcf.attribute_checks import check_finite, check_fromto
from aidsr.mjcf.elements import Element, attributes, line_of
from aidsr.mjcf.forbidden import check_forbidden
from aidsr.mjcf.names import duplicate_names, undefined_references
from aidsr.mjcf.schema import check_schema
from aidsr.mjcf.size_limits import SizeLimits, check_requested_sizes, check_tree_size
from aidsr.mjcf.spans import CDATA, COMMENT, DOCTYPE, INSTRUCTION, blanked, without
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits

SIZE_LIMITS = SizeLimits()
_ESCAPED = str.maketrans(
    {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
)
"""Escapes for characters that have another meaning in an XML attribute."""

_MOST_FAULTS = 200
"""Largest number of faults that one check reports. Our choice: more than anybody repairs at once; a hostile document
could have 20,000."""

_FENCED = re.compile(r"^[ \t]*```[^\n]*\n(.*?)^[ \t]*```", re.DOTALL | re.MULTILINE)
_FIRST_TAG = re.compile(r"<mujoco(?=[\s/>])")
_END = re.compile(r"</mujoco\s*>")
_DECLARATION = re.compile(r"<!(DOCTYPE|ENTITY|ELEMENT|ATTLIST|NOTATION)\b")
_MOST_SAID = 200
"""Largest number of characters taken from a parser message, which may quote a name of 50,000 characters. Our choice."""
_FOREIGN = {"robot": " (this is URDF)", "sdf": " (this is SDFormat)"}


@dataclass(frozen=True, eq=False)
class Document:
    """A parsed MJCF document."""

    text: str
    """Text of the document, without any surrounding text."""
    root: Element
    """Root element <mujoco>; line numbers count from the beginning of the text that was read."""
    notes: tuple[str, ...] = ()
    """Surrounding text that was ignored, one sentence each."""


def is_mjcf_text(source: object) -> TypeGuard[str]:
    """Return whether a value is MJCF text, and not the path of a file: a string that contains "<"."""
    return isinstance(source, str) and "<" in source


def text_of(mjcf: str | Path | Robot | Scene) -> str:
    """Return the MJCF text that is given as text, as the path of a file, or in a robot or scene.

    A string is a path if it ends with .xml and has no "<".

    Raises:
        TypeError: The argument has another type.
        UserError: The file cannot be read.
        MjcfError: The file is too large.
    """
    if isinstance(mjcf, Robot | Scene):
        return mjcf.mjcf
    check_type(mjcf, (str, Path), "mjcf must be MJCF text, the path of a file, a Robot or a Scene")
    if isinstance(mjcf, Path) or (mjcf.endswith(".xml") and not is_mjcf_text(mjcf)):
        return open_mjcf(Path(mjcf))
    return mjcf


def open_mjcf(path: Path) -> str:
    """Return the text of a file; a file that is too large is refused without being read.

    Raises:
        UserError: The file does not exist, is a folder, or is not text.
        MjcfError: The file is too large.
    """
    if path.is_dir():
        inside = min((file.name for file in path.glob("*.xml")), default="")
        cure = f"name the file, for example {path / inside}" if inside else "name a file"
        raise UserError(f"{path} is a folder, not an MJCF file; {cure}")
    try:
        size = path.stat().st_size
        if size > SIZE_LIMITS.characters:
            raise MjcfError([_too_large(size)])
        return read_text_file(path, max_bytes=SIZE_LIMITS.characters)
    except OSError as error:
        raise UserError(f"cannot read the MJCF file {path}: {error.strerror}; give the path of an MJCF file") from error


def decode_mjcf(content: bytes, source: str) -> str:
    """Decode UTF-8 bytes, with or without a byte order mark.

    Args:
        content: Content of a file.
        source: Name of the file for the error message.

    Raises:
        UserError: The content is not UTF-8 text.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UserError(f"{source} is not UTF-8 text; give an MJCF document, saved as UTF-8") from error


def read_mjcf(text: str, limits: SizeLimits = SIZE_LIMITS) -> Document:
    """Parse and check the document in a text; Markdown fences and prose around it are ignored with a note.

    Raises:
        MjcfError: The document has faults; the error holds all that can be found without compiling it.
    """
    document = parse_document(text, limits)
    faults = [*check_safety(document, limits), *check_document(document)]
    if faults:
        raise MjcfError(faults)
    return document


@isolated(limits=Limits(wall_s=20.0))
def check_mjcf(text: str) -> None:
    """Check a text as `read_mjcf` does, in an isolated process.

    Raises:
        MjcfError: The document has faults; the error holds all that can be found without compiling it.
        IsolationError: The check exceeded its limits of time or memory.
    """
    read_mjcf(text)


def parse_document(text: str, limits: SizeLimits = SIZE_LIMITS) -> Document:
    """Parse the document in a text without checking its content.

    This is the only parser for XML from outside this package; all other code calls it.

    Raises:
        MjcfError: The text is too large, declares entities, is not XML, or its root is not <mujoco>.
    """
    if len(text) > limits.characters:
        raise MjcfError([_too_large(len(text), limits)])
    body, first_line, notes = _extract_document(text)
    declared = _DECLARATION.search(blanked(body, COMMENT, CDATA))
    if declared:
        line = first_line + body.count("\n", 0, declared.start())
        problem = f"<!{declared[1]}> is not allowed, because models here use no entities"
        raise MjcfError([_fault("forbidden", problem, line, "write the values out")])
    root = _parse(body, first_line, limits)
    if root.tag != "mujoco":
        problem = f"the root element is <{str(root.tag)[:100]}>{_FOREIGN.get(str(root.tag), '')}, expected <mujoco>"
        raise MjcfError([_fault("unknown_element", problem, line_of(root), "write the model as MJCF")])
    faults = list(check_tree_size(root, limits))
    if faults:
        raise MjcfError(faults)
    return Document(body, root, notes)


def check_safety(document: Document, limits: SizeLimits = SIZE_LIMITS) -> list[Fault]:
    """Return the faults because of which a document must not be passed to MuJoCo."""
    return [*check_forbidden(document.root), *check_requested_sizes(document.root, limits)]


def check_document(document: Document) -> list[Fault]:
    """Return the faults of elements, attributes and names, ordered by line."""
    checks = (check_schema, duplicate_names, undefined_references, check_fromto, check_finite)
    found = chain.from_iterable(islice(check(document.root), _MOST_FAULTS) for check in checks)
    return sorted(found, key=lambda fault: fault.line or 0)


def canonical(root: Element) -> tuple[str, list[Element]]:
    """Return the document as text with one tag per line, and the element of each line.

    MuJoCo compiles this text and never the original. So it compiles exactly what was checked, however its own parser
    treats comments, CDATA or unusual quoting, and a line number in its messages identifies one element.
    """
    lines: list[str] = []
    owners: list[Element] = []

    def write(element: Element) -> None:
        written = "".join(f' {name}="{value.translate(_ESCAPED)}"' for name, value in attributes(element))
        children = [child for child in element if isinstance(child.tag, str)]
        lines.append(f"<{element.tag}{written}{'' if children else '/'}>")
        owners.append(element)
        for child in children:
            write(child)
        if children:
            lines.append(f"</{element.tag}>")
            owners.append(element)

    write(root)
    return "\n".join(lines), owners


def _parse(body: str, first_line: int, limits: SizeLimits) -> Element:
    if not body.strip():
        raise MjcfError([_fault("xml_syntax", "the text is empty, expected an MJCF document", None)])
    parser = etree.XMLParser(
        encoding="utf-8", resolve_entities=False, no_network=True, huge_tree=False, load_dtd=False, remove_pis=True
    )
    try:
        data = ("\n" * (first_line - 1) + re.sub(r"^\s*<\?xml.*?\?>", _blank, body)).encode()
        return etree.fromstring(data, parser)
    except UnicodeEncodeError as error:
        line = first_line + body.count("\n", 0, error.start)
        raise MjcfError([_fault("xml_syntax", "a character that is not Unicode text", line)]) from error
    except etree.XMLSyntaxError as error:
        line, column = error.position
        if "depth" in (error.msg or ""):
            problem = f"elements inside each other: more than {limits.depth}, at most {limits.depth} allowed"
            raise MjcfError([_fault("forbidden", problem, line)]) from error
        says = (error.msg or "").partition(", line ")[0].strip()[:_MOST_SAID]
        problem = f"not well-formed XML at line {line}, column {column}: {says}"
        raise MjcfError([_fault("xml_syntax", problem, line)]) from error


def _extract_document(text: str) -> tuple[str, int, tuple[str, ...]]:
    """Return the text of the document, its first line number, and a note if there was text around it."""
    text = text.removeprefix("\ufeff")
    start, end = 0, len(text)
    blocks = [block for block in _FENCED.finditer(text) if _FIRST_TAG.search(block[1])]
    if blocks:
        start, end = max((block.span(1) for block in blocks), key=lambda span: span[1] - span[0])
    # A comment may contain tags of another document, which must not be mistaken for the beginning or the end.
    visible = blanked(text, COMMENT, CDATA)
    first = _FIRST_TAG.search(visible, start, end)
    if first is None:
        return text, 1, ()
    if without(text[start : first.start()], COMMENT, INSTRUCTION, DOCTYPE).strip():
        start = first.start()
    last = max((tag.end() for tag in _END.finditer(visible, start, end)), default=end)
    if without(text[last:end], COMMENT, INSTRUCTION, DOCTYPE).strip():
        end = last
    around = (text[:start] + text[end:]).strip()
    notes = (f"Put aside what stood around the document, {len(around)} characters beginning {around[:40]!r}.",)
    return text[start:end], text.count("\n", 0, start) + 1, notes if around else ()


def _blank(match: re.Match[str]) -> str:
    return re.sub(r"[^\n]", " ", match[0])


def _too_large(size: int, limits: SizeLimits = SIZE_LIMITS) -> Fault:
    problem = f"the text has {size:,} characters, at most {limits.characters:,} are read"
    return _fault("forbidden", problem, None, "send the robot alone").model_copy(
        update={"measured": float(size), "limit": float(limits.characters)}
    )


def _fault(code: str, problem: str, line: int | None, cure: str = "") -> Fault:
    return Fault(code=code, layer="load", severity="error", message=problem, cure=cure, line=line)
