"""What the findings on scope are read off: cables, their pushes, the soft body, and names."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.sim.drive import read_drives
from aidsr.sim.soft_body import SERIES_JOINTS, SoftBody, read_soft_body
from aidsr.sim.structure import Structure, name_of

PUSH_SHARE = 0.1
"""Greatest push / greatest pull of an actuator on a cable. Our choice."""
_SHORTER = 0.9
"""Length / drawn length of a cable at which a servo's push is read as well. Our choice: a limb bent far."""

_JNT = mujoco.mjtJoint
_FREE = int(_JNT.mjJNT_FREE)
_SIMPLE_GAINS = (int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE))
_SIMPLE_BIASES = (int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE))
GRAVITY_M_S2 = 9.81


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


class ScopeReader:
    """What several findings are read off."""

    def __init__(self, model: mujoco.MjModel, structure: Structure) -> None:
        self.model, self.structure = model, structure
        self.data = mujoco.MjData(model)
        mujoco.mj_forward(model, self.data)
        self.length_m = structure.characteristic_length_m
        self.weight_n = structure.mass_kg * GRAVITY_M_S2
        self.tendons = {tendon.id: tendon for tendon in structure.tendons}
        self.pushes = self._read_pushes()
        self.cables = tuple(a for a in structure.tendon_actuators if self._pulls_cable(a))
        self.soft: SoftBody = read_soft_body(model, structure, self.cables)

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
                *(drive.side * force for force in self._forces_shorter(drive.actuator, drive.low, drive.high)),
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

    def inner_joints(self) -> list[int]:
        """Joints but free ones."""
        return [joint for joint in self.structure.joints if int(self.model.jnt_type[joint]) != _FREE]

    def name(self, kind: str, index: int) -> str:
        """Name of an element of a kind."""
        return name_of(self.model, getattr(mujoco.mjtObj, f"mjOBJ_{kind}"), index)

    def joint(self, joint: int) -> str:
        """Name of a joint; one without is called after its body."""
        name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        return name or f"joint of {self.name('BODY', int(self.model.jnt_bodyid[joint]))}"

    def geom(self, geom: int) -> str:
        """Name of a geom; one without is called after its body."""
        name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_GEOM, geom)
        return name or f"geom of {self.name('BODY', int(self.model.geom_bodyid[geom]))}"
