"""A run of a study in the pages: shown like every other, and not trained, probed or paid for outside its study."""

from made import made_training
from nicegui.testing import User
from test_pages import shown, visiting
from test_studies_panel import made_study

from aidsr.apps.web.site import Site
from aidsr.core.artifacts import Outcome
from aidsr.runs.files import replace_file


@visiting
async def test_a_design_of_a_study_has_no_form_to_train_or_probe_it(user: User, site: Site) -> None:
    made_study(site.library.path / "first")
    (begun, _) = site.studies.view("first").cells
    folder = made_training(site.run(begun.name).design(1))
    (folder / "evaluation.json").unlink()
    name = site.training_name(site.run(begun.name), 1)
    replace_file(site.processes.folder / f"{name}.json", b'{"pid": 0, "command": ["train", "x"]}')
    for tab, said in (("training", "policies are trained by the plan"), ("probe", "designs are probed by the plan")):
        await user.open(f"/run/{begun.name}/1?tab={tab}")
        await user.should_see(f"This run belongs to the study “first”. Its {said} of the study.")
        for offered in ("Start training", "Continue training", "Start the probe"):
            assert offered not in shown(user)


@visiting
async def test_a_run_of_a_study_is_not_given_a_budget_of_its_own(user: User, site: Site) -> None:
    made_study(site.library.path / "first")
    (begun, _) = site.studies.view("first").cells
    used_up = Outcome(outcome="out_of_budget", reason="used up", iteration=2)
    replace_file(site.run(begun.name).design(1).outcome.path, used_up.model_dump_json().encode())
    await user.open(f"/run/{begun.name}")
    await user.should_see("To continue, resume the study in a terminal with a larger limit.")
    assert "Resume with this budget" not in shown(user)
