"""Simulation of an environment without a robot: whether its targets rest, and whether anything blocks their motion.

`aidsr.tasks.goals.environment_index` checks the ranges of joints. This module also checks contacts: the target's joint
is swept through the required travel, and pressed against what it meets.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np

from aidsr.core.artifacts import Artifact
from aidsr.core.errors import UserError
from aidsr.mjcf.compile import load_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.sim.divergence import FATAL_WARNINGS
from aidsr.sim.extent import half_width_m
from aidsr.sim.overlap import OVERLAP_SHARE
from aidsr.tasks.variation import Change, Variation, apply_to_simulation

SETTLE_S = 1.0
"""Time for which the environment is simulated without a robot [s]. Our choice: enough for an object to fall over and a
soft contact to sink in."""
MOVED_M, TURNED_DEG = 0.002, 2.0
"""Displacement and turn above which a target moves by itself. Our choice: contacts and play allow this much."""
_MEETS_M = 0.0005
"""Overlap above which a contact is an obstacle [m]. Our choice: above the rounding of written coordinates."""
PRESS_N = 5.0
"""Force that presses a swept joint against an obstacle, at the part farthest from a hinge [N]. Our choice: more than
twice the force of a built-in arm's tip."""
_PRESS_S = 2.0
_SPEED = 1.0
"""Speed of the sweep with contacts, in travels per second. Our choice: slow enough that momentum does not help."""
_PLACES = 200
"""Number of positions in a sweep. Our choice: steps of half a degree in a quarter turn."""
_NEARLY = 0.98
"""Share of the required travel that counts as all of it. Our choice."""
INSIDE_M = 0.001
"""Overlap up to which being inside is ignored [m]. Our choice: such a body moves out by itself, and not far."""


@dataclass(frozen=True)
class Sweep:
    """Required motion of one joint: a turn by an angle, or a distance of a body's centre of mass."""

    moved_body: str
    """Body that the joint moves. It has no other joint, and no joint moves the bodies that carry it."""
    by_rad: float = 0.0
    """Required angle [rad]; 0 if a distance is required."""
    body: str = ""
    """Body whose centre of mass must move by `way_m` along `direction`; empty if an angle is required."""
    direction: tuple[float, ...] = (0.0, 0.0, 1.0)
    way_m: float = 0.0


class Overlap(Artifact):
    """A target that lies partly inside another shape at the start."""

    body: str
    other: str
    depth_m: float


class Drift(Artifact):
    """Motion of a target by itself."""

    body: str
    way_m: float
    """Displacement of its centre of mass [m]."""
    turned_deg: float
    """Turn of the hinge that moves it [deg]; 0 if no hinge moves it."""
    still_moves: bool
    """Whether it still moves at the end of the simulation."""

    @property
    def text(self) -> str:
        """Description in words."""
        turned = f", its hinge turns by {self.turned_deg:.3g} deg" if self.turned_deg else ""
        on = ", and it still moves then" if self.still_moves else ""
        return f"{self.body} goes {1000 * self.way_m:.3g} mm in {SETTLE_S:g} s{turned}{on}"


class Stop(Artifact):
    """An obstacle that a target meets on its way."""

    body: str
    """The body that its joint moves."""
    other: str
    at: float
    """Travel of the joint up to the obstacle [rad or m]."""
    of: float
    """Required travel of the joint [rad or m]."""
    angle: bool
    passes: bool
    """Whether the joint completes its travel when it is pressed against the obstacle."""

    @property
    def text(self) -> str:
        """Obstacle and travel in words."""
        if self.angle:
            return f"{self.other} after {math.degrees(self.at):.0f} of {math.degrees(self.of):.0f} deg"
        return f"{self.other} after {1000 * self.at:.3g} of {1000 * self.of:.3g} mm"


class UnattendedRun(Artifact):
    """Behaviour of an environment without a robot, from one initial state."""

    broken_s: float | None
    """Time at which the simulation diverges [s]; None if it does not."""
    overlaps: tuple[Overlap, ...]
    drifts: tuple[Drift, ...]
    """Drifts of the targets that move."""
    stops: tuple[Stop, ...]
    """Stops of the sweeps that meet something."""


