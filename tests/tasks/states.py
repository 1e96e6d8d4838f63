"""States just good enough for each task, as what is read and remembered there; the arguments are what can be amiss."""

import numpy as np
from sights import altered, first, outlined, slots, touches

from aidsr.tasks import Readings, Task, load_task
from aidsr.tasks.task import TaskState

JUST = 1e-6
OPPOSED = slots((0.3, (1.0, 0.0, 0.0)), (0.3, (-1.0, 0.0, 0.0)))


def of(name: str, level: str = "standard", **amiss) -> tuple[Task, Readings, TaskState]:
    """A task, what it reads and what it remembers, just good enough but for what is amiss."""
    task, seen = load_task(name, level), first(name, level)
    then, remembered = globals()[name.rpartition("/")[2]](task, seen, **amiss)
    return (
        task,
        then,
        {**task.reset_state(seen), **{what: np.asarray(value)[None] for what, value in remembered.items()}},
    )


def button_pushing(task, seen, travel_m=0.005, tip_n=0.06, robot_n=0.06, away_m=0.0, asked=1.0):
    tip_m = seen["button_position"][0] + (0.6 * away_m, 0.0, 0.8 * away_m)
    forces = {"tip_force": (0, 0, tip_n), "robot_force": (0, 0, robot_n)}
    return altered(seen, {"button_travel": travel_m, "tip_position": tip_m, **forces}), {"asked": asked}


def surface_adapting(
    task, seen, lying=None, gap_lengths=0.0299, aside_m=0.0, spread_lengths=0.1501, touch_n=0.05, too_hard_s=0.5
):
    """A body of ten balls around the half cylinder, of which some lie on it; it touches at two places."""
    lying = round(10 * task.share_on_surface) if lying is None else lying
    back, axis_m = seen["surface_back"][0], seen["surface_position"][0]
    gaps_m = np.where(np.arange(10) < lying, gap_lengths, 0.1) * seen.length_m
    out_m = seen.parameters["radius_m"][0, 0] + 0.008 + gaps_m
    body = outlined(seen, axis_m - out_m[:, None] * back + (0.0, aside_m, 0.0))
    radius_m, around = seen.parameters["radius_m"][0, 0], np.array([-back[2], 0.0, back[0]])
    contacts = np.zeros((16, 10))
    for slot, turn in zip(contacts, (0.1, 0.1 + spread_lengths * seen.length_m / radius_m), strict=False):
        slot[:2], slot[4:7] = (2.0, touch_n), axis_m + radius_m * (np.sin(turn) * around - np.cos(turn) * back)
    touching = {"surface_contacts": contacts.reshape(1, 1, -1)}
    return altered(body, touching), {"touching_s": 10.0, "too_hard_s": too_hard_s}


def pipe_inserting(task, seen, branch_m=0.1001, way=None, beside_m=0.034, across_m=0.0, too_hard_s=0.5, entered=1.0):
    """Somewhere in the branch, or this share of the way down to it."""
    side_rad, junction_m, branch_rad = (
        seen.parameters[name][0, 0] for name in ("side_rad", "junction_m", "branch_rad")
    )
    out, left = np.array([np.cos(side_rad), np.sin(side_rad), 0.0]), np.array([-np.sin(side_rad), np.cos(side_rad), 0])
    up = np.cos(branch_rad) * out + np.array([0.0, 0.0, np.sin(branch_rad)])
    in_branch_m = np.sin(branch_rad) * out - np.array([0.0, 0.0, np.cos(branch_rad)])
    deep_m = np.array([0.0, 0.0, -junction_m * (1.0 if way is None else way)])
    from_mouth_m = deep_m + beside_m * left + (branch_m * in_branch_m + across_m * up if way is None else 0.0)
    remembered = {"touching_s": 10.0, "too_hard_s": too_hard_s, "entered": entered}
    return altered(seen, {"tip_position": seen["pipe_position"][0] + from_mouth_m}), remembered


def around_corners(task, seen, above_m=0.0, tip_n=0.51):
    tip_m = seen["box_position"][0] - 0.07 * seen["box_forward"][0] + (0.0, 0.0, -0.246 + above_m)
    return altered(seen, {"tip_position": tip_m, "tip_force": (0.0, 0.6 * tip_n, -0.8 * tip_n)}), {}


def simple_grasping(task, seen, raised_m=0.1001, slip_m=0.0199, time_s=4.5, **grip):
    sensors = _held(seen, (slip_m, 0.0, raised_m), (0.0, 0.0, raised_m), **grip)
    return altered(seen, sensors, time_s=time_s), {"lifted": 1.0}


def delicate_grasping(task, seen, raised_m=0.1001, **grip):
    return altered(seen, _held(seen, (0.0, 0.0, raised_m), (0.0, 0.0, raised_m), **grip)), {}


def zero_gravity_grasping(task, seen, time_s=3.0, drift_m_s=0.0199, touched=True, moved_m=0.0499, **grip):
    mount_m_s = np.array([0.0, 0.0, 0.05])
    sensors = {"object_velocity": mount_m_s + np.array([drift_m_s, 0.0, 0.0]), "mount_velocity": mount_m_s}
    sensors |= {"grip": touches(*[0.3] * touched), **_held(seen, **grip)}
    return altered(seen, sensors, time_s=time_s), {"moved_m": moved_m}


