"""The test protocol: let the robot settle, then run a battery of actuator tests in one batch of simulations.

Source: the order and durations of the tests are our choice, calibrated on robots known to be good or bad. All times are
multiples of the pendulum time sqrt(L / g), so that a robot twice as large is tested in the same way.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.drive import Drive, neutral_ctrl, read_drives, set_act
from aidsr.sim.rollout import Recording, Simulation, integration_state, simulate
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2, Structure
from aidsr.validation.battery import BatteryTest, commands_at_end, list_tests, random_commands, slack_in
from aidsr.validation.points import drawn_seen_from_root, seen_from_root

Array = NDArray[np.float64]
Variant = Callable[[mujoco.MjModel], None]
"""Changes a copy of the model in place for a counterfactual simulation, for example one without gravity."""

_FIELDS = (
    "xipos",
    "site_xpos",
    "xpos",
    "xquat",
    "qpos",
    "qvel",
    "sensordata",
    "energy",
    "ten_length",
    "ten_velocity",
    "actuator_force",
)
_SLACK_GROUP, _DRIVEN_GROUP = 30, 0
"""Actuator groups of disabled and of enabled actuators; 30 is the highest group that can be disabled. Source: MuJoCo
XML reference, option/actuatorgroupdisable."""
_BALL, _HINGE = int(mujoco.mjtJoint.mjJNT_BALL), int(mujoco.mjtJoint.mjJNT_HINGE)


@dataclass(frozen=True)
class Protocol:
    """Durations and amplitudes of the tests. Times are multiples of sqrt(L / g)."""

    kick_rad: float = 0.02
    """Initial deflection of every hinge and ball joint before settling: perfect symmetry hides instability."""
    kick_speed_rad_s: float = 50.0
    """Largest joint speed that this deflection may cause; a stiff robot is deflected less, because its released springs
    would make it diverge."""
    settle: float = 12.0
    settle_bounds_s: tuple[float, float] = (1.0, 4.0)
    test: float = 9.0
    test_bounds_s: tuple[float, float] = (0.8, 3.0)
    ramp_share: float = 0.25
    """Share of a test during which the command is ramped from neutral to its target."""
    hold: float = 0.35
    """Duration for which the random sweep holds each command, as an exploring policy does."""
    frame: float = 0.05
    """Time between two recorded frames of the simulation."""
    seed: int = 0
    """Seed of the random signs of the initial deflection and of the random sweep."""
    most_steps: int = 2_000_000
    """Most time steps of all tests together, about 30 s on two cores for an arm of 12 segments. A robot that needs more
    could not be trained."""

    def frame_steps(self, model: mujoco.MjModel, length_m: float) -> int:
        """Return the time steps in a frame, at least three: an acceleration needs three."""
        return max(3, round(self.frame * pendulum_time_s(length_m) / float(model.opt.timestep)))

    def steps(self, model: mujoco.MjModel, structure: Structure) -> int:
        """Return the approximate number of time steps of all tests together, the cost of the whole protocol."""
        length_m = structure.characteristic_length_m
        frame_steps = self.frame_steps(model, length_m)
        frame_s = frame_steps * float(model.opt.timestep)
        settle, test = (
            self.frames(multiple, bounds_s, length_m, frame_s)
            for multiple, bounds_s in ((self.settle, self.settle_bounds_s), (self.test, self.test_bounds_s))
        )
        return frame_steps * (2 * settle + (4 + 2 * len(structure.actuators)) * test)

    def frames(self, multiple: float, bounds_s: tuple[float, float], length_m: float, frame_s: float) -> int:
        """Return the number of frames, at least 8, of a phase of a duration.

        Args:
            multiple: Duration as a multiple of sqrt(L / g).
            bounds_s: Shortest and longest duration [s].
            length_m: L [m].
            frame_s: Duration of a frame [s].
        """
        duration_s = min(max(multiple * pendulum_time_s(length_m), bounds_s[0]), bounds_s[1])
        return max(8, math.ceil(duration_s / frame_s))


def pendulum_time_s(length_m: float) -> float:
    """Return sqrt(L / g) [s]."""
    return math.sqrt(length_m / STANDARD_GRAVITY_M_S2)


@dataclass(frozen=True)
class Evidence:
    """Recordings of the test protocol on one robot.

    Attributes:
        protocol: Durations and amplitudes of the tests.
        frame_steps: Time steps in a frame.
        start: Data in the reference pose.
        settle: Recording of the passive phase: simulation 0 with the model's gravity, simulation 1 without gravity.
        drawn_m: Every point of the robot in the reference pose, in the frame of its root, (n_points, 3) [m]; see
            `displacements` for the points.
        settling_m: The same points during the passive phase, (2, n_frames, n_points, 3) [m].
        settled: Data at the end of simulation 0.
        drives: Commands of the robot's actuators in the settled state; empty if simulation 0 failed.
        tests: The tests of the driven phase, one for each row of `battery`; empty if simulation 0 failed.
        battery: Recording of the driven phase; None if simulation 0 failed.
    """

    protocol: Protocol
    frame_steps: int
    start: mujoco.MjData
    settle: Recording
    drawn_m: Array
    settling_m: Array
    settled: mujoco.MjData
    drives: tuple[Drive, ...]
    tests: tuple[BatteryTest, ...]
    battery: Recording | None


@dataclass(frozen=True)
class PlannedTests:
    """The battery before it is run, for callers that show a single test.

    Attributes:
        frame_steps: Time steps in a frame.
        drives: Commands of the robot's actuators in the settled state.
        tests: The tests.
        simulations: The simulation of each test, in the same order.
    """

    frame_steps: int
    drives: tuple[Drive, ...]
    tests: tuple[BatteryTest, ...]
    simulations: tuple[Simulation, ...]


def plan_tests(
    model: mujoco.MjModel, structure: Structure, protocol: Protocol = Protocol(), threads: int = 2
) -> PlannedTests | None:
    """Return the battery that `gather_evidence` would run, or None if the simulation of settling fails."""
    frame_steps = protocol.frame_steps(model, structure.characteristic_length_m)
    start = mujoco.MjData(model)
    mujoco.mj_forward(model, start)
    settle = _settle(model, structure, start, protocol, frame_steps, threads)
    if settle.failed(0):
        return None
    settled = _settled(model, settle)
    drives = read_drives(model, settled, structure)
    tests = list_tests(drives)
    simulations = _simulations(model, structure, settled, drives, tests, protocol, frame_steps)
    return PlannedTests(frame_steps, drives, tests, tuple(simulations))


def gather_evidence(
    model: mujoco.MjModel, structure: Structure, protocol: Protocol = Protocol(), threads: int = 2
) -> Evidence:
    """Run the whole protocol on a robot or a scene and return the recordings; `model` must have automatic reset off."""
    length_m = structure.characteristic_length_m
    frame_steps = protocol.frame_steps(model, length_m)
    start = mujoco.MjData(model)
    mujoco.mj_forward(model, start)
    settle = _settle(model, structure, start, protocol, frame_steps, threads)
    drawn_m, settling_m = drawn_seen_from_root(start, structure, model), seen_from_root(settle, structure, model)
    settled = _settled(model, settle)
    if settle.failed(0):
        return Evidence(protocol, frame_steps, start, settle, drawn_m, settling_m, settled, (), (), None)
    drives = read_drives(model, settled, structure)
    tests = list_tests(drives)
    battery = _run_tests(model, structure, settled, drives, tests, protocol, frame_steps, threads)
    return Evidence(protocol, frame_steps, start, settle, drawn_m, settling_m, settled, drives, tests, battery)


def rerun(
    model: mujoco.MjModel,
    structure: Structure,
    evidence: Evidence,
    variant: Variant,
    tests: Sequence[int],
    threads: int = 2,
) -> Recording:
    """Run some tests again in a changed copy of the model.

    Args:
        model: The original model.
        structure: The robot's part of the model.
        evidence: Result of the original tests; its settled state is the start.
        variant: The change.
        tests: Rows of the original battery, n of them.
        threads: Native threads of the simulation.

    Returns:
        A recording of 1 + n simulations: the reference first, then the tests in the order given.
    """
    changed = copy.copy(model)
    variant(changed)
    chosen = (BatteryTest("reference"), *(evidence.tests[index] for index in tests))
    settled, drives = evidence.settled, evidence.drives
    return _run_tests(changed, structure, settled, drives, chosen, evidence.protocol, evidence.frame_steps, threads)


def _settle(
    model: mujoco.MjModel,
    structure: Structure,
    start: mujoco.MjData,
    protocol: Protocol,
    frame_steps: int,
    threads: int,
) -> Recording:
    passive = _with_slack(model, structure.tendon_actuators)
    weightless = copy.copy(passive)
    weightless.opt.gravity[:] = 0
    kicked = _kick(model, structure, start, protocol)
    ctrl = neutral_ctrl(model, start)
    set_act(model, kicked, ctrl)
    frame_s = frame_steps * float(model.opt.timestep)
    frames = protocol.frames(protocol.settle, protocol.settle_bounds_s, structure.characteristic_length_m, frame_s)
    state, held = integration_state(model, kicked), np.tile(ctrl, (frames, 1))
    simulations = [Simulation(variant, state, held) for variant in (passive, weightless)]
    return simulate(simulations, frame_steps=frame_steps, fields=_FIELDS, threads=threads)


def _settled(model: mujoco.MjModel, settle: Recording) -> mujoco.MjData:
    """Return the data at the end of the passive phase with gravity."""
    settled = mujoco.MjData(model)
    mujoco.mj_setState(model, settled, settle.states[0], mujoco.mjtState.mjSTATE_INTEGRATION)
    if not settle.failed(0):
        mujoco.mj_forward(model, settled)
    return settled


def _kick(model: mujoco.MjModel, structure: Structure, start: mujoco.MjData, protocol: Protocol) -> mujoco.MjData:
    """Return data in the reference pose with every hinge and ball joint of the robot deflected a little.

    Source: a spring released at angle q with acceleration a reaches the speed q omega = sqrt(q a).
    """
    rng = np.random.default_rng(protocol.seed)
    turn = np.zeros(model.nv)
    for joint in structure.joints:
        kind, dof = int(model.jnt_type[joint]), int(model.jnt_dofadr[joint])
        if kind == _HINGE:
            turn[dof] = protocol.kick_rad * rng.choice((-1, 1))
        elif kind == _BALL:
            turn[dof : dof + 3] = protocol.kick_rad * rng.choice((-1, 1), size=3) / math.sqrt(3)
    kicked = mujoco.MjData(model)
    kicked.qpos[:] = start.qpos
    mujoco.mj_integratePos(model, kicked.qpos, turn, 1.0)
    mujoco.mj_forward(model, kicked)
    speed_rad_s = float(np.sqrt(np.abs(turn * (kicked.qacc - start.qacc)).max(initial=1e-9)))
    mujoco.mj_resetData(model, kicked)
    kicked.qpos[:] = start.qpos
    mujoco.mj_integratePos(model, kicked.qpos, turn * min(1.0, protocol.kick_speed_rad_s / speed_rad_s), 1.0)
    return kicked


def _with_slack(model: mujoco.MjModel, slack: Sequence[int]) -> mujoco.MjModel:
    """Return a copy of the model in which the actuators `slack` are disabled.

    A disabled actuator has no force at all; no constant command of a servo achieves that.
    """
    changed = copy.copy(model)
    disabled = int(model.opt.disableactuator)
    off = [0 <= group <= _SLACK_GROUP and bool(disabled >> group & 1) for group in map(int, model.actuator_group)]
    changed.actuator_group[:] = [_SLACK_GROUP if is_off else _DRIVEN_GROUP for is_off in off]
    changed.actuator_group[list(slack)] = _SLACK_GROUP
    changed.opt.disableactuator = 1 << _SLACK_GROUP
    return changed


def _run_tests(
    model: mujoco.MjModel,
    structure: Structure,
    settled: mujoco.MjData,
    drives: Sequence[Drive],
    tests: Sequence[BatteryTest],
    protocol: Protocol,
    frame_steps: int,
    threads: int,
) -> Recording:
    simulations = _simulations(model, structure, settled, drives, tests, protocol, frame_steps)
    return simulate(simulations, frame_steps=frame_steps, fields=_FIELDS, threads=threads)


def _simulations(
    model: mujoco.MjModel,
    structure: Structure,
    settled: mujoco.MjData,
    drives: Sequence[Drive],
    tests: Sequence[BatteryTest],
    protocol: Protocol,
    frame_steps: int,
) -> list[Simulation]:
    frame_s = frame_steps * float(model.opt.timestep)
    frames = protocol.frames(protocol.test, protocol.test_bounds_s, structure.characteristic_length_m, frame_s)
    hold = max(1, round(protocol.hold * pendulum_time_s(structure.characteristic_length_m) / frame_s))
    ramp = np.minimum(1.0, np.arange(1, frames + 1) / max(1.0, protocol.ramp_share * frames))[:, None]
    neutral = neutral_ctrl(model, settled)
    begin = mujoco.MjData(model)
    mujoco.mj_setState(model, begin, integration_state(model, settled), mujoco.mjtState.mjSTATE_INTEGRATION)
    set_act(model, begin, neutral)
    state = integration_state(model, begin)
    models = {slack: _with_slack(model, slack) for slack in {slack_in(test, drives) for test in tests}}
    simulations = []
    for test in tests:
        if test.kind == "sweep":
            ctrl = random_commands(neutral, drives, frames, hold, protocol.seed)
        else:
            ctrl = neutral + ramp * (commands_at_end(test, neutral, drives) - neutral)
        simulations.append(Simulation(models[slack_in(test, drives)], state, ctrl))
    return simulations
