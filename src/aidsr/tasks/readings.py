"""Inputs of a task: named sensors of one or many simulations, as arrays with a leading axis of simulations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.errors import UserError
from aidsr.sim.structure import read_structure
from aidsr.sim.task_sensors import CONTACT_SLOT_WIDTH
from aidsr.tasks.outline import SPHERES, covering, strung

if TYPE_CHECKING:
    from aidsr.tasks.task import Task
    from aidsr.tasks.variation import Variation

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

TOUCH_N = 0.05
"""Smallest force that counts as touching [N]. Source: our choice, well above solver noise, the weight of 5 g."""


@dataclass(frozen=True)
class Contacts:
    """Slots of one "contacts" sensor (see `TaskSensor`), for n simulations and s slots."""

    found: BoolArray
    """Whether each slot holds a contact, (n, s)."""
    force_n: FloatArray
    """Normal force, 0 for an empty slot, (n, s) [N]."""
    position_m: FloatArray
    """World position, (n, s, 3) [m]."""
    normal: FloatArray
    """Unit normal from the robot into the target, (n, s, 3)."""

    def opposition(self) -> FloatArray:
        """Return how far the contacts oppose each other, (n,): 0 none or all from one side, 1 exactly opposite.

        Source: our choice. Two contacts can hold a body between them when their normals oppose (Nguyen 1988,
        "Constructing force-closure grasps"); this is a gradual version of that test: half of one minus the smallest
        cosine between two contact normals.
        """
        pairs = self.found[:, :, None] & self.found[:, None, :]
        cosine = np.where(pairs, np.einsum("nik,njk->nij", self.normal, self.normal), 1.0)
        return np.asarray((1.0 - cosine.min(axis=(1, 2))) / 2.0)


@dataclass(frozen=True)
class Outline:
    """The robot's surface as spheres in its geoms, for n simulations and p spheres; see `Task.covers_outline`."""

    center_m: FloatArray
    """World position, (n, p, 3) [m]."""
    radius_m: FloatArray
    """Radius of each sphere, (p,) [m]."""
    length_share: FloatArray
    """Share of the body's length that each sphere stands for, (p,). The sum is 1, or less if much of the body cannot
    touch anything and so has no sphere."""

    def foremost_m(self, along_m: FloatArray) -> FloatArray:
        """Return the position of the foremost point of the surface along a line, (n,) [m].

        Args:
            along_m: Positions of the spheres' centres along the line, (n, p) [m].
        """
        return np.asarray((along_m + self.radius_m).max(axis=1))

    def rearmost_m(self, along_m: FloatArray) -> FloatArray:
        """Return the position of the rearmost point of the surface along a line, (n,) [m]; see `foremost_m`."""
        return np.asarray((along_m - self.radius_m).min(axis=1))


