"""Fixes of a robot's strength: forces and ranges of its actuators, stiffness of its springs."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass

from lxml import etree

from aidsr.core.errors import MjcfError
from aidsr.core.formatting import counted
from aidsr.fixes.record import EditDocument, Fix, Request
from aidsr.mjcf.edit import (
    effective_numbers,
    entries,
    gain_sign,
    get_numbers,
    is_servo,
    joints,
    scale_forces,
    scale_springs,
    set_numbers,
)
from aidsr.mjcf.elements import Element, elements
from aidsr.mjcf.schema import actuator_elements

_STRONGER = 1.5
"""Smallest factor on forces, and the factor if the fault does not say how much is missing. Our choice."""

_WEAKER = 0.67
_TOO_MUCH = {"actuator_overforce": 1.0, "actuator_power": 0.5}
"""Faults of too strong actuators, and the exponent n with which force is proportional to (measured value)^n."""

_HOLDING_RAD = 0.6
"""Largest total angle by which a limb may bend under its weight. Our choice: a limb that sags by a third of its length.
"""
BENT_RAD = 1.0
"""Angle by which the strongest pull should bend a limb against its springs. Our choice: about 60 degrees."""
_LEAST_WEIGHTS = 0.05
"""Smallest pull that `weaken` leaves / weight of the robot. Our choice: a tenth of the pull that `actuator_too_weak`
requires of an actuator that hardly moves the robot."""
_DAMPING_S = 0.1
"""Damping time c / k up to which the damping grows with the stiffness of a spring. Our choice."""
_MOST_WEIGHTS = 20.0
"""Largest pull that is given to a weak actuator / weight of the robot. Our choice: less than half of what a winch of
its size holds."""

_LET_GO = 1.3
"""Factor on the upper end of a servo's range. Our choice: more than the stroke of a limb bent by 3 rad."""


def strengthen(root: Element, request: Request) -> Iterator[str]:
    """Let the actuators in question pull as hard as bending the robot takes; all of them where none is named."""
    yield from _scale_forces(root, max(_missing_factor(request), _bending_factor(root, request)), request.names)


def _bending_factor(root: Element, request: Request) -> float:
    """Return the factor by which a pull must grow to reach weight x L / moment arm, with which a limb lifts itself.

    The fault gives the measured pull in weights of the robot. 1 if the robot does not compile or has no tendon.
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
    weights = min(read_structure(model).characteristic_length_m / lever_m, _MOST_WEIGHTS)
    return float(f"{weights / pull:.3g}")


def weaken(root: Element, request: Request) -> Iterator[str]:
    """Reduce the force of every actuator to two thirds, or to less if the limit on force or power requires it.

    If force or power is too large, the springs become softer too, so that the limb still bends. Nothing is changed if
    the remaining pull could not move the robot's weight: such a robot is too heavy, and its winches are not too strong.
    """
    fault, factor = request.fault, _WEAKER
    if fault is None or fault.code not in _TOO_MUCH:
        yield from _scale_forces(root, factor)
        return
    if fault.measured and fault.limit:
        factor = min(factor, 0.9 * (fault.limit / fault.measured) ** _TOO_MUCH[fault.code])
    factor = float(f"{factor:.2g}")
    pull = read_pull(root)
    if pull and factor * pull.force_n < _LEAST_WEIGHTS * pull.weight_n:
        return
    yield from _scale_forces(root, factor)
    if pull and 0 < (bend_rad := factor * pull.bend_rad) < BENT_RAD:
        yield from _scale_springs(root, float(f"{min(max(bend_rad / BENT_RAD, _holding_factor(root)), 1.0):.2g}"))


@dataclass(frozen=True)
class Pull:
    """Largest static effect of a robot's actuators in its initial pose."""

    force_n: float
    """Largest force of an actuator [N]."""
    tension_n: float
    """Largest pull of an actuator on a tendon [N]; 0 if they only push."""
    bend_rad: float
    """Largest bend by an actuator against the springs, summed over the joints that it acts on [rad]."""
    weight_n: float
    """Weight of the whole robot [N]."""


