"""`aidsr import`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from aidsr.apps.cli.flag import Flag

if TYPE_CHECKING:
    from aidsr.mjcf.importing import Imported


def import_robot(
    file: Path,
    /,
    *,
    out: Annotated[Path | None, Parameter(show_default=False)] = None,
    folder: Annotated[Path | None, Parameter(show_default=False)] = None,
    force: Flag = False,
) -> int:
    """Merge a robot that consists of several files into one MJCF document that the other commands can read.

    Included files are inserted. Meshes and height fields are stored as numbers; a mesh with more than 1,000 triangles
    is replaced by its convex hull with the same mass. Textures and skins from files are left out. The document begins
    with a list of the files and their hashes. Exit code 2: a file is missing or outside the folder, or the result is
    not a valid document or is too large.

        aidsr import mujoco_menagerie/robot/robot.xml --out robot.xml

        aidsr import suite/quadruped.xml --folder suite | aidsr validate -

    Parameters
    ----------
    file
        The main document.
    out
        Write the document to this file; default: standard output.
    folder
        Read only regular files in this folder and below it; default: the folder of the main document.
    force
        Allow --out to overwrite an existing file.
    """
    from aidsr.apps.cli.output_file import write_output
    from aidsr.apps.cli.terminal import write, write_document
    from aidsr.core.errors import UserError, with_source
    from aidsr.core.formatting import counted
    from aidsr.mjcf.importing import import_mjcf

    if out is not None and out.exists() and not force:
        raise UserError(f"{out} exists; name another file for --out, or add --force to replace it")
    with with_source(file):
        imported = import_mjcf(file, folder)
    text = _origin(imported) + imported.mjcf
    if out is None:
        write_document(text)
    else:
        write_output(out, text)
    place = f", written to {out}" if out is not None else ""
    lines = [
        f"{file}: {counted(len(imported.files), 'file')}{place}",
        *(f"- {note}" for note in imported.notes),
        "",
    ]
    write("\n".join(lines), to=sys.stderr if out is None else sys.stdout)
    return 0


def _origin(imported: Imported) -> str:
    """Return an XML comment that lists the imported files; "--", which XML comments may not contain, becomes "- -"."""
    from aidsr import __version__

    files = "".join(f"\n  {each.sha256}  {each.path}" for each in imported.files).replace("--", "- -")
    return f"<!-- Imported by aidsr {__version__} from these files (sha256):{files}\n-->\n"
