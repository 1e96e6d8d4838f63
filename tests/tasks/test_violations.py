"""What counts against a robot, and what loses an episode: just within the limits, and half as much again."""

import numpy as np
import pytest
from sights import altered, first, touches

from aidsr.tasks import TASKS, Readings, load_task
from aidsr.tasks.scoring import reset, score

LANES = ("flat_ground", "stairs", "incline", "obstacles", "gap", "tunnel")


def from_tip(away_m: float):
    """An object this far beside the functional part."""
    return lambda seen: {"object_position": seen["tip_position"][0] + (away_m, 0.0, 0.0)}


def at_height(sensor: str, height_m: float):
    return lambda seen: {sensor: (*seen[sensor][0, :2], height_m)}


def aside(left_m: float):
    """A robot this far to the left of its lane's middle line, somewhere along it."""
    return lambda seen: {
        "com_position": seen["lane_position"][0] + 0.5 * seen["lane_forward"][0] + left_m * seen["lane_left"][0]
    }


def from_bowl(along_m: float, up_m: float):
    return lambda seen: {"object_position": seen["bowl_position"][0] + (0.6 * along_m, 0.8 * along_m, up_m)}


def pushed(sensor: str, force_n: float):
    return lambda seen: {sensor: (0.6 * force_n, 0.0, -0.8 * force_n)}


def touched(sensor: str, *forces_n: float):
    return lambda seen: {sensor: touches(*forces_n)}


def knocked(sensor: str, force_n: float):
    """A contact that lasts a quarter of a control step of 40 ms."""
    return lambda seen: {sensor: np.concatenate([touches(force_n if step < 5 else 0.0) for step in range(20)], axis=1)}


VIOLATIONS = [
    ("button_pushing", pushed("robot_force", 20.0), 0.0),
    ("button_pushing", pushed("robot_force", 30.0), 0.5),
    ("button_pushing", pushed("tip_force", 30.0), 0.0),
    ("surface_adapting", touched("surface_contacts", 1.0, 5.0, 4.0), 0.0),
    ("surface_adapting", touched("surface_contacts", 1.0, 7.5), 0.5),
    ("pipe_inserting", touched("wall_contacts", 8.0, 12.0), 0.0),
    ("pipe_inserting", touched("wall_contacts", 12.0, 18.0), 0.5),
    ("pipe_inserting", knocked("wall_contacts", 30.0), 0.5),
    ("around_corners", touched("wall_contacts", 8.0, 12.0), 0.0),
    ("around_corners", touched("wall_contacts", 12.0, 18.0), 0.5),
    ("ball_from_bowl", touched("grip", 15.0, 15.0), 0.0),
    ("ball_from_bowl", touched("grip", 22.5), 0.5),
    ("ball_from_bowl", from_bowl(0.121, 0.039), 1.0),
    ("crank_turning", pushed("pin_force", 15.0), 0.0),
    ("crank_turning", pushed("pin_force", 22.5), 0.5),
    ("simple_grasping", lambda seen: {"object_velocity": (0.6, 0.0, 0.8)}, 0.0),
    ("simple_grasping", lambda seen: {"object_velocity": (0.9, 0.0, -1.2)}, 0.5),
    ("simple_grasping", at_height("object_position", 0.385), 0.0),
    ("simple_grasping", at_height("object_position", 0.375), 1.0),
    ("zero_gravity_grasping", from_tip(0.3), 0.0),
    ("zero_gravity_grasping", from_tip(0.45), 0.5),
    ("delicate_grasping", touched("grip", 1.0), 0.0),
    ("delicate_grasping", touched("grip", 1.5), 0.5),
    ("delicate_grasping", touched("grip", 0.9, 0.9, 0.6, 0.6), 0.0),
    ("delicate_grasping", touched("grip", 0.9, 0.9, 0.9, 0.9, 0.9), 0.5),
    ("dynamic_catching", touched("grip", 20.0, 20.0), 0.0),
    ("dynamic_catching", touched("grip", 30.0), 0.5),
    *[(lane, aside(left_m), 0.0) for lane in LANES for left_m in (-0.3, 0.3)],
    *[(lane, aside(left_m), 0.5) for lane in LANES[:-1] for left_m in (-0.35, 0.35)],
    ("tunnel", touched("wall_contacts", 8.0, 12.0), 0.0),
    ("tunnel", touched("wall_contacts", 12.0, 18.0), 0.5),
    ("tunnel", knocked("wall_contacts", 80.0), 0.0),
    ("tunnel", knocked("wall_contacts", 120.0), 0.5),
    *[("drawer_opening", pushed(f"drawer_{number}_force", 40.0), 0.0) for number in (1, 2, 3)],
    *[("drawer_opening", pushed(f"drawer_{number}_force", 60.0), 0.5) for number in (1, 2, 3)],
    ("force_controlled_brushing", touched("robot_contacts", 1.0, 2.0), 0.0),
    ("force_controlled_brushing", touched("robot_contacts", 1.5, 3.0), 0.5),
    ("force_controlled_brushing", touched("brush_contacts", 4.5), 0.0),
]