def read_pull(root: Element, names: Collection[str] = ()) -> Pull | None:
    """Return the strongest pull of a robot's actuators; None if it does not compile.

    Args:
        root: Root of the document.
        names: Names of the actuators or of their tendons; empty for all actuators.
    """
    import mujoco
    import numpy as np

    from aidsr.mjcf.compile import compile_mjcf
    from aidsr.sim.actuator_force import control_of

    try:
        model = compile_mjcf(etree.tostring(root, encoding="unicode"))
    except MjcfError:
        return None
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    moments = np.zeros((model.nout, model.nv))
    mujoco.mju_sparse2dense(
        moments, data.actuator_moment.ravel(), data.moment_rownnz, data.moment_rowadr, data.moment_colind.ravel()
    )
    forces_n, pulls_n = np.zeros(model.nout), np.zeros(model.nout)
    for end in (0, 1):
        data.ctrl[:] = model.actuator_ctrlrange[:, end]
        for actuator in np.flatnonzero(model.actuator_actadr >= 0).tolist():
            data.act[model.actuator_actadr[actuator]] = data.ctrl[control_of(model, actuator)]
        mujoco.mj_forward(model, data)
        forces_n = np.maximum(forces_n, np.abs(data.actuator_force))
        pulls_n = np.maximum(pulls_n, -data.actuator_force * model.actuator_gear[:, 0])
    of_output = np.repeat(np.arange(model.nactuator), model.actuator_outnum).tolist()
    tendons = {
        actuator: model.tendon(model.actuator_trnid[actuator, 0]).name
        for actuator in np.flatnonzero(model.actuator_trntype == mujoco.mjtTrn.mjTRN_TENDON).tolist()
    }
    chosen = [not names or not {model.actuator(i).name, tendons.get(i)}.isdisjoint(names) for i in of_output]
    forces_n *= chosen
    pulls_n *= [asked and i in tendons for asked, i in zip(chosen, of_output, strict=True)]
    sprung = np.flatnonzero(model.jnt_stiffness > 0)
    bend_rad_n = (np.abs(moments[:, model.jnt_dofadr[sprung]]) / model.jnt_stiffness[sprung]).sum(axis=1)
    return Pull(
        force_n=float(forces_n.max(initial=0.0)),
        tension_n=float(pulls_n.max(initial=0.0)),
        bend_rad=float((forces_n * bend_rad_n).max(initial=0.0)),
        weight_n=float(model.body_mass.sum() * np.linalg.norm(model.opt.gravity)),
    )


def _scale_forces(root: Element, factor: float, names: tuple[str, ...] = ()) -> Iterator[str]:
    if changed := scale_forces(root, factor, names):
        yield f"multiplied the force of {counted(changed, 'actuator')} by {factor:g}"


def _missing_factor(request: Request) -> float:
    """Return the factor by which a measured value must grow to exceed its limit by a fifth, clipped to 1.5 to 5."""
    fault = request.fault
    if fault is None or not fault.measured or not fault.limit:
        return _STRONGER
    return round(min(max(1.2 * fault.limit / fault.measured, _STRONGER), 5.0), 2)


def stiffen_springs(root: Element, _: Request) -> Iterator[str]:
    """Make every joint spring at least 1.8 times as stiff, and stiff enough to hold what hangs on it."""
    factor = max(1.8, _holding_factor(root))
    changed = 0
    for joint in joints(root):
        stiffness, damping = get_numbers(joint, "stiffness"), get_numbers(joint, "damping")
        if stiffness and stiffness[0] > 0:
            set_numbers(joint, "stiffness", *(factor * value for value in stiffness))
            if damping:
                most = max(damping[0], _DAMPING_S * factor * stiffness[0])
                set_numbers(joint, "damping", min(factor * damping[0], most), *damping[1:])
            changed += 1
    if changed:
        yield f"multiplied the stiffness of joints by {factor:g}, in {counted(changed, 'place')}"


def _holding_factor(root: Element) -> float:
    """Return the factor by which springs are too soft to hold their limb.

    It is the bend of the limb under its weight, summed over its joints, / `_HOLDING_RAD`; the bend of a joint is the
    weight that it carries x lever arm / stiffness. 1 if the robot does not compile.
    """
    import mujoco
    import numpy as np

    from aidsr.mjcf.compile import compile_mjcf

    try:
        model = compile_mjcf(etree.tostring(root, encoding="unicode"))
    except MjcfError:
        return 1.0
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    gravity_m_s2 = float(np.linalg.norm(model.opt.gravity))
    bend_rad = np.zeros(model.nbody)
    for joint in np.flatnonzero(model.jnt_stiffness > 0):
        body = model.jnt_bodyid[joint]
        lever_m = np.linalg.norm(data.subtree_com[body] - data.xanchor[joint])
        moment = model.body_subtreemass[body] * gravity_m_s2 * lever_m
        # only the softest hinge of a body counts: hinges about different axes do not add up
        bend_rad[body] = max(bend_rad[body], moment / model.jnt_stiffness[joint])
    for body in range(1, model.nbody):
        bend_rad[body] += bend_rad[model.body_parentid[body]]
    return float(f"{bend_rad.max(initial=0.0) / _HOLDING_RAD:.2g}")


