"""Recorder of one episode, which measures every control step in a copy of the simulation state."""

from __future__ import annotations

import copy
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from aidsr.core.artifacts import Vec3
from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.rollout import EpisodeOutcomes
from aidsr.learn.episodes.scene import TaskScene
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.contact_forces import contact_bodies, contact_name
from aidsr.sim.divergence import body_speeds
from aidsr.tasks import Feature, GoalTask, Task, Variation, apply_to_simulation
from aidsr.tools.distances import distance_m, find_pairs
from aidsr.tools.recording import ConditionValue, Distance, Moment, Recording, Touch
from aidsr.tools.resting import TOUCH_N

_START_S = 0.3
"""Time before which contacts are attributed to the robot's placement. Our choice: in this time it falls the width of a
hand."""
_ROUNDING = 1e-6
_INSIDE_M = 0.0005
"""Smallest overlap at the start that is reported. Our choice: more than the penetration of a soft contact by weight."""


@dataclass
class _Felt:
    """Contact of the robot with one geom of the environment, accumulated over control steps."""

    bodies: dict[str, None] = field(default_factory=dict)
    first_s: float = 0.0
    forces_n: list[float] = field(default_factory=list)
    peak: tuple[float, float, str] = (0.0, 0.0, "")
    """Largest total force [N], its time [s], and the body with the largest force at that time."""

    def add(self, time_s: float, force_n: dict[str, float]) -> None:
        """Add the forces of the robot's bodies at one time, by the name of the body [N]."""
        self.bodies |= dict.fromkeys(force_n)
        self.forces_n.append(sum(force_n.values()))
        self.peak = max(self.peak, (self.forces_n[-1], time_s, max(force_n, key=force_n.__getitem__)), key=_force_n)


def _force_n(peak: tuple[float, float, str]) -> float:
    return peak[0]


