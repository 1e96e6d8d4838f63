"""The tools of a session: what is recorded, what is never carried out twice, what the budget refuses."""

from __future__ import annotations

import json
import shutil
from itertools import count
from pathlib import Path
from typing import NoReturn

import pytest
from tests.tools.test_catalogue import travelling, with_cart
from tests.tools.test_statics import limb

from aidsr.core.calls import Question, ToolCall
from aidsr.core.errors import BudgetError
from aidsr.teams.measuring.own_tools import Chosen, chosen, write_chosen
from aidsr.teams.measuring.records import ToolRecord
from aidsr.teams.measuring.session import Session
from aidsr.teams.measuring.toolbox import Toolbox, ToolBudget
from aidsr.tools import Workspace
from aidsr.tools.probing import MEAN_PROGRESS

FAMILIES = [{"name": name, "idea": "It pulls."} for name in ("arm", "claw", "worm", "ring")]


def toolbox(folder: Path, calls: int = 20, minutes: float = 30.0, work: Workspace | None = None) -> Toolbox:
    ticks = count()
    work = work or Workspace(folder / "work")
    return Toolbox(work, folder, ToolBudget(calls, minutes), clock=lambda: 60.0 * next(ticks))


def call(box: Toolbox, tool: str, /, **arguments: object) -> ToolRecord:
    return box.call(ToolCall(id="1", name=tool, arguments=json.dumps(arguments)))


def proposed(folder: Path, **options) -> Toolbox:
    box = toolbox(folder, **options)
    assert call(box, "propose", families=FAMILIES).outcome == "done"
    return box


def test_four_families_come_first(tmp_path: Path) -> None:
    box = toolbox(tmp_path)
    assert "propose families of bodies first" in call(box, "validate", mjcf=limb(), family="arm").text
    assert "3 families; propose at least 4" in call(box, "propose", families=[*FAMILIES[:3], FAMILIES[0]]).text
    assert call(box, "propose", families=FAMILIES).text.startswith("noted: arm, claw, worm, ring")
    assert call(box, "validate", mjcf=limb(), family="arm").text.startswith("robot_2:"), (
        "the name of what was not made is used up"
    )


def test_a_measurement_that_was_asked_for_before_is_not_carried_out_again(tmp_path: Path) -> None:
    box = proposed(tmp_path)
    first = call(box, "validate", mjcf=limb(), functional_part="tip", family="arm")
    assert call(box, "validate", mjcf=limb(), functional_part="tip", family="arm") is first
    assert call(box, "validate", mjcf=limb(), family="arm").text.startswith("robot_2:"), (
        "another argument is another call"
    )
    assert box.calls_made == 2


def test_a_session_that_goes_on_gets_its_results_and_its_refusals_again(tmp_path: Path) -> None:
    box = toolbox(tmp_path)
    calls = [
        ("validate", {"mjcf": limb(), "family": "arm"}),
        ("propose", {"families": FAMILIES}),
        ("validate", {"mjcf": limb(), "family": "arm"}),
        ("measure", {"what": "bends", "subject": "robot_2"}),
        ("measure", {"what": "bends", "subject": "robot_9"}),
    ]
    before = [call(box, name, **arguments) for name, arguments in calls]
    assert [record.outcome for record in before] == ["refused", "done", "done", "done", "failed"]
    files = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()}
    again = toolbox(tmp_path)
    assert [call(again, name, **arguments) for name, arguments in calls] == before
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()} == files
    assert call(again, "validate", mjcf=limb(9.81), family="arm").text.startswith("robot_3:")
    assert (tmp_path / "tools" / "0006_validate.json").is_file()


def test_what_an_interrupted_call_made_is_removed_and_made_again_under_the_same_name(tmp_path: Path) -> None:
    box = proposed(tmp_path)
    call(box, "validate", mjcf=limb(), family="arm")
    call(box, "validate", mjcf="<mujoco", family="snake")
    box.workspace.add_robot(box.workspace.robot("robot_1"))  # a call that was killed before it was recorded
    box.workspace.skip("scene")
    again = toolbox(tmp_path)
    again.remove_unrecorded()
    assert sorted(path.name for path in again.workspace.folder.glob("*_[0-9]*")) == ["robot_1", "robot_2"]
    assert again.workspace.is_skipped("robot_2")
    assert call(again, "validate", mjcf=limb(9.81), family="arm").made == "robot_3"
    again.remove_unrecorded(kept=("robot_4",))
    assert again.workspace.add_robot(again.workspace.robot("robot_1")) == "robot_4"
    again.remove_unrecorded(kept=("robot_4",))
    assert again.workspace.robot("robot_4")


