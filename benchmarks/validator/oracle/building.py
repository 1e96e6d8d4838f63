"""Measures of whether a robot can be built: cables, forces, speeds, densities and walls, as symptom / limit."""

from __future__ import annotations

import copy
import math
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from itertools import pairwise

import mujoco
import numpy as np
from benchmarks.validator.oracle.loop import GRAVITY_M_S2, Bench
from benchmarks.validator.oracle.trace import Array, Trace
from numpy.typing import NDArray

_SITE, _JOINT = int(mujoco.mjtWrap.mjWRAP_SITE), int(mujoco.mjtWrap.mjWRAP_JOINT)
_AFFINE = int(mujoco.mjtBias.mjBIAS_AFFINE)
_PROBE_M, _WALL_M = 1e-6, 0.0008


def buried(bench: Bench) -> float:
    """Return the largest depth of a straight cable inside a part that has neither guide / half its width / 0.25.

    The depth comes from MuJoCo's collision detector, with a ball as small as a point.
    """
    spec = mujoco.MjSpec.from_string(bench.mjcf)
    spec.worldbody.add_geom(
        name="probe", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[_PROBE_M, 0, 0], contype=0, conaffinity=0
    )
    model = spec.compile()
    probe = model.geom("probe").id
    data, worst = mujoco.MjData(model), 0.0
    spans = np.array(_spans(model), dtype=np.int64).reshape(-1, 2)
    poses = [bench.start.qpos] + [bench.alone(i, bench.ends(i)[0]).end.qpos for i in bench.pulling]
    for pose in poses:
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        for point, geom in _near(model, data, spans, probe):
            data.geom_xpos[probe] = point
            distance = mujoco.mj_geomDistance(model, data, probe, geom, 1.0, None)
            worst = max(worst, -distance / float(model.geom_aabb[geom][3:].min()))
    return worst / 0.25


def _near(
    model: mujoco.MjModel, data: mujoco.MjData, spans: NDArray[np.int64], probe: int
) -> Iterator[tuple[Array, int]]:
    """Yield points of cables with the parts that they may be inside of: near parts, without those of the guides."""
    along = np.linspace(0.05, 0.95, 19)[:, None]
    begins, ends = data.site_xpos[spans[:, 0]], data.site_xpos[spans[:, 1]]
    points = begins[:, None] + along * (ends - begins)[:, None]
    weld = model.body_weldid[model.geom_bodyid]
    guides = model.body_weldid[model.site_bodyid[spans]]
    for geom in range(model.ngeom):
        if geom == probe or model.geom_type[geom] == int(mujoco.mjtGeom.mjGEOM_PLANE):
            continue
        close = np.linalg.norm(points - data.geom_xpos[geom], axis=2) < model.geom_rbound[geom]
        close[(guides == weld[geom]).any(axis=1)] = False
        for span, step in np.argwhere(close):
            yield points[span, step], geom


def _spans(model: mujoco.MjModel) -> list[tuple[int, int]]:
    found = []
    for tendon in range(model.ntendon):
        first = int(model.tendon_adr[tendon])
        wraps = [
            (int(model.wrap_type[k]), int(model.wrap_objid[k]))
            for k in range(first, first + int(model.tendon_num[tendon]))
        ]
        found += [(a, b) for (kind, a), (other, b) in pairwise(wraps) if kind == other == _SITE]
    return found


def skipping(bench: Bench) -> float:
    """Return the largest number of joints between neighbouring guides; a single joint counts 0.5.

    Only pairs of guides count whose joints are all closer to the cable than a quarter of the guides' distance.
    """
    model, worst = bench.model, 0
    for begin, end in _spans(model):
        line = _line(model, int(model.site_bodyid[begin]), int(model.site_bodyid[end]))
        anchors = [np.array(bench.start.xanchor[model.body_jntadr[body]]) for body in line if model.body_jntnum[body]]
        points: list[Array] = []
        for anchor in anchors:
            if not points or np.linalg.norm(anchor - points[-1]) > 1e-4:
                points.append(anchor)
        a, b = bench.start.site_xpos[begin], bench.start.site_xpos[end]
        span = float(np.linalg.norm(b - a))
        away = [float(np.linalg.norm(np.cross(point - a, b - a))) / max(span, 1e-9) for point in points]
        if span > 0 and away and max(away) < 0.25 * span:
            worst = max(worst, len(points))
    return worst / 1 if worst > 1 else 0.5 * worst


