"""What a person who works with the page all day would stumble over, in a real browser."""

import io
import re
import shutil
from pathlib import Path

import av
import numpy as np
from browser import PATIENCE_MS, Server, browsing, open_tab
from made import MJCF, concept, made_run, made_training
from PIL import Image
from playwright.sync_api import Response, expect
from test_studies_panel import made_study

from aidsr.apps.web.site import Site
from aidsr.core.artifacts import Evaluation, Fault, MeanAction, PlausibilityCheck, ValidationReport
from aidsr.core.calls import CallRecord
from aidsr.runs import EventLog
from aidsr.runs.events import StepStarted
from aidsr.runs.files import JsonFile, replace_file


def test_a_robot_to_start_from_is_named_and_used_once(runs: Path, server: Server) -> None:
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address("/new"))
        begins = page.get_by_text("The run starts from your robot: mine.xml")
        expect(begins).to_be_hidden()
        page.get_by_text("More settings", exact=True).click()
        page.locator("input[type=file]").last.set_input_files(
            {"name": "mine.xml", "mimeType": "text/xml", "buffer": MJCF.encode()}
        )
        expect(begins).to_be_visible()
        page.get_by_role("button", name="Start the run").click()
        page.wait_for_url("**/run/*")
        page.get_by_role("button", name="Stop").click()
        page.goto(server.address("/new"))
        page.get_by_role("button", name="Start the run").wait_for()
        expect(begins).to_be_hidden()


def test_a_training_at_work_is_seen_on_home_and_on_the_page_of_its_run(runs: Path, server: Server) -> None:
    run, site = made_run(runs), Site.at(runs)
    log = site.processes.folder / f"{site.training_name(run, 2)}.log"
    log.parent.mkdir(parents=True)
    with browsing() as visitor, EventLog(log):  # which is held as long as the process lives
        log.with_suffix(".json").write_text('{"pid": 0}')
        page = visitor.new_page()
        page.goto(server.address())
        expect(page.locator("tr .badge.training")).to_have_text("training")
        page.goto(server.address(f"/run/{run.path.name}"))
        page.get_by_text("Design 2, Arm 2, is being trained.").wait_for()
        page.get_by_role("button", name="Watch").click()
        expect(page.get_by_role("tab", name="Training")).to_have_attribute("aria-selected", "true")


def test_stop_keeps_the_focus_while_a_run_goes_on(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    (run.design(1).path / "outcome.json").unlink()
    with browsing() as visitor, EventLog(run.events), EventLog(run.design(1).events) as log:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.path.name}"))
        stop = page.get_by_role("button", name="Stop")
        stop.focus()
        log.write(StepStarted(step="robot", iteration=2))
        page.get_by_text("the Coder writes the robot").wait_for()
        log.write(StepStarted(step="critique", iteration=2))
        page.get_by_text("the Judge reviews the scene").wait_for()
        expect(stop).to_be_focused()


def test_quit_asks_first_and_an_error_stands_once_beside_its_button(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1, waiting=True)
    with browsing() as visitor, EventLog(run.events):
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.path.name}/1"))
        panel = page.get_by_role("region", name="your decision")
        for _ in range(3):
            panel.get_by_role("button", name="Refine").click()
        expect(panel.get_by_text("a refinement needs text")).to_have_count(1)
        panel.get_by_role("button", name="Close this message").click()
        expect(panel.get_by_text("a refinement needs text")).to_have_count(0)
        panel.get_by_role("button", name="Quit this design").click()
        expect(page.get_by_text("designs of the run continue")).to_be_visible()
        page.get_by_role("button", name="Cancel").click()
        assert not run.design(1).iteration(2).decision.path.exists()
        panel.get_by_role("button", name="Quit").click()
        page.get_by_role("button", name="Quit design").click()
        expect(page.get_by_role("button", name="Quit design")).to_be_hidden()
        decision = run.design(1).iteration(2).decision.read()
        assert decision is not None
        assert decision.verdict == "quit"


def test_a_hint_does_not_cover_the_error_that_its_button_brings(runs: Path, server: Server) -> None:
    run = made_run(runs, waiting=True, designs=1)
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.name}/1"))
        button = page.get_by_role("button", name="Refine")
        button.hover()
        hint = page.get_by_text("Sends your text to the Designer")
        expect(hint).to_be_visible()
        button.click()
        expect(page.locator(".trouble")).to_contain_text("a refinement needs text")
        expect(hint).to_be_hidden()


