"""A person's whole way through the page, in a real browser, with the real built-in team, validator and training."""

import http.server
import os
import threading
from pathlib import Path

import numpy as np
import pytest
from browser import Server, browsing, open_tab, shoot
from made import SCRIPT, made_export, made_run, made_training
from playwright.sync_api import Locator, Page, WebSocket, expect
from robots import arm

import aidsr
from aidsr.runs import Library, Run

PICTURES = "AIDSR_SCREENSHOTS" in os.environ
"""Whether pictures for the docs are taken: then the words are harmless and the training learns something."""
WISH = "make it a little longer" if PICTURES else f"make it longer {SCRIPT}"
STEPS = 30_000 if PICTURES else 512


def test_from_an_empty_home_to_a_trained_design(runs: Path, server: Server) -> None:
    with browsing(webgl=PICTURES) as visitor:
        page = visitor.new_page()
        page.goto(server.address())
        page.get_by_role("button", name="Set up a run").click()
        page.get_by_label("Number of concepts").fill("1")
        page.wait_for_timeout(500)  # a number travels in the background
        page.get_by_role("button", name="Start the run").click()
        page.wait_for_url("**/run/*")
        (run,) = Library(runs).runs()

        page.get_by_text("Two-section").first.wait_for()
        page.reload()  # while it works
        page.get_by_role("button", name="Review").click()
        words = page.get_by_label("What should change?")
        words.fill(WISH)
        page.wait_for_timeout(500)  # typed text travels in the background

        page.goto("about:blank")  # an open page reloads itself when its server is back, and would race the next line
        server.restart()
        page.goto(server.address(f"/run/{run.path.name}/1"))
        expect(words).to_have_value(WISH)
        shoot(page, "review")
        page.get_by_role("button", name="Refine").click()
        page.get_by_text("round 2, your request").wait_for()
        decision = run.design(1).iteration(1).decision.read()
        assert decision is not None
        assert decision.text == WISH

        other_tab = visitor.new_page()
        other_tab.goto(page.url)
        other_tab.get_by_role("button", name="Approve").click()
        expect(page.locator("h1 + .badge")).to_have_text("approved")
        assert run.design(1).final_scene.path.exists()
        other_tab.close()

        _train(page)
        page.goto(server.address())
        expect(page.get_by_text("1 of 1 approved")).to_be_visible()
        assert page.evaluate("window.stolen") is None


def _train(page: Page) -> None:
    open_tab(page, "Training")
    page.get_by_label("Maximum steps").fill(str(STEPS))
    page.get_by_text("Record videos of the best").click()
    page.get_by_role("button", name="Start training").click()
    page.get_by_text("Training 1").wait_for()
    page.reload()  # while it learns
    page.get_by_text("Plausibility checks").wait_for()
    expect(page.get_by_text("All 100 held-out episodes")).to_be_visible()
    page.get_by_role("button", name="Plausible", exact=True).click()
    page.get_by_text("You confirmed the motion.").wait_for()
    expect(page.get_by_role("button", name="Replay best")).to_be_visible()
    if PICTURES:  # only then the browser draws in three dimensions
        page.get_by_role("button", name="Replay best").click()
        expect(page.locator(".v3d-clock b")).to_contain_text("of training 1")
    shoot(page, "training", whole=True)


def test_hostile_text_is_inert_in_a_real_browser(runs: Path, server: Server) -> None:
    run = made_run(runs, name=SCRIPT, objective=SCRIPT, task="", model=f"x:{SCRIPT}", waiting=True, designs=1)
    with browsing() as visitor:
        page = visitor.new_page()
        for path in ("/", f"/run/{run.path.name}", f"/run/{run.path.name}/1", f"/run/{run.path.name}/1?iteration=1"):
            page.goto(server.address(path))
            page.get_by_text("<script>").first.wait_for()
            for tab in ("MJCF", "Concept", "Side by side", "Log"):
                if page.get_by_role("tab", name=tab).count():
                    open_tab(page, tab)
                    page.get_by_text("script").first.wait_for()
            if path != "/":
                asked = page.get_by_text("called made:up").filter(visible=True)  # titles of the chart are not
                asked.first.wait_for()
                for number in range(asked.count()):
                    asked.nth(number).click()
            assert page.evaluate("window.stolen") is None
            assert page.locator("img[src=x]").count() == 0


