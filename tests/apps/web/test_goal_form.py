"""A goal begun from its kind, in the form for a new run."""

from pathlib import Path

import pytest
from browser import Server, browsing, choose
from playwright.sync_api import expect

from aidsr.apps.web.goal_form import skeleton
from aidsr.examples import examples
from aidsr.sim.environment_summary import summarize_environment
from aidsr.tasks.goals.reading import KINDS, parse_goal


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_begins_with_keys_that_can_be_read(kind: str) -> None:
    environment = examples()["gate"].environment
    begun = skeleton(kind, summarize_environment(environment))
    goal = parse_goal(begun)
    assert goal.kind == kind
    assert "hold_s = 0.5" in begun
    uncommented = "\n".join(line.removeprefix("# ") for line in begun.splitlines())
    assert parse_goal(uncommented).hold_s == goal.hold_s, "what is commented out are its defaults"
    assert "…" not in begun, "names of the environment stand in it"


def test_a_goal_is_begun_from_its_kind_and_checked(runs: Path, server: Server) -> None:
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address("/new?template=valve"))
        field = page.get_by_label("Goal (TOML)")
        expect(field).to_have_value(examples()["valve"].goal)
        expect(page.locator(".chip", has_text="stem: hinge about 0 0 1, 0 to 95 deg")).to_be_visible()
        kind = page.get_by_label("Kind of goal", exact=True)
        expect(kind).to_have_value("turn")  # the template's
        choose(page, "Kind of goal", "lift")
        page.get_by_role("button", name="Insert template").click()
        expect(field).to_have_value(skeleton("lift", summarize_environment(examples()["valve"].environment)))
        field.fill('kind = "turn"\njoint = "stem"\nby_deg = 100')
        expect(kind).to_have_value("turn")
        expect(page.get_by_text("its range ends after 95 deg")).to_be_visible()
        page.get_by_role("button", name="Undo").click()
        expect(field).to_have_value(examples()["valve"].goal)
        expect(page.get_by_text("its range ends after 95 deg")).to_be_hidden()
