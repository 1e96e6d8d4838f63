"""Mutations of MJCF on bytes, tokens and trees, as made by typing errors, language models and attackers."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from lxml import etree

Choice = TypeVar("Choice")

_NUMBERS = (
    "nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "1e400", "0", "-1", "-0.0", "2147483648", "-2147483649",
    "99999999999999999999", "0x10", "1e", "1,5", "½", "", " ", "1 2 3 4 5 6 7 8 9",
)  # fmt: skip
_TAGS = (
    "include", "extension", "plugin", "replicate", "frame", "composite", "flexcomp", "attach", "asset", "model", "size",
    "option", "worldbody", "body", "geom", "joint", "freejoint", "site", "tendon", "spatial", "fixed", "actuator",
    "general", "muscle", "adhesion", "dcmotor", "cylinder", "equality", "weld", "connect", "keyframe", "key", "sensor",
    "user", "contact", "pair", "custom", "tuple", "deformable", "skin", "camera", "light", "pulley", "default",
    "mujoco",
)  # fmt: skip
_ATTRIBUTES = {
    "file": "CANARY/model.xml", "meshdir": "CANARY", "count": "100000", "nstack": "1e12", "memory": "100G",
    "timestep": "1e-12", "iterations": "1000000000", "childclass": "nothing", "class": "main", "name": "world",
    "limited": "true", "range": "1 -1", "type": "mesh", "plugin": "mujoco.sdf.bolt", "quat": "0 0 0 0",
    "euler": "1 2", "mass": "-1", "density": "1e30", "stiffness": "-1e9", "damping": "-1e9", "armature": "-1",
    "solref": "0 0", "solimp": "2 -1 0", "margin": "1e9", "gear": "1e30", "dyntype": "user", "dynprm": "0",
    "actdim": "1000000", "ctrlrange": "nan nan", "user": "1 " * 2000, "gravity": "1e300 0 0", "integrator": "RK4",
    "size": "1e30", "pos": "1e300 0 0", "nsample": "100000000", "inttotal": "1e9", "mocap": "true", "gravcomp": "1e9",
    "texturedir": "../../..", "content_type": "model/obj", "hfield": "h", "mesh": "m", "material": "x", "num": "1e9",
}  # fmt: skip
_ENCODINGS = ("utf-8", "utf-16", "utf-32", "latin-1", "cp1252", "utf-7")
_PIECES = (
    "<!DOCTYPE mujoco [<!ENTITY a 'aaaa'>]>", "&a;", "&#0;", "&#xD800;", "<![CDATA[", "]]>", "<!--", "-->", "<?xml",
    "?>", "\x00", "\ufeff", "\u202e", "\ud800", "</", "/>", '"', "'", "&", "```", "```xml\n", "<mujoco>", "</mujoco>",
    "\r", "\t", "<include file='CANARY/model.xml'/>", "xmlns='x'", "xi:include href='CANARY/model.xml'",
)  # fmt: skip

_TOKEN = re.compile(r'<[/?!]?[\w:.-]+|[\w:.-]+(?==)|"[^"]*"|/?>|[^<>"=\s]+')
_NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")


def mutate(seeds: Sequence[str], rng: np.random.Generator, canary: str) -> str:
    """Return one of the documents, changed in one to several ways.

    Args:
        seeds: Documents to start from.
        rng: Random generator, which determines the result.
        canary: Folder that documents try to reach but must not.
    """
    text = seeds[int(rng.integers(len(seeds)))]
    level = _pick(rng, _LEVELS)
    for _ in range(int(rng.choice([1, 1, 1, 2, 2, 3, 5, 8]))):
        text = level(text, rng, seeds)
    return text.replace("CANARY", canary)


def _pick(rng: np.random.Generator, choices: Sequence[Choice]) -> Choice:
    return choices[int(rng.integers(len(choices)))]


# --- bytes -----------------------------------------------------------------------------------------------------------


def _of_bytes(text: str, rng: np.random.Generator, seeds: Sequence[str]) -> str:
    kind = int(rng.integers(8))
    at = int(rng.integers(len(text) + 1))
    if kind == 0:
        return text[:at]
    if kind == 1:
        return text[:at] + str(_pick(rng, _PIECES)) + text[at:]
    if kind == 2:
        return text.encode("utf-8", "surrogatepass").decode(str(_pick(rng, _ENCODINGS)), "replace")
    if kind == 3:
        try:
            return text.encode(str(_pick(rng, _ENCODINGS)), "replace").decode("latin-1")
        except UnicodeEncodeError:  # a lone surrogate, which some encodings refuse in spite of "replace"
            return text
    if kind == 4:
        end = min(len(text), at + int(rng.integers(1, 400)))
        return text[:at] + text[end:]
    if kind == 5:
        end = min(len(text), at + int(rng.integers(1, 400)))
        return text[:at] + text[at:end] * int(rng.integers(2, 20)) + text[end:]
    if kind == 6:
        other = seeds[int(rng.integers(len(seeds)))]
        return text[:at] + other[int(rng.integers(len(other) + 1)) :]
    raw = bytearray(text.encode("utf-8", "surrogatepass"))
    for _ in range(int(rng.integers(1, 12))):
        raw[int(rng.integers(len(raw)))] = int(rng.integers(256))
    return raw.decode("utf-8", "replace")


# --- tokens ----------------------------------------------------------------------------------------------------------


def _of_tokens(text: str, rng: np.random.Generator, _seeds: Sequence[str]) -> str:
    kind = int(rng.integers(5))
    if kind <= 1:
        found = list(_NUMBER.finditer(text))
        if not found:
            return text
        place = found[int(rng.integers(len(found)))]
        return text[: place.start()] + str(_pick(rng, _NUMBERS)) + text[place.end() :]
    tokens = list(_TOKEN.finditer(text))
    if len(tokens) < 2:
        return text
    first, second = sorted((int(rng.integers(len(tokens))), int(rng.integers(len(tokens)))))
    one, other = tokens[first], tokens[second]
    if kind == 2 and one.end() <= other.start():
        return text[: one.start()] + other[0] + text[one.end() : other.start()] + one[0] + text[other.end() :]
    if kind == 3:
        return text[: one.start()] + text[one.end() :]
    return text[: one.end()] + " " + other[0] + " " + text[one.end() :]


# --- trees -----------------------------------------------------------------------------------------------------------


def _of_tree(text: str, rng: np.random.Generator, seeds: Sequence[str]) -> str:
    parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=False)
    try:
        root = etree.fromstring(text.encode("utf-8", "replace"), parser)
    except etree.XMLSyntaxError:
        return _of_tokens(text, rng, seeds)
    every = [element for element in root.iter() if isinstance(element.tag, str)]
    change = _pick(rng, _TREE_CHANGES)
    change(every, rng)
    return etree.tostring(root, encoding="unicode")


Elements = list[etree._Element]


def _some(every: Elements, rng: np.random.Generator) -> etree._Element:
    return every[int(rng.integers(len(every)))]


def _delete(every: Elements, rng: np.random.Generator) -> None:
    element = _some(every, rng)
    if (parent := element.getparent()) is not None:
        parent.remove(element)


def _duplicate(every: Elements, rng: np.random.Generator) -> None:
    element = _some(every[1:] or every, rng)
    if element.getparent() is not None:
        for _ in range(int(rng.choice([1, 1, 2, 30]))):
            element.addnext(copy.deepcopy(element))


def _move(every: Elements, rng: np.random.Generator) -> None:
    element, target = _some(every, rng), _some(every, rng)
    if element.getparent() is not None and target not in element.iter():
        target.append(element)


def _swap(every: Elements, rng: np.random.Generator) -> None:
    one, other = _some(every, rng), _some(every, rng)
    one.tag, other.tag = other.tag, one.tag


def _insert(every: Elements, rng: np.random.Generator) -> None:
    names = list(_ATTRIBUTES)
    chosen = {name: _ATTRIBUTES[name] for name in rng.choice(names, size=int(rng.integers(0, 4)), replace=False)}
    etree.SubElement(_some(every, rng), str(_pick(rng, _TAGS)), {str(name): value for name, value in chosen.items()})


def _set_attribute(every: Elements, rng: np.random.Generator) -> None:
    name = str(_pick(rng, list(_ATTRIBUTES)))
    _some(every, rng).set(name, _ATTRIBUTES[name])


def _swap_values(every: Elements, rng: np.random.Generator) -> None:
    one, other = _some(every, rng), _some(every, rng)
    shared = sorted(set(map(str, one.attrib)) & set(map(str, other.attrib)))
    if shared:
        name = str(_pick(rng, shared))
        first, second = one.get(name, ""), other.get(name, "")
        one.set(name, second)
        other.set(name, first)


def _drop_attribute(every: Elements, rng: np.random.Generator) -> None:
    element = _some(every, rng)
    if element.attrib:
        del element.attrib[str(_pick(rng, sorted(map(str, element.attrib))))]


def _scale_numbers(every: Elements, rng: np.random.Generator) -> None:
    element = _some(every, rng)
    factor = float(rng.choice([0, -1, 1e-9, 1e-3, 10, 1e3, 1e9]))
    for name, value in list(element.attrib.items()):
        try:
            element.set(name, " ".join(f"{float(word) * factor:.9g}" for word in str(value).split()))
        except ValueError:
            continue


def _deepen(every: Elements, rng: np.random.Generator) -> None:
    element = _some(every, rng)
    for _ in range(int(rng.choice([3, 30, 150, 400]))):
        element = etree.SubElement(element, "body")


def _multiply_everywhere(every: Elements, rng: np.random.Generator) -> None:
    """Multiply one attribute of all elements of a kind by a factor: such robots load, but move strangely."""
    element = _some(every, rng)
    names = [str(name) for name in element.attrib if _NUMBER.fullmatch(str(element.get(name)))]
    if names:
        name, factor = str(_pick(rng, names)), float(rng.choice([-1, 0, 1e-6, 1e-2, 1e2, 1e6]))
        for other in every:
            value = other.get(name, "")
            if other.tag == element.tag and _NUMBER.fullmatch(value):
                other.set(name, f"{float(value) * factor:.9g}")


_TREE_CHANGES: tuple[Callable[[Elements, np.random.Generator], None], ...] = (
    _delete,
    _duplicate,
    _move,
    _swap,
    _insert,
    _set_attribute,
    _swap_values,
    _drop_attribute,
    _scale_numbers,
    _scale_numbers,
    _deepen,
    _multiply_everywhere,
    _multiply_everywhere,
)

_LEVELS = (_of_bytes, _of_tokens, _of_tokens, _of_tree, _of_tree, _of_tree, _of_tree)
"""Mutations by frequency. Trees are the most frequent: most byte mutations are only refused as not well-formed."""
