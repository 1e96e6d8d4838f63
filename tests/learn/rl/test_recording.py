"""A held-out episode, recorded with its cables, contacts and progress."""

import io

import mujoco
import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from test_training import trained

from aidsr.core.errors import UserError
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.recording import STATE, Recorder
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.rl.recording import record_episode
from aidsr.sim.contact_forces import ContactForces
from scenes import Always, small_learning


def test_a_recording_has_what_happened_in_each_part_of_a_step() -> None:
    scene = small_learning()
    variation = scene.task.variation("held_out", 0)
    episodes = Episodes(scene.model, scene.task, scene.actions, [variation], threads=1, record=STATE)
    recorder = Recorder(episodes)
    outcomes = rollout(episodes, Always(1.0, -1.0), recorder.update)
    arrays = recorder.arrays()
    rows = len(arrays["qpos"])
    assert (rows - 1) * recorder.frame_s == pytest.approx(outcomes.time_s[0])
    np.testing.assert_allclose(arrays["qpos"][-1], episodes.batch.bind("qpos")[0], rtol=1e-6)
    assert arrays["progress"][-1] == pytest.approx(outcomes.progress[0])
    assert arrays["tension_n"][-1] == pytest.approx([8.0, 0.0], abs=1e-3), "one cable pulls fully, the other not"
    assert arrays["tension_n"].shape == arrays["ctrl"].shape == (rows, 2)


def test_a_contact_carries_the_weight_that_lies_on_it() -> None:
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 .1"/><body pos="0 0 0.0499"><freejoint/>
        <geom name="ball" size="0.05" mass="0.3"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=2000)
    contacts = ContactForces(model, np.array([model.geom("ball").id])).read(data)
    assert contacts[:, 3:].sum(axis=0) == pytest.approx([0.0, 0.0, 0.3 * 9.81], abs=1e-2)
    pushed = ContactForces(model, np.array([model.geom("floor").id])).read(data)
    assert pushed[:, 3:].sum(axis=0) == pytest.approx([0.0, 0.0, -0.3 * 9.81], abs=1e-2)


def test_a_held_out_episode_of_a_policy_is_recorded(tmp_path) -> None:
    trained(tmp_path / "001")
    with np.load(io.BytesIO(record_episode(tmp_path / "001", 3)), allow_pickle=False) as stored:
        assert int(stored["variation"]) == 3
        assert str(stored["ended"]) in ("succeeded", "failed", "out_of_time", "diverged")
        assert len(stored["qpos"]) == len(stored["progress"]) == len(stored["tension_n"]) > 1
        mujoco.MjModel.from_xml_string(str(stored["mjcf"]))
    with pytest.raises(UserError, match="not a finished training"):
        record_episode(tmp_path / "002", 3)