def test_a_number_out_of_bounds_is_told_at_its_field(runs: Path, server: Server) -> None:
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address("/new"))
        for typed in ("99", "0", "2.5"):
            page.get_by_label("Number of concepts").fill(typed)
            page.get_by_role("button", name="Start the run").click()
            expect(page.locator(".trouble")).to_contain_text("Number of concepts must be a whole number from 1 to 20")
            field = page.locator(".q-field", has=page.get_by_label("Number of concepts"))
            expect(field).to_contain_text("a whole number from 1 to 20")
            assert page.get_by_label("Number of concepts").input_value() == typed, "kept as it was typed"
            page.get_by_role("button", name="Close this message").click()
    assert not list(runs.glob("*/run.json"))


def test_an_earlier_iteration_has_its_own_title(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    run.design(1).iteration(2).concept.write(concept("Slimmer arm"))
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.path.name}/1?iteration=1"))
        expect(page.locator("h1")).to_have_text("1. Arm 1")
        page.get_by_role("link", name="Go to the current iteration, 2").click()
        expect(page.locator("h1")).to_have_text("1. Slimmer arm")


def test_a_search_does_not_outlive_its_page(runs: Path, server: Server) -> None:
    made_run(runs)
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address())
        page.get_by_label("Search runs").fill("nothing of the kind")
        page.get_by_text("None of 1 runs matches").wait_for()
        page.goto(server.address("/new"))
        page.goto(server.address())
        page.get_by_text("3 of 3 approved").wait_for()
        expect(page.get_by_label("Search runs")).to_have_value("")


def test_what_was_not_measured_does_not_hold(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    facts = {"limit": 0.1, "message": "too few successful episodes to tell"}
    checks = (
        PlausibilityCheck(name="needs_cables", passed=True, measured=None, **facts),
        PlausibilityCheck(name="energy", passed=True, measured=0.01, **facts),
    )
    made_training(run.design(1), (True,), checks)
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.path.name}/1?tab=training"))
        expect(page.locator(".check > .badge")).to_have_text(["not measured", "passed"])


def test_a_film_of_half_a_second_is_slowed_down(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    folder = made_training(run.design(1), (True,))
    replace_file(folder / "best.mp4", _film(frames=12, per_s=25))
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.path.name}/1?tab=training"))
        page.get_by_text("times real time").wait_for()
        film = page.locator("video")
        assert film.evaluate("film => film.playbackRate") < 0.2
        film.evaluate(
            "film => { film.onended = () => window.held = film.paused; film.currentTime = film.duration; film.play() }"
        )
        page.wait_for_function("window.held", timeout=PATIENCE_MS)  # its end stays for a while
        page.wait_for_function("!document.querySelector('video').paused", timeout=PATIENCE_MS)


def test_addresses_that_lead_nowhere_are_pages_of_ours(runs: Path, server: Server) -> None:
    made_run(runs)
    with browsing() as visitor:
        page = visitor.new_page()
        for address in ("/nowhere", "/files/no_run/preview.png", "/run/x/notanumber", "/download/no_run/1"):
            answer = page.goto(server.address(address))
            assert answer is not None
            assert answer.status == 404, address
            expect(page.get_by_role("heading", name="Page not found")).to_be_visible()
            expect(page.get_by_role("link", name="All runs")).to_be_visible()


