"""Scripts with blocks: what is observed decides which lines are played, in each of several episodes for itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.scenes import small_scene

from aidsr.core.errors import UserError
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import Constant, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.script import Condition, parse_script
from aidsr.learn.openloop.script_policy import ScriptPolicy, played_by, script_policy
from aidsr.tasks import Feature

TURN = Feature("turn", "", (-1, 1), "(parameters)")
GAP = Feature("base to ball", "m", (0, 1), "gap", size=2)
SIDES = "when f1 > 0:\nreach: t=0 -0.5, t=1 0.5\notherwise:\nreach: 0.25"


def policy_of(text: str, dt_s: float = 0.5) -> ScriptPolicy:
    return played_by(parse_script(text), ["robot/reach", "robot/lift"], np.zeros(2), dt_s, (TURN, GAP))


def seen(*turn: float, gap: float = 0.0) -> np.ndarray:
    """Observations with two numbers of the body before the features."""
    return np.array([[9.0, 9.0, one, gap, gap] for one in turn], dtype=np.float32)


def test_a_heading_has_conditions_and_perhaps_a_duration() -> None:
    text = "# first\nwhen f7 > 0 and f3<-.05 for 12 s:\n  reach: 1\nwhen f1 > 1:\nreach: 0\notherwise for 2.5:\nlift: 1"
    first, second, last = parse_script(text).blocks
    assert (first.line, first.heading, first.duration_s) == (2, "f7 > 0 and f3<-.05", 12.0)
    assert first.conditions == (Condition(7, True, 0.0), Condition(3, False, -0.05))
    assert (second.line, second.duration_s) == (4, math.inf)
    assert (last.line, last.heading, last.conditions, last.duration_s) == (6, "otherwise", (), 2.5)
    assert [list(block.tracks) for block in (first, second, last)] == [["reach"], ["reach"], ["lift"]]


def test_names_that_begin_like_a_heading_stay_names() -> None:
    (block,) = parse_script("when_up: 1\notherwise-left: 0").blocks
    assert (set(block.tracks), block.heading) == ({"when_up", "otherwise-left"}, "")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nwhen f1 > 0:\na: 1\notherwise:\na: 0", "line 1 of the script stands before the first block; move it"),
        ("otherwise:\na: 1\notherwise:\na: 0", r'line 3 .* after "otherwise" \(line 1\) is never played; keep one'),
        ("otherwise:\na: 1\nwhen f1 > 0:\na: 0", r'line 3 .* after "otherwise" \(line 1\) is never played'),
        ("when f1 > 0:\notherwise:\na: 1", 'line 1 of the script: the block has no lines; write "group: t=0 -1'),
        ("when f1 > 0:\na: 1\notherwise:", "line 3 of the script: the block has no lines"),
        ("when f1 > 0:\na: 1", 'line 1 of the script: the last block is not "otherwise"; end the script'),
        ("when f1 > 0 for 0 s:\na: 1", "line 1 of the script: a duration of 0 s; give one above 0"),
        ("otherwise for -2 s:\na: 1", "line 1 of the script: a duration of -2 s"),
        (
            "when f1 >= 0:\na: 1",
            'line 1 of the script: cannot read "when f1 >= 0:"; write "when f3 > 0.05 and f4 < 1:"',
        ),
        ("when f1 > 0 or f2 > 0:\na: 1", "cannot read"),
        ("when turn > 0:\na: 1", "cannot read"),
        ("when f1 > 0", "cannot read"),
        ("when:\na: 1", "cannot read"),
        ("otherwise f1 > 0:\na: 1", "cannot read"),
        ("when f1 > 0: a: 1", "cannot read"),
        ("when f1 > 0 for 2 min:\na: 1", "cannot read"),
        ("when f1 > 0:\na: 1\na: 0", 'line 3 of the script: group "a" has a line already'),
    ],
)
def test_blocks_that_cannot_be_played_are_refused_with_their_line(text: str, message: str) -> None:
    with pytest.raises(UserError, match=message):
        parse_script(text)


@pytest.mark.parametrize("number", ["f0", "f4"])
def test_an_unknown_number_is_refused_with_those_that_are_observed(number: str) -> None:
    message = rf"line 1 of the script: the job has no {number}; it observes f1 turn; f2-f3 base to ball \[m\]$"
    with pytest.raises(UserError, match=message):
        policy_of(f"when {number} > 0:\nreach: 1\notherwise:\nreach: 0")
    with pytest.raises(UserError, match="it observes nothing: leave out blocks"):
        played_by(parse_script(SIDES), ["reach"], np.zeros(1), 0.5)


def test_an_unknown_group_is_refused_with_its_block() -> None:
    with pytest.raises(UserError, match=r'^block 2 \(otherwise\) of the script: no group "rech" in this scene\. Did'):
        policy_of("when f1 > 0:\nreach: 1\notherwise:\nrech: 0")


def test_the_first_block_that_holds_is_played_until_the_end() -> None:
    policy = policy_of(SIDES)
    assert policy.act(seen(1.0, -1.0)).tolist() == [[-0.5, 0.0], [0.25, 0.0]]
    assert policy.act(seen(-1.0, 1.0)).tolist() == [[0.0, 0.0], [0.25, 0.0]], "what is seen later decides nothing"
    assert [(start.title, start.time_s, start.features) for start in policy.starts] == [
        ("block 1 (f1 > 0)", 0.0, (1.0, 0.0, 0.0))
    ]


def test_after_its_duration_a_block_is_chosen_again_and_its_time_begins_at_0() -> None:
    policy = policy_of("when f1 > 0 and f2 < 1 for 1 s:\nreach: t=0 -0.5, t=1 0.5\notherwise for 0.5 s:\nlift: 1")
    told = [(1.0, 0.0), (1.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (1.0, 2.0), (1.0, 0.0)]
    played = [policy.act(seen(turn, gap=gap))[0].tolist() for turn, gap in told]
    assert played == [[-0.5, 0.0], [0.0, 0.0], [-0.5, 0.0], [0.0, 0.0], [0.0, 1.0], [-0.5, 0.0]]
    assert [(start.title[:7], start.time_s) for start in policy.starts] == [
        ("block 1", 0.0),
        ("block 1", 1.0),
        ("block 2", 2.0),
        ("block 1", 2.5),
    ]


def test_durations_count_control_steps_without_rounding_errors() -> None:
    policy = policy_of("otherwise for 0.6 s:\nreach: t=0 0, t=1 1", dt_s=0.2)
    played = [policy.act(seen(0.0))[0, 0] for _ in range(9)]
    assert played == pytest.approx([0.0, 0.2, 0.4] * 3)


def test_each_block_says_what_is_cut_off_and_what_it_does_not_name() -> None:
    policy = policy_of("when f1 > 0 for 1 s:\nreach: t=0 0, t=2 4\notherwise:\nlift: 1.5")
    assert policy.cut_off(["robot/reach", "robot/lift"], 2.0) == (
        "in block 2 (otherwise), lift is asked for +1.5, cut off at +1, 100% of the time",
    )
    assert policy.unnamed == {"block 1 (f1 > 0)": ("lift",), "block 2 (otherwise)": ("reach",)}
    assert policy_of(SIDES).unnamed == policy_of("reach: 1").unnamed == {"the script": ("lift",)}


CRANK = """
when f7 > 0:
pull_left: t=0 -1, t=1 1
base_y: 1
otherwise:
pull_right: t=0 -1, t=1 1
"""
"""f7 of a crank is the direction of the turn."""


def crank() -> TaskScene:
    return TaskScene.of(small_scene("crank_turning"), "crank_turning")


def begun(scene: TaskScene, *indices: int) -> Episodes:
    variations = [scene.task.variation("development", index) for index in indices]
    return Episodes(scene.model, scene.task, scene.actions, variations, threads=1)


def test_two_variations_of_a_crank_play_different_blocks_in_one_batch() -> None:
    scene = crank()
    moving, still = scene.with_base(script_policy(scene, CRANK)), np.zeros((2, scene.actions.size))
    episodes, alone = begun(moving, 0, 1), begun(scene, 0, 1)
    policy = script_policy(scene, CRANK)
    names = [group.name.removeprefix("robot/") for group in scene.actions.groups]
    for _ in range(20):
        alone.step(policy.act(alone.observation))
        episodes.step(still)
        assert np.array_equal(episodes.applied_action, alone.applied_action), "played, or corrected by nothing"
    told = [dict(zip(names, action.round(2).tolist(), strict=True)) for action in episodes.applied_action]
    assert [variation.parameters["direction"] for variation in episodes.variations] == [(-1.0,), (1.0,)]
    assert told[0] == {"pull_left": -1.0, "pull_right": 0.52, "base_y": 0.0, "base_z": 0.0}
    assert told[1] == {"pull_left": 0.52, "pull_right": -1.0, "base_y": 1.0, "base_z": 0.0}


def test_an_episode_that_is_reset_chooses_its_block_anew_and_no_other_does() -> None:
    scene = crank()
    moving = scene.with_base(script_policy(scene, CRANK))
    episodes, still = begun(moving, 0, 0), np.zeros((2, scene.actions.size))
    done = []
    for step in range(8):
        if step == 3:
            episodes.reset(np.array([1]), [scene.task.variation("development", 1)])
        if step == 6:
            episodes.reset(np.array([1]), [scene.task.variation("development", 2)])
        episodes.step(still)
        done.append(episodes.applied_action[:, :2].round(2).tolist())
    first, second = (np.array(each) for each in zip(*done, strict=True))
    assert first[:, 1] == pytest.approx([-1 + 0.08 * step for step in range(8)])
    assert second[:3].tolist() == first[:3].tolist()
    assert second[3:6, 0] == pytest.approx([-1.0, -0.92, -0.84])
    assert second[3:6, 1] == pytest.approx([-1.0, -1.0, -1.0])
    assert second[6:, 1] == pytest.approx([-1.0, -0.92])


def test_batches_of_one_scene_keep_their_blocks_apart() -> None:
    scene = crank()
    moving, still = scene.with_base(script_policy(scene, CRANK)), np.zeros((1, scene.actions.size))
    one, other = begun(moving, 0), begun(moving, 1)
    one.step(still), other.step(still)
    one.step(still), other.step(still)
    assert one.applied_action[0, :2].tolist() == pytest.approx([-1.0, -0.92])
    assert other.applied_action[0, :2].tolist() == pytest.approx([-0.92, -1.0])


def test_a_script_without_blocks_is_a_function_of_time_as_before() -> None:
    text = "pull_left: t=0 -1, t=1.3 0.7, amplitude 0.3 hz 1.7 phase 30\nbase_y: 0.2 amplitude 1 hz 0.5\n*: -0.3"
    scene = crank()
    policy, blocked = script_policy(scene, text), script_policy(scene, f"otherwise:\n{text}")
    (block,) = parse_script(text).blocks
    tracks = [block.tracks.get(group.name.removeprefix("robot/"), block.tracks["*"]) for group in scene.actions.groups]
    observation = begun(scene, 0, 1).observation
    for step in range(60):
        expected = np.stack([track.at(step * scene.task.control_dt_s) for track in tracks])
        assert policy.act(observation).tobytes() == np.tile(expected, (2, 1)).tobytes()
        assert blocked.act(observation).tobytes() == np.tile(expected, (2, 1)).tobytes()
    times_s = np.array([0.04, 0.0, 3.2])
    playback = policy.playback(3)
    expected = np.stack([track.at(times_s) for track in tracks], axis=-1)
    assert playback.at(times_s, np.zeros((3, observation.shape[1]))).tobytes() == expected.tobytes()
    assert policy.starts == ()


def test_the_same_episode_is_the_same_alone_and_in_a_batch() -> None:
    scene = crank()
    script = f"{CRANK.replace('f7 > 0:', 'f7 > 0 for 0.4 s:')}"
    moving = scene.with_base(script_policy(scene, script))
    still = Constant(np.zeros(scene.actions.size))
    both = begun(moving, 0, 1)
    both.time_limit_s[:] = 2.0
    together = rollout(both, still)
    for row, index in enumerate((0, 1)):
        alone = begun(moving, index)
        alone.time_limit_s[:] = 2.0
        assert rollout(alone, still).reward[0] == together.reward[row]
