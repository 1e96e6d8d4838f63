"""Episodes over time, in a real browser: tracks, events, and what a person did with the live simulation."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from browser import Server, browsing, open_tab
from made import made_training
from playwright.sync_api import Page, expect

import aidsr
from aidsr.apps.web.recorded_episodes import kept_recording
from aidsr.apps.web.site import Site
from aidsr.runs import Run
from aidsr.runs.files import replace_file
from aidsr.runs.trainings import trainings_of

LOOK = "Object.values(document.querySelector('.v3d-picture').viewer.camera.position)"


def tracks(page: Page) -> list[str]:
    return page.locator(".v3d-track-name b").all_inner_texts()


def test_any_held_out_episode_is_seen_with_its_cables_and_contacts(runs: Path, arm_run: Run, server: Server) -> None:
    folder = made_training(arm_run.design(1), (True, False, True))
    replace_file(folder / "policy.zip", b"the recording below is kept, so that this is not read")
    kept = kept_recording(Site.at(runs), trainings_of(arm_run.design(1))[0], 2)
    kept.parent.mkdir(parents=True)
    rows, facts = 60, {"frame_s": 0.01, "mjcf": "", "ended": "succeeded", "variation": 2}
    touching = [[row, 0, 0, 0.1, 0, 0, 2.0] for row in range(30, 40)]
    np.savez(
        kept, qpos=np.zeros((rows, 24)), tension_n=np.ones((rows, 4)), ctrl=np.zeros((rows, 4)),
        progress=np.linspace(0, 1, rows), contacts=touching, **facts,
    )  # fmt: skip
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{arm_run.name}/1?tab=training"))
        page.get_by_text("squares of").wait_for()
        open_tab(page, "Training")
        page.get_by_text("All 3 held-out episodes").click()
        page.get_by_role("button", name="Replay episode 2").click()
        expect(page.locator(".v3d-clock b")).to_have_text("Episode: 2 of training 1")
        page.get_by_role("button", name="first contact").click()
        expect(page.locator(".v3d-clock")).to_contain_text("0.30 s")
        for knob in page.locator(".v3d .q-slider__thumb").all():  # one that glides never catches up with an episode
            expect(knob).to_have_css("transition-duration", "0s")
        assert tracks(page) == ["cable tension", "contact force", "progress", "command"]
        expect(page.locator(".v3d-key", has_text="all contacts")).to_contain_text("2 N")
        page.get_by_label("3-D view of").press(".")
        expect(page.locator(".v3d-clock")).to_contain_text("0.31 s")
        charts = page.locator(".v3d-track svg")
        expect(charts).to_have_count(4)
        page.get_by_role("button", name="command").click()
        expect(page.get_by_role("button", name="command")).to_have_attribute("aria-expanded", "false")
        expect(charts).to_have_count(3)
        page.reload()
        page.get_by_text("squares of").wait_for()
        page.get_by_text("All 3 held-out episodes").click()
        page.get_by_role("button", name="Replay episode 2").click()
        expect(charts).to_have_count(3)


def test_frames_inertia_and_contact_forces_are_drawn_on_request(arm_run: Run, server: Server) -> None:
    drawn = """() => {
        const { bodies, forces } = document.querySelector('.v3d-picture').viewer;
        return [forces.group.visible, bodies.frames.visible, bodies.inertia.visible];
    }"""
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{arm_run.name}/1"))
        page.get_by_text("squares of").wait_for()
        assert page.evaluate(drawn) == [True, False, False]
        page.get_by_role("button", name="Display options").click()
        page.get_by_role("menuitemcheckbox", name="Contact forces").click()
        expect(page.get_by_role("menuitemcheckbox", name="Contact forces")).to_have_attribute("aria-checked", "false")
        page.keyboard.press("Escape")
        for key in ("e", "i"):
            page.get_by_label("3-D view of").press(key)
        assert page.evaluate(drawn) == [False, True, True]


def test_motions_of_a_probe_are_seen_with_their_cables_and_progress(runs: Path, server: Server) -> None:
    run = aidsr.design(task="button_pushing", seed=1, concepts=1, runs=runs)
    design = run.design(1)
    report = aidsr.probe(design.path, candidates=16, variations=2, threads=1)
    replace_file(design.path / "probe.json", report.model_dump_json().encode())
    best = max((0, 1), key=lambda index: report.variations[index].episode.best_progress)
    probed = report.variations[best].episode
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.name}/1?tab=probe"))
        page.get_by_text("squares of").wait_for()
        expect(page.get_by_role("button", name="Show the target")).to_have_attribute("aria-pressed", "true")
        expect(page.get_by_role("button", name="Probe again")).to_be_visible()
        page.get_by_role("button", name=f"Replay motion of variation {probed.variation}").click()
        expect(page.locator(".v3d-clock b")).to_have_text(f"Episode: {probed.variation} of the probe")
        expect(page.locator(".v3d-track-name b").first).to_be_visible()
        assert [name for name in tracks(page) if name in ("cable tension", "progress", "command")] == [
            "cable tension",
            "progress",
            "command",
        ]
        page.get_by_role("button", name=f"best progress, {probed.best_progress:.2f}").click()
        expect(page.locator(".v3d-track-name").last).to_contain_text(
            re.compile(r"9 lines, current maximum [\d.]+ %, pull_")
        )


def test_what_a_person_did_is_looked_back_at_and_distances_are_measured(arm_run: Run, server: Server) -> None:
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{arm_run.name}/1"))
        page.get_by_text("squares of").wait_for()
        page.locator(".v3d-row .q-slider").first.click()
        page.wait_for_timeout(1500)
        page.get_by_role("button", name="Replay").click()
        expect(page.locator(".v3d-clock b")).to_have_text("Your recording")
        expect(page.locator(".v3d-track-name b").first).to_have_text("cable tension")
        for key, along in (("1", 0), ("2", 1), ("3", 2)):
            page.get_by_label("3-D view of").press(key)
            arm_from = page.evaluate("Object.values(document.querySelector('.v3d-picture').viewer.whence()[1])")
            assert arm_from[along] == pytest.approx(sum(abs(each) for each in arm_from), rel=0.01)
        page.get_by_label("3-D view of").press("f")
        page.get_by_role("button", name="Measure between two points").click()
        expect(page.get_by_text("Click two points")).to_be_visible()
        stage = page.locator(".v3d-picture canvas").bounding_box()
        assert stage
        seen_from = page.evaluate(LOOK)
        spots = page.evaluate("""[2, 6].map((index) => {
            const { viewer } = document.querySelector('.v3d-picture');
            const e = viewer.shapes.meshes.filter((one) => one?.userData.part.kind === 'geom')[index].matrix.elements;
            return { ...viewer.project(e[12], e[13], e[14]), at: [e[12], e[13], e[14]] };
        })""")
        for spot in spots:
            page.mouse.click(stage["x"] + spot["x"], stage["y"] + spot["y"])
        page.mouse.move(stage["x"] + 10, stage["y"] + 10)
        page.wait_for_timeout(500)
        assert page.evaluate(LOOK) == pytest.approx(seen_from), "the camera stays where it is"
        apart_mm = 1000 * math.dist(*(spot["at"] for spot in spots))
        measured = page.locator(".v3d-measured")
        expect(measured).to_have_text(re.compile(r"^\d+(\.\d+)? mm$"))
        told = measured.inner_text()
        assert float(told.removesuffix(" mm")) == pytest.approx(apart_mm, rel=0.1)  # on the skin, not in the middle
