"""What a script may command in a scene is told where a scene is made and where a script is played."""

from __future__ import annotations

import re
from pathlib import Path

from tests.scenes import small_arm
from tests.tools.carts import CART, play_once

from aidsr.learn.episodes.plausibility import START_LENGTHS
from aidsr.tools import TOOLS, Workspace
from aidsr.tools.playing import film_script
from aidsr.tools.scene import MeasuredScene

BASES = "commands the speed of base_{}, -0.1 to 0.1 m/s, until it is at an end of -0.1 to 0.1 m"


def assembled(folder: Path, task: str, part: str = "tip") -> tuple[Workspace, list[str]]:
    work = Workspace(folder)
    TOOLS["validate"].call(work, {"mjcf": small_arm(), "functional_part": part, "task": task})
    placement = {"mount": "mount", "base": "fixed"}
    made = TOOLS["assemble"].call(work, {"robot": "robot_1", "task": task, "placement": placement}).text
    return work, made.splitlines()


def test_a_scene_says_which_commands_of_the_environment_a_script_has(tmp_path: Path) -> None:
    work, told = assembled(tmp_path, "crank_turning")
    assert "a script commands, -1 to 1 over the control range: pull_left, pull_right" in told
    assert f"and of the environment: base_y: {BASES.format('y')}; base_z: {BASES.format('z')}" in told
    assert not any("by no script" in line for line in told)
    rest = "not named in the script, at the action whose command is nearest to 0: "

    def played(script: str, **more: object) -> str:
        return TOOLS["play"].call(work, {"scene": "scene_1", "script": script, "seconds": 0.2, **more}).text

    base_z = f"base_z at 0 (of the environment: {BASES.format('z')})"
    assert f"\n{rest}pull_right at -1, {base_z}\n" in played("pull_left: 1\nbase_y: 1")
    assert played("pull_left: 1\npull_right: 0\nbase_y: 1", variations=[0, 1]).endswith(f"\n{rest}{base_z}")
    assert rest not in played("pull_left: 1\n*: 0")


def test_a_scene_says_how_far_from_its_mount_a_robot_may_start(tmp_path: Path) -> None:
    assert START_LENGTHS == 0.5
    assert "farther from its mount than half of its length makes no valid policy" in TOOLS["assemble"].description
    work, told = assembled(tmp_path, "button_pushing")
    limit = "(valid: at most 0.5 of its length, 119 mm)"
    assert f"how far the nearest part of the robot is from the mount at the start: 0 mm {limit}" in told
    placement = {"mount": "mount", "base": "fixed", "position_m": [0.2, 0, 0]}
    far = TOOLS["assemble"].call(work, {"robot": "robot_1", "task": "button_pushing", "placement": placement}).text
    found = re.search(r"^too far for a valid policy: how far the nearest part .* at the start: (\d+) mm \(", far, re.M)
    assert found is not None
    assert 150 < int(found[1]) < 200


def test_a_scene_says_when_its_functional_part_is_too_much_of_the_robot(tmp_path: Path) -> None:
    said = (
        "no policy is valid: moving mass of the functional part and what it carries: 1 of the robot's moving mass "
        "(at most 0.5)"
    )
    (line,) = (line for line in assembled(tmp_path, "button_pushing", "base")[1] if line.startswith("no policy"))
    assert line == f"{said}; name a smaller part"
    assert not any(line.startswith("no policy") for line in assembled(tmp_path / "tip", "button_pushing")[1])


def test_what_the_job_itself_drives_is_told_to_be_out_of_reach(tmp_path: Path) -> None:
    work, told = assembled(tmp_path, "simple_grasping")
    (line,) = (line for line in told if line.startswith("of the environment, driven by the job and by no script: "))
    assert "carriage_lift: commands the position of carriage_lift, -0.1 to 0.05 m" in line
    script = {"scene": "scene_1", "script": "pull_left: 1\npull_right: 1", "seconds": 0.2}
    assert line in TOOLS["play"].call(work, script).text.splitlines()


