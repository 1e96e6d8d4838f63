"""A robot's size and reach as it is drawn, measured on the compiled model in an isolated process."""

from __future__ import annotations

from typing import Any

from aidsr.core.artifacts import Artifact, Robot, Vec3
from aidsr.sandbox.isolated import isolated


class Extent(Artifact):
    """Where a robot's shapes are, in the axes of its file, seen from its root's origin (its file's with several roots).

    These are the axes that a placement turns and the point that it puts on the mount.
    """

    low_m: Vec3
    """Lowest x, y and z of any shape."""
    high_m: Vec3
    """Highest x, y and z of any shape."""
    functional_part_m: Vec3 | None
    """Where the functional part works; None when the robot has no part of that name."""
    length_m: float
    """Characteristic length."""
    mass_kg: float
    """Of all its bodies."""


@isolated
def measure(robot: Robot) -> Extent:
    """Measure a robot as it is drawn, in an isolated process.

    Raises:
        MjcfError: The robot cannot be loaded.
        IsolationError: Loading it ran past its limits.
    """
    import mujoco
    import numpy as np

    from aidsr.mjcf.compile import compile_mjcf
    from aidsr.sim.extent import bounding_box_m
    from aidsr.sim.functional_part import find_functional_part
    from aidsr.sim.structure import read_structure

    model = compile_mjcf(robot.mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    # body 1 is the first root; a floor that came with the robot belongs to body 0 and does not count
    low, high = bounding_box_m(model, data, range(1, model.nbody))
    structure = read_structure(model)
    origin = data.xpos[structure.roots[0]] if len(structure.roots) == 1 else np.zeros(3)
    part = find_functional_part(model, robot.functional_part)
    works_at = None
    if part is not None:
        body = model.body(part.body).id
        works_at = _vector(data.xpos[body] - origin + data.xmat[body].reshape(3, 3) @ part.position_m)
    return Extent(
        low_m=_vector(low - origin),
        high_m=_vector(high - origin),
        functional_part_m=works_at,
        length_m=round(structure.characteristic_length_m, 4),
        mass_kg=round(float(np.sum(model.body_mass[1:])), 4),
    )


def _vector(values: Any) -> Vec3:
    x, y, z = (round(float(value), 6) + 0.0 for value in values)  # + 0.0 turns -0.0 into 0.0
    return x, y, z
