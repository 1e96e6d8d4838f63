"""All runs at once, in a real browser: what is at work, all designs in a table, and some of them side by side."""

import json
import re
from pathlib import Path

import pytest
from browser import Server, browsing, choose
from made import made_export, made_run, made_training
from playwright.sync_api import expect
from robots import arm, gripper

from aidsr.apps.web.site import Site
from aidsr.core.artifacts import ActuatorGroup
from aidsr.core.directory_lock import DirectoryLock
from aidsr.runs import EventLog
from aidsr.runs.events import StepStarted
from aidsr.runs.files import replace_file


def test_what_is_at_work_and_what_waits_stands_in_one_place(runs: Path, server: Server) -> None:
    run, site = made_run(runs, waiting=True), Site.at(runs)
    log = site.processes.folder / f"{site.training_name(run, 2)}.log"
    log.parent.mkdir(parents=True)
    folder = run.design(2).path / "training" / "001"
    replace_file(folder / "config.json", b'{"steps": 4000, "seed": 7}')
    rows = "steps,wall_s,episodes,success_share,progress,reward,diverged,steps_per_s\n1000,9,4,0.5,0.7,2.0,0,100\n"
    replace_file(folder / "curve.csv", rows.encode())
    with browsing() as visitor, EventLog(log):  # held as long as the process lives
        log.with_suffix(".json").write_text('{"pid": 0}')
        page = visitor.new_page()
        page.goto(server.address("/new"))
        expect(page).to_have_title("(1) New run · AID-SR")
        waits = page.get_by_role("link", name="1 waiting for you")
        expect(waits).to_have_attribute("title", re.compile("design 1: .*: waits for your decision"))
        waits.click()
        rows_shown = page.locator("table.work tbody tr")
        expect(rows_shown).to_have_count(2)
        expect(rows_shown.nth(0)).to_contain_text("waits for your decision")
        expect(rows_shown.nth(1)).to_contain_text("1,000 of 4,000 steps")
        expect(rows_shown.nth(1)).to_contain_text("about 30")
        expect(rows_shown.nth(1).get_by_role("button", name="Stop")).to_be_visible()
        replace_file(run.design(1).iteration(2).decision.path, b'{"verdict": "quit"}')
        replace_file(run.design(1).outcome.path, b'{"outcome": "quit", "reason": "given up", "iteration": 2}')
        expect(page).to_have_title("Activity · AID-SR")
        expect(rows_shown).to_have_count(1)


def test_a_training_from_a_terminal_is_at_work_and_says_that_it_is_evaluated(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    folder = run.design(1).path / "training" / "001"
    replace_file(folder / "config.json", b'{"steps": 4000, "seed": 7}')
    rows = "steps,wall_s,episodes,success_share,progress,reward,diverged,steps_per_s\n1000,9,4,0.5,0.7,2.0,0,100\n"
    replace_file(folder / "curve.csv", rows.encode())
    address = f"/run/{run.name}/1?tab=training"
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(address))
        state = page.get_by_role("article").locator(".badge")
        expect(state).to_have_text("stopped")
        lock = DirectoryLock(folder)  # as `aidsr train` holds it
        expect(state).to_have_text("running")
        expect(page.get_by_text("Started by another process")).to_be_visible()
        expect(page.get_by_role("button", name="Start training")).to_have_count(0)
        page.goto(server.address("/work"))
        row = page.locator("table.work tbody tr")
        expect(row).to_contain_text("1,000 of 4,000 steps")
        expect(row.get_by_role("button", name="Stop")).to_have_count(0)
        replace_file(folder / "training.json", b'{"steps": 4000}')
        expect(row).to_contain_text("evaluating the policy")
        page.goto(server.address(address))
        expect(state).to_have_text("evaluating")
        lock.release()
        expect(state).to_have_text("not evaluated")
        expect(page.get_by_role("button", name="Start training")).to_be_visible()


def test_a_run_at_work_says_how_long_it_takes_as_those_before(runs: Path, server: Server) -> None:
    before, run = made_run(runs, designs=2), made_run(runs, designs=2, started="2026-02-01T10:00:00+00:00")
    begun, ended = "2026-01-31T10:00:00+00:00", "2026-01-31T10:10:00+00:00"
    for number in (1, 2):
        lines = before.design(number).events.read_text().splitlines()
        events = [json.loads(line) | {"time": ended if index else begun} for index, line in enumerate(lines)]
        before.design(number).events.write_text("".join(f"{json.dumps(event)}\n" for event in events))
    (run.design(1).path / "outcome.json").unlink()
    with browsing() as visitor, EventLog(run.events), EventLog(run.design(1).events) as log:
        log.write(StepStarted(step="robot", iteration=2))
        page = visitor.new_page()
        page.goto(server.address("/work"))
        row = page.locator("table.work tbody tr")
        expect(row).to_contain_text("1 of 2 designs finished; the Coder writes the robot")
        expect(row).to_contain_text("about 9 min")
        expect(row.get_by_role("progressbar", name="50 % done")).to_be_visible()


