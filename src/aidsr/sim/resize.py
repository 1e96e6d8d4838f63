"""The text of a robot made larger or smaller, in a worker."""

from __future__ import annotations

from typing import Any

from aidsr.mjcf.compile import parse_mjcf
from aidsr.sandbox import isolation
from aidsr.sim.scaling import scale_robot

__all__ = ["at_size", "resize"]


def at_size(mjcf: str, factor: float) -> str:
    """Return the MJCF of a robot `factor` times as large out of the same material, made in a worker.

    Raises:
        MjcfError: The robot cannot be loaded, or a part of it has no scaling rule.
        IsolationError: Loading ran past a limit.
    """
    text: str = isolation.call("aidsr.sim.resize:resize", {"mjcf": mjcf, "factor": factor})["mjcf"]
    return text


def resize(argument: dict[str, Any]) -> dict[str, Any]:
    """Return {"mjcf"}, the robot of {"mjcf", "factor"} made larger or smaller; the worker's side of `at_size`."""
    spec = parse_mjcf(argument["mjcf"])
    scale_robot(spec, argument["factor"])
    spec.compile()
    return {"mjcf": spec.to_xml()}
