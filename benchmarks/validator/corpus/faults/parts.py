"""Faults of structure: missing or wrong parts, wrong ranges, gaps."""

# ruff: noqa: ARG001 - every change takes a generator and a size, whether it needs them or not
from __future__ import annotations

import math

import mujoco
import numpy as np
from benchmarks.validator.corpus.faults.anatomy import first_of, inner_joints, read_anatomy
from benchmarks.validator.corpus.faults.injection import Injection, UnsuitableError, of_spec, present
from lxml import etree

Tree = etree._Element

_BALL, _HINGE = int(mujoco.mjtJoint.mjJNT_BALL), int(mujoco.mjtJoint.mjJNT_HINGE)


def tree_of(mjcf: str) -> Tree:
    """Return a document as an XML tree without comments."""
    return etree.fromstring(mjcf.encode(), etree.XMLParser(remove_comments=True))


def _text(root: Tree) -> str:
    return etree.tostring(root, encoding="unicode")


def remove_dangling(root: Tree, attribute: str, names: set[str]) -> None:
    """Remove actuators and sensors whose `attribute` is a removed name, and the sensors of these actuators."""
    gone = set()
    for section in ("actuator", "sensor"):
        for element in root.findall(f"{section}/*"):
            if element.get(attribute) in names or (section == "sensor" and element.get("actuator") in gone):
                gone.add(element.get("name", ""))
                element.getparent().remove(element)


def _joint_motors(root: Tree, mjcf: str, count: int) -> None:
    """Add motors and position sensors to the first hinges."""
    model = mujoco.MjModel.from_xml_string(mjcf)
    hinges = [model.joint(j).name for j in range(model.njnt) if int(model.jnt_type[j]) == _HINGE]
    if len(hinges) <= count + 1 or not all(hinges):
        raise UnsuitableError("too few hinges")
    for section in ("actuator", "sensor"):
        if root.find(section) is None:
            root.append(etree.Element(section))
    for index in range(count):
        motor = {"name": f"joint_motor_{index}", "joint": hinges[index], "gear": "0.2", "ctrlrange": "-1 1"}
        root.find("actuator").append(etree.Element("motor", motor))
        root.find("sensor").append(etree.Element("jointpos", {"joint": hinges[index]}))


def _plain(mjcf: str) -> Tree:
    """Return the document as MuJoCo writes it: defaults are expanded, and each section occurs once."""
    spec = mujoco.MjSpec.from_string(mjcf)
    spec.compile()
    return tree_of(spec.to_xml())


