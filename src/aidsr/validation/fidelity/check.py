"""`check_fidelity`: the accuracy of a robot's simulation. Loads no simulator: a child process does the work."""

from __future__ import annotations

from pathlib import Path

from aidsr.sandbox.isolated import isolated
from aidsr.validation.fidelity.report import FidelityReport


def check_fidelity(mjcf: str | Path) -> FidelityReport:
    """Compare the simulation of a robot with exact elastic rods, finer segments and a finer time step.

    Each limb that is a straight elastic chain is compared with the exact rod that it represents, with the same limb
    with twice the segments, and with half the time step. The robot's root is fixed. Takes a few seconds.

    Args:
        mjcf: MJCF text, or the path of a file. The validator should report no error for this robot.

    Raises:
        UserError: The file cannot be read.
        MjcfError: The text is not a valid model; `aidsr.validate` reports its faults.
        IsolationError: The check took too long or its process died.
    """
    from aidsr.mjcf.read import open_mjcf

    text = open_mjcf(mjcf) if isinstance(mjcf, Path) else mjcf
    return examine_fidelity(text)


@isolated
def examine_fidelity(text: str) -> FidelityReport:
    """Return the report on MJCF text, computed in an isolated process."""
    from aidsr.validation.fidelity.measure import examine

    return examine(text)
