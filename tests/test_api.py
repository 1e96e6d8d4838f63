"""`aidsr` offers functions that take a path, a text or an object."""

from pathlib import Path

import pytest

import aidsr
from aidsr.api import find_scene
from aidsr.core.artifacts import Robot
from aidsr.core.errors import UserError
from aidsr.runs.folders import DesignFolder

ARM = """<mujoco>
  <worldbody><body name="arm"><joint name="hinge" axis="0 1 0"/>
    <geom name="link" type="capsule" size="0.01" fromto="0 0 0 0 0 0.2"/>
    <site name="tip" pos="0 0 0.2"/></body></worldbody>
  <actuator><position name="pull" joint="hinge" kp="1" ctrlrange="-1 1"/></actuator>
</mujoco>"""


def test_all_public_names_exist_and_nothing_else() -> None:
    assert dir(aidsr) == sorted(aidsr.__all__)
    assert all(hasattr(aidsr, name) for name in aidsr.__all__)
    with pytest.raises(AttributeError, match="it offers Model, Run, RunConfig"):
        aidsr.nothing  # noqa: B018 - the name is looked up


def test_validate_takes_a_text_a_path_or_an_object(tmp_path: Path) -> None:
    file = tmp_path / "robot.xml"
    file.write_text(ARM)
    expected = aidsr.validate(ARM)
    for given in (file, str(file), Robot(mjcf=ARM, functional_part="tip")):
        assert aidsr.validate(given) == expected
    with pytest.raises(UserError, match=r"absent\.xml"):
        aidsr.validate(str(tmp_path / "absent.xml"))


def test_assemble_takes_a_text_a_path_or_an_object_and_a_task(tmp_path: Path) -> None:
    file = tmp_path / "robot.xml"
    file.write_text(ARM)
    task = aidsr.load_task("button_pushing")
    expected = aidsr.assemble(Robot(mjcf=ARM, functional_part="tip"), task)
    assert expected.placement.mount == "mount"
    for given in (ARM, file, str(file)):
        assert aidsr.assemble(given, task, functional_part="tip") == expected
    alone = aidsr.assemble(ARM, task.brief().environment, expected.placement, functional_part="tip")
    assert "robot/tip" in alone.mjcf
    assert len(alone.mjcf) < len(expected.mjcf), "an environment alone brings no sensors of a task"


def test_a_scene_is_given_as_a_text_a_path_or_an_object(tmp_path: Path) -> None:
    task = aidsr.load_task("button_pushing")
    scene = aidsr.assemble(ARM, task, functional_part="tip")
    file = tmp_path / "scene.xml"
    file.write_text(scene.mjcf)
    for given in (scene, scene.mjcf, file, str(file)):
        found = find_scene(given, task).for_learning("auto")
        assert (found.mjcf, found.task) == (scene.mjcf, task)
        with pytest.raises(UserError, match="has no task; name one"):
            find_scene(given)


@pytest.mark.parametrize("kind", [str, Path, DesignFolder])
def test_what_is_no_approved_design_is_named(kind: type, tmp_path: Path) -> None:
    given = kind(tmp_path) if kind is not DesignFolder else DesignFolder(tmp_path)
    with pytest.raises(UserError, match=r"is not an approved design: final\.xml not found"):
        aidsr.probe(given, "gap")


def test_a_task_and_a_goal_exclude_each_other() -> None:
    with pytest.raises(UserError, match="both a task and a goal"):
        aidsr.train(ARM, "gap", goal="goal.toml")
