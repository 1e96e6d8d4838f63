"""`aidsr view`."""

from __future__ import annotations

from pathlib import Path


def view(path: Path, /, *, picture: Path = Path("aidsr_view.png")) -> int:
    """View a design, a scene or a robot.

    Opens MuJoCo's viewer, where you can move the actuators by hand. Without a display, it draws a picture instead.

        aidsr view runs/2026-01-31_1002_button_pushing_7f3a/designs/1

        aidsr view robot.xml --picture robot.png

    Parameters
    ----------
    path
        MJCF file, or the folder of a design or of one iteration.
    picture
        PNG file for the picture that is drawn if there is no display; an existing picture is replaced.
    """
    from rich.markup import escape

    from aidsr.apps.cli.output_file import require_output
    from aidsr.apps.cli.terminal import make_console
    from aidsr.core.errors import with_source
    from aidsr.mjcf.read import open_mjcf
    from aidsr.render.viewer import view as look

    require_output(picture, option="--picture", suffix=".png")
    model = model_of(path)
    with with_source(model):
        drawn = look(open_mjcf(model), picture)
    if drawn is not None:
        make_console(soft_wrap=True).print(f"No display found; picture written to [bold]{escape(str(drawn))}[/]")
    return 0


def model_of(path: Path) -> Path:
    """Return the MJCF file to view: the path itself, or for a folder its final scene, else its newest scene or robot.

    Raises:
        UserError: The folder is a run, holds neither a scene nor a robot, or its run has no design of this number.
    """
    from aidsr.core.errors import UserError
    from aidsr.core.numbered import is_number, numbered_in
    from aidsr.runs import RUN_FILE, DesignFolder, Run, read_status

    if (path / RUN_FILE).exists():
        raise UserError(f"{path} is a run, not a design; give one of its designs, for example {path / 'designs' / '1'}")
    run = path.parent.parent
    if not path.exists() and is_number(path.name) and path.parent.name == "designs" and (run / RUN_FILE).exists():
        read_status(Run(run)).design(int(path.name))  # tells which designs there are
    if not path.is_dir():
        return path
    iterations = [path, *numbered_in(path)]
    candidates = [
        DesignFolder(path).final_scene.path,
        *(it / f"{stem}.xml" for it in reversed(iterations) for stem in ("scene", "robot")),
    ]
    found = next((candidate for candidate in candidates if candidate.exists()), None)
    if found is None:
        raise UserError(
            f"{path} is not a design: neither scene nor robot found; give an MJCF file or the folder of a design"
        )
    return found
