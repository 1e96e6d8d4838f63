"""Points and forces of the contacts between a robot and its surroundings."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CONTACT_NUMBERS = 6
"""Numbers per contact: point (3) [m], force on the robot (3) [N]."""


class ContactForces:
    """Reader of the contacts between the robot of a model and everything else.

    Args:
        model: Compiled model.
        robot: Ids of the robot's geoms.
    """

    def __init__(self, model: mujoco.MjModel, robot: NDArray[np.intp]) -> None:
        self._model = model
        self._ours = np.zeros(model.ngeom, np.bool_)
        self._ours[robot] = True
        self._force = np.zeros(6)

    def read(self, data: mujoco.MjData) -> Array:
        """Return point and force of each contact with a non-zero force, in world coordinates, (n, 6) [m, N].

        Source: MuJoCo, mj_contactForce: the force on the second geom, in the contact's frame, whose first row points
        from the first geom to the second.
        """
        found = []
        for index in range(data.ncon):
            contact = data.contact[index]
            first, second = (bool(geom >= 0 and self._ours[geom]) for geom in contact.geom)
            if first == second:
                continue
            mujoco.mj_contactForce(self._model, data, index, self._force)
            if self._force[0] > 0:
                force = contact.frame.reshape(3, 3).T @ self._force[:3]
                found.append(np.concatenate([contact.pos, force if second else -force]))
        return np.array(found).reshape(-1, CONTACT_NUMBERS)