def test_home_of_many_runs_sends_small_pictures(runs: Path, server: Server) -> None:
    picture = io.BytesIO()
    gradient = np.add.outer(np.arange(480) // 2, np.arange(640) // 3)[..., None] % 256
    speckle = np.random.default_rng(0).integers(0, 9, (480, 640, 3))
    Image.fromarray(np.clip(gradient + speckle, 0, 255).astype(np.uint8)).save(picture, "PNG")
    oldest = ""
    for number in range(56):
        run = made_run(runs, designs=1, started=f"2026-01-31T10:{number:02d}:00+00:00")
        replace_file(run.design(1).iteration(2).preview.path, picture.getvalue())
        oldest = oldest or run.path.name
    sizes: list[int] = []

    def weigh(answer: Response) -> None:
        if answer.request.resource_type == "image":
            sizes.append(int(answer.headers.get("content-length", 0)))

    with browsing() as visitor:
        page = visitor.new_page()
        page.on("response", weigh)
        page.goto(server.address(), wait_until="networkidle")
        assert len(sizes) < 40, "pictures out of sight wait"
        rows = page.locator("table.runs tbody tr")
        expect(rows).to_have_count(40)
        page.get_by_label("Search runs").fill(oldest)
        expect(rows).to_have_count(1)
        page.get_by_label("Search runs").fill("")
        page.get_by_text("Showing the newest 40 of 56 runs").wait_for()
        page.get_by_role("button", name="Show more").click()
        expect(rows).to_have_count(56)
        expect(page.get_by_role("button", name="Show more")).to_be_hidden()
        page.evaluate("""() => Promise.all([...document.querySelectorAll("img.thumb")].map((one) => {
            one.loading = "eager";
            return one.decode();
        }))""")
    assert len(sizes) >= 56
    assert sum(sizes) < 300_000


def _film(*, frames: int, per_s: int) -> bytes:
    content = io.BytesIO()
    with av.open(content, "w", "mp4") as film:
        stream = film.add_stream("libx264", rate=per_s)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for number in range(frames):
            shade = np.full((48, 64, 3), 20 * number, np.uint8)
            film.mux(stream.encode(av.VideoFrame.from_ndarray(shade, format="rgb24")))
        film.mux(stream.encode())
    return content.getvalue()


def test_the_view_stays_in_sight_beside_a_long_panel(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    made_training(run.design(1), [True] * 100)
    with browsing(viewport={"width": 1280, "height": 800}) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.path.name}/1?tab=training"))
        page.get_by_text("All 100 held-out episodes").click()
        last = page.get_by_role("cell", name="99", exact=True)
        last.hover()  # waits until the table is open, and scrolls
        expect(last).to_be_in_viewport()
        expect(page.locator(".view")).to_be_in_viewport(ratio=0.6)


def test_a_run_that_waits_opens_on_what_it_waits_for(runs: Path, server: Server) -> None:
    done, waits = made_run(runs), made_run(runs, waiting=True, started="2026-02-01T10:00:00+00:00")
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{done.name}"))
        open_tab(page, "Log")
        page.wait_for_timeout(500)  # which tab is open travels in the background
        page.goto(server.address(f"/run/{waits.name}"))
        expect(page.get_by_role("tab", name="Designs")).to_have_attribute("aria-selected", "true")
        page.goto(server.address(f"/run/{done.name}"))
        expect(page.get_by_role("tab", name="Log")).to_have_attribute("aria-selected", "true")


def test_in_one_column_a_decision_comes_before_what_is_only_read(runs: Path, server: Server) -> None:
    run = made_run(runs, waiting=True)
    with browsing(viewport={"width": 390, "height": 844}) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.name}/1"))
        decision = page.get_by_role("region", name="your decision").bounding_box()
        iterations = page.get_by_role("region", name="iterations").bounding_box()
        assert decision
        assert iterations
        assert decision["y"] < iterations["y"]


def test_a_prompt_is_compared_with_the_one_before(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    calls = run.design(1).iteration(2).path / "calls"
    first = JsonFile(calls / "0001_coder.json", CallRecord).read()
    assert first is not None
    asked = first.question.messages[0].model_copy(update={"text": "Write it thinner.\n<script>stolen = 1</script>"})
    question = first.question.model_copy(update={"messages": (asked,)})
    later = first.model_copy(update={"question": question, "started": "2026-01-31T10:00:09+00:00"})
    JsonFile(calls / "0002_coder.json", CallRecord).write(later)
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.name}/1?tab=log"))
        folds = page.get_by_role("button", name="Coder called made:up")
        expect(folds).to_have_count(2)
        folds.first.click()  # the newest
        page.get_by_text("Changes from the previous prompt of this role").click()
        shown = page.get_by_role("region", name="changes between the prompts")
        expect(shown.locator(".plus").first).to_contain_text("Write it thinner.")
        expect(shown.locator(".minus").first).to_contain_text("Write it.")
        folds.last.click()
        expect(page.get_by_text("Changes from the previous prompt of this role")).to_have_count(1)
        assert page.evaluate("window.stolen") is None


