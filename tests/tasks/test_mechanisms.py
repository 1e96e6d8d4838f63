"""The mechanisms of the environments behave as their tasks say, measured by applying forces."""

from itertools import pairwise

import goals
import mujoco
import numpy as np
import pytest
from stick import Episode

from aidsr.tasks import apply_to_simulation, load_task
from aidsr.tasks.reaching.pipe_inserting import BRANCH_M, INNER_M, LENGTH_M, in_pipe, pipe_walls
from aidsr.tasks.scoring import score


def stage(name: str, level: str = "standard") -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(load_task(name, level).environment)
    return model, mujoco.MjData(model)


def settle(model, data, seconds: float) -> None:
    mujoco.mj_step(model, data, nstep=round(seconds / model.opt.timestep))


@pytest.mark.parametrize(("level", "preload_n"), [("standard", 0.15), ("hard", 5.0)])
@pytest.mark.parametrize("index", [0, 1, 2])
def test_button_moves_beyond_its_preload_by_its_stiffness(level, preload_n, index):
    model, data = stage("button_pushing", level)
    apply_to_simulation(load_task("button_pushing").variation("development", index), model, data)
    travels = []
    for extra_n in (-0.05, 0.12, 0.30, 2.0):
        data.joint("button_slide").qfrc_applied = preload_n + extra_n
        settle(model, data, 2.0)
        travels.append(data.joint("button_slide").qpos[0])
    assert travels == pytest.approx([0.0, 0.12 / 60, 0.30 / 60, 0.008], abs=2e-4)
    data.joint("button_slide").qfrc_applied = 0.0
    settle(model, data, 1.0)
    # a stop gives way a little under the preload
    assert data.joint("button_slide").qpos[0] == pytest.approx(0.0, abs=5e-4)


def test_a_press_counts_that_begins_after_the_signal_from_a_button_that_is_out():
    episode = Episode(load_task("button_pushing"), base="free")
    signal_s, said = episode.variation.parameters["signal_s"][0], []
    for time_s, travel_m in ((signal_s - 0.1, 0.0), (signal_s + 0.1, 0.006), (signal_s + 0.2, 0.0009), (9.0, 0.006)):
        episode.data.time, episode.data.joint("button_slide").qpos = time_s, travel_m
        mujoco.mj_forward(episode.model, episode.data)
        episode.state, _ = score(episode.task, episode.state, episode.look(), np.zeros((1, 1)))
        said.append(float(episode.state.task_state["asked"][0]))
    assert said == [0.0, 0.0, 1.0, 1.0]


@pytest.mark.parametrize(("level", "friction_n"), [("standard", 0.4), ("hard", 1.5)])
def test_drawers_slide_against_their_friction_and_stop(level, friction_n):
    model, data = stage("drawer_opening", level)
    for drawer in ("drawer_1", "drawer_2", "drawer_3"):
        handle = model.body(f"{drawer}_handle").id
        for pull_n, opening_m in (
            (0.8 * friction_n, 0.0),
            (friction_n + 0.6, 0.10),
            (0.0, 0.10),
            (-friction_n - 0.6, 0.0),
        ):
            # the robot is on the side of -x
            data.xfrc_applied[handle, 0] = -pull_n
            settle(model, data, 1.5)
            assert data.joint(drawer).qpos[0] == pytest.approx(opening_m, abs=3e-3), (drawer, pull_n)
        assert model.body(drawer).mass[0] + model.body(f"{drawer}_handle").mass[0] == pytest.approx(0.2)


def test_a_drawer_is_slowed_by_its_damping():
    model, data = stage("drawer_opening")
    data.xfrc_applied[model.body("drawer_1_handle").id, 0] = -0.7
    settle(model, data, 0.5)
    assert data.joint("drawer_1").qvel[0] == pytest.approx((0.7 - 0.4) / 3.0, rel=0.05)


def test_a_handle_bar_holds_what_hooks_behind_it():
    episode = Episode(load_task("drawer_opening"), base="free")
    # across the gap between bar and drawer, from below
    behind = episode.sensor("drawer_2_position") + np.array([0.0155, 0.0, 0.0])
    episode.place(behind + np.array([0.0, 0.0, 0.06]), (0.0, 0.0, 1.0))
    start_m = episode.tip_m.copy()
    episode.run(
        3.0,
        lambda e: e.hold("robot/stick", e.tip_m, start_m - (0.12, 0.0, 0.0), along=(0.0, 0.0, 1.0), strongest_n=3.0),
    )
    assert episode.sensor("drawer_2_opening")[0] > 0.06
    assert episode.sensor("drawer_1_opening")[0] == pytest.approx(0.0, abs=2e-3)


