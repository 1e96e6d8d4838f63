"""Differences between episodes as data, and their application to simulations.

A variation lists new values for fields of MuJoCo's model and state, each with the object that it belongs to. It is
applied to one simulation or, row by row, to a `mujoco.batch.Batch`, without recompiling the model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal
from weakref import WeakKeyDictionary

import mujoco
import numpy as np

if TYPE_CHECKING:
    from mujoco.batch import Batch

Shape = Literal["sphere", "cylinder", "box"]

_STATE = frozenset({"qpos", "qvel"})
_WRITTEN: WeakKeyDictionary[Batch, set[str]] = WeakKeyDictionary()
"""Names of the model fields that variations have written in each batch; an entry is removed with its batch."""


@dataclass(frozen=True)
class Change:
    """A new value for one field of one named object."""

    field: str
    """Field of MjModel ("body_pos", "geom_friction", "dof_frictionloss", ...) or of the state ("qpos", "qvel")."""
    name: str
    """Name of the object: a body, geom, site or actuator; for the fields jnt_*, dof_*, qpos and qvel a joint."""
    value: tuple[float, ...]
    of_body: bool = False
    """Whether `name` is the name of the joint's body: free joints mostly have no name of their own."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", tuple(float(number) for number in self.value))


@dataclass(frozen=True)
class Variation:
    """The differences that define one episode."""

    changes: tuple[Change, ...] = ()
    parameters: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """Values that no sensor of the scene shows, such as the required order of drawers; see `Readings.parameters`."""
    words: str = ""
    """Description of the differences, with units; empty if there are none or the task does not describe them."""


def shift_words(x_m: float, y_m: float) -> str:
    """Return a horizontal shift in words, "+8.0 mm along x, -3.0 mm along y"."""
    return f"{1000 * x_m:+.1f} mm along x, {1000 * y_m:+.1f} mm along y"


def turn_words(turn_deg: float) -> str:
    """Return a turn about the vertical in words, "12.0 deg to the left"; positive angles turn left."""
    return f"{abs(turn_deg):.1f} deg to the {'left' if turn_deg >= 0 else 'right'}"


def solid(name: str, shape: Shape, half_m: float, mass_kg: float) -> tuple[Change, ...]:
    """Return the changes that give a body, and its geom of the same name, another shape, size and mass.

    Args:
        name: Name of the body and of its geom.
        shape: Sphere, cylinder as high as it is wide, or cube.
        half_m: Half size in every direction [m].
        mass_kg: Mass of the homogeneous solid [kg].

    Source: moments of inertia of homogeneous solids, any mechanics textbook.
    """
    across, along = {"sphere": (2 / 5, 2 / 5), "cylinder": (1 / 4 + 1 / 3, 1 / 2), "box": (2 / 3, 2 / 3)}[shape]
    inertia = tuple(mass_kg * half_m**2 * factor for factor in (across, across, along))
    kind = getattr(mujoco.mjtGeom, f"mjGEOM_{shape.upper()}").value
    return (
        Change("geom_type", name, (kind,)),
        Change("geom_size", name, (half_m, half_m, half_m)),
        Change("body_mass", name, (mass_kg,)),
        Change("body_inertia", name, inertia),
    )


def apply_to_simulation(variation: Variation, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Start an episode: write the variation into a model, reset its data and compute the first sensor values.

    The model keeps the written values. If the variations of a task do not all change the same fields, start each
    episode with a copy of the compiled model (`copy.copy`); otherwise values of the previous episode remain.
    """
    for change in variation.changes:
        if change.field not in _STATE:
            getattr(model, change.field)[_rows(model, change)] = _shaped(change)
    mujoco.mj_setConst(model, data)
    mujoco.mj_resetData(model, data)
    for change in variation.changes:
        if change.field in _STATE:
            getattr(data, change.field)[_rows(model, change)] = change.value
    mujoco.mj_forward(model, data)


def apply_to_batch(variations: Sequence[Variation], batch: Batch, ids: Sequence[int]) -> None:
    """Start an episode in some simulations of a batch. Unchanged fields have the values of the batch's model.

    Args:
        variations: One variation for each simulation in `ids`.
        batch: The batch of simulations.
        ids: Indices of the simulations to reset, in ascending order.
    """
    rows = np.asarray(ids, dtype=np.int32)
    batch.reset(rows, stage=mujoco.mjtStage.mjSTAGE_NONE.value)
    written = _WRITTEN.setdefault(batch, set())
    for name in written:
        # a reset covers only the state: model fields would keep the values of the previous episode
        batch.expand(name)[rows] = getattr(batch.model, name)
    written |= {change.field for variation in variations for change in variation.changes} - _STATE
    for row, variation in zip(rows, variations, strict=True):
        for change in variation.changes:
            array = batch.bind(change.field) if change.field in _STATE else batch.expand(change.field)
            array[row][_rows(batch.model, change)] = _shaped(change)
    batch.set_const(rows)
    batch.forward(rows)


def _rows(model: mujoco.MjModel, change: Change) -> int | slice:
    """Return the index or the slice of the field that belongs to the named object."""
    kind = change.field.partition("_")[0]
    if kind not in {"qpos", "qvel", "dof", "jnt"}:
        return int(getattr(model, kind)(change.name).id)
    joint = model.joint(int(model.body(change.name).jntadr[0]) if change.of_body else change.name)
    if kind == "jnt":
        return int(joint.id)
    first = int((joint.qposadr if kind == "qpos" else joint.dofadr)[0])
    return slice(first, first + len(change.value))


def _shaped(change: Change) -> Any:
    """Return the value in the shape of the field: a number if the object has one, an array if it has several."""
    several = change.field in _STATE or change.field.startswith("dof_") or len(change.value) > 1
    return np.asarray(change.value) if several else change.value[0]
