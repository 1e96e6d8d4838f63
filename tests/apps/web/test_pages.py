"""The pages without a browser: what they show of run folders, what buttons do, and that hostile text stays text."""

import asyncio
import functools
import json
import os
import re
import shutil
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager, chdir
from dataclasses import dataclass, field, replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from made import MJCF, SCRIPT, blamed, concept, made_run, made_training
from nicegui import app, ui
from nicegui.elements.upload_files import SmallFileUpload
from nicegui.storage import Storage
from nicegui.testing import User, user_simulation
from nicegui.testing.user_interaction import UserInteraction

from aidsr.apps.web.comparison import comparison_column
from aidsr.apps.web.designs_page import design_row
from aidsr.apps.web.goal_form import named_joints
from aidsr.apps.web.live import working
from aidsr.apps.web.manual_panel import answer, prompts_of
from aidsr.apps.web.mjcf_text import difference, highlighted
from aidsr.apps.web.model_form import budget_from, estimated_cost
from aidsr.apps.web.pages import add_pages
from aidsr.apps.web.processes import Processes
from aidsr.apps.web.review_panel import part_names, refinement
from aidsr.apps.web.setup_page import FRESH, request_from
from aidsr.apps.web.site import Site
from aidsr.apps.web.upload import ENVIRONMENT
from aidsr.core.artifacts import (
    Critique,
    CritiqueIssue,
    Decision,
    Evaluation,
    Outcome,
    PerturbedEpisodes,
    PlausibilityCheck,
    TaskReport,
)
from aidsr.core.config import Budget, RunConfig
from aidsr.core.directory_lock import DirectoryLock
from aidsr.core.errors import UserError
from aidsr.examples import examples
from aidsr.runs import EventLog
from aidsr.runs.events import Started, Stopped
from aidsr.runs.files import replace_file
from aidsr.runs.trainings import Inspection, read_curve, trainings_of, without_tests
from aidsr.sim.environment_summary import summarize_environment
from aidsr.teams.providers.manual import pending_prompts


@asynccontextmanager
async def visitor(site: Site) -> AsyncIterator[User]:
    site.own.mkdir(parents=True)
    Storage.path = site.own / "people"
    async with user_simulation(root=lambda: None) as user:
        add_pages(site)
        yield user


def visiting(test: Callable[[User, Site], Awaitable[None]]) -> Callable[[Path], None]:
    """Run a test with a visitor of the pages over an empty folder of runs."""

    @functools.wraps(test)
    def wrapped(tmp_path: Path) -> None:
        async def visit() -> None:
            site = Site.at(tmp_path / "runs")
            async with visitor(site) as user:
                await test(user, site)

        asyncio.run(visit())

    del wrapped.__wrapped__  # type: ignore[attr-defined]  # pytest would look for its arguments there
    return wrapped


def press(user: User, name: str) -> None:
    """Click the button of that name, or the one around that text, as a browser would find it."""
    for element in user.client.elements.values():
        if name in (element.props.get("aria-label"), getattr(element, "text", None)):
            for button in (element, *element.ancestors()):
                if button.tag == "button" or isinstance(button, ui.button):
                    UserInteraction(user, {button}, None).click()
                    return
    pytest.fail(f"there is no button {name}")


def shown(user: User) -> str:
    """Return all text on the page as the browser is told it."""
    return json.dumps([element._to_dict() for element in user.client.elements.values()], default=str)


@visiting
async def test_an_empty_home_explains_itself(user: User, site: Site) -> None:
    await user.open("/")
    await user.should_see("No runs yet")
    await user.should_see("Three robots that push a button")
    await user.should_see("Ring a bell (custom task)")
    await user.open("/designs")
    await user.should_see("There are no designs yet.")
    await user.should_not_see("0 of 4 selected")
    await user.open("/")
    user.find("Set up a run").click()
    await user.should_see("Settings")


@visiting
async def test_home_shows_every_run_and_finds_them(user: User, site: Site) -> None:
    made_run(site.library.path, name="Arm")
    made_run(site.library.path, task="", objective="Turn the knob.", waiting=True)
    (site.library.path / "damaged").mkdir()
    (site.library.path / "damaged" / "run.json").write_text("{")
    await user.open("/")
    for said in ("button pushing", "Turn the knob.", "3 of 3 approved", "$0.7500", "damaged", "waiting"):
        await user.should_see(said)
    user.find("Search").type("knob")
    await user.should_not_see("button pushing")
    user.find("Search").clear().type("nothing of the kind")
    await user.should_see("None of 3 runs matches")


@visiting
async def test_a_run_is_thrown_away_and_taken_back(user: User, site: Site) -> None:
    run = made_run(site.library.path)
    await user.open("/")
    press(user, f"Delete {run.path.name}")
    await user.should_see("was moved to the trash")
    assert not run.path.exists()
    user.find("Undo").click()
    await user.should_see("button pushing")
    assert run.path.exists()


@visiting
async def test_a_run_is_watched(user: User, site: Site) -> None:
    run = made_run(site.library.path, waiting=True)
    await user.open(f"/run/{run.path.name}")
    for said in ("1. Arm 1", "waits for your decision", "1 fault", "approved", "stable", "passed"):
        await user.should_see(said)
    with EventLog(run.events) as log:
        log.write(Started())
    user.find("Side by side").click()
    await user.should_see("moving mass")
    user.find("Log").click()
    await user.should_see("robot: 1 fault: chatter")
    await user.should_see("Coder called made:up")
    user.find("Search: prompts").type("here it is")
    await user.should_see("Coder called made:up")
    await user.should_not_see("robot: 1 fault: chatter")