def test_a_run_with_a_question_to_a_person_waits_and_says_why_the_last_reply_came_back(
    runs: Path, server: Server
) -> None:
    prompts = runs / ".web" / "prompts" / "1"
    run = made_run(runs, model=f"manual:{prompts}", designs=1)
    (run.design(1).path / "outcome.json").unlink()
    first = f"<!-- AID-SR question {'0' * 64}, asked by the coder -->"
    earlier = "===== EARLIER REPLY =====\n\n<mujoco/>\n\n===== MESSAGE =====\n\nThe reply was empty.\n"
    replace_file(prompts / "0001.prompt.md", f"{first}\n\n{earlier}".encode())
    with browsing() as visitor, EventLog(run.events):
        page = visitor.new_page()
        page.goto(server.address())
        expect(page.locator("tr .badge.waiting")).to_have_text("waiting")
        expect(page.locator("tr .badge.running")).to_have_count(0)
        page.goto(server.address(f"/run/{run.name}"))
        expect(page.locator("h1 + .badge")).to_have_text("waiting")
        expect(page.get_by_text("The reply was empty.").first).to_be_visible()


def test_steps_beyond_those_asked_for_are_told_as_such(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    folder = made_training(run.design(1), (True,))
    head = "steps,wall_s,episodes,success_share,progress,reward,diverged,steps_per_s\n"
    replace_file(folder / "curve.csv", f"{head}4288,9,4,0.5,0.7,2.0,0,222\n".encode())
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.name}/1?tab=training"))
        expect(page.get_by_text("4,288 (requested: 4,000)")).to_be_visible()
        ticks = page.locator("svg.curve text:not([text-anchor=end][x='36'])")
        expect(ticks).to_have_text(["0", "1 k", "2 k", "3 k", "4 k"])


def test_lengths_are_in_mm_and_masses_in_g_wherever_a_robot_is_described(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    measured = {"characteristic_length_m": 0.3, "moving_mass_kg": 0.06}
    report = ValidationReport(stable=True, measurements=measured)
    replace_file(run.design(1).iteration(2).scene_report.path, report.model_dump_json().encode())
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.name}"))
        open_tab(page, "Side by side")
        for words in ("300 mm", "60 g"):
            expect(page.get_by_text(words, exact=True)).to_be_visible()
        page.goto(server.address(f"/run/{run.name}/1?tab=found"))
        for words in ("300 mm", "60 g"):
            expect(page.get_by_text(words, exact=True)).to_be_visible()


def test_on_a_phone_no_cell_of_a_list_is_out_of_sight(runs: Path, server: Server) -> None:
    made_run(runs)
    made_study(runs / "first")
    with browsing(viewport={"width": 390, "height": 844}) as visitor:
        page = visitor.new_page()
        for address, list_ in (("/designs", "table.designs"), ("/work", "[aria-label=studies] table")):
            page.goto(server.address(address))
            page.locator(f"{list_} tbody td").first.wait_for()
            cells = page.locator(f"{list_} tbody td:visible").all()
            assert len(cells) > 8
            for cell in cells:
                place = cell.bounding_box()
                assert place
                assert place["x"] + place["width"] <= 390, cell.inner_text()


def test_on_a_phone_the_header_fits_while_something_waits_and_something_runs(runs: Path, server: Server) -> None:
    working, waiting = made_run(runs, designs=1), made_run(runs, waiting=True, designs=1)
    (working.design(1).path / "outcome.json").unlink()
    with browsing(viewport={"width": 390, "height": 844}) as visitor, EventLog(working.events):
        page = visitor.new_page()
        page.goto(server.address(f"/run/{waiting.name}/1"))
        page.get_by_role("link", name="1 waiting for you").wait_for()
        expect(page.locator(".work-link .running")).to_have_text("1")
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        way = page.locator("header nav a:visible").last.bounding_box()
        assert way
        assert way["width"] > 50, "some letters of the way back"


