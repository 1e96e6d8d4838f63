"""Whether a robot is a tendon-driven continuum robot: what of a compiled model is out of scope.

In scope is a robot with sensors whose cables and soft body do the work. Cables pull, and bend limbs of three or more
joints in series; these limbs make up a fair share of its length and of its mass. Rigid parts beside them may carry
and touch, but nothing else drives or holds the robot: no motors in joints, wheels, jets, suction or magnets.

`find_out_of_scope(model, structure)` returns what it finds in a robot or in the robot of a scene. Motors, springs and
constraints of the environment are not the robot's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.drive import read_drives
from aidsr.sim.extent import bounding_box_m
from aidsr.sim.placement import first_shapes
from aidsr.sim.soft_body import SERIES_JOINTS, SoftBody, read_soft_body, unlocked_dofs
from aidsr.sim.structure import Structure, equality_bodies, name_of

Vector = NDArray[np.float64]

PUSH_SHARE = 0.1
"""Greatest push / greatest pull of an actuator on a cable. Our choice."""
FREE_TURN_RAD = 1.5 * np.pi
"""Range of a joint without a spring from which it is an axle. Our choice: joints of a limb turn half of that
at most."""
SPRING_SHARE = 0.02
"""Torque of a joint's spring at a quarter turn / weight x length, below which none returns the joint. Our choice."""
LOADED_SHARE = 1.0
"""Energy of springs in the initial pose / weight x length. Our choice: such springs throw the robot up by its length; a
blade that springs press on a wall has half of that."""
GHOST_SHARE = 0.25
"""Length of shapes that cannot touch anything / length of all shapes that move. Our choice."""
COVER_SHARE = 0.05
"""Distance / L within which a shape that collides stands for one beside it that does not: a skin, or the discs of a
backbone. Our choice: half the spacing of ten discs."""
GAP_SHARE = 0.01
"""Depth / L that a geom's `gap` lets others enter without force, from which it counts as one that does not collide."""
MARGIN_SHARE = 0.02
"""Distance / L from which a contact may begin to push. Our choice: margins that find contacts early are far smaller."""
MOUNTED_SHARE = 0.3
"""Distance / L from the mounted part within which a limb begins, and may pass through the mount. Our choice."""
RIGID_SHARE = 1.0
"""Extent of the largest rigid part / length of the limbs that cables bend; posts that carry a limb to its work do not
count. Our choice: robots on legs have up to 0.6, grippers 0.4, a bent post 0.9."""
HEAVIEST_SHARE = 0.9
"""Mass of the heaviest rigid part / moving mass. Our choice: trunks on soft legs have up to 0.8."""
UNMOVED_SHARE = 0.5
"""Mass that no cable moves / moving mass. Our choice."""
_OUTSIDE_RANGE_RAD = 0.02
"""How far outside its range a joint may start. Our choice: rounding of degrees."""
_PRELOAD_RAD = 0.1
_PRELOAD_SHARE = 2.0
"""Turn of a spring in the initial pose, and its torque / that of the weight behind the joint, from which it is loaded
where no cable bends the joint. Our choice: a spring that only carries what hangs on it has 1 at most."""
_SHORTER = 0.9
"""Length / drawn length of a cable at which a servo's push is read as well. Our choice: a limb bent far."""

_TRN, _EQ, _JNT = mujoco.mjtTrn, mujoco.mjtEq, mujoco.mjtJoint
_HINGE, _BALL = int(_JNT.mjJNT_HINGE), int(_JNT.mjJNT_BALL)
_SLIDE, _FREE = int(_JNT.mjJNT_SLIDE), int(_JNT.mjJNT_FREE)
_ON_JOINTS = (int(_TRN.mjTRN_JOINT), int(_TRN.mjTRN_JOINTINPARENT))
_FLAT = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
_SIMPLE_GAINS = (int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE))
_SIMPLE_BIASES = (int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE))
_GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class ScopeFinding:
    """One reason why a robot is out of scope.

    Attributes:
        code: Of the fault; the validator has a rule for each.
        message: What was measured or read.
        names: Parts concerned.
        measured, limit: The figure, and what is allowed; None where there is none.
        unit: Of both; empty for that of the rule.
        whole, whole_unit: What 1 of the unit is, where it is relative.
    """

    code: str
    message: str
    names: tuple[str, ...] = ()
    measured: float | None = None
    limit: float | None = None
    unit: str = ""
    whole: float | None = None
    whole_unit: str = ""


