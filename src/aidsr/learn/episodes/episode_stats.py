"""Statistics of episodes: motion, energy, joint limits. `plausibility` judges them."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.sim.actuator_force import output_of
from aidsr.sim.motion_limits import OVERRUN_DEG
from aidsr.tasks.readings import FloatArray

RECORDED = ("energy", "actuator_force", "actuator_length", "actuator_velocity", "qfrc_gravcomp", "qvel")
"""Fields of MjData that a `StatsRecorder` needs from every physics step; the model must have energy enabled."""

Ids = NDArray[np.intp]
_AT_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_AT_SITE, _AT_BODY = int(mujoco.mjtTrn.mjTRN_SITE), int(mujoco.mjtTrn.mjTRN_BODY)

OVER_RAD = float(np.deg2rad(OVERRUN_DEG))
OVER_LENGTHS = 0.05
"""Allowed overrun of a joint's range: `OVER_RAD` [rad] for a hinge or a ball joint, `OVER_LENGTHS` [characteristic
lengths] for a slide joint. Source: our choice for slides: as far as a part of that length moves when it turns by 3
degrees."""


@dataclass(frozen=True)
class EpisodeStats:
    """Statistics of n episodes; arrays are (n,) unless stated otherwise."""

    moved: FloatArray
    """Largest displacement of a part of the robot from its start / characteristic length, in the frame of the robot's
    root, or of the world for a free robot."""
    energy_gain_j: FloatArray
    """Largest rise of mechanical energy that no actuator supplied [J]."""
    work_j: FloatArray
    """Work of the robot's own actuators, magnitudes of positive and negative work added up [J]."""
    over_limit: FloatArray
    """Largest overrun of a joint's range, as a share of the allowed overrun."""
    qpos: tuple[FloatArray, ...]
    """Positions at the start and after each control step, one array (n_frames, nq) for each episode."""


class StatsRecorder:
    """Records statistics during a `rollout`; its `update` is the callback.

    Args:
        episodes: Episodes that have just been reset and that record `RECORDED`.
    """

    def __init__(self, episodes: Episodes) -> None:
        self._episodes = episodes
        self._motion = _Motion(episodes)
        self._energy = _Energy(episodes)
        self._limits = _Limits(episodes)
        self._frames: list[list[FloatArray]] = [[row.copy()] for row in episodes.batch.bind("qpos")]

    def update(self, result: StepResult) -> None:
        """Add one control step. Episodes that diverged in it are left out, because their values are meaningless."""
        episodes = self._episodes
        good = episodes.stepped[~result.diverged[episodes.stepped]]
        rows = np.isin(episodes.stepped, good)
        self._motion.update(good)
        self._limits.update(good)
        self._energy.update(good, {name: values[rows] for name, values in episodes.recorded.items()})
        for index in good.tolist():
            self._frames[index].append(episodes.batch.bind("qpos")[index].copy())

    def stats(self) -> EpisodeStats:
        """Return the statistics so far."""
        return EpisodeStats(
            moved=self._motion.farthest_m / self._episodes.structure.characteristic_length_m,
            energy_gain_j=self._energy.gain_j,
            work_j=self._energy.work_j,
            over_limit=self._limits.over,
            qpos=tuple(np.array(frames) for frames in self._frames),
        )


class _Motion:
    """Largest displacement of the robot's parts from their start."""

    def __init__(self, episodes: Episodes) -> None:
        self._episodes = episodes
        structure = episodes.structure
        self._bodies = list(structure.moving)
        self._root = structure.roots[0]
        self._free = bool(structure.free_roots)
        for field in ("xpos", "xmat"):
            episodes.batch.bind(field)
        episodes.batch.forward()
        self._start = self._centers_m(np.arange(episodes.n))
        self.farthest_m = np.zeros(episodes.n)

    def update(self, ids: Ids) -> None:
        way = np.linalg.norm(self._centers_m(ids) - self._start[ids], axis=2)
        self.farthest_m[ids] = np.maximum(self.farthest_m[ids], way.max(axis=1))

    def _centers_m(self, ids: Ids) -> FloatArray:
        """Return the centres of mass of the robot's bodies, (n, bodies, 3) [m]."""
        batch = self._episodes.batch
        centres = batch.bind("xipos")[ids][:, self._bodies]
        if self._free:
            return np.asarray(centres)
        from_root = centres - batch.bind("xpos")[ids, None, self._root]
        return np.asarray(np.einsum("nji,nbj->nbi", batch.bind("xmat")[ids, self._root].reshape(-1, 3, 3), from_root))


