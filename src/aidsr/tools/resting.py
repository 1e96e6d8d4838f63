"""Simulation of a robot or scene at rest, and of its new rest state under a pull or push."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.errors import UserError
from aidsr.mjcf.compile import compile_mjcf, load_mjcf
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.actuator_force import output_of
from aidsr.sim.command import exerted
from aidsr.sim.contact_forces import contact_bodies, contact_name
from aidsr.sim.drive import Drive, neutral_ctrl, read_drives, set_act
from aidsr.sim.functional_part import find_functional_part
from aidsr.sim.structure import Structure, name_of, read_structure
from aidsr.tools.scene import MeasuredScene
from aidsr.validation.mount import mount_model

Vector = NDArray[np.float64]

TOUCH_N = 1e-3
"""Smallest normal force that counts as a contact. Our choice: below the weight of any part."""

_RAMP_S = 0.5
"""Time in which a pull or push increases to its full value. Our choice: slow compared with the swing of a limb."""
_LONGEST_S = 6.0
"""Longest wait for rest. Our choice: several times the slowest settling time of built-in robots."""
_LOOK_S = 0.1
_AT_REST = 1e-3
"""Speed of the fastest joint below which a state counts as rest [rad/s or m/s]. Our choice: 0.1 mm in 0.1 s."""


@dataclass(frozen=True, eq=False)
class Resting:
    """A robot or scene in a state at rest."""

    model: mujoco.MjModel
    structure: Structure
    drawn: mujoco.MjData
    """State in the reference pose."""
    data: mujoco.MjData
    """State at rest."""
    at_rest: bool
    """Whether it came to rest within `_LONGEST_S`."""
    drives: tuple[Drive, ...] = field(default=())

    @classmethod
    def of(cls, subject: MeasuredScene) -> Resting:
        """Return a robot or scene at rest with neutral controls.

        Raises:
            MjcfError: The model cannot be loaded.
        """
        environment = compile_mjcf(subject.environment) if subject.environment else None
        model = mount_model(load_mjcf(subject.mjcf), subject.mount, environment).model
        structure = read_structure(model)
        drawn, data = mujoco.MjData(model), mujoco.MjData(model)
        mujoco.mj_forward(model, drawn)
        neutral = neutral_ctrl(model, drawn)
        data.ctrl[:] = neutral
        set_act(model, data, neutral)
        still = _settle(model, data, neutral, np.zeros(model.nv), None)
        return cls(model, structure, drawn, data, still, read_drives(model, data, structure))

    def pulled(self, drive: Drive, share: float) -> Resting:
        """Return the rest state in which one actuator has a share of its range from neutral to full pull, 0 to 1."""
        ctrl = self.data.ctrl.copy()
        ctrl[drive.ctrl] = drive.neutral + share * (drive.pull - drive.neutral)
        return self._moved(ctrl, None)

    def pushed(self, point_m: Vector, body: int, force_n: Vector) -> Resting:
        """Return the rest state under a force in world axes (3,) [N] at a point in a body's frame (3,) [m]."""
        return self._moved(self.data.ctrl.copy(), (point_m, body, force_n))

    def _moved(self, ctrl: Vector, push: _Push | None) -> Resting:
        data = copy.copy(self.data)
        data.time = 0.0
        still = _settle(self.model, data, ctrl, np.zeros(self.model.nv), push)
        return Resting(self.model, self.structure, self.drawn, data, still, self.drives)

    def world_m(self, point_m: Vector, body: int) -> Vector:
        """Return the position of a point of a body in the world (3,) [m]."""
        return _world_m(self.data, point_m, body)

    def drawn_world_m(self, point_m: Vector, body: int) -> Vector:
        """Return the position of a point of a body in the world in the reference pose (3,) [m]."""
        return _world_m(self.drawn, point_m, body)

    def position_m(self, point_m: Vector, body: int) -> Vector:
        """Return the position of a point of a body in the frame of the robot's root (3,) [m]."""
        root = self.structure.roots[0]
        turn = self.data.xmat[root].reshape(3, 3)
        return np.asarray(turn.T @ (self.world_m(point_m, body) - self.data.xpos[root]))

    def turned_deg(self, before: Resting, body: int) -> float:
        """Return the rotation angle of a body relative to the root since another state [deg]."""
        now, then = (state._orientation(body) for state in (self, before))
        cosine = (np.trace(now @ then.T) - 1.0) / 2.0
        return float(np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))))

    def _orientation(self, body: int) -> Vector:
        root = self.structure.roots[0]
        return np.asarray(self.data.xmat[root].reshape(3, 3).T @ self.data.xmat[body].reshape(3, 3))

    def farthest(self, moved: Resting) -> int:
        """Return the number of the body whose tip has moved farthest relative to the root in another state."""

        def way_m(body: int) -> float:
            tip = tip_of(self.model, body)
            return float(np.linalg.norm(moved.position_m(tip, body) - self.position_m(tip, body)))

        return max(self.structure.bodies, key=way_m)

    def touches(self) -> dict[tuple[str, str], str]:
        """Return the contacts of the robot, largest force first: descriptions by the names of both parts."""
        force, found = np.zeros(6), dict[tuple[str, str], float]()
        for index in range(self.data.ncon):
            contact = self.data.contact[index]
            robots = [body in self.structure.bodies for body in contact_bodies(self.model, contact)]
            mujoco.mj_contactForce(self.model, self.data, index, force)
            if any(robots) and force[0] >= TOUCH_N:
                own, other = (self._part(contact, side) for side in ((0, 1) if robots[0] else (1, 0)))
                pair = (min(own, other), max(own, other)) if all(robots) else (own, other)
                found[pair] = found.get(pair, 0.0) + float(force[0])
        hardest = sorted(found, key=lambda pair: -found[pair])
        return {pair: f"{pair[1]} with {pair[0]} ({found[pair]:.3g} N)" for pair in hardest}

    def _part(self, contact: mujoco.MjContact, side: int) -> str:
        """Return the body's name for a side of a contact that is the robot's, else the name of the geom or flex."""
        body = contact_bodies(self.model, contact)[side]
        return self.body_name(body) if body in self.structure.bodies else contact_name(self.model, contact, side)

    def exerts(self, drive: Drive) -> str:
        """Return the absolute value of what an actuator exerts in this state, with its unit: N, or N m of a torque."""
        factor, unit = exerted(self.model, drive.actuator)
        force = abs(float(self.data.actuator_force[output_of(self.model, drive.actuator)]))
        return f"{force * factor:.3g} {unit}"

    def actuator_name(self, drive: Drive) -> str:
        """Return the name of an actuator without "robot/"."""
        return name_of(self.model, mujoco.mjtObj.mjOBJ_ACTUATOR, drive.actuator).removeprefix(ROBOT_PREFIX)

    def body_name(self, body: int) -> str:
        """Return the name of a body without "robot/"."""
        return name_of(self.model, mujoco.mjtObj.mjOBJ_BODY, body).removeprefix(ROBOT_PREFIX)