def test_a_probe_at_work_is_listed_and_leads_to_its_tab(runs: Path, server: Server) -> None:
    run, site = made_run(runs, designs=1), Site.at(runs)
    log = site.processes.folder / f"{site.probe_name(run, 1)}.log"
    log.parent.mkdir(parents=True)
    with browsing() as visitor, EventLog(log):
        log.with_suffix(".json").write_text('{"pid": 0}')
        page = visitor.new_page()
        page.goto(server.address("/work"))
        expect(page.locator("table.work tbody tr")).to_contain_text("trying motions")
        page.get_by_role("link", name="design 1: Arm 1").click()
        expect(page.get_by_role("tab", name="Probe")).to_have_attribute("aria-selected", "true")
        page.get_by_text("Trying open-loop motions.").wait_for()


def test_designs_of_all_runs_are_filtered_sorted_and_compared(runs: Path, server: Server) -> None:
    first = made_run(runs, name="Arm", designs=2)
    made_run(runs, name="Worm", task="locomotion/tunnel", designs=1, started="2026-02-01T10:00:00+00:00")
    for number, won in ((1, (True, False)), (2, (True, True))):
        made_training(first.design(number), won)
        made_export(first.design(number))
        first.design(number).iteration(2).scene.xml.path.write_text(arm())
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        page.goto(server.address("/designs"))
        names = page.locator("table.designs tbody td a")
        expect(names).to_have_text(["1. Worm 1", "1. Arm 1", "2. Arm 2"])
        page.get_by_role("button", name="held-out success").click()
        expect(names).to_have_text(["2. Arm 2", "1. Arm 1", "1. Worm 1"])
        choose(page, "task", "tunnel")
        expect(names).to_have_text(["1. Worm 1"])
        choose(page, "task", "all")
        plot = page.get_by_role("region", name="success against")
        expect(plot.get_by_role("button")).to_have_text(["tokens", "actuators", "moving mass [g]", "printed parts"])
        expect(plot.get_by_role("img", name="held-out success against tokens")).to_be_visible()
        plot.get_by_role("button", name="printed parts").click()
        expect(plot.get_by_role("img", name="held-out success against printed parts").locator("circle")).to_have_count(
            2
        )
        page.get_by_role("checkbox", name="compare Arm 1").click()
        page.get_by_role("checkbox", name="compare Arm 2").click()
        page.get_by_role("button", name="Compare", exact=True).click()
        page.wait_for_url("**/compare?**", wait_until="commit")
        expect(page.get_by_text("squares of")).to_have_count(2)
        expect(page.get_by_text("No differences.")).to_be_visible()
        expect(page.get_by_text("a tapering arm").first).to_be_visible()
        look = "[...document.querySelectorAll('.v3d-picture')].map((one) => one.viewer.whence()[1].x)"
        drawn = "[...document.querySelectorAll('.v3d-picture')].every((one) => one.viewer && one.viewer.facts)"
        page.wait_for_function(drawn)
        before = page.evaluate(look)
        assert before[0] == pytest.approx(before[1], rel=1e-3)
        page.get_by_label("3-D view of 1. Arm 1").press("ArrowLeft")
        page.wait_for_function(drawn)
        after = page.evaluate(look)
        assert after[0] != pytest.approx(before[0], rel=1e-3)
        assert after[1] == pytest.approx(after[0], rel=1e-3)


def test_a_comparison_sees_each_robot_whole_whatever_its_size(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=2)
    for number, robot in ((1, arm()), (2, gripper())):
        run.design(number).iteration(2).scene.xml.path.write_text(robot)
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/compare?design={run.name}/1&design={run.name}/2"))
        expect(page.get_by_text("squares of")).to_have_count(2)
        page.get_by_label("3-D view of 1. Arm 1").press("ArrowLeft")
        away = page.evaluate("""[...document.querySelectorAll('.v3d-picture')].map(({ viewer }) =>
            viewer.camera.position.distanceTo(viewer.controls.target) / viewer.facts.camera.distance)""")
        lengths = page.evaluate("""[...document.querySelectorAll('.v3d-picture')].map(({ viewer }) =>
            viewer.facts.camera.distance / viewer.facts.length_m)""")
        assert lengths[0] != pytest.approx(lengths[1], rel=0.2), "they fill the view at different distances"
        assert away == pytest.approx([1.0, 1.0], rel=0.05)


