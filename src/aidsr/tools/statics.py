"""Static measurements of a robot: bending by each actuator, sag, stiffness and distances between parts."""

from __future__ import annotations

from collections.abc import Sequence

from aidsr.core.artifacts import Vec3
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tools.measured import Figure, Measured
from aidsr.tools.scene import MeasuredScene

_LIMITS = Limits(wall_s=600.0, cpu_s=300.0)
_MOST_LINES = 30
_MOST_TOUCHED = 3
"""Number of contacts listed in a line, largest forces first. Our choice."""


@isolated(limits=_LIMITS)
def bends(subject: MeasuredScene, *, pull: float = 1.0) -> Measured:
    """Measure the effect of each actuator alone on the resting robot: force, tip movement, angle and new contacts.

    The tip is that of the body that moves farthest relative to the robot's root.

    Args:
        subject: Scene, or robot alone.
        pull: Share of the control range, 0 to 1, from the neutral control to the end that pulls.

    Raises:
        UserError: The simulation diverged.
        MjcfError: The model cannot be loaded.
        IsolationError: The measurement exceeded a limit.
    """
    from aidsr.tools.resting import Resting, tip_of

    robot = Resting.of(subject)
    before = robot.touches()
    lines, angles, ways = [], [], []
    for drive in robot.drives:
        moved = robot.pulled(drive, pull)
        body = robot.farthest(moved)
        way = moved.position_m(tip_of(robot.model, body), body) - robot.position_m(tip_of(robot.model, body), body)
        angle_deg = moved.turned_deg(robot, body)
        angles.append(angle_deg)
        ways.append(float((way**2).sum() ** 0.5))
        x, y, z = (1000 * float(value) for value in way)
        still = "" if moved.at_rest else ", still moving"
        touched = [words for pair, words in moved.touches().items() if pair not in before]
        lines.append(
            f"{robot.actuator_name(drive)}: {moved.exerts(drive)}; {robot.body_name(body)} tip moves {x:+.1f} "
            f"{y:+.1f} {z:+.1f} mm and turns {angle_deg:.1f} deg{still}" + _touched(touched)
        )
    figures = (
        Figure(name="largest bend", value=max(angles, default=0.0), unit="deg"),
        Figure(name="smallest bend", value=min(angles, default=0.0), unit="deg"),
        Figure(name="largest way of a tip", value=1000 * max(ways, default=0.0), unit="mm"),
    )
    left = len(lines) - _MOST_LINES
    more = [f"{left} more actuators"] * (left > 0)
    axes = "Ways are in the axes of the robot's root; each actuator alone, from where the robot rests."
    axes += f" There it {_touched(list(before.values())).removeprefix('; ')}." if before else ""
    return Measured(figures=figures, lines=(axes, *lines[:_MOST_LINES], *more))


def _touched(words: Sequence[str]) -> str:
    """Return a clause with the contacts, to be appended to a line; empty without contacts."""
    left = len(words) - _MOST_TOUCHED
    return f"; touches {', '.join(words[:_MOST_TOUCHED])}{f' and {left} more' if left > 0 else ''}" if words else ""


@isolated(limits=_LIMITS)
def load(subject: MeasuredScene, part: str, *, force_n: float = 0.5, direction: Vec3 = (0.0, 0.0, -1.0)) -> Measured:
    """Measure the sag of a part under the robot's own weight, and its displacement and stiffness under a force.

    Args:
        subject: Scene, or robot alone.
        part: Body or site of the robot.
        force_n: Size of the force on the part [N].
        direction: Direction of the force in world axes, or in the axes of the root of a robot alone, as it rests; of
            any length.

    Raises:
        UserError: There is no such part, the direction is zero, or the simulation diverged.
        MjcfError: The model cannot be loaded.
        IsolationError: The measurement exceeded a limit.
    """
    import numpy as np

    from aidsr.core.errors import UserError
    from aidsr.sim.ownership import read_ownership
    from aidsr.tools.resting import Resting, point_of

    length = float(np.linalg.norm(direction))
    if not (length > 0 and np.isfinite(length) and force_n > 0):
        raise UserError("a load needs a force above 0 N and a direction other than zero")
    robot = Resting.of(subject)
    body, point = point_of(robot.model, part)
    drawn = robot.drawn_world_m(point, body)
    rest = robot.world_m(point, body)
    is_scene = read_ownership(robot.model).is_scene
    axes = np.eye(3) if is_scene else robot.data.xmat[robot.structure.roots[0]].reshape(3, 3)  # columns, in the world
    along = axes @ np.array(direction) / length
    pushed = robot.pushed(point, body, force_n * along)
    given_m = float((pushed.world_m(point, body) - rest) @ along)
    sag = axes.T @ (rest - drawn)
    figures = (
        Figure(name="sag", value=1000 * float(np.linalg.norm(sag)), unit="mm"),
        Figure(name="gives", value=1000 * given_m, unit=f"mm under {force_n:g} N"),
        Figure(name="stiffness", value=force_n / given_m if given_m > 1e-9 else float("inf"), unit="N/m"),
        Figure(name="turns", value=pushed.turned_deg(robot, body), unit="deg"),
    )
    x, y, z = (1000 * float(value) for value in sag)
    lines = [
        f"sag is from where {part} is drawn to where it rests with nothing pulled: {x:+.1f} {y:+.1f} {z:+.1f} mm "
        f"in {'world axes' if is_scene else 'the axes of the root'}"
    ]
    lines += [] if robot.at_rest and pushed.at_rest else ["it was still moving when it was measured"]
    return Measured(figures=figures, lines=tuple(lines))


@isolated(limits=_LIMITS)
def clearances(subject: MeasuredScene, pairs: Sequence[tuple[str, str]]) -> Measured:
    """Measure distances between named elements, in the initial pose and at rest without actuation.

    Args:
        subject: Scene, or robot alone.
        pairs: Names of two sites, geoms or bodies each; distances of geoms and bodies are those of their surfaces.

    Raises:
        UserError: A name is unknown, nothing can be measured between the two, or the simulation diverged.
        MjcfError: The model cannot be loaded.
    """
    from aidsr.core.errors import UserError
    from aidsr.tools.distances import distance_m, find_pairs
    from aidsr.tools.resting import Resting

    if not pairs:
        raise UserError("no pairs of names given; name two sites, geoms or bodies")
    robot = Resting.of(subject)
    figures, lines = [], []
    for first, second in find_pairs(robot.model, pairs):
        drawn, rest = (distance_m(robot.model, data, first, second) for data in (robot.drawn, robot.data))
        figures.append(Figure(name=f"{first.name} to {second.name}", value=1000 * rest, unit="mm"))
        lines.append(f"{first.name} to {second.name}: {1000 * drawn:.1f} mm as drawn, {1000 * rest:.1f} mm at rest")
    return Measured(figures=tuple(figures), lines=tuple(lines))