@dataclass(frozen=True)
class Readings:
    """Everything a task may read after one control step, for n simulations of one scene."""

    sensors: Mapping[str, FloatArray]
    """Samples by sensor name, (n, s, k): s physics steps since the last control step, oldest first, k numbers each."""
    time_s: FloatArray
    """Time since the start of the episode, (n,) [s]."""
    length_m: float
    """The robot's characteristic length [m]."""
    sample_dt_s: float
    """Time between two samples [s]."""
    parameters: Mapping[str, FloatArray] = field(default_factory=dict)
    """`Variation.parameters` of each episode, (n, k)."""
    outline: Outline | None = None
    """The robot's surface, for tasks that set `needs_outline`; otherwise None."""

    @property
    def n(self) -> int:
        """Number of simulations."""
        return int(self.time_s.shape[0])

    def __getitem__(self, name: str) -> FloatArray:
        """Return the newest sample of a sensor, (n, k)."""
        return self.samples(name)[:, -1]

    def scalar(self, name: str) -> FloatArray:
        """Return the newest sample of a one-number sensor, (n,)."""
        return self[name][:, 0]

    def samples(self, name: str) -> FloatArray:
        """Return all samples of a sensor since the last control step, (n, s, k)."""
        if name not in self.sensors:
            raise KeyError(f'unknown sensor "{name}"; the scene has {", ".join(sorted(self.sensors))}')
        return self.sensors[name]

    def force_n(self, name: str) -> FloatArray:
        """Return the newest magnitude of a force sensor, (n,) [N]."""
        return np.asarray(np.linalg.norm(self[name], axis=-1))

    def mean_force_n(self, name: str, *, mean_over_s: float = 0.01) -> FloatArray:
        """Return the magnitude of a force sensor's newest block mean, (n,) [N]; arguments as in `peak_force_n`."""
        return self._mean_forces_n(name, mean_over_s)[:, -1]

    def peak_force_n(self, name: str, *, mean_over_s: float = 0.01) -> FloatArray:
        """Return the largest block-mean magnitude of a force sensor since the last control step, (n,) [N].

        Args:
            name: Name of a sensor with three force components.
            mean_over_s: Duration of the blocks over which forces are averaged first [s], because the force of a single
                physics step depends on the solver, not on the touch (our choice: 10 ms, shorter than the reaction time
                of any servo).
        """
        return np.asarray(self._mean_forces_n(name, mean_over_s).max(axis=1))

    def _mean_forces_n(self, name: str, mean_over_s: float) -> FloatArray:
        """Return the magnitudes of a force sensor's block means, newest block last, (n, blocks) [N]."""
        means = _block_means(self.samples(name), mean_over_s / self.sample_dt_s)
        return np.asarray(np.linalg.norm(means, axis=-1))

    def peak_contact_n(self, name: str, *, mean_over_s: float = 0.01, together: bool = False) -> FloatArray:
        """Return the largest normal force of a "contacts" sensor since the last control step, (n,) [N].

        Args:
            name: Name of a "contacts" sensor.
            mean_over_s: See `peak_force_n`.
            together: Whether to sum the contacts in the slots in each physics step instead of taking the strongest.
                Contacts beyond the slots do not count; `all_contacts_n` counts them.
        """
        slots = self._slots(name)
        force_n = np.where(slots[..., 0] > 0, slots[..., 1], 0.0)
        at_once = force_n.sum(axis=2) if together else force_n.max(axis=2)
        return self._peak_n(at_once, mean_over_s)

    def all_contacts_n(self, name: str, *, mean_over_s: float = 0.01) -> FloatArray:
        """Return the largest sum of the normal forces of all contacts since the last control step, (n,) [N].

        With more contacts than slots, the sum is an upper bound, so that a limit is exceeded too early rather than too
        late: each contact without a slot counts with the whole force, friction included, of the weakest one in a slot.

        Args:
            name: Name of a "contacts" sensor.
            mean_over_s: See `peak_force_n`.
        """
        slots = self._slots(name)
        force_n = np.where(slots[..., 0] > 0, slots[..., 1], 0.0)
        beyond = np.maximum(slots[:, :, 0, 0] - slots.shape[2], 0.0)  # the first slot has the number of contacts
        weakest_n = np.linalg.norm(slots[:, :, -1, 1:4], axis=-1)
        return self._peak_n(force_n.sum(axis=2) + beyond * weakest_n, mean_over_s)

    def _slots(self, name: str) -> FloatArray:
        """Return all samples of a "contacts" sensor, (n, s, slots, `CONTACT_SLOT_WIDTH`)."""
        samples = self.samples(name)
        return samples.reshape(*samples.shape[:2], -1, CONTACT_SLOT_WIDTH)

    def _peak_n(self, force_n: FloatArray, mean_over_s: float) -> FloatArray:
        """Return the largest block mean of forces, (n, s) -> (n,) [N]."""
        return np.asarray(_block_means(force_n[..., None], mean_over_s / self.sample_dt_s)[..., 0].max(axis=1))

    @property
    def body(self) -> Outline:
        """The robot's outline, for tasks that set `needs_outline`.

        Raises:
            ValueError: There is no outline.
        """
        if self.outline is None:
            raise ValueError("readings without an outline: set needs_outline in the task")
        return self.outline

    def contacts(self, name: str) -> Contacts:
        """Return the newest sample of a "contacts" sensor, split into its fields."""
        slots = self[name].reshape(self.n, -1, CONTACT_SLOT_WIDTH)
        found = slots[:, :, 0] > 0
        return Contacts(
            found=found,
            force_n=np.where(found, slots[:, :, 1], 0.0),
            position_m=slots[:, :, 4:7],
            normal=slots[:, :, 7:10],
        )


