"""Readings written by hand: what a task would see in a state that nobody has to play."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from stick import Episode

from aidsr.tasks import Readings, load_task
from aidsr.tasks.readings import Outline

NORMALS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@cache
def first(name: str, level: str = "standard") -> Readings:
    """What a task reads as its first episode begins."""
    return Episode(load_task(name, level)).look()


def altered(seen: Readings, sensors: dict, **fields) -> Readings:
    """Readings of one simulation with other numbers in some sensors and other fields.

    Args:
        seen: What they are like elsewhere.
        sensors: By name, the newest sample, or all samples as (1, s, k).
        fields: Of `Readings`; a single `time_s` will do.
    """
    samples = {name: np.asarray(value, dtype=float) for name, value in sensors.items()}
    shaped = {name: value if value.ndim == 3 else value.reshape(1, 1, -1) for name, value in samples.items()}
    if "time_s" in fields:
        fields["time_s"] = np.array([fields["time_s"]], dtype=float)
    return replace(seen, sensors={**seen.sensors, **shaped}, **fields)


def slots(*contacts: tuple[float, tuple[float, float, float]], count: int = 4) -> np.ndarray:
    """One sample of a contacts sensor from pairs of force and normal."""
    data = np.zeros((count, 10))
    for row, (force_n, normal) in zip(data, contacts, strict=False):
        row[0], row[1], row[7:] = len(contacts), force_n, normal
    return data.reshape(1, 1, -1)


def touches(*forces_n: float) -> np.ndarray:
    """One sample of a contacts sensor with these forces, the first three at right angles to each other."""
    return slots(*zip(forces_n, NORMALS * 3, strict=False), count=8)


def outlined(seen: Readings, center_m) -> Readings:
    """Readings with other places for the balls of the outline, evenly shared and as thick as the stick."""
    center_m = np.asarray(center_m, dtype=float)
    count = len(center_m)
    return replace(seen, outline=Outline(center_m[None], np.full(count, 0.008), np.full(count, 1.0 / count)))


def stacked(several: Sequence[Readings]) -> Readings:
    """Readings of some simulations as those of all side by side; one sample stands for as many as others have."""
    count = max(samples.shape[1] for one in several for samples in one.sensors.values())

    def long(samples: np.ndarray) -> np.ndarray:
        return np.repeat(samples, count, axis=1) if samples.shape[1] == 1 else samples

    outlines = [one.outline for one in several]
    return replace(
        several[0],
        sensors={name: np.concatenate([long(one.sensors[name]) for one in several]) for name in several[0].sensors},
        time_s=np.concatenate([one.time_s for one in several]),
        parameters={name: np.concatenate([one.parameters[name] for one in several]) for name in several[0].parameters},
        outline=outlines[0]
        and replace(outlines[0], center_m=np.concatenate([outline.center_m for outline in outlines])),
    )