def test_a_drawer_that_is_open_again_at_the_end_has_to_be_shut():
    task = load_task("drawer_opening")
    episode = goals.drawer_opening(task)
    memory = episode.state.task_state
    assert memory["stage"] == [12.0]
    for opening_m, worth in ((0.10, 11 / 12), (0.055, 11.5 / 12), (0.01, 1.0)):
        episode.data.joint("drawer_2").qpos = opening_m
        mujoco.mj_forward(episode.model, episode.data)
        readings = episode.look()
        assert task.progress(readings, memory) == pytest.approx([worth], abs=2e-3)
        assert task.is_success(readings, memory) == [opening_m <= 0.01]


@pytest.mark.parametrize("name", ["simple_grasping", "delicate_grasping"])
@pytest.mark.parametrize("index", range(6))
def test_the_object_rests_on_the_table(name, index):
    task = load_task(name)
    model, data = stage(name)
    apply_to_simulation(task.variation("development", index), model, data)
    start = data.body("object").xpos.copy()
    settle(model, data, 2.0)
    assert data.body("object").xpos == pytest.approx(start, abs=2e-3)
    assert np.abs(data.joint("object_free").qvel[:3]).max() < 2e-3


@pytest.mark.parametrize(
    ("name", "course"),
    [
        ("simple_grasping", {0.0: 0.0, 1.0: -0.10, 2.9: -0.10, 4.5: 0.05, 9.0: 0.05}),
        ("delicate_grasping", {0.0: 0.0, 1.0: -0.10, 2.9: -0.10, 4.5: 0.05, 9.0: 0.05}),
        ("zero_gravity_grasping", {0.0: 0.0, 1.0: -0.10, 2.9: -0.10, 5.0: 0.0, 9.0: 0.0}),
    ],
)
def test_the_carriage_keeps_its_timetable(name, course):
    episode = Episode(load_task(name))
    for time_s, height_m in course.items():
        while episode.data.time < time_s - 1e-9:
            episode.step()
        assert episode.sensor("carriage_height")[0] == pytest.approx(height_m, abs=8e-3)


@pytest.mark.parametrize(
    ("name", "actuator", "speed_m_s", "low_m", "high_m"),
    [
        ("pipe_inserting", "feed", 0.05, 0.0, 0.35),
        ("drawer_opening", "base_x", 0.1, 0.0, 0.04),
        ("drawer_opening", "base_z", 0.1, -0.05, 0.05),
        ("force_controlled_brushing", "base_x", 0.1, -0.05, 0.05),
        ("force_controlled_brushing", "base_z", 0.1, -0.05, 0.05),
    ],
)
def test_a_base_moves_at_its_speed_within_its_travel_and_stays(name, actuator, speed_m_s, low_m, high_m):
    model, data = stage(name)
    assert tuple(model.actuator(actuator).ctrlrange) == pytest.approx((-speed_m_s, speed_m_s))
    joint = data.joint(actuator)
    data.actuator(actuator).ctrl = speed_m_s
    settle(model, data, 0.25)
    assert joint.qvel[0] == pytest.approx(speed_m_s, rel=0.05)
    settle(model, data, 12.0)
    assert joint.qpos[0] == pytest.approx(high_m, abs=2e-3)
    data.actuator(actuator).ctrl = -speed_m_s
    settle(model, data, 14.0)
    assert joint.qpos[0] == pytest.approx(low_m, abs=2e-3)
    data.actuator(actuator).ctrl = 0.0
    settle(model, data, 2.0)
    assert joint.qpos[0] == pytest.approx(low_m, abs=2e-3)


def test_the_hard_shake_pushes_the_object_sideways_with_one_newton():
    episode = Episode(load_task("simple_grasping", "hard"))
    forces = []
    while episode.data.time < 6.0:
        episode.step()
        forces.append(episode.data.qfrc_actuator[episode.model.joint("object_free").dofadr[0] :][:3].copy())
    before, after = np.array(forces[:110]), np.array(forces[114:])
    assert not before.any()
    assert np.abs(after[:, 1]).max() == pytest.approx(1.0, abs=0.02)
    assert np.abs(after[:, [0, 2]]).max() < 1e-6