@dataclass(frozen=True)
class Reader:
    """Converter from the arrays of one compiled model, which may stand for many simulations, to readings."""

    columns: Mapping[str, slice]
    """Columns of `sensordata` by sensor name."""
    length_m: float
    timestep_s: float
    geoms: tuple[int, ...]
    """Ids of the robot's solid geoms, each as often as `offset_m` has rows of it; empty if the task does not need the
    outline."""
    offset_m: FloatArray
    """Centres of the outline's spheres in the frames of their geoms, (g, s, 3) [m]: g geoms, s spheres each."""
    radius_m: FloatArray
    """Radii of the spheres, (g * s,) [m]."""
    length_share: FloatArray
    """See `Outline.length_share`, (g * s,)."""

    @classmethod
    def of(cls, task: Task, model: mujoco.MjModel) -> Self:
        """Return the reader for a scene: a robot placed in the task's environment."""
        structure = read_structure(model)
        starts = zip(model.sensor_adr, model.sensor_dim, strict=True)
        solid = [geom for geom in structure.geoms if model.geom_contype[geom] or model.geom_conaffinity[geom]]
        geoms = tuple(solid) if task.needs_outline else ()
        half_m = np.array([model.geom_aabb[geom][3:] for geom in geoms]).reshape(-1, 3)
        offset_m, radius_m = strung(half_m)
        share_m = np.repeat(2.0 * half_m.max(axis=1) / SPHERES, SPHERES)
        if task.covers_outline and geoms:
            owners, offset_m, radius_m = covering(model, geoms)
            counts = [owners.count(geom) for geom in geoms]
            share_m = np.repeat(2.0 * half_m.max(axis=1) / counts, counts)
            geoms = owners
        return cls(
            columns={model.sensor(i).name: slice(int(a), int(a) + int(k)) for i, (a, k) in enumerate(starts)},
            length_m=structure.characteristic_length_m,
            timestep_s=float(model.opt.timestep),
            geoms=geoms,
            offset_m=offset_m,
            radius_m=radius_m.reshape(-1),
            length_share=share_m / max(share_m.sum(), structure.characteristic_length_m),
        )

    def read(
        self,
        sensordata: FloatArray,
        time_s: FloatArray,
        variations: Sequence[Variation],
        geom_xpos: FloatArray | None = None,
        geom_xmat: FloatArray | None = None,
    ) -> Readings:
        """Return the readings of n simulations.

        Args:
            sensordata: Sensor values after each physics step of the last control step, (n, s, nsensordata). Readings
                are views of it, so pass a copy if a simulation will overwrite the array.
            time_s: Time since each episode began, (n,) [s].
            variations: Variation of each episode, n of them.
            geom_xpos: MuJoCo's field, (n, ngeom, 3) [m]; only read if the task needs the outline.
            geom_xmat: MuJoCo's field, (n, ngeom, 9) or (n, ngeom, 3, 3); only read if the task needs the outline.

        Raises:
            UserError: The variations have different parameters.
            ValueError: The task needs the outline, and `geom_xpos` or `geom_xmat` is missing.
        """
        return Readings(
            sensors={name: sensordata[:, :, columns] for name, columns in self.columns.items()},
            time_s=time_s,
            length_m=self.length_m,
            sample_dt_s=self.timestep_s,
            parameters=_parameters(variations),
            outline=self._outline(geom_xpos, geom_xmat),
        )

    def _outline(self, geom_xpos: FloatArray | None, geom_xmat: FloatArray | None) -> Outline | None:
        if not self.geoms:
            return None
        if geom_xpos is None or geom_xmat is None:
            raise ValueError("geom_xpos and geom_xmat missing: this task needs the outline, pass them to read()")
        n, geoms = geom_xpos.shape[0], list(self.geoms)
        turn = geom_xmat.reshape(n, -1, 3, 3)[:, geoms]
        center_m = geom_xpos[:, geoms, None] + np.einsum("ngij,gbj->ngbi", turn, self.offset_m)
        return Outline(center_m.reshape(n, -1, 3), self.radius_m, self.length_share)


def _block_means(samples: FloatArray, length: float) -> FloatArray:
    """Return means over blocks of about `length` samples, newest block last: (n, s, k) -> (n, blocks, k)."""
    block = max(1, min(samples.shape[1], round(length)))
    kept = samples[:, samples.shape[1] % block :]
    return np.asarray(kept.reshape(kept.shape[0], -1, block, kept.shape[2]).mean(axis=2))


def _parameters(variations: Sequence[Variation]) -> dict[str, FloatArray]:
    """Return the parameters of n episodes by name, (n, k) each.

    Raises:
        UserError: The episodes have different parameters.
    """
    names = variations[0].parameters.keys() if variations else ()
    for variation in variations:
        if variation.parameters.keys() != names:
            first, other = (", ".join(sorted(each)) or "none" for each in (names, variation.parameters))
            raise UserError(
                f"episodes with different parameters: one has {first}, one has {other}. Return all of them from every "
                "call of sample_variation."
            )
    return {name: np.array([variation.parameters[name] for variation in variations]) for name in names}
