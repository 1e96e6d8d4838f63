"""Batched simulation: equal to stepping one by one, whatever the threads, and honest about failures."""

from __future__ import annotations

import copy
from pathlib import Path

import mujoco
import numpy as np
import pytest

from aidsr.sim.rollout import Recording, Simulation, integration_state, simulate

PENDULUM = """
<mujoco><option timestep="0.002"/><worldbody>
<body><joint name="a" axis="0 1 0" damping="0.01"/><geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.01"/>
<body pos="0 0 -0.3"><joint name="b" axis="0 1 0" damping="0.01"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.01"/></body></body></worldbody>
<actuator><motor joint="a" ctrlrange="-1 1"/></actuator></mujoco>
"""
FRAMES, STEPS = 30, 5


def pendulum() -> mujoco.MjModel:
    model = mujoco.MjModel.from_xml_string(PENDULUM)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return model


def commands(amplitude: float) -> np.ndarray:
    return amplitude * np.sin(np.arange(FRAMES) / 3)[:, None]


def run(model: mujoco.MjModel, count: int = 3, threads: int = 2) -> Recording:
    state = integration_state(model, mujoco.MjData(model))
    simulations = [Simulation(model, state, commands(0.2 * index)) for index in range(count)]
    return simulate(simulations, frame_steps=STEPS, fields=("qpos", "xipos"), threads=threads)


def test_it_is_what_stepping_one_by_one_gives() -> None:
    model = pendulum()
    recording = run(model)
    data = mujoco.MjData(model)
    for frame, command in enumerate(commands(0.4)):
        before = data.xipos.copy()
        for _ in range(STEPS):
            data.ctrl[:] = command
            before, previous = data.xipos.copy(), before
            mujoco.mj_step(model, data)
        np.testing.assert_array_equal(recording.fields["qpos"][2, frame], data.qpos)
        change = (data.xipos - 2 * before + previous) / model.opt.timestep**2
        np.testing.assert_allclose(recording.acceleration_m_s2[2, frame], np.linalg.norm(change, axis=-1), atol=1e-6)


def test_threads_change_nothing() -> None:
    one, two = run(pendulum(), threads=1), run(pendulum(), threads=2)
    np.testing.assert_array_equal(one.states, two.states)
    np.testing.assert_array_equal(one.acceleration_m_s2, two.acceleration_m_s2)


def test_variants_of_a_model_run_side_by_side() -> None:
    model = pendulum()
    weightless = copy.copy(model)
    weightless.opt.gravity[:] = 0
    data = mujoco.MjData(model)
    data.qpos[0] = 1
    state = integration_state(model, data)
    recording = simulate(
        [Simulation(variant, state, commands(0)) for variant in (model, weightless)],
        frame_steps=STEPS,
        fields=("qpos",),
    )
    assert np.ptp(recording.fields["qpos"][0, :, 0]) > 0.1
    assert np.ptp(recording.fields["qpos"][1, :, 0]) == 0


def test_a_simulation_that_diverges_stops_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is cut before the frame that failed, and the others are what they are without it."""
    monkeypatch.chdir(tmp_path)  # MuJoCo logs its warnings where it stands
    model = pendulum()
    state = integration_state(model, mujoco.MjData(model))
    wild = commands(0.0)
    wild[7:] = np.nan
    simulations = [Simulation(model, state, commands(0.2)), Simulation(model, state, wild)]
    recording = simulate(simulations, frame_steps=STEPS, fields=("qpos",))
    assert recording.failures[0] == ""
    assert recording.failed(1)
    assert recording.good_frames.tolist() == [FRAMES, 7]
    assert np.isfinite(recording.fields["qpos"]).all()
    np.testing.assert_array_equal(recording.fields["qpos"][0], run(model).fields["qpos"][1])


def test_a_frame_must_be_long_enough_for_an_acceleration() -> None:
    model = pendulum()
    state = integration_state(model, mujoco.MjData(model))
    with pytest.raises(ValueError, match="at least 3"):
        simulate([Simulation(model, state, commands(0))], frame_steps=2, fields=("qpos",))
