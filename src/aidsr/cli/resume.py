"""`aidsr resume`."""

from __future__ import annotations

from pathlib import Path

__all__ = ["resume"]


def resume(run: Path, /) -> int:
    """Go on with a run that was stopped or killed.

    What is finished is kept, and no question that a language model answered is asked again.

        aidsr resume runs/2026-01-31_1002_button_pushing_7f3a

    Parameters
    ----------
    run
        Folder of the run.
    """
    from aidsr.cli.following import follow
    from aidsr.pipeline import parts_of
    from aidsr.runs import Run

    found = Run(run)
    return follow(found, parts_of(found))
