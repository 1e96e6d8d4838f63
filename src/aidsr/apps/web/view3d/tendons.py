"""Tendons: their paths as MuJoCo routes them, and the data that a viewer needs to draw them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.apps.web.view3d.parts import MAX_SHAPES
from aidsr.sim.drive import Drive
from aidsr.sim.ownership import read_ownership
from aidsr.sim.structure import name_of

SEGMENT_NUMBERS = 8
"""Count of numbers for each segment of a tendon in a frame: tendon id, start (3), end (3), radius."""

_TENDON = int(mujoco.mjtObj.mjOBJ_TENDON)


class TendonLines:
    """Finder of the straight segments of all tendons; it uses `mjv_updateScene`, which computes how they wrap."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._scene = mujoco.MjvScene(model, maxgeom=MAX_SHAPES)
        self._camera = mujoco.MjvCamera()
        self._options = mujoco.MjvOption()
        self._options.geomgroup[:] = 0
        self._options.sitegroup[:] = 0
        self._options.flags[:] = False
        self._options.flags[mujoco.mjtVisFlag.mjVIS_TENDON] = True

    def begin_drag(self, data: mujoco.MjData, drag: mujoco.MjvPerturb) -> None:
        """Start dragging a body: MuJoCo sets the strength of the spring from its mass and the size of the picture."""
        mujoco.mjv_initPerturb(self._model, data, self._scene, drag)

    def segments(self, data: mujoco.MjData) -> NDArray[np.float32]:
        """Return the segments in the current state, (n, 8): tendon id, start [m], end [m], radius [m]."""
        if not self._model.ntendon:
            return np.zeros((0, SEGMENT_NUMBERS), np.float32)
        moving = mujoco.mjtCatBit.mjCAT_DYNAMIC
        mujoco.mjv_updateScene(self._model, data, self._options, None, self._camera, moving, self._scene)
        pieces = [piece for piece in self._scene.geoms[: self._scene.ngeom] if piece.objtype == _TENDON]
        found = np.zeros((len(pieces), SEGMENT_NUMBERS), np.float32)
        for row, piece in zip(found, pieces, strict=True):
            along = piece.mat[:, 2] * piece.size[2]
            row[0], row[1:4], row[4:7], row[7] = piece.objid, piece.pos - along, piece.pos + along, piece.size[0]
        return found


def tendon_facts(model: mujoco.MjModel, looks: mujoco.MjModel, drives: Sequence[Drive]) -> list[dict[str, Any]]:
    """Return name, colour and owner of each tendon, and the tension that is drawn with the strongest colour [N].

    That is the hardest pull of any actuator of the robot in its rest pose. It is the same for all tendons, so that
    their colours can be compared.
    """
    hardest = [max(-drive.force_low_n, -drive.force_high_n, 0.0) for drive in drives if drive.on_tendon]
    full_n = max(hardest, default=0.0) or 1.0
    owned = read_ownership(model)
    return [
        {
            "name": name_of(model, mujoco.mjtObj.mjOBJ_TENDON, tendon),
            "rgba": [round(float(number), 4) for number in _colour(looks, tendon)],
            "robot": owned.tendon(tendon),
            "full_n": round(full_n, 4),
        }
        for tendon in range(model.ntendon)
    ]


def _colour(looks: mujoco.MjModel, tendon: int) -> NDArray[np.float32]:
    material = int(looks.tendon_matid[tendon])
    return np.asarray(looks.mat_rgba[material] if material >= 0 else looks.tendon_rgba[tendon])
