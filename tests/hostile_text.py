"""Texts that once kept a process busy for minutes; run as a program, it reads all of them."""

from __future__ import annotations

import contextlib
import random
import sys
from collections.abc import Callable
from typing import Any

from aidsr.core.errors import AidsrError

N = 60_000


def _world(body: str, rest: str = "") -> str:
    return f"<mujoco><worldbody>{body}</worldbody>{rest}</mujoco>"


def _undefined(name: str) -> str:
    return f'<contact><exclude body1="{name}" body2="world"/></contact>'


def _shuffled(seed: int) -> str:
    letters = [chr(0x4E00 + i) for i in range(490)]
    random.Random(seed).shuffle(letters)
    return "".join(letters)


def _bodies(count: int) -> str:
    return "".join(f'<body name="b{i}"><joint name="j{i}"/><geom name="g{i}" size="1"/></body>' for i in range(count))


REPLIES: dict[str, Callable[[], str]] = {
    "openings without an end": lambda: "<mujoco><" * N,
    "openings of one tag": lambda: "<mujoco " * N + ">" + " " * N,
    "closings without an end": lambda: "<mujoco>" * N + "</mujoco" + " " * N,
    "spaces behind a fence": lambda: "```" + " " * N + "x",
    "objects without end": lambda: "{}\n" * (2 * N),
    "tags without an end": lambda: "```xml\n" + "<body " * N + "</mujoco>\n```",
}
DOCUMENTS: dict[str, Callable[[], str]] = {
    "comments without an end": lambda: "<mujoco>" + "<!--" * N + "</mujoco>",
    "comments before the document": lambda: "<!--" * N + "<mujoco/>",
    "instructions around the document": lambda: "<?" * N + "<mujoco/>" + "<?" * N,
    "DOCTYPEs without an end": lambda: "<!DOCTYPE [" * N + "<mujoco/>",
    "CDATA without an end": lambda: "<mujoco>" + "<![CDATA[" * N + "</mujoco>",
    "many attributes": lambda: _world("<geom " + " ".join(f'a{i}="1"' for i in range(100_000)) + "/>"),
    "many unknown attributes": lambda: _world("".join(f'<geom a{i}size="1"/>' for i in range(19_000))),
    "many unknown elements": lambda: _world("".join(f"<geon{i}/>" for i in range(19_000))),
    "digits in a name": lambda: _world('<body name="b1"/>', _undefined(f"b{'1' * N}a1")),
    "names that are nearly alike": lambda: _world(
        "".join(f'<body name="{_shuffled(i)}"/>' for i in range(800)), _undefined(_shuffled(-1))
    ),
    "deep and wide": lambda: _world("<body>" * 190 + _bodies(3000) + "</body>" * 190),
}
PATCHES: dict[str, Callable[[], str]] = {
    "copies of copies": lambda: '<add sel="//geom"><geom/></add>' * 12,
}
MARKUP: dict[str, Callable[[], str]] = {"comments of dashes": lambda: "<!----- -->\n" * (2 * N)}
MESSAGES: dict[str, Callable[[], str]] = {"spaces in a message": lambda: "Error: x in " + " " * N + "a"}


def read(kind: str, name: str) -> None:
    """Read one of the texts as the package does; that it is refused is as good."""
    from aidsr.fixes.markup import dashes_in_comments
    from aidsr.mjcf.compiler_messages import parse_message
    from aidsr.mjcf.read import read_mjcf
    from aidsr.teams.llm.patch import apply_patch, extract_patch
    from aidsr.teams.llm.replies import element_names, extract_mjcf, fenced_blocks, parse_json

    reading: dict[str, tuple[dict[str, Callable[[], str]], tuple[Callable[[str], Any], ...]]] = {
        "reply": (REPLIES, (extract_mjcf, extract_patch, fenced_blocks, parse_json, _element_names(element_names))),
        "document": (DOCUMENTS, (read_mjcf,)),
        "patch": (PATCHES, (lambda patch: apply_patch(_world(_bodies(3000)), f"<patch>{patch}</patch>"),)),
        "markup": (MARKUP, (dashes_in_comments,)),
        "message": (MESSAGES, (parse_message,)),
    }
    texts, readers = reading[kind]
    for reader in readers:
        with contextlib.suppress(AidsrError):
            reader(texts[name]())


def _element_names(element_names: Callable[..., Any]) -> Callable[[str], Any]:
    return lambda text: element_names(text, "body", "site")


CASES = [
    (kind, name)
    for kind, texts in {
        "reply": REPLIES,
        "document": DOCUMENTS,
        "patch": PATCHES,
        "markup": MARKUP,
        "message": MESSAGES,
    }.items()
    for name in texts
]

if __name__ == "__main__":
    for case in CASES:
        sys.stdout.write(": ".join(case) + "\n")
        sys.stdout.flush()
        read(*case)