def test_on_a_phone_a_damaged_run_is_named(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    (run.path / "run.json").write_text("{")
    with browsing(viewport={"width": 390, "height": 844}) as visitor:
        page = visitor.new_page()
        page.goto(server.address())
        for words in (run.name, "run.json cannot be read"):
            expect(page.locator("table.runs").get_by_text(words).first).to_be_visible()


def test_what_an_interrupted_run_left_off_is_not_at_work(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    (run.design(1).path / "outcome.json").unlink()
    with EventLog(run.design(1).events) as log:
        log.write(StepStarted(step="robot", iteration=3))
    with browsing() as visitor:
        page = visitor.new_page()
        for address in (f"/run/{run.name}", f"/run/{run.name}/1"):
            page.goto(server.address(address))
            expect(page.locator(".stage", has_text="stopped")).to_be_visible()
            expect(page.get_by_text("running", exact=True)).to_have_count(0)
        page.goto(server.address("/designs"))
        expect(page.locator("table.designs .badge")).to_have_text("interrupted")


def test_the_words_of_the_strip_are_whole_in_four_columns(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=4)
    with browsing(viewport={"width": 1440, "height": 900}) as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.name}"))
        expect(page.locator(".stage").filter(has_text="passed")).to_have_count(4)
        tops = {round(place["y"]) for each in page.locator("article").all() if (place := each.bounding_box())}
        assert len(tops) == 1, "four columns"
        cut = page.evaluate("""[...document.querySelectorAll(".attempt")].filter((row) =>
            row.scrollWidth > row.clientWidth || [...row.querySelectorAll(".stage")].some((one) =>
                one.scrollWidth > one.clientWidth)).map((row) => row.innerText)""")
        assert cut == []


def test_held_out_success_comes_first_and_approval_says_its_warnings(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=1)
    made_training(run.design(1), [True] * 3 + [False])
    warning = Fault(code="chatter", layer="simulate", severity="warning", names=(), measured=2.0, limit=1.0, unit="mm",
                    message="the tip shakes")  # fmt: skip
    report = ValidationReport(stable=True, faults=(warning, warning))
    replace_file(run.design(1).iteration(2).scene_report.path, report.model_dump_json().encode())
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.name}"))
        card = page.get_by_role("article")
        expect(card.locator(".facts > div").first).to_have_text(re.compile("held-out success.*3 of 4", re.DOTALL))
        expect(card.locator(".badge")).to_have_text("approved, 2 warnings")
        page.goto(server.address(f"/run/{run.name}/1?tab=training"))
        expect(page.locator("h1 + .badge")).to_have_text("approved, 2 warnings")
        for place in (page.locator(".facts").first, page.get_by_role("article").locator(".facts").first):
            expect(place.locator("> div").first).to_have_text(re.compile("held-out success.*3 of 4", re.DOTALL))


def test_a_training_says_with_what_it_begins_and_whether_a_policy_is_needed(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=2)
    for design in run.designs:
        made_training(design, [True] * 4)
    folder = run.design(1).path / "training" / "001"
    replace_file(
        folder / "config.json", b'{"steps": 4000, "seed": 7, "recipe": {"algorithm": "sac", "script": "a: 1"}}'
    )
    verdict = Evaluation.model_validate_json((folder / "evaluation.json").read_bytes())
    told = verdict.model_copy(update={"mean_action": MeanAction(action=(0.4,), succeeded=3, of=4)})
    replace_file(folder / "evaluation.json", told.model_dump_json().encode())
    with browsing() as visitor:
        page = visitor.new_page()
        for number, count in ((1, 1), (2, 0)):
            page.goto(server.address(f"/run/{run.name}/{number}?tab=training"))
            expect(page.get_by_role("article").locator(".facts").first).to_contain_text("held-out success")
            facts = page.get_by_role("article").locator(".facts > div")
            expect(facts.filter(has_text=re.compile("starts from.*a motion script", re.DOTALL))).to_have_count(count)
            line = "the constant mean action of the policy wins 3 of"
            expect(page.get_by_text(line)).to_have_count(count)


def test_an_empty_objective_is_marked_at_its_field(runs: Path, server: Server) -> None:
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address("/new"))
        page.get_by_role("tab", name="Custom task").click()
        objective = page.get_by_label("Objective", exact=True)
        objective.wait_for()
        page.get_by_role("button", name="Start the run").click()
        expect(page.locator(".q-field--error")).to_contain_text("Describe what the robot should do.")
        expect(objective).to_be_focused()
        expect(page.get_by_text("aidsr tasks")).to_have_count(0)
        objective.fill("Press the button.")
        expect(page.locator(".q-field--error")).to_have_count(0)
    assert not [path for path in runs.glob("*") if not path.name.startswith(".")]


def test_only_of_a_language_model_it_is_said_that_it_may_take_minutes(runs: Path, server: Server) -> None:
    rules = made_run(runs, designs=1)
    model = made_run(runs, designs=1, model="openai:some", started="2026-02-01T10:00:00+00:00")
    for run in (rules, model):
        shutil.rmtree(run.path / "designs")
        run.concepts.path.unlink()
    with browsing() as visitor, EventLog(rules.events), EventLog(model.events):
        page = visitor.new_page()
        page.goto(server.address(f"/run/{model.name}"))
        page.get_by_text("A language model may take minutes. You can close this page.").wait_for()
        page.goto(server.address(f"/run/{rules.name}"))
        page.get_by_text("You can close this page.").wait_for()
        expect(page.get_by_text("language model")).to_have_count(0)
