"""Boxes that lie flush on each other are not apart."""

import mujoco
import numpy as np
import pytest

from aidsr.sim.geom_distance import geom_distance_m

HALF_M = (0.003, 0.0035, 0.005, 0.01)


def placed(first: np.ndarray, second: np.ndarray, place: np.ndarray) -> tuple[mujoco.MjModel, mujoco.MjData]:
    def words(values: np.ndarray) -> str:
        return " ".join(map(str, values))

    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><geom type="box" size="{words(first)}"/>'
        f'<geom type="box" size="{words(second)}" pos="{words(place)}"/></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def test_boxes_of_all_shapes_that_lie_flush_on_each_other_touch() -> None:
    rng, wrong = np.random.default_rng(0), 0
    for _ in range(1000):
        first, second = rng.choice(HALF_M, 3), rng.choice(HALF_M, 3)
        axis = rng.integers(3)
        place = rng.choice([0, 1e-8], 3)
        place[axis] -= first[axis] + second[axis]
        model, data = placed(first, second, place)
        assert geom_distance_m(model, data, 0, 1, 1.0) == pytest.approx(0.0, abs=5e-6)
        wrong += mujoco.mj_geomDistance(model, data, 0, 1, 1.0, None) > 1e-3
    assert wrong, "MuJoCo is right by itself now: the module can go"


@pytest.mark.parametrize("gap_m", [-0.001, 0.0005, 0.02])
def test_other_distances_are_as_they_are(gap_m: float) -> None:
    size = np.full(3, 0.0035)
    model, data = placed(size, size, np.array([0.0, 0.0, 0.007 + gap_m]))
    before = data.geom_xpos.copy()
    assert geom_distance_m(model, data, 0, 1, 1.0) == pytest.approx(gap_m, abs=3e-6)
    assert np.array_equal(data.geom_xpos, before)


def test_what_is_farther_than_asked_for_is_so_far() -> None:
    size = np.full(3, 0.0035)
    model, data = placed(size, size, np.array([0.0, 0.0, 0.5]))
    assert geom_distance_m(model, data, 0, 1, 0.1) == 0.1