class Recorder:
    """Recorder that follows one episode.

    Args:
        scene: The scene.
        variation: Variation of the episode.
        episodes: Batch with this episode only, just reset.
        distances: Pairs of names of sites, geoms or bodies whose distance is measured.

    Raises:
        UserError: A name is unknown.
    """

    def __init__(
        self, scene: TaskScene, variation: Variation, episodes: Episodes, distances: Sequence[tuple[str, str]]
    ) -> None:
        self._task, self._episodes, self._variation_text = scene.task, episodes, variation.words
        self._model = model = copy.copy(scene.model)
        self._data = mujoco.MjData(model)
        self._names = [model.body(body).name for body in range(model.nbody)]
        self._robot = np.array([name.startswith(ROBOT_PREFIX) for name in self._names])
        self._root = int(self._robot.argmax())
        mujoco.mj_forward(model, self._data)
        described = self._inside()
        apply_to_simulation(variation, model, self._data)
        self._upright = self._data.xmat[self._root].reshape(3, 3).copy()
        self._pairs = find_pairs(model, distances)
        self._felt: dict[str, _Felt] = {}
        self._touches_itself: Counter[str] = Counter()
        self._itself, self._fastest, self._violation_s = 0, "", 0.0
        self._features = [self._observed()]
        self._turns, self._last_turn_deg = 0.0, 0.0
        self.moments = [self._moment(0.0, float(episodes.progress[0]))]
        self._best, self._best_conditions = self.moments[0].progress, self._conditions()
        inside = self._inside()
        self._overlaps = tuple(
            (name, inside.get(name, 0.0), described.get(name, 0.0)) for name in {**described, **inside}
        )

    def step(self, result: StepResult) -> None:
        """Record the state after a control step."""
        if result.diverged[0]:
            return
        self._episodes.copy_state(0, self._data)
        mujoco.mj_forward(self._model, self._data)
        self._violation_s += self._task.control_dt_s * float(result.violation[0] > 0.0)
        self.moments.append(self._moment(float(result.time_s[0]), float(result.progress[0])))
        if self.moments[-1].progress > self._best:
            self._best, self._best_conditions = self.moments[-1].progress, self._conditions()

    def recording(self, outcomes: EpisodeOutcomes, variation: int) -> Recording:
        """Return the recording of the finished episode."""
        self._features.append(self._observed())
        steps = len(self.moments)
        touches = [
            Touch(
                geom=geom,
                bodies=tuple(felt.bodies),
                first_s=felt.first_s,
                share=len(felt.forces_n) / steps,
                mean_n=float(np.mean(felt.forces_n)),
                peak_n=felt.peak[0],
                peak_s=felt.peak[1],
                peak_by=felt.peak[2],
                at_start=felt.first_s <= _START_S,
            )
            for geom, felt in self._felt.items()
        ]
        return Recording(
            variation=variation,
            variation_text=self._variation_text,
            ended=self._ended(outcomes),
            succeeded=bool(outcomes.success[0]),
            best_progress=float(outcomes.best_progress[0]),
            moments=tuple(self.moments),
            stages=tuple((words, self._reached_s(start)) for start, words in self._task.stages),
            touches=tuple(sorted(touches, key=lambda touch: touch.first_s)),
            self_touch_share=self._itself / steps,
            self_touching=next((pair for pair, _ in self._touches_itself.most_common(1)), ""),
            distances=self._distances(),
            features=tuple(
                (name, unit, start, end)
                for (name, unit), start, end in zip(_feature_names(self._task), *self._features, strict=True)
            ),
            reached=outcomes.reached[0],
            held_s=float(outcomes.held_s[0]),
            hold_s=self._task.hold_s,
            exceeded_limits=outcomes.exceeded_limits[0],
            violation_s=self._violation_s,
            overlaps=self._overlaps,
            conditions=self._best_conditions,
            progress_definition=self._task.criteria.progress if isinstance(self._task, GoalTask) else "",
        )

    def _conditions(self) -> tuple[ConditionValue, ...]:
        """Return the quantities in the conditions of the stages, in the current state."""
        return tuple(
            ConditionValue(
                name=one.name,
                value=float(one.value[0]),
                limit=float(np.ravel(one.limit)[0]),
                at_least=one.at_least,
                unit=one.unit,
            )
            for one in self._episodes.conditions()
        )

    def _ended(self, outcomes: EpisodeOutcomes) -> str:
        if outcomes.success[0]:
            return "success, held"
        if outcomes.failure[0]:
            return f"lost by the task's own rule: {self._episodes.lost_by(0)}"
        if outcomes.diverged[0]:
            return f"the simulation diverged; {self._fastest} moved fastest before"
        over = self.moments[-1].time_s > self._task.time_limit_s - self._task.control_dt_s / 2
        return "the task's time is over" if over else "all that was to be played was played"

    def _reached_s(self, progress: float) -> float | None:
        return next((each.time_s for each in self.moments if each.progress >= progress - _ROUNDING), None)

    def _moment(self, time_s: float, progress: float) -> Moment:
        self._feel(time_s)
        speeds = body_speeds(self._model.body_rootid, self._data.cvel, self._data.xipos, self._data.subtree_com)
        self._fastest = self._names[int(np.where(self._robot, speeds, -1.0).argmax())].removeprefix(ROBOT_PREFIX)
        return Moment(
            time_s=round(time_s, 6),
            progress=progress,
            center_m=_vec3(self._data.subtree_com[self._root]),
            heading_deg=self._heading_deg(),
            distances_m=tuple(distance_m(self._model, self._data, first, second) for first, second in self._pairs),
        )

    def _heading_deg(self) -> float:
        """Return the rotation of the root about the vertical since the start, full turns included [deg]."""
        turned = self._data.xmat[self._root].reshape(3, 3) @ self._upright.T
        now = float(np.rad2deg(np.arctan2(turned[1, 0] - turned[0, 1], turned[0, 0] + turned[1, 1])))
        self._turns += 360.0 * round((self._last_turn_deg - now) / 360.0)
        self._last_turn_deg = now
        return now + self._turns

    def _feel(self, time_s: float) -> None:
        """Add the contacts of the current state."""
        model, data, force = self._model, self._data, np.zeros(6)
        now: dict[str, dict[str, float]] = {}
        itself: set[str] = set()
        for index in range(data.ncon):
            contact = data.contact[index]
            bodies = contact_bodies(model, contact)
            mine = [body for body in bodies if self._robot[body]]
            mujoco.mj_contactForce(model, data, index, force)
            if force[0] < TOUCH_N or not mine:
                continue
            if len(mine) == 2:
                parts = sorted(self._names[body].removeprefix(ROBOT_PREFIX) for body in mine)
                itself.add(" with ".join(parts))
                continue
            name = contact_name(model, contact, int(self._robot[bodies[0]]))
            body = self._names[mine[0]].removeprefix(ROBOT_PREFIX)
            forces = now.setdefault(name, {})
            forces[body] = forces.get(body, 0.0) + float(force[0])
        for name, forces in now.items():
            self._felt.setdefault(name, _Felt(first_s=time_s)).add(time_s, forces)
        self._touches_itself.update(itself)
        self._itself += bool(itself)

    def _inside(self) -> dict[str, float]:
        """Return the depths of overlap with the robot, by the name of the environment's geom [m]."""
        found: dict[str, float] = {}
        for contact in self._data.contact[: self._data.ncon]:
            first, second = (bool(self._robot[body]) for body in contact_bodies(self._model, contact))
            if first != second and -contact.dist > _INSIDE_M:
                name = contact_name(self._model, contact, int(first))
                found[name] = max(found.get(name, 0.0), -float(contact.dist))
        return found

    def _distances(self) -> tuple[Distance, ...]:
        found = []
        for index, (first, second) in enumerate(self._pairs):
            least = min(self.moments, key=lambda moment: moment.distances_m[index])
            found.append(
                Distance(
                    first=first.name,
                    second=second.name,
                    start_m=self.moments[0].distances_m[index],
                    least_m=least.distances_m[index],
                    least_s=least.time_s,
                    end_m=self.moments[-1].distances_m[index],
                )
            )
        return tuple(found)

    def _observed(self) -> list[float]:
        """Return the task's features, which are the last entries of the current observation."""
        size = sum(feature.size for feature in self._task.features)
        return [float(value) for value in self._episodes.observation[0][-size:]] if size else []


def _feature_names(task: Task) -> list[tuple[str, str]]:
    """Return name and unit of every number in a task's features."""
    return [
        (feature.name + (f" {_number(feature, index)}" if feature.size > 1 else ""), feature.unit)
        for feature in task.features
        for index in range(feature.size)
    ]


def _number(feature: Feature, index: int) -> str:
    """Return the label of a number of a feature: an axis for features of three numbers with a unit, else its index."""
    return "xyz"[index] if feature.size == 3 and feature.unit else f"[{index}]"


def _vec3(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Vec3:
    x, y, z = (float(value) for value in values)
    return x, y, z
