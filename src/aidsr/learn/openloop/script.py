"""Motion scripts: what each group of actuators does over time, as a few lines of text that are parsed, never executed.

left legs:  mean 0.2 amplitude 0.5 hz 1.5 phase 90
right legs: mean 0.2 amplitude 0.5 hz 1.5 phase 270
neck:       t=0 -1, t=1 0.8, t=3 -0.2
jaw:        t=0 -1, t=2 1 amplitude 0.1 hz 4 from 2 until 6
*:          -1
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aidsr.core.errors import UserError
from aidsr.core.formatting import excerpt
from aidsr.core.suggestions import closest_name
from aidsr.core.text_files import read_text_file
from aidsr.learn.openloop.motion import Motion
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.tasks.readings import FloatArray

if TYPE_CHECKING:
    from aidsr.learn.episodes.scene import TaskScene

GRAMMAR = """\
A line "group: ..." for each group, "*" for all without a line of their own; what has none, of the environment too, \
stays where its command is nearest to 0. Actions are -1 to 1 over the control range: waypoints with straight lines \
between ("t=0 -1, t=1.5 0.8": seconds, action), or one number; on top, if wanted, a sine, \
"-0.2, amplitude 0.5 hz 1.5 phase 90" (degrees), perhaps only "from 2 until 6" seconds. Sums are cut off at -1 and 1."""

_MAX_CHARACTERS = 10_000
_MAX_WAYPOINTS = 100
"""Our choice: more than a handwritten motion needs."""
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_TERM = re.compile(
    rf"\s*(?:t\s*=\s*(?P<time>{_NUMBER})\s*s?\s*[:,]?\s*(?P<action>{_NUMBER})|(?P<key>[a-z]+)\s*=?\s*(?P<value>{_NUMBER})"
    rf"|(?P<constant>{_NUMBER}))\s*(?:[,;]|(?=\s)|$)"
)
_OTHERS = "*"
_ROUNDING = 1e-6
_KEYS = ("mean", "amplitude", "hz", "phase", "from", "until")


@dataclass(frozen=True)
class Track:
    """Motion of one group."""

    waypoints: tuple[tuple[float, float], ...]
    """Times [s] and actions, in ascending order of time; the first action holds before them, the last one after
    them."""
    amplitude: float = 0.0
    frequency_hz: float = 0.0
    phase_rad: float = 0.0
    """Phase of the sine at time 0 [rad]."""
    from_s: float = 0.0
    until_s: float = math.inf
    """The sine is added from `from_s` until this time [s]."""

    def at(self, time_s: FloatArray | float) -> FloatArray:
        """Return the actions at the given times, in the shape of `time_s`, -1 to 1."""
        return np.asarray(np.clip(self.unclipped(time_s), -1.0, 1.0))

    def unclipped(self, time_s: FloatArray | float) -> FloatArray:
        """Return the actions of `at` before they are clipped."""
        times, actions = zip(*self.waypoints, strict=True)
        base = np.interp(time_s, times, actions)
        on = (np.asarray(time_s) >= self.from_s) & (np.asarray(time_s) < self.until_s)
        swing = self.amplitude * np.sin(2 * np.pi * self.frequency_hz * np.asarray(time_s) + self.phase_rad)
        return np.asarray(base + np.where(on, swing, 0.0))


@dataclass(frozen=True)
class Script:
    """A parsed script: a track for each group that it names."""

    tracks: dict[str, Track]

    def played_by(self, groups: Sequence[str], rest: FloatArray, control_dt_s: float) -> ScriptPolicy:
        """Return a policy that plays the script.

        Args:
            groups: Names of all groups of the scene, one for each number of an action; the prefix "robot/" may be left
                out.
            rest: Action of each group at rest, (k,).
            control_dt_s: Time between two actions [s].

        Raises:
            UserError: The script names a group that does not exist.
        """
        plain = [name.removeprefix(ROBOT_PREFIX) for name in groups]
        tracks = {name.removeprefix(ROBOT_PREFIX): track for name, track in self.tracks.items()}
        for name in tracks:
            if name != _OTHERS and name not in plain:
                near = closest_name(name, plain)
                hint = f' Did you mean "{near}"?' if near else ""
                raise UserError(f'no group "{excerpt(name)}" in this scene.{hint} Its groups: {", ".join(plain)}')
        others = tracks.get(_OTHERS)
        return ScriptPolicy(
            [
                tracks.get(name) or others or Track(((0.0, float(at_rest)),))
                for name, at_rest in zip(plain, rest, strict=True)
            ],
            control_dt_s,
            unnamed=() if others else tuple(name for name in plain if name not in tracks),
        )


class ScriptPolicy:
    """Plays the tracks of a script in n parallel episodes and ignores the observations.

    Args:
        tracks: Tracks, one for each number of an action.
        control_dt_s: Time between two actions [s].
        unnamed: Groups that the script does not name; they stay at rest.
    """

    def __init__(self, tracks: Sequence[Track], control_dt_s: float, unnamed: tuple[str, ...] = ()) -> None:
        self._tracks, self.control_dt_s, self.unnamed, self._steps = tuple(tracks), control_dt_s, unnamed, 0

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return the next action for each observation, (n, k)."""
        self._steps += 1
        return np.tile(self.at((self._steps - 1) * self.control_dt_s), (len(observation), 1))

    def cut_off(self, groups: Sequence[str], until_s: float) -> tuple[str, ...]:
        """Return a clause for each group whose requested action exceeds -1 or 1 and is clipped.

        Args:
            groups: Names of the groups, one for each number of an action.
            until_s: Duration of the motion [s].
        """
        times = self.control_dt_s * np.arange(max(1, round(until_s / self.control_dt_s)), dtype=np.float64)
        clauses = []
        for name, track in zip(groups, self._tracks, strict=True):
            requested = track.unclipped(times)
            beyond = np.abs(requested) > 1.0 + _ROUNDING
            if beyond.any():
                farthest = float(requested[np.abs(requested).argmax()])
                clauses.append(
                    f"{name.removeprefix(ROBOT_PREFIX)} is asked for {farthest:+.3g}, cut off at "
                    f"{math.copysign(1, farthest):+g}, {beyond.mean():.0%} of the time"
                )
        return tuple(clauses)

    def at(self, time_s: FloatArray | float) -> FloatArray:
        """Return the action at a time, (k,), or at several, (n,) -> (n, k)."""
        return np.stack([track.at(time_s) for track in self._tracks], axis=-1)


