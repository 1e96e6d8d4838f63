"""From the arrays of a simulation to what a task reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np

from aidsr.core.errors import UserError
from aidsr.sim.structure import read_structure
from aidsr.tasks.readings import FloatArray, Outline, Readings
from aidsr.tasks.task import Task
from aidsr.tasks.variation import Variation

__all__ = ["Reader"]

_BALLS = 3
"""Balls along the longest axis of each geom: both ends and the middle."""


@dataclass(frozen=True)
class Reader:
    """Reads the scenes of one compiled model, which may stand for many simulations."""

    columns: Mapping[str, slice]
    """Where each named sensor lies in `sensordata`."""
    length_m: float
    timestep_s: float
    geoms: tuple[int, ...]
    """The robot's geoms that are solid; empty where the task does not look at them."""
    offset_m: FloatArray
    """Centres of the outline's balls in the frames of their geoms, (g, b, 3) [m]."""
    radius_m: FloatArray
    """(g * b,) [m]."""
    length_share: FloatArray
    """(g * b,)."""

    @classmethod
    def of(cls, task: Task, model: mujoco.MjModel) -> Self:
        """Return the reader for a scene, a robot placed in the task's environment."""
        structure = read_structure(model)
        starts = zip(model.sensor_adr, model.sensor_dim, strict=True)
        solid = [geom for geom in structure.geoms if model.geom_contype[geom] or model.geom_conaffinity[geom]]
        geoms = tuple(solid) if task.needs_outline else ()
        half_m = np.array([model.geom_aabb[geom][3:] for geom in geoms]).reshape(-1, 3)
        radius_m = half_m.min(axis=1)
        along = half_m.max(axis=1) - radius_m
        axis = np.eye(3)[half_m.argmax(axis=1)] if geoms else np.zeros((0, 3))
        steps = np.linspace(-1.0, 1.0, _BALLS)
        share = np.repeat(half_m.max(axis=1), _BALLS)
        return cls(
            columns={model.sensor(i).name: slice(int(a), int(a) + int(k)) for i, (a, k) in enumerate(starts)},
            length_m=structure.characteristic_length_m,
            timestep_s=float(model.opt.timestep),
            geoms=geoms,
            offset_m=steps[None, :, None] * (along[:, None] * axis)[:, None, :],
            radius_m=np.repeat(radius_m, _BALLS),
            length_share=share / share.sum() if geoms else share,
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
            sensordata: Sensor values after each physics step of the last control step, (n, s, nsensordata); readings
                are views of it, so pass a copy of what a simulation will write into again.
            time_s: Time since each episode began, (n,) [s].
            variations: What each episode was started with, n of them.
            geom_xpos: MuJoCo's field, (n, ngeom, 3) [m]; only looked at where the task needs the outline.
            geom_xmat: MuJoCo's field, (n, ngeom, 9) or (n, ngeom, 3, 3).

        Raises:
            UserError: Not all variations have the same parameters.
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
            raise ValueError("this task looks at the robot's outline: pass geom_xpos and geom_xmat to read()")
        n, geoms = geom_xpos.shape[0], list(self.geoms)
        turn = geom_xmat.reshape(n, -1, 3, 3)[:, geoms]
        center_m = geom_xpos[:, geoms, None] + np.einsum("ngij,gbj->ngbi", turn, self.offset_m)
        return Outline(center_m.reshape(n, -1, 3), self.radius_m, self.length_share)


def _parameters(variations: Sequence[Variation]) -> dict[str, FloatArray]:
    """Return the parameters of n episodes, (n, k) each.

    Raises:
        UserError: Not all episodes have the same ones.
    """
    names = variations[0].parameters.keys() if variations else ()
    for variation in variations:
        if variation.parameters.keys() != names:
            first, other = (", ".join(sorted(each)) or "none" for each in (names, variation.parameters))
            raise UserError(
                f"all episodes of a task must have the same parameters; found one with {first} and one with {other}. "
                "Give every variation that `draw` returns all of them."
            )
    return {name: np.array([variation.parameters[name] for variation in variations]) for name in names}
