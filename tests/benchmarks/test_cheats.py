"""Bodies that cheat: each is a body that could win, and each is refused by name."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from benchmarks.cheats.bodies import CHEATS
from benchmarks.cheats.parts import Player, constant
from benchmarks.cheats.playing import lift_m, place, play
from benchmarks.cheats.wins import BEFORE, read_rows

from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.structure import read_structure
from aidsr.tasks import TASKS, load_task

BY_NAME = {cheat.name: cheat for cheat in CHEATS}


def test_every_task_has_a_body_that_cheats_and_no_name_stands_for_two():
    assert {cheat.task for cheat in CHEATS} == {name.rpartition("/")[2] for name in TASKS}
    assert len(BY_NAME) == len(CHEATS) >= 18


@pytest.mark.parametrize("cheat", CHEATS, ids=lambda cheat: cheat.name)
def test_a_body_that_cheats_has_what_a_continuum_robot_is_counted_by(cheat):
    structure = read_structure(mujoco.MjModel.from_xml_string(cheat.mjcf))
    assert structure.longest_series >= 3
    assert structure.tendon_actuators
    assert len(structure.roots) == 1


def test_before_they_were_refused_most_of_them_were_valid_and_successful():
    rows = read_rows(BEFORE)
    assert {row["commit"] for row in rows} == {"2a7e353"}
    called = {row["body"] for row in rows if 2 * row["wins"] >= row["episodes"] and row["valid"] and not row["errors"]}
    assert called <= set(BY_NAME)
    assert len(called) >= 18


def test_a_body_is_lifted_until_it_stands():
    cheat = BY_NAME["four_wheels"]
    assert lift_m(cheat.mjcf) == pytest.approx(0.0005, abs=1e-4)
    assert lift_m(cheat.mjcf.replace('name="root" ', 'name="root" pos="0 0 -0.1"')) == pytest.approx(0.1005, abs=1e-4)


def test_an_edit_is_made_on_its_own_task_alone():
    cheat = BY_NAME["tilted_world"]
    own, other = (mujoco.MjModel.from_xml_string(place(cheat, load_task(name))) for name in (cheat.task, "obstacles"))
    assert own.opt.gravity[0] > 0.0
    assert other.opt.gravity[0] == 0.0


def test_a_player_starts_again_with_episodes_that_start_again():
    cheat, task = BY_NAME["motor_jaws"], load_task("simple_grasping")
    scene = TaskScene.of(place(cheat, task), task, grouping="off")
    started = []

    def make():
        started.append(True)
        return constant({"left": 1.0})

    player = Player(scene, make)
    first, later = np.zeros((1, 40), dtype=np.float32), np.ones((1, 40), dtype=np.float32)
    for seen in (first, first, later, first):
        action = player.act(seen)
    assert len(started) == 3  # once to begin with, and at each first observation
    names = [group.actuators[0] for group in scene.actions.groups]
    assert action[0, names.index("robot/left")] == 1.0
    assert action[0, names.index("robot/right")] == scene.actions.rest[names.index("robot/right")]


def test_rigid_jaws_win_by_their_rule_where_nothing_refuses_them():
    cheat, task = BY_NAME["motor_jaws"], load_task("simple_grasping")
    scene = TaskScene.of(place(cheat, task), task, grouping="off")
    assert play(scene, cheat.rule, 1).success.all()
