"""The fixed suite of scenes on which ways of learning are compared: one file per scene.

A file holds the robot and its placement, not the whole scene, so that a scene follows its task from version to version
of the benchmark. It also names the scene's half: ways of learning are chosen by the half `decide` alone, and the half
`aside` may be looked at only after that choice.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from aidsr.core.artifacts import Artifact, Placement, Robot
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.assembly import assemble
from aidsr.tasks import load_task

SCENES = Path(__file__).parent / "scenes"

Half = Literal["decide", "aside"]


class SuiteScene(Artifact):
    """A robot, its placement and its task."""

    name: str
    task: str
    half: Half
    author: Literal["language model", "built-in rules"]
    origin: str
    """Origin of the robot, in enough detail to find it again."""
    robot: Robot
    placement: Placement

    def scene(self) -> TaskScene:
        """Return the robot in the environment of its task."""
        task = load_task(self.task)
        mjcf = assemble(self.robot, task.environment, self.placement, task.sensors).mjcf
        return TaskScene.of(mjcf, task, groups=self.robot.actuator_groups)


def suite(half: Half | None = None) -> list[SuiteScene]:
    """Return the scenes of one half, or all, sorted by name."""
    found = [SuiteScene.model_validate_json(path.read_bytes()) for path in sorted(SCENES.glob("*.json"))]
    return [scene for scene in found if half in (None, scene.half)]
