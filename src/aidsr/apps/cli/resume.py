"""`aidsr resume`."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from aidsr.apps.cli.flag import Flag
from aidsr.apps.cli.spending import Limits, merged_limits


def resume(
    run: Path,
    /,
    *,
    limits: Limits | None = None,
    trust: Flag = False,
) -> int:
    """Continue a run that was stopped or killed.

    Finished work is kept, and no answered call to a language model is repeated. A limit given here replaces the
    earlier one of its kind and includes what is already spent; designs that ran out of budget are continued.

        aidsr resume runs/2026-01-31_1002_button_pushing_7f3a

        aidsr resume runs/2026-01-31_1002_button_pushing_7f3a --max-cost 2

    Parameters
    ----------
    run
        Folder of the run.
    trust
        Allow a run that was not made here to send its prompts and your API key to the address in its run.json.
    """
    from aidsr.apps.cli.progress import follow_run
    from aidsr.apps.cli.terminal import make_console
    from aidsr.apps.cli.trust import confirmed
    from aidsr.loop.run import parts_of, replace_budget, require_run_is_ours
    from aidsr.runs import Run, read_status

    found = Run(run)
    confirmed(partial(require_run_is_ours, found), trust)
    if limits is not None and limits != Limits():
        replace_budget(found, merged_limits(found.budget(), limits.given))
    status = read_status(found)
    if status.state == "finished" and not any(
        design.outcome is not None and design.outcome.outcome == "out_of_budget" for design in status.designs
    ):
        make_console().print("This run is already finished; nothing is repeated.\n")
    return follow_run(found, parts_of(found, trust=True))
