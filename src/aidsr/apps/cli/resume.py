"""`aidsr resume`."""

from __future__ import annotations

from pathlib import Path

from aidsr.apps.cli.spending import Limits

__all__ = ["resume"]


def resume(run: Path, /, *, limits: Limits | None = None) -> int:
    """Go on with a run that was stopped or killed.

    What is finished is kept, and no question that a language model answered is asked again. A limit given here holds
    instead of the earlier ones, what was spent before included; designs that ran out of budget go on.

        aidsr resume runs/2026-01-31_1002_button_pushing_7f3a

        aidsr resume runs/2026-01-31_1002_button_pushing_7f3a --max-cost 2

    Parameters
    ----------
    run
        Folder of the run.
    """
    from aidsr.apps.cli.following import follow
    from aidsr.loop import give_budget, parts_of
    from aidsr.runs import Run

    found = Run(run)
    if limits is not None and limits != Limits():
        give_budget(found, limits.budget())
    return follow(found, parts_of(found))
