"""What a rule looks at: the compiled robot, how it stands, and what it did."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.sim.accelerations import turning_accelerations
from aidsr.sim.divergence import DivergenceSign, first_sign, recording_diverged
from aidsr.sim.drive import Drive
from aidsr.sim.moment_arms import MomentArms, read_moment_arms
from aidsr.sim.rollout import Recording
from aidsr.sim.structure import Structure, name_of
from aidsr.validation.points import displacements, last_quarter
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2, Evidence, Variant, rerun
from aidsr.validation.thresholds import BODY_SPEED_M_S, CHATTER_ERROR_G, JOINT_SPEED_RAD_S

_PARTS = 4
_SPEED_LIMITS = {"max_joint_speed_rad_s": JOINT_SPEED_RAD_S, "max_body_speed_m_s": BODY_SPEED_M_S}


@dataclass(frozen=True)
class RobotUnderTest:
    """One robot or scene under examination.

    Attributes:
        model: The model that was driven.
        structure: What of it is the robot.
        needs_contact: Whether the task needs touch.
        evidence: What it did; None while only the structure is being looked at.
        found: What earlier rules found.
        causes: Counterfactual reruns made so far, by name: they are made for symptoms only and shared between rules.
    """

    model: mujoco.MjModel
    structure: Structure
    needs_contact: bool = False
    evidence: Evidence | None = None
    found: list[Fault] = field(default_factory=list)
    causes: dict[str, dict[int, float]] = field(default_factory=dict)

    @cached_property
    def drawn(self) -> mujoco.MjData:
        """Data in the reference pose; rules only read it."""
        data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, data)
        return data

    @cached_property
    def moment_arms(self) -> MomentArms:
        """Moment arms of the driven cables."""
        return read_moment_arms(self.model, self.structure)

    @property
    def length_m(self) -> float:
        """L [m]."""
        return self.structure.characteristic_length_m

    @property
    def driven(self) -> Evidence:
        """The evidence; rules that ask for it run only when there is some."""
        if self.evidence is None:
            raise RuntimeError("this rule needs the evidence of the test battery")
        return self.evidence

    @property
    def settled(self) -> bool:
        """Whether the passive phase can be measured: it neither failed nor became faster than anything real."""
        settle = self.driven.settle
        speeds = settle.speed_m_s[0][:, list(self.structure.bodies)]
        return not settle.failed(0) and float(np.max(speeds, initial=0.0)) <= BODY_SPEED_M_S

    def body(self, index: int) -> str:
        """Name of a body."""
        return name_of(self.model, mujoco.mjtObj.mjOBJ_BODY, index)

    def joint(self, index: int) -> str:
        """Name of a joint; one without a name is called after its body."""
        unnamed = not mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_JOINT, index)
        return f"joint of {self.body(int(self.model.jnt_bodyid[index]))}" if unnamed else self._name("JOINT", index)

    def geom(self, index: int) -> str:
        """Name of a geom; one without a name is called after its body."""
        unnamed = not mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_GEOM, index)
        return f"geom of {self.body(int(self.model.geom_bodyid[index]))}" if unnamed else self._name("GEOM", index)

    def site(self, index: int) -> str:
        """Name of a site."""
        return self._name("SITE", index)

    def tendon(self, index: int) -> str:
        """Name of a tendon."""
        return self._name("TENDON", index)

    def actuator(self, index: int) -> str:
        """Name of an actuator."""
        return self._name("ACTUATOR", index)

    def sensor(self, index: int) -> str:
        """Name of a sensor."""
        return self._name("SENSOR", index)

    def _name(self, kind: str, index: int) -> str:
        return name_of(self.model, getattr(mujoco.mjtObj, f"mjOBJ_{kind}"), index)

    def effect_of(self, drive: int) -> float:
        """Largest effect / L of one actuator alone, the other tendons slack; 0 if it has no end but neutral."""
        return max((self.effect_in(test) for test in self.single_tests([drive])), default=0.0)

    def effect_in(self, test: int) -> float:
        """Effect / L of a test: its largest displacement, or where the robot shakes the one it shakes about."""
        return float(self._effects[test])

    def diverged(self, recording: Recording) -> NDArray[np.bool_]:
        """Which simulations have a sign of divergence, (n_sims,)."""
        return recording_diverged(recording, self.model, self.structure, **_SPEED_LIMITS)

    def first_divergence(self, recording: Recording, row: int) -> DivergenceSign | None:
        """The first sign of divergence in a simulation, None without one."""
        return first_sign(recording, row, self.model, self.structure, **_SPEED_LIMITS)

    @cached_property
    def sound_tests(self) -> tuple[int, ...]:
        """Rows of the battery without a sign of divergence: what a diverging test shows is its divergence."""
        battery = self.driven.battery
        return () if battery is None else tuple(np.flatnonzero(~self.diverged(battery)).tolist())

    @cached_property
    def diverges(self) -> bool:
        """Whether the passive phase or any test has a sign of divergence."""
        settle, battery = self.driven.settle, self.driven.battery
        return bool(self.diverged(settle)[0] or battery is None or self.diverged(battery).any())

    def shakes(self, test: int) -> bool:
        """Whether the robot shakes at the end of a test more than an error allows."""
        return bool(self._shaking[test])

    def describe_test(self, row: int) -> str:
        """Return a test of the battery in words."""
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
        """Effect / L of each simulation against the first, (n_sims,)."""
        ways_m = displacements(recording, self.structure, self.model, reference=0)
        largest_m = np.linalg.norm(ways_m, axis=-1).max(axis=(1, 2), initial=0.0)
        held_m = np.linalg.norm(last_quarter(ways_m, axis=1).mean(axis=1), axis=-1).max(axis=1, initial=0.0)
        return np.asarray(np.where(self._shakes(recording), held_m, largest_m) / self.length_m)

    def shaking_g(self, recording: Recording) -> NDArray[np.float64]:
        """Root mean square acceleration of each body's centre of mass in the last quarter, (n_sims, n_bodies), in g.

        Of the calmest of four parts: a robot that topples late and hits the ground once does not shake. Less what
        turning at a constant speed takes: a wheel that spins does not shake.
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
        """Force of an actuator on its tendon or joint in every frame of the battery, (n_tests, n_frames).

        Positive pushes; see `Drive.side` for tendons without a path.

        Source: MuJoCo documentation, Computation, "Actuation model": `actuator_force` is before the gear.
        """
        if self.driven.battery is None:
            return np.zeros((0, 0))
        output = int(self.model.actuator_outadr[drive.actuator])
        force = self.driven.battery.fields["actuator_force"][:, :, output]
        return np.asarray(drive.side * force * self.model.actuator_gear[drive.actuator, 0])

    def largest_effect(self, drives: Iterable[int]) -> float:
        """Largest effect / L of some actuators, each alone."""
        return max((self.effect_of(drive) for drive in drives), default=0.0)

    def single_tests(self, drives: Iterable[int]) -> list[int]:
        """Rows of the battery in which one of some actuators is driven alone."""
        wanted = set(drives)
        return [i for i, test in enumerate(self.driven.tests) if test.kind == "single" and test.drive in wanted]

    def effects_if(self, name: str, variant: Variant, tests: Sequence[int]) -> dict[int, float]:
        """Effects of some tests in a changed model, by row of the battery; made once under a name.

        0 where the changed robot diverges: what is thrown about shows nothing.
        """
        if name not in self.causes:
            recording = rerun(self.model, self.structure, self.driven, variant, tests)
            effects = np.where(self.diverged(recording), 0.0, self._effects_of(recording))[1:]
            self.causes[name] = {test: float(effect) for test, effect in zip(tests, effects, strict=True)}
        return self.causes[name]
