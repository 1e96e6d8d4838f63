"""The input of every rule: the compiled robot, its structure, and the recordings of its tests."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.sim.accelerations import turning_accelerations
from aidsr.sim.actuator_force import output_of
from aidsr.sim.divergence import MAX_BODY_SPEED_M_S, DivergenceSign, first_sign, recording_diverged
from aidsr.sim.drive import Drive
from aidsr.sim.moment_arms import MomentArms, read_moment_arms
from aidsr.sim.rollout import Recording
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2, Structure, name_of
from aidsr.validation.points import displacements, last_quarter
from aidsr.validation.protocol import Evidence, Variant, rerun
from aidsr.validation.thresholds import CHATTER_ERROR_G, JOINT_SPEED_RAD_S

_PARTS = 4
_SPEED_LIMITS = {"max_joint_speed_rad_s": JOINT_SPEED_RAD_S, "max_body_speed_m_s": MAX_BODY_SPEED_M_S}


@dataclass(frozen=True)
class RobotUnderTest:
    """A robot or scene that is being validated.

    Attributes:
        model: The model that is simulated.
        structure: The robot's part of the model.
        needs_contact: Whether the task requires contact.
        evidence: Recordings of the tests; None before the tests, when only the model is examined.
        found: Faults that earlier rules found.
        counterfactual_effects: Cache of the counterfactual simulations made so far: their effects by row of the
            battery, for each name of a change with its tests. They are run only for robots with a symptom and are
            shared between rules.
    """

    model: mujoco.MjModel
    structure: Structure
    needs_contact: bool = False
    evidence: Evidence | None = None
    found: list[Fault] = field(default_factory=list)
    counterfactual_effects: dict[tuple[str, tuple[int, ...]], dict[int, float]] = field(default_factory=dict)

    @cached_property
    def drawn(self) -> mujoco.MjData:
        """Data in the reference pose; rules must not change it."""
        data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, data)
        return data

    @cached_property
    def moment_arms(self) -> MomentArms:
        """Moment arms of the driven cables."""
        return read_moment_arms(self.model, self.structure)

    @property
    def length_m(self) -> float:
        """Characteristic length L [m]."""
        return self.structure.characteristic_length_m

    @property
    def driven(self) -> Evidence:
        """The recordings of the tests; only for rules that run after the tests.

        Raises:
            RuntimeError: The robot has not been tested.
        """
        if self.evidence is None:
            raise RuntimeError("this rule needs the evidence of the test battery")
        return self.evidence

    @property
    def settled(self) -> bool:
        """Whether the passive phase can be measured: it did not fail, and no body exceeded `MAX_BODY_SPEED_M_S`."""
        settle = self.driven.settle
        speeds = settle.speed_m_s[0][:, list(self.structure.bodies)]
        return not settle.failed(0) and float(np.max(speeds, initial=0.0)) <= MAX_BODY_SPEED_M_S

    def body(self, index: int) -> str:
        """Return the name of a body."""
        return name_of(self.model, mujoco.mjtObj.mjOBJ_BODY, index)

    def joint(self, index: int) -> str:
        """Return the name of a joint, or "joint of" its body if it has no name."""
        unnamed = not mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_JOINT, index)
        return f"joint of {self.body(int(self.model.jnt_bodyid[index]))}" if unnamed else self._name("JOINT", index)

    def geom(self, index: int) -> str:
        """Return the name of a geom, or "geom of" its body if it has no name."""
        unnamed = not mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_GEOM, index)
        return f"geom of {self.body(int(self.model.geom_bodyid[index]))}" if unnamed else self._name("GEOM", index)

    def site(self, index: int) -> str:
        """Return the name of a site."""
        return self._name("SITE", index)

    def tendon(self, index: int) -> str:
        """Return the name of a tendon."""
        return self._name("TENDON", index)

    def actuator(self, index: int) -> str:
        """Return the name of an actuator."""
        return self._name("ACTUATOR", index)

    def sensor(self, index: int) -> str:
        """Return the name of a sensor."""
        return self._name("SENSOR", index)

    def _name(self, kind: str, index: int) -> str:
        return name_of(self.model, getattr(mujoco.mjtObj, f"mjOBJ_{kind}"), index)

    def effect_of(self, drive: int) -> float:
        """Return the largest effect / L of one actuator alone, with the other tendons slack.

        0 if both ends of its control range are its neutral command, so that it has no test.

        Args:
            drive: Index of the actuator in `Evidence.drives`.
        """
        return max((self.effect_in(test) for test in self.single_tests([drive])), default=0.0)

    def effect_in(self, test: int) -> float:
        """Return the effect / L of a test: its largest displacement, or the mean displacement at its end if it shakes.

        Args:
            test: Row of the battery.
        """
        return float(self._effects[test])

    def diverged(self, recording: Recording) -> NDArray[np.bool_]:
        """Return which simulations of a recording have a sign of divergence, (n_sims,)."""
        return recording_diverged(recording, self.model, self.structure, **_SPEED_LIMITS)

    def first_divergence(self, recording: Recording, row: int) -> DivergenceSign | None:
        """Return the first sign of divergence in one simulation of a recording, or None."""
        return first_sign(recording, row, self.model, self.structure, **_SPEED_LIMITS)

    @cached_property
    def known_tests(self) -> tuple[int, ...]:
        """Rows of the battery without the tests of actuators that have no control range.

        The commands in such tests are guesses, so rules do not use them.
        """
        tests, drives = self.driven.tests, self.driven.drives
        return tuple(row for row, test in enumerate(tests) if test.drive < 0 or drives[test.drive].ranged)

    @cached_property
    def sound_tests(self) -> tuple[int, ...]:
        """Rows of the battery without a sign of divergence. Other rules use only these tests."""
        battery = self.driven.battery
        return () if battery is None else tuple(np.flatnonzero(~self.diverged(battery)).tolist())

    @cached_property
    def diverges(self) -> bool:
        """Whether the passive phase or any test has a sign of divergence."""
        settle, battery = self.driven.settle, self.driven.battery
        return bool(self.diverged(settle)[0] or battery is None or self.diverged(battery).any())

    def shakes(self, test: int) -> bool:
        """Whether the robot shakes at the end of a test by more than the limit of an error (`CHATTER_ERROR_G`)."""
        return bool(self._shaking[test])

    def describe_test(self, row: int) -> str:
        """Return a description of a test of the battery, as a noun phrase."""
        test = self.driven.tests[row]
        if test.drive >= 0:
            actuator = self.actuator(self.driven.drives[test.drive].actuator)
            return f"the test of {actuator} at ctrl {test.command:.4g}"
        return {
            "reference": "the test with slack tendons",
            "rest": "the test at rest with all actuators on",
            "all": "the test of all actuators together",
        }.get(test.kind, "the random sweep of all actuators")

    @cached_property
    def _shaking(self) -> NDArray[np.bool_]:
        battery = self.driven.battery
        return np.zeros(0, dtype=bool) if battery is None else self._shakes(battery)

    def _shakes(self, recording: Recording) -> NDArray[np.bool_]:
        return np.asarray(self.shaking_g(recording).max(axis=1, initial=0.0) > CHATTER_ERROR_G)

    @cached_property
    def _effects(self) -> NDArray[np.float64]:
        battery = self.driven.battery
        return np.zeros(0) if battery is None else self._effects_of(battery)

    def _effects_of(self, recording: Recording) -> NDArray[np.float64]:
        """Return the effect / L of each simulation, with the first simulation as reference, (n_sims,)."""
        displacements_m = displacements(recording, self.structure, self.model, reference=0)
        largest_m = np.linalg.norm(displacements_m, axis=-1).max(axis=(1, 2), initial=0.0)
        held_m = np.linalg.norm(last_quarter(displacements_m, axis=1).mean(axis=1), axis=-1).max(axis=1, initial=0.0)
        return np.asarray(np.where(self._shakes(recording), held_m, largest_m) / self.length_m)

    def shaking_g(self, recording: Recording) -> NDArray[np.float64]:
        """Return the root mean square acceleration of each body's centre of mass in the last quarter of a recording.

        The last quarter is divided into four parts and the calmest counts: a robot that topples late and hits the
        ground once does not shake. The acceleration of turning at a constant speed is subtracted: a spinning wheel does
        not shake.

        Returns:
            (n_sims, n_bodies), in standard gravity.
        """
        bodies = list(self.structure.bodies)
        shaking = last_quarter(recording.acceleration_m_s2[:, :, bodies], axis=1)
        loud = np.flatnonzero((shaking**2).mean(axis=1).max(axis=1, initial=0.0) > STANDARD_GRAVITY_M_S2**2)
        shaking = np.array(shaking)
        for row in loud:
            states = (last_quarter(recording.fields[name][row], axis=0) for name in ("qpos", "qvel"))
            turning = turning_accelerations(self.model, *states)[:, bodies]
            shaking[row] = np.maximum(shaking[row] - turning, 0.0)
        squares = shaking**2
        parts = np.array_split(squares, min(_PARTS, squares.shape[1]), axis=1)
        return np.asarray(np.sqrt(np.min([part.mean(axis=1) for part in parts], axis=0)) / STANDARD_GRAVITY_M_S2)

    def force_n(self, drive: Drive) -> NDArray[np.float64]:
        """Return the force of an actuator on its tendon or joint in every frame of the battery, (n_tests, n_frames).

        In N, or N m on a turning joint. Positive values push; see `Drive.side` for tendons without a path.

        Source: MuJoCo documentation, Computation, "Actuation model": `actuator_force` is before the gear.
        """
        if self.driven.battery is None:
            return np.zeros((0, 0))
        output = output_of(self.model, drive.actuator)
        force = self.driven.battery.fields["actuator_force"][:, :, output]
        return np.asarray(drive.side * force * self.model.actuator_gear[output, 0])

    def largest_effect(self, drives: Iterable[int]) -> float:
        """Return the largest effect / L of some actuators, each driven alone."""
        return max((self.effect_of(drive) for drive in drives), default=0.0)

    def single_tests(self, drives: Iterable[int]) -> list[int]:
        """Return the rows of the battery in which one of some actuators is driven alone."""
        wanted = set(drives)
        return [i for i, test in enumerate(self.driven.tests) if test.kind == "single" and test.drive in wanted]

    def effects_if(self, name: str, variant: Variant, tests: Sequence[int]) -> dict[int, float]:
        """Return the effects / L of some tests in a changed model, by row of the battery.

        The effect is 0 if the changed robot diverges, because its displacement then means nothing. The result is cached
        by `name` and `tests`: a name must always stand for the same variant.
        """
        key = (name, tuple(tests))
        if key not in self.counterfactual_effects:
            recording = rerun(self.model, self.structure, self.driven, variant, tests)
            effects = np.where(self.diverged(recording), 0.0, self._effects_of(recording))[1:]
            self.counterfactual_effects[key] = {
                test: float(effect) for test, effect in zip(tests, effects, strict=True)
            }
        return self.counterfactual_effects[key]
