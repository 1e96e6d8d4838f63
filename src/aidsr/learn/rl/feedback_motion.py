"""A motion that sees: an open-loop motion, and a linear feedback of what the task lets a policy observe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from aidsr.core.artifacts import Artifact
from aidsr.learn.openloop.motion import Motion, Motions
from aidsr.tasks.readings import FloatArray

BASE_MOTION = "base_motion.json"
"""File of a base motion, beside the policy that adds to it."""

_Number = Annotated[float, Field(allow_inf_nan=False)]
_CLIP = 5.0
"""Normalised features beyond this count as this. Our choice: a contact force may be a hundred times its usual value."""


class FeedbackMotion(Artifact):
    """One motion with its feedback, f features and k groups of actuators.

    action(t) = motion(t) + gains x (features(t) - mean) / std, cut off at -1 and 1
    """

    motion: Motion
    gains: tuple[tuple[_Number, ...], ...]
    """(k, f)."""
    mean: tuple[_Number, ...]
    """Of each of the task's features, (f,)."""
    std: tuple[Annotated[float, Field(gt=0, allow_inf_nan=False)], ...]
    """Likewise."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        sizes = {len(self.mean), len(self.std), *map(len, self.gains)}
        if len(self.gains) != len(self.motion.groups) or len(sizes) != 1:
            raise ValueError("its gains fit neither its groups nor its features")
        return self


@dataclass(frozen=True)
class FeedbackMotions:
    """n motions with feedback as arrays, or one for all episodes; the base that a policy's actions are added to."""

    motions: Motions
    gains: FloatArray
    """(n, k, f)."""
    mean: FloatArray
    """(f,)."""
    std: FloatArray
    """(f,)."""

    @classmethod
    def of(cls, one: FeedbackMotion) -> Self:
        """Return one motion as arrays."""
        return cls(Motions.of([one.motion]), np.array([one.gains]), np.array(one.mean), np.array(one.std))

    def repeated(self, times: int) -> FeedbackMotions:
        """Return each motion several times, one after the other."""
        motions = Motions(**{name: np.repeat(value, times, axis=0) for name, value in vars(self.motions).items()})
        return FeedbackMotions(motions, np.repeat(self.gains, times, axis=0), self.mean, self.std)

    def act(self, observation: NDArray[np.floating], time_s: FloatArray) -> FloatArray:
        """Return the actions of n episodes, (n, k), -1 to 1.

        Args:
            observation: Its last f numbers are the task's features, (n, n_observations).
            time_s: Since each episode began, (n,) [s].
        """
        seen = np.clip((observation[:, -self.mean.size :] - self.mean) / self.std, -_CLIP, _CLIP)
        return np.asarray(np.clip(self.motions.at(time_s) + (self.gains @ seen[..., None])[..., 0], -1.0, 1.0))

    def one(self, index: int, names: Sequence[str]) -> FeedbackMotion:
        """Return one of them in a readable form, rounded."""
        return FeedbackMotion(
            motion=self.motions.motion(index, names),
            gains=tuple(tuple(row) for row in self.gains[index].round(6).tolist()),
            mean=tuple(self.mean.round(9).tolist()),
            std=tuple(self.std.round(9).tolist()),
        )
