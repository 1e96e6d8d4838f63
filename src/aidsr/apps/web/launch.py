"""Create a run from a filled-in form, and start a process that works on it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

from aidsr.apps.web.site import Site
from aidsr.core.config import RunConfig
from aidsr.loop.run import create_run, make_brief
from aidsr.loop.teams import check_effects
from aidsr.runs import Run


@dataclass(frozen=True)
class RunRequest:
    """Parameters of a new run: a task or an objective, and the settings."""

    config: RunConfig
    task: str = ""
    level: Literal["standard", "hard"] = "standard"
    objective: str = ""
    environment: str = ""
    """MJCF of the environment, for an objective in words."""
    goal: str = ""
    """TOML of the goal that defines success in that environment; empty where there is none."""
    robot: str = ""
    """MJCF of the initial robot; empty for none."""


DEMO = RunRequest(RunConfig(seed=1), task="reaching/button_pushing")
"""Three robots that push a button, designed by the built-in rules: no API key, no cost."""


def launch(site: Site, request: RunRequest) -> Run:
    """Create the folder of a run and start a process that works on it; may take seconds.

    Raises:
        UserError: Something requested does not exist, or parts of the request do not fit together.
    """
    check_effects(request.config)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "goal.toml"
        file.write_text(request.goal, encoding="utf-8")
        goal = file if request.goal else ""
        brief = make_brief(
            request.objective,
            task=request.task,
            level=request.level,
            environment=request.environment,
            robot=request.robot,
            goal=goal,
        )
        level = request.level if request.task else ""
        run = create_run(brief, request.config, level=level, runs=site.library.path, goal=goal)
    site.resume(run)
    return run