def test_calls_and_minutes_are_counted_and_kept_within_the_budget(tmp_path: Path) -> None:
    box = proposed(tmp_path, calls=2)
    call(box, "validate", mjcf=limb(), family="arm")
    assert (box.calls_made, box.minutes_used) == (1, 2.0)
    assert call(box, "measure", what="bends", subject="robot_1").outcome == "done"
    refused = call(box, "measure", what="load", subject="robot_1")
    assert (refused.outcome, refused.text.splitlines()[0]) == (
        "refused",
        "not carried out: all 2 calls are used: finish with the best scene",
    )
    assert call(box, "read", name="robot_1").outcome == "done", "what costs nothing goes on"
    short = proposed(tmp_path / "short", minutes=2)
    call(short, "validate", mjcf=limb(), family="arm")
    assert "all 2 minutes are used" in call(short, "validate", mjcf=limb(9.81), family="arm").text


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [("weigh", "{}", "no tool 'weigh'"), ("fix", "{", "no JSON"), ("fix", "[]", "no JSON object")],
)
def test_mistakes_are_results(tmp_path: Path, name: str, arguments: str, message: str) -> None:
    box = proposed(tmp_path)
    record = box.call(ToolCall(id="1", name=name, arguments=arguments))
    assert (record.outcome, message in record.text, box.calls_made) == ("refused", True, 0)


def with_scene(folder: Path, **options) -> Toolbox:
    """A toolbox with a scene, called stable, of a robot that came back: no families have to be measured."""
    work = with_cart(folder)
    path = work.folder / "scene_1" / "scene.json"
    path.write_text(path.read_text().replace('"stable": false', '"stable": true'))
    box = proposed(folder, work=work, **options)
    box.explore = False
    return box


def explored(folder: Path, families: int) -> Toolbox:
    """A toolbox with a robot of each family, of which some were measured."""
    box = proposed(folder, calls=60)
    for family in FAMILIES:
        call(box, "validate", mjcf=limb(), family=family["name"])
    for number in range(1, families + 1):
        assert call(box, "measure", what="bends", subject=f"robot_{number}").outcome == "done"
    return box


PATCH = '<set sel="//body/joint" stiffness="0.2"/>'
SWEEP = {"subject": "robot_1", "select": "//body/joint", "attribute": "stiffness", "values": ["0.2"], "what": "bends"}


def test_one_body_of_each_family_is_measured_before_any_is_refined(tmp_path: Path) -> None:
    box = explored(tmp_path, 3)
    for name, arguments in (
        ("edit", {"robot": "robot_1", "patch": PATCH}),
        ("sweep", SWEEP),
        ("train", {"scene": "s"}),
    ):
        refused = call(box, name, **arguments)
        assert (refused.outcome, "trained or finished with; not yet: ring" in refused.text) == ("refused", True)
    assert call(box, "edit", robot=["robot_1"], patch=PATCH).outcome == "failed", "the arguments are checked"
    cured = call(box, "edit", robot="robot_4", patch=PATCH)
    assert cured.text.startswith("robot_7:"), "what was not measured may be cured"
    assert call(box, "measure", what="bends", subject="robot_7").outcome == "done", "an edit is of the same family"
    assert call(box, "edit", robot="robot_1", patch=PATCH).outcome == "done"
    assert call(box, "sweep", **SWEEP).outcome == "done"


def test_a_family_that_comes_to_nothing_three_times_holds_up_no_other(tmp_path: Path) -> None:
    box = explored(tmp_path, 3)
    call(box, "validate", mjcf=limb(9.81), family="ring")
    assert call(box, "sweep", **SWEEP).outcome == "refused"
    call(box, "validate", mjcf=limb(1.62), family=" Ring ")
    assert call(box, "sweep", **SWEEP).outcome == "done"


