"""Motion scripts: what each group of actuators does over time, as a few lines of text that are parsed, never executed.

left legs:  mean 0.2 amplitude 0.5 hz 1.5 phase 90
right legs: mean 0.2 amplitude 0.5 hz 1.5 phase 270
neck:       t=0 -1, t=1 0.8, t=3 -0.2
jaw:        t=0 -1, t=2 1 amplitude 0.1 hz 4 from 2 until 6
*:          -1

Lines may stand in blocks, between which the task's features decide:

when f7 > 0 and f3 < 0.05 for 12 s:
reach: t=0 -1, t=1 -0.45
otherwise:
reach: -1
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from aidsr.core.errors import UserError
from aidsr.core.formatting import excerpt
from aidsr.core.text_files import read_text_file
from aidsr.learn.openloop.motion import Motion
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.tasks.readings import BoolArray, FloatArray

GRAMMAR = """\
A line "group: ..." for each group, "*" for all without a line of their own; what has none, of the environment too, \
stays where its command is nearest to 0. Actions are -1 to 1 over the control range: waypoints with straight lines \
between ("t=0 -1, t=1.5 0.8": seconds, action), or one number; on top, if wanted, a sine, \
"-0.2, amplitude 0.5 hz 1.5 phase 90" (degrees), perhaps only "from 2 until 6" seconds. Sums are cut off at -1 and 1. \
The lines may stand in blocks, each under its own line "when f7 > 0 and f3 < 0.05 for 12 s:", the last under \
"otherwise:"; f7 is the 7th number that the job observes. The first block whose condition holds is played, its time \
from 0; after its 12 s, if given, a block is chosen again."""

_MAX_CHARACTERS = 10_000
_MAX_WAYPOINTS = 100
"""Our choice: more than a handwritten motion needs."""
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_TERM = re.compile(
    rf"\s*(?:t\s*=\s*(?P<time>{_NUMBER})\s*s?\s*[:,]?\s*(?P<action>{_NUMBER})|(?P<key>[a-z]+)\s*=?\s*(?P<value>{_NUMBER})"
    rf"|(?P<constant>{_NUMBER}))\s*(?:[,;]|(?=\s)|$)"
)
OTHERS = "*"
"""Name of the line for all groups without a line of their own."""
_HEADED = re.compile(r"(?:when|otherwise)(?=[\s:]|$)")
_HEADING = re.compile(rf"(?:when\s+(?P<conditions>.+?)|otherwise)\s*(?:\bfor\s+(?P<duration>{_NUMBER})\s*s?)?\s*:")
_CONDITION = re.compile(rf"\s*f(\d{{1,4}})\s*([<>])\s*({_NUMBER})\s*")
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
class Condition:
    """Comparison of one number of a task's features with a limit."""

    feature: int
    """Which number it is, from 1."""
    is_above: bool
    """Whether the number must be above the limit, or below it."""
    limit: float
    """Limit in the unit of the feature."""

    def holds(self, features: NDArray[np.floating]) -> BoolArray:
        """Return whether it holds for the features of each episode, (n, f) -> (n,)."""
        values = features[:, self.feature - 1]
        return np.asarray(values > self.limit if self.is_above else values < self.limit)


@dataclass(frozen=True)
class Block:
    """Lines of a script that are played together: a track for each group that they name."""

    line: int
    """Number of its first line, which is its heading unless the script has no blocks."""
    heading: str = ""
    """Its condition as it is written, or "otherwise"; "" in a script without blocks."""
    conditions: tuple[Condition, ...] = ()
    """All must hold where the block is chosen; there are none in the last block."""
    duration_s: float = math.inf
    """Time after which a block is chosen again [s]; infinite for the rest of the episode."""
    tracks: dict[str, Track] = field(default_factory=dict)

    def holds(self, features: NDArray[np.floating]) -> BoolArray:
        """Return whether all conditions hold for the features of each episode, (n, f) -> (n,)."""
        held = np.ones(len(features), dtype=np.bool_)
        for condition in self.conditions:
            held &= condition.holds(features)
        return held


@dataclass(frozen=True)
class Script:
    """A parsed script: its blocks in order, or one block for a script without blocks."""

    blocks: tuple[Block, ...]


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
    blocks: list[Block] = []
    for number, line in enumerate(text.splitlines(), 1):
        stripped = line.partition("#")[0].strip()
        if not stripped:
            continue
        if _HEADED.match(stripped):
            blocks.append(_block(stripped, number, blocks))
            continue
        blocks = blocks or [Block(number)]
        tracks = blocks[-1].tracks
        name, colon, terms = stripped.rpartition(": ") if ": " in stripped else stripped.rpartition(":")
        if not colon or not name.strip():
            raise UserError(
                f'line {number} of the script has no group: "{excerpt(stripped)}"; write "group: t=0 -1, t=1 0.5"'
            )
        if name.strip() in tracks:
            raise UserError(f'line {number} of the script: group "{excerpt(name.strip())}" has a line already')
        tracks[name.strip()] = _track(terms, number)
    if not blocks:
        raise UserError(f"the script is empty. {GRAMMAR}")
    _check_filled(blocks[-1])
    if blocks[-1].conditions:
        raise UserError(
            f'line {blocks[-1].line} of the script: the last block is not "otherwise"; end the script with '
            '"otherwise:" and lines for all other cases'
        )
    return Script(tuple(blocks))


def _block(heading: str, line: int, before: list[Block]) -> Block:
    """Return the block that a heading begins, without its lines.

    Raises:
        UserError: The heading cannot be read, or no block may begin here.
    """
    where = f"line {line} of the script"
    found = _HEADING.fullmatch(heading)
    parts = re.split(r"\band\b", found["conditions"]) if found and found["conditions"] else []
    terms = [_CONDITION.fullmatch(part) for part in parts]
    if found is None or None in terms:
        raise UserError(
            f'{where}: cannot read "{excerpt(heading)}"; write "when f3 > 0.05 and f4 < 1:", "otherwise:" or, with a '
            'duration, "otherwise for 12 s:", and the lines of groups below'
        )
    if before:
        _check_filled(before[-1])
        if not before[-1].heading:
            raise UserError(
                f"line {before[-1].line} of the script stands before the first block; move it into each block that "
                "needs it"
            )
        if not before[-1].conditions:
            raise UserError(
                f'{where}: a block after "otherwise" (line {before[-1].line}) is never played; keep one "otherwise", '
                "as the last block"
            )
    conditions = tuple(Condition(int(term[1]), term[2] == ">", float(term[3])) for term in terms if term)
    duration_s = float(found["duration"] or math.inf)
    if duration_s <= 0:
        raise UserError(f"{where}: a duration of {duration_s:g} s; give one above 0, or none")
    return Block(line, (found["conditions"] or "otherwise").strip(), conditions, duration_s)


def _check_filled(block: Block) -> None:
    if not block.tracks:
        raise UserError(
            f'line {block.line} of the script: the block has no lines; write "group: t=0 -1, t=1 0.5" below it'
        )


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
