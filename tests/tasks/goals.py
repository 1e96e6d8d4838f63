"""One way to the goal of each task, played by hand: the stick or the object is pulled along with limited forces.

Each function plays an episode to its end. What it does is what a good robot would achieve, not how.
"""

from functools import cache

import numpy as np
from stick import Episode

from aidsr.tasks import Task, load_task
from aidsr.tasks.reaching.pipe_inserting import branch_direction
from aidsr.tasks.reaching.surface_adapting import ROD_M

STICK = "robot/stick"
WAVY = 1
"""An episode whose surface has waves."""


@cache
def played(name: str, level: str = "standard") -> Episode:
    """The way to the goal of a task, played once; to be looked at only."""
    return globals()[name.rpartition("/")[2]](load_task(name, level))


def button_pushing(task: Task) -> Episode:
    episode = Episode(task, base="free")
    face, inwards = episode.sensor("button_position"), episode.sensor("button_direction")
    for way in (0.15, 0.1, 0.05, 0.01):
        episode.place(face - way * inwards, inwards)
        episode.step()
    while episode.data.time < episode.variation.parameters["signal_s"][0]:
        episode.place(face - 0.01 * inwards, inwards)
        episode.step()
    goal = face + 0.013 * inwards
    episode.run(2.0, lambda e: e.hold(STICK, e.tip_m, goal, along=inwards))
    return episode


def surface_adapting(task: Task) -> Episode:
    episode = Episode(task, base="free", index=WAVY)
    back, radius_m = episode.sensor("surface_back"), episode.variation.parameters["radius_m"][0]
    # on two neighbouring waves, the one straight ahead and the next, where a straight body touches twice
    between, around = np.deg2rad(10.0), np.array([-back[2], 0.0, back[0]])
    out, along = (np.cos(turn) * -back + np.sin(turn) * around for turn in (between, between + np.pi / 2))
    lying_m = (radius_m - ROD_M) * np.cos(between) + ROD_M + 0.008
    for way in (0.1, 0.05, 0.001):
        middle = episode.sensor("surface_position") + (lying_m + way) * out
        episode.place(middle + 0.06 * along, along)
        episode.step()
    goal = middle - 0.0025 * out
    episode.run(2.0, lambda e: e.hold(STICK, e.data.body(STICK).xipos, goal, along=along))
    return episode


def pipe_inserting(task: Task) -> Episode:
    episode = Episode(task, base="free")
    down, branch = np.array([0.0, 0.0, -1.0]), branch_direction(episode.look())[0]
    mouth, junction_m = episode.sensor("pipe_position"), episode.variation.parameters["junction_m"][0]
    for depth_m in (-0.1, 0.0, 0.06, 0.1, junction_m):
        episode.place(mouth + depth_m * down, down)
        episode.step()
    # a stick is straight: it is put into the branch as if it had bent on the way
    for depth_m in (0.05, 0.105):
        episode.place(mouth + junction_m * down + depth_m * branch, branch)
        episode.step()
    episode.run(2.0)
    return episode


def around_corners(task: Task) -> Episode:
    episode = Episode(task, base="free")
    box, forward = episode.sensor("box_position"), episode.sensor("box_forward")
    side_m, down = (0.13 + task.overlap_m) / 2, np.array([0.0, 0.0, -1.0])
    way = [(side_m, 0.1), (side_m, 0.0), (side_m, -0.08), (side_m, -0.155), (0.03, -0.155), (-0.03, -0.155)]
    for along_m, up_m in (*way, (-side_m, -0.155), (-side_m, -0.2), (-side_m, -0.244)):
        goal = box + along_m * forward - up_m * down
        episode.place(goal, down)
        episode.step()
    episode.run(2.0, lambda e: e.hold(STICK, e.tip_m, goal + 0.003 * down, along=down))
    return episode


def simple_grasping(task: Task) -> Episode:
    return _carried(Episode(task), after_s=3.0)


def delicate_grasping(task: Task) -> Episode:
    return _carried(Episode(task), after_s=3.0)


def zero_gravity_grasping(task: Task) -> Episode:
    return _carried(Episode(task), after_s=1.0)


def dynamic_catching(task: Task) -> Episode:
    episode = Episode(task)
    capture = episode.sensor("keeping_position")
    while np.linalg.norm(episode.sensor("ball_position") - capture) > 0.04:
        episode.step()
    episode.put("ball_free", capture)

    def hand(e: Episode) -> None:
        if e.state.task_state["kept"][0]:
            e.data.xfrc_applied[:] = 0.0
        else:
            e.hold("ball", e.sensor("ball_position"), e.sensor("keeping_position") + np.array([0.0, 0.0, 0.0005]))

    episode.run(5.0, hand)
    return episode


def ball_from_bowl(task: Task) -> Episode:
    episode = Episode(task)
    start = episode.sensor("object_position")
    weight = np.array([0.0, 0.0, 9.81 * episode.model.body("object").mass[0] / 1000.0])

    def hand(e: Episode) -> None:
        up_m = min(0.1 * e.data.time, 0.115)
        e.hold("object", e.sensor("object_position"), start + weight + (0.0, 0.0, up_m))

    episode.run(4.0, hand)
    return episode


def flat_ground(task: Task) -> Episode:
    return _travelled(task, [(x, 0.0, 0.02) for x in np.linspace(0.0, 1.05 * task.goal_m, 20)])


def stairs(task: Task) -> Episode:
    episode = Episode(task)
    rise_m, tread_m = (episode.variation.parameters[name][0] for name in ("rise_m", "tread_m"))
    steps = [(0.4 + (step + 0.5) * tread_m, 0.0, rise_m * (step + 1) + 0.02) for step in range(3)]
    return _travelled(task, [(0.1, 0.0, 0.02), (0.3, 0.0, 0.02), *steps])