def _line(model: mujoco.MjModel, one: int, other: int) -> list[int]:
    """Return the bodies on the path between two bodies of the tree, without their common ancestors."""

    def up(body: int) -> list[int]:
        line = [body]
        while line[-1]:
            line.append(int(model.body_parentid[line[-1]]))
        return line

    first, second = up(one), up(other)
    return [b for b in first if b not in second] + [b for b in second if b not in first][::-1]


def _traces(bench: Bench) -> list[Trace]:
    """Return the traces of all driven tests but the random sweep."""
    return [bench.together(), *(bench.alone(i, bench.ends(i)[0]) for i in range(bench.model.nu))]


def _spatial(bench: Bench) -> list[int]:
    model = bench.model
    return [i for i in bench.pulling if model.wrap_type[model.tendon_adr[model.actuator_trnid[i, 0]]] != _JOINT]


def pushing(bench: Bench) -> float:
    """Return the largest push / largest pull / 0.1, of the worst actuator."""
    worst = 0.0
    for i in _spatial(bench):
        forces = np.concatenate([trace.forces_n[:, i] for trace in [*_traces(bench), bench.sweep()]])
        worst = max(worst, float(max(forces.max(), 0.0) / max(-forces.min(), 1e-12)) / 0.1)
    return worst


def force(bench: Bench) -> float:
    """Return the largest pull / min(500 N, max(30 N, 50 times the weight))."""
    pull = max(
        (-float(t.forces_n[:, i].min()) for t in [*_traces(bench), bench.sweep()] for i in bench.pulling), default=0.0
    )
    return pull / min(500.0, max(30.0, 50 * bench.weight_n))


def _reeling(bench: Bench, trace: Trace, actuator: int) -> tuple[Array, Array]:
    """Return the pull [N] and the speed of the cable [m/s], which is positive when the cable is reeled in."""
    lengths = trace.tendons_m[:, int(bench.model.actuator_trnid[actuator, 0])]
    return np.maximum(-trace.forces_n[1:, actuator], 0.0), -np.diff(lengths) / trace.timestep_s


def power(bench: Bench) -> float:
    """Return the largest power / min(300 W, max(50 W, 200 W/kg)), or in the sweep / 1500 W."""
    allowed = min(300.0, max(50.0, 200 * bench.weight_n / GRAVITY_M_S2))
    worst = 0.0
    for trace, limit in [(trace, allowed) for trace in _traces(bench)] + [(bench.sweep(), 1500.0)]:
        for i in bench.pulling:
            pull, speed_m_s = _reeling(bench, trace, i)
            worst = max(worst, float((pull * speed_m_s).max(initial=0.0)) / limit)
    return worst


def speed(bench: Bench) -> float:
    """Return the largest speed of a pulled cable / 0.5 m/s."""
    worst = 0.0
    for trace in _traces(bench):
        for i in bench.pulling:
            pull, speed_m_s = _reeling(bench, trace, i)
            worst = max(worst, float(np.abs(speed_m_s[pull > 0]).max(initial=0.0)) / 0.5)
    return worst


def stroke(bench: Bench) -> float:
    """Return tension (at most 500 N) x stroke / the work of the strongest motor over ten turns of any spool.

    A larger tension is too large for any stroke, which `force` measures. A stroke of more than ten turns of a spool
    with a radius of 0.03 m is too long with any tension.
    """
    worst = 0.0
    for i in bench.pulling:
        lengths = [
            trace.tendons_m[:, int(bench.model.actuator_trnid[i, 0])] for trace in [*_traces(bench), bench.sweep()]
        ]
        pull = min(500.0, max(-float(trace.forces_n[:, i].min()) for trace in [*_traces(bench), bench.sweep()]))
        travel = float(max(length.max() for length in lengths) - min(length.min() for length in lengths))
        worst = max(worst, pull * travel / _most_work_j(), travel / (10 * 2 * math.pi * 0.03))
    return worst