def refuse(run: UnattendedRun) -> None:
    """Refuse a goal that cannot be met as the environment is written.

    Raises:
        UserError: The simulation diverges, a target lies inside another shape, or a target is stopped on its way.
    """
    if run.broken_s is not None:
        raise UserError(
            f"the environment breaks down by itself after {run.broken_s:.2g} s without a robot; look for overlaps, "
            "light bodies on stiff springs, and forces without damping"
        )
    for overlap in run.overlaps:
        raise UserError(
            f'"{overlap.body}" stands {1000 * overlap.depth_m:.3g} mm inside of {overlap.other} at the start, which '
            "holds it or throws it out; move them apart, or let them not collide (<contact><exclude>)"
        )
    for stop in run.stops:
        if not stop.passes:
            raise UserError(
                f'"{stop.body}" cannot go all the way: it meets {stop.text}, where {PRESS_N:g} N do not get it on; '
                "clear its way, ask for less, or the other way"
            )


def remarks(runs: Sequence[UnattendedRun]) -> tuple[str, ...]:
    """Return sentences on what a user should know about an environment that is not refused.

    Args:
        runs: Behaviour of the environment as written, then in some variations; at least one.
    """
    first, *varied = runs
    said = [f"{drift.text[0].upper()}{drift.text[1:]}, without a robot." for drift in first.drifts]
    said += [
        f"{stop.body} meets {stop.text}; {PRESS_N:g} N press it on, through a contact that soft."
        for stop in first.stops
        if stop.at < _NEARLY * stop.of
    ]
    faults: dict[str, int] = {}
    for run in varied:
        for fault in [f"{each.body} stands inside of {each.other}" for each in run.overlaps] + [
            f"{each.body} is stopped by {each.other}" for each in run.stops if not each.passes
        ]:
            faults[fault] = faults.get(fault, 0) + 1
    said += [f"{fault} in {count} of {len(varied)} variations that were tried." for fault, count in faults.items()]
    return tuple(said)


def run_unattended(
    mjcf: str, bodies: Sequence[str], sweeps: Sequence[Sweep], starts: Sequence[Sequence[Change]]
) -> tuple[UnattendedRun, ...]:
    """Return the behaviour of an environment without a robot, for each of several initial states.

    Args:
        mjcf: MJCF of the environment.
        bodies: Names of the targets; the bodies that they carry belong to them.
        sweeps: Required motions of their joints.
        starts: Changes to the environment as written, for each initial state.

    Raises:
        MjcfError: The environment cannot be loaded.
        IsolationError: The simulation exceeded the limits of its child process.
    """
    return _once(mjcf, tuple(bodies), tuple(sweeps), tuple(tuple(start) for start in starts))


@lru_cache(maxsize=16)
def _once(
    mjcf: str, bodies: tuple[str, ...], sweeps: tuple[Sweep, ...], starts: tuple[tuple[Change, ...], ...]
) -> tuple[UnattendedRun, ...]:
    return _play(mjcf, bodies, sweeps, starts)


@isolated
def _play(
    mjcf: str, bodies: tuple[str, ...], sweeps: tuple[Sweep, ...], starts: tuple[tuple[Change, ...], ...]
) -> tuple[UnattendedRun, ...]:
    found, written = [], load_mjcf(mjcf).model
    for start in starts:
        model = copy.copy(written)
        data = mujoco.MjData(model)
        apply_to_simulation(Variation(start), model, data)
        overlaps = _overlaps(model, data, bodies)
        stops = [_sweep(model, start, sweep) for sweep in sweeps]
        broken_s, drifts = _settle(model, data, bodies)
        found.append(
            UnattendedRun(
                broken_s=broken_s, overlaps=overlaps, drifts=drifts, stops=tuple(stop for stop in stops if stop)
            )
        )
    return tuple(found)