@pytest.mark.parametrize("level", ["standard", "hard"])
@pytest.mark.parametrize("index", range(6))
def test_an_untouched_ball_waits_and_passes_the_capture_point_at_its_speed_and_time(level, index):
    episode = Episode(load_task("dynamic_catching", level), base="free", split="held_out", index=index)
    episode.place(np.array([0.0, 0.6, 0.5]), (0.0, 1.0, 0.0))
    task, capture, start = episode.task, episode.data.site("capture_point").xpos.copy(), episode.sensor("ball_position")
    throw_s = episode.variation.parameters["throw_s"][0]
    course = []

    def watch(e: Episode) -> None:
        away_m = np.linalg.norm(e.data.body("ball").xpos - capture)
        course.append((away_m, e.data.time, np.linalg.norm(e.data.joint("ball_free").qvel[:3])))

    while episode.data.time < throw_s - 1e-6:
        episode.step(watch)
    assert episode.sensor("ball_position") == pytest.approx(start, abs=1e-6)
    episode.run(0.6, watch)
    away_m, time_s, speed_m_s = min(course)
    assert away_m < 0.025 * np.sqrt(2) + 5e-3
    assert 0.18 < time_s - throw_s < 0.37
    assert task.slowest_m_s * 0.9 < speed_m_s < task.fastest_m_s * 1.1


def test_every_ball_waits_over_the_floor():
    task = load_task("dynamic_catching")
    starts_m = [task.variation("held_out", index).changes[0].value[2] for index in range(200)]
    assert min(starts_m) > 0.05 + 0.03


def test_the_mount_turns_over_after_the_ball_is_due_until_it_looks_down():
    episode = Episode(load_task("dynamic_catching"))
    turn_s = episode.variation.parameters["turn_s"][0]
    looks = {}
    for time_s in (0.0, turn_s, turn_s + 1.2):
        while episode.data.time < time_s - 1e-6:
            episode.step()
        looks[time_s] = episode.data.site("mount").xmat.reshape(3, 3)[:, 2].copy()
    up, still, down = looks.values()
    assert up == pytest.approx((np.sqrt(0.5), 0.0, np.sqrt(0.5)), abs=1e-6)
    assert still == pytest.approx(up, abs=1e-3)
    assert down == pytest.approx((0.0, 0.0, -1.0), abs=0.02)


@pytest.mark.parametrize("branch_deg", [50.0, 65.0, 80.0])
def test_a_ball_fits_the_pipe_and_its_branch_all_along_their_middle_lines_and_no_larger_one(branch_deg):
    branch_rad, junction_m = np.deg2rad(branch_deg), 0.14
    spec = mujoco.MjSpec()
    for wall in pipe_walls(junction_m, branch_rad).values():
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=wall.half_size_m, pos=wall.position_m, quat=wall.quaternion
        )
    ball = spec.worldbody.add_body(name="ball")
    ball.add_freejoint()
    ball.add_geom(size=(INNER_M - 0.001, 0, 0))
    model = spec.compile()
    data = mujoco.MjData(model)
    down, along = np.array([0.0, 0.0, -1.0]), np.array([np.sin(branch_rad), 0.0, -np.cos(branch_rad)])
    straight = [(way_m * down, way_m, -1.0) for way_m in np.linspace(0.0, LENGTH_M, 30)]
    branching = [(junction_m * down + way_m * along, junction_m + way_m, way_m) for way_m in (0.02, 0.08, BRANCH_M)]
    for point, way_m, branch_m in straight + branching:
        point *= 1.0 - 1e-9  # both ends are inside, rounding is not
        found = in_pipe(point[None], np.array([junction_m]), np.array([branch_rad]))
        assert found.inside.tolist() == [True]
        if branch_m > 0.0:
            assert (found.branch_m[0], found.beside_branch_m[0]) == pytest.approx((branch_m, 0.0), abs=1e-9)
        if branch_m > 0.0 or way_m < junction_m:
            assert found.way_m[0] == pytest.approx(way_m, abs=1e-9)
        contacts = []
        for shift in (0.0, 0.004):
            data.qpos[:3] = point + np.array([0.0, shift, 0.0])
            mujoco.mj_forward(model, data)
            contacts.append(data.ncon)
        assert contacts[0] == 0
        assert contacts[1] > 0


@pytest.mark.parametrize("index", range(6))
def test_what_goes_straight_on_down_the_pipe_passes_the_branch(index):
    task = load_task("pipe_inserting")
    episode = Episode(task, base="free", index=index)
    mouth, progress = episode.sensor("pipe_position"), []
    for depth_m in np.linspace(0.0, LENGTH_M, 16):
        episode.place(mouth - (0.0, 0.0, depth_m), (0.0, 0.0, -1.0))
        memory = {**episode.state.task_state, "entered": np.ones(1)}
        progress.append(float(episode.task.progress(episode.look(), memory)[0]))
        assert not episode.task.is_success(episode.look(), memory)[0]
    assert max(progress) < 0.9
    assert progress[-1] < max(progress) - 0.01, "who has passed it gains by going back"