def test_a_robot_is_of_a_family_that_was_proposed(tmp_path: Path) -> None:
    refused = call(proposed(tmp_path), "validate", mjcf=limb(), family="snake")
    assert refused.outcome == "failed"
    assert 'no family "snake" was proposed; families: arm, claw, worm, ring; propose again' in refused.text


def measured(name: str, scene: str, text: str = "", seeds: list[int] | None = None, **figures: float) -> ToolRecord:
    """A record as a long measurement leaves it."""
    values = {"scene": scene, **({"seeds": seeds} if seeds else {})}
    return ToolRecord(name=name, arguments=json.dumps(values), text=text, outcome="done", seconds=1.0, figures=figures)


def far(scene: str, progress: float, seeds: list[int]) -> ToolRecord:
    found = measured("probe", scene, seeds=seeds)
    return found.model_copy(update={"figures": {MEAN_PROGRESS: progress}})


def test_the_result_is_what_came_farthest_over_several_seeds(tmp_path: Path) -> None:
    box = with_scene(tmp_path)
    shutil.copytree(box.workspace.folder / "scene_1", box.workspace.folder / "scene_2")
    box._records += [far("scene_1", 0.4, [0, 1]), far("scene_2", 0.9, [0]), far("scene_2", 0.5, [3])]
    refused = call(box, "finish", scene="scene_1", summary="A cart.")
    assert (
        "over several seeds scene_2 came to progress 0.70 and scene_1 to 0.40: finish with the better" in refused.text
    )
    assert box.exploration.best_again() == ("scene_2", pytest.approx(0.7))
    assert call(box, "finish", scene="scene_2", summary="A cart.").outcome == "done"


def test_what_was_only_trained_is_compared_with_what_was_probed(tmp_path: Path) -> None:
    box = with_scene(tmp_path)
    shutil.copytree(box.workspace.folder / "scene_1", box.workspace.folder / "scene_2")
    box._records += [far("scene_1", 0.9, [0, 1]), measured("train", "scene_2", success=0.0, progress=0.1)]
    refused = call(box, "finish", scene="scene_2", summary="A cart.")
    assert "scene_1 came to progress 0.90 and scene_2, by what was measured of it, to 0.10" in refused.text
    box._records += [measured("play", "scene_2", success=0.0, progress=0.88)]
    assert call(box, "finish", scene="scene_2", summary="A cart.").outcome == "done"


def test_each_seed_counts_the_same(tmp_path: Path) -> None:
    box = with_scene(tmp_path)
    box._records += [far("scene_1", 0.9, [0]), far("scene_1", 0.5, [1, 2, 3])]
    assert box.exploration.progress_again("scene_1") == pytest.approx(0.6)


def test_one_seed_puts_no_scene_first_and_an_unstable_one_is_no_result(tmp_path: Path) -> None:
    box = with_scene(tmp_path)
    box._records += [far("scene_1", 0.9, [4])]
    assert box.exploration.best_again() is None
    box._records += [far("scene_1", 0.9, [5])]
    assert box.exploration.best_again() == ("scene_1", pytest.approx(0.9))
    path = box.workspace.folder / "scene_1" / "scene.json"
    path.write_text(path.read_text().replace('"stable": true', '"stable": false'))
    assert box.exploration.best_again() is None


def won(name: str, script: str, episodes: int, of: int) -> ToolRecord:
    """A record of a script, or of a training, that won so many episodes of scene_1."""
    values = {"scene": "scene_1", **({"script": script} if script else {})}
    figures = {"success": episodes / of, "episodes": of}
    return measured(name, "scene_1", **figures).model_copy(update={"arguments": json.dumps(values)})


def test_the_script_that_won_most_goes_along_with_its_scene(tmp_path: Path) -> None:
    box = with_scene(tmp_path)
    box._records += [won("play", "*: 0.1", 3, 8), won("play", "*: 0.2", 1, 2)]
    assert box.exploration.script_for("scene_1") == "*: 0.2"
    box._records += [won("play", "*: 0.3", 7, 8), won("play", "*: 0.4", 7, 8), won("play", "*: 0.5", 1, 1)]
    assert box.exploration.script_for("scene_1") == "*: 0.4", (
        "the later of two that are as good; one of one says little"
    )
    assert box.exploration.script_for("scene_2") == ""
    box._records.append(won("probe", "", 8, 8))
    assert box.exploration.script_for("scene_1") == "*: 0.4", "a probe plays another motion in each variation"
    box._records.append(won("train", "*: 0.4", 20, 20))
    assert box.exploration.script_for("scene_1") == "*: 0.4"


