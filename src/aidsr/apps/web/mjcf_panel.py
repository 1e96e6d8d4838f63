"""The MJCF of an iteration, with its faults marked, or as the difference from the previous version."""

from __future__ import annotations

from dataclasses import dataclass

from nicegui import ui

from aidsr.apps.web.addresses import file_address
from aidsr.apps.web.mjcf_text import difference, highlighted
from aidsr.apps.web.widgets import box, button, text
from aidsr.core.artifacts import Fault
from aidsr.runs import DesignFolder, Run
from aidsr.runs.files import BytesFile
from aidsr.runs.status import newest


@dataclass(frozen=True)
class _Text:
    """One document of an iteration."""

    title: str
    path: str
    """Path of its file, relative to the run."""
    now: str
    before: str
    """Text of the same document at the newest earlier iteration that has it; empty where there is none."""
    faults: tuple[Fault, ...]


def mjcf_panel(run: Run, design: DesignFolder, number: int) -> None:
    """Show the robot, the scene, and the robot as it was before automatic fixes."""
    documents = _documents(run, design, number)
    if not documents:
        text("There is no MJCF yet.", "soft")
        return
    names = [one.title for one in documents]
    with box("row"):
        which = ui.toggle(names, value=names[0]).props("dense unelevated")
        how = ui.toggle(["Full", "Changes"], value="Full").props("dense unelevated")
    with box() as place:
        pass

    def draw() -> None:
        place.clear()
        with place:
            _draw(run, documents[names.index(str(which.value))], changes=how.value == "Changes")

    which.on_value_change(draw)
    how.on_value_change(draw)
    draw()


def _draw(run: Run, document: _Text, *, changes: bool) -> None:
    with box("stack"):
        with box("row apart"):
            text(f"{len(document.now.splitlines())} lines, {len(document.now.encode()) / 1000:.1f} kB", "small soft")
            address = file_address(run.name, document.path)
            button("Download", lambda: ui.download(address), "bare", "download")
        if changes and not document.before:
            text("There is no earlier version.", "soft")
            return
        marks = {fault.line: f"{fault.code}: {fault.message}" for fault in document.faults if fault.line}
        html = difference(document.before, document.now) if changes else highlighted(document.now, marks)
        if not html:
            text("No changes since the previous iteration.", "soft")
            return
        # safe without sanitizing: all text of the document is escaped
        shown = ui.html(html, sanitize=False).classes("code full")
        shown.props.update({"tabindex": "0", "role": "region", "aria-label": document.title})


def _documents(run: Run, design: DesignFolder, number: int) -> list[_Text]:
    until = design.leading_to(number)
    found = []
    files = {"Robot": "robot.xml", "Scene": "scene.xml", "Before automatic fixes": "robot_as_written.xml"}
    for title, name in files.items():
        paths = [it.path / name for it in until if (it.path / name).exists()]
        if title != "Robot":
            paths = [path for path in paths if path.parent.name == f"{number:02d}"]
        if not paths:
            continue
        earlier = newest(
            it.path / name if (it.path / name).exists() else None for it in until if it.path != paths[0].parent
        )
        report = design.iteration(int(paths[0].parent.name))
        validated = report.scene_report.read() if title == "Scene" else report.robot_report.read()
        found.append(
            _Text(
                title,
                paths[0].relative_to(run.path).as_posix(),
                BytesFile(paths[0]).read_text() or "",
                (BytesFile(earlier).read_text() or "") if earlier else "",
                validated.faults if validated and title != "Before automatic fixes" else (),
            )
        )
    return found
