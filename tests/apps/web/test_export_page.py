"""A design as parts, without a browser: what is said before, while and after it is exported."""

import asyncio
import os
import time
from pathlib import Path

from made import made_export, made_run
from nicegui import ui
from nicegui.testing import User
from test_pages import press, shown, visiting, visitor

from aidsr.apps.web.export_page import State, draw_export, read_export
from aidsr.apps.web.export_result import letters
from aidsr.apps.web.site import Site
from aidsr.core.artifacts import Fault
from aidsr.fabrication.schema import PartEntry, Verdict
from aidsr.runs import DesignFolder, Run


def aged(folder: Path, seconds: float) -> None:
    """Let a file look as if it was written some time ago."""
    then = time.time() - seconds
    os.utime(folder, (then, then))


@visiting
async def test_an_export_shows_verdict_parts_and_changes(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    made_export(run.design(1), verdict="not buildable")
    await user.open(f"/run/{run.path.name}/1")
    press(user, "Export")
    for said in (
        "not buildable",
        "part exceeds bed",
        "268 mm (at most 250)",
        "larger than the bed",
        "a flange",
        "108 mm",
    ):
        await user.should_see(said)
    page = shown(user)
    assert f"/files/{run.path.name}/designs/1/export/parts/tip_x2.stl?v=" in page
    assert f"/sheet/{run.path.name}/1" in page
    for element in user.client.elements.values():
        assert "<script" not in str(element.props.get("innerHTML", ""))


@visiting
async def test_a_retest_is_not_called_stable_above_an_error_of_its_winches(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    folder = made_export(run.design(1))
    told = Verdict.model_validate_json((folder / "verdict.json").read_text())
    assert told.retest is not None
    strong = Fault(
        code="actuator_overforce", layer="realizability", severity="error", message="pulls too hard", cure="Pull less."
    )
    retest = told.retest.model_copy(update={"faults": (strong,)})
    (folder / "verdict.json").write_text(told.model_copy(update={"retest": retest}).model_dump_json())
    await user.open(f"/run/{run.path.name}/1/export")
    await user.should_see("actuator overforce")
    await user.should_see("moves without a fault")
    await user.should_see("Limits of cables, winches and parts")
    await user.should_not_see(content="stable")
    shaking = retest.model_copy(
        update={
            "stable": False,
            "faults": (Fault(code="chatter", layer="simulate", severity="error", message="shakes"),),
        }
    )
    (folder / "verdict.json").write_text(told.model_copy(update={"retest": shaking}).model_dump_json())
    await user.open(f"/run/{run.path.name}/1/export")
    await user.should_see("has faults of motion")


@visiting
async def test_a_finding_is_told_once_and_warnings_are_not_called_changes(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    folder = made_export(run.design(1), verdict="buildable")
    told = Verdict.model_validate_json((folder / "verdict.json").read_text())
    assert told.retest is not None
    error = Fault(code="actuator_overforce", layer="realizability", severity="error", message="pulls too hard")
    warning = error.model_copy(update={"severity": "warning"})
    retest = told.retest.model_copy(update={"faults": (error,)})
    update = {"reasons": (warning,), "retest": retest, "changes": (), "simulated_g": 60.0, "built_g": 34.6}
    (folder / "verdict.json").write_text(told.model_copy(update=update).model_dump_json())
    await user.open(f"/run/{run.path.name}/1/export")
    await user.should_see("It can be built as simulated; 1 warning.")
    assert shown(user).count("pulls too hard") == 1
    await user.should_see("pieces fixed to the world")
    await user.should_see("10 g (simulated 36 g)")


@visiting
async def test_an_export_is_a_process_of_its_own(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    await user.open(f"/run/{run.path.name}/1/export")
    await user.should_see("Export parts")
    press(user, "Export")
    await user.should_see("Can it be built?", retries=3000)
    assert (run.design(1).path / "export" / "sheet.html").exists()


@visiting
async def test_only_an_approved_design_is_exported(user: User, site: Site) -> None:
    made_run(site.library.path, designs=1, waiting=True)
    (run,) = site.library.runs()
    await user.open(f"/run/{run.path.name}/1/export")
    await user.should_see("A design can be exported once it is approved.")
    await user.open(f"/run/{run.path.name}/7/export")
    await user.should_see("No design 7")


def drawn(site: Site, run: Run, state: State) -> str:
    async def draw() -> str:
        async with visitor(site) as user:

            @ui.page("/alone")
            def alone() -> None:
                draw_export(site, run, run.design(1), state)

            await user.open("/alone")
            return shown(user)

    return asyncio.run(draw())


def test_without_the_extra_it_is_said_what_to_install(tmp_path: Path) -> None:
    site = Site.at(tmp_path)
    run = made_run(tmp_path, designs=1)
    said = drawn(site, run, State("pip install aidsr[fabrication]", approved=True, trained=False))
    assert "Export is not available on this machine: pip install aidsr[fabrication]" in said
    assert "Limb material" not in said


def test_an_older_export_is_not_taken_for_what_a_failed_process_wrote(tmp_path: Path) -> None:
    site, run = Site.at(tmp_path), made_run(tmp_path, designs=1)
    design: DesignFolder = run.design(1)
    assert read_export(site, run, design).verdict is None
    folder = made_export(design)
    found = read_export(site, run, design)
    assert found.verdict is not None
    assert [part.file for part in found.parts] == ["tip_x2"]
    aged(folder / "verdict.json", 60)
    name = site.export_name(run, 1)
    site.processes.folder.mkdir(parents=True)
    (site.processes.folder / f"{name}.json").write_text('{"pid": 0}')
    (site.processes.folder / f"{name}.log").write_text("no space left on the disk")
    found = read_export(site, run, design)
    assert (found.verdict, found.output_tail) == (None, "no space left on the disk")


def test_parts_have_the_letters_of_the_sheet() -> None:
    def part(name: str, what: str) -> PartEntry:
        return PartEntry(
            file=name, what=what, copies=1, used_for=(), material="petg", infill=1, mass_g=1, simulated_g=None,
            size_mm=(1, 1, 1), support_cm3=0, thinnest_wall_mm=1, watertight=True, fits_bed=True,
        )  # fmt: skip

    assert letters((part("a", "robot"), part("s", "station"), part("b", "robot"), part("d", "spool"))) == (
        "A", "1", "B", "2",
    )  # fmt: skip