@visiting
async def test_a_run_that_nobody_works_on_says_so_and_can_go_on(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    (run.design(1).path / "outcome.json").unlink()
    await user.open(f"/run/{run.path.name}")
    await user.should_see("No process is running this run")
    await user.should_see("Resume")
    with EventLog(run.design(1).events) as log:
        log.write(Stopped(cause="error", message="the model cannot be reached"))
    await user.open(f"/run/{run.path.name}")
    await user.should_see("the model cannot be reached")


@visiting
async def test_a_larger_budget_starts_from_the_present_one_and_waits_for_the_other_designs(
    user: User, site: Site
) -> None:
    run = made_run(site.library.path, designs=2, model="ollama:made")
    used_up = Outcome(outcome="out_of_budget", reason="used up", iteration=2)
    replace_file(run.design(1).outcome.path, used_up.model_dump_json().encode())
    run.design(2).outcome.path.unlink()
    replace_file(run.larger_budget, Budget(tokens=9000).model_dump_json().encode())
    with EventLog(run.events):  # the other design is at work
        await user.open(f"/run/{run.path.name}")
        (field,) = user.find("Maximum tokens of the run").elements
        assert field.value == 9000
        field.set_value(20000)
        press(user, "Resume with this budget")
        await user.should_see("is already running; wait for it, or stop it first")
    assert run.budget() == Budget(tokens=9000)
    assert run.design(1).outcome.read() == used_up


@visiting
async def test_an_address_that_leads_nowhere_says_so(user: User, site: Site) -> None:
    made = made_run(site.library.path)
    await user.open("/run/nowhere")
    await user.should_see("Page not found")
    for address in (f"/run/{made.path.name}/9", f"/run/{made.path.name}/9/export"):
        await user.open(address)
        await user.should_see("No design 9")
        await user.should_see(f"{made.name} has no design 9; it has: 1, 2, 3")
    (made.path / "run.json").write_text("{")
    for address in (f"/run/{made.path.name}", f"/run/{made.path.name}/1", f"/run/{made.path.name}/1/export"):
        await user.open(address)
        await user.should_see("This run cannot be read")
        await user.should_see("run.json cannot be read")


@visiting
async def test_a_design_is_found_by_its_number_when_one_before_it_was_deleted(user: User, site: Site) -> None:
    run = made_run(site.library.path)
    shutil.rmtree(run.design(1).path)
    for number in (2, 3):
        for address in (f"/run/{run.path.name}/{number}", f"/run/{run.path.name}/{number}/export"):
            await user.open(address)
            await user.should_see(f"{number}. Arm {number}")
    await user.open(f"/run/{run.path.name}")
    user.find("Side by side").click()
    await user.should_see("3. Arm 3")
    with pytest.raises(UserError, match="this run has no design 1; it has: 2, 3"):
        site.view(run).design(1)


@visiting
async def test_a_design_says_what_changed_and_what_got_better(user: User, site: Site) -> None:
    run = made_run(site.library.path)
    await user.open(f"/run/{run.path.name}/1")
    for said in ("Changes since iteration 1", "it is stable now", "chatter is gone (1 place)", "It reaches."):
        await user.should_see(said)
    await user.open(f"/run/{run.path.name}/1?iteration=1")
    await user.should_see("Too soft. Stiffen it.")
    await user.should_see("9 mm (at most 1), line 4")
    user.find("MJCF").click()
    await user.should_see("Full")
    user.find("Concept").click()
    await user.should_see("a tapering arm")


@visiting
async def test_a_design_tried_on_its_task_says_how_far_it_came(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    issue = CritiqueIssue(blame="designer", component="arm", problem="too short by 4 cm.", suggestion="Lengthen it.")
    report = TaskReport(phase="never_reached", progress=0.25, critique=Critique(passed=False, issues=(issue,)))
    run.design(1).iteration(2).task_report.write(report)
    await user.open(f"/run/{run.path.name}/1")
    await user.should_see("Tried on its task: never reached, progress 0.25")
    await user.should_see("arm (designer): too short by 4 cm. Lengthen it.")
    await user.open(f"/run/{run.path.name}")
    await user.should_see("never reached")


@visiting
async def test_a_refinement_is_kept_while_it_is_typed_and_written_as_a_decision(user: User, site: Site) -> None:
    run = made_run(site.library.path, waiting=True, designs=1)
    with EventLog(run.events):  # somebody is at work, so that no process is started
        await user.open(f"/run/{run.path.name}/1")
        user.find("Refine").click()
        await user.should_see("a refinement needs text")
        user.find("What should change?").type("make it longer")
        await user.open(f"/run/{run.path.name}/1")
        assert user.find("What should change?").elements.pop().value == "make it longer"
        user.find("Refine").click()
        await user.should_see("Sent to the Designer.")
    decision = run.design(1).iteration(2).decision.read()
    assert decision is not None
    assert (decision.verdict, decision.text) == ("refine", "make it longer")


@visiting
async def test_a_review_tells_what_the_rules_understand_and_what_became_of_the_last_words(
    user: User, site: Site
) -> None:
    run = made_run(site.library.path, waiting=True, designs=1)
    model = made_run(site.library.path, waiting=True, designs=1, name="Other", model="x:model")
    run.design(1).iteration(1).decision.write(Decision(verdict="refine", text="use three tendons"))
    told = concept("Arm").model_copy(update={"rationale": 'Not understood: "use three tendons".'})
    run.design(1).iteration(2).concept.write(told)
    with EventLog(run.events), EventLog(model.events):
        await user.open(f"/run/{run.path.name}/1")
        await user.should_see("The built-in rules understand only: longer, shorter")
        await user.should_see("“use three tendons”")
        await user.should_see('Not understood: "use three tendons".')
        await user.open(f"/run/{model.path.name}/1")
        await user.should_see("What should change?")
        await user.should_not_see("The built-in rules understand only")
        await user.should_not_see("What became of your last words")


@pytest.mark.parametrize(
    ("turned", "told"),
    [
        ("", "stand (a robot stands upright)"),
        (' euler="180 0 0"', "a robot hangs down"),
        (' euler="0 90 0"', "along 1 0"),
    ],
)
def test_an_uploaded_environment_tells_where_a_robot_will_point(turned: str, told: str) -> None:
    site = f'<site name="mount_stand" pos="0 0 0.7"{turned}/>'
    facts = dict(ENVIRONMENT.look(f"<mujoco><worldbody>{site}</worldbody></mujoco>", {}))
    assert told in facts["mounts"]


@visiting
async def test_only_the_iteration_that_waits_asks_for_a_decision(user: User, site: Site) -> None:
    run = made_run(site.library.path, waiting=True, designs=1)
    await user.open(f"/run/{run.path.name}/1?iteration=1")
    await user.should_see("Iteration 2 waits for your decision.")
    await user.should_not_see("Approve")
    await user.should_not_see("the Judge passed it")
    for address in (f"/run/{run.path.name}/1", f"/run/{run.path.name}/1?iteration=2"):
        await user.open(address)
        await user.should_see("Approve")
        await user.should_not_see("Iteration 2 waits for your decision.")


@visiting
async def test_an_earlier_iteration_is_called_the_same_in_heading_breadcrumb_and_browser(
    user: User, site: Site
) -> None:
    run = made_run(site.library.path, designs=1)
    run.design(1).iteration(2).concept.write(concept("Shorter arm"))
    for chosen, name in ((1, "1. Arm 1"), (2, "1. Shorter arm")):
        await user.open(f"/run/{run.path.name}/1?iteration={chosen}")
        await user.should_see("Changes since iteration 1" if chosen == 2 else "Too soft. Stiffen it.")
        assert user.client.title == f"{name} · AID-SR"
        named = [each.text for each in user.client.elements.values() if getattr(each, "text", "").startswith("1. ")]
        assert named == [name, name], "breadcrumb and heading"


@visiting
async def test_the_page_of_a_design_says_what_it_is_for(user: User, site: Site) -> None:
    own = "Reach the cup on the shelf and push it 5 cm to the side without touching the wall behind it, then let go."
    for task, objective, said in (
        ("reaching/button_pushing", "Press the button.", "Task: button pushing"),
        ("", own, "Task: Reach the cup on the shelf and push it 5 cm to the side without touching the"),
    ):
        run = made_run(site.library.path, task=task, objective=objective, designs=1)
        await user.open(f"/run/{run.path.name}/1")
        await user.should_see(said)


@visiting
async def test_of_two_tabs_that_decide_the_second_is_told(user: User, site: Site) -> None:
    run = made_run(site.library.path, waiting=True, designs=1)
    with EventLog(run.events):
        await user.open(f"/run/{run.path.name}/1")
        run.design(1).iteration(2).decision.path.write_text('{"verdict": "quit"}')
        user.find("Approve").click()
        await user.should_see("already made")


@visiting
async def test_a_decision_that_cannot_be_read_is_named(user: User, site: Site) -> None:
    run = made_run(site.library.path, waiting=True, designs=1)
    with EventLog(run.events):
        await user.open(f"/run/{run.path.name}/1")
        run.design(1).iteration(2).decision.path.write_text("{'verdict': 'approve'}")
        user.find("Approve").click()
        await user.should_see("decision.json cannot be read")


@visiting
async def test_of_two_trainings_the_one_at_work_is_told_from_the_stopped_one(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    name = site.training_name(run, 1)
    site.processes.folder.mkdir(parents=True)
    (site.processes.folder / f"{name}.json").write_text('{"pid": 0}')
    for number in ("001", "002"):
        folder = run.design(1).path / "training" / number
        replace_file(folder / "config.json", b'{"steps": 4000, "seed": 7}')
        replace_file(folder / "events.jsonl", b"")
    os.utime(run.design(1).path / "training" / "001" / "events.jsonl", (1, 1))
    with EventLog(site.processes.folder / f"{name}.log"):  # held as long as the process lives
        await user.open(f"/run/{run.path.name}/1")
        user.find("Training").click()
        await user.should_see("Training 1")
        badges = [one for one in user.client.elements.values() if "badge" in one.classes]
        assert [one.text for one in badges if one.text in ("running", "stopped")] == ["running", "stopped"]


@dataclass(frozen=True)
class NotedProcesses(Processes):
    """Processes that only note their commands."""

    started: list[list[str]] = field(default_factory=list)

    def start(self, name: str, command: Sequence[str]) -> None:
        del name
        self.started.append(list(command))


def noting(site: Site) -> tuple[Site, list[list[str]]]:
    """Return a site whose processes only note their commands, and those commands."""
    processes = NotedProcesses(site.processes.folder)
    return replace(site, processes=processes), processes.started


def test_a_design_without_a_goal_is_trained_and_probed_with_a_typed_one(tmp_path: Path) -> None:
    site, started = noting(Site.at(tmp_path / "runs"))
    run = made_run(site.library.path, designs=1, task="", objective="Ring the bell.")
    (run.path / "environment.xml").write_text(examples()["bell"].environment)

    async def visit() -> None:
        async with visitor(site) as user:
            for tab, pressed in (("training", "Start training"), ("probe", "Start the probe")):
                await user.open(f"/run/{run.path.name}/1?tab={tab}")
                goal = user.find("Goal (TOML)").elements.pop()
                goal.value = ""
                press(user, pressed)
                await user.should_see("in a terminal add --goal goal.toml to the command")
                goal.value = 'kind = "touch"\ntarget = "gong"'
                press(user, pressed)
                await user.should_see("gong")
                assert len(started) == (tab == "probe"), "a goal that does not fit the environment starts nothing"
                goal.value = examples()["bell"].goal
                press(user, pressed)
                file = Path(started[-1][started[-1].index("--goal") + 1])
                assert file.read_text() == examples()["bell"].goal

    asyncio.run(visit())
    assert [command[0] for command in started] == ["train", "probe"]


def test_the_physics_steps_of_a_probe_can_be_set(tmp_path: Path) -> None:
    site, started = noting(Site.at(tmp_path / "runs"))
    run = made_run(site.library.path, designs=1)

    async def visit() -> None:
        async with visitor(site) as user:
            await user.open(f"/run/{run.path.name}/1?tab=probe")
            press(user, "Start the probe")
            user.find("Maximum physics steps").elements.pop().value = 900_000
            press(user, "Start the probe")
            user.find("Maximum physics steps").elements.pop().value = 0
            press(user, "Start the probe")
            await user.should_see("Maximum physics steps must be a whole number above 0, or empty for the default")

    asyncio.run(visit())
    assert started == [["probe", str(run.design(1).path), *more] for more in ([], ["--max-steps", "900000"])]


def test_a_training_has_protocol_and_seed_and_a_stopped_one_is_continued(tmp_path: Path) -> None:
    site, started = noting(Site.at(tmp_path / "runs"))
    run = made_run(site.library.path, designs=1)
    design, name = str(run.design(1).path), site.training_name(run, 1)
    command = ["train", design, "--steps", "4000", "--seeds", "1", "--first-seed", "3", "--protocol", "paper"]
    folder = run.design(1).path / "training" / "001"

    async def visit() -> None:
        async with visitor(site) as user:
            page = f"/run/{run.path.name}/1?tab=training"
            await user.open(page)
            await user.should_not_see("Continue training")
            for label, value in (("Maximum steps", 4000), ("First seed", 3)):
                user.find(label).elements.pop().value = value
            next(one for one in user.client.elements.values() if "protocol" in str(one.props)).value = "paper"
            press(user, "Start training")
            assert started == [command]
            replace_file(site.processes.folder / f"{name}.json", json.dumps({"pid": 0, "command": command}).encode())
            said = "seed 3: 1000 steps\n\nInterrupted. Progress is kept; repeat the same command to continue\n"
            replace_file(site.processes.folder / f"{name}.log", said.encode())
            replace_file(folder / "config.json", b'{"steps": 4000, "seed": 3}')
            replace_file(folder / "events.jsonl", b"")
            rows = "steps,wall_s,episodes,success_share,progress,reward,diverged,steps_per_s\n1024,9,4,0.5,0.7,2,0,9\n"
            replace_file(folder / "curve.csv", rows.encode())
            await user.open(page)
            await user.should_see("Training 1 was stopped at 1,024 of 4,000 steps.")
            await user.should_not_see("repeat the same command")
            press(user, "Continue training")
            assert started == [command, command]
            replace_file(folder / "training.json", b"{}")
            await user.open(page)
            await user.should_see("Training 1 was stopped before its evaluation had ended.")

    asyncio.run(visit())


@visiting
async def test_a_training_estimates_its_time_from_the_last_one(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    folder = made_training(run.design(1))
    replace_file(folder / "config.json", b'{"steps": 4000, "seed": 7, "recipe": {"algorithm": "sac"}}')
    replace_file(folder / "training.json", b'{"steps": 4000, "wall_s": 40.0}')
    await user.open(f"/run/{run.path.name}/1?tab=training")
    user.find("Maximum steps").elements.pop().value = 6000
    user.find("Policies (trained in sequence)").elements.pop().value = 2
    await user.should_see("At most about 2 min 0 s of learning, at the speed of training 1")
    next(one for one in user.client.elements.values() if "protocol" in str(one.props)).value = "paper"
    await user.should_not_see("of learning")


@visiting
async def test_a_trained_design_is_shown_and_a_persons_word_kept(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    check = PlausibilityCheck(name="energy", passed=True, measured=0.01, limit=0.1, unit="J", message="energy kept")
    folder = made_training(run.design(1), (False, True, True, True), (check,))
    rows = "steps,wall_s,episodes,success_share,progress,reward,diverged,steps_per_s\n2000,9,4,0.5,0.7,2.0,0,222\n"
    replace_file(folder / "curve.csv", rows.encode())
    np.savez(folder / "best.npz", qpos=np.zeros((3, 1)), frame_s=0.02, variation=3, mjcf=MJCF)
    said, noted = (site.processes.folder / f"{site.training_name(run, 1)}.{kind}" for kind in ("log", "json"))
    replace_file(said, b"trained already")
    replace_file(noted, b'{"pid": 0}')
    os.utime(noted, (1, 1))
    await user.open("/designs")
    await user.should_see("0 of 4 selected")
    await user.open(f"/run/{run.path.name}/1")
    labels = [each.text for each in user.client.elements.values() if "key" in each.classes]
    assert labels[:2] == ["held-out success", "policy"]
    user.find("Training").click()
    for said in ("3 of 4", "2,000 of 4,000", "energy kept", "There is no video", "Replay best"):
        await user.should_see(said)
    assert "best of training 1" in shown(user)
    press(user, "Replay best")
    user.find("Not plausible").click()
    await user.should_see("You rejected the motion.")
    assert trainings_of(run.design(1))[0].inspection.read() == Inspection(plausible=False)
    assert "trained already" not in shown(user), "the verdict says it all"
    os.utime(noted)
    await user.open(f"/run/{run.path.name}/1")
    user.find("Training").click()
    await user.should_see("trained already")
    await user.open("/")
    await user.should_see("1 of 1 approved")


@visiting
async def test_success_left_by_a_perturbation_is_shown(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    folder = made_training(run.design(1), (True, True, True, True))
    verdict = Evaluation.model_validate_json((folder / "evaluation.json").read_bytes())
    rubbed = PerturbedEpisodes(
        kind="high_cable_friction", summary="cable friction 0.3", episodes=4, succeeded=(2,), nominal_successes=4
    )
    verdict = verdict.model_copy(update={"perturbed": (rubbed,)})
    replace_file(folder / "evaluation.json", verdict.model_dump_json().encode())
    await user.open(f"/run/{run.path.name}/1")
    user.find("Training").click()
    for expected in ("Perturbed scenes", "cable friction 0.3", "1 of 4", "5 % to 70 %", "25 %"):
        await user.should_see(expected)


def test_what_is_said_of_a_design_is_said_of_one_policy(tmp_path: Path) -> None:
    site = Site.at(tmp_path)
    run = made_run(site.library.path, designs=1)
    design = run.design(1)
    cheating = PlausibilityCheck(
        name="cables", passed=False, measured=0.9, limit=0.1, unit="", message="it wins with slack cables"
    )
    made_training(design, (True, True, True, True), (cheating,)).rename(design.path / "training" / "002")
    made_training(design, (True, True, True, False))
    view = site.view(run).design(1)
    assert (view.evaluated, view.held_out, view.valid, view.successful) == (2, (3, 4), True, True)
    assert design_row(site.view(run), view, design).success == 0.75
    assert design_row(site.view(run), replace(view, warnings=2), design).warnings == 2
    rows = dict(comparison_column(run.name, design, view).rows)
    told = ("held-out success", "valid", "successful")
    assert tuple(rows[name] for name in told) == ("75 % of 4", "yes", "yes")


def at_work(site: Site, name: str, *lines: str) -> EventLog:
    """Return the lock of a process that is at work and has written these lines; to be held while it lives."""
    site.processes.folder.mkdir(parents=True, exist_ok=True)
    (site.processes.folder / f"{name}.json").write_text('{"pid": 0}')
    (site.processes.folder / f"{name}.log").write_text("".join(f"{line}\n" for line in lines))
    return EventLog(site.processes.folder / f"{name}.log")


@visiting
async def test_an_evaluation_and_a_probe_tell_their_progress(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=2)
    folder = made_training(run.design(1))
    (folder / "evaluation.json").unlink()
    replace_file(folder / "training.json", b"{}")
    evaluated = "12 of 100 episodes ended, 11 succeeded; about 30.1 s left, then checks"
    probed = "32 of 128 motions tried, 1 of 2 variations solved, progress 0.50, about 1 min 0 s left"
    with (
        at_work(site, site.training_name(run, 1), "evaluating 100 episodes …", evaluated),
        at_work(site, site.probe_name(run, 2), probed),
    ):
        training, probe = site.activities.current()
        assert training.doing == "evaluating the policy: 12 of 100 episodes ended, 11 succeeded"
        assert probe.doing == "32 of 128 motions tried, 1 of 2 variations solved, progress 0.50"
        assert (training.share, probe.share) == (0.12, 0.25)
        assert training.left_s is not None
        assert probe.left_s is not None
        assert 0 < training.left_s <= 30.1 < probe.left_s <= 60
        await user.open(f"/run/{run.path.name}/1?tab=training")
        await user.should_see("Evaluating the policy. 12 of 100 episodes ended, 11 succeeded.")
        await user.open(f"/run/{run.path.name}/2?tab=probe")
        await user.should_see("32 of 128 motions tried")


@visiting
async def test_the_test_at_the_end_of_a_training_is_said(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    folder = made_training(run.design(1))
    (folder / "evaluation.json").unlink()
    rows = "steps,wall_s,episodes,success_share,progress,reward,diverged,steps_per_s\n4032,9,4,0.5,0.7,2.0,0,222\n"
    replace_file(folder / "curve.csv", rows.encode())
    with at_work(site, site.training_name(run, 1)), EventLog(folder / "events.jsonl"):
        (activity,) = site.activities.current()
        assert (activity.doing, activity.left_s) == ("4,000 of 4,000 steps, testing the policy", None)
        await user.open(f"/run/{run.path.name}/1?tab=training")
        await user.should_see("testing the policy")
        await user.should_not_see("0.0 s left")


@visiting
async def test_a_budget_that_is_too_small_to_tell_anything_has_a_hint(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    await user.open(f"/run/{run.path.name}/1?tab=training")
    steps = user.find("Maximum steps").elements.pop()
    for count, hinted in ((4000, True), (10_000, False), (None, True)):
        steps.value = count
        assert ("So few steps only show how training works" in shown(user)) is hinted


def test_a_number_out_of_range_is_kept_and_refused_with_the_range(tmp_path: Path) -> None:
    site, started = noting(Site.at(tmp_path / "runs"))
    run = made_run(site.library.path, designs=1)

    async def visit() -> None:
        async with visitor(site) as user:
            await user.open(f"/run/{run.path.name}/1?tab=training")
            for label, value, allowed in (
                ("Maximum steps", 0, "a whole number of at least 1"),
                ("Policies (trained in sequence)", 999, "a whole number from 1 to 100"),
                ("First seed", -1, "a whole number of at least 0"),
            ):
                field = user.find(label).elements.pop()
                before, field.value = field.value, value
                assert (field.value, field.error) == (value, allowed)
                field.sanitize()  # as when the field is left
                assert field.value == value
                press(user, "Start training")
                await user.should_see(f"{label} must be {allowed}")
                field.value = before
                assert field.error is None

    asyncio.run(visit())
    assert not started


@visiting
async def test_a_held_out_variation_that_does_not_exist_is_not_played(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=2)
    made_training(run.design(1))
    await user.open(f"/compare?design={run.name}/1&design={run.name}/2")
    field = user.find("Held-out variation").elements.pop()
    field.value = 999
    field.sanitize()
    assert (field.value, field.error) == (999, "a whole number from 0 to 99")
    press(user, "Play in all views")
    await user.should_not_see("cannot be replayed")
    field.value = 99
    press(user, "Play in all views")
    await user.should_see("the episodes of this training cannot be replayed: policy.zip not found")


@visiting
async def test_the_test_of_the_final_policy_is_no_point_of_the_learning_curve(user: User, site: Site) -> None:
    """The first rows are a training of 4,000 steps: 29 % of its episodes succeeded, then none of the 20 of the test."""
    run = made_run(site.library.path, designs=1)
    folder = made_training(run.design(1))
    rows = "steps,wall_s,episodes,success_share,progress,reward,diverged,steps_per_s\n"
    rows += "3936,31.98,17,0.2857,0.333,3.9435,0,686.4\n4032,32.11,18,0.2857,0.333,3.9435,0,723.9\n"
    replace_file(folder / "curve.csv", (rows + "4032,32.11,38,0.0,0.1202,-0.6237,0,125.6\n").encode())
    training = trainings_of(run.design(1))[0]
    learned, test = without_tests(training, read_curve(training))
    assert [row.success_share for row in learned] == [0.2857, 0.2857]
    assert test is not None
    assert (test.success_share, test.progress) == (0.0, 0.1202)
    await user.open(f"/run/{run.path.name}/1?tab=training")
    await user.should_see("29 %")
    await user.should_see("Test of the kept policy after learning")
    await user.should_see("0 % succeeded, progress 0.12.")
    replace_file(folder / "curve.csv", rows.encode())
    assert without_tests(training, read_curve(training)) == (learned, None)
    beaten = {"steps": 4000, "seed": 7, "recipe": {"script": "hold 1", "from_probe": True}}
    replace_file(folder / "config.json", json.dumps(beaten).encode())
    assert without_tests(training, learned) == (learned[:1], learned[1])


@visiting
async def test_of_a_training_that_another_process_does_it_is_said_where_to_stop_it(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    folder = made_training(run.design(1))
    replace_file(folder / "training.json", b"{}")
    lock = DirectoryLock(folder)
    await user.open(f"/run/{run.path.name}/1?tab=training")
    await user.should_see("Started by another process (a study or a terminal); stop it there.")
    await user.should_see("Rendering videos, or repeating the evaluation.")
    (activity,) = site.activities.current()
    assert activity.doing == "rendering videos, or repeating the evaluation"
    lock.release()


@visiting
async def test_of_a_damaged_file_a_sentence_stands_where_it_would_be_shown(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    folder = made_training(run.design(1))
    replace_file(folder / "best.npz", b"PK")
    replace_file(folder / "curve.csv", b"time,value\n1,2\n")
    await user.open(f"/run/{run.path.name}/1")
    await user.should_see("best.npz is not a recorded episode")
    await user.should_see("It reaches.")
    user.find("Training").click()
    await user.should_see("cannot read the learning curve")
    (folder / "best.npz").unlink()
    run.design(1).iteration(2).scene.json.path.write_text("{}")
    await user.open(f"/run/{run.path.name}/1")
    await user.should_see("scene.json cannot be read")


@visiting
async def test_a_form_kept_for_a_task_that_is_gone_starts_with_another(user: User, site: Site) -> None:
    await user.open("/new")
    with user.client:
        app.storage.user["setup"].update(task="reaching/knob_turning", level="hard", concepts=2)
    await user.open("/new")
    with user.client:
        form = app.storage.user["setup"]
        assert (form["task"], form["level"], form["concepts"]) == ("reaching/button_pushing", "standard", 2)


@visiting
async def test_text_of_models_and_people_is_never_markup(user: User, site: Site) -> None:
    run = made_run(site.library.path, name=SCRIPT, objective=SCRIPT, task="", model=f"x:{SCRIPT}", designs=1)
    run.design(1).iteration(2).critique.path.unlink()
    run.design(1).iteration(2).critique.write(blamed())
    for address in ("/", f"/run/{run.path.name}", f"/run/{run.path.name}/1", f"/run/{run.path.name}/1?iteration=1"):
        await user.open(address)
        for element in user.client.elements.values():
            markup = str(element.props.get("innerHTML", "")) + str(element.props.get("content", ""))
            assert "<script" not in markup
            assert "<img" not in markup


@pytest.mark.parametrize(
    "mjcf", [SCRIPT, f"<!-- {SCRIPT} -->", f'<a b="{SCRIPT}"/>', "<a b='\"><script>'/>", "</div><script>"]
)
def test_mjcf_is_shown_with_everything_in_it_escaped(mjcf: str) -> None:
    for html in (highlighted(mjcf, {1: SCRIPT}), difference(mjcf, "<mujoco/>"), difference("", mjcf)):
        assert "<script" not in html
        assert "<img" not in html
        assert "</div><script" not in html


def test_differences_are_marked_line_by_line() -> None:
    html = difference("<a/>\n<b/>", "<a/>\n<c/>")
    assert html.count('class="minus"') == 1
    assert html.count('class="plus"') == 1
    assert difference("<a/>", "<a/>") == ""


def test_lines_of_dashes_and_pluses_differ_like_any_other() -> None:
    html = difference("<!--\n-- old -->\n<a/>", "<!--\n++ new -->\n<a/>")
    assert html.count('class="minus"') == html.count('class="plus"') == 1


@pytest.mark.parametrize("piece", ["a", "<!--", "a.", "'\"", "<a"])
def test_no_line_of_a_model_keeps_the_page_busy(piece: str) -> None:
    line = piece * 100_000  # looked at anew from each character it would take many minutes
    assert unescape(re.sub(r"<[^>]+>", "", highlighted(line))) == f"1{line}"


def test_a_form_becomes_an_order_or_a_sentence(tmp_path: Path) -> None:
    site = Site.at(tmp_path)
    order = request_from(site, FRESH | {"concepts": 2.0, "human": False})
    assert (order.task, order.config) == ("reaching/button_pushing", RunConfig(concepts=2))
    for change, sentence in (
        ({"concepts": None}, "Number of concepts must be a whole number from 1 to 20"),
        ({"concepts": 0}, "Number of concepts must be a whole number from 1 to 20"),
        ({"concepts": 2.5}, "Number of concepts must be a whole number from 1 to 20"),
        (
            {"kind": "manual", "max_output_tokens": 100},
            "Maximum output tokens per call must be a whole number of at least 256",
        ),
        ({"kind": "language", "model": " "}, "the name of the language model is missing"),
    ):
        with pytest.raises(UserError, match=sentence):
            request_from(site, FRESH | change)
    with chdir(tmp_path):
        near = Site.at(Path("runs"))
    by_hand = request_from(near, FRESH | {"kind": "manual"}).config.model
    assert by_hand.startswith(f"manual:{tmp_path.resolve()}/runs/.web/prompts/"), "found from anywhere"


BELL = """<mujoco model="bell"><worldbody>
  <geom name="floor" type="plane" size="1 1 0.05"/><site name="mount" pos="0 0 0.5" euler="180 0 0"/>
  <body name="bell" pos="0.13 0 0.28"><geom name="bell" size="0.03"/></body>
</worldbody></mujoco>"""


@visiting
async def test_only_settings_that_apply_to_the_designer_are_shown_and_used(user: User, site: Site) -> None:
    rules = {"Seed of the built-in rules"}
    model = {"Maximum output tokens per call", "Show pictures to the Judge"}
    await user.open("/new")
    for kind, name in (("builtin", "Built-in rules"), ("language", "A language model"), ("manual", "By hand")):
        press(user, name)
        seen, hidden = (rules, model) if kind == "builtin" else (model, rules)
        for label in seen:
            await user.should_see(label)
        for label in hidden:
            await user.should_not_see(label)
        form = FRESH | {"kind": kind, "model": "ollama:made", "seed": 7, "max_output_tokens": 100}
        if kind == "builtin":
            config = request_from(site, form | {"judge_pictures": True}).config
            assert (config.seed, config.max_output_tokens, config.judge_pictures) == (7, 20_000, False)
        else:
            config = request_from(site, form | {"max_output_tokens": 500, "judge_pictures": True}).config
            assert (config.seed, config.max_output_tokens, config.judge_pictures) == (0, 500, True)


@visiting
async def test_a_goal_is_looked_at_when_it_is_given(user: User, site: Site) -> None:
    await user.open("/new")
    user.find("Custom task").click()
    fields = {field._props["label"]: field for field in user.client.elements.values() if isinstance(field, ui.upload)}

    async def give(label: str, name: str, said: str) -> None:
        await fields[label].handle_uploads([SmallFileUpload(name, "text/plain", said.encode())])

    await give("Environment (MJCF)", "odd.xml", BELL.replace('size="0.03"', 'sise="0.03"'))
    await user.should_see("odd.xml cannot be used: line 3: ", retries=100)
    (trouble,) = (each for each in user.client.elements.values() if "trouble" in each.classes)
    assert trouble.parent_slot.parent is fields["Environment (MJCF)"].parent_slot.parent
    assert trouble.parent_slot.parent is not fields["Goal (goal.toml)"].parent_slot.parent
    await give("Environment (MJCF)", "cut.xml", BELL[:-10])
    await user.should_see("cut.xml cannot be used: not well-formed XML at line 4", retries=100)
    await give("Environment (MJCF)", "bell.xml", BELL)
    await user.should_see("bell.xml", retries=100)
    await user.should_not_see("cannot be used")
    for said, sentence in (
        ("kind = ", "hit.toml cannot be used: cannot read the goal as TOML"),
        ('kind = "hit"', "has an unknown kind 'hit'"),
        ('kind = "touch"\ntarget = "gong"', "gong"),
        ('kind = "touch"\ntarget = "bell"\nforce = 1', "force"),
    ):
        await give("Goal (goal.toml)", "hit.toml", said)
        await user.should_see(sentence, retries=100)
    await give("Goal (goal.toml)", "hit.toml", 'kind = "touch"\ntarget = "bell"')
    await user.should_see("hit.toml, 0.0 kB", retries=100)
    with user.client:
        form = dict(app.storage.user["setup"])
    order = request_from(site, form | {"source": "words", "objective": "Ring it."})
    assert (order.environment, order.goal) == (BELL, 'kind = "touch"\ntarget = "bell"')


def test_of_an_environment_only_what_a_goal_can_name_is_counted_and_listed() -> None:
    loose = BELL.replace('pos="0.13 0 0.28">', 'pos="0.13 0 0.28"><freejoint/>').replace(
        "</worldbody>", '<body name="knob"><joint name="pin" type="hinge"/><geom size="0.01"/></body></worldbody>'
    )
    assert ("bodies", "2") in ENVIRONMENT.look(loose, {}), "without the world"
    assert named_joints(loose, summarize_environment(loose)) == ["pin: hinge about 0 0 1"]


@visiting
async def test_a_template_fills_the_form_and_a_goal_is_checked_as_it_is_typed(user: User, site: Site) -> None:
    await user.open("/new?template=bell")
    await user.should_see("bell.xml")
    await user.should_see("touch")
    (field,) = user.find("Goal (TOML)").elements
    for said, sentence in (('kind = "touch"\ntarget = "gong"', "gong"), ('kind = "hit"', "unknown kind 'hit'")):
        field.set_value(said)
        await user.should_see(sentence, retries=100)
    field.set_value('kind = "touch"\ntarget = "bell"\nhold_s = 0.25')
    await user.should_see("0.25 s", retries=100)


@visiting
async def test_a_link_with_a_template_does_not_replace_what_was_written(user: User, site: Site) -> None:
    await user.open("/new?template=bell")
    (objective,) = user.find("Objective").elements
    objective.set_value("Ring it twice.")
    await user.open("/new?template=valve")
    await user.should_see("Your own words are kept")
    await user.should_see("Ring it twice.")
    objective = next(iter(user.find("Objective").elements))
    objective.set_value(examples()["bell"].objective)
    await user.open("/new?template=valve")
    await user.should_see("valve.xml")
    await user.should_not_see("Your own words are kept")


@visiting
async def test_the_form_of_a_goal_leads_to_the_page_of_the_manual(user: User, site: Site) -> None:
    await user.open("/new?template=bell")
    (link,) = user.find("Kinds and keys of goals").elements
    await user.open(link.props["href"])
    assert user.client.title == "Goals · AID-SR"
    assert '<h2 id="an-order-of-stages">' in shown(user).replace('\\"', '"')
    assert "```" not in shown(user), "each block of code is one, also with a title"
    assert (await user.http_client.get("/docs/images/web/home.png")).status_code == 200
    await user.open("/docs/gaols.md")
    await user.should_see('no page "gaols" in the manual')


def asked_by_hand(directory: Path, number: int, said: str) -> None:
    directory.mkdir(parents=True, exist_ok=True)
    first = f"<!-- AID-SR question {'0' * 64}, asked by the coder -->"
    (directory / f"{number:04d}.prompt.md").write_text(f"{first}\n{said}")


@visiting
async def test_a_prompt_is_answered_by_hand(user: User, site: Site) -> None:
    directory = site.own / "prompts" / "1"
    asked_by_hand(directory, 1, f"Write a robot. {SCRIPT}")
    run = made_run(site.library.path, model=f"manual:{directory}", waiting=True)
    with EventLog(run.events):
        await user.open(f"/run/{run.path.name}")
        await user.should_see("Prompt 1 of the coder")
        await user.should_see("Write a robot.")
        await user.should_see("by hand")
        await user.should_not_see(f"manual:{directory}")
        assert site.view(run).shown == "waiting"
        press(user, "Send the reply")
        await user.should_see("the reply is empty")
        user.find("The whole reply").type("<mujoco/>")
        press(user, "Send the reply")
        await user.should_not_see("Prompt 1 of the coder", retries=30)
    assert (directory / "0001.reply.md").read_text() == "<mujoco/>"


@visiting
async def test_a_prompt_after_a_refused_reply_says_why(user: User, site: Site) -> None:
    directory = site.own / "prompts" / "1"
    asked_by_hand(
        directory, 1, "\n===== EARLIER REPLY =====\n\n<mujoco/>\n\n===== MESSAGE =====\n\nThe reply was empty.\n"
    )
    run = made_run(site.library.path, model=f"manual:{directory}", designs=1)
    (run.design(1).path / "outcome.json").unlink()
    with EventLog(run.events):
        await user.open(f"/run/{run.path.name}")
        await user.should_see("Feedback on your last reply")
        await user.should_see("The reply was empty.")


def test_a_prompt_is_answered_once_and_only_within_the_folder_of_runs(tmp_path: Path) -> None:
    site = Site.at(tmp_path / "runs")
    outside = tmp_path / "elsewhere"
    asked_by_hand(outside, 1, "Write.")
    with pytest.raises(UserError, match="outside the folder of runs"):
        prompts_of(site, made_run(site.library.path, model=f"manual:{outside}"))
    (prompt,) = pending_prompts(outside)
    answer(prompt, "first")
    with pytest.raises(UserError, match="already answered"):
        answer(prompt, "second")
    with pytest.raises(UserError, match=r"the reply has 1,000,001 characters, more than 1,000,000;"):
        answer(prompt, "x" * 1_000_001)
    assert sorted(path.name for path in outside.iterdir()) == ["0001.prompt.md", "0001.reply.md"]
    assert prompt.reply.read_text() == "first"


@visiting
async def test_a_double_click_does_a_thing_once(user: User, site: Site) -> None:
    done: list[str] = []

    def pay() -> str:
        done.append("paid")
        return f"paid {len(done)}"

    @ui.page("/double")
    def double() -> None:
        go = ui.button("Pay", on_click=lambda: working(go, pay, ui.label))

    await user.open("/double")
    press(user, "Pay")
    press(user, "Pay")
    await user.should_see("paid 1")
    press(user, "Pay")
    await user.should_see("paid 2")
    await asyncio.sleep(0.3)  # a click that counted twice would show by now
    assert len(done) == 2, "once for two clicks while it was being done, and once for a click afterwards"


@visiting
async def test_the_form_is_kept_and_keys_are_never_shown(user: User, site: Site) -> None:
    os.environ["OPENAI_API_KEY"] = "sk-do-not-show-me"
    try:
        await user.open("/new")
        press(user, "A language model")
        await user.should_see("OPENAI_API_KEY")
        await user.should_see("key set")
        assert "sk-do-not-show-me" not in shown(user)
        press(user, "tunnel")
        await user.open("/new")
        await user.should_see("ANTHROPIC_API_KEY")
    finally:
        del os.environ["OPENAI_API_KEY"]


def test_what_a_run_will_cost_rests_on_runs_here_and_says_so(tmp_path: Path) -> None:
    site = Site.at(tmp_path)
    made_run(tmp_path, model="ollama:made")
    said = estimated_cost(site, "ollama:made", 2)
    assert said.startswith("About 2 calls, 2000 in, 1000 out tokens, cost $0.5000: the mean of 3 earlier designs")
    assert estimated_cost(site, "no model", 2) == ""
    assert estimated_cost(site, "builtin", 2) == "No language model: no calls, no cost."


def test_limits_become_a_budget() -> None:
    assert budget_from(FRESH | {"cost_usd": 2.5, "tokens": 5000.0}) == Budget(cost_usd=2.5, tokens=5000)
    for change, sentence in (
        ({"cost_usd": 0}, r"Maximum cost of the run \[USD\] must be above 0, or empty for no limit"),
        ({"tokens": 0.5}, "Maximum tokens of the run must be a whole number above 0, or empty for no limit"),
    ):
        with pytest.raises(UserError, match=sentence):
            budget_from(FRESH | change)


def test_a_refinement_may_be_about_one_part() -> None:
    assert refinement(" softer ", "robot/tip").text == "About robot/tip: softer"
    with pytest.raises(UserError, match="needs text"):
        refinement("  ", "robot/tip")


def test_parts_are_named_by_safe_loading_only() -> None:
    scene = '<mujoco><worldbody><body name="table"/><body name="robot/tip"><geom size="1"/></body></worldbody></mujoco>'
    assert part_names(scene) == ["robot/tip"]
    entity = '<!DOCTYPE m [<!ENTITY a SYSTEM "file:///etc/passwd">]>'
    assert part_names(f'{entity}<mujoco><worldbody><body name="&a;"/></worldbody></mujoco>') == []