_Push = tuple[Vector, int, Vector]


def tip_of(model: mujoco.MjModel, body: int) -> Vector:
    """Return the distal tip of a body in its own frame (3,) [m]; its origin if the body is unnamed or has no tip."""
    part = find_functional_part(model, name) if (name := model.body(body).name) else None
    return part.position_m if part else np.zeros(3)


def point_of(model: mujoco.MjModel, name: str) -> tuple[int, Vector]:
    """Return the number of the body of a named part, and the part's working point in the body's frame (3,) [m].

    Raises:
        UserError: There is no such part.
    """
    part = find_functional_part(model, name) or find_functional_part(model, ROBOT_PREFIX + name)
    if part is None:
        raise UserError(f'no body, site or geom "{name}"; name one of the robot')
    return int(model.body(part.body).id), part.position_m


def _world_m(data: mujoco.MjData, point_m: Vector, body: int) -> Vector:
    return np.asarray(data.xpos[body] + data.xmat[body].reshape(3, 3) @ point_m)


def _settle(model: mujoco.MjModel, data: mujoco.MjData, ctrl: Vector, force: Vector, push: _Push | None) -> bool:
    """Simulate until rest under controls and a push that increase over a ramp; return whether rest was reached.

    Args:
        model: The compiled model.
        data: State, which is advanced.
        ctrl: Final controls (nu,).
        force: Buffer for generalized forces (nv,).
        push: Point in the body's frame (3,) [m], number of the body, and force in world axes (3,) [N]; None for none.

    Raises:
        UserError: The simulation diverged.
    """
    start, began_s = data.ctrl.copy(), data.time
    look = max(1, round(_LOOK_S / model.opt.timestep))
    for step in range(round(_LONGEST_S / model.opt.timestep)):
        ramp = min(1.0, (data.time - began_s) / _RAMP_S)
        data.ctrl[:] = start + ramp * (ctrl - start)
        if push is not None:
            point_m, body, force_n = push
            force[:] = 0.0
            mujoco.mj_applyFT(model, data, ramp * force_n, np.zeros(3), _world_m(data, point_m, body), body, force)
            data.qfrc_applied[:] = force
        mujoco.mj_step(model, data)
        over = data.time - began_s > 2 * _RAMP_S
        if over and step % look == 0 and np.abs(data.qvel).max(initial=0.0) < _AT_REST:
            mujoco.mj_forward(model, data)
            return True
    if not np.isfinite(data.qpos).all():
        raise UserError("the simulation diverged during the measurement; use a smaller force, or correct the robot")
    mujoco.mj_forward(model, data)
    return False
