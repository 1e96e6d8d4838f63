"""An environment played without a robot: does its target rest, and does anything stand in the way of what is asked.

Joints have ranges, and `aidsr.tasks.goals.surroundings` looks at these. Here contacts count as well: the target's joint
is swept through the asked travel, and what it meets is pressed against.
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
from aidsr.tasks.readings import FloatArray
from aidsr.tasks.variation import Change, Variation, apply_to_simulation

SETTLE_S = 1.0
"""How long the environment is left to itself. Our choice: what stands falls over within it, a soft contact sinks."""
MOVED_M, TURNED_DEG = 0.002, 2.0
"""What a target may give before it is said to move by itself. Our choice: what contacts and play give way."""
_MEETS_M = 0.0005
"""Overlap that is a contact. Our choice: above rounding in written coordinates."""
PRESS_N = 5.0
"""With which what is met is pressed against, at the part farthest from a hinge. Our choice: more than twice what the
tip of a built-in arm presses with."""
_PRESS_S = 2.0
_SPEED = 1.0
"""Of the sweep with contacts, in travels per second. Our choice: slow enough that nothing is won by momentum."""
_PLACES = 200
"""Places of a sweep. Our choice: half a degree of a quarter turn."""
_NEARLY = 0.98
"""Share of a way after which a stop is its end. Our choice."""
_INSIDE = 0.2
"""Overlap / thickness of the thinner geom from which a target stands inside of something. Source: as in
`aidsr.sim.overlap`."""
_INSIDE_M = 0.001
"""Overlap below which it does not matter. Our choice: such a body moves out by itself, and not far."""


@dataclass(frozen=True)
class Sweep:
    """What one joint is to do: turn by an angle, or move a body's centre of mass a way."""

    joint: str
    """Body that the joint moves; it has no other joint, and nothing moves what carries it."""
    by_rad: float = 0.0
    """Angle, where it is to turn."""
    body: str = ""
    """Body that is to get somewhere, else."""
    direction: tuple[float, ...] = (0.0, 0.0, 1.0)
    way_m: float = 0.0


class Overlap(Artifact):
    """A part of a target that is inside of something at the start."""

    body: str
    other: str
    depth_m: float


class Drift(Artifact):
    """How far a target moves by itself."""

    body: str
    way_m: float
    """Of its centre of mass."""
    turned_deg: float
    """Of the hinge that moves it; 0 where that is none."""
    still_moves: bool
    """Whether it still moves at the end of the time."""

    @property
    def text(self) -> str:
        """The same in words."""
        turned = f", its hinge turns by {self.turned_deg:.3g} deg" if self.turned_deg else ""
        on = ", and it still moves then" if self.still_moves else ""
        return f"{self.body} goes {1000 * self.way_m:.3g} mm in {SETTLE_S:g} s{turned}{on}"


class Stop(Artifact):
    """What a target meets on its way."""

    body: str
    """The body that its joint moves."""
    other: str
    at: float
    """How far it comes [rad or m]."""
    of: float
    """How far it is to come."""
    angle: bool
    passes: bool
    """Whether it gets on when it is pressed against it."""

    @property
    def text(self) -> str:
        """What is met, and where."""
        if self.angle:
            return f"{self.other} after {math.degrees(self.at):.0f} of {math.degrees(self.of):.0f} deg"
        return f"{self.other} after {1000 * self.at:.3g} of {1000 * self.of:.3g} mm"


class Alone(Artifact):
    """What one beginning of an environment does without a robot."""

    broken_s: float | None
    """When the simulation breaks down; None where it does not."""
    overlaps: tuple[Overlap, ...]
    drifts: tuple[Drift, ...]
    """Of the targets that move."""
    stops: tuple[Stop, ...]
    """Of the sweeps, those that meet something."""


def refuse(begun: Alone) -> None:
    """Refuse a goal that cannot be met as the environment is written.

    Raises:
        UserError: The simulation breaks down, a target stands inside of something, or is stopped on its way.
    """
    if begun.broken_s is not None:
        raise UserError(
            f"the environment breaks down by itself after {begun.broken_s:.2g} s without a robot; look for overlaps, "
            "light bodies on stiff springs, and forces without damping"
        )
    for overlap in begun.overlaps:
        raise UserError(
            f'"{overlap.body}" stands {1000 * overlap.depth_m:.3g} mm inside of {overlap.other} at the start, which '
            "holds it or throws it out; move them apart, or let them not collide (<contact><exclude>)"
        )
    for stop in begun.stops:
        if not stop.passes:
            raise UserError(
                f'"{stop.body}" cannot go all the way: it meets {stop.text}, where {PRESS_N:g} N do not get it on; '
                "clear its way, ask for less, or the other way"
            )


def remarks(begins: Sequence[Alone]) -> tuple[str, ...]:
    """Return what a user should know of an environment that is not refused, in sentences.

    Args:
        begins: As it is written, then in some variations; at least one.
    """
    first, *varied = begins
    said = [f"{drift.text[0].upper()}{drift.text[1:]}, without a robot." for drift in first.drifts]
    said += [
        f"{stop.body} meets {stop.text}; {PRESS_N:g} N press it on, through a contact that soft."
        for stop in first.stops
        if stop.at < _NEARLY * stop.of
    ]
    faults: dict[str, int] = {}
    for begun in varied:
        for fault in [f"{each.body} stands inside of {each.other}" for each in begun.overlaps] + [
            f"{each.body} is stopped by {each.other}" for each in begun.stops if not each.passes
        ]:
            faults[fault] = faults.get(fault, 0) + 1
    said += [f"{fault} in {count} of {len(varied)} variations that were tried." for fault, count in faults.items()]
    return tuple(said)


