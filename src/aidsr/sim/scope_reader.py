"""Data that the scope checks share: cables, the forces of their actuators, the soft body, and names."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.sim.actuator_force import end_forces, output_of
from aidsr.sim.drive import Drive, read_drives
from aidsr.sim.limbs import EVEN_JOINTS, SERIES_JOINTS
from aidsr.sim.soft_body import SoftBody, read_soft_body
from aidsr.sim.structure import Structure, name_of

PUSH_SHARE = 0.1
"""Largest allowed push / largest pull of an actuator on a cable. Our choice."""
_SHORTER = 0.9
"""Length / reference length of a cable at which the forces of its actuator are calculated as well. Our choice: the
length in a strongly bent limb."""

_JNT = mujoco.mjtJoint
_FREE = int(_JNT.mjJNT_FREE)


@dataclass(frozen=True)
class ScopeFinding:
    """One reason why a robot is out of scope.

    Attributes:
        code: Code of the fault; the validator has a rule for each code.
        message: What was measured or found in the model.
        names: Names of the parts concerned.
        measured, limit: Measured value and its limit; None if there is none.
        unit: Unit of both; empty for the unit of the rule.
        whole, whole_unit: Absolute value and unit to which `measured` is relative, if it is a share.
    """

    code: str
    message: str
    names: tuple[str, ...] = ()
    measured: float | None = None
    limit: float | None = None
    unit: str = ""
    whole: float | None = None
    whole_unit: str = ""


class ScopeReader:
    """Data that several scope checks use.

    Attributes:
        model, structure: Compiled model, and the robot in it.
        data: Data of the model in the reference pose.
        length_m: Characteristic length L [m].
        weight_n: Weight of the moving bodies on Earth [N].
        tendons: Tendons of the robot by id.
        pushes: Largest push and largest pull [N] of each actuator on a tendon, by actuator id.
        cables: Ids of the actuators that pull a cable.
        soft: The bodies that these actuators bend.
    """

    def __init__(self, model: mujoco.MjModel, structure: Structure) -> None:
        self.model, self.structure = model, structure
        self.data = mujoco.MjData(model)
        mujoco.mj_forward(model, self.data)
        self.length_m = structure.characteristic_length_m
        self.weight_n = structure.weight_n
        self.tendons = {tendon.id: tendon for tendon in structure.tendons}
        self.pushes = self._read_pushes()
        self.cables = tuple(a for a in structure.tendon_actuators if self._pulls_cable(a))
        self.soft: SoftBody = read_soft_body(model, structure, self.cables)

    def _read_pushes(self) -> dict[int, tuple[float, float]]:
        """Return the largest push and the largest pull of each actuator on a tendon over its control range [N]."""
        model = self.model
        pushes = {}
        for drive in read_drives(model, self.data, self.structure):
            if not drive.on_tendon:
                continue
            forces = [
                drive.force_low_n,
                drive.force_high_n,
                *(drive.side * force for force in self._forces_shorter(drive)),
            ]
            pushes[drive.actuator] = (max(0.0, *forces), max(0.0, *(-force for force in forces)))
        return pushes

    def _forces_shorter(self, drive: Drive) -> list[float]:
        """Return the forces of an actuator on its shortened tendon at both ends of its control range [N].

        The tendon has `_SHORTER` of its reference length. Empty for actuators whose force is not affine in the length.
        """
        length = _SHORTER * float(self.data.actuator_length[output_of(self.model, drive.actuator)])
        return end_forces(self.model, drive.actuator, length, drive.low, drive.high) or []

    def _pulls_cable(self, actuator: int) -> bool:
        """Return whether an actuator on a tendon pulls a cable.

        A spatial tendon is a cable. A fixed tendon counts as one if it acts on three or more joints, spreads its force
        over them, and its actuator hardly pushes.
        """
        tendon = self.tendons.get(int(self.model.actuator_trnid[actuator, 0]))
        if tendon is None or tendon.spatial:
            return tendon is not None
        push, pull = self.pushes[actuator]
        first = int(self.model.tendon_adr[tendon.id])
        sizes = np.abs(np.asarray(self.model.wrap_prm)[first : first + int(self.model.tendon_num[tendon.id])])
        spread = sizes.sum() ** 2 >= EVEN_JOINTS * (sizes**2).sum()
        return bool(spread) and tendon.spans > SERIES_JOINTS and push <= PUSH_SHARE * pull

    def inner_joints(self) -> list[int]:
        """Return all joints of the robot except free joints."""
        return [joint for joint in self.structure.joints if int(self.model.jnt_type[joint]) != _FREE]

    def name(self, kind: str, index: int) -> str:
        """Return the name of an element; `kind` is the end of its mjtObj constant, such as "BODY"."""
        return name_of(self.model, getattr(mujoco.mjtObj, f"mjOBJ_{kind}"), index)

    def joint(self, joint: int) -> str:
        """Return the name of a joint, "joint of <body>" if it has none."""
        name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        return name or f"joint of {self.name('BODY', int(self.model.jnt_bodyid[joint]))}"

    def geom(self, geom: int) -> str:
        """Return the name of a geom, "geom of <body>" if it has none."""
        name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_GEOM, geom)
        return name or f"geom of {self.name('BODY', int(self.model.geom_bodyid[geom]))}"
