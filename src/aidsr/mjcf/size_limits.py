"""Limits on the size of an untrusted document and of the model it describes, checked before anything is compiled."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from aidsr.core.artifacts import Fault
from aidsr.mjcf.defaults import default_classes, setting
from aidsr.mjcf.elements import Element, attributes, elements, load_fault, numbers
from aidsr.mjcf.names import LISTS, REFERENCES


@dataclass(frozen=True)
class SizeLimits:
    """Largest allowed sizes of a document.

    Our choice: at least ten times the largest robot of the benchmark, and small enough to compile within seconds;
    MuJoCo needs 5 s for 90,000 replicated geoms and more than 40 s for 20,000 free bodies.
    """

    characters: int = 4 * 2**20
    """Characters of the text."""
    elements: int = 20_000
    """Elements in the text."""
    depth: int = 200
    """Depth of nested elements."""
    attributes: int = 100
    """Attributes of one element; no element of MJCF has more than 40."""
    name_characters: int = 500
    """Characters in a name or in a reference to a name."""
    bodies: int = 2_000
    """Bodies after replication."""
    parts: int = 20_000
    """Geoms, joints, sites and other parts after replication, including the points of a composite or flexcomp."""
    numbers: int = 50_000
    """Numbers in one attribute."""
    keyframes: int = 100
    texels: int = 2**25
    """Texels of all textures together: two textures of 4096 x 4096, or a cube of 2364 x 2364."""
    samples: int = 2**22
    """Samples of all height fields together."""
    delayed: int = 1_000_000
    """Numbers that all sensors and actuators together keep for a delay (`nsample`)."""
    rays: int = 10_000
    """Rays of all range finders that use a camera together."""
    memory_mib: int = 1024
    """Memory that <size memory> may reserve [MiB]."""


_NAMES = frozenset({"name", "class", "prefix", "objname", "refname", *REFERENCES})
_PARTS = frozenset({"geom", "site", "joint", "freejoint", "camera", "light", "inertial", "frame"})
_GENERATORS = frozenset({"replicate", "composite", "flexcomp"})

_LARGEST: dict[str, dict[str, float]] = {
    "size": {"njmax": 1e5, "nconmax": 1e5, "nstack": 1e8, "nuserdata": 1e5, "nkey": 100},
    "texture": {"width": 4096, "height": 6 * 4096, "nchannel": 4},
    "hfield": {"nrow": 1024, "ncol": 1024},
    "camera": {"resolution": 4096},
    "global": {"offwidth": 4096, "offheight": 4096},
    "quality": {"shadowsize": 8192, "offsamples": 16, "numslices": 128, "numstacks": 128, "numquads": 128},
    "mesh": {"params": 200, "maxhullvert": 1e4},
    "skin": {"subgrid": 16},
    "flexcomp": {"cellcount": 32},
    "flex": {"cellcount": 32},
    "contact": {"num": 1000},
    "user": {"dim": 1000},
    "numeric": {"size": 500},
    "option": {"iterations": 1e4, "ls_iterations": 1e4, "noslip_iterations": 1e4, "ccd_iterations": 1e4},
    "lengthrange": {"inttotal": 100},
}
"""Largest values of attributes that determine MuJoCo's memory or time, by element and attribute. Our choice: far above
any need."""
_LARGEST_ANYWHERE = {"nsample": 1e4} | {
    f"nuser_{kind}": 1000.0 for kind in ("body", "jnt", "geom", "site", "cam", "tendon", "actuator", "sensor")
}
_TOTALS = {
    "texels": "texels of all textures",
    "samples": "samples of all height fields",
    "delayed": "numbers kept for the delays of sensors and actuators",
    "rays": "rays of all range finders",
}
_MEMORY = re.compile(r"\s*\+?(\d+)\s*([KMGTPE]?)\s*", re.IGNORECASE)


def check_tree_size(root: Element, limits: SizeLimits) -> Iterator[Fault]:
    """Yield a fault for too many elements, for too deep nesting, for too many attributes, and for too long a name."""
    count = sum(1 for _ in elements(root))
    if count > limits.elements:
        yield _over(root, "elements", count, limits.elements)
    level, depth, first = [root], 0, root
    while level:
        depth, first = depth + 1, level[0]
        level = [child for parent in level for child in parent]
    if depth > limits.depth:
        yield _over(first, "elements inside each other", depth, limits.depth)
    for element in elements(root):
        if len(element.attrib) > limits.attributes:
            yield _over(element, "attributes of one element", len(element.attrib), limits.attributes)
            return
        for attribute, value in attributes(element):
            names = value.split() if element.tag == "flex" and attribute in LISTS else [value]
            length = max(map(len, names), default=0) if attribute in _NAMES else 0
            if length > limits.name_characters:
                yield _over(element, f"characters in '{attribute}'", length, limits.name_characters)
                return


def check_requested_sizes(root: Element, limits: SizeLimits) -> Iterator[Fault]:
    """Yield a fault for each size that the document requests and that would take too much memory or time."""
    keyframes = list(elements(root, "key"))
    if len(keyframes) > limits.keyframes:
        yield _over(keyframes[-1], "keyframes", len(keyframes), limits.keyframes)
    yield from _generates_too_much(root, limits)
    yield from _totals_too_much(root, limits)
    for element in elements(root):
        yield from _reserves_too_much(element, limits)
        largest = _LARGEST_ANYWHERE | _LARGEST.get(str(element.tag), {})
        for attribute, value in attributes(element):
            count = len(value.split())
            if count > limits.numbers:
                yield _over(element, f"values in '{attribute}'", count, limits.numbers)
            asked = max(numbers(value), default=0.0) if attribute in largest else 0.0
            if asked > largest.get(attribute, math.inf):
                yield _over(element, f"'{attribute}'", asked, largest[attribute])


def _over(element: Element, what: str, found: float, limit: float) -> Fault:
    fault = load_fault("forbidden", element, f"{what}: {found:.9g}, at most {limit:.9g} allowed", cure="ask for less")
    return fault.model_copy(update={"measured": float(found), "limit": float(limit)})


def _generates_too_much(root: Element, limits: SizeLimits) -> Iterator[Fault]:
    """Yield a fault for each innermost element that has too many bodies or parts after replication."""
    built: dict[Element, tuple[float, float]] = {}
    for element in reversed(list(elements(root))):  # children before their parents
        inside = [built[child] for child in element if child in built]
        bodies, parts = sum(count[0] for count in inside), sum(count[1] for count in inside)
        if element.tag in _GENERATORS:
            asked = math.prod(max(1.0, number) for number in numbers(element.get("count", "1")))
            # an empty <replicate> takes as long to compile as one with one part
            inside_parts = max(parts, 1.0)
            bodies, parts = (bodies * asked, inside_parts * asked) if element.tag == "replicate" else (asked, asked)
        built[element] = (bodies + (element.tag == "body"), parts + (element.tag in _PARTS))
    for element, (bodies, parts) in built.items():
        if not any(_exceeds(built.get(child, (0, 0)), limits) for child in element):
            if bodies > limits.bodies:
                yield _over(element, "bodies", bodies, limits.bodies)
            elif parts > limits.parts:
                yield _over(element, "geoms, joints, sites and other parts", parts, limits.parts)


def _exceeds(built: tuple[float, float], limits: SizeLimits) -> bool:
    return built[0] > limits.bodies or built[1] > limits.parts


def _totals_too_much(root: Element, limits: SizeLimits) -> Iterator[Fault]:
    """Yield a fault at the element with which the total size of one kind of asset or buffer exceeds its limit."""
    classes = default_classes(root)
    rays = {element.get("name"): _product(element, "resolution", classes) for element in elements(root, "camera")}
    totals: dict[str, Iterator[tuple[Element, float]]] = {
        "texels": ((element, _texels(element, classes)) for element in elements(root, "texture")),
        "samples": (
            (element, _product(element, "nrow", classes) * _product(element, "ncol", classes))
            for element in elements(root, "hfield")
        ),
        "delayed": (
            (element, _product(element, "nsample", classes, 0.0) * _product(element, "num", classes))
            for section in elements(root, "sensor", "actuator")
            for element in elements(section)
        ),
        "rays": ((element, rays.get(element.get("camera"), 0.0)) for element in elements(root, "rangefinder")),
    }
    for kind, counted in totals.items():
        limit, total = getattr(limits, kind), 0.0
        for element, count in counted:
            total += count
            if total > limit:
                yield _over(element, _TOTALS[kind], total, limit)
                break


def _texels(texture: Element, classes: Mapping[str, Element]) -> float:
    """Return the number of texels of a texture; a cube has six square sides, whatever its height attribute says."""
    kind, width = setting(texture, "type", classes), _product(texture, "width", classes)
    flat = kind is not None and kind.value == "2d"
    return width * (_product(texture, "height", classes) if flat else 6 * width)


def _product(element: Element, attribute: str, classes: Mapping[str, Element], absent: float = 1.0) -> float:
    """Return the product of an attribute's numbers, each counted as at least 1; `absent` if it is not set."""
    found = setting(element, attribute, classes)
    read = numbers(found.value) if found else []
    return math.prod(max(1.0, number) for number in read) if read else absent


def _reserves_too_much(element: Element, limits: SizeLimits) -> Iterator[Fault]:
    asked = _MEMORY.fullmatch(element.get("memory", ""))
    if element.tag == "size" and asked:
        mib = int(asked[1][:30]) * 1024.0 ** (" KMGTPE".index(asked[2].upper() or " ") - 2)
        if mib > limits.memory_mib:
            yield _over(element, "'memory' in MiB", mib, limits.memory_mib)