def _overlaps(model: mujoco.MjModel, data: mujoco.MjData, bodies: Sequence[str]) -> tuple[Overlap, ...]:
    found: dict[tuple[str, str], float] = {}
    for body in bodies:
        own = _carried(model, model.body(body).id)
        for geom, other, depth_m in _contacts(model, data, own):
            thickness_m = 2.0 * min(half_width_m(model, each) for each in (geom, other))
            if depth_m > OVERLAP_SHARE * thickness_m and depth_m > INSIDE_M:
                pair = (body, name_of_shape(model, other))
                found[pair] = max(found.get(pair, 0.0), depth_m)
    return tuple(Overlap(body=body, other=other, depth_m=depth) for (body, other), depth in found.items())


def _contacts(model: mujoco.MjModel, data: mujoco.MjData, own: set[int]) -> list[tuple[int, int, float]]:
    """Return the contacts between some bodies and all others: own geom, other geom, depth [m]."""
    found = []
    for contact in data.contact[: data.ncon]:
        first, second = (int(geom) for geom in contact.geom)
        mine = [int(model.geom_bodyid[geom]) in own for geom in (first, second)]
        if mine[0] != mine[1]:
            geom, other = (first, second) if mine[0] else (second, first)
            found.append((geom, other, -float(contact.dist)))
    return found


def _settle(
    model: mujoco.MjModel, data: mujoco.MjData, bodies: Sequence[str]
) -> tuple[float | None, tuple[Drift, ...]]:
    """Return the time at which the simulation diverges [s], or else None and the targets that move."""
    ids = {body: model.body(body).id for body in bodies}
    start, angles = {body: data.xipos[at].copy() for body, at in ids.items()}, data.qpos.copy()
    for _ in range(round(SETTLE_S / model.opt.timestep)):
        mujoco.mj_step(model, data)
        if any(data.warning[kind].number for kind in FATAL_WARNINGS):
            return float(data.time), ()
    before = {body: data.xipos[at].copy() for body, at in ids.items()}
    nearly, late_s = data.qpos.copy(), 0.1 * SETTLE_S
    for _ in range(max(1, round(late_s / model.opt.timestep))):
        mujoco.mj_step(model, data)
    found = []
    for body, at in ids.items():
        joint = _hinge(model, at)
        turned, lately = (
            (math.degrees(float(end[joint] - begin[joint])) if joint is not None else 0.0)
            for begin, end in ((angles, nearly), (nearly, data.qpos))
        )
        way_m = float(np.linalg.norm(before[body] - start[body]))
        late_m = float(np.linalg.norm(data.xipos[at] - before[body]))
        if way_m > MOVED_M or abs(turned) > TURNED_DEG:
            still = late_m > 0.1 * MOVED_M or abs(lately) > 0.1 * TURNED_DEG
            found.append(Drift(body=body, way_m=way_m, turned_deg=turned, still_moves=still))
    return None, tuple(found)


def _hinge(model: mujoco.MjModel, body: int) -> int | None:
    """Return the address in qpos of the hinge that moves a body; None if its nearest joint is not a hinge."""
    while body and not model.body_jntnum[body]:
        body = int(model.body_parentid[body])
    joint = int(model.body_jntadr[body])
    if joint < 0 or model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
        return None
    return int(model.jnt_qposadr[joint])


