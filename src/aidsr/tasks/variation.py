"""What differs between episodes, as data, and how a simulation takes it on.

A variation names fields of MuJoCo's model and state and the objects they belong to. It is applied to one simulation or,
row by row, to a `mujoco.batch.Batch`, without compiling anything again.
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
"""Fields of the model that variations have written in a batch, for as long as there is the batch."""


@dataclass(frozen=True)
class Change:
    """One field of one named object gets another value."""

    field: str
    """Field of MjModel ("body_pos", "geom_friction", "dof_frictionloss", ...) or of the state ("qpos", "qvel")."""
    name: str
    """The body, geom, site, actuator, or for jnt_, dof_, qpos and qvel the joint, it belongs to."""
    value: tuple[float, ...]
    of_body: bool = False
    """Whether `name` is that of the body which the joint belongs to: free joints mostly have no name of their own."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", tuple(float(number) for number in self.value))


@dataclass(frozen=True)
class Variation:
    """What sets one episode apart."""

    changes: tuple[Change, ...] = ()
    parameters: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """What the scene itself cannot show, such as the order in which drawers are wanted; see `Readings.parameters`."""
    words: str = ""
    """What sets it apart in the task's own words, with units; empty where nothing does, or the task does not say."""


def shift_words(x_m: float, y_m: float) -> str:
    """Return in words how far something level is moved, "+8 mm along x, -3 mm along y"."""
    return f"{1000 * x_m:+.1f} mm along x, {1000 * y_m:+.1f} mm along y"


def turn_words(turn_deg: float) -> str:
    """Return in words how far something is turned about the vertical, "12 deg to the left"."""
    return f"{abs(turn_deg):.1f} deg to the {'left' if turn_deg >= 0 else 'right'}"


def solid(name: str, shape: Shape, half_m: float, mass_kg: float) -> tuple[Change, ...]:
    """Return the changes that make a body with one geom of the same name a solid of another shape, size and mass.

    Args:
        name: The body and its geom.
        shape: A sphere, a cylinder as high as it is wide, or a cube.
        half_m: Its half size in every direction [m].
        mass_kg: Its mass, evenly spread [kg].

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
    """Start an episode: write the variation into a model, reset its data and compute the first readings.

    The model keeps what is written. Where the variations of a task do not all change the same, begin each episode with
    a copy of the compiled model (`copy.copy`), or it inherits from the one before.
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
    """Start an episode in some simulations of a batch; what a variation leaves out is as in the batch's model.

    Args:
        variations: One for each simulation.
        batch: The simulations.
        ids: Which of them are reset, in rising order.
    """
    rows = np.asarray(ids, dtype=np.int32)
    batch.reset(rows, stage=mujoco.mjtStage.mjSTAGE_NONE.value)
    written = _WRITTEN.setdefault(batch, set())
    for name in written:
        # a reset is one of the state: the fields of the model would be inherited from the episode before
        batch.expand(name)[rows] = getattr(batch.model, name)
    written |= {change.field for variation in variations for change in variation.changes} - _STATE
    for row, variation in zip(rows, variations, strict=True):
        for change in variation.changes:
            array = batch.bind(change.field) if change.field in _STATE else batch.expand(change.field)
            array[row][_rows(batch.model, change)] = _shaped(change)
    batch.set_const(rows)
    batch.forward(rows)


def _rows(model: mujoco.MjModel, change: Change) -> int | slice:
    """Return which rows of the field belong to the named object."""
    kind = change.field.partition("_")[0]
    if kind not in {"qpos", "qvel", "dof", "jnt"}:
        return int(getattr(model, kind)(change.name).id)
    joint = model.joint(int(model.body(change.name).jntadr[0]) if change.of_body else change.name)
    if kind == "jnt":
        return int(joint.id)
    first = int((joint.qposadr if kind == "qpos" else joint.dofadr)[0])
    return slice(first, first + len(change.value))


def _shaped(change: Change) -> Any:
    """Return the value as the field wants it: a number where the object has one, an array where it has several."""
    several = change.field in _STATE or change.field.startswith("dof_") or len(change.value) > 1
    return np.asarray(change.value) if several else change.value[0]
