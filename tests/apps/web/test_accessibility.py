"""No page has a fault that keeps people from using it, by axe-core (axe.min.js, MPL-2.0, version in its first line)."""

from pathlib import Path

import pytest
from browser import Server, browsing, open_tab
from made import made_export, made_run, made_training
from playwright.sync_api import Page
from robots import arm
from test_studies_panel import made_study

from aidsr.core.artifacts import PlausibilityCheck
from aidsr.runs import Run
from aidsr.runs.files import replace_file

AXE = Path(__file__).with_name("axe.min.js")


def findings(page: Page) -> list[str]:
    """Return what axe-core finds serious or critical on a page, and headings without words: rule and first element."""
    if page.evaluate("typeof axe === 'undefined'"):
        page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("axe.run(document, {resultTypes: ['violations']})")
    return [
        f"{one['id']}: {one['nodes'][0]['html'][:200]}"
        for one in found["violations"]
        if one["impact"] in ("serious", "critical") or one["id"] == "empty-table-header"
    ]


SCHEMES_AND_WIDTHS = [("light", 390), ("dark", 1280)]


def findings_everywhere(page: Page) -> list[str]:
    """Return the findings of a page in every scheme and width; it is left in the last one."""
    found = []
    for scheme, width in SCHEMES_AND_WIDTHS:
        page.emulate_media(color_scheme=scheme)
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_timeout(500)
        found += [f"{scheme}, {width} px wide: {one}" for one in findings(page)]
    return found


def test_pages_have_no_serious_findings(runs: Path, server: Server) -> None:
    check = PlausibilityCheck(name="energy", passed=True, measured=None, limit=0.1, unit="J", message="energy kept")
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address())
        page.get_by_role("button", name="Set up a run").wait_for()
        found = {"empty": findings_everywhere(page)}
        run = made_run(runs, waiting=True)
        run.design(2).iteration(2).robot.xml.path.write_text(arm())  # numbers of lines have two digits
        made_training(run.design(2), (True, False), (check,))
        made_export(run.design(2))
        made_run(runs, task="", objective="Turn the knob.")
        left = made_run(runs, designs=1, started="2026-02-01T10:00:00+00:00")
        (left.design(1).path / "outcome.json").unlink()
        replace_file(runs / ".web" / "processes" / f"{left.path.name}.log", b"a line of its output\n" * 60)
        made_study(runs / "first")
        made = f"/run/{run.path.name}"
        compare = f"/compare?design={run.path.name}/1&design={run.path.name}/2"
        for path in (
            "/",
            "/new",
            made,
            f"/run/{left.path.name}",
            f"{made}/1",
            f"{made}/1?iteration=1",
            f"{made}/2/export",
            "/work",
            "/designs",
            "/studies/new",
            "/study/first",
            compare,
        ):
            page.goto(server.address(path))
            page.get_by_role("heading").first.wait_for()
            found[path] = findings_everywhere(page)
        page.goto(server.address("/new"))
        page.get_by_role("radio", name="A language model").click()
        page.get_by_text("OPENAI_API_KEY").first.wait_for()
        open_tab(page, "Custom task")
        found["words"] = findings_everywhere(page)
        for tab in ("Side by side", "Log"):
            page.goto(server.address(made))
            open_tab(page, tab)
            found[tab] = findings_everywhere(page)
        for tab in ("Concept", "MJCF", "Log", "Probe", "Training"):
            page.goto(server.address(f"{made}/2"))
            open_tab(page, tab)
            found[f"design {tab}"] = findings_everywhere(page)
    bad = {place: each for place, each in found.items() if each}
    assert not bad, "\n".join(f"{place}: {one}" for place, each in bad.items() for one in each)


@pytest.mark.parametrize(("scheme", "width"), SCHEMES_AND_WIDTHS)
def test_the_page_of_an_address_that_leads_nowhere_has_no_serious_findings(
    server: Server, scheme: str, width: int
) -> None:
    """It takes its scheme when it is loaded."""
    with browsing(color_scheme=scheme, viewport={"width": width, "height": 900}) as visitor:
        page = visitor.new_page()
        page.goto(server.address("/nowhere"))
        page.get_by_role("heading").first.wait_for()
        page.wait_for_timeout(500)
        assert not findings(page)


@pytest.mark.parametrize(("scheme", "width"), SCHEMES_AND_WIDTHS)
def test_the_page_that_asks_for_the_token_has_no_serious_findings(runs: Path, scheme: str, width: int) -> None:
    screen = {"width": width, "height": 900}
    with (
        Server.over(runs, token="correct-horse-battery") as server,
        browsing(color_scheme=scheme, viewport=screen) as visitor,
    ):
        page = visitor.new_page()
        page.goto(server.address())
        found = findings(page)
        page.get_by_label("Token").fill("wrong")
        page.get_by_role("button", name="Sign in").click()
        page.get_by_role("alert").wait_for()
        found += findings(page)
        assert page.evaluate("innerWidth") == width, "a phone shows it in its own size"
    assert not found


def test_the_view_and_its_timeline_have_no_serious_findings(arm_run: Run, server: Server) -> None:
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{arm_run.name}/1"))
        page.get_by_text("squares of").wait_for()
        page.locator(".v3d-row .q-slider").first.click()
        page.wait_for_timeout(1500)
        page.get_by_role("button", name="Replay").click()
        page.locator(".v3d-track-name b").first.wait_for()
        assert not findings(page)
