"""A study from its form to a run of it, in a real browser."""

import re
from pathlib import Path

from browser import Server, browsing, shoot
from playwright.sync_api import expect

from aidsr.studies.study import open_study


def test_a_study_is_started_watched_and_opened_down_to_a_run(runs: Path, server: Server) -> None:
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address("/work"))
        page.get_by_role("link", name="New study").click()
        estimated = page.locator(".facts > div", has_text="on this machine")
        expect(estimated).to_contain_text(re.compile(r"about \d+ h"))  # of all tasks, before anything is pressed
        page.get_by_role("button", name="Start the study").click()
        expect(page.get_by_role("alert")).to_contain_text("the study has no name")
        page.get_by_label("Study name").fill("first")
        for label, value in (
            ("Designs per task and arm", "1"),
            ("Concepts per run", "1"),
            ("Policies per design", "0"),
        ):
            page.get_by_label(label).fill(value)
        page.get_by_label("Tasks", exact=True).click()
        page.get_by_role("option", name="all tasks").click()
        page.get_by_role("option", name="button pushing").click()
        page.keyboard.press("Escape")
        page.get_by_role("group", name="protocol").get_by_role("button", name="paper").click()
        page.get_by_text("Also probe each approved design").click()
        expect(estimated).to_contain_text(re.compile(r"about \d+(\.\d s| min)"))
        page.get_by_role("button", name="Start the study").click()
        page.wait_for_url("**/study/first")
        expect(page.get_by_text("1 of 1 approved")).to_be_visible()
        expect(page.get_by_role("button", name="Stop")).to_be_hidden()
        expect(page.get_by_role("link", name="Report")).to_be_visible()
        shoot(page, "study")
        page.get_by_role("link", name="run 1, finished").click()
        expect(page.get_by_role("heading", name="button pushing", level=1)).to_be_visible()
        page.get_by_role("navigation").get_by_role("link", name="first").click()
        expect(page.get_by_role("heading", name="first", level=1)).to_be_visible()
    assert (runs / "first" / "report.html").is_file()
    assert open_study(runs / "first").plan.protocol == "paper"
