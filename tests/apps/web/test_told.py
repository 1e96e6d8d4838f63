"""What a page tells when something else happens than was asked for."""

import json
import os
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from made import made_run, made_training
from nicegui.testing import User
from test_pages import at_work, shown, visiting

from aidsr import api
from aidsr.apps.web.compare_page import _Compared
from aidsr.apps.web.comparison import comparison_column
from aidsr.apps.web.measure_form import goal_file
from aidsr.apps.web.recorded_episodes import record_probed
from aidsr.apps.web.site import Site
from aidsr.apps.web.training_form import continues
from aidsr.core.artifacts import Decision, EpisodeResult
from aidsr.core.errors import UserError
from aidsr.examples import examples
from aidsr.learn.openloop import Motion, ProbeReport
from aidsr.learn.openloop.report import ProbedVariation
from aidsr.runs import EventLog
from aidsr.runs.events import Started
from aidsr.runs.files import replace_file
from aidsr.runs.trainings import Training


@visiting
async def test_a_process_that_was_asked_to_end_is_shown_as_stopping(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1)
    (made_training(run.design(1)) / "evaluation.json").unlink()
    name = site.training_name(run, 1)
    with at_work(site, name):
        for page in ("/work", f"/run/{run.name}/1?tab=training"):
            await user.open(page)
            assert '"Stop"' in shown(user)
            asked = site.processes.folder / f"{name}.stopping"
            asked.write_text("0")
            site.activities._read_s = -float("inf")
            await user.open(page)
            await user.should_see("Stopping…")
            assert '"Stop"' not in shown(user)
            asked.unlink()


@visiting
async def test_the_output_of_a_process_that_refused_to_start_is_shown(user: User, site: Site) -> None:
    run = made_run(site.library.path, designs=1, waiting=True)
    pages = (f"/run/{run.name}", f"/run/{run.name}/1")
    with at_work(site, run.name, "the key OPENAI_API_KEY is not set"):
        run.design(1).iteration(2).decision.write(Decision(verdict="refine", text="Make it longer."))
        for page in pages:
            await user.open(page)
            await user.should_not_see("OPENAI_API_KEY is not set")
            await user.should_not_see("no process works on this run")
    for page in pages:
        await user.open(page)
        await user.should_see("OPENAI_API_KEY is not set")
    await user.should_see("Your decision is written, but no process works on this run.")
    with EventLog(run.events) as log:
        log.write(Started())
    await user.open(pages[0])
    await user.should_not_see("OPENAI_API_KEY is not set")


COMMAND = ["train", "x", "--steps", "4000", "--seeds", "2", "--first-seed", "3", "--protocol", "paper", "--no-videos"]


@pytest.mark.parametrize(
    ("config", "continued"),
    [
        ({"steps": 4000, "seed": 4, "recipe": {"algorithm": "ppo"}}, True),
        ({"steps": 4000, "seed": 5, "recipe": {"algorithm": "ppo"}}, False),
        ({"steps": 60000, "seed": 4, "recipe": {"algorithm": "ppo"}}, False),
        ({"steps": 4000, "seed": 4, "recipe": {"algorithm": "sac"}}, False),
    ],
)
def test_only_the_training_of_the_command_is_continued(
    config: dict[str, object], continued: bool, tmp_path: Path
) -> None:
    replace_file(tmp_path / "config.json", json.dumps(config).encode())
    assert continues(COMMAND, Training(tmp_path)) == continued
    assert not continues(["train", "x"], Training(tmp_path))


@visiting
async def test_a_training_that_was_stopped_elsewhere_is_not_continued_by_an_older_command(
    user: User, site: Site
) -> None:
    run = made_run(site.library.path, designs=1)
    (made_training(run.design(1)) / "evaluation.json").unlink()
    events = run.design(1).path / "training" / "001" / "events.jsonl"
    replace_file(run.design(1).path / "training" / "001" / "config.json", b'{"steps": 4000, "seed": 3}')
    note = site.processes.folder / f"{site.training_name(run, 1)}.json"
    replace_file(note, json.dumps({"pid": 0, "command": COMMAND}).encode())
    for began_s, offered in ((time.time() - 60, False), (time.time() + 60, True)):
        replace_file(events, b"")
        os.utime(events, (began_s, began_s))
        await user.open(f"/run/{run.name}/1?tab=training")
        await user.should_see("Training 1 was stopped before its first steps.")
        assert ("Continue training" in shown(user)) == offered
        assert ("the command that started it continues it" in shown(user)) != offered


def test_a_probe_is_not_replayed_under_another_goal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = SimpleNamespace(task=SimpleNamespace(name="touch the gong"), scene="<mujoco/>")
    monkeypatch.setattr(api, "find_scene", lambda *_, **__: found)
    site = Site.at(tmp_path / "runs")
    run = made_run(site.library.path, designs=1, task="", objective="Ring the bell.")
    won = EpisodeResult(variation=0, ended="succeeded", progress=1, best_progress=1, time_s=1, reward=1)
    probed = ProbedVariation(episode=won, family="pull", motion=Motion(begin_s=0, ramp_s=1, frequency_hz=1, groups=()))
    goal, report = goal_file(site, site.probe_name(run, 1)), run.design(1).path / "probe.json"
    replace_file(goal, examples()["bell"].goal.encode())
    for task, age_s in (("touch the gong", -60), ("another kind of goal", 60)):
        written = ProbeReport(
            task=task, level="standard", benchmark_version=7, seed=0, candidates=16, searched_s=1, simulated_s=1,
            wall_s=1, variations=(probed,), same_motion_share=1, reached="held success",
        )  # fmt: skip
        replace_file(report, written.model_dump_json().encode())
        os.utime(report, (time.time() + age_s, time.time() + age_s))
        with pytest.raises(UserError, match="the goal was changed since this probe; probe again"):
            record_probed(site, run, run.design(1), 0)


def test_what_is_compared_of_a_design_is_of_one_policy(tmp_path: Path) -> None:
    site = Site.at(tmp_path / "runs")
    run = made_run(site.library.path, designs=1)
    design = run.design(1)
    assert _Compared(site, run, design).training is None
    made_training(design, won=(True, True)).rename(design.path / "training" / "002")
    made_training(design, won=(False, True))
    made_training(design, won=(False, False)).rename(design.path / "training" / "003")
    made_training(design, won=(False, True))
    training = _Compared(site, run, design).training
    assert training is not None
    assert training.number == 2
    assert ("held-out success", "100 % of 2") in comparison_column(run.name, design, site.view(run).designs[0]).rows
