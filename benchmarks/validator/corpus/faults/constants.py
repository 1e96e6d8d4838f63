"""Faults in constants: units, gravity, friction, keyframes, damping and filters."""

# ruff: noqa: ARG001 - every change takes a generator and a size, whether it needs them or not
from __future__ import annotations

import re

import mujoco
import numpy as np
from benchmarks.validator.corpus.faults.anatomy import inner_joints, pull_actuators
from benchmarks.validator.corpus.faults.injection import Injection, UnsuitableError, of_spec, present

_LENGTHS = re.compile(r'\b(pos|size|fromto)="([^"]*)"')


def millimetres(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
    """Multiply all positions and sizes by `size`."""
    if "<hfield" in mjcf or "<mesh" in mjcf or "<plugin" in mjcf:
        raise UnsuitableError("shapes with lengths of their own")
    text = mujoco.MjSpec.from_string(mjcf)
    text.compile()

    def larger(match: re.Match[str]) -> str:
        return f'{match[1]}="' + " ".join(f"{size * float(word):.9g}" for word in match[2].split()) + '"'

    return _LENGTHS.sub(larger, text.to_xml()), f"lengths times {size:.3g}"


def grams(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Multiply masses and inertias by `size`."""
    for body in spec.bodies:
        if body.explicitinertial:
            body.mass, body.inertia = body.mass * size, np.array(body.inertia) * size
        for geom in body.geoms:
            geom.mass, geom.density = geom.mass * size, geom.density * size
    return f"masses times {size:.3g}"


def heavy_world(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Multiply gravity by `size`."""
    if not np.array(spec.option.gravity).any():
        raise UnsuitableError("weightless")
    spec.option.gravity = np.array(spec.option.gravity) * size
    return f"gravity times {size:.3g}"


def keyframe_in_degrees(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Add a keyframe in degrees."""
    model = spec.copy().compile()
    if model.nq != model.nv:
        raise UnsuitableError("balls or a free joint")
    values = rng.uniform(-20, 20, model.nq)
    values[0] = 20.0
    spec.add_key(name="start", qpos=values)
    return "a keyframe in degrees"


def on_ice(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Give all geoms and contact pairs of a free robot and its floor a friction of 0.05 / `size`."""
    if not any(int(joint.type) == 0 for joint in spec.joints):
        raise UnsuitableError("a fixed robot")
    for geom in spec.geoms:
        geom.friction = [0.05 / size, 0.0001, 0.0001]
    for pair in spec.pairs:
        pair.friction = [0.05 / size, 0.05 / size, 0.0001, 0.0001, 0.0001]
    return f"friction {0.05 / size:.3g}"


def honey(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Set the damping of every joint to `size` seconds times its stiffness."""
    for joint in inner_joints(spec):
        joint.damping = size * np.array(joint.stiffness)
    return f"damping {size:.3g} s times the stiffness"


def lazy_motors(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Give every tendon actuator a filter with a time constant of `size` seconds."""
    for actuator in pull_actuators(spec):
        actuator.dyntype = mujoco.mjtDyn.mjDYN_FILTER
        actuator.dynprm[0] = size
    return f"a filter of {size:.3g} s"


CONSTANTS: tuple[Injection, ...] = (
    Injection("length_unit", millimetres, {"bad": (1000, 1000)}),
    Injection("mass_unit", of_spec(grams), {"bad": (1000, 1000)}),
    Injection("odd_gravity", of_spec(heavy_world), {"bad": (7, 1000), "near miss": (1.02, 1.3)}),
    Injection("keyframe_out_of_range", of_spec(keyframe_in_degrees), present()),
    Injection("no_grip", of_spec(on_ice), {"bad": (1, 20)}),
    Injection("overdamped", of_spec(honey), {"bad": (40, 400)}),
    Injection("filter_slow", of_spec(lazy_motors), {"bad": (40, 400)}),
)
"""Faults in which numbers are not those of a real robot."""
