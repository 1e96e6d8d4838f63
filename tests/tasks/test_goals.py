"""Goals in files: what they may say, what they make of an environment, and what is said of mistakes."""

import re
from pathlib import Path

import numpy as np
import pytest
from stick import Episode, scene
from table import TABLE

from aidsr import probe
from aidsr.apps.cli import main
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.learn.episodes.scene import TaskScene
from aidsr.loop.run import create_run, make_brief
from aidsr.tasks import goal_task, read_goal

PAGE = (Path(__file__).parents[2] / "docs" / "environments.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r'^```\w+ title="([^"]+)"\n(.*?)^```', PAGE, re.MULTILINE | re.DOTALL))


def made(tmp_path, text, mjcf=TABLE):
    path = tmp_path / "goal.toml"
    path.write_text(text)
    return goal_task(read_goal(path), mjcf)


def reach(episode):
    for way in (0.2, 0.1, 0.0):
        episode.place(np.array([0.2 - way, 0.1, 0.3]), (1.0, 0.0, 0.0))
        episode.step()
    episode.run(1.0)


def lift(episode):
    weight_n = 9.81 * 0.05
    goal = episode.sensor("goal_position") + np.array([0.0, 0.0, 0.06 + weight_n / 1000])
    episode.run(2.0, lambda e: e.hold("ball", e.sensor("goal_position"), goal))


def push(episode):
    def hand(e: Episode) -> None:
        e.data.joint("rail").qfrc_applied = -0.5

    episode.run(2.0, hand)


def walk(episode):
    for way in np.linspace(0.0, 0.6, 6):
        episode.place(np.array([0.0, way, 0.4]), (0.0, 1.0, 0.0))
        episode.step()
    episode.run(1.0)


def touch(episode):
    for way in (0.1, 0.05):
        episode.place(np.array([0.0, 0.27 - way, 0.1]), (0.0, 1.0, 0.0))
        episode.step()
    goal = np.array([0.0, 0.2705, 0.1])
    episode.run(1.0, lambda e: e.hold("robot/stick", e.tip_m, goal, along=(0.0, 1.0, 0.0)))


GOALS = {
    "reach": ('kind = "reach"\ntarget = "hook"', reach, "goal/reach", False),
    "lift": ('kind = "lift"\ntarget = "ball"', lift, "goal/move", True),
    "push": ('kind = "travel"\ntarget = "flag"\ndistance_m = 0.1\ndirection = [-1, 0, 0]', push, "goal/move", True),
    "walk": ('kind = "travel"\ndistance_m = 0.4\ndirection = [0, 2, 0]\nbase = "free"', walk, "goal/travel", False),
    "touch": ('kind = "touch"\ntarget = "post"\nforce_n = 0.05\nat_most_n = 3', touch, "goal/touch", True),
}


@pytest.mark.parametrize(("text", "hand", "name", "needs_contact"), GOALS.values(), ids=GOALS)
def test_a_goal_is_a_task_like_any_other(tmp_path, text, hand, name, needs_contact):
    task = made(tmp_path, text)
    assert (task.name, task.needs_contact, task.time_limit_s, task.hold_s) == (name, needs_contact, 10.0, 0.5)
    idle = Episode(task)
    idle.run(2.0)
    assert not idle.won
    episode = Episode(task, base="free")
    width = sum(feature.size for feature in task.features)
    assert task.observe(episode.look(), episode.state.task_state).shape[1] == width
    hand(episode)
    assert episode.won
    assert episode.progress[-1] == pytest.approx(1.0, abs=0.01)
    assert max(episode.progress) <= 1.0
    assert min(episode.progress) >= 0.0


def test_too_hard_a_touch_is_a_violation_and_no_success(tmp_path):
    task = made(tmp_path, 'kind = "touch"\ntarget = "post"\nforce_n = 0.01\nat_most_n = 0.02')
    episode = Episode(task, base="free")
    touch(episode)
    assert not episode.won
    assert episode.score.violation[0] == 1.0


@pytest.mark.parametrize(
    ("target", "field", "name", "middle"),
    [
        ("hook", "site_pos", "hook", (0.2, 0.1, 0.3)),
        ("flag", "body_pos", "cart", (0.3, 0.0, 0.1)),
        ("ball", "qpos", "ball", (-0.3, 0.0, 0.03)),
    ],
)
def test_the_target_is_put_elsewhere_with_what_carries_it(tmp_path, target, field, name, middle):
    task = made(tmp_path, f'kind = "reach"\ntarget = "{target}"\nvary_m = [0.1, 0, 0.05]')
    drawn = [task.variation("development", index).changes[0] for index in range(50)]
    assert {(change.field, change.name) for change in drawn} == {(field, name)}
    off = np.array([change.value for change in drawn]) - middle
    assert np.abs(off).max(axis=0) == pytest.approx([0.1, 0.0, 0.05], abs=0.01)
    assert task.variation("held_out", 0) != task.variation("development", 0)
    before = made(tmp_path, f'kind = "reach"\ntarget = "{target}"')
    shift = Episode(task).look()["goal_offset"] - Episode(before).look()["goal_offset"]
    assert np.abs(shift).sum() > 0.01


@pytest.mark.parametrize("joint", ["<freejoint/>", '<joint type="free"/>', '<freejoint name="x: free"/>'])
def test_a_body_on_a_free_joint_is_put_elsewhere_whatever_the_joint_is_called(tmp_path, joint):
    # other joints have the names that it could be taken for
    mjcf = TABLE.replace('<freejoint name="ball_free"/>', joint).replace(
        '<body name="post" pos="0 0.3 0.1">',
        '<body pos="0.6 0.6 0.6"><joint name="joint"/><joint name="ball" axis="0 1 0"/><geom size="0.01"/></body>'
        '<body name="post" pos="0 0.3 0.1">',
    )
    task = made(tmp_path, 'kind = "lift"\ntarget = "ball"\nvary_m = [0.02, 0.02, 0]', mjcf)
    for index in range(3):
        episode = Episode(task, index=index)
        (change,) = episode.variation.changes
        assert episode.data.body("ball").xpos == pytest.approx(change.value)
        assert 0.001 < np.abs(np.subtract(change.value, (-0.3, 0.0, 0.03))).max() <= 0.02
        others = [episode.data.joint(name).qpos[0] for name in ("joint", "ball", "rail")]
        assert others == [0.0, 0.0, 0.0]


def test_bodies_without_a_name_that_carry_the_target_are_no_riddle(tmp_path):
    mjcf = TABLE.replace(
        '<body name="post"',
        '<body pos="1 1 0.5"><joint type="slide"/><geom size="0.01"/><body><geom size="0.01"/>'
        '<body name="lid"><geom size="0.01"/></body></body></body><body name="post"',
    )
    assert made(tmp_path, 'kind = "lift"\ntarget = "lid"', mjcf).goal.target == "lid"
    with pytest.raises(UserError, match="vary_m requires a target on a named body"):
        made(tmp_path, 'kind = "lift"\ntarget = "lid"\nvary_m = [0.1, 0, 0]', mjcf)


def test_a_scene_made_for_no_goal_is_measured_for_it(tmp_path):
    task = made(tmp_path, GOALS["lift"][0])
    without = scene(made(tmp_path, GOALS["walk"][0]), "fixed")
    assert "goal_position" not in without
    sensors = [one.name for one in task.sensors]
    with pytest.raises(UserError, match="the robot has no actuators"):  # as a stick has; all before is right
        TaskScene.of(without, task)
    from aidsr.sim.assembly import add_sensors

    twice = add_sensors(add_sensors(without, task.sensors), task.sensors)
    assert [twice.count(f'name="{name}"') for name in sensors] == [1, 1, 1]


def test_a_robot_without_a_solid_shape_is_refused_where_its_surface_counts(tmp_path):
    from aidsr.core.artifacts import Placement, Robot
    from aidsr.sim.assembly import assemble
    from scenes import small_arm

    keep_out = '\n[[limits]]\nkind = "keep_out"\ncenter_m = [1, 0, 0]\nsize_m = [0.1, 0.1, 0.1]\n'
    task = made(tmp_path, GOALS["reach"][0] + keep_out)
    ghost = small_arm().replace("<geom ", '<geom contype="0" conaffinity="0" ')
    for mjcf, refused in ((ghost, True), (small_arm(), False)):
        robot = Robot(mjcf=mjcf, functional_part="tip")
        placed = assemble(robot, task.environment, Placement(mount="mount", base="fixed"), task.sensors).mjcf
        if refused:
            with pytest.raises(UserError, match="the robot has no solid shape, and goal/reach measures"):
                TaskScene.of(placed, task)
        else:
            assert TaskScene.of(placed, task).actions.size == 2


MISTAKES = {
    "": "no kind",
    'kind = "lifting"\ntarget = "ball"': 'did you mean "lift"',
    "kind = 3": "unknown kind 3",
    "kind =": "goal.toml as TOML",
    'kind = "lift"': 'missing key "target"',
    'kind = "lift"\ntarget = "ball"\nby = 3': 'unknown key "by" (did you mean "by_m"?)',
    'kind = "lift"\ntarget = "ball"\nby_m = "high"': "by_m: input should be a valid number",
    'kind = "lift"\ntarget = "ball"\nby_m = -1': "by_m: input should be greater than 0; found -1",
    'kind = "lift"\ntarget = "bal"': 'did you mean "ball"',
    'kind = "lift"\ntarget = "post"': "no joint carries it",
    'kind = "lift"\ntarget = "hook"': 'unknown target "hook"',
    'kind = "reach"\ntarget = "ceiling"': "it has mount, hook, cart, flag, ball, post",
    'kind = "travel"\ndistance_m = 1\ndirection = [0, 0, 0]': "use a finite one other than zero",
    'kind = "travel"\ndistance_m = 1\ndirection = [1, 0]': "direction: 2 numbers instead of three",
    'kind = "travel"\ndistance_m = 1\ndirection = [1, 0, 0, 0]': "4 numbers instead of three, for x, y and z",
    'kind = "travel"\ndistance_m = 1\ndirection = [1, nan, 0]': "use a finite one other than zero",
    'kind = "reach"\ntarget = "hook"\nvary_m = 0.002': "vary_m: three numbers, [x, y, z] in metres; found 0.002",
    'kind = "reach"\ntarget = "hook"\nvary_m = [0, -1, 0]': (
        "vary_m.2: three numbers of at least 0, [x, y, z] in metres; found -1"
    ),
    'kind = "travel"\ndistance_m = 1\ndirection = "x"': "direction: three numbers, [x, y, z]; found 'x'",
    'kind = "follow"\npath_m = [1, 2]': "path_m.1: three numbers, [x, y, z] in metres for each point; found 1",
    'kind = "travel"\ndistance_m = 1\nvary_m = [1, 0, 0]': "vary_m requires a target",
    'kind = "travel"\ndistance_m = 1\nvary_m = [1, 0]': "2 numbers instead of three",
    'kind = "touch"\ntarget = "post"\nforce_n = 2\nat_most_n = 1': "at_most_n (1 N) must be more than force_n (2 N)",
    'kind = "reach"\ntarget = "hook"\nhold_s = 11': "hold_s (11 s) must be shorter than time_limit_s (10 s)",
}


@pytest.mark.parametrize(("text", "sentence"), MISTAKES.items())
def test_a_mistake_is_one_sentence(tmp_path, text, sentence):
    with pytest.raises(UserError) as error:
        made(tmp_path, text)
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_there_and_an_environment_that_is_none(tmp_path):
    with pytest.raises(UserError, match="goal not found"):
        read_goal(tmp_path / "nowhere.toml")
    with pytest.raises(UserError, match="cannot load the environment"):
        made(tmp_path, GOALS["lift"][0], "<mujoco")


@pytest.fixture
def example(tmp_path, monkeypatch):
    """The files of docs/environments.md."""
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_the_example_is_kept_with_its_run(example):
    brief = make_brief("Touch the bell", environment=Path("bell.xml"), goal=Path("goal.toml"))
    assert (brief.task, brief.base, brief.needs_contact) == ("", "any", True)
    run = create_run(brief, RunConfig(), runs=example, goal=Path("goal.toml"))
    assert run.goal.read().decode() == FILES["goal.toml"]
    with pytest.raises(UserError, match="has its own objective, environment and goal"):
        make_brief(task="button_pushing", goal=Path("goal.toml"))


def test_the_example_passes_its_own_check(example):
    from aidsr.teams.fitting.check import check_goal

    found = check_goal("bell.xml", "goal.toml")
    assert found.problems == ()
    assert (found.blind.noise, found.blind.episodes) == (0, 5)
    assert found.probe.reached == "held success"


def test_a_lighter_example_can_be_done_by_a_small_arm(example, capsys):
    from aidsr.core.artifacts import Placement, Robot
    from aidsr.sim.assembly import assemble
    from scenes import small_arm

    arm = Robot(mjcf=small_arm(), functional_part="tip")
    text = assemble(arm, FILES["bell.xml"], Placement(mount="mount", base="fixed")).mjcf
    assert "goal_" not in text
    Path("scene.xml").write_text(text)
    # lighter and shorter, as so small an arm can
    Path("goal.toml").write_text(FILES["goal.toml"].replace("force_n = 0.5", "force_n = 0.1").replace("1.5", "0.2"))
    report = probe(text, goal_task(read_goal("goal.toml"), text), candidates=48, variations=1, threads=1)
    assert report.success_share == 1.0
    with pytest.raises(SystemExit) as ended:
        main(["probe", "scene.xml", "--goal", "goal.toml", "--candidates", "48", "--variations", "1", "--threads", "1"])
    assert ended.value.code == 0
    assert "goal/touch: 1 of 1 variations solved; best single motion solves 1 of 1" in capsys.readouterr().out


TOLD = {
    "reach": ("Nothing: each begins as described here.", "at most 0.02 m from hook. Held for 0.5 s.", "Nothing."),
    "lift": ("Nothing: each begins as described here.", "ball is at least 0.05 m higher than it was at", "Nothing."),
    "push": ("Nothing: each begins as described here.", "flag is at least 0.1 m along -1 0 0 (world axes)", "Nothing."),
    "walk": (
        "Nothing: each begins as described here.",
        "The robot's centre of mass is at least 0.4 m along",
        "Nothing.",
    ),
    "touch": (
        "Nothing: each begins as described here.",
        "The net force on post by the functional part is at least 0.05 N and at most 3 N. Held for 0.5 s.",
        "More than 3 N by the functional part on post at any moment.",
    ),
}


@pytest.mark.parametrize("kind", GOALS)
def test_a_goal_tells_those_who_design_for_it_how_it_is_judged(tmp_path, kind):
    (tmp_path / "table.xml").write_text(TABLE)
    (tmp_path / "goal.toml").write_text(GOALS[kind][0])
    told = make_brief("Do it", environment=tmp_path / "table.xml", goal=tmp_path / "goal.toml").judging
    differ, success, against = TOLD[kind]
    assert (told["Episodes differ"], told["Penalty"]) == (differ, against)
    assert success in told["Success"]
    assert told["Time"] == "10 s, 25 actions a second."


def test_a_target_that_is_elsewhere_in_each_episode_is_said_to_be(tmp_path):
    told = made(tmp_path, GOALS["touch"][0] + "\nvary_m = [0, 0.02, 0.03]").brief().judging
    assert told["Episodes differ"] == (
        "Where post is: up to 0.02 m along y, 0.03 m along z, to either side of where it is described here."
    )
