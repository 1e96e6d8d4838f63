"""`check_fidelity`: how far a simulation can be trusted. Loads no simulator: a child process does the work."""

from __future__ import annotations

from pathlib import Path

from aidsr.sandbox.isolated import isolated
from aidsr.validation.fidelity.report import FidelityReport


def check_fidelity(mjcf: str | Path) -> FidelityReport:
    """Compare the simulation of a robot with exact elastic rods, finer segments and a finer time step.

    Each limb that is a straight elastic chain is held against the exact rod it stands for, against itself with twice
    the segments, and against half the time step, with the robot's root held. Takes a few seconds.

    Args:
        mjcf: MJCF text, or the path of a file. It should be a robot the validator calls stable.

    Raises:
        UserError: The file cannot be read.
        MjcfError: The text is no model; `aidsr.validate` says what is wrong with it.
        IsolationError: The check took too long or its process died.
    """
    from aidsr.mjcf.read import open_mjcf

    text = open_mjcf(mjcf) if isinstance(mjcf, Path) else mjcf
    return examine_fidelity(text)


@isolated
def examine_fidelity(text: str) -> FidelityReport:
    """Return the report, made in an isolated process."""
    from aidsr.validation.fidelity.measure import examine

    return examine(text)
