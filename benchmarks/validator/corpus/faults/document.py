"""MJCF that does not load: frequent mistakes of language models and people, one at a time."""

# ruff: noqa: ARG001 - every change takes a generator and a size, whether it needs them or not
from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from benchmarks.validator.corpus.faults.injection import Injection, TextChange, UnsuitableError, present
from benchmarks.validator.corpus.faults.parts import Tree
from lxml import etree

Mistake = Callable[[Tree, np.random.Generator], str]
"""Changes an XML tree and returns a description of the change."""


def _of_tree(mistake: Mistake) -> TextChange:
    def changed(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
        root = etree.fromstring(mjcf.encode(), etree.XMLParser(remove_comments=True))
        words = mistake(root, rng)
        return etree.tostring(root, encoding="unicode"), words

    return changed


def _of_text(pattern: str, new: str, words: str) -> TextChange:
    def changed(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
        places = list(re.finditer(pattern, mjcf, re.DOTALL))
        if not places:
            raise UnsuitableError(f"nothing like {pattern}")
        place = places[int(rng.integers(len(places)))]
        return mjcf[: place.start()] + place.expand(new) + mjcf[place.end() :], words

    return changed


def _one(root: Tree, rng: np.random.Generator, *paths: str, having: str = "") -> Tree:
    found = [e for path in paths for e in root.findall(path) if not having or having in e.attrib]
    if not found:
        raise UnsuitableError(f"no {paths}")
    return found[int(rng.integers(len(found)))]


def _two(root: Tree, rng: np.random.Generator, path: str) -> tuple[Tree, Tree]:
    found = [e for e in root.findall(path) if e.get("name")]
    if len(found) < 2:
        raise UnsuitableError(f"fewer than two {path}")
    first, second = rng.choice(len(found), size=2, replace=False)
    return found[int(first)], found[int(second)]


def _set(path: str, having: str = "", **values: str) -> TextChange:
    """Return the change that sets attributes of one random element; a trailing "_" of a name is dropped."""

    def mistake(root: Tree, rng: np.random.Generator) -> str:
        element = _one(root, rng, path, having=having)
        for name, value in values.items():
            element.set(name.rstrip("_"), value)
        return f"<{element.tag}> '{element.get('name', '')}' gets {values}"

    return _of_tree(mistake)


def _rename_attribute(path: str, old: str, new: str) -> TextChange:
    def mistake(root: Tree, rng: np.random.Generator) -> str:
        element = _one(root, rng, path, having=old)
        element.set(new, element.attrib.pop(old))
        return f"{old} written as {new}"

    return _of_tree(mistake)


def _rename_element(path: str, new: str) -> TextChange:
    def mistake(root: Tree, rng: np.random.Generator) -> str:
        element = _one(root, rng, path)
        words = f"<{element.tag}> written as <{new}>"
        element.tag = new
        return words

    return _of_tree(mistake)


def _add(path: str, xml: str) -> TextChange:
    """Return the change that adds XML inside one random element; `path` "." is the root."""

    def mistake(root: Tree, rng: np.random.Generator) -> str:
        holder = root if path == "." else _one(root, rng, path)
        for element in etree.fromstring(f"<all>{xml}</all>"):
            holder.append(element)
        return f"{xml} added to <{holder.tag}>"

    return _of_tree(mistake)


def _same_name(path: str) -> TextChange:
    def mistake(root: Tree, rng: np.random.Generator) -> str:
        first, second = _two(root, rng, path)
        for user in root.iter():  # keep all references valid, so that nothing else becomes wrong
            for attribute in ("site", "joint", "body1", "body2", "tendon", "objname", "actuator"):
                if user.get(attribute) == second.get("name"):
                    user.set(attribute, first.get("name", ""))
        second.set("name", first.get("name", ""))
        return f"two {first.tag} named {first.get('name')}"

    return _of_tree(mistake)


def _off_by_one(path: str, attribute: str) -> TextChange:
    """Return the change that makes a reference undefined: 500 is added to its last number, or "_1" is appended."""

    def mistake(root: Tree, rng: np.random.Generator) -> str:
        element = _one(root, rng, path, having=attribute)
        old = element.get(attribute, "")
        element.set(
            attribute,
            re.sub(r"\d+(?!.*\d)", lambda m: str(int(m[0]) + 500), old) if re.search(r"\d", old) else old + "_1",
        )
        return f"{attribute}={old} became {element.get(attribute)}"

    return _of_tree(mistake)


def _empty_path(root: Tree, rng: np.random.Generator) -> str:
    tendon = _one(root, rng, "tendon/spatial")
    for site in list(tendon)[1:]:
        tendon.remove(site)
    return "tendon with one site"


def _unbracketed(root: Tree, rng: np.random.Generator) -> str:
    tendon, geom = _one(root, rng, "tendon/spatial"), _one(root, rng, "worldbody//geom")
    geom.set("name", geom.get("name") or "wrapped")
    if geom.get("type") not in ("sphere", "cylinder"):
        raise UnsuitableError("not a shape to wrap around")
    tendon.append(etree.Element("geom", geom=geom.get("name")))
    return "tendon ends with a wrapping geom"


def _pulley_first(root: Tree, rng: np.random.Generator) -> str:
    _one(root, rng, "tendon/spatial").insert(0, etree.Element("pulley", divisor="2"))
    _one(root, rng, "tendon/spatial").append(etree.Element("pulley", divisor="2"))
    return "pulley at an end of a tendon"


def _twice_in_a_row(root: Tree, rng: np.random.Generator) -> str:
    tendon = _one(root, rng, "tendon/spatial")
    site = next((child for child in tendon if child.tag == "site"), None)
    if site is None:
        raise UnsuitableError("no site")
    site.addnext(etree.Element("site", site=site.get("site")))
    return "a site twice in a row"


def _without_mass(root: Tree, rng: np.random.Generator) -> str:
    body = _one(root, rng, "worldbody//body//body")
    if body.find("joint") is None and body.find("freejoint") is None:
        raise UnsuitableError("no joint")
    for part in [*body.findall("geom"), *body.findall("inertial")]:
        body.remove(part)
    if root.find("tendon//geom") is not None:
        raise UnsuitableError("tendons around geoms")
    return f"body {body.get('name')} without geom"


def _massless_geoms(root: Tree, rng: np.random.Generator) -> str:
    bodies = [b for b in root.findall("worldbody//body") if b.find("joint") is not None and not b.findall("body")]
    if not bodies:
        raise UnsuitableError("no last segment")
    body = bodies[int(rng.integers(len(bodies)))]
    for geom in body.findall("geom"):
        geom.set("mass", "0")
    return f"geoms of {body.get('name')} have mass 0"


def _free_inside(root: Tree, rng: np.random.Generator) -> str:
    body = _one(root, rng, "worldbody/body//body")
    for joint in [*body.findall("joint"), *body.findall("freejoint")]:
        joint.tag = "freejoint"
        for name in list(joint.attrib):
            if name != "name":
                del joint.attrib[name]
        return f"free joint in {body.get('name')}, inside another body"
    raise UnsuitableError("no joint")


def _too_many_dofs(root: Tree, rng: np.random.Generator) -> str:
    body = _one(root, rng, "worldbody/body//body")
    for index, axis in enumerate(("1 0 0", "0 1 0", "0 0 1")):
        body.insert(0, etree.Element("joint", name=f"more_{index}", type="slide", axis=axis, limited="false"))
        body.insert(0, etree.Element("joint", name=f"turn_{index}", type="hinge", axis=axis, limited="false"))
    if len(body.findall("joint")) < 7:
        raise UnsuitableError("few joints")
    return f"more than six degrees of freedom in {body.get('name')}"


def _two_orientations(root: Tree, rng: np.random.Generator) -> str:
    body = _one(root, rng, "worldbody//body")
    body.set("quat", "1 0 0 0")
    body.set("euler", "0 0 0")
    return "quat and euler together"


def _fromto_by_default(root: Tree, rng: np.random.Generator) -> str:
    geom = _one(root, rng, "worldbody//geom", having="fromto")
    default = root.find("default")
    if default is None:
        default = etree.SubElement(root, "default")
        root.insert(0, default)
    inner = etree.SubElement(default, "default")
    inner.set("class", "round")
    etree.SubElement(inner, "geom").set("type", "sphere")
    geom.attrib.pop("type", None)
    geom.set("class", "round")
    return "fromto on a sphere by its class"


def _keyframe(root: Tree, rng: np.random.Generator) -> str:
    keyframe = root.find("keyframe")
    if keyframe is None:
        keyframe = etree.SubElement(root, "keyframe")
    etree.SubElement(keyframe, "key", name="home", **{str(rng.choice(["qpos", "qvel", "ctrl"])): "0 " * 333})
    return "keyframe with 333 numbers"


def _range(path: str, **values: str) -> TextChange:
    def mistake(root: Tree, rng: np.random.Generator) -> str:
        joints = [j for j in root.findall(path) if j.get("type", "hinge") == "hinge" and not j.get("class")]
        if not joints or root.findall("worldbody//joint[@type='ball']") or _ball_by_default(root):
            raise UnsuitableError("no hinges")
        joint = joints[int(rng.integers(len(joints)))]
        for name, value in values.items():
            joint.set(name, value)
        return f"range of {joint.get('name')} is {values}"

    return _of_tree(mistake)


def _ball_by_default(root: Tree) -> bool:
    return any(joint.get("type") == "ball" for joint in root.findall("default//joint"))


def _ball_range(root: Tree, rng: np.random.Generator) -> str:
    balls = [j for j in root.findall("worldbody//joint") if j.get("type") == "ball" or _ball_by_default(root)]
    if not balls:
        raise UnsuitableError("no ball joints")
    joint = balls[int(rng.integers(len(balls)))]
    joint.set("range", "0.2 1")
    joint.set("limited", "true")
    return "ball range that does not begin with 0"


def _doctype(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
    body = re.sub(r"<\?xml.*?\?>", "", mjcf).strip()
    return f'<!DOCTYPE mujoco [<!ENTITY big "1e9">]>\n{body}', "entity declared"


_MISTAKES: dict[str, tuple[TextChange, ...]] = {
    "xml_syntax": (
        _of_text(r"</body>", "", "a closing tag missing"),
        _of_text(r'(\w+)="([\d. -]+)"', r"\1=\2", "a value without quotes"),
        _of_text(r"<geom ", "<geom < ", "a stray <"),
        _of_text(r'\sname="([^"]*)"', r' name="\1" name="\1"', "an attribute twice"),
        _of_text(r"/>", ">", "an element not closed"),
        _of_text(r"(.{200,})\Z", r"", "cut short"),
        _of_text(r'\sname="([^"]*)"', r' name="a & b"', "a bare &"),
    ),
    "forbidden": (
        _add(".", '<include file="common.xml"/>'),
        _add(".", '<asset><mesh name="m" file="part.stl"/></asset>'),
        _add(".", '<asset><texture name="t" type="2d" file="skin.png"/></asset>'),
        _add(".", '<extension><plugin plugin="mujoco.elasticity.cable"/></extension>'),
        _set("compiler", meshdir="/tmp"),
        _doctype,
        _add("worldbody", '<replicate count="5000"><body><freejoint/><geom size="0.01"/></body></replicate>'),
        _add(".", '<size memory="900G"/>'),
    ),
    "unknown_element": (
        _rename_element("worldbody//geom", "capsule"),
        _rename_element("worldbody//site", "sites"),
        _rename_element("tendon/spatial", "cable"),
        _rename_element("actuator/*", "servo"),
        _add("worldbody//body", '<spring stiffness="1"/>'),
        _add(".", "<tendons/>"),
        _add("actuator", '<geom size="0.1"/>'),
    ),
    "unknown_attribute": (
        _rename_attribute("worldbody//joint", "damping", "dampening"),
        _rename_attribute("worldbody//geom", "size", "radius"),
        _rename_attribute("worldbody//body", "pos", "position"),
        _rename_attribute("actuator/*", "ctrlrange", "ctrl_range"),
        _set("actuator/motor", kp="10"),
        _set("tendon/spatial", color="1 0 0 1"),
        _set("worldbody//joint", torque="3"),
    ),
    "bad_value": (
        _set("worldbody//body", having="pos", pos="0 0"),
        _set("worldbody//body", having="pos", pos="0, 0, 0.1"),
        _set("worldbody//geom", having="size", size="big"),
        _set("worldbody//geom", having="size", size="-0.01 -0.01 -0.01"),
        _set("worldbody//geom", having="size", size="nan"),
        _set("option", timestep="fast"),
        _set("option", integrator="implicit-fast"),
        _set("worldbody//geom", having="type", type="pipe"),
        _set("worldbody//geom", rgba="1 0 0 1 1 1"),
        _set("worldbody//geom", friction="1 2 3 4"),
    ),
    "wrong_for_type": (
        _set("worldbody//geom", having="fromto", type="sphere"),
        _set("worldbody//geom", having="fromto", pos="0 0 0.01"),
        _of_tree(_two_orientations),
        _of_tree(_fromto_by_default),
        _set("worldbody//geom", having="fromto", type="plane"),
    ),
    "duplicate_name": (
        _same_name("worldbody//body"),
        _same_name("worldbody//joint"),
        _same_name("worldbody//site"),
        _same_name("tendon/*"),
        _same_name("actuator/*"),
    ),
    "undefined_reference": (
        _off_by_one("tendon/spatial/site", "site"),
        _off_by_one("actuator/*", "tendon"),
        _off_by_one("sensor/*", "objname"),
        _off_by_one("contact/exclude", "body2"),
        _set("worldbody//geom", class_="rubber"),
        _set("worldbody//geom", material="steel"),
        _off_by_one("sensor/*", "tendon"),
    ),
    "joint_range_invalid": (
        _range("worldbody//joint", limited="true", range="30 -30"),
        _range("worldbody//joint", limited="true", range="0 0"),
        _range("worldbody//joint", limited="true", range="0.5 0.1"),
        _of_tree(_ball_range),
        _range("worldbody//joint", limited="true", range="10 10"),
    ),
    "ctrlrange_invalid": (
        _set("actuator/*", ctrllimited="true", ctrlrange="1 -1"),
        _set("actuator/*", ctrllimited="true", ctrlrange="0 0"),
        _set("actuator/*", ctrllimited="true", ctrlrange="5 5"),
        _set("actuator/*", ctrllimited="true", ctrlrange="0 -40"),
        _set("actuator/*", ctrllimited="true", ctrlrange="0.3 0.2"),
    ),
    "tendon_path_invalid": (
        _of_tree(_empty_path),
        _of_tree(_unbracketed),
        _of_tree(_pulley_first),
        _of_tree(_twice_in_a_row),
    ),
    "zero_mass": (_of_tree(_without_mass), _of_tree(_massless_geoms)),
    "invalid_joint_placement": (
        _of_tree(_free_inside),
        _of_tree(_too_many_dofs),
        _add("worldbody", '<joint name="of_the_world" type="hinge"/>'),
        _add("worldbody", "<freejoint/>"),
    ),
    "keyframe_size": (_of_tree(_keyframe),),
    "missing_asset": (
        _set("worldbody//geom", type="mesh", mesh="skull"),
        _set("worldbody//geom", type="hfield", hfield="hills"),
        _add(".", '<asset><material name="skin" texture="leather"/></asset>'),
    ),
}

DOCUMENT: tuple[Injection, ...] = tuple(
    Injection(code, change, present()) for code, changes in _MISTAKES.items() for change in changes
)
"""One injection for each mistake."""
