"""Pictures of a scene for the Judge."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from aidsr.core.artifacts import Scene
from aidsr.core.errors import IsolationError, MjcfError
from aidsr.runs import IterationFolder

_STANDING = "The scene as it stands at the start."
_MOVING = "Five moments, from left to right, while the robot's actuators swing through their ranges."


def pictures_of(folder: Path, scene: Scene) -> dict[str, bytes]:
    """Return pictures of an iteration's scene by caption; those that cannot be rendered are left out.

    They are files of the iteration, so a resumed run sends the same pictures and does not pay for a critique twice.
    """
    from aidsr.render.pictures import filmstrip

    iteration = IterationFolder(folder)
    if iteration.motion.read() is None:
        with suppress(MjcfError, IsolationError):  # the scene can be judged without this picture
            iteration.motion.write(filmstrip(scene.mjcf))
    files = {_STANDING: iteration.preview, _MOVING: iteration.motion}
    return {caption: png for caption, file in files.items() if (png := file.read()) is not None}
