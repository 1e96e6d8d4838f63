"""Pictures of a training: the learning curve, and two of the held-out episodes as videos and as recordings."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from aidsr.core.plots import png_plot
from aidsr.learn.episodes.policy_checks import EvaluationRollout
from aidsr.learn.episodes.varied_mjcf import varied_mjcf
from aidsr.render.pictures import video

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_FRAMES = 400
"""Maximum number of frames of one video; longer episodes show every second or third control step. Our choice: about 15
s of rendering."""


def curve_picture(curve: Path) -> bytes:
    """Return a training's curve.csv as a PNG plot: success, progress and return over control steps."""
    with curve.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    column = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]} if rows else {}
    steps = column.get("steps", np.zeros(0))

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        for name, label in (("success_share", "success"), ("progress", "progress at the end")):
            left.plot(steps, column.get(name, steps), label=label)
        left.set(xlabel="control steps", ylabel="last episodes", ylim=(-0.02, 1.02))
        left.legend()
        right.plot(steps, column.get("reward", steps))
        right.set(xlabel="control steps", ylabel="return")
        for axes in (left, right):
            axes.ticklabel_format(axis="x", scilimits=(0, 0))

    return png_plot(draw, (7.0, 3.2))


def episode_recordings(mjcf: str, rolled: EvaluationRollout, control_dt_s: float) -> dict[str, bytes]:
    """Return the best and the median episode by return as recordings that a viewer can show from any side, by name.

    Each is an .npz archive without pickled objects: `qpos` (n_frames, nq), `frame_s`, the time between two of its rows
    [s], `variation`, the index of the held-out variation, and `mjcf`, the scene with the objects that this variation
    moved or resized changed.
    """
    recorded = {}
    for name, index in _chosen(rolled).items():
        archive = io.BytesIO()
        np.savez_compressed(
            archive,
            qpos=rolled.stats.qpos[index].astype(np.float32),  # precise enough for viewing, half the size of float64
            frame_s=np.float64(control_dt_s),
            variation=np.int64(index),
            mjcf=np.array(varied_mjcf(mjcf, rolled.variations[index])),
        )
        recorded[name] = archive.getvalue()
    return recorded


def episode_videos(mjcf: str, rolled: EvaluationRollout, control_dt_s: float) -> dict[str, bytes]:
    """Return the best and the median episode by return as MP4 videos, by name; an empty dict without OpenGL."""
    drawn = {}
    for name, index in _chosen(rolled).items():
        qpos = rolled.stats.qpos[index]
        every = max(1, -(-len(qpos) // _MOST_FRAMES))
        scene = varied_mjcf(mjcf, rolled.variations[index])
        film = video(scene, qpos=qpos[::every].tolist(), frames_per_s=1.0 / (control_dt_s * every))
        if film is not None:
            drawn[name] = film
    return drawn


def _chosen(rolled: EvaluationRollout) -> dict[str, int]:
    """Return the indices of the episodes that are shown, by their rank among the others."""
    order = np.argsort(rolled.outcomes.reward)
    return {"best": int(order[-1]), "median": int(order[(len(order) - 1) // 2])}
