"""Recording of one episode and its description: path, heading, contacts, distances, stages, reason of its end."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from aidsr.core.artifacts import Artifact, ExceededLimit, Vec3
from aidsr.core.formatting import format_number
from aidsr.tools.measured import Figure, format_value

_ROWS = 9
"""Number of rows in the table of the text."""
_MOST_CONTACTS = 10
_MOST_BODIES = 3
"""Numbers of contacts, and of bodies for each contact, in the text. Our choice: readable."""
_AT_ONCE_S = 0.05
"""Time within which a first contact is described as "at the start": one control step."""
_DELICATE = "too delicate to rely on: give it more clearance, or steadier contact"
_SAME_M = 5e-6
"""Overlaps that differ by less are described as equal. Our choice: the text has hundredths of a millimetre."""


class Touch(Artifact):
    """Contact of the robot with one geom of the environment over an episode."""

    geom: str
    """Name of the geom, or of its body where it has no name."""
    bodies: tuple[str, ...]
    """Bodies of the robot that touched it, in the order of their first contact."""
    first_s: float
    """Time of the first contact."""
    share: float
    """Share of the control steps with contact."""
    mean_n: float
    """Mean of the total normal force over the control steps with contact."""
    peak_n: float
    """Largest total normal force at a control step."""
    peak_s: float
    """Time of the largest force."""
    peak_by: str
    """Body of the robot with the largest share of the largest force."""
    at_start: bool
    """Whether it was touched within 0.3 s, such as the surface on which the robot was placed."""


class Distance(Artifact):
    """Distance between two named sites, geoms or bodies over an episode."""

    first: str
    second: str
    start_m: float
    least_m: float
    least_s: float
    end_m: float


class ConditionValue(Artifact):
    """A quantity in the conditions of the task's stages, with its limit."""

    name: str
    value: float
    limit: float
    at_least: bool
    unit: str

    @property
    def text(self) -> str:
        """The quantity as a clause, such as "raised by 12 mm (at least 100)"."""
        limit = f"at {'least' if self.at_least else 'most'} {format_value(self.limit)}"
        return f"{self.name} {format_value(self.value)} {self.unit}".rstrip() + f" ({limit})"


class Moment(Artifact):
    """State after a control step."""

    time_s: float
    progress: float
    center_m: Vec3
    """Centre of mass of the robot in the world."""
    heading_deg: float
    """Rotation of the robot's root about the vertical since the start, positive to the left."""
    distances_m: tuple[float, ...]
    """Distances of the requested pairs."""


