"""The table of the built-in team says how much of it was measured."""

import importlib.util
import io
import json
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from aidsr.core.artifacts import EpisodeResult, Evaluation, PlausibilityCheck
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.learn.rl.recipe import PROTOCOLS, Recipe
from aidsr.studies.outcomes import DesignRow
from aidsr.studies.study import Arm, StudyPlan, create_study
from aidsr.studies.tables import IN_SAMPLE
from aidsr.tasks import BENCHMARK_VERSION, TASKS_OUT_OF_SAMPLE

PATH = Path(__file__).parents[2] / "benchmarks" / "builtin" / "table.py"
TASKS = ("reaching/button_pushing", "locomotion/gap")


@pytest.fixture(scope="module")
def program():
    spec = importlib.util.spec_from_file_location("builtin_table", PATH)
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)  # there pydantic looks types up
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def study(tmp_path):
    arm = Arm(name="builtin", config=RunConfig(model="builtin", concepts=1))
    plan = StudyPlan(tasks=TASKS, arms=(arm,), runs=5, protocol="paper", versions={"mujoco": "3.17.0"})
    return create_study(tmp_path / "study", plan)


def outcome(program, **changed):
    facts = {"task": TASKS[0], "level": "standard", "design": 2, "family": "arm", "outcome": "approved", "valid": True}
    facts |= {"successful": True, "success_share": 0.75, "steps": 1000, "training_s": 60.0, "mujoco": "3.17.0"}
    facts |= {
        "benchmark_version": BENCHMARK_VERSION,
        "recipe": Recipe().model_dump(mode="json"),
        "most_steps": 300_000,
        "best_progress": 0.9,
    }
    return program.Row(**facts | changed)


def written(path, *outcomes):
    path.write_text("".join(each.model_dump_json() + "\n" for each in outcomes))
    return path


def test_designs_that_did_not_end_are_in_no_rate(program, study):
    text = program.table(study.plan, program.merged(study, ()))
    assert "**0 of 10 planned designs came to an end**" in text
    assert "| locomotion/gap | 0 of 5 |  |  |  |  |" in text
    assert "0 of 2 tasks have a design that ended" in text


def test_what_was_measured_elsewhere_is_kept(program, study, tmp_path):
    found = outcome(program)
    assert program.kept(written(tmp_path / "some.jsonl", found), study.plan) == (found,)
    assert program.kept(tmp_path / "none.jsonl", study.plan) == ()
    text = program.table(study.plan, program.merged(study, [found]))
    assert "**1 of 10 planned designs came to an end**" in text
    rates = "1 of 1 (21% to 100%) | 1 of 1 (21% to 100%) | 0 of 1 | 0 of 1"
    assert f"| reaching/button_pushing | 1 of 5 | {rates} | 75% | 0.90 |" in text


def test_policies_that_resumed_while_learning_are_counted(program, study):
    text = program.table(study.plan, program.merged(study, [outcome(program, resumed=1)]))
    assert "1 of the policies resumed while learning" in text
    assert "resumed" not in program.table(study.plan, program.merged(study, [outcome(program)]))


def test_a_design_without_a_policy_is_in_no_mean(program, study):
    lost = outcome(program, outcome="out_of_iterations", valid=False, successful=False, success_share=0.0)
    lost = lost.model_copy(update={"best_progress": None, "steps": 0})
    text = program.table(study.plan, [lost])
    rates = "0 of 1 (0% to 79%) | 0 of 1 (0% to 79%) | 0 of 1 | 0 of 1"
    assert f"| reaching/button_pushing | 1 of 5 | {rates} | 0% |  |  |  | arm |" in text