def script_policy(scene: TaskScene, script: str | Script) -> ScriptPolicy:
    """Return a policy that plays a script in a scene from the start of an episode.

    Args:
        scene: The scene.
        script: The script, or its text.

    Raises:
        UserError: The text is not a script, or names a group that the scene does not have.
    """
    read = parse_script(script) if isinstance(script, str) else script
    names = [group.name for group in scene.actions.groups]
    return read.played_by(names, scene.actions.rest, scene.task.control_dt_s)


def read_script(path: Path) -> str:
    """Return the text of a script file.

    Raises:
        UserError: The file does not exist, or does not contain a script.
    """
    try:
        text = read_text_file(path, max_bytes=_MAX_CHARACTERS)
    except FileNotFoundError:
        raise UserError(f"script not found: {path}; give a file with a motion script (docs/tools.md)") from None
    except OSError as error:
        raise UserError(
            f"cannot read {path} as a script: {error.strerror}; give a file with a motion script (docs/tools.md)"
        ) from None
    try:
        parse_script(text)
    except UserError as error:
        raise UserError(f"{path} is no script: {error}") from None
    return text


def parse_script(text: str) -> Script:
    """Return the script that a text contains.

    Raises:
        UserError: The text is not a script; the message gives the line and the reason.
    """
    if len(text) > _MAX_CHARACTERS:
        raise UserError(f"the script has {len(text):,} characters; use at most {_MAX_CHARACTERS:,}")
    tracks: dict[str, Track] = {}
    for number, line in enumerate(text.splitlines(), 1):
        stripped = line.partition("#")[0].strip()
        if not stripped:
            continue
        name, colon, terms = stripped.rpartition(": ") if ": " in stripped else stripped.rpartition(":")
        if not colon or not name.strip():
            raise UserError(
                f'line {number} of the script has no group: "{excerpt(stripped)}"; write "group: t=0 -1, t=1 0.5"'
            )
        if name.strip() in tracks:
            raise UserError(f'line {number} of the script: group "{excerpt(name.strip())}" has a line already')
        tracks[name.strip()] = _track(terms, number)
    if not tracks:
        raise UserError(f"the script is empty. {GRAMMAR}")
    return Script(tracks)


