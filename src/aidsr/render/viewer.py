"""Display of a model in MuJoCo's viewer, or as a picture where there is no display."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from aidsr.core.errors import UserError
from aidsr.render import pictures
from aidsr.sandbox.isolated import isolated


def view(mjcf: str, picture: Path) -> Path | None:
    """Show a model and return when the viewer is closed; without a display, write a picture of it.

    The viewer runs in a separate process, so that a model that crashes it affects nothing else.

    Args:
        mjcf: MJCF of a robot or scene.
        picture: File for the picture, used only without a display.

    Returns:
        The path of the picture, or None if the viewer was shown.

    Raises:
        MjcfError: The MJCF cannot be loaded.
        IsolationError: Loading or rendering exceeded a limit.
        UserError: The viewer failed although there is a display, or the picture cannot be written.
    """
    if not has_display():
        drawn = pictures.picture(mjcf, width=1280, height=960)
        try:
            picture.write_bytes(drawn)
        except OSError as error:
            raise UserError(f"cannot write {picture}: {error.strerror}") from error
        return picture
    checked = checked_document(mjcf)
    with tempfile.TemporaryDirectory(prefix="aidsr-view-") as folder:
        file = Path(folder) / "model.xml"
        file.write_text(checked, encoding="utf-8")
        viewer = subprocess.run([sys.executable, "-m", "mujoco.viewer", f"--mjcf={file}"], cwd=folder, check=False)
    if viewer.returncode != 0:
        raise UserError(
            f"MuJoCo's viewer ended with code {viewer.returncode}. Without a usable display, unset DISPLAY and "
            "WAYLAND_DISPLAY to get a picture instead."
        )
    return None


def has_display() -> bool:
    """Return whether a window can be opened."""
    if sys.platform == "linux":
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return True


@isolated
def checked_document(mjcf: str) -> str:
    """Return the canonical text of the checked document, so that the viewer opens exactly this document."""
    from aidsr.mjcf.compile import load_mjcf
    from aidsr.mjcf.read import canonical

    text, _ = canonical(load_mjcf(mjcf).document.root)
    return text
