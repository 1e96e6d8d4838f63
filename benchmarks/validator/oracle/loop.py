"""The oracle's tests of one robot: let it settle, drive it, and keep the traces."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from functools import cached_property

import mujoco
import numpy as np
from benchmarks.validator.oracle.shape import corners, lowest_m
from benchmarks.validator.oracle.trace import Array, Trace, record

Change = Callable[[mujoco.MjModel], None]

GRAVITY_M_S2 = 9.81
_KICK_RAD = 0.02
_SLACK = 29  # number of the actuator group that is switched off
_FREE, _BALL, _HINGE = (int(getattr(mujoco.mjtJoint, f"mjJNT_{kind}")) for kind in ("FREE", "BALL", "HINGE"))
_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)


class Bench:
    """A robot and the tests made with it so far.

    Args:
        mjcf: MJCF of the robot. A robot with a free joint and without a floor gets a floor at its lowest point.
        step: Time step of the oracle / time step of the robot.
    """

    def __init__(self, mjcf: str, step: float = 0.5) -> None:
        spec = mujoco.MjSpec.from_string(mjcf)
        model = spec.compile()
        self.free = bool((model.jnt_type == _FREE).any())
        flat = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
        if self.free and not np.isin(model.geom_type, flat).any():
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], pos=[0, 0, lowest_m(model)])
            model = spec.compile()
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
        model.opt.timestep *= step
        self._substeps = max(1, round(1 / step))
        self.model, self.mjcf = model, mjcf
        self.start = mujoco.MjData(model)
        mujoco.mj_forward(model, self.start)
        self._kept: dict[str, Trace] = {}

    @cached_property
    def moving(self) -> list[int]:
        """Bodies that can move relative to the world."""
        return [body for body in range(1, self.model.nbody) if self.model.body_weldid[body] != 0]

    @cached_property
    def root(self) -> int:
        """First body with a free joint, otherwise the first body."""
        free = [int(self.model.jnt_bodyid[j]) for j in range(self.model.njnt) if self.model.jnt_type[j] == _FREE]
        return free[0] if free else 1

    @cached_property
    def length_m(self) -> float:
        """The smaller of the longest path along joints and the diagonal of the box around the moving bodies [m]."""
        points = np.concatenate([corners(self.model, self.start, geom) for geom in self._moving_geoms])
        diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
        return min(diagonal, self._longest_way_m) if self._longest_way_m else diagonal

    @cached_property
    def _moving_geoms(self) -> list[int]:
        return [geom for geom in range(self.model.ngeom) if int(self.model.geom_bodyid[geom]) in self.moving]

    @cached_property
    def _longest_way_m(self) -> float:
        way: dict[int, tuple[float, Array]] = {}
        longest = 0.0
        for body in self.moving:
            first = int(self.model.body_jntadr[body])
            anchors = [self.start.xanchor[first + k] for k in range(self.model.body_jntnum[body])]
            begin = anchors[0] if anchors else self.start.xpos[body]
            travelled, here = way.get(int(self.model.body_parentid[body]), (0.0, begin))
            for anchor in anchors:
                travelled, here = travelled + float(np.linalg.norm(anchor - here)), anchor
            way[body] = travelled, np.array(here)
            mine = [geom for geom in self._moving_geoms if self.model.geom_bodyid[geom] == body]
            far = [np.linalg.norm(corners(self.model, self.start, geom) - here, axis=1).max() for geom in mine]
            longest = max(longest, travelled + float(max(far, default=0.0)))
        return longest

    @property
    def time_s(self) -> float:
        """sqrt(L / g), the unit of durations [s]."""
        return math.sqrt(self.length_m / GRAVITY_M_S2)

    @cached_property
    def weight_n(self) -> float:
        """Weight of the moving bodies [N]."""
        return float(self.model.body_mass[self.moving].sum()) * GRAVITY_M_S2

    @cached_property
    def pulling(self) -> list[int]:
        """Actuators on tendons."""
        return [i for i in range(self.model.nu) if int(self.model.actuator_trntype[i]) == _TENDON]

    @property
    def failed(self) -> bool:
        """Whether a test made so far ended in bad numbers."""
        return any(trace.failed for trace in self._kept.values())

    def settle(self, name: str = "settle", change: Change | None = None, gravity: float = 1.0) -> Trace:
        """Kick every joint slightly, and simulate with slack tendons."""
        name = f"{name} {gravity}"
        if name not in self._kept:
            duration = min(max(12 * self.time_s, 1.0), 4.0)
            neutral = self.neutral(self.start)
            self._kept[name] = self._run(self._kicked(), neutral, None, duration, self.pulling, change, gravity)
        return self._kept[name]

    def drive(
        self,
        name: str,
        target: dict[int, float],
        slack: Sequence[int] = (),
        change: Change | None = None,
    ) -> Trace:
        """Start at rest, move some commands to their target in a quarter of the time, and hold them.

        Args:
            name: Name under which the trace is kept.
            target: Target command by actuator.
            slack: Actuators that are switched off.
            change: Changes the model for this test.
        """
        if name not in self._kept:
            neutral = self.neutral(self.settle().end)
            end = neutral.copy()
            for actuator, value in target.items():
                end[actuator] = value
            self._kept[name] = self._run(self._resting(), neutral, end, self._test_s, slack, change)
        return self._kept[name]

    def reference(self, name: str = "reference", change: Change | None = None) -> Trace:
        """Simulate with slack tendons for the duration of a test."""
        return self.drive(name, {}, self.pulling, change)

    def alone(self, actuator: int, end: float, name: str = "", change: Change | None = None) -> Trace:
        """Drive one actuator to one end of its range, with the other tendons slack."""
        others = [i for i in self.pulling if i != actuator]
        return self.drive(f"{name} alone {actuator} {end}", {actuator: end}, others, change)

    def together(self) -> Trace:
        """Drive every actuator to the end at which it pulls hardest."""
        return self.drive("together", {i: self.ends(i)[0] for i in range(self.model.nu)})

    def ends(self, actuator: int) -> tuple[float, float]:
        """Return the end of the range at which a tendon is pulled hardest (for a joint the high end), and the other."""
        return self._ends[actuator]

    @cached_property
    def _ends(self) -> list[tuple[float, float]]:
        ends = []
        for actuator in range(self.model.nu):
            low, high = self.range_of(actuator)
            forces = [self.force_n(actuator, end) for end in (low, high)]
            pulls_low = actuator in self.pulling and forces[0] < forces[1]
            ends.append((low, high) if pulls_low else (high, low))
        return ends

    @property
    def _test_s(self) -> float:
        return min(max(9 * self.time_s, 0.8), 3.0)

    def range_of(self, actuator: int) -> tuple[float, float]:
        """Return the control range; -1 to 1 if there is none."""
        if not self.model.actuator_ctrllimited[actuator]:
            return -1.0, 1.0
        low, high = self.model.actuator_ctrlrange[actuator]
        return float(low), float(high)

    def force_n(self, actuator: int, command: float) -> float:
        """Return the force on the joint or tendon in the rest pose; it is negative if a tendon is pulled."""
        data = mujoco.MjData(self.model)
        data.qpos[:] = self.settle().end.qpos
        data.ctrl[:] = command
        data.act[:] = command
        mujoco.mj_forward(self.model, data)
        return float(data.actuator_force[actuator] * self.model.actuator_gear[actuator, 0])

    def sweep(self) -> Trace:
        """Drive all actuators to random ends of their ranges, which change at the same times."""
        rng = np.random.default_rng(11)
        low, high = (np.array([self.range_of(i)[k] for i in range(self.model.nu)]) for k in (0, 1))
        hold_s = 0.35 * self.time_s
        ends = np.where(rng.random((math.ceil(self._test_s / hold_s) + 1, self.model.nu)) < 0.5, low, high)
        if "sweep" not in self._kept:
            neutral = self.neutral(self.settle().end)
            self._kept["sweep"] = self._run(
                self._resting(), neutral, lambda time_s: ends[int(time_s / hold_s)], self._test_s, ()
            )
        return self._kept["sweep"]

    def neutral(self, data: mujoco.MjData) -> Array:
        """Return commands without force: a servo is commanded to stay where it is."""
        ctrl = np.zeros(self.model.nu)
        for i in range(self.model.nu):
            gain, bias = self.model.actuator_gainprm[i, 0], self.model.actuator_biasprm[i]
            if gain and bias.any():
                ctrl[i] = -(bias[0] + bias[1] * data.actuator_length[i]) / gain
            if self.model.actuator_ctrllimited[i]:
                ctrl[i] = np.clip(ctrl[i], *self.model.actuator_ctrlrange[i])
        return ctrl

    def _kicked(self) -> mujoco.MjData:
        rng, turn = np.random.default_rng(5), np.zeros(self.model.nv)
        for joint in range(self.model.njnt):
            dof, kind = int(self.model.jnt_dofadr[joint]), int(self.model.jnt_type[joint])
            count = {_HINGE: 1, _BALL: 3}.get(kind, 0)
            turn[dof : dof + count] = rng.choice((-1, 1), size=count) * _KICK_RAD / math.sqrt(max(count, 1))
        data = mujoco.MjData(self.model)
        mujoco.mj_integratePos(self.model, data.qpos, turn, 1.0)
        return data

    def _resting(self) -> mujoco.MjData:
        data, rest = mujoco.MjData(self.model), self.settle().end
        data.qpos[:], data.qvel[:] = rest.qpos, rest.qvel
        return data

    def _run(
        self,
        data: mujoco.MjData,
        begin: Array,
        target: Array | Callable[[float], Array] | None,
        duration_s: float,
        slack: Sequence[int],
        change: Change | None = None,
        gravity: float = 1.0,
    ) -> Trace:
        model = copy.copy(self.model)  # each test may change its own copy
        model.opt.gravity[:] *= gravity
        model.actuator_group[:] = 0
        model.actuator_group[list(slack)] = _SLACK
        model.opt.disableactuator = 1 << _SLACK
        if change:
            change(model)
        return record(model, data, begin, target, duration_s, self.root, self._substeps)