def find_out_of_scope(model: mujoco.MjModel, structure: Structure) -> tuple[ScopeFinding, ...]:
    """Return everything that makes a robot another kind than a tendon-driven continuum robot; empty for one in scope.

    Takes milliseconds: nothing is simulated.

    Args:
        model: Compiled robot, or scene in which a robot stands; all that follows is read in its reference pose.
        structure: `read_structure(model)`.
    """
    return tuple(_Reader(model, structure).findings())


class _Reader:
    """What several findings are read off."""

    def __init__(self, model: mujoco.MjModel, structure: Structure) -> None:
        self.model, self.structure = model, structure
        self.data = mujoco.MjData(model)
        mujoco.mj_forward(model, self.data)
        self.length_m = structure.characteristic_length_m
        self.weight_n = structure.mass_kg * _GRAVITY_M_S2
        self.tendons = {tendon.id: tendon for tendon in structure.tendons}
        self.pushes = self._read_pushes()
        self.cables = tuple(a for a in structure.tendon_actuators if self._pulls_cable(a))
        self.soft: SoftBody = read_soft_body(model, structure, self.cables)

    def findings(self) -> Iterator[ScopeFinding]:
        yield from self._missing_parts()
        yield from self._other_actuators()
        yield from self._pushing_cables()
        yield from self._axles()
        yield from self._springs()
        yield from self._outside_forces()
        yield from self._outside_holds()
        yield from self._locked_joints()
        yield from self._ghosts()
        yield from self._excluded_contacts()
        yield from self._margins()
        yield from self._limbs()
        yield from self._fully_actuated()

    # --- parts -------------------------------------------------------------------------------------------------------

    def _missing_parts(self) -> Iterator[ScopeFinding]:
        structure = self.structure
        for code, parts in (
            ("no_tendons", structure.tendons),
            ("no_actuators", structure.actuators),
            ("no_sensors", structure.sensors),
        ):
            if not parts:
                yield ScopeFinding(code, f"the robot has no {code.removeprefix('no_')}", (), 0, 1)
        if structure.tendons and structure.actuators and not structure.tendon_actuators:
            names = tuple(self._name("TENDON", tendon.id) for tendon in structure.tendons)
            yield ScopeFinding("tendons_not_actuated", "no actuator pulls on a tendon", names, 0, 1)
        if structure.longest_series < SERIES_JOINTS:
            message = "no limb has three or more hinge or ball joints one after the other"
            yield ScopeFinding("no_soft_chain", message, (), structure.longest_series, SERIES_JOINTS)

    # --- actuators ---------------------------------------------------------------------------------------------------

    def _read_pushes(self) -> dict[int, tuple[float, float]]:
        """Greatest push and pull of each actuator with a control range on a tendon [N]."""
        model = self.model
        pushes = {}
        for drive in read_drives(model, self.data, self.structure):
            if not drive.on_tendon:
                continue
            forces = [
                drive.force_low_n,
                drive.force_high_n,
                *self._forces_shorter(drive.actuator, drive.low, drive.high),
            ]
            pushes[drive.actuator] = (max(0.0, *forces), max(0.0, *(-force for force in forces)))
        return pushes

    def _forces_shorter(self, actuator: int, low: float, high: float) -> list[float]:
        """Forces of an actuator on its tendon at both ends of its control range when the tendon is shorter [N].

        Source: MuJoCo documentation, Computation, "Actuation model": force = gain * input + bias, affine in the length.
        """
        model = self.model
        if int(model.actuator_gaintype[actuator]) not in _SIMPLE_GAINS:
            return []
        if int(model.actuator_biastype[actuator]) not in _SIMPLE_BIASES:
            return []
        if int(model.actuator_dyntype[actuator]) == int(mujoco.mjtDyn.mjDYN_INTEGRATOR):
            return []
        length = _SHORTER * float(self.data.actuator_length[actuator])
        gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
        slope = gain[0] + (gain[1] * length if int(model.actuator_gaintype[actuator]) == _SIMPLE_GAINS[1] else 0.0)
        offset = bias[0] + bias[1] * length if int(model.actuator_biastype[actuator]) == _SIMPLE_BIASES[1] else 0.0
        output = int(model.actuator_outadr[actuator])
        forces = np.array([slope * low + offset, slope * high + offset])
        if model.actuator_forcelimited[output]:
            forces = np.clip(forces, *model.actuator_forcerange[output])
        return list(map(float, forces * model.actuator_gear[actuator, 0]))

    def _pulls_cable(self, actuator: int) -> bool:
        """Whether an actuator on a tendon pulls a cable: along a path, or on a sum of joints like one along a limb."""
        tendon = self.tendons.get(int(self.model.actuator_trnid[actuator, 0]))
        if tendon is None or tendon.spatial:
            return tendon is not None
        push, pull = self.pushes[actuator]
        return tendon.spans > SERIES_JOINTS and push <= PUSH_SHARE * pull

    def _other_actuators(self) -> Iterator[ScopeFinding]:
        """Find actuators that are not cables: jets, adhesion and motors."""
        model = self.model
        found: dict[str, list[str]] = {"thruster": [], "adhesion": [], "motorized_joint": []}
        for actuator in self.structure.actuators:
            kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
            if actuator in self.cables:
                continue
            if kind == int(_TRN.mjTRN_BODY):
                code = "adhesion"
            elif kind == int(_TRN.mjTRN_SITE) or (kind in _ON_JOINTS and int(model.jnt_type[target]) == _FREE):
                code = "thruster"
            else:
                code = "motorized_joint"
            found[code].append(self._name("ACTUATOR", actuator))
        words = {
            "thruster": "pushes the robot from outside",
            "adhesion": "sticks to what it touches",
            "motorized_joint": "turns or slides joints without a cable along a limb",
        }
        for code, names in found.items():
            if names:
                yield ScopeFinding(code, words[code], tuple(names), len(names), 0)

    def _pushing_cables(self) -> Iterator[ScopeFinding]:
        model = self.model
        pushing = {}
        for actuator, (push, pull) in self.pushes.items():
            tendon = self.tendons.get(int(model.actuator_trnid[actuator, 0]))
            limited = model.actuator_ctrllimited[int(model.actuator_ctrladr[actuator])]
            if tendon is not None and tendon.spatial and limited and push > PUSH_SHARE * pull and push > 0:
                pushing[actuator] = push / pull if pull > 0 else np.inf
        if pushing:
            worst = max(pushing, key=lambda actuator: pushing[actuator])
            names = tuple(self._name("ACTUATOR", actuator) for actuator in pushing)
            pull = self.pushes[worst][1]
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

    # --- joints and springs ------------------------------------------------------------------------------------------

    def _inner_joints(self) -> list[int]:
        return [joint for joint in self.structure.joints if int(self.model.jnt_type[joint]) != _FREE]

    def _axles(self) -> Iterator[ScopeFinding]:
        """Find joints that turn by more than three quarters of a turn and that no spring returns."""
        model = self.model
        axles = []
        for joint in self._inner_joints():
            if int(model.jnt_type[joint]) == _SLIDE:
                continue
            low, high = model.jnt_range[joint]
            ball = int(model.jnt_type[joint]) == _BALL
            room = (2 * high if ball else high - low) if model.jnt_limited[joint] else np.inf
            torque = abs(float(model.jnt_stiffness[joint])) * np.pi / 2
            if room > FREE_TURN_RAD and torque < SPRING_SHARE * self.weight_n * self.length_m:
                axles.append(self._joint(joint))
        if axles:
            yield ScopeFinding(
                "wheel", "turns like a wheel on its axle, and no spring returns it", tuple(axles), len(axles), 0
            )

    def _springs(self) -> Iterator[ScopeFinding]:
        """Find springs that hold more energy in the initial pose than it takes to hold a limb up."""
        model = self.model
        energy: dict[str, float] = {}
        away: dict[str, float] = {}
        for joint in self._inner_joints():
            name, at = self._joint(joint), int(model.jnt_qposadr[joint])
            if int(model.jnt_type[joint]) == _BALL:
                stretch = _turn_between(model.qpos0[at : at + 4], model.qpos_spring[at : at + 4])
            else:
                stretch = float(model.qpos0[at] - model.qpos_spring[at])
                low, high = model.jnt_range[joint]
                outside = max(low - model.qpos0[at], model.qpos0[at] - high) if model.jnt_limited[joint] else 0.0
                if outside > (
                    _OUTSIDE_RANGE_RAD if int(model.jnt_type[joint]) == _HINGE else _OUTSIDE_RANGE_RAD * self.length_m
                ):
                    away[name] = float(outside)
            energy[name] = _spring_energy_j(float(model.jnt_stiffness[joint]), model.jnt_stiffnesspoly[joint], stretch)
            if model.jnt_stiffness[joint] < 0:
                energy[name] = np.inf
        for tendon in self.structure.tendons:
            name, length = self._name("TENDON", tendon.id), float(self.data.ten_length[tendon.id])
            low, high = model.tendon_lengthspring[tendon.id]
            stretch = max(0.0, length - high) - max(0.0, low - length)
            stiffness = float(model.tendon_stiffness[tendon.id])
            energy[name] = _spring_energy_j(stiffness, model.tendon_stiffnesspoly[tendon.id], stretch)
            if stiffness < 0:
                energy[name] = np.inf
        allowed_j = LOADED_SHARE * self.weight_n * self.length_m
        whole = sum(energy.values())
        if whole > allowed_j:
            names = tuple(name for name, joules in energy.items() if joules > 0.05 * whole or np.isinf(joules))
            message = "springs are loaded in the initial pose"
            if np.isfinite(whole) and self.weight_n > 0:
                unit_j = self.weight_n * self.length_m
                yield ScopeFinding(
                    "loaded_spring", message, names, whole / unit_j, LOADED_SHARE, whole=unit_j, whole_unit="J"
                )
            else:
                message = message if np.isfinite(whole) else "a spring with negative stiffness pushes from its rest"
                yield ScopeFinding("loaded_spring", message, names, None, LOADED_SHARE)
        elif thrown := [joint for joint in self._inner_joints() if self._throws(joint)]:
            message = "no cable bends the joint, and its spring is loaded beyond what hangs on it"
            yield ScopeFinding(
                "loaded_spring", message, tuple(map(self._joint, thrown)), len(thrown), 0, "loaded springs"
            )
        elif away:
            message = "starts outside the range of the joint, whose limit throws it back"
            yield ScopeFinding(
                "loaded_spring", message, tuple(away), max(away.values()), _OUTSIDE_RANGE_RAD, "rad outside its range"
            )

    def _throws(self, joint: int) -> bool:
        """Whether the spring of a hinge that cables do not bend is loaded beyond what the weight behind it asks for."""
        model, data = self.model, self.data
        body, at = int(model.jnt_bodyid[joint]), int(model.jnt_qposadr[joint])
        if body in self.soft.bent or int(model.jnt_type[joint]) != _HINGE:
            return False
        stretch = abs(float(model.qpos0[at] - model.qpos_spring[at]))
        lever_m = float(np.linalg.norm(data.subtree_com[body] - data.xanchor[joint]))
        carried = float(model.body_subtreemass[body]) * _GRAVITY_M_S2 * lever_m
        torque = abs(float(model.jnt_stiffness[joint])) * stretch
        return stretch > _PRELOAD_RAD and torque > _PRELOAD_SHARE * carried

    # --- the world ---------------------------------------------------------------------------------------------------

    def _outside_forces(self) -> Iterator[ScopeFinding]:
        model = self.model
        lifted = [body for body in self.structure.bodies if model.body_gravcomp[body] != 0]
        if lifted:
            force_n = _GRAVITY_M_S2 * sum(
                abs(float(model.body_gravcomp[body])) * float(model.body_mass[body]) for body in lifted
            )
            names = tuple(self._name("BODY", body) for body in lifted)
            yield ScopeFinding("outside_force", "gravity compensation carries it", names, force_n, 0)
        elif np.any(model.opt.wind) and not self.structure.is_scene:
            speed = float(np.linalg.norm(model.opt.wind))
            yield ScopeFinding("outside_force", "the robot's own <option> makes wind", (), speed, 0, "m/s of wind")

    def _outside_holds(self) -> Iterator[ScopeFinding]:
        """Find constraints, cables and rails between the robot and what is not the robot."""
        model, structure = self.model, self.structure
        ours = set(structure.bodies)
        held: list[str] = []
        for equality in np.flatnonzero(np.asarray(model.eq_active0)).tolist():
            ends = equality_bodies(model, equality)
            apart = len({int(model.body_weldid[end]) for end in ends}) > 1
            if apart and len([end for end in ends if end in ours]) == 1:
                held.append(self._name("EQUALITY", equality))
        held += [self._name("BODY", body) for body in structure.bodies if model.body_mocapid[body] >= 0]
        for tendon in structure.tendons:
            outside = any(body not in ours for body in tendon.bodies)
            if outside and (structure.is_scene or structure.free_roots):
                held.append(self._name("TENDON", tendon.id))
        for root in structure.roots:
            first, count = int(model.body_jntadr[root]), int(model.body_jntnum[root])
            held += [self._joint(j) for j in range(first, first + count) if int(model.jnt_type[j]) == _SLIDE]
        if held:
            yield ScopeFinding("held_from_outside", "holds or guides the robot from outside", tuple(held), len(held), 0)

    def _locked_joints(self) -> Iterator[ScopeFinding]:
        model = self.model
        free = unlocked_dofs(model, self.data)
        locked = [joint for joint in self._inner_joints() if not free[int(model.jnt_dofadr[joint])]]
        if locked:
            names = tuple(self._joint(joint) for joint in locked)
            yield ScopeFinding(
                "joint_locked", "an equality constraint leaves the joint no motion", names, len(locked), 0
            )

    # --- contact -----------------------------------------------------------------------------------------------------

    def _collides(self) -> dict[int, bool]:
        """Whether each shape of the robot collides with all surroundings that any of its shapes collides with."""
        model, structure = self.model, self.structure
        ours = set(structure.geoms)
        others = [
            g for g in range(model.ngeom) if g not in ours and (model.geom_contype[g] or model.geom_conaffinity[g])
        ]
        types, affinities = (
            np.asarray(a)[others] if others else np.array([1]) for a in (model.geom_contype, model.geom_conaffinity)
        )
        touched = {
            g: (int(model.geom_contype[g]) & affinities) | (int(model.geom_conaffinity[g]) & types) != 0
            for g in structure.geoms
        }
        most = np.any(list(touched.values()), axis=0) if touched else np.zeros(0, dtype=bool)
        deep_m = GAP_SHARE * self.length_m
        return {
            g: bool(most.any() and (row >= most).all() and model.geom_gap[g] - model.geom_margin[g] <= deep_m)
            for g, row in touched.items()
        }

    def _ghosts(self) -> Iterator[ScopeFinding]:
        """Find shapes that move with the robot and that nothing can touch, unless others of its shapes are close by."""
        model, structure = self.model, self.structure
        collides = self._collides()
        moving = [
            g
            for g in structure.geoms
            if int(model.geom_bodyid[g]) in structure.moving and int(model.geom_type[g]) not in _FLAT
        ]
        solid = [g for g in structure.geoms if collides[g]]
        ghosts = [g for g in moving if not collides[g]]
        if not ghosts:
            return
        lengths = {g: 2 * float(np.max(model.geom_aabb[g][3:])) for g in moving}
        bare = {g: self._uncovered(g, solid) * lengths[g] for g in ghosts}
        whole_m = sum(lengths.values())
        share = sum(bare.values()) / whole_m if whole_m > 0 else 0.0
        if share > GHOST_SHARE:
            names = tuple(dict.fromkeys(self._geom(g) for g in ghosts if bare[g] > 0))
            message = "passes through what is around it"
            yield ScopeFinding("ghost_shape", message, names, share, GHOST_SHARE, whole=whole_m, whole_unit="m")

    def _uncovered(self, geom: int, solid: list[int]) -> float:
        """Share of a shape's surface that is far from every shape that collides."""
        if not solid:
            return 1.0
        model, data = self.model, self.data
        box = model.geom_aabb[geom]
        points = data.geom_xpos[geom] + (box[:3] + _surface(box[3:])) @ data.geom_xmat[geom].reshape(3, 3).T
        apart = points[:, None] - data.geom_xpos[solid]
        local = np.einsum("pgi,gij->pgj", apart, data.geom_xmat[solid].reshape(-1, 3, 3)) - model.geom_aabb[solid, :3]
        away_m = np.linalg.norm(np.maximum(np.abs(local) - model.geom_aabb[solid, 3:], 0.0), axis=2).min(axis=1)
        return float(np.mean(away_m > COVER_SHARE * self.length_m))

    def _excluded_contacts(self) -> Iterator[ScopeFinding]:
        """Find contact exclusions and pairs between the robot and its surroundings.

        A limb may pass through what it is mounted on where it begins.
        """
        model, structure = self.model, self.structure
        ours = set(structure.bodies)
        found: list[int] = []
        for signature in np.asarray(model.exclude_signature).tolist():
            ends = (signature >> 16, signature & 0xFFFF)
            mine = [end for end in ends if end in ours]
            if len(mine) == 1 and not self._begins_on_mount(mine[0], ends[0] if mine[0] == ends[1] else ends[1]):
                found += mine
        for one, other in zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True):
            mine = [int(model.geom_bodyid[geom]) for geom in (one, other) if int(model.geom_bodyid[geom]) in ours]
            found += mine if len(mine) == 1 else []
        if found:
            names = tuple(dict.fromkeys(self._name("BODY", body) for body in found))
            message = "has contact settings of its own towards its surroundings"
            yield ScopeFinding("contact_excluded", message, names, len(names), 0)

    def _margins(self) -> Iterator[ScopeFinding]:
        margins_m = {g: float(self.model.geom_margin[g]) for g in self.structure.geoms}
        wide = [g for g, margin_m in margins_m.items() if margin_m > MARGIN_SHARE * self.length_m]
        if wide:
            names = tuple(dict.fromkeys(self._geom(g) for g in wide))
            share = max(margins_m.values()) / self.length_m
            message = "pushes what is still away from it"
            yield ScopeFinding(
                "contact_margin", message, names, share, MARGIN_SHARE, whole=self.length_m, whole_unit="m"
            )

    def _begins_on_mount(self, body: int, other: int) -> bool:
        """Whether a body is close to the fixed root or the first shape behind it, and the other is its mount."""
        model, structure = self.model, self.structure
        fixed = [root for root in structure.roots if root not in structure.free_roots]
        if int(model.body_weldid[other]) not in {
            int(model.body_weldid[int(model.body_parentid[root])]) for root in fixed
        }:
            return False
        if body in first_shapes(model, list(structure.bodies), int(model.body_weldid[other])):
            return True
        base = [b for b in structure.bodies if b not in structure.moving]
        low, high = bounding_box_m(model, self.data, base or fixed)
        at = self.data.xpos[body]
        return bool(np.linalg.norm(np.maximum(0.0, np.maximum(low - at, at - high))) <= MOUNTED_SHARE * self.length_m)

    # --- soft body ---------------------------------------------------------------------------------------------------

    def _limbs(self) -> Iterator[ScopeFinding]:
        """Find cables that bend nothing, and robots that are rigid for the most part."""
        structure, soft = self.structure, self.soft
        if not self.cables or structure.longest_series < SERIES_JOINTS:
            return
        if soft.series < SERIES_JOINTS:
            message = f"cables bend {soft.series} joints one after the other"
            yield ScopeFinding("few_bent_joints", message, (), soft.series, SERIES_JOINTS)
            return
        if soft.linkage:
            names = tuple(self._name("BODY", body) for body in soft.linkage)
            message = "a cable turns or slides it on a joint of its own"
            yield ScopeFinding("cable_on_linkage", message, names, len(names), 0)
        share = soft.largest_part_m / soft.length_m
        if share > RIGID_SHARE:
            names = tuple(self._name("BODY", body) for body in soft.largest_part)
            message = f"a rigid part of {soft.largest_part_m:.3g} m"
            yield ScopeFinding("mostly_rigid", message, names, share, RIGID_SHARE, whole=soft.length_m, whole_unit="m")
        for bodies, mass_share, limit, message in (
            (soft.heaviest_part, soft.heaviest_share, HEAVIEST_SHARE, "a rigid part has nearly all of the mass"),
            (soft.unmoved, soft.unmoved_share, UNMOVED_SHARE, "no cable moves these bodies"),
        ):
            if mass_share > limit:
                names = tuple(self._name("BODY", body) for body in bodies)
                yield ScopeFinding(
                    "mostly_rigid", message, names, mass_share, limit, "of the moving mass", structure.mass_kg, "kg"
                )

    def _fully_actuated(self) -> Iterator[ScopeFinding]:
        """Find robots with as many independent actuators as ways to bend.

        Source: our choice, after the usual definition of a continuum robot as underactuated; rank of the actuators'
        moments over the degrees of freedom inside the robot.
        """
        model, data, structure = self.model, self.data, self.structure
        if structure.longest_series < SERIES_JOINTS:
            return
        joints = set(self._inner_joints())
        inner = [dof for dof in range(model.nv) if int(model.dof_jntid[dof]) in joints]
        moments = np.zeros((model.nout, model.nv))
        mujoco.mju_sparse2dense(
            moments, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
        )
        outputs = [int(model.actuator_outadr[actuator]) for actuator in structure.actuators]
        rank = int(np.linalg.matrix_rank(moments[np.ix_(outputs, inner)])) if outputs and inner else 0
        if inner and rank >= len(inner):
            names = tuple(self._name("ACTUATOR", actuator) for actuator in structure.actuators)
            message = f"the actuators command each of the {len(inner)} degrees of freedom on its own"
            yield ScopeFinding("fully_actuated", message, names, rank, len(inner) - 1)

    # --- names -------------------------------------------------------------------------------------------------------

    def _name(self, kind: str, index: int) -> str:
        return name_of(self.model, getattr(mujoco.mjtObj, f"mjOBJ_{kind}"), index)

    def _joint(self, joint: int) -> str:
        name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        return name or f"joint of {self._name('BODY', int(self.model.jnt_bodyid[joint]))}"

    def _geom(self, geom: int) -> str:
        name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_GEOM, geom)
        return name or f"geom of {self._name('BODY', int(self.model.geom_bodyid[geom]))}"


def _turn_between(one: Vector, other: Vector) -> float:
    """Angle between two orientations [rad]."""
    velocity = np.zeros(3)
    mujoco.mju_subQuat(velocity, np.asarray(one), np.asarray(other))
    return float(np.linalg.norm(velocity))


def _spring_energy_j(stiffness: float, poly: Vector, stretch: float) -> float:
    """Energy of a spring [J].

    Source: MuJoCo XML reference, joint/stiffness: force = x (k + p0 |x| + p1 x^2).
    """
    x = abs(stretch)
    return 0.5 * stiffness * x**2 + float(poly[0]) * x**3 / 3 + float(poly[1]) * x**4 / 4


def _surface(half: Vector) -> Vector:
    """Points on a box around its longest axis, (n, 3): stations along it, on its four sides."""
    order = np.argsort(half)
    points = []
    for station in np.linspace(-1, 1, 5):
        for axis in order[:2]:
            for side in (-1, 1):
                point = np.zeros(3)
                point[order[2]], point[axis] = station * half[order[2]], side * half[axis]
                points.append(point)
    return np.array(points)