def judged(study, *, seed: int = 0, valid: bool = False, won: int = 0, of: int = 1):
    """A policy of the study's first run as it is on disk, and its row."""
    cell = next(iter(study.cells))
    folder = study.home(cell) / "run"
    trained = folder / "designs" / "1" / "training" / f"{seed + 1:03d}"
    trained.mkdir(parents=True)
    (folder / "run.json").write_text("{}")
    config = {"benchmark_version": BENCHMARK_VERSION, "steps": 300_000, "recipe": Recipe().model_dump(mode="json")}
    config |= {"seed": seed, "scene_sha256": "5e", "versions": {"mujoco": "3.16.0"}}
    check = PlausibilityCheck(name="still", passed=valid, measured=0.0, limit=1.0, message="it stays still")
    lost = EpisodeResult(variation=0, ended="failed", progress=0.1, best_progress=0.4, reward=0.0, time_s=1.0)
    episodes = [lost.model_copy(update={"ended": "succeeded"})] * won + [lost] * (of - won)
    made = {"commit": "abc", "processor": "a CPU", "scene_sha256": "5e", "policy_sha256": f"p{seed}"}
    evaluation = Evaluation(
        task=cell.task, level="standard", benchmark_version=4, episodes=episodes, checks=[check], **made
    )
    (trained / "config.json").write_text(json.dumps(config))
    (trained / "training.json").write_text(json.dumps({"steps": 1000, "wall_s": 60.0}))
    (trained / "evaluation.json").write_text(evaluation.model_dump_json())
    (trained / "scene.xml").write_text("<mujoco/>")
    (trained / "normalisation.json").write_text("{}")
    with zipfile.ZipFile(trained / "policy.zip", "w") as archive:
        weights = io.BytesIO()
        torch.save({"actor.mu": torch.ones(2), "critic.qf0": torch.ones(9)}, weights)
        archive.writestr("policy.pth", weights.getvalue())
        archive.writestr("policy.optimizer.pth", b"more")
    return DesignRow(arm="builtin", task=cell.task, run=1, design=1, outcome="approved", evaluations=(evaluation,))


def test_a_policy_of_the_study_is_told_with_what_it_was_made_with(program, study):
    (found,) = program.rows_of(judged(study), study)
    assert (found.mujoco, found.scene_sha256, found.policy_sha256) == ("3.16.0", "5e", "p0")
    assert (found.commit, found.processor, found.steps) == ("abc", "a CPU", 1000)
    assert (found.episodes, found.failed_checks) == ({"failed": 1}, {"still": "it stays still"})
    assert "Evaluated at commit abc on a CPU." in program.table(study.plan, [found])


def test_a_design_counts_where_most_of_its_policies_do(program, study):
    more = replace(study, plan=study.plan.model_copy(update={"seeds": 3}))
    for seed, won in enumerate((19, 8, 10)):
        design = judged(more, seed=seed, valid=True, won=won, of=20)
    rows = program.rows_of(design, more)
    assert [(row.policy_seed, row.policy_sha256, row.success_share) for row in rows] == [
        (0, "p0", 0.95),
        (1, "p1", 0.4),
        (2, "p2", 0.5),
    ]
    text = program.table(more.plan, rows)
    assert "3 policies a design" in text
    assert "| 1 of 5 | 1 of 1 (21% to 100%) | 1 of 1 (21% to 100%) | 0 of 1 | 0 of 1 | 62% |" in text
    (reliable,) = program.rows_of(design, study)
    assert "| 1 of 1 (21% to 100%) | 1 of 1 | 1 of 1 | 95% |" in program.table(study.plan, [reliable])


def test_policies_are_published_without_what_only_training_needs(program, study, tmp_path):
    judged(study)
    program.publish(study, tmp_path / "out")
    (folder,) = (tmp_path / "out").glob("*/*")
    assert (folder.parent.name, folder.name) == ("button_pushing", "1-0")
    assert (folder / "scene.xml").read_text() == "<mujoco/>"
    with zipfile.ZipFile(folder / "policy.zip") as archive:
        assert archive.namelist() == ["policy.pth"]
        assert list(torch.load(io.BytesIO(archive.read("policy.pth")), weights_only=True)) == ["actor.mu"]


@pytest.mark.parametrize("name", ["results", "results-60000"])
def test_published_tables_of_earlier_versions_are_of_their_outcomes_and_say_so(program, name):
    rows = program.read_rows(PATH.parent / f"{name}.jsonl")
    text = (PATH.parent / f"{name}.md").read_text()
    assert text == program.table(program.plan_of(rows), rows, name)
    assert f"These are results of version {rows[0].benchmark_version} of the benchmark" in text
    assert IN_SAMPLE in text


def test_the_readme_tells_the_published_outcomes(program):
    rows = program.counting(program.read_rows(PATH.parent / "results-version8.jsonl"))
    valid, successful = sum(row.valid for row in rows), sum(row.successful for row in rows)
    readme = (PATH.parents[2] / "README.md").read_text()
    assert f"{len(rows)} of 54 designs" in readme
    assert f"{valid} valid, {successful} successful" in readme


def test_a_row_of_before_there_were_scripts_keeps_its_place(program):
    row = outcome(program, recipe={name: value for name, value in BEST.items() if name not in ("script", "correction")})
    plan = program.plan_of([row])
    assert program._fitting(row, plan, PATH) == row


