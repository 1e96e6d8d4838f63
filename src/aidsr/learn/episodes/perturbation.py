"""Differences between a real robot and its simulation: wrong parameters, delay, and friction of cables at their guides.

A perturbation belongs to one episode. It is drawn from the split and the index of the episode's variation, so the same
episode always has the same perturbation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Self, get_args

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from aidsr.core.artifacts import PerturbationKind
from aidsr.sim.divergence import warnings_ignored
from aidsr.sim.structure import Structure
from aidsr.tasks import Split, Task, Variation
from aidsr.tasks.readings import FloatArray

TOLERANCE = 0.2
"""Largest error of a parameter, as a share of it. Source: our choice; stiffness and friction of printed parts are
rarely known more precisely."""

DELAY_S = 0.04
"""Delay of actions [s]. Source: our choice: camera, bus and motor driver together, and one control step of all tasks
but one. A delay of observations would add to it; it is not simulated separately, because it acts in the same control
loop."""

CABLE_FRICTIONS = (0.1, 0.3)
"""Coefficients of friction between a cable and its guides. Source: 0.1 is UHMWPE or steel in a PTFE tube
(aidsr.fabrication.winches.SHEATH_FRICTION); 0.3 is our choice for a cable on printed plastic."""

KINDS: tuple[PerturbationKind, ...] = get_args(PerturbationKind)

_PARAMETERS = ("stiffness", "damping", "friction", "mass", "cable_forces")
_TAG = 0x0FF
"""Part of the seed that separates these draws from those of variations, which have the same split and index."""

Ids = NDArray[np.intp]


@dataclass(frozen=True)
class Perturbation:
    """Difference of one episode from the model. Factors multiply the model's values."""

    stiffness: float = 1.0
    """Factor on the stiffness of the robot's joints and tendons."""
    damping: float = 1.0
    """Factor on the damping of the robot's joints and tendons."""
    friction: float = 1.0
    """Factor on the friction of all contacts."""
    mass: float = 1.0
    """Factor on mass and inertia of the robot's bodies."""
    cable_forces: tuple[float, ...] = ()
    """Factors on the force of each actuator of `Structure.tendon_actuators`; an empty tuple leaves the forces
    unchanged."""
    delay_s: float = 0.0
    """Delay between an action and its effect on the actuators [s]; a whole number of control steps."""
    cable_friction: float = 0.0
    """Coefficient of friction between cables and guides."""

    def only(self, *names: str) -> Perturbation:
        """Return a perturbation with only the named fields; the others are as in the model."""
        return Perturbation(**{name: getattr(self, name) for name in names})

    @property
    def changes_model(self) -> bool:
        """Whether a parameter of the model is changed."""
        return any(getattr(self, name) not in (1.0, ()) for name in _PARAMETERS)


@dataclass(frozen=True)
class PerturbedVariation(Variation):
    """A variation with a perturbation."""

    perturbation: Perturbation = Perturbation()

    @classmethod
    def of(cls, variation: Variation, perturbation: Perturbation) -> Self:
        """Return a variation with a perturbation."""
        return cls(**{one.name: getattr(variation, one.name) for one in fields(Variation)}, perturbation=perturbation)


def perturbation_of(variation: Variation) -> Perturbation:
    """Return the perturbation of an episode's variation."""
    return variation.perturbation if isinstance(variation, PerturbedVariation) else Perturbation()