def _track(text: str, line: int) -> Track:
    """Return the track that a line describes.

    Raises:
        UserError: A part of the line cannot be read.
    """
    waypoints: list[tuple[float, float]] = []
    given: dict[str, float] = {}
    at = 0
    while at < len(text.rstrip()):
        term = _TERM.match(text, at)
        if term is None:
            raise UserError(f'line {line} of the script: cannot read "{excerpt(text[at:].strip())}". {GRAMMAR}')
        at = term.end()
        if term["time"]:
            waypoints.append((float(term["time"]), float(term["action"])))
            continue
        key, value = term["key"] or "mean", float(term["value"] or term["constant"])
        if key not in _KEYS:
            raise UserError(f'line {line} of the script: unknown word "{excerpt(key)}"; words: t=, {", ".join(_KEYS)}')
        if key in given:
            raise UserError(f'line {line} of the script: "{key}" is given twice')
        given[key] = value
    return _checked(waypoints, given, line)


def _checked(waypoints: list[tuple[float, float]], given: dict[str, float], line: int) -> Track:
    where = f"line {line} of the script"
    if waypoints and "mean" in given:
        raise UserError(f"{where} has both waypoints and a mean; leave the mean out")
    if len(waypoints) > _MAX_WAYPOINTS:
        raise UserError(f"{where} has {len(waypoints)} waypoints; use at most {_MAX_WAYPOINTS}")
    times = [time_s for time_s, _ in waypoints]
    if times != sorted(set(times)) or (times and times[0] < 0):
        raise UserError(f"{where}: times of waypoints must rise from 0 or later")
    if not waypoints and not given:
        raise UserError(f"{where} says nothing of its group. {GRAMMAR}")
    if ("amplitude" in given) != ("hz" in given):
        raise UserError(f"{where}: a sine needs both amplitude and hz")
    numbers = [*given.values(), *(number for waypoint in waypoints for number in waypoint)]
    if not all(math.isfinite(number) and abs(number) <= 1e6 for number in numbers):
        raise UserError(f"{where} has a number that is not finite or too large")
    return Track(
        waypoints=tuple(waypoints) or ((0.0, given.get("mean", 0.0)),),
        amplitude=given.get("amplitude", 0.0),
        frequency_hz=given.get("hz", 0.0),
        phase_rad=math.radians(given.get("phase", 0.0)),
        from_s=given.get("from", 0.0),
        until_s=given.get("until", math.inf),
    )


def script_of(motion: Motion) -> str:
    """Return a motion of the probe as a script, a line for each group."""
    lines = []
    for group in motion.groups:
        line = f"{group.group.removeprefix(ROBOT_PREFIX)}: {group.first:g}"
        if group.first != group.last:
            times = f"t={motion.begin_s:.4g}", f"t={motion.begin_s + motion.ramp_s:.4g}"
            line = f"{group.group.removeprefix(ROBOT_PREFIX)}: {times[0]} {group.first:g}, {times[1]} {group.last:g}"
        if group.amplitude:
            frequency = group.frequency_hz or motion.frequency_hz
            line += f"; amplitude {group.amplitude:.3g} hz {frequency:.4g} phase {math.degrees(group.phase_rad):.1f}"
        lines.append(line)
    return "\n".join(lines)