def test_a_policy_that_is_a_motion_of_the_search_stays_and_is_counted(program):
    learned, found = outcome(program, recipe=BEST), outcome(program, recipe=BEST | {"script": "pull: 1"}, design=2)
    plan = program.plan_of([learned, found])
    assert program._fitting(found, plan, PATH) == found
    assert "1 of the policies are an open-loop motion" in program.table(plan, [learned, found])
    assert "open-loop" not in program.table(plan, [learned])


def test_policies_of_before_deep_overlap_was_penalized_stay_and_are_counted(program):
    before = outcome(program, recipe={name: value for name, value in BEST.items() if name != "overlap_penalty"})
    after = outcome(program, recipe=BEST, design=2)
    plan = program.plan_of([before, after])
    assert program._fitting(before, plan, PATH) == before
    assert "1 of the policies were trained before `best` penalized" in program.table(plan, [before, after])
    assert "penalized" not in program.table(plan, [after])


@pytest.mark.parametrize(
    "changed",
    [
        {"benchmark_version": 3},
        {"most_steps": 60_000},
        {"recipe": None},
        {"recipe": Recipe(epochs=3).model_dump(mode="json")},
        {"recipe": Recipe().model_dump(mode="json", exclude={"settling"})},
        {"level": "hard"},
        {"design": 6},
        {"policy_seed": 1},
        {"task": "locomotion/stairs"},
    ],
)
def test_what_a_table_has_no_place_for_is_not_overwritten(program, study, tmp_path, changed):
    path = written(tmp_path / "some.jsonl", outcome(program, **changed))
    with pytest.raises(UserError, match="has no place for it: version"):
        program.kept(path, study.plan)


def test_outcomes_of_a_task_that_has_changed_since_stay_in_the_file_and_are_in_no_figure(
    program, study, tmp_path, monkeypatch
):
    monkeypatch.setattr(program, "HOME", tmp_path)
    before = [outcome(program, benchmark_version=3), outcome(program, benchmark_version=3, design=3)]
    path = written(tmp_path / "some.jsonl", outcome(program, design=1), *before)
    program._write(study, program.kept(path, study.plan), "some")
    assert [row.design for row in program.read_rows(path)] == [1, 2, 3]
    page = path.with_suffix(".md").read_text()
    assert "2 older outcomes, of tasks that have changed since, are in no figure" in page
    assert "| reaching/button_pushing | 1 of 5 |" in page
    again = outcome(program, design=2)
    program._write(study, [*program.kept(path, study.plan), again], "some")
    assert program.read_rows(path)[1] == again


BEST = PROTOCOLS["best"].model_dump(mode="json")


@pytest.mark.parametrize(
    ("recipe", "protocol"), [(BEST, "best"), (BEST | {"updates": 4}, "best"), (None, "paper"), ({"epochs": 3}, "paper")]
)
def test_the_protocol_of_rows_is_told_also_where_its_recipe_was_another_then(program, recipe, protocol):
    assert program.plan_of([outcome(program, recipe=recipe)]).protocol == protocol


@pytest.mark.parametrize(
    ("other", "said"), [({"recipe": None}, "`best`.*`paper`"), ({"level": "hard"}, "hard.*standard")]
)
def test_rows_of_two_protocols_or_levels_are_no_table(program, other, said):
    with pytest.raises(UserError, match=f"rows of one table differ in version, level, budget or protocol: .*{said}"):
        program.plan_of([outcome(program, recipe=BEST), outcome(program, design=3, **{"recipe": BEST} | other)])


def test_tasks_in_and_out_of_sample_have_a_line_each_and_perturbed_success_a_column(program):
    new = TASKS_OUT_OF_SAMPLE[0]
    rows = [
        outcome(program, recipe=BEST, design=1, kept_perturbed={"delay": 0.8, "stiffness": 1.0}),
        outcome(program, recipe=BEST, design=1, task=new, successful=False, success_share=0.1),
    ]
    page = program.table(program.plan_of(rows), rows)
    head, *lines = [line for line in page.splitlines() if line.startswith("|")]
    cells = {line.split(" | ")[0].strip("| "): line.split(" | ") for line in lines[1:]}
    kept = head.split(" | ").index("perturbed, kept")
    assert [cells[name][kept] for name in (TASKS[0], new, "**in sample**", "**all**")] == ["90%", "", "90%", "90%"]
    assert cells["**in sample**"][3].startswith("1 of 1 ")
    assert cells["**out of sample**"][3].startswith("0 of 1 ")
