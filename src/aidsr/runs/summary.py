"""Overview page of a run: one self-contained HTML file, computed from the files of the run."""

from __future__ import annotations

import base64
import shlex
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from aidsr.core.artifacts import Concept, Fault, Placement
from aidsr.core.config import RunConfig
from aidsr.core.formatting import format_cost, format_duration, format_tokens
from aidsr.core.html import html_template
from aidsr.runs.files import replace_file
from aidsr.runs.folders import DesignFolder, IterationFolder, Run
from aidsr.runs.stages import stability_in_words
from aidsr.runs.status import DesignStatus, newest, read_status
from aidsr.runs.trainings import trainings_of, verdict_in_words

if TYPE_CHECKING:
    from jinja2 import Template


def write_summary(run: Run, *, offline: bool = False) -> Path:
    """Write summary.html from the current state of the run, and return its path.

    Args:
        run: The run.
        offline: Whether its team asks no language model, see `aidsr.teams.providers.is_offline`.
    """
    status = read_status(run)
    brief = run.brief()
    page = _template().render(
        run=run,
        record=status.record,
        offline=offline,
        roles=_roles_asked(status.record.config),
        status=status,
        brief=brief,
        designs=[_card(run.design(design.number), design) for design in status.designs],
        cost=format_cost(status.usage),
        tokens=format_tokens(status.usage),
        duration=format_duration(status.latency_s),
    )
    replace_file(run.summary, page.encode())
    return run.summary


def _roles_asked(config: RunConfig) -> str:
    """Return in words the roles that the language model plays."""
    left_out = {
        "no_judge": ("Judge",),
        "no_integrator": ("Scene Integrator",),
        "no_judge_or_integrator": ("Judge", "Scene Integrator"),
        "no_feedback": ("Judge",),
    }.get(config.method, ())
    *others, last = (role for role in ("Designer", "Coder", "Scene Integrator", "Judge") if role not in left_out)
    return f"{', '.join(others)} and {last}"


@dataclass(frozen=True)
class _Row:
    """One iteration on the page."""

    number: int
    made: str
    repairs: tuple[str, ...]
    """Notes on automatic fixes, one sentence each."""
    robot: str
    scene: str
    judge: str
    faults: tuple[Fault, ...]
    issues: tuple[str, ...]
    decision: str
    picture: str


@dataclass(frozen=True)
class _Card:
    """One design on the page."""

    status: DesignStatus
    concept: Concept | None
    placement: Placement | None
    picture: str
    """Newest picture as a data URL; empty where there is none."""
    picture_path: str
    """Path of the picture relative to the page."""
    motion: str
    """Newest film strip as a data URL; empty where there is none."""
    motion_path: str
    """Path of the film strip relative to the page."""
    rows: tuple[_Row, ...]
    faults_found: int
    files: tuple[tuple[str, str], ...]
    """Labels and paths relative to the page."""
    trainings: tuple[str, ...]
    """Result of each training, in words."""
    cost: str
    tokens: str
    duration: str


def _card(folder: DesignFolder, status: DesignStatus) -> _Card:
    newest_first = folder.leading_to(status.stands_at or None)
    preview = newest(it.preview.path if it.preview.path.exists() else None for it in newest_first)
    motion = newest(it.motion.path if it.motion.path.exists() else None for it in newest_first)
    rows = tuple(_row(iteration) for iteration in folder.iterations)
    return _Card(
        status=status,
        concept=newest(it.concept.read() for it in newest_first),
        placement=newest(it.placement.read() for it in newest_first),
        picture=_data_address(preview),
        picture_path=_relative(folder, preview),
        motion=_data_address(motion),
        motion_path=_relative(folder, motion),
        rows=rows,
        faults_found=sum(len(row.faults) for row in rows),
        files=tuple(_files(folder, newest_first)),
        trainings=tuple(verdict_in_words(training) for training in trainings_of(folder)),
        cost=format_cost(status.usage),
        tokens=format_tokens(status.usage),
        duration=format_duration(status.latency_s),
    )


def _row(iteration: IterationFolder) -> _Row:
    robot, scene = iteration.robot_report.read(), iteration.scene_report.read()
    critique, repairs = iteration.critique.read(), iteration.repairs.read()
    made = {"concept": iteration.concept.path, "robot": iteration.robot.xml.path, "placement": iteration.placement.path}
    return _Row(
        number=iteration.number,
        made=", ".join(name for name, path in made.items() if path.exists()),
        repairs=repairs.notes if repairs else (),
        robot=stability_in_words(robot) if robot else "",
        scene=stability_in_words(scene) if scene else "",
        judge=("passed" if critique.passed else "not passed") if critique else "",
        faults=tuple(fault for report in (robot, scene) if report for fault in report.errors),
        issues=tuple(f"{issue.component}: {issue.problem}" for issue in critique.issues) if critique else (),
        decision=_decision(iteration),
        picture=_data_address(iteration.preview.path),
    )


def _decision(iteration: IterationFolder) -> str:
    """Return the unparsed text of decision.json, which a person writes and which may be incomplete."""
    if not iteration.decision.path.exists():
        return ""
    return iteration.decision.path.read_text(encoding="utf-8", errors="replace")


def _files(folder: DesignFolder, newest_first: tuple[IterationFolder, ...]) -> list[tuple[str, str]]:
    shown = next(iter(newest_first), None)
    candidates = [("final scene", folder.final_scene.path), ("final robot", folder.final_robot.path)]
    if shown is not None:
        candidates += [
            ("scene report", shown.scene_report.path),
            ("robot report", shown.robot_report.path),
            ("critique", shown.critique.path),
        ]
    candidates.append(("events", folder.events))
    return [(label, _relative(folder, path)) for label, path in candidates if path.exists()]


def _relative(design: DesignFolder, file: Path | None) -> str:
    """Return the path of a file relative to the page, which is in the run's folder."""
    return file.relative_to(design.path.parent.parent).as_posix() if file else ""


def _data_address(png: Path | None) -> str:
    if png is None or not png.exists():
        return ""
    return f"data:image/png;base64,{base64.b64encode(png.read_bytes()).decode()}"


@cache
def _template() -> Template:
    return html_template(
        Path(__file__).with_name("summary.html.j2"),
        quoted=lambda path: shlex.quote(str(path)),
        numbers=lambda values: ", ".join(f"{value:.3g}" for value in values),
    )
