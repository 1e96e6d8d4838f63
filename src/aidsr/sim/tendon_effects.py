"""Forces of tendons on joints: antagonistic actuators, and actuators with the same effect in different limbs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_OPPOSITE_COSINE = -0.9
"""Largest cosine between the pulls of two antagonists in joint space. Our choice: within 26 deg of opposite directions,
far from the cosine of -0.5 between three tendons around a limb."""

_SAME_PULL = 0.05
"""Largest relative difference between pulls that have the same effect in two limbs. Our choice: well above rounding of
coordinates, well below the difference between neighbouring tendons."""


def length_gradient(model: mujoco.MjModel, data: mujoco.MjData, tendon: int) -> Vector:
    """Return the derivative of a tendon's length with respect to each degree of freedom, (nv,)."""
    row = np.zeros(model.nv)
    dofs, values = length_gradient_entries(model, data, tendon)
    row[dofs] = values
    return row


def length_gradient_entries(
    model: mujoco.MjModel, data: mujoco.MjData, tendon: int
) -> tuple[NDArray[np.int32], Vector]:
    """Return the degrees of freedom between the ends of a tendon, and the derivatives of its length, (n,) each."""
    first, count = int(model.ten_J_rowadr[tendon]), int(model.ten_J_rownnz[tendon])
    entries = slice(first, first + count)
    return np.array(model.ten_J_colind[entries]), np.array(data.ten_J.reshape(-1)[entries])


def unit_pull(model: mujoco.MjModel, data: mujoco.MjData, tendon: int) -> Vector:
    """Return the generalized force of a unit pull on a tendon, (nv,): the negative gradient of its length."""
    return np.asarray(0.0 - length_gradient(model, data, tendon))  # not -0.0 for joints beside the tendon


def opposite_pairs(pulls: Mapping[int, Vector]) -> tuple[tuple[int, int], ...]:
    """Return pairs of actuators that pull the same joints in opposite directions."""
    ids = sorted(pulls)
    return tuple(
        (one, other)
        for k, one in enumerate(ids)
        for other in ids[k + 1 :]
        if pulls[one] @ pulls[other] < _OPPOSITE_COSINE * np.linalg.norm(pulls[one]) * np.linalg.norm(pulls[other])
    )


def symmetric_groups(limb_dofs: Sequence[Sequence[int]], pulls: Mapping[int, Vector]) -> tuple[tuple[int, ...], ...]:
    """Return groups of actuators that have the same pull on the joints of their own limb, each in a different limb.

    Args:
        limb_dofs: Degrees of freedom of each limb, from its root outwards.
        pulls: Generalized force of a unit pull of each actuator, (nv,).
    """
    groups: list[tuple[int, Vector, list[int], set[int]]] = []
    for actuator, pull in pulls.items():
        in_limbs = [pull[list(dofs)] for dofs in limb_dofs]
        limb = int(np.argmax([np.linalg.norm(part) for part in in_limbs])) if in_limbs else 0
        if not in_limbs or not in_limbs[limb].any():
            continue
        own = in_limbs[limb]
        for size, example, members, limbs in groups:
            alike = size == own.size and np.linalg.norm(own - example) <= _SAME_PULL * np.linalg.norm(example)
            if alike and limb not in limbs:
                members.append(actuator)
                limbs.add(limb)
                break
        else:
            groups.append((own.size, own, [actuator], {limb}))
    return tuple(tuple(members) for _, _, members, _ in groups if len(members) > 1)
