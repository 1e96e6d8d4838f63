"""Open-loop motions: what each group of actuators does over time, independent of observations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Artifact
from aidsr.tasks.readings import FloatArray

_DIGITS = 4
"""Decimal places of the numbers of a motion. Our choice: finer than any winch, and still readable."""


class GroupMotion(Artifact):
    """Motion of one group of actuators, in actions: -1 to 1 spans the control range, larger values are clipped."""

    group: str
    first: float
    """Action before the ramp begins."""
    last: float
    """Action after the ramp has ended."""
    amplitude: float = 0.0
    """Amplitude of the sinusoid on top."""
    phase_rad: float = 0.0
    frequency_hz: float | None = None
    """Frequency of the sinusoid [Hz]; None for the frequency of the whole motion."""


class Motion(Artifact):
    """One motion of a robot: each group goes from one value to another and swings about it.

    action(t) = first + (last - first) x ramp(t) + amplitude x sin(2 pi frequency t + phase), clipped to -1 and 1
    """

    begin_s: float
    """Start of the ramp [s]."""
    ramp_s: float
    """Duration of the ramp [s]."""
    frequency_hz: float
    """Frequency of all groups without a frequency of their own [Hz]."""
    groups: tuple[GroupMotion, ...]

    @property
    def summary(self) -> str:
        """The motion in one line, with the number of groups that it moves."""
        moving = [group for group in self.groups if group.first != group.last or group.amplitude]
        ramps = any(group.first != group.last for group in self.groups)
        swings = any(group.amplitude for group in self.groups)
        how = [f"ramp from {self.begin_s:.2g} s for {self.ramp_s:.2g} s"] * ramps
        own = sorted({group.frequency_hz or self.frequency_hz for group in self.groups if group.amplitude})
        how += [f"swing at {' and '.join(f'{each:.2g}' for each in own)} Hz"] * swings
        return ", ".join(how or ["hold"]) + f" ({len(moving)} of {len(self.groups)} groups)"


@dataclass(frozen=True)
class Motions:
    """n motions of k groups as arrays, to be played in parallel."""

    first: FloatArray
    """Actions before the ramp begins, (n, k)."""
    change: FloatArray
    """Difference between last and first action, (n, k)."""
    amplitude: FloatArray
    """Amplitudes of the sinusoids, (n, k)."""
    phase_rad: FloatArray
    """Phases of the sinusoids at time 0 [rad], (n, k)."""
    frequency_hz: FloatArray
    """Frequencies of the sinusoids [Hz], one for all groups, (n, 1), or one for each group, (n, k)."""
    begin_s: FloatArray
    """Starts of the ramps [s], (n,)."""
    ramp_s: FloatArray
    """Durations of the ramps [s], (n,)."""

    @property
    def last(self) -> FloatArray:
        """Actions after the ramp has ended, (n, k)."""
        return np.asarray(self.first + self.change)

    @classmethod
    def of(cls, motions: Sequence[Motion]) -> Self:
        """Return motions as arrays."""

        def each(name: str) -> FloatArray:
            return np.array([[getattr(group, name) for group in motion.groups] for motion in motions])

        return cls(
            first=each("first"),
            change=each("last") - each("first"),
            amplitude=each("amplitude"),
            phase_rad=each("phase_rad"),
            frequency_hz=np.array(
                [[group.frequency_hz or motion.frequency_hz for group in motion.groups] for motion in motions]
            ),
            begin_s=np.array([motion.begin_s for motion in motions]),
            ramp_s=np.array([motion.ramp_s for motion in motions]),
        )

    @classmethod
    def joined(cls, parts: Sequence[Motions]) -> Self:
        """Return several batches of motions as one batch."""
        arrays = {each.name: [getattr(part, each.name) for part in parts] for each in fields(cls)}
        arrays["frequency_hz"] = [np.broadcast_to(part.frequency_hz, part.first.shape) for part in parts]
        return cls(**{name: np.concatenate(values) for name, values in arrays.items()})

    def at(self, time_s: float | FloatArray) -> FloatArray:
        """Return the actions at a time, the same for all motions or one for each, (n,); (n, k), -1 to 1."""
        ramp = np.clip((time_s - self.begin_s) / self.ramp_s, 0.0, 1.0)[:, None]
        turned = self.frequency_hz * np.reshape(time_s, (-1, 1))
        swing = self.amplitude * np.sin(2 * np.pi * turned + self.phase_rad)
        return np.asarray(np.clip(self.first + self.change * ramp + swing, -1.0, 1.0))

    def motion(self, index: int, names: Sequence[str]) -> Motion:
        """Return one of the motions in readable form, rounded."""

        def rounded(value: float) -> float:
            return round(float(value), _DIGITS)

        own = self.frequency_hz.shape[1] > 1

        return Motion(
            begin_s=rounded(self.begin_s[index]),
            ramp_s=rounded(self.ramp_s[index]),
            frequency_hz=rounded(self.frequency_hz[index, 0]),
            groups=tuple(
                GroupMotion(
                    group=name,
                    first=rounded(self.first[index, k]),
                    last=rounded(self.first[index, k] + self.change[index, k]),
                    amplitude=rounded(self.amplitude[index, k]),
                    phase_rad=rounded(self.phase_rad[index, k]),
                    frequency_hz=rounded(self.frequency_hz[index, k]) if own else None,
                )
                for k, name in enumerate(names)
            ),
        )


class OpenLoopPolicy:
    """Plays motions from the beginning, one in each episode, and ignores the observations.

    Args:
        motions: One motion for each episode.
        control_dt_s: Time between two actions [s].
    """

    def __init__(self, motions: Motions, control_dt_s: float) -> None:
        self._motions, self._control_dt_s = motions, control_dt_s
        self._steps = 0

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return the next actions, (n, k)."""
        del observation
        self._steps += 1
        return self._motions.at((self._steps - 1) * self._control_dt_s)