def test_nothing_gets_around_the_tunnel_or_under_the_platforms():
    model, data = stage("tunnel")
    mujoco.mj_forward(model, data)
    geom = np.zeros(1, dtype=np.int32)
    for y in np.linspace(-0.55, 0.55, 12):
        if abs(y) > 0.06:
            start, forward = np.array([0.0, y, 0.2]), np.array([1.0, 0.0, 0.0])
            assert mujoco.mj_ray(model, data, start, forward, None, 1, -1, geom) == pytest.approx(0.342, abs=1e-3)
    model, data = stage("gap")
    mujoco.mj_forward(model, data)
    start, forward = np.array([1.03, 0.0, -0.14 + 0.005]), np.array([1.0, 0.0, 0.0])
    assert 0 < mujoco.mj_ray(model, data, start, forward, None, 1, -1, geom) < 0.06


@pytest.mark.parametrize("level", ["standard", "hard"])
def test_the_only_way_past_the_obstacles_turns(level):
    task = load_task("obstacles", level)
    model, data = stage("obstacles", level)
    none = np.zeros(1, dtype=np.int32)

    def free(start_m, end_m) -> bool:
        """Whether both sides of something 0.1 m wide have a free way."""
        sides = [[np.array([x, y + side, 0.02]) for x, y in (start_m, end_m)] for side in (-0.05, 0.05)]
        ways = (mujoco.mj_ray(model, data, start, end - start, None, 1, -1, none) for start, end in sides)
        return not any(0.0 <= way <= 1.0 for way in ways)

    starts_m, ends_m = np.linspace(-0.1, 0.1, 9), np.linspace(-0.25, 0.25, 21)
    for index in range(4):
        variation = task.variation("development", index)
        apply_to_simulation(variation, model, data)
        assert not any(free((0.0, start), (1.1, end)) for start in starts_m for end in ends_m)
        turns_m = np.reshape(variation.parameters["turns_m"], (-1, 2))
        way_m = [(0.0, 0.0), *turns_m, (1.1, turns_m[-1, 1])]
        assert all(free(start, end) for start, end in pairwise(way_m))
        for along_m, y in turns_m:
            walls_m = [
                mujoco.mj_ray(model, data, np.array([along_m, y, 0.02]), np.array([0.0, way, 0.0]), None, 1, -1, none)
                for way in (np.sign(y), -np.sign(y))
            ]
            assert walls_m == pytest.approx([0.3 - abs(y), 0.1], abs=1e-6)
            assert sum(walls_m) == pytest.approx(0.3 - task.reach_m, abs=0.01)


@pytest.mark.parametrize("bend", [-1.0, 0.0, 1.0])
def test_the_tunnel_is_as_wide_and_high_as_it_says(bend):
    from aidsr.tasks import Variation
    from aidsr.tasks.locomotion.tunnel import tunnel_changes

    model, data = stage("tunnel")
    bend_rad = bend * np.deg2rad(25.0)
    apply_to_simulation(Variation(tunnel_changes(bend_rad, 0.09)), model, data)
    geom = np.zeros(1, dtype=np.int32)
    turned = np.array([-np.sin(bend_rad), np.cos(bend_rad), 0.0])
    along = np.array([np.cos(bend_rad), np.sin(bend_rad), 0.0])
    middle = np.array([0.65, 0.0, 0.04])
    for point, aside in ((np.array([0.45, 0.0, 0.04]), np.array([0.0, 1.0, 0.0])), (middle + 0.2 * along, turned)):
        walls_m = [mujoco.mj_ray(model, data, point, way * aside, None, 1, -1, geom) for way in (1.0, -1.0)]
        assert walls_m == pytest.approx([0.06, 0.06], abs=1e-6)
        up_m = mujoco.mj_ray(model, data, point, np.array([0.0, 0.0, 1.0]), None, 1, -1, geom)
        assert up_m == pytest.approx(0.05, abs=1e-6)


@pytest.mark.parametrize(("level", "drift_m_s"), [("standard", 0.019), ("standard", 0.015), ("hard", 0.05)])
def test_a_ball_that_drifts_after_the_mount_by_itself_is_not_held(level, drift_m_s):
    episode = Episode(load_task("zero_gravity_grasping", level))
    episode.put("object_free", (0.08, 0.0, 0.45))
    episode.data.joint("object_free").qvel[:3] = (0.0, 0.0, drift_m_s)
    episode.run(15.0)
    assert not episode.won
