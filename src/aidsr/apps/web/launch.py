"""From what a person filled in to a run that is being worked on."""

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
    """What is to be designed, and how."""

    config: RunConfig
    task: str = ""
    level: Literal["standard", "hard"] = "standard"
    objective: str = ""
    environment: str = ""
    """MJCF, for an objective in words."""
    goal: str = ""
    """TOML that defines success in that environment; empty where there is none."""
    robot: str = ""
    """MJCF of a robot to start from."""


DEMO = RunRequest(RunConfig(seed=1), task="reaching/button_pushing")
"""Three robots that push a button, by the built-in rules: no API key, no cost."""


def launch(site: Site, request: RunRequest) -> Run:
    """Make the folder of a run and start a process that works on it; may take seconds.

    Raises:
        UserError: Something asked for does not exist or does not fit together.
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
