"""What each actuator did."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from aidsr.sim.structure import name_of
from aidsr.validation.case import Case
from aidsr.validation.drive import Drive
from aidsr.validation.page.sampling import thinned
from aidsr.validation.page.signals import moved_over_length
from aidsr.validation.page.traces import ActuatorTrace

__all__ = ["actuator_traces"]

_MOST_ACTUATORS = 64
"""Told on a page; robots with more are seen by their names in the report."""


def actuator_traces(case: Case) -> Iterator[ActuatorTrace]:
    """Yield what each actuator did in its own test; nothing for a robot that did not survive settling."""
    evidence = case.evidence
    if evidence is None or evidence.battery is None:
        return
    moved = moved_over_length(case)
    for index, drive in enumerate(evidence.drives[:_MOST_ACTUATORS]):
        rows = case.single_tests([index])
        force_n = -case.force_n(drive)
        best = max(rows, key=case.effect_in, default=-1)
        lengths = evidence.battery.fields["ten_length"][:, :, _target(case, drive)] if drive.on_tendon else np.zeros(1)
        frames = moved.shape[1]
        yield ActuatorTrace(
            name=case.actuator(drive.actuator),
            pulls=_target_name(case, drive),
            low=drive.low,
            high=drive.high,
            effect=case.effect_of(index),
            tension_n=max(0.0, float(force_n.max())) if drive.on_tendon else 0.0,
            stroke_m=float(np.ptp(lengths)),
            time_s=thinned(np.arange(1.0, frames + 1) * evidence.battery.frame_s) if best >= 0 else (),
            displacement=thinned(moved[best]) if best >= 0 else (),
            force_n=thinned(force_n[best]) if best >= 0 else (),
        )


def _target(case: Case, drive: Drive) -> int:
    return int(case.model.actuator_trnid[drive.actuator, 0])


def _target_name(case: Case, drive: Drive) -> str:
    if drive.on_tendon:
        return case.tendon(_target(case, drive))
    joints = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    if int(case.model.actuator_trntype[drive.actuator]) in joints:
        return case.joint(_target(case, drive))
    return name_of(case.model, mujoco.mjtObj.mjOBJ_ACTUATOR, drive.actuator)