def test_a_script_that_wins_less_than_half_or_than_a_training_from_nothing_is_left(tmp_path: Path) -> None:
    box = with_scene(tmp_path)
    box._records += [won("play", "*: 0.1", 3, 8)]
    assert box.exploration.script_for("scene_1") == ""
    box._records += [won("play", "*: 0.1", 6, 8), won("train", "", 19, 20)]
    assert box.exploration.script_for("scene_1") == ""


def test_what_a_script_wins_is_counted(tmp_path: Path) -> None:
    box = with_scene(tmp_path)
    script = "*: 1"
    lost = call(box, "play", scene="scene_1", script=script, variations=[0, 1])
    assert lost.figures["success"] == 0.0
    assert box.exploration.script_for("scene_1") == ""


def test_a_training_that_succeeds_ends_the_work(tmp_path: Path) -> None:
    box = with_scene(tmp_path)
    box._records += [
        measured("train", "scene_1", success=0.45, valid=1.0),
        measured("train", "scene_1", success=1.0, valid=0.0),
    ]
    assert box.exploration.succeeded() is None
    box._records += [measured("train", "scene_1", "success in 55%\n3 failed", success=0.55, valid=1.0)]
    assert box.exploration.succeeded() == ("scene_1", "success in 55%")


def test_a_scene_is_measured_again_before_it_is_the_result(tmp_path: Path) -> None:
    box = with_scene(tmp_path)
    assert "scene_1 was not measured again" in call(box, "finish", scene="scene_1", summary="A cart.").text
    for variation in range(3):
        call(box, "play", scene="scene_1", script="drive: 1", seconds=0.2, variation=variation)
    assert call(box, "finish", scene="scene_1", summary="A cart.").outcome == "done"
    found = chosen(box.workspace, "finished")
    assert found is not None
    assert (found.scene, found.why, found.measured) == ("scene_1", "A cart.", True)


def test_with_the_budget_spent_it_may_finish_at_once(tmp_path: Path) -> None:
    box = with_scene(tmp_path, calls=1)
    call(box, "play", scene="scene_1", script="drive: 1", seconds=0.2)
    assert call(box, "finish", scene="scene_1", summary="A cart.").outcome == "done"


def test_the_last_scene_that_was_kept_counts(tmp_path: Path) -> None:
    box = with_scene(tmp_path)
    call(box, "assemble", robot="robot_1", placement={"mount": "mount", "base": "fixed", "position_m": [0, 0, 0.1]})
    path = box.workspace.folder / "scene_2" / "scene.json"
    path.write_text(path.read_text().replace('"stable": false', '"stable": true'))
    for scene in ("scene_1", "scene_2", "scene_1"):
        assert call(box, "keep", scene=scene, why="faster").outcome == "done"
    found = chosen(box.workspace, "kept")
    assert found is not None
    assert (found.scene, found.measured) == ("scene_1", False)


def test_a_scene_that_is_not_stable_is_neither_kept_nor_the_result(tmp_path: Path) -> None:
    box = proposed(tmp_path, work=with_cart(tmp_path))
    assert "scene_1 is not stable" in call(box, "keep", scene="scene_1", why="best").text
    assert 'no scene "scene_7"' in call(box, "keep", scene="scene_7", why="best").text
    assert chosen(travelling(tmp_path), "kept") is None


class Spent:
    """A model whose budget allows no call."""

    name = "spent"

    def ask(self, _question: Question) -> NoReturn:
        raise BudgetError("1,000 tokens are spent", "tokens")


def test_what_was_kept_is_the_result_of_a_spent_budget_unless_the_run_may_get_another(tmp_path: Path) -> None:
    box = proposed(tmp_path)
    write_chosen(box.workspace, "kept", Chosen(scene="scene_1", why="the only one"))
    assert Session(Spent(), box, text_tools=True).run("The job.").scene == "scene_1"
    with pytest.raises(BudgetError, match="1,000 tokens are spent"):
        Session(Spent(), box, text_tools=True, may_continue=True).run("The job.")