def test_a_comparison_of_nothing_offers_designs(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=2)
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/compare?design={run.name}/2"))
        expect(page.get_by_text("Select two to four designs of any runs.")).to_be_visible()
        expect(page.get_by_role("checkbox", name="compare Arm 2")).to_be_checked()
        page.get_by_role("checkbox", name="compare Arm 1").click()
        page.get_by_role("button", name="Compare", exact=True).click()
        expect(page.get_by_role("heading", name="Differences in the MJCF")).to_be_visible()


def test_a_fifth_design_is_not_picked_and_the_bar_says_so(runs: Path, server: Server) -> None:
    made_run(runs, designs=5)
    with browsing(viewport={"width": 1440, "height": 900}) as visitor:
        page = visitor.new_page()
        page.goto(server.address("/designs"))
        bar = page.get_by_role("status").filter(has_text="selected")
        for number in range(1, 5):
            page.get_by_role("checkbox", name=f"compare Arm {number}").click()
            expect(bar).to_contain_text(f"{number} of 4 selected")
        width = page.locator("table.designs").bounding_box()
        fifth = page.get_by_role("checkbox", name="compare Arm 5")
        fifth.click()
        expect(bar).to_contain_text("4 of 4 selected; deselect one before you select another.")
        expect(fifth).not_to_be_checked()
        assert page.locator("table.designs").bounding_box() == width
        page.get_by_role("checkbox", name="compare Arm 4").click()
        expect(bar).to_contain_text("3 of 4 selected.")
        fifth.click()
        expect(bar).to_contain_text("4 of 4 selected.")


def test_a_comparison_groups_actuators_as_the_design_itself(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=2)
    mjcf = gripper()
    bend = ActuatorGroup(name="bend", actuators=tuple(re.findall(r'name="([^"]+)" tendon=', mjcf)[:2]))
    assert len(bend.actuators) == 2
    for number in (1, 2):
        design = run.design(number).iteration(2)
        design.scene.xml.path.write_text(mjcf)
        about = json.loads((design.path / "robot.json").read_text())
        replace_file(design.path / "robot.json", json.dumps(about | {"actuator_groups": [bend.model_dump()]}).encode())
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.name}/1"))
        expect(page.locator(".v3d-group .v3d-name")).to_have_text(["bend"])
        head = page.locator(".v3d-head b")
        expect(head).to_have_text(["Pull the tendons"])
        group = page.locator(".v3d-group")
        expect(group.locator(".v3d-value")).to_have_text("0 N")
        group.locator('[tabindex="0"]').press("PageUp")  # Quasar focuses the track, not the element of the role
        expect(group.locator(".v3d-value")).to_have_text(re.compile(r"0\.\d+ N|[1-9]\S* N"))
        page.goto(server.address(f"/compare?design={run.name}/1&design={run.name}/2"))
        expect(page.locator(".v3d-group .v3d-name")).to_have_text(["bend", "bend"])


def test_a_group_stays_together_and_says_what_each_member_does(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    design = run.design(1).iteration(2)
    cables = re.findall(r'<motor name="([^"]+)"', gripper())
    joint = re.search(r'<joint name="([^"]+)"', gripper())
    assert joint
    mjcf = gripper().replace("</actuator>", f'<motor name="extra" joint="{joint[1]}" ctrlrange="0 1"/></actuator>')
    design.scene.xml.path.write_text(mjcf)
    groups = [
        ActuatorGroup(name="bend", actuators=tuple(cables[:2])),
        ActuatorGroup(name="mixed", actuators=(cables[2], "extra")),
    ]
    about = json.loads((design.path / "robot.json").read_text())
    about |= {"actuator_groups": [group.model_dump() for group in groups]}
    replace_file(design.path / "robot.json", json.dumps(about).encode())
    with browsing(webgl=True) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.name}/1"))
        names = page.locator(".v3d-name")
        expect(names).to_have_text(["bend", *cables[:2], "mixed", cables[2], "extra", *cables[3:]])
        expect(page.locator(".v3d-head b")).to_have_text(["Pull the tendons"])
        value = page.locator(".v3d-row .v3d-value")
        expect(value.nth(0)).to_have_text("0 N")
        page.locator(".v3d-row").nth(1).locator('[tabindex="0"]').press("PageUp")
        expect(value.nth(1)).not_to_have_text("0 N")
        expect(value.nth(2)).to_have_text("0 N")
        # Both are read at once: the slider may still be on its way to its place.
        page.wait_for_function(
            """() => {
                const [group, pulled] = document.querySelectorAll(".v3d-row .v3d-value");
                return group.innerText === "0 to " + pulled.innerText;
            }"""
        )
