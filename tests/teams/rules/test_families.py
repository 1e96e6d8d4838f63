"""Every family writes clean MJCF, survives full drive, and is stable under the validator."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from jobs import FAMILIES, IDEAS, KINDS, OTHER_KINDS, brief, concept
from lxml import etree

from aidsr.mjcf.read import read_mjcf
from aidsr.tasks import load_task
from aidsr.teams import rules as builtin
from aidsr.teams.rules.coder import RuleCoder
from aidsr.teams.rules.job import read_job
from aidsr.validation import validate

TASKS = {kind: task for task, kind in {**KINDS, **OTHER_KINDS}.items()}
EVERY = [
    pytest.param(TASKS[kind], family, variant, id=f"{kind}-{family}-{variant}")
    for kind, table in IDEAS.items()
    for family, variants in table.items()
    for variant in variants
]


def robot(task: str, family: str, variant: str, seed: int = 0):
    return RuleCoder().write(brief(task), concept(task, family, variant, seed))


def test_every_variant_is_an_idea_for_some_job() -> None:
    offered = {(family, v) for table in IDEAS.values() for family, variants in table.items() for v in variants}
    assert offered == {(family.name, v) for family in FAMILIES.values() for v in family.variants}


@pytest.mark.parametrize(("task", "family", "variant"), EVERY)
def test_the_document_is_clean_and_complete(task: str, family: str, variant: str) -> None:
    made = robot(task, family, variant)
    root = read_mjcf(made.mjcf).root
    assert etree.tostring(root.find("compiler")) is not None
    bodies = root.findall(".//worldbody//body")
    assert all(body.get("name") for body in bodies)
    tendons = {item.get("name") for item in root.findall("tendon/spatial")}
    assert tendons
    assert {item.get("tendon") for item in root.findall("actuator/general")} == tendons
    kinds = {str(item.tag) for item in root.find("sensor")}
    assert {"tendonpos", "actuatorfrc", "framepos", "touch"} <= kinds
    assert any(item.get("name") == made.functional_part for item in root.iter("site"))
    names = [name for group in made.actuator_groups for name in group.actuators]
    assert len(names) == len(set(names))
    assert set(names) <= {item.get("name") for item in root.findall("actuator/general")}


@pytest.mark.parametrize(("task", "family", "variant"), EVERY)
def test_full_drive_for_two_seconds_raises_no_warning(task: str, family: str, variant: str) -> None:
    model = mujoco.MjModel.from_xml_string(robot(task, family, variant, seed=1).mjcf)
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    for _ in range(25):
        data.ctrl[:] = model.actuator_ctrlrange[:, 1] * (rng.random(model.nu) < 0.5)
        for _ in range(40):
            mujoco.mj_step(model, data)
    assert all(warning.number == 0 for warning in data.warning)
    assert np.isfinite(data.qpos).all()


@pytest.mark.parametrize(("task", "family", "variant"), EVERY)
def test_cables_only_pull_and_with_what_a_servo_gives(task: str, family: str, variant: str) -> None:
    model = mujoco.MjModel.from_xml_string(robot(task, family, variant).mjcf)
    assert (model.actuator_gainprm[:, 0] == -1).all()
    assert (model.actuator_ctrlrange[:, 0] == 0).all()
    assert (model.actuator_ctrlrange[:, 1] <= 60).all()


def test_parameters_survive_the_concept() -> None:
    for task, family, variant in (param.values for param in EVERY):
        made = concept(task, family, variant)
        assert FAMILIES[family].read(made).model_dump() == made.parameters


OBJECTS = {
    "missing": None,
    "tiny and near": {"along_m": 0.001, "near_m": 0.0, "beside_m": 0.0, "half_width_m": 0.0},
    "huge and far": {"along_m": 5.0, "near_m": 3.0, "beside_m": 4.0, "half_width_m": 2.0},
    "behind the mount": {"along_m": -1.0, "near_m": -1.5, "beside_m": 0.0, "half_width_m": 0.5},
}


@pytest.mark.parametrize("base", ["fixed", "moving"])
@pytest.mark.parametrize("target", OBJECTS)
def test_every_variant_can_be_built_whatever_the_job_is_about(target: str, base: str) -> None:
    for task, family, variant in (param.values for param in EVERY):
        job, changes = read_job(brief(task)), OBJECTS[target]
        seen = replace(job.target or read_job(brief("button_pushing")).target, **changes) if changes else None
        room = {"approach_m": 0.1, "room_m": 0.01} if base == "moving" else {"approach_m": 0.0, "room_m": math.inf}
        job = replace(job, target=seen, base=base, press_n=100.0, headroom_m=0.001, **room)
        kind = FAMILIES[family]
        made = kind.concept(kind.size(job, np.random.default_rng(0), variant), job)
        assert kind.write_concept(made).functional_part == made.functional_part


FIRST = [
    pytest.param(TASKS[kind], family, variants[0], id=f"{kind}-{family}")
    for kind, table in IDEAS.items()
    for family, variants in table.items()
]


@pytest.mark.parametrize(("task", "family", "variant"), FIRST)
def test_a_robot_of_each_family_is_stable(task: str, family: str, variant: str) -> None:
    report = validate(robot(task, family, variant, seed=3).mjcf, needs_contact=True)
    assert report.stable, report.account()


def reinforced(task: str, family: str, variant: str) -> str:
    made = FAMILIES[family]
    return made.write(made.reinforce(made.reinforce(made.read(concept(task, family, variant))))).mjcf


@pytest.mark.parametrize(("task", "family", "variant"), FIRST)
def test_the_reinforced_robot_says_which_it_is(task: str, family: str, variant: str) -> None:
    text = reinforced(task, family, variant)
    assert f'model="{family}_variation_2"' in text
    assert text.count("<joint") == robot(task, family, variant).mjcf.count("<joint")


@pytest.mark.slow
@pytest.mark.parametrize(("task", "family", "variant"), FIRST)
def test_the_reinforced_robot_is_stable(task: str, family: str, variant: str) -> None:
    assert validate(reinforced(task, family, variant)).stable


@pytest.mark.slow
@pytest.mark.parametrize(("task", "family", "variant"), EVERY)
def test_five_seeds_of_every_variant_are_stable(task: str, family: str, variant: str) -> None:
    for seed in range(5):
        report = validate(robot(task, family, variant, seed).mjcf, needs_contact=True)
        assert report.stable, report.account()


@pytest.mark.slow
@pytest.mark.parametrize("task", KINDS)
def test_five_seeds_of_each_task_end_in_stable_scenes_that_are_passed(task: str) -> None:
    from aidsr.sim.assembly import assemble

    asked = brief(task)
    for seed in range(1, 6):
        team = builtin.team(seed)
        for idea in team.designer.propose(asked, 3):
            made = team.coder.write(asked, idea)
            placed = team.integrator.place(asked, idea, made)
            whole = assemble(made, asked.environment, placed, load_task(task).sensors)
            report = validate(whole.mjcf, needs_contact=asked.needs_contact)
            assert report.stable, report.account()
            assert team.judge.judge(asked, idea, made, whole, report).passed
