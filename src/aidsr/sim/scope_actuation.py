"""Scope checks of actuation: a robot must be driven by cables that pull, and by nothing else."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from aidsr.sim.actuator_force import control_of, output_of
from aidsr.sim.limbs import SERIES_JOINTS
from aidsr.sim.scope_reader import PUSH_SHARE, ScopeFinding, ScopeReader

RIGID_SHARE = 1.0
"""Largest allowed extent of a rigid part / length of the limbs that cables bend. Posts that carry a limb to its working
position do not count. Our choice: robots on legs have up to 0.6, grippers 0.4, a bent post 0.9."""
HEAVIEST_SHARE = 0.9
"""Largest allowed mass of a rigid part / moving mass. Our choice: trunks on soft legs have up to 0.8."""
UNMOVED_SHARE = 0.5
"""Largest allowed mass that no cable moves / moving mass. Our choice."""
LEVER_SHARE = 0.5
"""Largest allowed distance of a rigid part from its joint, where fewer than three joints that cables bend carry it /
length of its limb. Our choice: 388 published designs and scenes have up to 0.31, 400 robots of the corpus's writers up
to 0.34, jaws on the first link of a limb that points away 0.86, jaws that a limb of 0.15 m releases 0.71."""
_TRN, _JNT = mujoco.mjtTrn, mujoco.mjtJoint
_FREE = int(_JNT.mjJNT_FREE)
_ON_JOINTS = (int(_TRN.mjTRN_JOINT), int(_TRN.mjTRN_JOINTINPARENT))


def find_missing_parts(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find robots without cables, actuators, sensors or a limb."""
    structure = reader.structure
    for code, parts in (
        ("no_tendons", structure.tendons),
        ("no_actuators", structure.actuators),
        ("no_sensors", structure.sensors),
    ):
        if not parts:
            yield ScopeFinding(code, f"the robot has no {code.removeprefix('no_')}", (), 0, 1)
    if structure.tendons and structure.actuators and not structure.tendon_actuators:
        names = tuple(reader.name("TENDON", tendon.id) for tendon in structure.tendons)
        yield ScopeFinding("tendons_not_actuated", "no actuator pulls on a tendon", names, 0, 1)
    if structure.longest_series < SERIES_JOINTS:
        message = "no limb has three or more hinge or ball joints one after the other"
        yield ScopeFinding("no_soft_chain", message, (), structure.longest_series, SERIES_JOINTS)


def find_other_actuators(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find actuators that do not pull cables: jets, adhesion and motors."""
    model = reader.model
    found: dict[str, list[str]] = {"thruster": [], "adhesion": [], "motorized_joint": []}
    for actuator in reader.structure.actuators:
        kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
        if actuator in reader.cables:
            continue
        if kind == int(_TRN.mjTRN_BODY):
            code = "adhesion"
        elif kind == int(_TRN.mjTRN_SITE) or (kind in _ON_JOINTS and int(model.jnt_type[target]) == _FREE):
            code = "thruster"
        else:
            code = "motorized_joint"
        found[code].append(reader.name("ACTUATOR", actuator))
    words = {
        "thruster": "pushes the robot from outside",
        "adhesion": "sticks to what it touches",
        "motorized_joint": "turns or slides joints without a cable along a limb",
    }
    for code, names in found.items():
        if names:
            yield ScopeFinding(code, words[code], tuple(names), len(names), 0)


def find_pushing_cables(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find actuators that can push on a cable."""
    model = reader.model
    pushing = {}
    for actuator, (push, pull) in reader.pushes.items():
        tendon = reader.tendons.get(int(model.actuator_trnid[actuator, 0]))
        limited = model.actuator_ctrllimited[control_of(model, actuator)]
        if tendon is not None and tendon.spatial and limited and push > PUSH_SHARE * pull and push > 0:
            pushing[actuator] = push / pull if pull > 0 else np.inf
    if pushing:
        worst = max(pushing, key=lambda actuator: pushing[actuator])
        names = tuple(reader.name("ACTUATOR", actuator) for actuator in pushing)
        pull = reader.pushes[worst][1]
        if pull > 0:
            yield ScopeFinding(
                "tendon_pushes",
                "pushes on its tendon",
                names,
                pushing[worst],
                PUSH_SHARE,
                whole=pull,
                whole_unit="N",
            )
        else:
            yield ScopeFinding("tendon_pushes", "pushes on its tendon and never pulls", names, None, PUSH_SHARE)


def find_limbs(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find robots whose cables bend too few joints, or that are mostly rigid."""
    structure, soft = reader.structure, reader.soft
    if not reader.cables or structure.longest_series < SERIES_JOINTS:
        return
    if soft.series < SERIES_JOINTS:
        message = f"cables bend {soft.series} joints one after the other"
        yield ScopeFinding("few_bent_joints", message, (), soft.series, SERIES_JOINTS)
        return
    if soft.linkage:
        names = tuple(reader.name("BODY", body) for body in soft.linkage)
        message = "a cable turns or slides it on a joint of its own"
        yield ScopeFinding("cable_on_linkage", message, names, len(names), 0)
    share = soft.largest_part_m / soft.length_m
    if share > RIGID_SHARE:
        names = tuple(reader.name("BODY", body) for body in soft.largest_part)
        message = f"a rigid part of {soft.largest_part_m:.3g} m"
        yield ScopeFinding("mostly_rigid", message, names, share, RIGID_SHARE, whole=soft.length_m, whole_unit="m")
    if soft.lever_m > LEVER_SHARE * soft.lever_limb_m:
        names = tuple(reader.name("BODY", body) for body in soft.lever_part)
        message = (
            f"fewer than {SERIES_JOINTS} joints that cables bend carry a rigid part that reaches {soft.lever_m:.3g} m "
            "from its joint"
        )
        share = soft.lever_m / soft.lever_limb_m
        yield ScopeFinding(
            "mostly_rigid", message, names, share, LEVER_SHARE, "of its limb's length", soft.lever_limb_m, "m"
        )
    for bodies, mass_share, limit, message in (
        (soft.heaviest_part, soft.heaviest_share, HEAVIEST_SHARE, "a rigid part has nearly all of the mass"),
        (soft.unmoved, soft.unmoved_share, UNMOVED_SHARE, "no cable moves these bodies"),
    ):
        if mass_share > limit:
            names = tuple(reader.name("BODY", body) for body in bodies)
            yield ScopeFinding(
                "mostly_rigid", message, names, mass_share, limit, "of the moving mass", structure.mass_kg, "kg"
            )


def find_fully_actuated(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find fully actuated robots, with as many independent actuators as internal degrees of freedom.

    Source: our choice, after the usual definition of a continuum robot as underactuated; the measure is the rank of the
    actuators' moment matrix over the degrees of freedom inside the robot.
    """
    model, data, structure = reader.model, reader.data, reader.structure
    if structure.longest_series < SERIES_JOINTS:
        return
    joints = set(reader.inner_joints())
    inner = [dof for dof in range(model.nv) if int(model.dof_jntid[dof]) in joints]
    moments = np.zeros((model.nout, model.nv))
    mujoco.mju_sparse2dense(moments, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind)
    outputs = [output_of(model, actuator) for actuator in structure.actuators]
    rank = int(np.linalg.matrix_rank(moments[np.ix_(outputs, inner)])) if outputs and inner else 0
    if inner and rank >= len(inner):
        names = tuple(reader.name("ACTUATOR", actuator) for actuator in structure.actuators)
        message = f"the actuators command each of the {len(inner)} degrees of freedom on its own"
        yield ScopeFinding("fully_actuated", message, names, rank, len(inner) - 1)