def play_alone(
    mjcf: str, bodies: Sequence[str], sweeps: Sequence[Sweep], starts: Sequence[Sequence[Change]]
) -> tuple[Alone, ...]:
    """Return what an environment does without a robot, for each of some beginnings.

    Args:
        mjcf: The environment.
        bodies: Targets, with what they carry.
        sweeps: What is asked of their joints.
        starts: What differs from the environment as it is written, for each beginning.

    Raises:
        MjcfError: It cannot be loaded.
        IsolationError: It ran past its limits.
    """
    return _once(mjcf, tuple(bodies), tuple(sweeps), tuple(tuple(start) for start in starts))


@lru_cache(maxsize=16)
def _once(
    mjcf: str, bodies: tuple[str, ...], sweeps: tuple[Sweep, ...], starts: tuple[tuple[Change, ...], ...]
) -> tuple[Alone, ...]:
    return _play(mjcf, bodies, sweeps, starts)


@isolated
def _play(
    mjcf: str, bodies: tuple[str, ...], sweeps: tuple[Sweep, ...], starts: tuple[tuple[Change, ...], ...]
) -> tuple[Alone, ...]:
    found, written = [], load_mjcf(mjcf).model
    for start in starts:
        model = copy.copy(written)
        data = mujoco.MjData(model)
        apply_to_simulation(Variation(start), model, data)
        overlaps = _overlaps(model, data, bodies)
        stops = [_sweep(model, start, sweep) for sweep in sweeps]
        broken_s, drifts = _settle(model, data, bodies)
        found.append(
            Alone(broken_s=broken_s, overlaps=overlaps, drifts=drifts, stops=tuple(stop for stop in stops if stop))
        )
    return tuple(found)


def _overlaps(model: mujoco.MjModel, data: mujoco.MjData, bodies: Sequence[str]) -> tuple[Overlap, ...]:
    found: dict[tuple[str, str], float] = {}
    for body in bodies:
        own = _carried(model, model.body(body).id)
        for geom, other, depth_m in _contacts(model, data, own):
            thickness_m = min(_thickness_m(model, each) for each in (geom, other))
            if depth_m > _INSIDE * thickness_m and depth_m > _INSIDE_M:
                pair = (body, name_of_shape(model, other))
                found[pair] = max(found.get(pair, 0.0), depth_m)
    return tuple(Overlap(body=body, other=other, depth_m=depth) for (body, other), depth in found.items())


def _contacts(model: mujoco.MjModel, data: mujoco.MjData, own: set[int]) -> list[tuple[int, int, float]]:
    """Return the contacts between some bodies and all others: own geom, the other, how deep [m]."""
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
    """Return when the simulation breaks down within the time, else the targets that move in it."""
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
    """Return the address in qpos of the hinge that moves a body; None where that is none."""
    while body and not model.body_jntnum[body]:
        body = int(model.body_parentid[body])
    joint = int(model.body_jntadr[body])
    if joint < 0 or model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
        return None
    return int(model.jnt_qposadr[joint])


def _sweep(model: mujoco.MjModel, start: Sequence[Change], sweep: Sweep) -> Stop | None:
    """Return what a joint meets on its way that cannot give way; None where it meets nothing."""
    data = mujoco.MjData(model)
    joint = int(model.body_jntadr[model.body(sweep.joint).id])
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
                    body=sweep.joint,
                    other=name_of_shape(model, other),
                    at=met[geom, other],
                    of=abs(by),
                    angle=angle,
                    passes=passes,
                )
    return None


def _by(model: mujoco.MjModel, data: mujoco.MjData, joint: int, sweep: Sweep) -> float:
    """Return how far a joint has to go for its body to get its way, 0 where it does not."""
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
    """Return whether a joint gets all its way when it is driven with the force that is pressed with."""
    model = copy.copy(model)
    data = mujoco.MjData(model)
    apply_to_simulation(Variation(tuple(start)), model, data)
    address, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    press = math.copysign(PRESS_N * _arm_m(model, data, joint, own), by)
    begun = float(data.qpos[address])
    model.dof_damping[dof] = press / (_SPEED * by)  # with nothing in its way it goes at this speed
    for _ in range(round((1.0 / _SPEED + _PRESS_S) / model.opt.timestep)):
        # weight and spring are carried besides
        data.qfrc_applied[dof] = data.qfrc_bias[dof] - data.qfrc_spring[dof] + press
        mujoco.mj_step(model, data)
        if (float(data.qpos[address]) - begun) / by >= _NEARLY:
            return True
    return False


def _arm_m(model: mujoco.MjModel, data: mujoco.MjData, joint: int, own: set[int]) -> float:
    """Return how far from a hinge its body reaches [m]; 1 for a slide."""
    if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE:
        return 1.0
    anchor, axis = data.xanchor[joint], data.xaxis[joint]
    geoms = [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in own]
    return max(
        float(np.linalg.norm(np.cross(data.geom_xpos[geom] - anchor, axis))) + float(model.geom_rbound[geom])
        for geom in geoms
    )


def _carried(model: mujoco.MjModel, body: int) -> set[int]:
    """Return a body and all that it carries."""
    found = {body}
    for other in range(body + 1, model.nbody):
        if int(model.body_parentid[other]) in found:
            found.add(other)
    return found


def _thickness_m(model: mujoco.MjModel, geom: int) -> float:
    if model.geom_type[geom] in (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD):
        return math.inf
    half: FloatArray = model.geom_aabb[geom, 3:]
    return 2.0 * float(half.min())


def name_of_shape(model: mujoco.MjModel, geom: int) -> str:
    """Return the name of a geom, or of its body where it has none."""
    body = model.body(model.geom_bodyid[geom]).name
    return model.geom(geom).name or (body if body != "world" else f"geom {geom} of the world")