def soften_springs(root: Element, request: Request) -> Iterator[str]:
    """Soften every joint spring by the factor by which the measured motion is too small, at least to 0.6 times."""
    yield from _scale_springs(root, min(1.0 / _missing_factor(request), 0.6))


def _scale_springs(root: Element, factor: float) -> Iterator[str]:
    if factor != 1.0 and scale_springs(root, factor):
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
            others = [get_numbers(other, name) for other in actuators if other.tag == actuator.tag]
            acting = next((other for other in others if any(other)), None)
            if values and not any(values) and acting and bool(actuator.get("tendon")):
                set_numbers(actuator, name, *acting)
                changed += 1
            elif values and not any(values):
                acts = _pulling_gear(root, actuator) if name == "gear" else sign if name == "gainprm" else 1.0
                set_numbers(actuator, name, acts, *values[1:])
                changed += 1
    if changed:
        yield f"gave a gear or gain that acts in {counted(changed, 'place')}"


def _pulling_gear(root: Element, actuator: Element) -> float:
    """Return the gear with which an actuator acts: -1 for a motor on a tendon that would push, else 1.

    A positive force lengthens a tendon.
    """
    low_high = effective_numbers(root, actuator, "ctrlrange")
    pushes = actuator.tag == "motor" and actuator.get("tendon") and len(low_high) == 2 and sum(low_high) > 0
    return -1.0 if pushes else 1.0


def let_go(root: Element, _: Request) -> Iterator[str]:
    """Open the ranges of tendon servos upwards, so that one can let go while its antagonist pulls, and none pushes."""
    changed = 0
    for servo in _on_tendons(root, "position", "general"):
        if not is_servo(root, servo):
            continue
        low_high = effective_numbers(root, servo, "ctrlrange")
        if len(low_high) == 2 and low_high[0] >= 0:
            set_numbers(servo, "ctrlrange", low_high[0], _LET_GO * low_high[1])
            _forbid_pushing(root, servo)
            changed += 1
    if changed:
        yield f"opened the ranges of {counted(changed, 'servo')}, so that they can let go"


def _forbid_pushing(root: Element, servo: Element) -> bool:
    """Limit the force of a servo on a tendon to pulling; return whether anything was changed.

    A servo without a force range may pull as hard as it does in the initial pose at an end of its control range. One
    that only pushes there stays as it is.
    """
    side = math.copysign(1.0, (effective_numbers(root, servo, "gear") or [1.0])[0])
    limits_n = sorted(side * force_n for force_n in effective_numbers(root, servo, "forcerange"))
    if len(limits_n) == 2:
        if limits_n[1] <= 0:
            return False
        limit_n = -limits_n[0] if limits_n[0] < 0 else limits_n[1]
    else:
        pull = read_pull(root, [servo.get("name") or servo.get("tendon") or ""])
        limit_n = float(f"{pull.tension_n:.4g}") if pull else 0.0
    if limit_n:
        set_numbers(servo, "forcerange", *sorted((0.0, -side * limit_n)))
        servo.attrib.pop("forcelimited", "")
    return bool(limit_n)


def pull_only(root: Element, request: Request) -> Iterator[str]:
    """Cut the pushing half off the ranges of actuators on tendons, and give servos a force range that only pulls.

    A positive force lengthens a tendon.
    """
    changed = 0
    for motor in _on_tendons(root, "motor", "general", "position"):
        known = not request.names or motor.get("name") in request.names or motor.get("tendon") in request.names
        sign, low_high = gain_sign(root, motor), effective_numbers(root, motor, "ctrlrange")
        if known and is_servo(root, motor):
            changed += _forbid_pushing(root, motor)
            continue
        if not known or len(low_high) != 2 or not sign:
            continue
        strongest = max(map(abs, low_high))
        wanted = [0.0, strongest] if sign < 0 else [-strongest, 0.0]
        if wanted != low_high:
            set_numbers(motor, "ctrlrange", *wanted)
            changed += 1
    if changed:
        yield f"let {counted(changed, 'actuator')} only pull"


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