LOST = [
    ("ball_from_bowl", from_bowl(0.121, 0.039), True),
    ("ball_from_bowl", from_bowl(0.119, 0.039), False),
    ("ball_from_bowl", from_bowl(0.121, 0.041), False),
    ("simple_grasping", at_height("object_position", 0.385), False),
    ("simple_grasping", at_height("object_position", 0.375), True),
    ("zero_gravity_grasping", from_tip(0.59), False),
    ("zero_gravity_grasping", from_tip(0.61), True),
    ("delicate_grasping", touched("grip", 1.99), False),
    ("delicate_grasping", touched("grip", 2.0), True),
    ("delicate_grasping", touched("grip", 1.9, 1.9, 1.9), False),
    ("delicate_grasping", touched("grip", 1.9, 1.9, 1.9, 0.4), True),
    ("dynamic_catching", at_height("ball_position", 0.051), False),
    ("dynamic_catching", at_height("ball_position", 0.05), True),
    *[(lane, aside(left_m), False) for lane in LANES for left_m in (-0.39, 0.39)],
    *[(lane, aside(left_m), True) for lane in LANES for left_m in (-0.41, 0.41)],
    ("gap", pushed("pit_force", 0.04), False),
    ("gap", pushed("pit_force", 0.06), True),
]


def state(name: str, sensors, level: str = "standard") -> Readings:
    seen = first(name, level)
    return altered(seen, sensors(seen))


@pytest.mark.parametrize(("name", "sensors", "violation"), VIOLATIONS)
def test_what_passes_a_limit_counts_by_how_far(name, sensors, violation):
    assert load_task(name).violation(state(name, sensors)) == pytest.approx([violation])


@pytest.mark.parametrize(("name", "sensors", "lost"), LOST)
def test_what_cannot_be_made_good_is_lost(name, sensors, lost):
    task, seen = load_task(name), state(name, sensors)
    _, worth = score(task, reset(task, first(name)), seen, np.zeros((1, 1)))
    assert worth.failure.tolist() == [lost]


@pytest.mark.parametrize(("forces_n", "violation", "lost"), [((0.75,), 0.5, False), ((0.9, 0.9, 0.9, 0.4), 1.0, True)])
def test_at_the_hard_level_a_fragile_object_bears_half(forces_n, violation, lost):
    task = load_task("delicate_grasping", "hard")
    seen = state(task.name, touched("grip", *forces_n), "hard")
    assert task.violation(seen) == pytest.approx([violation])
    assert task.is_failure(seen, task.reset_state(seen)).tolist() == [lost]


def test_every_task_is_violated_here():
    tried = {name for name, _, violation in VIOLATIONS if violation}
    assert tried == {name.rpartition("/")[2] for name in TASKS}