def test_another_site_reaches_nothing(runs: Path, server: Server) -> None:
    made_run(runs)
    stranger = http.server.ThreadingHTTPServer(("127.0.0.1", 0), http.server.SimpleHTTPRequestHandler)
    threading.Thread(target=stranger.serve_forever, daemon=True).start()
    address = f"127.0.0.1:{server.port}"
    opened = f"""() => new Promise((done) => {{
      const socket = new WebSocket("ws://{address}/_nicegui_ws/socket.io/?EIO=4&transport=websocket");
      socket.onopen = () => done("open"); socket.onerror = () => done("refused");
    }})"""
    fetched = f"() => fetch('http://{address}/', {{mode: 'no-cors'}}).then(() => 'read', () => 'refused')"
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address("/assets/icon.svg"))
        assert page.evaluate(opened) == "open"  # from its own pages it works
        page.goto(f"http://127.0.0.1:{stranger.server_port}/")
        assert page.evaluate(opened) == "refused"
        assert page.evaluate(fetched) == "refused"
    stranger.shutdown()
    stranger.server_close()


def test_the_token_opens_the_web_app_and_another_does_not(runs: Path) -> None:
    with Server.over(runs, token="correct-horse-battery") as server, browsing() as visitor:
        page = visitor.new_page()
        for token in ("wrong", server.token):
            page.goto(server.address())
            page.get_by_label("Token").fill(token)
            page.get_by_role("button", name="Sign in").click()
            said = page.get_by_role("alert") if token == "wrong" else page.get_by_text("New run").first
            expect(said).to_be_visible()


def test_without_webgl_a_design_is_a_still_picture_and_a_sentence(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.path.name}/1"))
        page.get_by_text("The interactive view needs WebGL").wait_for()
        picture = page.locator(".v3d-still img")
        assert picture.evaluate("image => image.decode().then(() => image.naturalWidth)") == 1
        assert page.get_by_text("Preparing the model").count() == 0