class Recording(Artifact):
    """Recording of one episode."""

    variation: int
    """Index of the development variation."""
    variation_text: str
    """Description of this variation by the task; empty where nothing varies."""
    ended: str
    """Reason of its end, in words."""
    succeeded: bool
    best_progress: float
    moments: tuple[Moment, ...]
    """States at the start and after every control step."""
    stages: tuple[tuple[str, float | None], ...]
    """Stages of the task with the time when each was reached [s]; None where it was not reached."""
    touches: tuple[Touch, ...]
    """Contacts with geoms of the environment, in the order of their first contact."""
    self_touch_share: float
    """Share of the control steps with self-contact of the robot."""
    distances: tuple[Distance, ...]
    features: tuple[tuple[str, str, float, float], ...]
    """Observations of the task: name, unit, values at the start and at the end."""
    self_touching: str = ""
    """The two bodies of the robot with the longest self-contact."""
    reached: str = ""
    """Highest stage reached, in words."""
    held_s: float = 0.0
    """Longest uninterrupted time for which the goal was held."""
    hold_s: float = 0.0
    """Time for which the goal must be held."""
    exceeded_limits: tuple[ExceededLimit, ...] = ()
    """Limits of a goal that were exceeded."""
    violation_s: float = 0.0
    """Time in violation of a rule of the task."""
    overlaps: tuple[tuple[str, float, float], ...] = ()
    """Geoms of the environment that overlap with the robot at the start: name, depth in this variation [m], and depth
    in the environment without variation [m]."""
    conditions: tuple[ConditionValue, ...] = ()
    """Quantities in the conditions of the stages, at the time of the best progress."""
    progress_definition: str = ""
    """Definition of progress, where the task is made of a goal."""
    cut_off: tuple[str, ...] = ()
    """Commands of the motion beyond the control range, in clauses."""
    commands: tuple[str, ...] = ()
    """Lines on groups that the script does not name, and on actuators of the environment that it cannot command."""
    blocks: tuple[str, ...] = ()
    """Lines on the blocks of the script in the order in which they were played; empty for a script without blocks."""
    not_valid: tuple[str, ...] | None = None
    """Reasons why a policy that succeeds so is not valid, in clauses; None where not tested."""
    fragile: tuple[str, ...] = ()
    """Numerical variants of the same physics in which the same motion fails, in clauses."""

    @property
    def duration_s(self) -> float:
        """Duration of the episode."""
        return self.moments[-1].time_s

    @property
    def path_m(self) -> float:
        """Length of the path of the centre of mass."""
        points = [moment.center_m for moment in self.moments]
        return sum(_distance(a, b) for a, b in itertools.pairwise(points))

    @property
    def heading_deg(self) -> float:
        """Heading at the end."""
        return self.moments[-1].heading_deg

    @property
    def mean_velocity_m_s(self) -> Vec3:
        """Displacement of the centre of mass / duration."""
        (x0, y0, z0), (x1, y1, z1) = self.moments[0].center_m, self.moments[-1].center_m
        time_s = self.duration_s or 1.0
        return (x1 - x0) / time_s, (y1 - y0) / time_s, (z1 - z0) / time_s

    @property
    def figures(self) -> tuple[Figure, ...]:
        """Numbers by which episodes are compared."""
        vx, vy, vz = (1000 * value for value in self.mean_velocity_m_s)
        return (
            Figure(name="best progress", value=self.best_progress),
            Figure(name="progress at the end", value=self.moments[-1].progress),
            Figure(name="success", value=float(self.succeeded)),
            Figure(name="time", value=self.duration_s, unit="s"),
            Figure(name="mean velocity x", value=vx, unit="mm/s"),
            Figure(name="y", value=vy, unit="mm/s"),
            Figure(name="z", value=vz, unit="mm/s"),
            Figure(name="heading", value=self.heading_deg, unit="deg"),
            self._peak(),
            *(figure for one in self.distances for figure in _distance_figures(one)),
        )

    def _peak(self) -> Figure:
        """Return the largest contact force on a geom of the environment, with its time, body and geom as a note."""
        name, hardest = "peak contact force", max(self.touches, key=lambda touch: touch.peak_n, default=None)
        if hardest is None:
            return Figure(name=name, value=0.0, unit="N")
        note = f"at {format_number(hardest.peak_s)} s, {hardest.peak_by} on {hardest.geom}"
        return Figure(name=name, value=hardest.peak_n, unit="N", note=note)

    def text(self) -> str:
        """Return the description of the episode in at most 45 lines."""
        return "\n".join([*self.account(), *self._features(), *self._table()])

    def account(self) -> list[str]:
        """Return lines on progress, path, contacts, distances and the reason of the end."""
        return [
            f"{format_number(self.duration_s)} s of development variation {self.variation}, best progress "
            f"{self.best_progress:.2f}. Ended: {self.ended}",
            *([f"in this variation: {self.variation_text}"] if self.variation_text else []),
            *self.blocks,
            self._progress(),
            *([f"when progress was best: {self._conditions_text()}"] if self.conditions else []),
            *self._validity(),
            *(f"a limit exceeded: {limit.text}" for limit in self.exceeded_limits),
            *self._violation(),
            *(_overlap_line(*each) for each in self.overlaps),
            *self.cut_off,
            *self.commands,
            self._way(),
            *self._touches(),
            *(_distance_line(one) for one in self.distances),
        ]

    def csv(self) -> str:
        """Return every control step as CSV."""
        names = [f"{one.first} to {one.second} [m]" for one in self.distances]
        head = ["time [s]", "progress", "x [m]", "y [m]", "z [m]", "heading [deg]", *names]
        rows = [
            [moment.time_s, moment.progress, *moment.center_m, moment.heading_deg, *moment.distances_m]
            for moment in self.moments
        ]
        return "\n".join([",".join(head), *(",".join(f"{value:.5g}" for value in row) for row in rows)]) + "\n"

    def _progress(self) -> str:
        best = max(self.moments, key=lambda moment: moment.progress)
        reached = [f'"{words}" at {format_number(at)} s' for words, at in self.stages if at is not None]
        missed = [f'"{words}"' for words, at in self.stages if at is None and not self.succeeded]
        line = f"progress: best {best.progress:.2f} at {format_number(best.time_s)} s, {self.moments[-1].progress:.2f} "
        line += "at the end"
        if self.stages:
            line += f"; reached: {', '.join(reached) or 'no stage'}" + f"; not: {', '.join(missed)}" * bool(missed)
        if self.held_s and not self.succeeded:
            line += f"; held for {self.held_s:.3g} s of {self.hold_s:.3g} s at most"
        if self.progress_definition:
            line += f"; it counts {self.progress_definition[0].lower()}{self.progress_definition[1:].rstrip('.')}"
        return line

    @property
    def phase(self) -> str:
        """Highest stage reached, first limit exceeded, and whether such a policy would be valid, in clauses."""
        held = f", held {self.held_s:.3g} s of {self.hold_s:.3g} s" if self.held_s and not self.succeeded else ""
        exceeded = f"; {self.exceeded_limits[0].text}" if self.exceeded_limits else ""
        told = self.conditions and not self.succeeded
        conditions = f"; when progress was best: {self._conditions_text()}" if told else ""
        return f"{self.reached}{held}{conditions}{exceeded}{self._valid_clause()}"

    def _conditions_text(self) -> str:
        return ", ".join(one.text for one in self.conditions)

    def _valid_clause(self) -> str:
        if self.not_valid is None:
            return ""
        lost = f"; lost {' and '.join(self.fragile)}" if self.fragile else ""
        return (f"; not valid: {' and '.join(self.not_valid)}" if self.not_valid else "; valid") + lost

    def _validity(self) -> list[str]:
        if self.not_valid is None:
            return []
        if self.not_valid:
            told = f"no valid policy wins so: {' and '.join(self.not_valid)}"
        else:
            told = "with slack cables or a locked soft body the same motion fails, as it must for a valid policy"
        return [told, *([f"{_DELICATE}: computed {' and '.join(self.fragile)} it fails"] if self.fragile else [])]

    def _violation(self) -> list[str]:
        told = self.violation_s and not self.exceeded_limits
        return [f"penalized for {self.violation_s:.3g} s"] if told else []

    def _way(self) -> str:
        start, end = self.moments[0].center_m, self.moments[-1].center_m
        vx, vy, vz = (1000 * value for value in self.mean_velocity_m_s)
        headings = [moment.heading_deg for moment in self.moments]
        return (
            f"centre of mass: from {_place(start)} to {_place(end)} m, path {format_number(self.path_m)} m, mean "
            f"velocity {vx:.1f} {vy:.1f} {vz:.1f} mm/s; heading {self.heading_deg:+.1f} deg at the end, between "
            f"{min(headings):+.1f} and {max(headings):+.1f} (left positive)"
        )

    def _touches(self) -> list[str]:
        lines = []
        for touch in self.touches[:_MOST_CONTACTS]:
            more = len(touch.bodies) - _MOST_BODIES
            by = ", ".join(touch.bodies[:_MOST_BODIES]) + (f" and {more} more" if more > 0 else "")
            when = "at the start" if touch.first_s <= _AT_ONCE_S else f"first at {format_number(touch.first_s)} s"
            lines.append(
                f"touches {touch.geom} {when}, {touch.share:.0%} of the time, mean {format_number(touch.mean_n)} N, by "
                f"{by}; peak {format_number(touch.peak_n)} N at {format_number(touch.peak_s)} s by {touch.peak_by}"
            )
        if len(self.touches) > _MOST_CONTACTS:
            lines.append(f"touches {len(self.touches) - _MOST_CONTACTS} more shapes")
        if self.self_touch_share:
            lines.append(f"touches itself {self.self_touch_share:.0%} of the time, mostly {self.self_touching}")
        return lines or ["touches nothing"]

    def _features(self) -> list[str]:
        if not self.features:
            return []
        told = []
        for name, unit, start, end in self.features:
            first, last = format_value(start), format_value(end)
            told.append(f"{name} {first}{f' -> {last}' if last != first else ''} {unit}".rstrip())
        return ["the task observes (start -> end, where it changed): " + "; ".join(told)]

    def _table(self) -> list[str]:
        last = len(self.moments) - 1
        picked = sorted({round(i * last / (_ROWS - 1)) for i in range(_ROWS)})
        head = "time s | progress | x y z m | heading deg"
        head += "".join(f" | {one.first} to {one.second} mm" for one in self.distances)
        rows = [head]
        for moment in (self.moments[index] for index in picked):
            row = f"{moment.time_s:.2f} | {moment.progress:.2f} | {_place(moment.center_m)} | {moment.heading_deg:+.1f}"
            rows.append(row + "".join(f" | {1000 * value:.1f}" for value in moment.distances_m))
        return rows