def incline(task: Task) -> Episode:
    slope, edge_m = (Episode(task).variation.parameters[name][0] for name in ("slope", "edge_m"))
    return _travelled(
        task,
        [(x, 0.0, 0.02 + slope * np.clip(x - 0.35, 0.0, edge_m - 0.35)) for x in np.linspace(0.0, edge_m + 0.15, 20)],
    )


def obstacles(task: Task) -> Episode:
    turns_m = np.reshape(Episode(task).variation.parameters["turns_m"], (-1, 2))
    corners = np.array([(0.0, 0.0), *turns_m, (1.15, turns_m[-1, 1])])
    along_m = np.linspace(0.0, 1.15, 30)
    # it is the middle of the stick that goes around the corners
    return _travelled(task, [(x + 0.06, np.interp(x, *corners.T), 0.02) for x in along_m])


def gap(task: Task) -> Episode:
    return _travelled(task, [(x, 0.0, 0.02) for x in np.linspace(0.0, 1.4, 35)])


def tunnel(task: Task) -> Episode:
    bend_rad = Episode(task).variation.parameters["bend_rad"][0]
    first = [(x, 0.0, 0.02) for x in np.linspace(0.0, 0.65, 12)]
    second = [(0.65 + s * np.cos(bend_rad), s * np.sin(bend_rad), 0.02) for s in np.linspace(0.0, 0.45, 12)]
    return _travelled(task, [*first, *second])


def drawer_opening(task: Task) -> Episode:
    episode = Episode(task, base="free")
    beside = np.array([0.0, 0.045, 0.0])
    for number in episode.variation.parameters["order"]:
        drawer = f"drawer_{int(number) + 1}"
        episode.place(episode.sensor(f"{drawer}_position") + beside, (0.0, -1.0, 0.0))
        for goal_m, seconds in ((0.0, 1.2), (0.07, 0.6), (0.0, 1.2)):

            def hand(e: Episode, drawer: str = drawer, goal_m: float = goal_m) -> None:
                # the tip leans on the end of the bar while the drawer is moved
                end = e.sensor(f"{drawer}_position") + 0.5 * beside
                e.hold(STICK, e.tip_m, end, along=(0.0, -1.0, 0.0), strongest_n=2.0)
                slide = e.data.joint(drawer)
                force_n = 400.0 * (goal_m - slide.qpos[0]) - 10.0 * slide.qvel[0]
                slide.qfrc_applied = np.clip(force_n, -5.0, 5.0)

            episode.run(seconds, hand)
    return episode


def crank_turning(task: Task) -> Episode:
    episode = Episode(task, base="free")
    direction = episode.variation.parameters["direction"][0]
    crank, start = episode.data.joint("crank"), episode.data.joint("crank").qpos[0]

    def hand(e: Episode) -> None:
        left = np.deg2rad(task.turn_deg + 2.0) - direction * (crank.qpos[0] - start)
        crank.qfrc_applied = direction * (1.2 * task.torque_nm * np.sign(left)) + 0.05 * (
            direction * np.clip(10 * left, -2.5, 2.5) - crank.qvel[0]
        )

    while not episode.won and episode.data.time < 6.0:
        # beside the pin, clear of it
        angle = crank.qpos[0]
        episode.place(
            episode.sensor("pin_position") + 0.02 * np.array([0.0, -np.sin(angle), np.cos(angle)]), (1.0, 0.0, 0.0)
        )
        episode.step(hand)
    return episode


def force_controlled_brushing(task: Task) -> Episode:
    episode = Episode(task, base="free")
    right, back, up = (episode.sensor(f"wall_{axis}") for axis in ("right", "back", "up"))
    middle, side_m = episode.sensor("wall_position"), 0.30 / task.cells_a_side
    for row in range(task.cells_a_side):
        columns = range(task.cells_a_side)
        for column in columns if row % 2 == 0 else reversed(columns):
            if episode.won:
                break
            across = [(index + 0.5) * side_m - 0.15 for index in (column, row)]
            cell = middle + across[0] * right - across[1] * up
            episode.place(cell, back)
            # 0.6 mm into the wall at 1000 N/m
            for _ in range(4):
                episode.step(lambda e, goal=cell + 0.0006 * back: e.hold(STICK, e.tip_m, goal, along=back))
    return episode


def _carried(episode: Episode, after_s: float) -> Episode:
    """The object comes along with the carriage, just below the stick, as if it were held."""
    episode.run(after_s)
    offset = episode.sensor("object_position") - episode.sensor("mount_position")
    if not episode.model.opt.gravity[2]:
        offset = np.array([0.0, 0.0, -0.147])  # too near by more than the hand lags behind, so that it touches

    def hand(e: Episode) -> None:
        goal = e.sensor("mount_position") + offset
        weight = (0.0, 0.0, 9.81 * e.model.body("object").mass[0] / 1000.0) if e.model.opt.gravity[2] else 0.0
        e.hold("object", e.sensor("object_position"), goal + weight)

    episode.run(5.5, hand)
    return episode


def _travelled(task: Task, way_m: list[tuple[float, float, float]]) -> Episode:
    """The stick is set down along a way in the lane, lying flat and pointing forward, and stays at its end."""
    episode = Episode(task)
    forward, left = episode.sensor("lane_forward"), episode.sensor("lane_left")
    for x, y, z in way_m:
        episode.place(x * forward + y * left + (0.0, 0.0, z), forward)
        episode.step()
    episode.run(2.0)
    return episode