def dynamic_catching(task, seen, away_m=0.1501, closest_m=0.0, touched=1.0, caught_s=2.5, kept=1.0):
    ball = {"ball_position": seen["keeping_position"][0] + (0.0, 0.6 * away_m, -0.8 * away_m)}
    return altered(seen, ball), {"closest": closest_m, "touched": touched, "caught_s": caught_s, "kept": kept}


def ball_from_bowl(task, seen, raised_m=0.1001, **grip):
    return altered(seen, _held(seen, (0.0, 0.0, raised_m), **grip)), {}


def flat_ground(task, seen, forward_m=None, aside_m=0.299, length_m=0.3):
    forward_m = task.goal_m + JUST if forward_m is None else forward_m
    return _in_lane(seen, _start_m(seen)[0] + forward_m, aside_m, length_m=length_m), {}


def stairs(task, seen, way=1.0 + JUST, climbed=0.801, aside_m=0.299):
    tread_m, rise_m = (seen.parameters[name][0, 0] for name in ("tread_m", "rise_m"))
    start_m, _, low_m = _start_m(seen)
    along_m = start_m + way * (0.4 + 2 * tread_m - start_m)
    return _in_lane(seen, along_m, aside_m, low_m + climbed * 3 * rise_m), {}


def incline(task, seen, way=1.0 + JUST, climbed=0.801, aside_m=0.299):
    edge_m, rise_m = (seen.parameters[name][0, 0] for name in ("edge_m", "rise_m"))
    start_m, _, low_m = _start_m(seen)
    return _in_lane(seen, start_m + way * (edge_m - start_m), aside_m, low_m + climbed * rise_m), {}


def obstacles(task, seen, along_m=1.1 + JUST, aside_m=0.299):
    return _in_lane(seen, along_m, aside_m), {}


def gap(task, seen, way=1.0 + JUST):
    """The rearmost part has come this share of its way, from where the stick stands; all others are ahead of it."""
    rear_m = -0.008 + way * (1.0 + seen.parameters["width_m"][0, 0] + 0.02 + 0.008)
    along_m = rear_m + 0.008 + np.array([0.3, 0.0, 0.1])
    lane = seen["lane_position"][0] + along_m[:, None] * seen["lane_forward"][0]
    return outlined(seen, lane + 0.1 * seen["lane_left"][0]), {}


def tunnel(task, seen, way=1.0 + JUST):
    """Likewise, along the tunnel's middle line."""
    bend_rad = seen.parameters["bend_rad"][0, 0]
    along_m = (-0.358 + way * (0.6 + 0.358) + 0.008 + np.array([0.3, 0.0, 0.1]))[:, None]
    forward, left = seen["lane_forward"][0], seen["lane_left"][0]
    turned = np.cos(bend_rad) * forward + np.sin(bend_rad) * left
    from_start = (0.35 + np.minimum(along_m, 0.3)) * forward + np.maximum(along_m - 0.3, 0.0) * turned
    return outlined(seen, seen["lane_position"][0] + from_start), {}


def drawer_opening(task, seen, stage=12.0, open_m=(0.0099, 0.0, 0.0099)):
    openings = {f"drawer_{number}_opening": opening_m for number, opening_m in enumerate(open_m, start=1)}
    return altered(seen, openings), {"stage": stage}


def force_controlled_brushing(task, seen, brushed=None, stroke_s=0.1, band_s=6.001, too_hard_s=0.5):
    cells = task.cells_a_side**2
    brushed = int(np.ceil(task.coverage * cells - JUST)) if brushed is None else brushed
    cells_s = np.where(np.arange(cells) < brushed, stroke_s, 0.0)
    times_s = {"band_s": band_s, "contact_s": 10.0, "touching_s": 10.0, "too_hard_s": too_hard_s}
    return seen, {"cells_s": cells_s, **times_s}


def crank_turning(task, seen, turned_deg=None, near=True):
    turned_deg = task.turn_deg + JUST if turned_deg is None else turned_deg
    angle = seen["crank_angle"][0, 0] + np.deg2rad(turned_deg) * seen.parameters["direction"][0, 0]
    tip_m = seen["pin_position"][0] - (0.0 if near else 0.5, 0.0, 0.0)
    return altered(seen, {"crank_angle": angle, "tip_position": tip_m}), {}


def _held(seen, object_way_m=(0.0, 0.0, 0.0), tip_way_m=(0.0, 0.0, 0.0), *, away_m=None, opposed=False) -> dict:
    """Sensors after object and functional part have moved; or with the functional part this far beside the object."""
    object_m = seen["object_position"][0] + object_way_m
    tip_m = seen["tip_position"][0] + tip_way_m if away_m is None else object_m + np.array([0.0, away_m, 0.0])
    return {"object_position": object_m, "tip_position": tip_m, **({"grip": OPPOSED} if opposed else {})}


def _start_m(seen) -> np.ndarray:
    """Where the centre of mass begins: along the lane, to its left, and over the ground [m]."""
    from_lane = seen["com_position"][0] - seen["lane_position"][0]
    return np.array([from_lane @ seen["lane_forward"][0], from_lane @ seen["lane_left"][0], from_lane[2]])


def _in_lane(seen, along_m, aside_m, up_m=0.02, **fields):
    place_m = seen["lane_position"][0] + along_m * seen["lane_forward"][0] + aside_m * seen["lane_left"][0]
    return altered(seen, {"com_position": (*place_m[:2], place_m[2] + up_m)}, **fields)
