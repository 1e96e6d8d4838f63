"""Every feature of every task, compared with the simulation itself or with readings written by hand."""

import mujoco
import numpy as np
import pytest
import states
from sights import altered, first, slots, touches
from stick import Episode

from aidsr.tasks import TASKS, load_task


class Stirred(Episode):
    """An episode in which everything that can move is a little elsewhere and under way."""

    def __init__(self, task) -> None:
        super().__init__(task)
        rng = np.random.default_rng(4)
        mujoco.mj_integratePos(self.model, self.data.qpos, rng.normal(0.0, 0.02, self.model.nv), 1.0)
        self.data.qvel = rng.normal(0.0, 0.3, self.model.nv)
        mujoco.mj_forward(self.model, self.data)

    def site(self, name: str) -> np.ndarray:
        return self.data.site(name).xpos

    def body(self, name: str) -> np.ndarray:
        return self.data.body(name).xpos

    def axis(self, name: str, which: int) -> np.ndarray:
        return self.data.body(name).xmat.reshape(3, 3)[:, which]

    def slid(self, *joints: str) -> np.ndarray:
        return np.array([self.data.joint(name).qpos[0] for name in joints])

    def moving(self, joint: str) -> np.ndarray:
        return self.data.joint(joint).qvel[:3]

    @property
    def lane(self) -> np.ndarray:
        """Rows forward, left and up."""
        turn = next(
            (c.value for c in self.variation.changes if (c.field, c.name) == ("body_quat", "lane")), (1, 0, 0, 0)
        )
        yaw = 2 * np.arctan2(turn[3], turn[0])
        return np.array([[np.cos(yaw), np.sin(yaw), 0.0], [-np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])

    @property
    def balls_m(self) -> np.ndarray:
        """Both ends and the middle of the stick, seen in the lane, (3, 3) [m]."""
        middle, along = self.data.body("robot/stick").xipos, self.axis("robot/stick", 2)
        return (middle + 0.052 * np.array([[-1.0], [0.0], [1.0]]) * along) @ self.lane.T

    @property
    def stick_m_s(self) -> np.ndarray:
        velocity = np.zeros(6)
        stick = self.model.body("robot/stick").id
        mujoco.mj_objectVelocity(self.model, self.data, mujoco.mjtObj.mjOBJ_BODY, stick, velocity, 0)
        return velocity[3:]

    def near_edge_m(self, geom: str) -> float:
        box = self.model.geom(geom)
        return box.pos[0] - box.size[0]


def to_object(e: Stirred) -> np.ndarray:
    return np.concatenate([e.body("object") - e.tip_m, e.moving("object_free"), e.body("object") - e.site("mount")])


def travelling(e: Stirred) -> np.ndarray:
    middle_m = e.lane @ e.data.body("robot/stick").xipos
    return np.concatenate([middle_m, e.lane @ e.stick_m_s, e.lane[0, :2]])


def to_obstacles(e: Stirred) -> np.ndarray:
    ways = []
    for post in (e.model.geom(f"post_{number}") for number in (1, 2)):
        side = np.sign(e.model.geom(post.name.replace("post", "barrier")).pos[1])
        ways.append(post.pos[:2] - (0.0, side * (post.size[0] + 0.1)) - e.balls_m[1, :2])
    return np.concatenate(ways)


def in_box(e: Stirred) -> np.ndarray:
    return e.data.body("box").xmat.reshape(3, 3).T @ (e.tip_m - e.body("box"))


def of_incline(e: Stirred) -> np.ndarray:
    turn = e.model.geom("ramp").quat
    return np.array([-np.tan(2 * np.arctan2(turn[2], turn[0])), e.near_edge_m("plateau")])


def of_crank(e: Stirred) -> np.ndarray:
    (angle,) = e.slid("crank")
    turned = e.variation.parameters["direction"][0] * (angle - e.course[0][0]["crank_angle"][0, 0])
    return np.array([np.cos(angle), np.sin(angle), turned / np.deg2rad(270)])


def in_pipe(e: Stirred) -> np.ndarray:
    wall = e.data.geom("branch_left")
    along = wall.xmat.reshape(3, 3)[:, 2]
    junction = wall.xpos - 0.08 * along - 0.039 * e.axis("pipe", 1)
    to_goal = junction + 0.1 * along - e.tip_m
    junction_m = e.body("pipe")[2] - junction[2]
    x, y, z = (e.axis("pipe", axis) @ (e.tip_m - e.body("pipe")) for axis in range(3))
    beside = max(abs(x), abs(y)) / 0.035
    return np.array([*(e.body("pipe") - e.tip_m), *to_goal, *along, -z / (junction_m + 0.1), beside])


def ends_in_gap(e: Stirred) -> np.ndarray:
    along_m, width_m = e.balls_m[:, 0], e.near_edge_m("far_platform") - 1.0
    return np.array([along_m.min() - 0.008, along_m.max() + 0.008, width_m / 0.10])


def before_tunnel(e: Stirred) -> np.ndarray:
    away_m = np.linalg.norm(e.balls_m[:, :2] - (0.35, 0.0), axis=1)
    turn, roof = e.model.geom("left_2").quat, e.model.geom("roof_1")
    bend_rad, height_m = 2 * np.arctan2(turn[3], turn[0]), roof.pos[2] - roof.size[2]
    return np.array([-away_m.max() - 0.008, -away_m.min() + 0.008, bend_rad, height_m / 0.10])


def of_stairs(e: Stirred) -> np.ndarray:
    tread_m = e.near_edge_m("step_2") - e.near_edge_m("step_1")
    return np.array([tread_m / 0.15, 2 * e.model.geom("step_1").size[2] / 0.02])


def in_cylinder(e: Stirred) -> np.ndarray:
    radius_m = e.model.geom("surface_block").size[2]
    return np.array([*(e.body("surface") - e.tip_m), *-e.axis("surface", 0), radius_m / 0.25])


def to_first_drawer(e: Stirred) -> np.ndarray:
    drawer = f"drawer_{int(e.variation.parameters['order'][0]) + 1}"
    return np.array([*(e.body(f"{drawer}_handle") - e.tip_m), *e.slid(drawer) / 0.06])


def to_first_cell(e: Stirred) -> np.ndarray:
    corner = e.body("wall") - 0.12 * e.axis("wall", 0) + 0.12 * e.axis("wall", 2)
    return np.array([*(corner - e.tip_m), *-e.axis("wall", 1)])


MOVED = {
    "button_pushing": [
        (0, lambda e: e.site("button_face") - e.tip_m),
        (3, lambda e: e.data.site("button_face").xmat[::3]),
        (6, lambda e: e.slid("button_slide") / 0.005),
    ],
    "surface_adapting": [(0, in_cylinder)],
    "pipe_inserting": [(0, in_pipe), (11, lambda e: e.slid("feed"))],
    "simple_grasping": [(0, to_object), (9, lambda e: e.slid("carriage_lift"))],
    "zero_gravity_grasping": [
        (0, to_object),
        (9, lambda e: e.slid("carriage_lift")),
        (13, lambda e: e.data.body("object").xmat.reshape(3, 3) @ e.data.joint("object_free").qvel[3:]),
    ],
    "delicate_grasping": [(0, to_object), (9, lambda e: e.slid("carriage_lift"))],
    "dynamic_catching": [
        (0, lambda e: e.body("ball") - e.tip_m),
        (3, lambda e: e.body("ball") - e.site("keeping_place")),
        (6, lambda e: e.moving("ball_free")),
        (12, lambda e: e.slid("mount_turn") / np.deg2rad(135.0)),
    ],
    "flat_ground": [(0, travelling)],
    "stairs": [(0, travelling), (8, of_stairs)],
    "obstacles": [(0, travelling), (8, to_obstacles)],
    "gap": [(0, travelling), (8, ends_in_gap)],
    "tunnel": [(0, travelling), (8, before_tunnel)],
    "drawer_opening": [
        (0, to_first_drawer),
        (6, lambda e: e.slid("base_x", "base_z")),
        (8, lambda e: e.slid("drawer_1", "drawer_2", "drawer_3") / 0.06),
    ],
    "around_corners": [
        (0, in_box),
        (3, lambda e: np.array([0.075, 0.0, 0.0]) - in_box(e)),
        (6, lambda e: e.axis("box", 0)[:2]),
        (8, lambda e: e.slid("feed")),
    ],
    "ball_from_bowl": [
        (0, to_object),
        (9, lambda e: e.slid("base_z")),
        (10, lambda e: (e.body("object")[2:] - e.course[0][0]["object_position"][0, 2]) / 0.1),
    ],
    "incline": [(0, travelling), (8, of_incline)],
    "crank_turning": [
        (0, lambda e: e.site("pin") - e.tip_m),
        (3, of_crank),
        (7, lambda e: e.slid("base_y", "base_z")),
    ],
    "force_controlled_brushing": [(0, to_first_cell), (10, lambda e: e.slid("base_x", "base_z"))],
}
"""By task and first column, what the simulation itself says."""

FIVE_BRUSHED = np.where(np.arange(25) < 5, 0.1, 0.0)

SAID = [
    ("button_pushing", {"tip_force": (3.0, 0.0, -4.0)}, {"asked": 1.0}, {7: 1.0, 8: 1.0}),
    ("surface_adapting", {"surface_contacts": touches(2.0, 1.0)}, {}, {9: 0.4}),
    ("pipe_inserting", {"wall_contacts": touches(2.0, 1.0)}, {"entered": 1.0}, {12: 0.6, 13: 1.0}),
    (
        "around_corners",
        {"tip_force": (0.0, 3.0, -4.0), "wall_contacts": touches(2.0, 1.0)},
        {},
        {9: 1.0, 10: 0.6},
    ),
    ("ball_from_bowl", {"grip": touches(2.0, 1.0)}, {}, {11: 0.4, 12: 0.5}),
    ("crank_turning", {"pin_force": (3.0, 0.0, -4.0)}, {}, {6: -1.0, 9: 1.0}),
    ("simple_grasping", {"grip": touches(2.0, 1.0)}, {}, {11: 0.4, 12: 0.5}),
    ("zero_gravity_grasping", {"grip": touches(1.0, 2.0)}, {}, {11: 0.4, 12: 0.5}),
    ("delicate_grasping", {"grip": touches(1.0, 0.5)}, {}, {11: 0.2, 12: 0.5, 13: 0.25}),
    (
        "dynamic_catching",
        {"grip": touches(2.0, 1.0)},
        {"caught_s": 0.5, "kept": 1.0},
        {9: 0.4, 10: 0.5, 11: 0.2, 13: 1.0},
    ),
    ("drawer_opening", {f"drawer_{n}_force": (0.0, 3.0, 4.0) for n in (1, 2, 3)}, {"stage": 3.0}, {4: 1.0, 5: -1.0}),
    ("force_controlled_brushing", {"brush_contacts": touches(0.4, 0.3)}, {}, {6: 0.7, 7: 1.0}),
    ("force_controlled_brushing", {"brush_contacts": touches(0.6, 0.5)}, {}, {6: 1.1, 7: 0.0}),
    (
        "force_controlled_brushing",
        {"robot_contacts": touches(0.5)},
        {"cells_s": FIVE_BRUSHED, "band_s": 3.0, "contact_s": 4.0},
        {6: 0.0, 8: 0.2, 9: 0.75},
    ),
]
"""What is read and remembered, and the columns that tell of it."""

ELSEWHERE = {
    "surface_adapting": {7, 8, 10},
    "simple_grasping": {10},
    "zero_gravity_grasping": {10},
    "delicate_grasping": {10},
}
"""Columns with a test of their own below."""


@pytest.mark.parametrize("name", MOVED)
def test_features_are_what_the_simulation_says(name):
    task = load_task(name)
    episode = Stirred(task)
    features = task.observe(episode.look(), episode.state.task_state)[0]
    for column, what in MOVED[name]:
        said = what(episode)
        assert features[column : column + len(said)] == pytest.approx(said, abs=1e-6), column
        assert np.abs(said).max() > 1e-3


@pytest.mark.parametrize(("name", "sensors", "remembered", "columns"), SAID)
def test_features_tell_of_touch_and_memory(name, sensors, remembered, columns):
    task, seen = load_task(name), first(name)
    memory = {**task.reset_state(seen), **{what: np.asarray(value)[None] for what, value in remembered.items()}}
    features = task.observe(altered(seen, sensors), memory)[0]
    assert {column: features[column] for column in columns} == pytest.approx(columns)


def test_contacts_that_face_each_other_are_told():
    seen = altered(first("simple_grasping"), {"grip": slots((1.0, (0.0, 1.0, 0.0)), (1.0, (0.0, -1.0, 0.0)))})
    assert load_task("simple_grasping").observe(seen, {})[0, 12] == 1.0


@pytest.mark.parametrize(
    ("name", "time_s", "told"),
    [("simple_grasping", 4.5, 1.0), ("delicate_grasping", 2.25, 0.5), ("zero_gravity_grasping", 7.5, 1.5)],
)
def test_the_time_of_the_carriage_is_told(name, time_s, told):
    assert load_task(name).observe(altered(first(name), {}, time_s=time_s), {})[0, 10] == pytest.approx(told)


@pytest.mark.parametrize(("gap_m", "lies"), [(0.002, 1.0), (0.05, 0.0)])
def test_how_much_of_a_body_lies_on_the_surface_is_told(gap_m, lies):
    episode = Episode(load_task("surface_adapting"), base="free")
    out_m = episode.variation.parameters["radius_m"][0] + 0.008 + gap_m
    middle = episode.data.body("surface").xpos - out_m * episode.sensor("surface_back")
    episode.place(middle + np.array([0.0, 0.06, 0.0]), (0.0, 1.0, 0.0))
    features = episode.task.observe(episode.look(), {})[0]
    assert features[7:9] == pytest.approx([lies, gap_m], abs=1e-6)


@pytest.mark.parametrize(("spread_lengths", "told"), [(0.15, 1.0), (0.3, 2.0)])
def test_the_spread_of_contacts_on_the_surface_is_told(spread_lengths, told):
    task, seen, memory = states.of("surface_adapting", spread_lengths=spread_lengths)
    assert task.observe(seen, memory)[0, 10] == pytest.approx(told, abs=1e-6)


@pytest.mark.parametrize("name", TASKS)
def test_every_feature_is_looked_at_here(name):
    short = name.rpartition("/")[2]
    episode = Stirred(load_task(name))
    moved = {column + k for column, what in MOVED[short] for k in range(len(what(episode)))}
    said = {column for task, _, _, columns in SAID if task == short for column in columns}
    width = sum(feature.size for feature in episode.task.features)
    assert moved | said | ELSEWHERE.get(short, set()) == set(range(width))
