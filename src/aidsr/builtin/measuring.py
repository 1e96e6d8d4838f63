"""Facts of a robot's text that only a compiled model knows, measured in an isolated process."""

from __future__ import annotations

from typing import Any

from aidsr.artifacts import Artifact, Robot
from aidsr.sim import isolation

__all__ = ["Footprint", "footprint", "footprint_in_worker"]


class Footprint(Artifact):
    """Where a robot's shapes are, seen from its root's origin, in its own file's axes."""

    depth_m: float
    """How far they reach below it."""
    middle_x_m: float
    """Middle between their foremost and hindmost point."""


def footprint(robot: Robot) -> Footprint:
    """Measure a robot as it is drawn.

    Raises:
        MjcfError: The robot cannot be loaded.
        IsolationError: Loading it ran past its limits.
    """
    found = isolation.call("aidsr.builtin.measuring:footprint_in_worker", {"mjcf": robot.mjcf})
    return Footprint.model_validate(found)


def footprint_in_worker(argument: dict[str, Any]) -> dict[str, Any]:
    """Do the work of `footprint` on plain values.

    Raises:
        MjcfError: The robot cannot be loaded.
    """
    import mujoco

    from aidsr.sim.compiling import compile_mjcf
    from aidsr.sim.extent import bounding_box_m

    model = compile_mjcf(argument["mjcf"])
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    # Body 1 is the first root; a floor that came with the robot belongs to body 0 and does not count.
    low, high = bounding_box_m(model, data, range(1, model.nbody))
    root = data.xpos[1] if model.nbody > 1 else (0.0, 0.0, 0.0)
    return {"depth_m": float(root[2] - low[2]), "middle_x_m": float((low[0] + high[0]) / 2.0 - root[0])}
