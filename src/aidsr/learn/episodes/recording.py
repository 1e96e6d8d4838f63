"""Recording of one episode for viewing: positions, cables, contacts, progress, and when the goal holds."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.rollout import Policy, rollout
from aidsr.learn.episodes.varied_mjcf import varied_mjcf
from aidsr.sim.contact_forces import ContactForces
from aidsr.sim.tendon_tension import tensions_n
from aidsr.tasks.readings import FloatArray

STATE = ("qpos", "qvel", "act")
"""Fields that the episodes must record in each physics step."""
_MOST_ROWS = 4000
"""Maximum number of rows of one episode. Our choice: more than a screen has columns."""


def record_rollout(episodes: Episodes, policy: Policy, mjcf: str, variation: int) -> bytes:
    """Play a single episode with a policy and return it as an .npz archive.

    The archive has no pickled objects. Rows are `frame_s` [s] apart, up to ten in each control step: `qpos` (n, nq),
    `ctrl` (n, nu), `tension_n` (n, ntendon) [N], `progress` (n,), 0 to 1, `holds` (n,), whether the goal holds at that
    moment. `contacts` (m, 7) are those of the robot with anything else: row, point (3) [m], force on the robot (3) [N].
    `variation` is the variation's index, `ended` how the episode ended, and `mjcf` the scene with the objects that the
    variation moved or resized changed.

    Args:
        episodes: A single episode, just created or reset, with `record=STATE`.
        policy: Policy that drives the actuators.
        mjcf: MJCF of the scene.
        variation: Index of the variation, stored in the archive.
    """
    recorder = Recorder(episodes)
    outcomes = rollout(episodes, policy, recorder.update)
    archive = io.BytesIO()
    np.savez_compressed(
        archive,
        **recorder.arrays(),  # type: ignore[arg-type]  # the type stub mistakes the names of arrays for its other option
        frame_s=np.float64(recorder.frame_s),
        variation=np.int64(variation),
        ended=np.array(outcomes.result(0, variation).ended),
        mjcf=np.array(varied_mjcf(mjcf, episodes.variations[0])),
    )
    return archive.getvalue()


@dataclass
class Recorder:
    """Records a single episode during a `rollout`; its `update` is the callback.

    Args:
        episodes: A single episode, just reset.
    """

    episodes: Episodes
    _rows: list[dict[str, FloatArray]] = field(default_factory=list)

    def __post_init__(self) -> None:
        episodes, batch = self.episodes, self.episodes.batch
        self._model = batch.get_model(0)
        self._data = mujoco.MjData(self._model)
        self._contacts = ContactForces(self._model, np.array(episodes.structure.geoms, np.intp))
        steps, most = episodes.physics_steps, _MOST_ROWS * episodes.task.control_dt_s / episodes.task.time_limit_s
        in_a_step = max(each for each in range(1, 11) if steps % each == 0 and (each == 1 or each <= most))
        self._every = steps // in_a_step
        self.frame_s = float(self._model.opt.timestep) * self._every
        self._record({name: batch.bind(name)[0] for name in STATE}, batch.bind("ctrl")[0], 0.0, holds=False)

    def update(self, result: StepResult) -> None:
        """Add one control step; a step in which the simulation diverged is left out."""
        if result.diverged[0]:
            return
        ctrl = self.episodes.batch.bind("ctrl")[0]
        for step in range(self._every - 1, self.episodes.physics_steps, self._every):
            state = {name: self.episodes.recorded[name][0, step] for name in STATE}
            self._record(state, ctrl, float(result.progress[0]), holds=bool(self.episodes.holds[0]))

    def arrays(self) -> dict[str, NDArray[np.float32]]:
        """Return the recorded arrays, as described in `record_rollout`."""
        contacts = [np.insert(row["contacts"], 0, index, axis=1) for index, row in enumerate(self._rows)]
        rows = {
            name: np.array([row[name] for row in self._rows], np.float32)
            for name in ("qpos", "ctrl", "tension_n", "progress", "holds")
        }
        return rows | {"contacts": np.concatenate(contacts).astype(np.float32)}

    def _record(self, state: Mapping[str, FloatArray], ctrl: FloatArray, progress: float, *, holds: bool) -> None:
        model, data = self._model, self._data
        for name, values in {**state, "ctrl": ctrl}.items():
            getattr(data, name)[:] = values
        mujoco.mj_forward(model, data)
        self._rows.append(
            {
                "qpos": data.qpos.copy(),
                "ctrl": data.ctrl.copy(),
                "tension_n": tensions_n(model, data.ten_length, data.actuator_force),
                "progress": np.array(progress),
                "holds": np.array(float(holds)),
                "contacts": self._contacts.read(data),
            }
        )
