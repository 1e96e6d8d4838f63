"""What a page tells when something else happens than was asked for."""

from made import made_run, made_training
from nicegui.testing import User
from test_pages import at_work, shown, visiting

from aidsr.apps.web.site import Site
from aidsr.core.artifacts import Decision
from aidsr.runs import EventLog
from aidsr.runs.events import Started


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
