"""Facts of a robot's text that only a compiled model knows, measured in an isolated process."""

from __future__ import annotations

from typing import Any

from aidsr.artifacts import Robot
from aidsr.sim import isolation

__all__ = ["lowest_point_in_worker", "lowest_point_m"]


def lowest_point_m(robot: Robot) -> float:
    """Return how far the robot's shapes reach below its root's origin, in its own file's axes [m].

    Raises:
        MjcfError: The robot cannot be loaded.
        IsolationError: Loading it ran past its limits.
    """
    found = isolation.call("aidsr.builtin.measuring:lowest_point_in_worker", {"mjcf": robot.mjcf})
    return float(found["depth_m"])


def lowest_point_in_worker(argument: dict[str, Any]) -> dict[str, Any]:
    """Do the work of `lowest_point_m` on plain values.

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
    low, _ = bounding_box_m(model, data, range(1, model.nbody))
    root = data.xpos[1] if model.nbody > 1 else (0.0, 0.0, 0.0)
    return {"depth_m": float(root[2] - low[2])}
