"""Points and forces of the contacts between a robot and its surroundings, and what takes part in a contact."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_OBJ = mujoco.mjtObj

CONTACT_NUMBERS = 6
"""Numbers per contact: point (3) [m], force on the robot (3) [N]."""


def contact_bodies(model: mujoco.MjModel, contact: mujoco.MjContact) -> tuple[int, int]:
    """Return the ids of the two bodies in a contact; of a flex, the body of the touched vertex, or of one of its nodes.

    Source: MuJoCo, mjContact: a side is a geom, or it has geom -1 and is a flex with an element or a vertex.
    """
    first, second = (_body(model, contact, side) for side in (0, 1))
    return first, second


def _body(model: mujoco.MjModel, contact: mujoco.MjContact, side: int) -> int:
    if (geom := int(contact.geom[side])) >= 0:
        return int(model.geom_bodyid[geom])
    flex, element, vertex = int(contact.flex[side]), int(contact.elem[side]), int(contact.vert[side])
    if vertex < 0:
        vertex = int(model.flex_elem[model.flex_elemdataadr[flex] + element * (model.flex_dim[flex] + 1)])
    body = int(model.flex_vertbodyid[model.flex_vertadr[flex] + vertex])
    return body if body >= 0 else int(model.flex_nodebodyid[model.flex_nodeadr[flex]])  # nodes move its vertices


def contact_name(model: mujoco.MjModel, contact: mujoco.MjContact, side: int) -> str:
    """Return the name of the geom or flex on a side of a contact, 0 or 1; of its body if it has none."""
    geom, flex = int(contact.geom[side]), int(contact.flex[side])
    own = (_OBJ.mjOBJ_GEOM, geom) if geom >= 0 else (_OBJ.mjOBJ_FLEX, flex)
    return mujoco.mj_id2name(model, *own) or str(model.body(contact_bodies(model, contact)[side]).name)


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