def test_a_scene_that_no_script_can_drive_says_why(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    endless = small_arm().replace(' ctrlrange="0 8.0"', "")
    TOOLS["validate"].call(work, {"mjcf": endless, "functional_part": "tip", "task": "button_pushing"})
    placement = {"mount": "mount", "base": "fixed"}
    made = TOOLS["assemble"].call(work, {"robot": "robot_1", "task": "button_pushing", "placement": placement}).text
    assert "no script can be played in it: actuators without ctrlrange: robot/pull_left, robot/pull_right" in made


def test_a_scene_says_what_the_conditions_of_a_script_may_depend_on(tmp_path: Path) -> None:
    (line,) = (line for line in assembled(tmp_path, "drawer_opening")[1] if line.startswith("observed"))
    assert line.startswith(
        "observed, for the conditions of blocks: f1-f3 functional part to the wanted drawer's handle"
    )
    assert " [m]; f4 opening of the wanted drawer, 1 = " in line
    assert "; f9-f11 openings of drawers 1 to 3" in line


BRANCHING = "when f7 > 0 for 0.2 s:\npull_left: 1\nbase_y: 1\notherwise:\npull_right: 1.5"


def test_a_play_says_which_block_was_played_from_when_and_what_was_observed(tmp_path: Path) -> None:
    work, _ = assembled(tmp_path, "crank_turning")

    def played(script: str, **more: object) -> list[str]:
        arguments = {"scene": "scene_1", "script": script, "seconds": 0.4, **more}
        return TOOLS["play"].call(work, arguments).text.splitlines()

    (other,) = (line for line in played(BRANCHING) if line.startswith("block"))
    assert re.fullmatch(r"block 2 \(otherwise\) from 0 s, where f1 -0\.\d+, .*, f6 0, f7 -1, f8 0, f9 0, f10 0", other)
    told = played(BRANCHING, variation=1)
    first, second = (line for line in told if line.startswith("block"))
    assert first.startswith("block 1 (f7 > 0) from 0 s, where f1 ")
    assert second.startswith("block 1 (f7 > 0) from 0.2 s, where f1 ")
    assert "in block 2 (otherwise), pull_right is asked for +1.5, cut off at +1, 100% of the time" in told
    rest = "at the action whose command is nearest to 0: pull_"
    assert any(line.startswith(f"not named in block 1 (f7 > 0), {rest}right at -1, base_z at 0 (of") for line in told)
    assert any(line.startswith(f"not named in block 2 (otherwise), {rest}left at -1, base_y at 0 (of") for line in told)
    assert not any(line.startswith("block") for line in played("*: 0"))


def test_many_starts_of_blocks_are_counted(tmp_path: Path) -> None:
    work, _ = assembled(tmp_path, "crank_turning")
    script = {"scene": "scene_1", "script": "otherwise for 0.04 s:\n*: 0", "seconds": 0.4}
    told = TOOLS["play"].call(work, script).text.splitlines()
    assert sum(line.startswith("block 1 (otherwise) from") for line in told) == 8
    assert "and 2 more blocks" in told


def test_a_sweep_varies_a_condition_and_a_duration(tmp_path: Path) -> None:
    work, _ = assembled(tmp_path, "crank_turning")
    for heading, values in (("when f7 > {x}:", ["-2", "0"]), ("when f7 < 0 for {x} s:", ["0.04", "0"])):
        how = {"script": f"{heading}\nbase_y: 1\notherwise:\nbase_y: 0", "seconds": 0.2}
        told = TOOLS["sweep"].call(work, {"subject": "scene_1", "values": values, "what": "play", "how": how}).text
        assert f"\n{values[0]} | " in told
        assert ("a duration of 0 s; give one above 0" in told) == ("for" in heading)


def test_a_branching_script_is_checked_like_any_other(tmp_path: Path) -> None:
    """Both blocks do the same, so the recording differs only by the lines on blocks."""
    goal = tmp_path / "goal.toml"
    goal.write_text('kind = "travel"\ndistance_m = 0.2\ntime_limit_s = 4\nhold_s = 0.2\n')
    scene, drive = MeasuredScene(mjcf=CART, goal=goal), "drive: t=0 1, t=0.4 1, t=0.41 0"
    plain, branching = (play_once(scene, script) for script in (drive, f"when f1 > 1e3:\n*: 0\notherwise:\n{drive}"))
    assert plain.succeeded
    assert plain.not_valid is not None
    assert len(branching.blocks) == 1
    assert branching.model_copy(update={"blocks": (), "commands": plain.commands}) == plain
    film = film_script(scene, f"when f1 > 1e3:\n*: 0\notherwise:\n{drive}", seconds=1.0)
    assert film.qpos == film_script(scene, drive, seconds=1.0).qpos