def perturbed(task: Task, structure: Structure, kind: PerturbationKind, split: Split, index: int) -> PerturbedVariation:
    """Return a variation of a task with one kind of perturbation; equal arguments give an equal perturbation.

    The kind "combined" has all factors, the delay and the lower cable friction together. Its factors are those that the
    same episode has in the single kinds, such as "stiffness".
    """
    rng = _rng(split, index)
    parameters = _parameters(rng, structure)
    low, high = CABLE_FRICTIONS
    drawn: Mapping[PerturbationKind, Perturbation] = {
        "stiffness": parameters.only("stiffness"),
        "damping": parameters.only("damping"),
        "friction": parameters.only("friction"),
        "mass": parameters.only("mass"),
        "cable_force": parameters.only("cable_forces"),
        "delay": Perturbation(delay_s=DELAY_S),
        "low_cable_friction": Perturbation(cable_friction=low),
        "high_cable_friction": Perturbation(cable_friction=high),
        "combined": Perturbation(
            **{name: getattr(parameters, name) for name in _PARAMETERS}, delay_s=DELAY_S, cable_friction=low
        ),
    }
    return PerturbedVariation.of(task.variation(split, index), drawn[kind])


def randomized(task: Task, structure: Structure, index: int) -> PerturbedVariation:
    """Return a development variation with a perturbation of every kind, for training.

    Factors are drawn as for an evaluation. Half of the episodes have the delay, and cable friction is uniform between 0
    and the higher coefficient.
    """
    rng = _rng("development", index)
    parameters = _parameters(rng, structure)
    delay_s, friction = float(rng.choice([0.0, DELAY_S])), float(rng.uniform(0.0, max(CABLE_FRICTIONS)))
    drawn = Perturbation(
        **{name: getattr(parameters, name) for name in _PARAMETERS}, delay_s=delay_s, cable_friction=friction
    )
    return PerturbedVariation.of(task.variation("development", index), drawn)


def _rng(split: Split, index: int) -> np.random.Generator:
    return np.random.default_rng([("development", "held_out").index(split), index, _TAG])


def _parameters(rng: np.random.Generator, structure: Structure) -> Perturbation:
    """Draw an error of each parameter, uniformly within `TOLERANCE`."""
    stiffness, damping, friction, mass, *cables = rng.uniform(
        1.0 - TOLERANCE, 1.0 + TOLERANCE, 4 + len(structure.tendon_actuators)
    ).tolist()
    return Perturbation(stiffness, damping, friction, mass, tuple(cables))


# --- parameters of the model -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Scaled:
    """Part of a field of MjModel that is multiplied by a factor."""

    field: str
    ids: tuple[int, ...]
    factor: str
    """Name of the field of `Perturbation` that is the factor."""
    columns: tuple[int, ...] = ()
    """Columns of a field with several numbers for each object; an empty tuple means all of them."""


def _scaled_fields(model: mujoco.MjModel, structure: Structure) -> tuple[_Scaled, ...]:
    """Return the parts of MjModel that the parameters of a perturbation multiply.

    A cable's force is gain x activation + bias, limited to its range, so all three are scaled. For a muscle, these are
    the parameters of its peak force; for actuators of other kinds, only the range is scaled.
    """
    joints, tendons = structure.joints, tuple(tendon.id for tendon in structure.tendons)
    dofs = tuple(int(i) for i in np.flatnonzero(np.isin(model.dof_jntid, joints)))
    cables = structure.tendon_actuators
    linear, muscles = (
        tuple(i for i in cables if int(model.actuator_gaintype[i]) in kinds)
        for kinds in (
            (int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE)),
            (int(mujoco.mjtGain.mjGAIN_MUSCLE),),
        )
    )
    found = [
        _Scaled(f"{kind}_{which}", ids, which)
        for kind, ids, which in (
            ("jnt", joints, "stiffness"),
            ("tendon", tendons, "stiffness"),
            ("dof", dofs, "damping"),
            ("tendon", tendons, "damping"),
        )
    ]
    found += [_Scaled(f"{one.field}poly", one.ids, one.factor) for one in found]
    found += [
        _Scaled("geom_friction", tuple(range(model.ngeom)), "friction"),
        _Scaled("pair_friction", tuple(range(model.npair)), "friction"),
        _Scaled("body_mass", structure.bodies, "mass"),
        _Scaled("body_inertia", structure.bodies, "mass"),
        _Scaled("actuator_forcerange", cables, "cable_forces"),
    ]
    for prm in ("actuator_gainprm", "actuator_biasprm"):
        found += [
            _Scaled(prm, linear, "cable_forces", (0, 1, 2)),
            _Scaled(prm, muscles, "cable_forces", (2, 3)),
        ]
    return tuple(one for one in found if one.ids)


