"""Actuators whose sign is inverted."""

# ruff: noqa: ARG001 - every change takes a generator and a size, whether it needs them or not
from __future__ import annotations

import mujoco
import numpy as np
from benchmarks.validator.corpus.faults.anatomy import pull_actuators
from benchmarks.validator.corpus.faults.injection import Injection, UnsuitableError, of_spec, present

_MUSCLE = int(mujoco.mjtGain.mjGAIN_MUSCLE)


def flipped(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Invert the gear of one of several tendon actuators: a motor then pushes, and a servo aims below 0."""
    actuators = pull_actuators(spec)
    chosen = actuators[int(rng.integers(len(actuators)))]
    if len(actuators) < 2 or int(chosen.gaintype) == _MUSCLE:
        raise UnsuitableError("one actuator, or muscles")
    chosen.gear = -np.array(chosen.gear)
    return f"gear of actuator {chosen.name} changes its sign"


def fed_back(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Invert the stiffness of one or all servos on tendons, so that they run away."""
    servos = [actuator for actuator in pull_actuators(spec) if actuator.biasprm[1] < 0]
    if not servos:
        raise UnsuitableError("no servos on tendons")
    chosen = servos if rng.random() < 0.5 else [servos[int(rng.integers(len(servos)))]]
    for servo in chosen:
        gain, bias = np.array(servo.gainprm), np.array(servo.biasprm)
        gain[0], bias[1] = -gain[0], -bias[1]
        servo.gainprm, servo.biasprm = gain, bias
    return f"stiffness of {len(chosen)} servos changes its sign"


SIGNS: tuple[Injection, ...] = (
    Injection("actuator_sign", of_spec(flipped), present()),
    Injection("actuator_sign", of_spec(fed_back), present()),
)
"""Faults of actuators with an inverted sign."""
