"""What a person typed or chose is kept: own words under a template, the jobs of a study, a prompt to copy."""

import re
from pathlib import Path

from made import made_run
from nicegui import app
from nicegui.testing import User
from test_pages import asked_by_hand, noting, press, visiting
from test_studies_panel import made_study

from aidsr.apps.web.setup_page import FRESH
from aidsr.apps.web.site import Site
from aidsr.apps.web.words_form import take_back, take_template
from aidsr.examples import examples
from aidsr.runs import EventLog
from aidsr.runs.files import replace_file


def test_own_words_under_two_templates_are_taken_back() -> None:
    first, second = list(examples())[:2]
    own = {"objective": "Turn my knob.", "environment": "<mujoco/>", "environment_name": "mine.xml"}
    form = {**FRESH, **own}
    take_template(form, first)
    take_template(form, second)
    assert form["objective"] == examples()[second].objective
    take_back(form)
    assert {key: form[key] for key in own} == own
    assert form["goal"] == ""
    assert "replaced" not in form


@visiting
async def test_a_template_can_be_undone(user: User, site: Site) -> None:
    await user.open("/new")
    form = app.storage.user["setup"]
    form.update(source="words", objective="Turn my knob.")
    take_template(form, next(iter(examples())))
    await user.open("/new")
    await user.should_see("The template replaced your own words.")
    press(user, "Undo")
    await user.should_see("Turn my knob.")
    assert form["objective"] == "Turn my knob."


def test_a_study_is_resumed_with_its_number_of_jobs(tmp_path: Path) -> None:
    site, started = noting(Site.at(tmp_path))
    site.studies._processes = site.processes
    made_study(tmp_path / "first")
    site.studies.resume("first")
    note = b'{"pid": 0, "command": ["benchmark", "first", "--resume", "--jobs", "7"]}'
    replace_file(site.processes.folder / "first~study.json", note)
    site.studies.resume("first")
    assert [command[-1] for command in started] == ["2", "7"]


@visiting
async def test_it_is_said_where_a_browser_does_not_copy(user: User, site: Site) -> None:
    directory = site.own / "prompts" / "1"
    asked_by_hand(directory, 1, "Write a robot.")
    run = made_run(site.library.path, model=f"manual:{directory}", waiting=True)
    with EventLog(run.events):
        await user.open(f"/run/{run.name}")
        for copied, said in ((False, "this browser copies only over HTTPS"), (True, "Copied.")):
            user.javascript_rules[re.compile(".*clipboard.*")] = lambda _match, copied=copied: copied
            press(user, "Copy the prompt")
            await user.should_see(said)
        await user.should_not_see("this browser copies only over HTTPS")


@visiting
async def test_a_run_that_is_a_link_says_how_to_open_it(user: User, site: Site) -> None:
    run = made_run(site.library.path.parent / "elsewhere")
    site.library.path.mkdir(exist_ok=True)
    (site.library.path / "linked").symlink_to(run.path)
    for page in ("/", "/run/linked"):
        await user.open(page)
        await user.should_see("but a link; move or copy the run there, or give the folder that holds it with --runs")
