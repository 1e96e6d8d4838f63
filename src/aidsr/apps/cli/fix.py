"""`aidsr fix`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from aidsr.apps.cli.flag import Flag
from aidsr.apps.cli.input_files import STANDARD_INPUT, read_standard_input, require_files

if TYPE_CHECKING:
    from aidsr.fixes import FixResult

_NOT_WRITTEN = ", not written; add --in-place or --out FILE to write"


def fix(
    *files: Annotated[str, Parameter(allow_leading_hyphen=True)],
    out: Annotated[Path | None, Parameter(show_default=False)] = None,
    in_place: Flag = False,
    force: Flag = False,
    simulate: Flag = False,
    list_fixes: Annotated[bool, Parameter(name="--list", negative="", show_default=False)] = False,
) -> int:
    """Fix unambiguous mistakes in the MJCF of robots or scenes; with --simulate, also faults found in simulation.

    Prints the fixes, and writes files only with --out or --in-place. Exit code 0: no faults remain that can be found
    without simulation (with --simulate: no errors remain). 1: some remain, or the fixes were not written. 2: a mistake
    in the command. For several files, the highest code is returned. A document without faults is not changed.

        aidsr fix robot.xml

        aidsr fix robot.xml --out fixed.xml

        aidsr fix robots/*.xml --in-place

        cat robot.xml | aidsr fix - > fixed.xml

        aidsr fix robot.xml --simulate --out stable.xml

    Parameters
    ----------
    files
        MJCF files of robots or scenes; "-" reads standard input and, without --out, writes to standard output.
    out
        Write the fixed text to this file.
    in_place
        Overwrite each file with its fixed text.
    force
        Allow --out to overwrite an existing file.
    simulate
        Also apply fixes that change the robot, and validate after each of them, until the robot is stable or no fix
        helps. The version with the fewest errors is kept; it has no error that the original robot did not have.
    list_fixes
        Print all fixes and the fault codes that they cure as a Markdown table, and exit.
    """
    from aidsr.apps.cli.terminal import write_document
    from aidsr.core.errors import UserError

    if list_fixes:
        write_document(fixes_table())
        return 0
    require_files(files, "fix")
    if out is not None and (in_place or len(files) > 1):
        raise UserError("--out writes one file: give one file, and leave out --in-place")
    if out is not None and out.exists() and not force:
        raise UserError(f"{out} exists; name another file for --out, or add --force to replace it")
    if in_place and STANDARD_INPUT in files:
        raise UserError("standard input cannot be fixed in place; leave out --in-place")
    return max([_fix_file(file, Path(file) if in_place else out, simulate=simulate) for file in files])


def _fix_file(file: str, target: Path | None, *, simulate: bool) -> int:
    """Fix one file, write the result to its output, print the fixes, and return the exit code."""
    from aidsr.apps.cli.output_file import write_output
    from aidsr.apps.cli.terminal import write, write_document
    from aidsr.fixes import fix
    from aidsr.mjcf.read import open_mjcf
    from aidsr.validation.fixing import fix_until_stable

    from_stdin = file == STANDARD_INPUT
    text = read_standard_input() if from_stdin else open_mjcf(Path(file))
    result = fix_until_stable(text) if simulate else fix(text)
    line_end = "\r\n" if text.endswith("\r\n") else "\n"
    fixed = result.mjcf + line_end * (text.endswith("\n") and not result.mjcf.endswith("\n"))
    written = True
    if target is not None:
        if result.total or target != Path(file):
            write_output(target, fixed)
    elif from_stdin:
        write_document(fixed)
    else:
        written = not result.total
    write(
        _account("standard input" if from_stdin else file, result, target, written=written),
        to=sys.stderr if from_stdin and target is None else sys.stdout,
    )
    return 0 if written and not result.unfixed else 1


def _account(name: str, result: FixResult, target: Path | None, *, written: bool) -> str:
    """Return the text output for a file: number of fixes and output file, one line per fix, remaining faults."""
    from aidsr.core.formatting import counted

    place = f", written to {target}" if target is not None else ""
    count = counted(result.total, "fix")
    head = "nothing to fix" if not result.total else f"{count}{place if written else _NOT_WRITTEN}"
    left = f"remaining: {', '.join(result.unfixed)}; see aidsr validate" if result.unfixed else ""
    return "\n".join([f"{name}: {head}", *(f"- {note}" for note in result.notes), *([left] if left else []), ""])


def fixes_table() -> str:
    """Return all fixes as a Markdown table, in the order in which they are applied."""
    from aidsr.fixes import FIXES

    rows = [
        (f"`{each.name}`", "safe" * each.safe, ", ".join(f"`{code}`" for code in each.cures), each.doc)
        for each in FIXES
    ]
    lines = ["| fix | | cures | what it does |", "|---|---|---|---|", *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n".join(lines) + "\n"
