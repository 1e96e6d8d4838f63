"""What a page tells when something else happens than was asked for."""

from made import made_run, made_training
from nicegui.testing import User
from test_pages import at_work, shown, visiting

from aidsr.apps.web.site import Site


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
