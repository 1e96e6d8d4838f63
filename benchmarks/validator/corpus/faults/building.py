"""Faults of robots that cannot be built: impossible cables, motors, densities and walls."""

# ruff: noqa: ARG001 - every change takes a generator and a size, whether it needs them or not
from __future__ import annotations

import mujoco
import numpy as np
from benchmarks.validator.corpus.faults.anatomy import inner_joints, pull_actuators, read_anatomy
from benchmarks.validator.corpus.faults.injection import Injection, UnsuitableError, of_spec
from benchmarks.validator.corpus.faults.parts import tree_of
from lxml import etree


def fewer_guides(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
    """Remove the guides of every tendon, except each `size`-th one and the last."""
    anatomy = read_anatomy(mujoco.MjSpec.from_string(mjcf))
    if not anatomy.routes:
        raise UnsuitableError("no tendon over sites alone")
    root, step = tree_of(mjcf), round(size)
    for element in root.findall("tendon/spatial"):
        sites = list(element)
        if any(site.tag != "site" for site in sites) or len(sites) < 2 * step:
            raise UnsuitableError("few guides")
        for index, site in enumerate(sites):
            if index % step and index != len(sites) - 1:
                element.remove(site)
    return etree.tostring(root, encoding="unicode"), f"one guide in {step} left"


def pushing(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Let motors push with `size` x 0.1 of the force with which they pull."""
    changed = 0
    for actuator in pull_actuators(spec):
        low, high = actuator.ctrlrange
        if np.array(actuator.biasprm).any() or not (low == 0 or high == 0):
            continue
        actuator.ctrlrange = [-0.1 * size * high, high] if low == 0 else [low, -0.1 * size * low]
        changed += 1
    if not changed:
        raise UnsuitableError("no motor that only pulls")
    return f"{changed} motors push with {10 * size:.3g} % of their pull"


def stronger(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Multiply forces, stiffness and damping by `size`: the robot moves as before, but with other forces."""
    for actuator in pull_actuators(spec):
        actuator.gainprm, actuator.biasprm = np.array(actuator.gainprm) * size, np.array(actuator.biasprm) * size
        actuator.forcerange = np.array(actuator.forcerange) * size
    for joint in inner_joints(spec):
        joint.stiffness, joint.damping = np.array(joint.stiffness) * size, np.array(joint.damping) * size
    return f"forces, stiffness and damping times {size:.3g}"


def longer_levers(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Make the whole robot `size` times as large, of the same material under the same strain."""
    if any(int(joint.type) == 0 for joint in spec.joints):
        raise UnsuitableError("a free robot")
    for body in spec.bodies:
        body.pos = np.array(body.pos) * size
    for geom in spec.geoms:
        if int(geom.type) != int(mujoco.mjtGeom.mjGEOM_PLANE):
            geom.size, geom.pos = np.array(geom.size) * size, np.array(geom.pos) * size
            geom.fromto = np.array(geom.fromto) * size
            geom.mass = geom.mass * size**3
    for site in spec.sites:
        site.pos = np.array(site.pos) * size
    for joint in inner_joints(spec):
        joint.stiffness, joint.damping = np.array(joint.stiffness) * size**4, np.array(joint.damping) * size**4.5
    for actuator in pull_actuators(spec):
        if np.array(actuator.biasprm).any():
            raise UnsuitableError("servos on lengths")
        actuator.gainprm = np.array(actuator.gainprm) * size**3
    return f"{size:.3g} times as large"


def odd_density(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Give one body a density of 23,000 kg/m3 x `size`, or of 5 kg/m3 / `size`."""
    anatomy = read_anatomy(spec)
    model = anatomy.model
    names = [model.body(b).name for limb in anatomy.limbs for b in limb.bodies]
    candidates = [name for name in names if name and spec.body(name).geoms]
    if not candidates:
        raise UnsuitableError("bodies without names")
    name = candidates[int(rng.integers(len(candidates)))]
    wanted = 23_000 * size if rng.random() < 0.5 else 5 / size
    for geom in spec.body(name).geoms:
        geom.mass, geom.density = float("nan"), wanted
    return f"{name} has a density of {wanted:.3g} kg/m3"


def loose(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Let servos pay out so much cable that it is slack for about `size` x 0.3 of the command range, at most 97 %."""
    anatomy, share, changed = read_anatomy(spec), min(0.3 * size, 0.97), 0
    for actuator in pull_actuators(spec):
        # about the length that the cable has if the limb is bent the other way
        rest_m = float(anatomy.data.ten_length[anatomy.model.tendon(actuator.target).id])
        low, taut_m = float(actuator.ctrlrange[0]), 1.08 * rest_m
        if np.array(actuator.biasprm)[1] and low < taut_m:
            actuator.ctrlrange = [low, taut_m + (taut_m - low) * share / (1 - share)]
            changed += 1
    if not changed:
        raise UnsuitableError("no servos on lengths")
    return f"{changed} servos pay out {100 * share:.0f} % too much"


def thin_web(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Add a plate with a thickness of 0.8 mm / `size` to one body; other bodies can touch it."""
    anatomy = read_anatomy(spec)
    bodies = [b for limb in anatomy.limbs for b in limb.bodies]
    named = [b for b in bodies if anatomy.model.body(b).name and anatomy.model.body_geomnum[b]]
    if not named:
        raise UnsuitableError("bodies without names")
    body = named[int(rng.integers(len(named)))]
    geom, half_m = int(anatomy.model.body_geomadr[body]), 0.5 * anatomy.half_width_m(body)
    spec.body(anatomy.model.body(body).name).add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[half_m, half_m, 0.0004 / size],
        pos=anatomy.model.geom_pos[geom],
        contype=1,
        conaffinity=1,
    )
    return f"{anatomy.model.body(body).name} has a web of {0.8 / size:.2g} mm"


BUILDING: tuple[Injection, ...] = (
    Injection("tendon_through_body", fewer_guides, {"bad": (4, 9), "band": (2, 4)}, {"realizable": True}),
    Injection("tendon_skips_segments", fewer_guides, {"bad": (4, 8), "near miss": (1, 1)}, {"realizable": True}),
    Injection(
        "tendon_pushes",
        of_spec(pushing),
        {"bad": (2.1, 10), "near miss": (0.05, 0.45), "band": (0.6, 1.8)},
        {"realizable": True},
    ),
    Injection(
        "actuator_overforce",
        of_spec(stronger),
        {"bad": (3, 200), "near miss": (0.8, 1.2), "band": (1, 20)},
        {"realizable": True},
    ),
    Injection(
        "actuator_power", of_spec(longer_levers), {"bad": (5, 20), "near miss": (0.8, 1.2)}, {"realizable": True}
    ),
    Injection(
        "actuator_speed", of_spec(longer_levers), {"bad": (25, 120), "near miss": (0.8, 1.2)}, {"realizable": True}
    ),
    Injection("cable_stroke", of_spec(longer_levers), {"bad": (20, 80), "near miss": (0.8, 1.2)}, {"realizable": True}),
    Injection(
        "implausible_density",
        of_spec(odd_density),
        {"bad": (2.1, 8), "near miss": (0.1, 0.45)},
        {"realizable": True},
    ),
    Injection(
        "tendon_slack",
        of_spec(loose),
        {"bad": (2.1, 3.2), "near miss": (0.05, 0.4), "band": (0.7, 1.6)},
        {"realizable": True},
    ),
    Injection(
        "thin_wall",
        of_spec(thin_web),
        {"bad": (2.1, 8), "near miss": (0.1, 0.45), "band": (0.6, 1.8)},
        {"realizable": True},
    ),
)
"""Faults of robots that can be simulated but not built."""
