"""Convergence of the simulation: change of the results with twice the segments or half the time step."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.mjcf.compile import compile_mjcf
from aidsr.sim.drive import neutral_ctrl, read_drives, set_act
from aidsr.sim.elastica import Rod, Tip
from aidsr.sim.rollout import Simulation, integration_state, simulate
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2, Chain, Structure, read_structure
from aidsr.validation.fidelity.cables import Cable, Guide, guides_of
from aidsr.validation.fidelity.compare import (
    arc_of,
    bend_by_cable,
    bend_by_load,
    comparison_load_n,
    frequency_of,
    tip_distance_percent,
)
from aidsr.validation.fidelity.limb import Limb, LimbError, read_limb
from aidsr.validation.fidelity.rewrite import rewrite

Array = NDArray[np.float64]

_SAME_TIP_PERCENT = 0.2
"""Distance between tips [% of the length] up to which a rewritten limb is equivalent to the original. Our choice: well
below the errors to be measured."""
_SAME_FREQUENCY = 0.01

_FRAME_STEPS = 5
_SHORTEST_S, _LONGEST_S = 0.5, 1.5
_MOST_DRIVES = 8
"""Most actuators driven for the time step check. Our choice: they share the integrator, so a few are sufficient."""


def twice_the_segments_percent(
    model: mujoco.MjModel, chain: Chain, limb: Limb, rod: Rod, cables: tuple[Cable, ...]
) -> float:
    """Return the largest distance that a limb's tip moves when each segment is split in two [% of its length].

    The tests are the tip load of `compare` and every cable that bends the limb in a plane.

    Raises:
        LimbError: The segments cannot be split; the message gives the reason.
    """
    guides: dict[Cable, tuple[Guide, ...]] = {}
    for cable in cables:
        if arc_of(model, limb, cable) is not None:
            passed = guides_of(model, limb, cable)
            if passed is None:
                raise LimbError(f"cable {cable.name} does not run from guide to guide outwards along it")
            guides[cable] = passed
    load_n = comparison_load_n(rod)
    arcs = {cable: arc_of(model, limb, cable) for cable in guides}
    pulls = [arc.pull_n for arc in arcs.values() if arc is not None]
    original = [bend_by_load(model, limb, load_n)]
    original += [bend_by_cable(model, limb, cable, arc) for cable, arc in arcs.items() if arc is not None]
    tips = []
    for factor in (1, 2):
        written = compile_mjcf(rewrite(model, chain, limb, rod, guides, factor=factor))
        again = read_limb(written, read_structure(written).chains[0])
        tips.append(_tips(written, again, load_n, pulls))
        if factor == 1 and abs(frequency_of(written, again) / frequency_of(model, limb) - 1) > _SAME_FREQUENCY:
            raise LimbError("rewritten, it swings at another frequency: it has parts beyond this check")
    if _most_apart(limb, original, tips[0]) > _SAME_TIP_PERCENT:
        raise LimbError("rewritten, it bends differently: it has parts beyond this check")
    return _most_apart(limb, tips[0], tips[1])


def half_step_percent(model: mujoco.MjModel, structure: Structure, limbs: list[Limb]) -> float | None:
    """Return the largest distance that any limb's tip moves when the time step is halved [% of the limb's length].

    In each test one tendon actuator is ramped to the end of its range that is farther from neutral and held there, with
    the root fixed and without contacts. The robot must have a tendon actuator. None if a simulation fails.
    """
    tips = [
        _driven_tips(model, structure, [limb.bodies[-1] for limb in limbs], halved=halved) for halved in (False, True)
    ]
    if tips[0] is None or tips[1] is None:
        return None
    apart = np.linalg.norm(tips[0] - tips[1], axis=-1) / np.array([limb.length_m for limb in limbs])
    return float(100 * apart.max(initial=0.0))


def _tips(model: mujoco.MjModel, limb: Limb, load_n: float, pulls: list[float]) -> list[Tip | None]:
    found = [bend_by_load(model, limb, load_n)]
    for tendon, pull_n in enumerate(pulls):
        cable = Cable(tendon, f"t{tendon}", pull_n)
        arc = arc_of(model, limb, cable, pull_n)
        found.append(bend_by_cable(model, limb, cable, arc) if arc else None)
    return found


def _most_apart(limb: Limb, some: list[Tip | None], others: list[Tip | None]) -> float:
    if any(tip is None for tip in (*some, *others)):
        raise LimbError("no pose at rest was found")
    pairs = zip(some, others, strict=True)
    return max(tip_distance_percent(limb, one, other) for one, other in pairs if one is not None and other is not None)


def _driven_tips(model: mujoco.MjModel, structure: Structure, bodies: list[int], *, halved: bool) -> Array | None:
    """Return the centres of mass of some bodies in each test and frame, (n_tests, n_frames, n_bodies, 3) [m].

    None if a simulation fails.
    """
    stepped = copy.copy(model)
    stepped.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    stepped.opt.timestep = model.opt.timestep / (2 if halved else 1)
    swing_s = np.sqrt(structure.characteristic_length_m / STANDARD_GRAVITY_M_S2)
    duration = float(np.clip(4.0 * swing_s, _SHORTEST_S, _LONGEST_S))
    frames = max(4, round(duration / (_FRAME_STEPS * model.opt.timestep)))
    data = mujoco.MjData(stepped)
    mujoco.mj_forward(stepped, data)
    neutral = neutral_ctrl(stepped, data)
    set_act(stepped, data, neutral)
    drives = [drive for drive in read_drives(stepped, data, structure) if drive.on_tendon]
    ramp = np.minimum(1.0, np.arange(1, frames + 1) / (frames / 4))[:, None]
    runs = []
    for drive in drives[:_MOST_DRIVES]:
        goal = neutral.copy()
        goal[drive.ctrl] = max((drive.pull, drive.release), key=lambda end: abs(end - drive.neutral))
        runs.append(Simulation(stepped, integration_state(stepped, data), neutral + ramp * (goal - neutral)))
    recording = simulate(runs, frame_steps=_FRAME_STEPS * (2 if halved else 1), fields=("xipos",))
    return None if any(recording.failures) else np.asarray(recording.fields["xipos"][:, :, bodies])