class PerturbedModels:
    """Writes the parameters of perturbations into the models of a batch.

    Args:
        batch: The simulations.
        structure: Structure of the robot in their model.
    """

    def __init__(self, batch: Batch, structure: Structure) -> None:
        self._batch = batch
        self._scaled = _scaled_fields(batch.model, structure)
        self._cables = structure.tendon_actuators
        self._written = False

    def restore(self, rows: Ids) -> None:
        """Reset the scaled fields to the model's own values, before variations write theirs."""
        if self._written:
            for name in {one.field for one in self._scaled}:
                self._batch.expand(name)[rows] = getattr(self._batch.model, name)

    def write(self, rows: Ids, perturbations: Sequence[Perturbation]) -> None:
        """Multiply the values of the model and its variations.

        Args:
            rows: Indices of simulations that have just been reset, (n,).
            perturbations: One perturbation for each of them.
        """
        if not any(one.changes_model for one in perturbations):
            return
        self._written = True
        for scaled in self._scaled:
            values, at = self._batch.expand(scaled.field), np.ix_(rows, np.array(scaled.ids))
            present = values[at]
            factors = np.array([self._factors(scaled, one) for one in perturbations])
            factors = factors.reshape(factors.shape + (1,) * (present.ndim - 2))
            if scaled.columns:
                factors = np.where(np.isin(np.arange(present.shape[-1]), scaled.columns), factors, 1.0)
            values[at] = present * factors
        ids = rows.astype(np.int32)
        with warnings_ignored():
            self._batch.set_const(ids)
            self._batch.forward(ids)

    def _factors(self, scaled: _Scaled, perturbation: Perturbation) -> list[float]:
        if scaled.factor != "cable_forces":
            return [getattr(perturbation, scaled.factor)] * len(scaled.ids)
        by_id = dict(zip(self._cables, perturbation.cable_forces or (1.0,) * len(self._cables), strict=True))
        return [by_id[i] for i in scaled.ids]


# --- delay -----------------------------------------------------------------------------------------------------------


class DelayLine:
    """Delay between the policy's actions and the actuators.

    Args:
        rest: Action before the first one, (k,).
        n: Number of episodes.
        control_dt_s: Time between two actions [s].
    """

    def __init__(self, rest: FloatArray, n: int, control_dt_s: float) -> None:
        self._rest, self._control_dt_s = rest, control_dt_s
        self._sent = [np.tile(rest, (n, 1))]
        """Past actions, the latest first, (n, k) each."""
        self._steps = np.zeros(n, dtype=np.intp)

    def reset(self, rows: Ids, perturbations: Sequence[Perturbation]) -> None:
        """Restart some episodes, with actions at rest.

        Raises:
            ValueError: A delay is not a whole number of control steps.
        """
        for row, one in zip(rows.tolist(), perturbations, strict=True):
            steps = one.delay_s / self._control_dt_s
            if not np.isclose(steps, round(steps)):
                raise ValueError(
                    f"delay between control steps: {one.delay_s:g} s; use a multiple of {self._control_dt_s:g} s"
                )
            self._steps[row] = round(steps)
        while len(self._sent) <= self._steps.max():
            self._sent.append(np.tile(self._rest, (len(self._steps), 1)))
        for sent in self._sent:
            sent[rows] = self._rest

    def send(self, action: FloatArray) -> FloatArray:
        """Add an action and return the delayed one that drives the actuators now, (n, k) both."""
        self._sent = [action.copy(), *self._sent[:-1]]
        return np.array(self._sent)[self._steps, np.arange(len(self._steps))]
