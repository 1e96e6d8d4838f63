"""Pictures of a scene: of its motion, and for the Judge."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from aidsr.core.artifacts import Scene
from aidsr.core.errors import IsolationError, MjcfError
from aidsr.render.view import View
from aidsr.runs import IterationFolder, Run

_STANDING = "The scene as it stands at the start."
_MOVING = "Five moments, from left to right, while the robot's actuators swing through their ranges."


def motion_view(run: Run) -> View:
    """Return a view in which the targets of the run's task or goal are visible, if it has any."""
    from aidsr.tasks import load_task, read_goal
    from aidsr.tasks.goals.environment_index import EnvironmentIndex
    from aidsr.tasks.goals.reading import AnyGoal
    from aidsr.tasks.targets import targets_of, targets_of_goal

    record = run.asked()
    if record.task:
        return View(shown=targets_of(load_task(record.task, record.level or "standard")))
    if not run.goal.path.exists():
        return View()
    brief = run.brief()
    goal: AnyGoal = read_goal(run.goal.path).resolved(EnvironmentIndex(brief.environment, brief.summary))
    return View(shown=targets_of_goal(goal))


def pictures_of(folder: Path, view: View, scene: Scene) -> dict[str, bytes]:
    """Return pictures of an iteration's scene by caption; those that cannot be rendered are left out.

    They are files of the iteration, so a resumed run sends the same pictures and does not pay for a critique twice.
    """
    from aidsr.render.pictures import filmstrip

    iteration = IterationFolder(folder)
    if iteration.motion.read() is None:
        with suppress(MjcfError, IsolationError):  # the scene can be judged without this picture
            iteration.motion.write(filmstrip(scene.mjcf, view=view))
    files = {_STANDING: iteration.preview, _MOVING: iteration.motion}
    return {caption: png for caption, file in files.items() if (png := file.read()) is not None}
