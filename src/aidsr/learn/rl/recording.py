"""One held-out episode of a trained policy, played again and recorded: positions, cables, contacts, progress."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aidsr.core.errors import UserError
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits

if TYPE_CHECKING:
    from aidsr.learn.episodes.batch import Episodes, StepResult
    from aidsr.tasks.readings import FloatArray

_LIMITS = Limits(wall_s=300.0, cpu_s=180.0, memory_mib=16384)
"""Our choice: ten times what the longest episode of a task takes; torch maps some 6 GiB without using them."""


_STATE = ("qpos", "qvel", "act")
_MOST_ROWS = 4000
"""Of one episode. Our choice: more than a screen has columns."""


@isolated(limits=_LIMITS)
def record_episode(training: Path, variation: int) -> bytes:
    """Play one held-out variation with the policy of a training, and return it as an .npz archive.

    The archive has no pickled objects. Rows are `frame_s` [s] apart, up to ten in each control step: `qpos`
    (n, nq), `ctrl` (n, nu), `tension_n` (n, ntendon) [N], `progress` (n,), 0 to 1. `contacts` (m, 7) are those of the
    robot with anything else: row, point (3) [m], force on the robot (3) [N]. `variation` is its index, `ended` how the
    episode ended, and `mjcf` the scene with what the variation moved or resized.

    Played alone an episode may come out otherwise than among the hundred of an evaluation, as the network adds up in
    another order; `ended` is that of this one.

    Args:
        training: Folder of a finished training.
        variation: Index of a held-out variation, from 0.

    Raises:
        UserError: There is no such training, or an earlier version made it, with other observations.
        IsolationError: It takes too long.
    """
    from aidsr.learn.episodes.batch import Episodes
    from aidsr.learn.episodes.rollout import rollout
    from aidsr.learn.episodes.varied_mjcf import varied_mjcf
    from aidsr.learn.rl.policy import one_torch_thread
    from aidsr.learn.rl.trained import FinishedTraining

    finished = FinishedTraining.load(training)
    scene, varied = finished.scene, finished.scene.task.variation("held_out", variation)
    smoothing = finished.config.recipe.smoothing
    episodes = Episodes(scene.model, scene.task, scene.actions, [varied], threads=1, smoothing=smoothing, record=_STATE)
    if finished.policy.normalisation.mean.shape != episodes.observation.shape[1:]:
        raise UserError(f"the policy in {training} was trained with other observations; train it again")
    recorder = Recorder(episodes)
    with one_torch_thread():
        outcomes = rollout(episodes, finished.policy, recorder.update)
    archive = io.BytesIO()
    np.savez_compressed(
        archive,
        **recorder.arrays(),  # type: ignore[arg-type]  # the stub takes the names of arrays for its other option
        frame_s=np.float64(recorder.frame_s),
        variation=np.int64(variation),
        ended=np.array(outcomes.result(0, variation).ended),
        mjcf=np.array(varied_mjcf(scene.mjcf, varied)),
    )
    return archive.getvalue()


@dataclass
class Recorder:
    """Records a single episode during a `rollout`; its `update` is the callback.

    Args:
        episodes: One, just reset.
    """

    episodes: Episodes
    _rows: list[dict[str, FloatArray]] = field(default_factory=list)

    def __post_init__(self) -> None:
        import mujoco

        from aidsr.sim.contact_forces import ContactForces

        episodes, batch = self.episodes, self.episodes.batch
        self._model = batch.get_model(0)
        self._data = mujoco.MjData(self._model)
        self._contacts = ContactForces(self._model, np.array(episodes.structure.geoms, np.intp))
        steps, most = episodes.physics_steps, _MOST_ROWS * episodes.task.control_dt_s / episodes.task.time_limit_s
        in_a_step = max(each for each in range(1, 11) if steps % each == 0 and (each == 1 or each <= most))
        self._every = steps // in_a_step
        self.frame_s = float(self._model.opt.timestep) * self._every
        self._record({name: batch.bind(name)[0] for name in _STATE}, batch.bind("ctrl")[0], 0.0)

    def update(self, result: StepResult) -> None:
        """Add one control step; one in which the simulation diverged is left out."""
        if result.diverged[0]:
            return
        ctrl = self.episodes.batch.bind("ctrl")[0]
        for step in range(self._every - 1, self.episodes.physics_steps, self._every):
            state = {name: self.episodes.recorded[name][0, step] for name in _STATE}
            self._record(state, ctrl, float(result.progress[0]))

    def arrays(self) -> dict[str, NDArray[np.float32]]:
        """Return what was recorded, as `record_episode` has it."""
        contacts = [np.insert(row["contacts"], 0, index, axis=1) for index, row in enumerate(self._rows)]
        rows = {
            name: np.array([row[name] for row in self._rows], np.float32)
            for name in ("qpos", "ctrl", "tension_n", "progress")
        }
        return rows | {"contacts": np.concatenate(contacts).astype(np.float32)}

    def _record(self, state: Mapping[str, FloatArray], ctrl: FloatArray, progress: float) -> None:
        import mujoco

        from aidsr.sim.tendon_tension import tensions_n

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
                "contacts": self._contacts.read(data),
            }
        )
