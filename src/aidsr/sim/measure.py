"""Size and mass of a robot in its reference pose, measured on the compiled model in an isolated process."""

from __future__ import annotations

from aidsr.core.artifacts import Artifact, Robot, Vec3
from aidsr.core.formatting import rounded_vector
from aidsr.sandbox.isolated import isolated


class Extent(Artifact):
    """Bounding box, length and mass of a robot.

    Coordinates are in the axes of the robot's MJCF file, relative to the origin of its root (to the origin of the file
    if there are several roots). A placement rotates these axes and puts this origin on the mount.
    """

    low_m: Vec3
    """Lowest x, y and z of any geom [m]."""
    high_m: Vec3
    """Highest x, y and z of any geom [m]."""
    functional_part_m: Vec3 | None
    """Working point of the functional part [m]; None if the robot has no part of that name."""
    length_m: float
    """Characteristic length [m]."""
    mass_kg: float
    """Mass of all bodies [kg]."""


@isolated
def measure(robot: Robot) -> Extent:
    """Measure a robot in its reference pose, in an isolated process.

    Raises:
        MjcfError: The robot cannot be loaded.
        IsolationError: Loading it exceeded its limits of time or memory.
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
    # body 1 is the first root; a floor in the robot's file belongs to body 0 and does not count
    low, high = bounding_box_m(model, data, range(1, model.nbody))
    structure = read_structure(model)
    origin = data.xpos[structure.roots[0]] if len(structure.roots) == 1 else np.zeros(3)
    part = find_functional_part(model, robot.functional_part)
    works_at = None
    if part is not None:
        body = model.body(part.body).id
        works_at = rounded_vector(data.xpos[body] - origin + data.xmat[body].reshape(3, 3) @ part.position_m)
    return Extent(
        low_m=rounded_vector(low - origin),
        high_m=rounded_vector(high - origin),
        functional_part_m=works_at,
        length_m=round(structure.characteristic_length_m, 4),
        mass_kg=round(float(np.sum(model.body_mass[1:])), 4),
    )
