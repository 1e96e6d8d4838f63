"""Worker side of `aidsr.fabrication.anatomy`: compile a robot and read its anatomy in the initial pose."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.core.errors import MjcfError
from aidsr.fabrication.anatomy import Anatomy, Cable, Guide, Joint, Part, Shape, Vector
from aidsr.mjcf.compile import compile_mjcf
from aidsr.sim.actuator_force import gear_of
from aidsr.sim.ownership import WRAP_SITE, tendon_wraps
from aidsr.sim.structure import name_of
from aidsr.sim.tendon_effects import unit_pull

_OBJ = mujoco.mjtObj
_FREE, _SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)
_BALL = int(mujoco.mjtJoint.mjJNT_BALL)
_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)
_WELD = int(mujoco.mjtEq.mjEQ_WELD)
_WELD_APART_MM, _WELD_TURN_RAD = 0.1, 0.01
"""Largest distance and angle between the initial and the welded pose of two bodies that are printed as one part.
Our choice: less than what printers resolve, and more than the rounding of numbers in a file."""

_LOOPS = (_WELD, int(mujoco.mjtEq.mjEQ_CONNECT))
_MESH = int(mujoco.mjtGeom.mjGEOM_MESH)
_KINDS = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
    _MESH: "hull",
}


def read(mjcf: str) -> Anatomy:
    """Return the anatomy of a robot; called in the isolated process of `aidsr.fabrication.anatomy.read_anatomy`."""
    return _Reader(compile_mjcf(mjcf)).anatomy()


class _Reader:
    """Reader of a compiled robot in its initial pose.

    A part is identified by its first body, called its root here.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        mujoco.mj_forward(model, self.data)
        self.owner = self._owners()
        kept = sorted(set(self.owner[1:].tolist()))
        self.bare = {root for root in kept if not self._solid(root)}
        self.number = {root: index for index, root in enumerate(root for root in kept if root not in self.bare)}

    def anatomy(self) -> Anatomy:
        self._refuse_what_has_no_shape()
        model = self.model
        pulling = {int(model.actuator_trnid[a, 0]): a for a in range(model.nactuator) if self._pulls(a)}
        pulled = Counter(int(model.actuator_trnid[a, 0]) for a in range(model.nactuator) if self._pulls(a))
        loops = [
            index
            for index in range(model.neq)
            if model.eq_active0[index] and int(model.eq_type[index]) in _LOOPS and not self._is_rigid_weld(index)
        ]
        return Anatomy(
            parts=tuple(self._part(root) for root in self.number),
            joints=tuple(self._joint(body) for body in range(1, model.nbody) if self._bends(body)),
            cables=tuple(self._cable(tendon, pulling.get(tendon)) for tendon in range(model.ntendon)),
            other_actuators=tuple(self._name("ACTUATOR", a) for a in range(model.nactuator) if not self._pulls(a)),
            open_loops=tuple(self._name("EQUALITY", index) for index in loops if not self._is_weld_of_bodies(index)),
            displaced_welds=tuple(self._name("EQUALITY", index) for index in loops if self._is_weld_of_bodies(index)),
            shared_cables=tuple(self._name("TENDON", tendon) for tendon, count in pulled.items() if count > 1),
            couplings=tuple(
                name_of(model, _OBJ.mjOBJ_EQUALITY, index)
                for index in range(model.neq)
                if model.eq_active0[index] and int(model.eq_type[index]) not in _LOOPS
            ),
            weightless=tuple(
                self._name("BODY", body)
                for body in range(1, model.nbody)
                if model.body_gravcomp[body] and not self._is_held(int(self.owner[body]))
            ),
        )

    def _owners(self) -> Vector:
        """Return the first body of each body's rigid part (nbody,)."""
        model = self.model
        owner = np.arange(model.nbody)
        for body in range(1, model.nbody):
            if model.body_jntnum[body] == 0 and model.body_parentid[body] != 0:
                owner[body] = owner[model.body_parentid[body]]
        for index in range(model.neq):
            if self._is_rigid_weld(index):
                one, other = sorted(owner[[model.eq_obj1id[index], model.eq_obj2id[index]]])
                owner[owner == other] = one
        return owner

    def _is_rigid_weld(self, index: int) -> bool:
        """Whether an equality constraint makes two of the robot's bodies one part.

        It does if it is an active weld that holds them in their initial relative pose.
        """
        return self._is_weld_of_bodies(index) and self._holds_initial_pose(index)

    def _is_weld_of_bodies(self, index: int) -> bool:
        """Whether an equality constraint is an active weld of two of the robot's bodies."""
        model = self.model
        return bool(
            model.eq_active0[index]
            and int(model.eq_type[index]) == _WELD
            and int(model.eq_objtype[index]) == int(_OBJ.mjOBJ_BODY)
            and model.eq_obj1id[index]
            and model.eq_obj2id[index]
        )

    def _holds_initial_pose(self, index: int) -> bool:
        """Whether the relative pose of a weld of two bodies is their initial one, within printing tolerances.

        Source: MuJoCo, `mjModel.eq_data` of a weld: the anchor in the second body's frame, its place in the first
        body's frame, and the orientation of the second body relative to the first.
        """
        data, bodies = self.data, (self.model.eq_obj1id[index], self.model.eq_obj2id[index])
        anchor, place, relative = np.split(self.model.eq_data[index][:10], (3, 6))
        (at, turn), (other_at, other_turn) = ((data.xpos[body], data.xmat[body].reshape(3, 3)) for body in bodies)
        apart_m = np.linalg.norm(at + turn @ place - other_at - other_turn @ anchor)
        welded = np.empty(9)
        mujoco.mju_quat2Mat(welded, relative / np.linalg.norm(relative))
        difference = (turn @ welded.reshape(3, 3)).T @ other_turn
        angle_rad = math.acos(np.clip((np.trace(difference) - 1) / 2, -1.0, 1.0))
        return bool(1000 * apart_m <= _WELD_APART_MM and angle_rad <= _WELD_TURN_RAD)

    def _refuse_what_has_no_shape(self) -> None:
        """Refuse bodies without shapes, except those that only add a joint to their single child body.

        Raises:
            MjcfError: A body, or the whole robot, has no solid shape.
        """
        parents = self.owner[self.model.body_parentid]
        hanging = Counter(parents[self.owner != parents].tolist())
        odd = [self._name("BODY", root) for root in sorted(self.bare) if hanging[root] != 1 or self._is_held(root)]
        if odd or not self.number:
            subject = f"{', '.join(odd)} {'have' if len(odd) > 1 else 'has'}" if odd else "the robot has"
            message = f"{subject} no solid shape to print"
            cure = "Give each a geom, or hang on it just the one body that it lets turn."
            fault = Fault(
                code="part_without_shape",
                layer="realizability",
                severity="error",
                names=tuple(odd),
                message=f"{message}. {cure}",
            )
            raise MjcfError([fault])

    def _pulls(self, actuator: int) -> bool:
        return int(self.model.actuator_trntype[actuator]) == _TENDON

    def _bends(self, body: int) -> bool:
        first = int(self.model.body_jntadr[body])
        return body not in self.bare and first >= 0 and int(self.model.jnt_type[first]) != _FREE

    def _solid(self, root: int) -> list[int]:
        """Return the solid geoms of a part: those that can collide, or all of them where none can."""
        model = self.model
        solid = [
            geom
            for geom in range(model.ngeom)
            if self.owner[model.geom_bodyid[geom]] == root and int(model.geom_type[geom]) in _KINDS
        ]
        return [geom for geom in solid if model.geom_contype[geom] or model.geom_conaffinity[geom]] or solid

    def _name(self, kind: str, index: int) -> str:
        return name_of(self.model, getattr(_OBJ, f"mjOBJ_{kind}"), index)

    def _part(self, root: int) -> Part:
        model, data = self.model, self.data
        bodies = [int(body) for body in np.flatnonzero(self.owner == root)]
        return Part(
            name=self._name("BODY", root),
            bodies=tuple(self._name("BODY", body) for body in bodies),
            body_ids=tuple(bodies),
            shapes=tuple(self._shape(geom) for geom in self._solid(root)),
            position_mm=_mm(data.xpos[root]),
            rotation=_numbers(data.xmat[root]),
            mass_kg=float(model.body_mass[bodies].sum()),
            held=self._is_held(root),
        )

    def _is_held(self, root: int) -> bool:
        """Whether the part with this first body is fixed to the world."""
        return int(self.model.body_parentid[root]) == 0 and int(self.model.body_jntnum[root]) == 0

    def _shape(self, geom: int) -> Shape:
        model, data, kind = self.model, self.data, int(self.model.geom_type[geom])
        points: tuple[Any, ...] = ()
        if kind == _MESH:
            mesh = int(model.geom_dataid[geom])
            first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            points = tuple(_mm(vertex) for vertex in model.mesh_vert[first : first + count])
        return Shape(
            name=self._name("GEOM", geom),
            kind=_KINDS[kind],
            size_mm=_mm(model.geom_size[geom]),
            position_mm=_mm(data.geom_xpos[geom]),
            rotation=_numbers(data.geom_xmat[geom]),
            points_mm=points,
        )

    def _joint(self, body: int) -> Joint:
        model, data, line = self.model, self.data, [body]
        while (before := int(self.owner[model.body_parentid[line[0]]])) in self.bare:
            line.insert(0, before)
        joints = np.flatnonzero(np.isin(model.jnt_bodyid, line)).tolist()
        kinds = {int(model.jnt_type[j]) for j in joints}
        ball = kinds == {_BALL} and len(joints) == 1
        anchors = data.xanchor[joints]
        axes = data.xmat[body].reshape(3, 3).T if ball else data.xaxis[joints]
        stiffness = [float(np.ravel(model.jnt_stiffness[j])[0]) for j in joints]
        return Joint(
            names=tuple(self._name("JOINT", j) for j in joints),
            parent=self.number.get(before, -1),
            child=self.number[int(self.owner[body])],
            bodies=(int(model.body_parentid[line[0]]), body),
            kind="ball" if ball else "hinge" if not kinds & {_SLIDE, _BALL, _FREE} else "other",
            anchor_mm=_mm(anchors.mean(axis=0)),
            axes=tuple(_numbers(axis) for axis in axes),
            stiffness_n_m_rad=tuple(stiffness) * (3 if ball else 1),
            spring_rest_rad=(0.0,) * 3 if ball else tuple(map(self._spring_rest, joints)),
            limits_rad=tuple(self._limits(j) for j in joints) * (3 if ball else 1),
            offset_mm=1000.0 * float(np.linalg.norm(anchors - anchors[0], axis=1).max()),
        )

    def _spring_rest(self, joint: int) -> float:
        """Return where the spring of a joint with one axis is at rest, relative to the initial pose [rad]."""
        address = self.model.jnt_qposadr[joint]
        return float(self.model.qpos_spring[address] - self.model.qpos0[address])

    def _limits(self, joint: int) -> tuple[float, float]:
        model = self.model
        if not model.jnt_limited[joint]:
            return -math.inf, math.inf
        low, high = map(float, model.jnt_range[joint])
        if int(model.jnt_type[joint]) == _BALL:
            return -high, high
        drawn = float(model.qpos0[model.jnt_qposadr[joint]])
        return low - drawn, high - drawn

    def _cable(self, tendon: int, actuator: int | None) -> Cable:
        model, data = self.model, self.data
        wraps = tendon_wraps(model, tendon)
        sites = [site for kind, site in wraps if kind == WRAP_SITE]
        pull = unit_pull(model, data, tendon)
        dofs = {self._name("JOINT", int(model.dof_jntid[dof])): float(pull[dof]) for dof in np.flatnonzero(pull)}
        return Cable(
            tendon=self._name("TENDON", tendon),
            actuator="" if actuator is None else self._name("ACTUATOR", actuator),
            guides=tuple(self._guide(site) for site in sites),
            wraps=len(sites) < len(wraps) or len(sites) < 2,
            length_mm=1000.0 * float(data.ten_length[tendon]),
            largest_pull_n=math.inf if actuator is None else self._largest_pull_n(actuator),
            torques_mm={name: 1000.0 * torque for name, torque in dofs.items()},
            resists=self._resists(tendon),
        )

    def _resists(self, tendon: int) -> bool:
        """Whether a tendon itself has a spring, a damper or limits."""
        model = self.model
        springs, dampers = model.tendon_stiffness, model.tendon_damping
        polynomials = model.tendon_stiffnesspoly, model.tendon_dampingpoly
        return any(np.any(values[tendon]) for values in (springs, dampers, *polynomials, model.tendon_limited))

    def _largest_pull_n(self, actuator: int) -> float:
        model = self.model
        if model.actuator_forcelimited[actuator]:
            return max(0.0, float((-gear_of(model, actuator)[0] * model.actuator_forcerange[actuator]).max()))
        return math.inf

    def _guide(self, site: int) -> Guide:
        body = int(self.model.site_bodyid[site])
        part = self.number.get(int(self.owner[body]), -1)
        return Guide(site=self._name("SITE", site), part=part, body=body, position_mm=_mm(self.data.site_xpos[site]))


def _mm(metres: Vector) -> tuple[float, float, float]:
    x, y, z = (1000.0 * float(value) for value in metres)
    return (x, y, z)


def _numbers(values: Vector) -> Any:
    return tuple(float(value) for value in np.ravel(values))
