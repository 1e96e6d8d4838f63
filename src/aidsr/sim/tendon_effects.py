"""Forces of tendons on joints: which actuators are antagonists, and which do the same in different limbs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_OPPOSITE_COSINE = -0.9
"""Pulls in joint space whose cosine is below this are antagonists. Our choice: 26 deg around opposite, far from the
cosine of -0.5 between three tendons around a limb."""

_SAME_PULL = 0.05
"""Pulls in joint space that differ by less than this share are the same motion of two limbs. Our choice: well above
rounding in written coordinates, well below the difference between neighbouring tendons."""


def unit_pull(model: mujoco.MjModel, data: mujoco.MjData, tendon: int) -> Vector:
    """Return the generalized force of a unit pull on a tendon, (nv,): minus the gradient of its length."""
    pull = np.zeros(model.nv)
    first, count = int(model.ten_J_rowadr[tendon]), int(model.ten_J_rownnz[tendon])
    columns = model.ten_J_colind[first : first + count]
    pull[columns] = -data.ten_J.reshape(-1)[first : first + count]
    return pull


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
    """Return actuators whose pull, written in the joints of the limb they act on, is the same in several limbs.

    Args:
        limb_dofs: Degrees of freedom of each limb, from its root outwards.
        pulls: Pull of each actuator, (nv,).
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
