"""Time series of a motion, shown as tracks below a view: cables, commands, contacts, progress, and events."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aidsr.apps.web.view3d.motions import Array, Motion

_MOST_POINTS = 600
"""Maximum number of evenly spaced points of a line. Our choice: about one for each column of pixels."""
_PEAK_NEWTON = 0.05
"""Contact is shown as an event only if its force exceeds this. Our choice: the weight of 5 g."""


def tracks_of(motion: Motion, facts: dict[str, Any]) -> dict[str, Any]:
    """Return the tracks of a motion.

    Args:
        motion: The motion.
        facts: Data of its model, as sent to a viewer.
    """
    frames = len(motion.qpos)
    contact_n = _contact_n(motion)
    hardest = [values for values in (contact_n, _hardest_n(motion)) if values is not None]
    shown = _shown(frames, hardest)
    tracks = []
    if motion.tension_n is not None:
        lines = [(tendon["name"], motion.tension_n[shown, i]) for i, tendon in enumerate(facts["tendons"])]
        tracks.append(_track("cable tension", "N", lines))
    if contact_n is not None:
        tracks.append(_track("contact force", "N", [("all contacts", contact_n[shown])]))
    if motion.progress is not None:
        tracks.append(_track("progress", "", [("progress", motion.progress[shown])], top=1.0))
    if motion.ctrl is not None:
        tracks.append(_track("command", "%", list(_commands(motion.ctrl[shown], facts["controls"])), top=100.0))
    return {
        "times": _rounded(shown * motion.frame_s),
        "tracks": [track for track in tracks if track["lines"]],
        "events": sorted(_events(motion, contact_n), key=lambda event: event["time_s"]),
        "phases": [
            {"name": "touching", "spans": _spans(motion, contact_n)},
            {"name": "goal holds", "spans": _spans(motion, motion.holds)},
        ],
    }


def _shown(frames: int, hardest: Sequence[Array]) -> NDArray[np.intp]:
    """Return the indices of drawn frames: evenly spaced, plus the peaks between them, so that no short peak is lost."""
    edges = np.unique(np.linspace(0, frames - 1, min(frames, _MOST_POINTS)).round().astype(int))
    peaks = [start + int(values[start:end].argmax()) for values in hardest for start, end in itertools.pairwise(edges)]
    return np.unique(np.concatenate([edges, np.array(peaks, int)]))


def _hardest_n(motion: Motion) -> Array | None:
    """Return the highest tension of any tendon in each frame [N]; None where it is unknown or there is no tendon."""
    return None if motion.tension_n is None or not motion.tension_n.size else motion.tension_n.max(axis=1)


def _contact_n(motion: Motion) -> Array | None:
    """Return the sum of the magnitudes of all contact forces in each frame [N]; None where they are unknown."""
    if motion.contacts is None:
        return None
    at, size = motion.contacts[:, 0].astype(int), np.linalg.norm(motion.contacts[:, 4:], axis=1)
    return np.asarray(np.bincount(at, size, minlength=len(motion.qpos))[: len(motion.qpos)], float)


def _commands(ctrl: Array, controls: Sequence[dict[str, Any]]) -> Iterator[tuple[str, Array]]:
    """Yield name and commands of each of the robot's controls, as shares of its range [%]: 0 releases, 100 pulls."""
    for control in controls:
        if control["robot"]:
            span = control["pull"] - control["release"] or 1.0
            yield control["name"], 100.0 * (ctrl[:, control["at"]] - control["release"]) / span


def _track(name: str, unit: str, lines: Sequence[tuple[str, Array]], top: float = 0.0) -> dict[str, Any]:
    low = min([0.0, *(float(values.min()) for _, values in lines)])
    high = max([top, 1e-9, *(float(values.max()) for _, values in lines)])
    drawn = [{"name": line, "values": _rounded(values)} for line, values in lines]
    return {"name": name, "unit": unit, "low": low, "high": high, "lines": drawn}


def _events(motion: Motion, contact_n: Array | None) -> Iterator[dict[str, Any]]:
    if contact_n is not None and contact_n.max(initial=0.0) > _PEAK_NEWTON:
        yield _event(motion, int(np.flatnonzero(contact_n)[0]), "first contact")
        yield _event(motion, int(contact_n.argmax()), f"peak contact force, {contact_n.max():.3g} N")
    hardest = _hardest_n(motion)
    if hardest is not None:
        yield _event(motion, int(hardest.argmax()), f"peak tension, {hardest.max():.3g} N")
    if motion.progress is not None and motion.progress.max(initial=0.0) > 0:
        yield _event(motion, int(motion.progress.argmax()), f"best progress, {motion.progress.max():.2f}")
    if motion.holds is not None and motion.holds.max(initial=0.0) > 0:
        yield _event(motion, int(np.flatnonzero(motion.holds)[0]), "goal first holds")
    if motion.ended:
        yield _event(motion, len(motion.qpos) - 1, motion.ended.replace("_", " "))


def _event(motion: Motion, frame: int, label: str) -> dict[str, Any]:
    return {"time_s": round(frame * motion.frame_s, 4), "label": label}


def _spans(motion: Motion, values: Array | None) -> list[list[float]]:
    """Return the intervals in which values are above zero, each as start and end [s]."""
    if values is None:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[0], values > 0, [0]]).astype(int)))
    return [_rounded(pair * motion.frame_s) for pair in edges.reshape(-1, 2)]


def _rounded(numbers: NDArray[np.floating]) -> list[float]:
    return [round(float(number), 4) for number in numbers]
