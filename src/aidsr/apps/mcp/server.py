"""The tools of the MCP server. Their arguments are untrusted and go through the safe paths of `mjcf` and `sandbox`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from mcp.server.mcpserver import Image, MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from pydantic import Field

from aidsr import __version__
from aidsr.apps.mcp.scene_folder import SceneFolder
from aidsr.core.artifacts import Artifact, EnvironmentSummary, Fault, Placement, Robot, ValidationReport
from aidsr.core.errors import AidsrError
from aidsr.learn.openloop import probe
from aidsr.render.pictures import picture
from aidsr.render.view import View
from aidsr.sim.assembly import assemble
from aidsr.tasks import Level, load_task, task_names
from aidsr.teams.llm.prompts import render
from aidsr.validation import validate

_INSTRUCTIONS = """\
Design tendon-driven continuum robots with measured physics. A usual order: list_tasks, read_task, then write MJCF as
the resource aidsr://mjcf-guide says; validate it until it is stable; assemble_scene places it in the task's environment
and validates it there; render shows it. Fix the causes of faults, not their symptoms: each says what was measured, the
limit, and the usual cure."""

TaskName = Annotated[str, Field(description="Name of a task as list_tasks returns it.")]
Mjcf = Annotated[str, Field(description="The whole MJCF document of the robot alone.")]
SceneNumber = Annotated[str, Field(description='Number that assemble_scene returned, such as "0003".')]


class TaskLine(Artifact):
    """One task of the list."""

    name: str
    objective: str


class TaskDescription(Artifact):
    """What a designer needs to know about a task."""

    name: str
    objective: str
    base: str
    """"fixed" to a mount, "moving" with one, "free", or "any"."""
    needs_contact: bool
    time_limit_s: float
    hold_s: float
    stages: tuple[str, ...]
    """What is reached on the way to success, in order."""
    environment: EnvironmentSummary
    environment_mjcf: str


class Verdict(Artifact):
    """What the validator found."""

    stable: bool
    """Sound and in scope."""
    sound: bool
    """Whether the physics holds."""
    in_scope: bool
    """Whether it is a tendon-driven continuum robot, whose cables and soft body do the work."""
    account: str
    """All findings in words, the most damaging first."""
    faults: tuple[Fault, ...]
    scene: str = ""
    """Number of the scene, where one was made."""
    path: str = ""
    """Its file, for `aidsr train`, `aidsr view` and the like."""


def build_server(folder: Path) -> MCPServer:
    """Return the server.

    Args:
        folder: Folder of the scenes.
    """
    server = MCPServer("aidsr", version=__version__, instructions=_INSTRUCTIONS, log_level="WARNING")
    _add_task_tools(server)
    scenes = SceneFolder(folder)
    _add_validation_tools(server, scenes)
    _add_scene_tools(server, scenes)
    return server


def _add_task_tools(server: MCPServer) -> None:
    @server.tool()
    def list_tasks() -> list[TaskLine]:
        """List the benchmark tasks with their objectives."""
        return [TaskLine(name=name, objective=load_task(name).objective) for name in task_names()]

    @server.tool()
    def read_task(task: TaskName, level: Level = "standard") -> TaskDescription:
        """Return what a designer needs to know about a task: objective, environment, stages to success."""
        try:
            found = load_task(task, level)
        except AidsrError as error:
            raise ToolError(str(error)) from None
        brief = found.brief()
        return TaskDescription(
            name=found.name,
            objective=brief.objective,
            base=brief.base,
            needs_contact=brief.needs_contact,
            time_limit_s=found.time_limit_s,
            hold_s=found.hold_s,
            stages=tuple(words for _, words in found.stages),
            environment=brief.summary,
            environment_mjcf=brief.environment,
        )

    @server.resource("aidsr://mjcf-guide", mime_type="text/markdown")
    def mjcf_guide() -> str:
        """How to write a tendon-driven robot in MJCF, with one complete limb."""
        return render("mjcf_guide")


def _add_validation_tools(server: MCPServer, scenes: SceneFolder) -> None:
    @server.tool(name="validate")
    def validate_robot(
        mjcf: Mjcf,
        mount: Annotated[Literal["auto", "fixed", "free"], Field(description="How its root is held.")] = "auto",
        needs_contact: bool = False,
        realizable: Annotated[bool, Field(description="Also reject what could not be built.")] = False,
    ) -> Verdict:
        """Drive every actuator of a robot in simulation and report what is wrong with its physics and its scope."""
        if "<" not in mjcf:  # elsewhere such a string is a path; a client must not make the server read files
            raise ToolError(f"not an MJCF document: {mjcf[:80]!r}; give the text of one, not its path")
        try:
            report = validate(mjcf, mount=mount, needs_contact=needs_contact, realizable=realizable)
        except AidsrError as error:
            raise ToolError(str(error)) from None
        return _verdict(report, report.account())

    @server.tool()
    def assemble_scene(
        mjcf: Mjcf,
        functional_part: Annotated[str, Field(description="Body or site of the robot that does the work.")],
        task: TaskName,
        placement: Annotated[Placement, Field(description="Where and how the robot is placed.")],
        level: Level = "standard",
    ) -> Verdict:
        """Place a robot in the environment of a task, save the scene, and validate it there."""
        try:
            found = load_task(task, level)
            robot = Robot(mjcf=mjcf, functional_part=functional_part)
            scene = assemble(robot, found.environment, placement, found.sensors)
            report = validate(scene.mjcf, needs_contact=found.needs_contact)
        except AidsrError as error:
            raise ToolError(str(error)) from None
        directory = scenes.add(robot, scene, found)
        account = "\n".join([report.account(), *scene.notes])
        path = str(directory / "scene.xml")
        return _verdict(report, account, scene=directory.name, path=path)


def _verdict(report: ValidationReport, account: str, scene: str = "", path: str = "") -> Verdict:
    return Verdict(
        stable=report.stable,
        sound=report.sound,
        in_scope=report.in_scope,
        account=account,
        faults=report.faults,
        scene=scene,
        path=path,
    )


def _add_scene_tools(server: MCPServer, scenes: SceneFolder) -> None:
    @server.tool(name="probe")
    def probe_scene(scene: SceneNumber) -> str:
        """Measure, without learning, how far the robot of a scene gets on its task; takes tens of seconds."""
        try:
            report = probe(scenes.scene(scene), scenes.task(scene))
        except AidsrError as error:
            raise ToolError(str(error)) from None
        return (
            f"{report.reached}. Progress {report.progress:.2f} of 1 on average, {report.success_share:.0%} of the "
            f"variations solved by some motion, {report.same_motion_share:.0%} by one and the same. "
            f"The search ended because {report.why_ended}."
        )

    @server.tool(name="render")
    def render_scene(
        scene: SceneNumber,
        azimuth_deg: Annotated[float, Field(description="Azimuth of the camera about the vertical.")] = 135.0,
        elevation_deg: Annotated[
            float, Field(description="Elevation of the camera: 0 level, -90 straight down.")
        ] = -20.0,
    ) -> Image:
        """Render a scene in its initial state."""
        try:
            mjcf = scenes.scene(scene).read_text(encoding="utf-8")
            return Image(
                data=picture(mjcf, view=View(azimuth_deg=azimuth_deg, elevation_deg=elevation_deg)), format="png"
            )
        except AidsrError as error:
            raise ToolError(str(error)) from None
