"""Adjustment of a free robot's height so that it stands on the ground, and a test of how stably it stands.

A placement gives the position of the root's origin, and its author rarely knows the position of the lowest foot.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Artifact, Placement, Robot, Vec3
from aidsr.core.errors import UserError
from aidsr.mjcf.compile import compile_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.sim.assembly import assemble
from aidsr.sim.drive import neutral_ctrl, set_act
from aidsr.sim.geom_distance import geom_distance_m
from aidsr.sim.placement import mount_pose
from aidsr.sim.structure import read_structure
from aidsr.sim.task_sensors import TaskSensor

_GAP_M = 0.0005
"""Gap left below the lowest foot. Our choice: too small to be visible, and large enough that no contact pushes at the
start."""
_STEP_M = 0.004
"""Step between the heights that are tried. Our choice: less than the thickness of any wall in the environments."""
_FARTHEST_M = 0.6
"""Largest distance by which a robot is raised or lowered. Our choice: more than the height of such robots."""
_BISECTIONS = 12
_REST_S = 1.5
"""Simulated time of the standing test [s]. Our choice: a body that tips over does so within a second."""


class Standing(Artifact):
    """Adjusted placement of a free robot, and the result of the standing test."""

    placement: Placement
    """The given placement, raised or lowered."""
    raised_m: float
    """Displacement against gravity [m]; negative if the robot was lowered."""
    found_ground: bool
    """Whether there is a height at which the robot overlaps nothing and is just above something."""
    tilt_deg: float = 0.0
    """Rotation of the root about horizontal axes during the standing test, in which no actuator pulls [deg]."""
    sinks_m: float = 0.0
    """Distance by which the centre of mass moved down during the standing test [m]."""
    slides_m: float = 0.0
    """Distance by which the centre of mass moved sideways during the standing test [m]."""
    note: str = ""
    """The result in a sentence, for the author of the placement."""


@isolated(limits=Limits(wall_s=120.0, cpu_s=120.0))
def stand(robot: Robot, environment: str, placement: Placement, sensors: Sequence[TaskSensor] = ()) -> Standing:
    """Return the placement of a free robot, raised or lowered against gravity until the robot stands on the ground.

    A robot that overlaps something is raised until it is clear; any other robot is lowered until it is 0.5 mm above
    what it would touch. A short simulation with neutral commands then tests how stably it stands.

    Args:
        robot: The robot alone.
        environment: MJCF of the environment.
        placement: Placement of the robot; its base is free.
        sensors: Sensors with which the task measures the robot.

    Raises:
        UserError: The base of the placement is fixed.
        MjcfError: The robot, the environment or the scene of both cannot be loaded.
        IsolationError: The calculation exceeded its limits of time or memory.
    """
    if placement.base != "free":
        raise UserError('only a free robot stands by itself; place it with base "free"')
    model = compile_mjcf(assemble(robot, environment, placement, sensors).mjcf)
    gravity = np.asarray(model.opt.gravity)
    if not gravity.any():
        note = "there is no gravity: nothing to stand on; the height is as given"
        return Standing(placement=placement, raised_m=0.0, found_ground=False, note=note)
    up = -gravity / np.linalg.norm(gravity)
    structure = read_structure(model)
    heights = _Heights(model, structure.bodies, structure.roots[0], up)
    raised_m = heights.find()
    if raised_m is None:
        note = (
            f"found no height within {1000 * _FARTHEST_M:g} mm at which the robot stands clear; it overlaps with "
            f"{heights.overlap() or 'nothing'} as placed, and keeps its height"
        )
        return Standing(placement=placement, raised_m=0.0, found_ground=False, note=note)
    turn = np.zeros(4)
    mujoco.mju_negQuat(turn, mount_pose(compile_mjcf(environment), placement).quaternion)
    offset = np.zeros(3)
    mujoco.mju_rotVecQuat(offset, raised_m * up, turn)
    x, y, z = (round(float(value), 6) for value in np.array(placement.position_m) + offset)
    moved = placement.model_copy(update={"position_m": (x, y, z)})
    tilt_deg, sinks_m, slides_m = heights.rest(raised_m)
    return Standing(
        placement=moved,
        raised_m=raised_m,
        found_ground=True,
        tilt_deg=tilt_deg,
        sinks_m=sinks_m,
        slides_m=slides_m,
        note=_note(raised_m, (x, y, z), tilt_deg, sinks_m, slides_m)
        + ("; flexes are not taken into account in its height" if model.nflex else ""),
    )


def _note(raised_m: float, at_m: Vec3, tilt_deg: float, sinks_m: float, slides_m: float) -> str:
    how = f"{'raised' if raised_m > 0 else 'lowered'} by {abs(1000 * raised_m):.1f} mm" if raised_m else "as placed"
    x, y, z = at_m
    text = (
        f"stands on what is below it, {how}: position {x:g} {y:g} {z:g} m from the mount. Let stand for {_REST_S:g} s "
    )
    text += f"with nothing pulled it tilts by {tilt_deg:.1f} deg, sinks by {1000 * sinks_m:.1f} mm and slides by "
    return text + f"{1000 * slides_m:.1f} mm" + (": it tips over; widen its feet, or turn it" if tilt_deg > 30 else "")


class _Heights:
    """Search for the height of a free robot in a scene, relative to its placement.

    Args:
        model: Compiled scene.
        bodies: Ids of the robot's bodies.
        root: Id of its free root.
        up: Unit vector against gravity, (3,).
    """

    def __init__(self, model: mujoco.MjModel, bodies: tuple[int, ...], root: int, up: NDArray[np.float64]) -> None:
        self._model, self._root, self._up = model, root, up
        self._data = mujoco.MjData(model)
        self._start = model.qpos0.copy()
        self._at = int(model.jnt_qposadr[model.body_jntadr[root]])
        mine = [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in bodies]
        others = [geom for geom in range(model.ngeom) if geom not in set(mine)]
        self._pairs = [(one, other) for one in mine for other in others if self._collide(one, other)]

    def _collide(self, one: int, other: int) -> bool:
        types, affinities = self._model.geom_contype, self._model.geom_conaffinity
        return bool(types[one] & affinities[other] or types[other] & affinities[one])

    def _put(self, height_m: float) -> None:
        self._data.qpos[:] = self._start
        self._data.qpos[self._at : self._at + 3] += height_m * self._up
        mujoco.mj_kinematics(self._model, self._data)

    def gap_m(self, height_m: float) -> float:
        """Return the smallest distance between robot and environment at a height [m]; negative if they overlap."""
        self._put(height_m)
        return min(
            (geom_distance_m(self._model, self._data, one, other, _FARTHEST_M) for one, other in self._pairs),
            default=_FARTHEST_M,
        )

    def overlap(self) -> str:
        """Return the name of what the robot overlaps most at height 0, and the depth; "" if it overlaps nothing."""
        self._put(0.0)
        gaps = [
            (geom_distance_m(self._model, self._data, one, other, _FARTHEST_M), other) for one, other in self._pairs
        ]
        gap_m, other = min(gaps, default=(1.0, 0))
        name = self._model.geom(other).name or self._model.body(self._model.geom_bodyid[other]).name
        return f"{name} by {-1000 * gap_m:.0f} mm" if gap_m < 0 else ""

    def find(self) -> float | None:
        """Return how far to raise the robot [m], negative to lower it; None if no height was found."""
        step = _STEP_M if self.gap_m(0.0) < _GAP_M else -_STEP_M
        height_m = 0.0
        while abs(height_m) < _FARTHEST_M:
            height_m += step
            clear = self.gap_m(height_m) >= _GAP_M
            if clear == (step > 0):
                return self._between(height_m - step, height_m)
        return None

    def _between(self, first_m: float, second_m: float) -> float:
        """Return the lowest clear height between two heights [m]; the higher one of them is clear."""
        low, high = min(first_m, second_m), max(first_m, second_m)
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2
            low, high = (low, middle) if self.gap_m(middle) >= _GAP_M else (middle, high)
        return round(high, 6)

    def rest(self, height_m: float) -> tuple[float, float, float]:
        """Simulate the robot from a height with neutral commands; return its tilt [deg], sinking and sliding [m]."""
        model, data = self._model, self._data
        mujoco.mj_resetData(model, data)
        data.qpos[self._at : self._at + 3] += height_m * self._up
        mujoco.mj_forward(model, data)
        ctrl = neutral_ctrl(model, data)
        data.ctrl[:] = ctrl
        set_act(model, data, ctrl)
        first, turn = data.subtree_com[self._root].copy(), data.xmat[self._root].reshape(3, 3).copy()
        for _ in range(round(_REST_S / model.opt.timestep)):
            mujoco.mj_step(model, data)
        moved = data.subtree_com[self._root] - first
        turned = data.xmat[self._root].reshape(3, 3) @ turn.T
        sinks_m = -float(moved @ self._up)
        slides_m = float(np.linalg.norm(moved - (moved @ self._up) * self._up))
        tilt_deg = float(np.rad2deg(np.arccos(np.clip(self._up @ turned @ self._up, -1.0, 1.0))))
        return tilt_deg, sinks_m, slides_m