def test_a_design_is_drawn_without_complaints_of_the_browser(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        complaints: list[str] = []
        page.on("console", lambda said: complaints.append(said.text) if "THREE" in said.text else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(server.address(f"/run/{run.path.name}/1"))
        page.get_by_text("squares of").wait_for()
        assert not complaints


def test_an_episode_is_replayed_though_the_view_was_out_of_sight(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    finger = """<mujoco><worldbody><body name="robot/finger"><joint name="robot/bend" axis="0 1 0" damping="0.1"/>
      <geom type="capsule" size="0.01" fromto="0 0 0 0 0 0.2"/></body></worldbody></mujoco>"""
    run.design(1).iteration(2).scene.xml.path.write_text(finger)
    folder = made_training(run.design(1))
    np.savez(folder / "best.npz", qpos=np.linspace(0, 1, 500).reshape(-1, 1), frame_s=0.02, mjcf="")
    with browsing(webgl=True, viewport={"width": 1000, "height": 700}) as visitor:
        page = visitor.new_page()
        views: list[WebSocket] = []
        page.on("websocket", lambda socket: views.append(socket) if "/view3d/" in socket.url else None)
        page.goto(server.address(f"/run/{run.path.name}/1"))
        page.get_by_text("squares of").wait_for()
        open_tab(page, "Training")
        replay = page.get_by_role("button", name="Replay best")
        replay.wait_for()
        page.evaluate("scrollTo(0, document.body.scrollHeight)")
        if not views[0].is_closed():  # nothing is simulated while nobody looks
            views[0].wait_for_event("close")
        replay.click()
        expect(page.locator(".v3d-clock b")).to_have_text("Episode: best of training 1")


def test_printed_parts_are_drawn_and_pointed_at(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    made_export(run.design(1))
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        complaints: list[str] = []
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(server.address(f"/run/{run.path.name}/1"))
        page.get_by_role("button", name="Export").click()
        page.get_by_text("squares of 1 cm").wait_for()
        expect(page.locator(".v3d-letter")).to_have_text("A")
        page.get_by_role("button", name="A", exact=True).click()
        page.get_by_text("2 × tip, 12 g, 20 × 20 × 20 mm").wait_for()
        with visitor.expect_page() as opened:
            page.get_by_role("link", name="Assembly sheet").click()
        sheet = opened.value
        sheet.get_by_text("How to build it").wait_for()
        assert sheet.evaluate("window.stolen") is None
        assert not complaints


@pytest.mark.parametrize("width", [390, 820, 1280, 1920])
def test_pages_fit_phones_tablets_and_wide_screens(runs: Path, server: Server, width: int) -> None:
    run = made_run(runs, waiting=True, task="", objective="Turn" + "ing" * 300)
    with browsing(viewport={"width": width, "height": 1000}) as visitor:
        page = visitor.new_page()
        made_export(run.design(2))
        made = f"/run/{run.path.name}"
        for path in ("/", "/new", made, f"{made}/1", f"{made}/2", f"{made}/2/export"):
            page.goto(server.address(path))
            page.get_by_role("link", name="AID-SR").wait_for()
            assert page.evaluate("document.documentElement.scrollWidth") <= width, path
            assert all(one["height"] < 120 for one in map(Locator.bounding_box, page.locator("h1").all()) if one), path
        page.goto(server.address())
        for seen in (page.get_by_text("waiting", exact=True), page.get_by_role("button", name="Delete")):
            place = seen.first.bounding_box()
            assert place
            assert 0 <= place["x"] <= width - place["width"]


@pytest.mark.parametrize("width", [390, 1280])
def test_low_views_show_all_their_buttons(arm_run: Run, server: Server, width: int) -> None:
    design = f"design={arm_run.name}/1"
    made = made_run(arm_run.path.parent, designs=1, started="2026-02-01T10:00:00+00:00")
    made.design(1).iteration(2).scene.xml.path.write_text(arm())
    with browsing(webgl=True, viewport={"width": width, "height": 900}) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/compare?{design}&design={made.name}/1"))
        page.locator(".v3d-tools").nth(1).wait_for()
        for label in ("Fit robot in view", "Save a picture", "Full screen"):
            shown = page.get_by_label(label).first.bounding_box()
            stage = page.locator(".v3d-picture").first.bounding_box()
            assert shown
            assert stage
            assert stage["y"] <= shown["y"] <= stage["y"] + stage["height"] - shown["height"], label


def test_the_page_is_used_by_keyboard(runs: Path, server: Server) -> None:
    made_run(runs, waiting=True)
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address())
        page.get_by_text("button pushing").wait_for()
        page.keyboard.press("/")
        page.keyboard.type("nothing of the kind")
        page.get_by_text("None of 1 runs matches").wait_for()
        page.keyboard.press("Tab")
        page.evaluate("document.activeElement.blur()")
        page.keyboard.press("n")
        page.wait_for_url("**/new")
        page.get_by_role("radio", name="tunnel").focus()
        page.keyboard.press("Enter")
        expect(page.get_by_role("radio", name="tunnel")).to_have_attribute("aria-checked", "true")


@pytest.mark.skipif(not PICTURES, reason="pictures for the docs are only taken when wanted")
def test_pictures_for_the_docs(runs: Path, server: Server) -> None:
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        page.goto(server.address())
        shoot(page, "empty")
        page.get_by_role("button", name="Three robots that push a button").click()
        page.wait_for_url("**/run/*")
        page.locator("img.shot").first.wait_for()
        shoot(page, "watch")
        page.locator("h1 + .badge.finished").wait_for()
        run = page.url
        open_tab(page, "Side by side")
        shoot(page, "compare")
        page.goto(f"{run}/2")
        page.wait_for_timeout(5000)  # the view in three dimensions begins to move
        shoot(page, "design")
        page.get_by_role("button", name="Export").click()
        page.get_by_role("button", name="Export").click()
        page.get_by_text("squares of").wait_for()
        shoot(page, "export", whole=True)
        page.goto(server.address("/new"))
        for picture in page.locator("img.task").all():
            picture.evaluate("image => image.complete || new Promise(done => image.onload = done)")
        shoot(page, "setup", whole=True)
        aidsr.design(task="simple_grasping", concepts=2, seed=3, runs=runs)
        aidsr.design(task="tunnel", concepts=1, runs=runs)
        page.goto(server.address())
        page.get_by_text("tunnel", exact=True).wait_for()
        shoot(page, "home")
        page.goto(server.address("/designs"))
        page.get_by_role("checkbox").first.wait_for()
        shoot(page, "designs")
        page.goto(f"{run}/2?tab=probe")
        page.get_by_role("button", name="Start the probe").click()
        page.get_by_role("button", name="Replay motion of variation").first.click()
        page.locator(".v3d-track-name b").first.wait_for()
        page.get_by_role("button", name="best progress").click()
        page.set_viewport_size({"width": 1280, "height": 1160})
        shoot(page, "timeline")
        page.set_viewport_size({"width": 1280, "height": 900})
        page.goto(server.address("/new"))
        page.get_by_role("button", name="Start the run").click()
        page.get_by_role("button", name="Review").first.wait_for()
        waiting = page.url
        page.goto(f"{run}/2?tab=training")
        page.get_by_role("button", name="Start training").click()
        page.goto(server.address("/work"))
        page.get_by_text("of 300,000 steps").wait_for()
        shoot(page, "work")
        page.get_by_role("button", name="Stop").last.click()
        page.goto(waiting)
        page.get_by_role("button", name="Stop").click()
        page.locator("h1 + .badge.stopped").wait_for()
