"""Tension of tendons."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.actuator_force import output_of

Array = NDArray[np.float64]

_BY_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)


def tensions_n(model: mujoco.MjModel, ten_length: Array, actuator_force: Array) -> Array:
    """Return the tension of each tendon from its actuators and its own spring, (ntendon,) [N]; negative if it pushes.

    Args:
        model: Compiled model.
        ten_length: Length of each tendon, (ntendon,) [m].
        actuator_force: Force of each actuator output, as in MjData, (nout,) [N].

    Source: MuJoCo documentation, Computation, "Actuation model" and "Passive forces"; only the linear part of a spring
    is included, since the tendons here have no other.
    """
    spring = np.asarray(model.tendon_lengthspring)
    stretched = np.maximum(ten_length - spring[:, 1], 0.0) + np.minimum(ten_length - spring[:, 0], 0.0)
    pull = np.asarray(model.tendon_stiffness) * stretched
    for actuator in range(model.nactuator):
        if int(model.actuator_trntype[actuator]) == _BY_TENDON:
            output = output_of(model, actuator)
            pull[int(model.actuator_trnid[actuator, 0])] -= actuator_force[output] * model.actuator_gear[output, 0]
    return np.asarray(pull)