def _sweep(model: mujoco.MjModel, start: Sequence[Change], sweep: Sweep) -> Stop | None:
    """Return the first obstacle, fixed to the world, that a joint meets on its way; None if it meets none."""
    data = mujoco.MjData(model)
    joint = int(model.body_jntadr[model.body(sweep.moved_body).id])
    address = int(model.jnt_qposadr[joint])
    own = _carried(model, int(model.jnt_bodyid[joint]))
    apply_to_simulation(Variation(tuple(start)), model, data)
    begun = float(data.qpos[address])
    before = {(geom, other): depth_m for geom, other, depth_m in _contacts(model, data, own)}
    by = sweep.by_rad or _by(model, data, joint, sweep)
    met: dict[tuple[int, int], float] = {}
    for place in np.linspace(0.0, by, _PLACES)[1:]:
        data.qpos[address] = begun + place
        mujoco.mj_forward(model, data)
        for geom, other, depth_m in _contacts(model, data, own):
            deeper_m = depth_m - max(0.0, before.get((geom, other), 0.0))
            if deeper_m <= 0.0 or model.body_weldid[model.geom_bodyid[other]] != 0:
                continue
            met.setdefault((geom, other), abs(place))
            if deeper_m > _MEETS_M:
                passes = _passes(model, start, joint, by, own)
                angle = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
                return Stop(
                    body=sweep.moved_body,
                    other=name_of_shape(model, other),
                    at=met[geom, other],
                    of=abs(by),
                    angle=angle,
                    passes=passes,
                )
    return None


def _by(model: mujoco.MjModel, data: mujoco.MjData, joint: int, sweep: Sweep) -> float:
    """Return the travel of a joint [rad or m] after which its body has moved far enough; 0 if it never has."""
    body, address = model.body(sweep.body).id, int(model.jnt_qposadr[joint])
    along = np.array(sweep.direction) / np.linalg.norm(sweep.direction)
    begun, at = float(data.qpos[address]), data.xipos[body].copy()
    slide = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE
    if slide:
        share = float(data.xaxis[joint] @ along)
        return sweep.way_m / share if abs(share) > 1e-6 else 0.0
    found = 0.0
    for by in sorted(np.linspace(-math.pi, math.pi, 721), key=abs):
        data.qpos[address] = begun + by
        limited = bool(model.jnt_limited[joint])
        low, high = model.jnt_range[joint]
        if limited and not low - 1e-6 <= begun + by <= high + 1e-6:
            continue
        mujoco.mj_kinematics(model, data)
        if float((data.xipos[body] - at) @ along) >= sweep.way_m:
            found = float(by)
            break
    data.qpos[address] = begun
    return found


def _passes(model: mujoco.MjModel, start: Sequence[Change], joint: int, by: float, own: set[int]) -> bool:
    """Return whether a joint completes its travel when it is driven with the force `PRESS_N`."""
    model = copy.copy(model)
    data = mujoco.MjData(model)
    apply_to_simulation(Variation(tuple(start)), model, data)
    address, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    press = math.copysign(PRESS_N * _arm_m(model, data, joint, own), by)
    begun = float(data.qpos[address])
    model.dof_damping[dof] = press / (_SPEED * by)  # without an obstacle the joint moves at this speed
    for _ in range(round((1.0 / _SPEED + _PRESS_S) / model.opt.timestep)):
        # weight and spring forces are compensated
        data.qfrc_applied[dof] = data.qfrc_bias[dof] - data.qfrc_spring[dof] + press
        mujoco.mj_step(model, data)
        if (float(data.qpos[address]) - begun) / by >= _NEARLY:
            return True
    return False


def _arm_m(model: mujoco.MjModel, data: mujoco.MjData, joint: int, own: set[int]) -> float:
    """Return how far the moved bodies reach from the axis of a hinge [m]; 1 for a slide."""
    if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE:
        return 1.0
    anchor, axis = data.xanchor[joint], data.xaxis[joint]
    geoms = [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in own]
    return max(
        float(np.linalg.norm(np.cross(data.geom_xpos[geom] - anchor, axis))) + float(model.geom_rbound[geom])
        for geom in geoms
    )


def _carried(model: mujoco.MjModel, body: int) -> set[int]:
    """Return the ids of a body and of all bodies that it carries."""
    found = {body}
    for other in range(body + 1, model.nbody):
        if int(model.body_parentid[other]) in found:
            found.add(other)
    return found


def name_of_shape(model: mujoco.MjModel, geom: int) -> str:
    """Return the name of a geom, or of its body if the geom has none."""
    body = model.body(model.geom_bodyid[geom]).name
    return model.geom(geom).name or (body if body != "world" else f"geom {geom} of the world")