@cache
def _most_work_j() -> float:
    """Return the work of the largest torque that a motor can hold over ten turns of a spool [J]."""
    table = tomllib.loads(files("aidsr.core").joinpath("motors.toml").read_text("utf-8"))
    motors = next(value for value in table.values() if isinstance(value, list))
    held = [max(m.get("rated_torque_n_m", 0.0), 0.2 * m.get("stall_torque_n_m", 0.0)) for m in motors]
    return max(held) * 10 * 2 * math.pi


def density(bench: Bench) -> float:
    """Return the density of the most unusual moving body / 23,000 kg/m3, or 5 kg/m3 / its density."""
    return max((max(each / 23_000, 5 / each) for each in body_densities(bench)), default=0.0)


def body_densities(bench: Bench) -> list[float]:
    """Return the density of every moving body that has a volume [kg/m3].

    Volumes are the masses that MuJoCo computes with a density of 1.
    """
    spec = mujoco.MjSpec.from_string(bench.mjcf)
    for geom in spec.geoms:
        geom.mass, geom.density = math.nan, 1.0
    for body in spec.bodies:
        body.explicitinertial = 0
    try:
        volumes = spec.compile().body_mass
    except ValueError:  # a body without geoms
        return []
    masses = {body: (float(bench.model.body_mass[body]), float(volumes[body])) for body in bench.moving}
    return [mass / volume for mass, volume in masses.values() if volume > 0 and mass > 0]


def slack(bench: Bench) -> float:
    """Return the share of a servo's commands that pay out over 1 % more cable than the longest path of any test / 0.3.

    The length paid out is that at which the servo's force, computed by MuJoCo in the rest pose, would vanish.
    """
    model, worst = bench.model, 0.0
    for i in bench.pulling:
        stiffness = -float(model.actuator_biasprm[i, 1]) * float(model.actuator_gear[i, 0])
        if model.actuator_biastype[i] != _AFFINE or stiffness == 0:
            continue
        tendon = int(model.actuator_trnid[i, 0])
        paid_out = sorted(_free_length_m(bench, i, tendon, stiffness, end) for end in bench.range_of(i))
        traces = [bench.settle(), *_traces(bench), bench.sweep()]
        longest_m = 1.01 * max(float(trace.tendons_m[:, tendon].max()) for trace in traces)
        width_m = paid_out[1] - paid_out[0]
        worst = max(worst, (paid_out[1] - longest_m) / width_m / 0.3 if width_m > 0 else 0.0)
    return worst


def _free_length_m(bench: Bench, actuator: int, tendon: int, stiffness: float, command: float) -> float:
    """Return the cable length [m] at which a servo would give no force, from its unlimited force in the rest pose."""
    model, data = copy.copy(bench.model), mujoco.MjData(bench.model)
    model.actuator_forcelimited[:] = 0
    data.qpos[:] = bench.settle().end.qpos
    data.ctrl[:], data.act[:] = command, command
    mujoco.mj_forward(model, data)
    force_n = float(data.actuator_force[actuator] * model.actuator_gear[actuator, 0])
    return float(data.ten_length[tendon]) + force_n / stiffness


def wall(bench: Bench) -> float:
    """Return 0.8 mm / the thinnest extent of a part with contacts, or of any part of a body without such parts."""
    model = bench.model
    touching = [bool(model.geom_contype[g] or model.geom_conaffinity[g]) for g in range(model.ngeom)]
    felt = {int(model.geom_bodyid[g]) for g in range(model.ngeom) if touching[g]}
    primitives = range(int(mujoco.mjtGeom.mjGEOM_SPHERE), int(mujoco.mjtGeom.mjGEOM_BOX) + 1)
    thickness_m = [
        2 * float(model.geom_aabb[g][3:].min())
        for g in range(model.ngeom)
        if int(model.geom_bodyid[g]) in bench.moving and int(model.geom_type[g]) in primitives
        if touching[g] or int(model.geom_bodyid[g]) not in felt
    ]
    return _WALL_M / min(thickness_m, default=1.0)
