"""Response of a robot to random gaits: heading drift, velocity and first contacts."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tools.measured import Figure, Measured
from aidsr.tools.scene import MeasuredScene

if TYPE_CHECKING:
    from aidsr.tools.recording import Recording

_LIMITS = Limits(wall_s=1800.0, cpu_s=900.0)
MOST_GAITS = 64


@isolated(limits=_LIMITS)
def random_gaits(
    scene: MeasuredScene, *, gaits: int = 12, seconds: float = 4.0, seed: int = 0, variation: int = 0
) -> Measured:
    """Play random gaits and measure heading drift, velocity and first contacts.

    A gait is a sinusoid with its own frequency for each actuator group; some groups stay at rest. A robot that turns
    under most gaits loses its way before it learns. A robot that moves in the right direction under any gait has a
    passive property that helps learning.

    Args:
        scene: The scene.
        gaits: Number of gaits.
        seconds: Duration of each gait [s].
        seed: Seed of the random generator.
        variation: Index of the development variation.

    Raises:
        UserError: A number is out of range, or the scene does not belong to its task.
        MjcfError: The scene cannot be loaded.
        IsolationError: The measurement exceeded a limit.
    """
    import numpy as np

    from aidsr.core.errors import UserError
    from aidsr.learn.openloop.motion import Motions, OpenLoopPolicy
    from aidsr.learn.openloop.motion_search import MotionSpace
    from aidsr.learn.openloop.script import script_of
    from aidsr.tools.playing import record

    if not (1 <= gaits <= MOST_GAITS and seconds > 0):
        raise UserError(f"gaits must be 1 to {MOST_GAITS} and seconds above 0: {gaits}, {seconds:g}")
    loaded = scene.load()
    space = MotionSpace(loaded.actions.rest, seconds)
    drawn = space.motions(space.sample("gait", gaits, np.random.default_rng(seed)))
    motions = [drawn.motion(index, [group.name for group in loaded.actions.groups]) for index in range(gaits)]
    found = [
        record(
            loaded,
            OpenLoopPolicy(Motions.of([motion]), loaded.task.control_dt_s),
            variation=variation,
            seconds=seconds,
        )
        for motion in motions
    ]
    headings = np.array([abs(one.heading_deg) for one in found])
    velocity = 1000 * np.array([one.mean_velocity_m_s for one in found])
    gained = np.array([one.moments[-1].progress - one.moments[0].progress for one in found])
    best = int(gained.argmax())
    mean, spread = velocity.mean(axis=0), velocity.std(axis=0)
    figures = (
        Figure(name="heading drift, median", value=float(np.median(headings)), unit="deg"),
        Figure(name="heading drift, largest", value=float(headings.max()), unit="deg"),
        *(
            Figure(name=f"mean velocity {axis}", value=float(v), unit="mm/s")
            for axis, v in zip("xyz", mean, strict=True)
        ),
        Figure(name="progress gained, mean", value=float(gained.mean())),
        Figure(name="progress gained, best", value=float(gained[best])),
    )
    lines = (
        f"{gaits} gaits of {seconds:g} s, seed {seed}, development variation {variation}; some groups at rest in each",
        "standard deviation of the velocity over the gaits: " + " ".join(f"{each:.0f}" for each in spread) + " mm/s",
        f"{int((gained > 0.005).sum())} of {gaits} gained progress, {int((gained < -0.005).sum())} lost some",
        _first_touches(found),
        _ends(found),
        f"the gait that gained most ({gained[best]:+.2f}), as a script:",
        script_of(motions[best]),
    )
    return Measured(figures=figures, lines=tuple(line for line in lines if line))


def _first_touches(found: list[Recording]) -> str:
    """Return a line on the first contacts of the gaits, without contacts that exist at the start."""
    firsts: Counter[str] = Counter()
    times: dict[str, list[float]] = {}
    for one in found:
        new = [touch for touch in one.touches if not touch.at_start]
        if new:
            firsts[f"{new[0].geom} by {new[0].bodies[0]}"] += 1
            times.setdefault(f"{new[0].geom} by {new[0].bodies[0]}", []).append(new[0].first_s)
    told = [f"{what} {count} times (first at {min(times[what]):.1f} s)" for what, count in firsts.most_common(4)]
    return "touched first, beside what it stands on: " + (", ".join(told) or "nothing")


def _ends(found: list[Recording]) -> str:
    """Return a line on why gaits ended early; empty where none did."""
    ends = Counter(one.ended for one in found if not one.ended.startswith(("all that", "the task's time")))
    return "ended early: " + "; ".join(f"{count} x {words}" for words, count in ends.most_common()) if ends else ""
