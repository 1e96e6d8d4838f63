"""The text of a robot made larger or smaller."""

from __future__ import annotations

from aidsr.mjcf.compile import parse_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.sim.scaling import scale_robot


@isolated
def resize(mjcf: str, factor: float) -> str:
    """Return the MJCF of a robot `factor` times as large out of the same material, made in an isolated process.

    Raises:
        MjcfError: The robot cannot be loaded, or a part of it has no scaling rule.
        IsolationError: Loading ran past a limit.
    """
    spec = parse_mjcf(mjcf)
    scale_robot(spec, factor)
    spec.compile()
    return str(spec.to_xml())
