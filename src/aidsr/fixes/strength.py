"""Fixes of how strong a robot is: forces and ranges of its actuators, stiffness of its springs."""

from __future__ import annotations

from collections.abc import Iterator

from lxml import etree

from aidsr.core.errors import MjcfError
from aidsr.fixes.record import EditDocument, Fix, Request
from aidsr.mjcf.edit import (
    effective_numbers,
    entries,
    gain_sign,
    get_numbers,
    scale_forces,
    scale_springs,
    set_numbers,
)
from aidsr.mjcf.elements import Element, elements
from aidsr.mjcf.schema import actuator_elements

_STRONGER = 1.5
"""Factor on forces where nothing says how much is missing. Our choice."""

_LET_GO = 1.3
"""How much further a servo's range is opened. Our choice: more than the stroke of a limb bent by 3 rad."""


def strengthen(root: Element, request: Request) -> Iterator[str]:
    """Let the actuators in question pull as hard as bending the robot takes; all of them where none is named."""
    yield from _scale_forces(root, max(_missing_factor(request), _bending_factor(root, request)), request.names)


def _bending_factor(root: Element, request: Request) -> float:
    """Return by what factor a pull stays below weight x length / lever of the tendons, with which a limb lifts itself.

    A fault measures the pull in weights; 1 where the robot does not compile or has no tendon.
    """
    import mujoco

    from aidsr.mjcf.compile import compile_mjcf
    from aidsr.sim.structure import read_structure

    try:
        model = compile_mjcf(etree.tostring(root, encoding="unicode"))
    except MjcfError:
        return 1.0
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    lever_m = max(map(abs, data.ten_J.ravel()), default=0.0)
    pull = request.fault.measured if request.fault else None
    if not lever_m or not pull:
        return 1.0
    return float(f"{read_structure(model).characteristic_length_m / lever_m / pull:.3g}")


def weaken(root: Element, _: Request) -> Iterator[str]:
    """Let every actuator pull a third less hard."""
    yield from _scale_forces(root, 0.67)


def _scale_forces(root: Element, factor: float, names: tuple[str, ...] = ()) -> Iterator[str]:
    if changed := scale_forces(root, factor, names):
        yield f"multiplied the force of {changed} actuators by {factor:g}"


def _missing_factor(request: Request) -> float:
    """Return by what factor a measured value stays below its limit, with a fifth to spare, within 1.5 to 5."""
    fault = request.fault
    if fault is None or not fault.measured or not fault.limit:
        return _STRONGER
    return round(min(max(1.2 * fault.limit / fault.measured, _STRONGER), 5.0), 2)


def stiffen_springs(root: Element, _: Request) -> Iterator[str]:
    """Make every joint spring 1.8 times as stiff, with damping in step."""
    yield from _scale_springs(root, 1.8)


def soften_springs(root: Element, request: Request) -> Iterator[str]:
    """Make every joint spring as much softer as was found too little moved, at most 0.6 times as stiff."""
    yield from _scale_springs(root, min(1.0 / _missing_factor(request), 0.6))


def _scale_springs(root: Element, factor: float) -> Iterator[str]:
    if scale_springs(root, factor):
        yield f"multiplied joint stiffness and damping by {factor:g}"


def restore_gear(root: Element, _: Request) -> Iterator[str]:
    """Give actuators whose gear or gain is zero one that acts, and pulls where only pulling forces are allowed."""
    actuators = list(elements(root, *actuator_elements()))
    limits = [get_numbers(actuator, "forcerange") for actuator in actuators]
    sign = -1.0 if any(limit and max(limit) <= 0 for limit in limits) else 1.0
    changed = 0
    for actuator in actuators:
        for name in ("gear", "gainprm", "kp"):
            values = get_numbers(actuator, name)
            if values and not any(values):
                acts = _pulling_gear(root, actuator) if name == "gear" else sign if name == "gainprm" else 1.0
                set_numbers(actuator, name, acts, *values[1:])
                changed += 1
    if changed:
        yield f"gave a gear or gain that acts in {changed} places"


def _pulling_gear(root: Element, actuator: Element) -> float:
    """The gear with which a motor on a tendon pulls: a positive force lengthens it."""
    low_high = effective_numbers(root, actuator, "ctrlrange")
    pushes = actuator.tag == "motor" and actuator.get("tendon") and len(low_high) == 2 and sum(low_high) > 0
    return -1.0 if pushes else 1.0


def let_go(root: Element, _: Request) -> Iterator[str]:
    """Open the ranges of tendon servos upwards, so that one can let go while its antagonist pulls, and none pushes."""
    changed = 0
    for servo in _on_tendons(root, "position"):
        low_high = effective_numbers(root, servo, "ctrlrange")
        if len(low_high) == 2 and low_high[0] >= 0:
            set_numbers(servo, "ctrlrange", low_high[0], _LET_GO * low_high[1])
            force, gain = effective_numbers(root, servo, "forcerange"), effective_numbers(root, servo, "kp")
            pull = abs(min(force)) if len(force) == 2 else max(gain, default=1.0) * low_high[1]
            if gain_sign(root, servo) > 0 and pull and (len(force) != 2 or max(force) > 0):
                set_numbers(servo, "forcerange", -pull, 0.0)
            changed += 1
    if changed:
        yield f"opened the ranges of {changed} servos, so that they can let go"


def pull_only(root: Element, request: Request) -> Iterator[str]:
    """Cut the pushing half off the ranges of motors on tendons: a positive force lengthens a tendon."""
    changed = 0
    for motor in _on_tendons(root, "motor", "general"):
        known = not request.names or motor.get("name") in request.names or motor.get("tendon") in request.names
        sign, low_high = gain_sign(root, motor), effective_numbers(root, motor, "ctrlrange")
        if not known or len(low_high) != 2 or not sign:
            continue
        strongest = max(map(abs, low_high))
        wanted = [0.0, strongest] if sign < 0 else [-strongest, 0.0]
        if wanted != low_high:
            set_numbers(motor, "ctrlrange", *wanted)
            changed += 1
    if changed:
        yield f"let {changed} motors only pull"


def _on_tendons(root: Element, *tags: str) -> list[Element]:
    return [actuator for actuator in entries(root, "actuator") if actuator.tag in tags and actuator.get("tendon")]


FIXES: tuple[Fix[EditDocument], ...] = (
    Fix(restore_gear, cures=("zero_gear",)),
    Fix(strengthen, cures=("actuator_too_weak",)),
    Fix(
        weaken,
        cures=("numerical_instability", "energy_growth", "limit_overrun", "actuator_overforce", "actuator_power"),
    ),
    Fix(stiffen_springs, cures=("gravity_collapse", "passive_collapse")),
    Fix(soften_springs, cures=("too_stiff", "few_bent_joints")),
    Fix(let_go, cures=("antagonist_lock",)),
    Fix(pull_only, cures=("tendon_pushes",)),
)