def no_tendons(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
    """Replace tendons by motors at joints."""
    root = _plain(mjcf)
    section = root.find("tendon")
    remove_dangling(root, "tendon", {tendon.get("name", "") for tendon in section})
    root.remove(section)
    _joint_motors(root, mjcf, int(rng.integers(2, 5)))
    return _text(root), "tendons removed, joint motors instead"


def no_actuators(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
    """Remove all actuators."""
    root = _plain(mjcf)
    names = {actuator.get("name", "") for actuator in root.find("actuator")}
    remove_dangling(root, "actuator", names)
    root.remove(root.find("actuator"))
    return _text(root), "actuators removed"


def no_sensors(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
    """Remove all sensors."""
    root = _plain(mjcf)
    root.remove(root.find("sensor"))
    return _text(root), "sensors removed"


def tendons_not_actuated(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
    """Keep the tendons, but let actuators drive joints instead."""
    root = _plain(mjcf)
    remove_dangling(root, "tendon", {tendon.get("name", "") for tendon in root.find("tendon")})
    _joint_motors(root, mjcf, int(rng.integers(2, 5)))
    return _text(root), "actuators moved from tendons to joints"


def no_soft_chain(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
    """Keep the joints of the first 3 / `size` bodies of every limb, and remove the others."""
    keep = round(3 / size)
    spec = mujoco.MjSpec.from_string(mjcf)
    anatomy = read_anatomy(spec)
    stiff = {anatomy.model.body(body).name for limb in anatomy.limbs for body in limb.bodies[keep:]}
    root = _plain(mjcf)
    removed = set()
    for body in root.findall("worldbody//body"):
        if body.get("name") in stiff:
            for joint in body.findall("joint"):
                removed.add(joint.get("name", ""))
                body.remove(joint)
    remove_dangling(root, "joint", removed)
    for tendon in root.findall("tendon/fixed"):
        for part in [part for part in tendon if part.get("joint") in removed]:
            tendon.remove(part)
    return _text(root), f"joints removed, {keep} left in every limb"


def disconnected(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
    """Attach the outer part of a limb to the world, as if a body was closed too early."""
    spec = mujoco.MjSpec.from_string(mjcf)
    anatomy = read_anatomy(spec)
    limb = first_of(anatomy.limbs)
    index = int(rng.integers(1, len(limb.bodies) - 1))
    body = limb.bodies[index]
    root = _plain(mjcf)
    name = anatomy.model.body(body).name
    element = next((e for e in root.findall("worldbody//body") if e.get("name") == name and name), None)
    if element is None:
        raise UnsuitableError("bodies without names")
    element.getparent().remove(element)
    for attribute in ("quat", "euler", "axisangle", "xyaxes", "zaxis"):
        element.attrib.pop(attribute, None)
    element.set("pos", " ".join(f"{x:.7g}" for x in anatomy.data.xpos[body]))
    element.set("quat", " ".join(f"{x:.7g}" for x in anatomy.data.xquat[body]))
    root.find("worldbody").append(element)
    return _text(root), f"{name} hangs from the world instead of from the segment before it"


def segments_gap(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Move a segment away from the one before it by `size` / 2 segment lengths."""
    anatomy = read_anatomy(spec)
    limb = first_of(anatomy.limbs)
    index = int(rng.integers(1, len(limb.bodies)))
    body = limb.bodies[index]
    parent = int(anatomy.model.body_parentid[body])
    shift = 0.5 * size * limb.spacing_m * limb.direction(index - 1) @ anatomy.data.xmat[parent].reshape(3, 3)
    found = spec.body(anatomy.model.body(body).name)
    if found is None:
        raise UnsuitableError("bodies without names")
    found.pos = np.array(found.pos) + shift
    return f"{found.name} begins {0.5 * size:.2g} segment lengths too far out"


def fully_actuated(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Add a motor for each degree of freedom of a share `size` of the joints."""
    joints = inner_joints(spec)
    added = 0
    for index, joint in enumerate(joints):
        if index >= size * len(joints):
            break
        joint.name = joint.name or f"joint_{index}"
        for axis in range(3 if int(joint.type) == _BALL else 1):
            gear = [0.0] * 6
            gear[axis] = 0.3 * max(float(joint.stiffness[0]), 1e-4)
            spec.add_actuator(
                name=f"own_{index}_{axis}",
                trntype=mujoco.mjtTrn.mjTRN_JOINT,
                target=joint.name,
                gear=gear,
                ctrlrange=[-1, 1],
                ctrllimited=1,
            )
            added += 1
    return f"{added} motors added, one for each degree of freedom"


def ctrlrange_missing(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Leave out the control ranges of one or all actuators, or write them from high to low."""
    actuators = list(spec.actuators)
    chosen = actuators if rng.random() < 0.5 else actuators[:1]
    inverted = bool(rng.random() < 0.5)
    for actuator in chosen:
        low, high = actuator.ctrlrange
        actuator.ctrllimited = int(mujoco.mjtLimited.mjLIMITED_AUTO)
        actuator.ctrlrange = [high, low] if inverted else [0, 0]
    return f"control range of {len(chosen)} actuators {'inverted' if inverted else 'left out'}"


def range_inverted_ignored(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Write the ranges of some or all joints from high to low."""
    limited = [j for j in inner_joints(spec) if int(j.type) != _BALL and j.range[0] < j.range[1]]
    if not limited:
        raise UnsuitableError("no limited hinge")
    chosen = limited if rng.random() < 0.5 else limited[: int(rng.integers(1, 3))]
    for joint in chosen:
        joint.limited = int(mujoco.mjtLimited.mjLIMITED_AUTO)
        joint.range = [joint.range[1], joint.range[0]]
    return f"range of {len(chosen)} joints inverted"


def joint_range_too_small(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Limit joints, so that a limb can bend by 30 degrees / `size` in all."""
    limb = first_of(read_anatomy(spec).limbs)
    joints = inner_joints(spec)
    per_body = max(1, round(len(joints) / max(1, len({j.parent.name for j in joints}))))
    each = math.radians(30) / size / (len(limb.bodies) * per_body)
    # specifications keep the unit of the document they were read from
    unit = math.degrees(1) if spec.compiler.degree else 1.0
    for joint in joints:
        joint.limited = int(mujoco.mjtLimited.mjLIMITED_TRUE)
        joint.range = [0 if int(joint.type) == _BALL else -each * unit, each * unit]
    return f"limits of a limb allow {30 / size:.3g} deg together"


PARTS: tuple[Injection, ...] = (
    Injection("no_tendons", no_tendons, present()),
    Injection("no_actuators", no_actuators, present()),
    Injection("no_sensors", no_sensors, present()),
    Injection("tendons_not_actuated", tendons_not_actuated, present()),
    Injection("no_soft_chain", no_soft_chain, {"bad": (1.5, 3.0), "near miss": (0.75, 1.0)}),
    Injection("disconnected", disconnected, present()),
    Injection("segments_gap", of_spec(segments_gap), {"bad": (3, 7), "near miss": (0.1, 0.4), "band": (0.7, 1.6)}),
    Injection("fully_actuated", of_spec(fully_actuated), {"bad": (1.0, 1.0), "near miss": (0.3, 0.5)}),
    Injection("ctrlrange_missing", of_spec(ctrlrange_missing), present()),
    Injection("range_inverted_ignored", of_spec(range_inverted_ignored), present()),
    Injection(
        "joint_range_too_small",
        of_spec(joint_range_too_small),
        {"bad": (2.1, 57), "near miss": (0.1, 0.48), "band": (0.6, 1.8)},
    ),
)
"""Faults of structure."""