class _Energy:
    """Rise of the scene's energy beyond what the actuators supplied.

    Between two physics steps, an actuator does the work of its force over the change of its length, or, if it has none
    (`_has_length`), over its mean velocity times the time step. Gravity compensation does the work of its forces over
    the change of the joints; damping, friction and contacts only remove energy. Springs are part of MuJoCo's potential
    energy. Soft contacts and limits return energy stored in them, so a rise within a share of the robot's own work is
    allowed (see `plausibility`). A heavy stage moved by the environment does many times as much work: its work counts
    as supplied, but does not increase what is allowed.

    Source: MuJoCo documentation, Computation, "Energy"; the balance is the first law of mechanics.
    """

    def __init__(self, episodes: Episodes) -> None:
        n, model = episodes.n, episodes.model
        self._timestep_s = float(model.opt.timestep)
        self._own = list(episodes.structure.actuators)
        self._without_length = [output_of(model, one) for one in range(model.nu) if not _has_length(model, one)]
        self.gain_j, self.work_j = np.zeros(n), np.zeros(n)
        self._paid_j, self._lowest_j = np.zeros(n), np.full(n, np.inf)
        self._force, self._velocity = np.zeros((n, model.nactuator)), np.zeros((n, model.nactuator))
        self._length = np.full((n, model.nactuator), np.nan)

    def update(self, ids: Ids, recorded: dict[str, FloatArray]) -> None:
        force, length, velocity = (recorded[f"actuator_{name}"] for name in ("force", "length", "velocity"))
        before = np.where(np.isnan(self._length[ids]), length[:, 0], self._length[ids])
        stretched = np.diff(length, axis=1, prepend=before[:, None])
        slower = np.concatenate([self._velocity[ids][:, None], velocity[:, :-1]], axis=1)
        way = (slower + velocity) / 2 * self._timestep_s
        stretched[..., self._without_length] = way[..., self._without_length]
        pulled = np.concatenate([self._force[ids][:, None], force[:, :-1]], axis=1)
        work_j = pulled * stretched
        lifted_j = (recorded["qfrc_gravcomp"] * recorded["qvel"]).sum(axis=2) * self._timestep_s
        # recorded energy is from before its physics step, recorded velocity from after it
        lifted_before_j = np.cumsum(lifted_j, axis=1) - lifted_j
        paid_j = self._paid_j[ids, None] + work_j.sum(axis=2).cumsum(axis=1) + lifted_before_j
        unpaid_j = recorded["energy"].sum(axis=2) - paid_j
        lowest_j = np.minimum(np.minimum.accumulate(unpaid_j, axis=1), self._lowest_j[ids, None])
        self.gain_j[ids] = np.maximum(self.gain_j[ids], (unpaid_j - lowest_j).max(axis=1))
        self.work_j[ids] += np.abs(work_j[..., self._own].sum(axis=2)).sum(axis=1)
        self._paid_j[ids] += work_j.sum(axis=(1, 2)) + lifted_j.sum(axis=1)
        self._lowest_j[ids] = lowest_j[:, -1]
        self._force[ids], self._length[ids], self._velocity[ids] = force[:, -1], length[:, -1], velocity[:, -1]


def _has_length(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether MuJoCo gives an actuator a length.

    It is 0 throughout for an actuator at a free joint, at a body, or at a site without a reference site.

    Source: MuJoCo documentation, XML Reference, actuator/general, attributes joint, site, and refsite.
    """
    kind, (target, reference) = int(model.actuator_trntype[actuator]), model.actuator_trnid[actuator].tolist()
    if kind in _AT_JOINT:
        return bool(model.jnt_type[target] != int(mujoco.mjtJoint.mjJNT_FREE))
    return kind != _AT_BODY and not (kind == _AT_SITE and reference < 0)


class _Limits:
    """Overrun of the robot's joint ranges."""

    def __init__(self, episodes: Episodes) -> None:
        model, structure = episodes.model, episodes.structure
        self._qpos = episodes.batch.bind("qpos")
        hinge, slide, ball = (int(getattr(mujoco.mjtJoint, f"mjJNT_{kind}")) for kind in ("HINGE", "SLIDE", "BALL"))
        allowed = {hinge: OVER_RAD, slide: OVER_LENGTHS * structure.characteristic_length_m}
        limited = [joint for joint in structure.joints if model.jnt_limited[joint]]
        straight = [joint for joint in limited if int(model.jnt_type[joint]) in allowed]
        balls = [joint for joint in limited if int(model.jnt_type[joint]) == ball]
        self._columns = [int(model.jnt_qposadr[joint]) for joint in straight]
        self._range = model.jnt_range[straight].reshape(-1, 2)
        self._allowed = np.array([allowed[int(model.jnt_type[joint])] for joint in straight])
        self._quats = model.jnt_qposadr[balls].reshape(-1, 1) + np.arange(4)
        self._widest = model.jnt_range[balls].reshape(-1, 2)[:, 1]
        self.over = np.zeros(episodes.n)

    def update(self, ids: Ids) -> None:
        where = self._qpos[ids][:, self._columns]
        beyond = np.maximum(self._range[:, 0] - where, where - self._range[:, 1]) / self._allowed
        quats = self._qpos[ids][:, self._quats]
        turned = 2.0 * np.arctan2(np.linalg.norm(quats[..., 1:], axis=2), np.abs(quats[..., 0]))
        both = np.concatenate([beyond, (turned - self._widest) / OVER_RAD], axis=1)
        self.over[ids] = np.maximum(self.over[ids], both.max(axis=1, initial=0.0))
