"""Manipulation: what progress is made of while a drawer is moved or a wall is brushed."""

import mujoco
import numpy as np
import pytest
from sights import altered
from stick import Episode

from aidsr.tasks import load_task
from aidsr.tasks.manipulation.drawer_opening import wanted
from aidsr.tasks.manipulation.force_controlled_brushing import in_order

CELLS = 25


def memory(*brushed: int) -> dict[str, np.ndarray]:
    cells_s = np.zeros((1, CELLS))
    cells_s[0, list(brushed)] = 0.1
    times_s = {"band_s": np.ones(1), "contact_s": np.ones(1), "touching_s": np.ones(1), "too_hard_s": np.zeros(1)}
    return {"cells_s": cells_s, **times_s}


@pytest.mark.parametrize(
    ("brushed", "expected"), [((), 0), ((0, 1, 2), 3), ((1, 2, 3), 0), ((0, 1, 5), 2), (range(CELLS), CELLS)]
)
def test_cells_count_up_to_the_first_that_is_missing(brushed, expected):
    assert in_order(memory(*brushed)).tolist() == [expected]


def test_progress_waits_for_the_cell_whose_turn_it_is():
    task = load_task("force_controlled_brushing")
    seen = Episode(task).look()
    first, elsewhere, both = (float(task.progress(seen, memory(*b))[0]) for b in ((0,), (8, 9), (0, 1)))
    assert first > elsewhere + 0.02
    assert both > first


def test_enough_cells_count_from_the_first_on():
    task = load_task("force_controlled_brushing")
    seen = Episode(task).look()
    assert task.is_success(seen, memory(*range(18))).tolist() == [True]
    assert task.progress(seen, memory(*range(18))).tolist() == [1.0]
    assert task.is_success(seen, memory(*range(CELLS - 18, CELLS))).tolist() == [False]


@pytest.mark.parametrize(("brushed", "counted"), [(6, True), (5, False), (7, False)])
def test_a_cell_is_brushed_in_its_turn_only(brushed, counted):
    task = load_task("force_controlled_brushing")
    episode = Episode(task, base="free")
    middle, side_m = episode.sensor("wall_position"), 0.30 / task.cells_a_side
    # the seventh cell, on the second row, which goes back
    across = 1.0 * side_m * episode.sensor("wall_right") + 1.0 * side_m * episode.sensor("wall_up")
    seen = altered(episode.look(), {"brush_contacts": touch(middle + across, 0.6)})
    after = task.update_state(seen, memory(*range(brushed)))
    assert (after["cells_s"][0, 6] > 0.0) == (counted or brushed > 6)
    assert (after["cells_s"][0, 6] == pytest.approx(task.control_dt_s)) == counted


def touch(place_m: np.ndarray, force_n: float) -> np.ndarray:
    """One contact, in the first of four slots."""
    contacts = np.zeros((4, 10))
    contacts[0, :2], contacts[0, 4:7] = (1.0, force_n), place_m
    return contacts.reshape(1, 1, -1)


@pytest.mark.parametrize(("stage", "opening_m"), [(2.0, 0.0), (3.0, 0.08)])
def test_who_lost_the_handle_gains_by_going_back_to_it(stage, opening_m):
    reached = [_drawer_progress(stage, opening_m, away_m) for away_m in (0.02, 0.06, 0.12)]
    assert reached == sorted(reached, reverse=True)
    assert reached[0] > reached[2] + 0.005


def test_a_handle_is_pulled_from_behind_and_pushed_from_before():
    behind, before = -0.015, 0.015
    assert _drawer_progress(2.0, 0.0, behind) > _drawer_progress(2.0, 0.0, before) + 0.005
    assert _drawer_progress(3.0, 0.08, behind) == pytest.approx(_drawer_progress(3.0, 0.08, before), abs=1e-6)


def test_letting_go_of_a_drawer_that_is_moved_far_costs_nothing():
    held, lost = (_drawer_progress(2.0, 0.059, away_m) for away_m in (0.02, 0.12))
    assert held == pytest.approx(lost, abs=1e-4)
    assert held == pytest.approx((2.0 + 0.059 / 0.06) / 12, abs=1e-3)


@pytest.mark.parametrize(("stage", "said"), [(0, 1), (2, 1), (3, -1), (4, 1), (11, -1), (12, -1)])
def test_a_policy_is_told_to_open_or_to_shut_and_to_keep_shut_at_the_end(stage, said):
    task = load_task("drawer_opening")
    features = task.observe(Episode(task, base="free").look(), {"stage": np.array([float(stage)])})
    assert features[0, 5] == said


@pytest.mark.parametrize("left_open", [0, 1, 2])
def test_when_all_stages_are_done_the_drawer_left_open_is_wanted(left_open):
    task = load_task("drawer_opening")
    episode = Episode(task, base="free")
    episode.data.joint(f"drawer_{left_open + 1}").qpos[0] = 0.03
    mujoco.mj_forward(episode.model, episode.data)
    seen = episode.look()
    to_handle, opening_m, _ = wanted(seen, {"stage": np.array([12.0])})
    assert opening_m == pytest.approx([0.03])
    assert seen["tip_position"] + to_handle == pytest.approx(seen[f"drawer_{left_open + 1}_position"])


def _drawer_progress(stage: float, opening_m: float, away_m: float) -> float:
    """Progress with the first drawer this far open and the tip this far before its handle."""
    task = load_task("drawer_opening")
    episode = Episode(task, base="free")
    drawer = f"drawer_{int(episode.variation.parameters['order'][0]) + 1}"
    episode.data.joint(drawer).qpos[0] = opening_m
    mujoco.mj_forward(episode.model, episode.data)
    episode.place(episode.sensor(f"{drawer}_position") - np.array([away_m, 0.0, 0.0]), (1.0, 0.0, 0.0))
    return float(task.progress(episode.look(), {"stage": np.array([stage])})[0])
