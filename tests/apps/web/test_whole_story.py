"""One story through the page, in a real browser: words, run, pin and refine, compare, train, timeline, parts."""

import re
from pathlib import Path

import pytest
from browser import Server, browsing, choose, open_tab
from playwright.sync_api import Page, expect

from aidsr.runs import Library

WORDS = "Make it a little longer."


@pytest.mark.slow  # minutes, where a processor draws in three dimensions
def test_from_words_to_parts(runs: Path, server: Server) -> None:
    with browsing(webgl=True, viewport={"width": 1280, "height": 800}) as visitor:
        page = visitor.new_page()
        complaints: list[str] = []
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(server.address("/new?template=bell"))
        page.get_by_label("Number of concepts").fill("2")
        page.wait_for_timeout(500)  # a number travels in the background
        page.get_by_role("button", name="Start the run").click()
        page.wait_for_url("**/run/*")
        (run,) = Library(runs).runs()
        home = server.address(f"/run/{run.name}")

        page.get_by_role("button", name="Review").first.wait_for()  # of whichever design is first
        page.goto(f"{home}/1")
        about = _pin_and_refine(page)
        page.get_by_text("round 2, your request").wait_for()
        decision = run.design(1).iteration(1).decision.read()
        assert decision is not None
        assert decision.text == f"About {about}: {WORDS}"
        for number in (1, 2):
            page.goto(f"{home}/{number}")
            page.get_by_role("button", name="Approve").click()
            expect(page.locator("h1 + .badge")).to_have_text(re.compile("^approved"))  # and its warnings

        page.goto(server.address(f"/compare?design={run.name}/1&design={run.name}/2"))
        expect(page.get_by_role("heading", name="Compare designs")).to_be_visible()
        expect(page.get_by_text("squares of")).to_have_count(2)

        page.goto(f"{home}/1")
        _train(page)
        page.get_by_role("button", name="Replay best").click()
        expect(page.locator(".v3d-clock b")).to_contain_text("of training 1")
        expect(page.locator(".v3d-track-name b").first).to_have_text("cable tension")

        page.get_by_role("button", name="Export").click()
        page.wait_for_url("**/export")
        page.get_by_role("button", name="Export", exact=True).click()
        expect(page.get_by_role("link", name="Assembly sheet")).to_be_visible()
        page.get_by_text("squares of").wait_for()
        assert not complaints
    assert list((run.design(1).path / "export" / "parts").glob("*.stl"))


def _pin_and_refine(page: Page) -> str:
    """Choose the first part of the robot, ask for a change of it, and return its name."""
    about = "robot/base"
    choose(page, "Part (click it in the view, or select it here)", about)
    page.get_by_label("What should change?").fill(WORDS)
    page.wait_for_timeout(500)  # typed text travels in the background
    page.get_by_role("button", name="Refine").click()
    return about


def _train(page: Page) -> None:
    open_tab(page, "Training")
    page.get_by_label("Maximum steps").fill("512")
    page.get_by_text("Record videos of the best").click()
    page.get_by_role("button", name="Start training").click()
    page.get_by_text("Plausibility checks").wait_for()