def validity_in_words(played: Sequence[Recording]) -> str:
    """Return in how many variations a script succeeded, and in which of these such a policy would be valid, in words.

    Args:
        played: Recordings of `play_variations`.
    """
    from aidsr.learn.episodes.plausibility import SURVIVING

    won = [one for one in played if one.succeeded]
    line = f"won {len(won)} of {len(played)}"
    if not won:
        return line
    groups = (
        ("valid", [str(one.variation) for one in won if not one.not_valid]),
        ("not valid", [str(one.variation) for one in won if one.not_valid]),
    )
    told = ", ".join(f"{word} in {', '.join(those)}" for word, those in groups if those)
    line += (
        f". A policy that does the same would be {told}: each that was won is checked for overlap, energy and joint "
        "ranges, and played again with slack cables, with a locked soft body, and without other actuators"
    )
    ways = sorted({how for one in won for how in one.fragile})
    if not ways:
        return line + "; all are won at half the time step and with another integrator as well"
    kept = [(how, sum(how not in one.fragile for one in won)) for how in ways]
    lost = ", ".join(f"{count} of these {len(won)} are won {how}" for how, count in kept)
    few = any(count < SURVIVING * len(won) for _how, count in kept)
    return f"{line}; {lost}" + (f": less than half is not valid ({_DELICATE})" if few else "")


def _distance_figures(one: Distance) -> tuple[Figure, Figure]:
    name = f"{one.first} to {one.second}"
    least = Figure(name=f"least {name}", value=1000 * one.least_m, unit="mm")
    return least, Figure(name="at the end", value=1000 * one.end_m, unit="mm")


def _overlap_line(name: str, deep_m: float, described_m: float) -> str:
    line = f"overlaps {name} by {1000 * deep_m:.3g} mm at the start"
    same = abs(deep_m - described_m) < _SAME_M
    return line if same else f"{line} of this variation, {1000 * described_m:.3g} mm where the environment describes it"


def _distance_line(one: Distance) -> str:
    return (
        f"{one.first} to {one.second}: {1000 * one.start_m:.1f} mm at the start, least {1000 * one.least_m:.1f} mm at "
        f"{format_number(one.least_s)} s, {1000 * one.end_m:.1f} mm at the end"
    )


def _place(point_m: Vec3) -> str:
    return " ".join(f"{value:.3f}" for value in point_m)


def _distance(a: Vec3, b: Vec3) -> float:
    return float(sum((x - y) ** 2 for x, y in zip(a, b, strict=True)) ** 0.5)
