"""The trace of each actuator: its motion and force in its own test."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from aidsr.sim.drive import Drive
from aidsr.sim.structure import name_of
from aidsr.validation.curves import downsample, moved_over_length
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.signals import ActuatorTrace

_MOST_ACTUATORS = 64
"""Most actuators shown on a page; the report has the names of the others."""


def actuator_traces(robot: RobotUnderTest) -> Iterator[ActuatorTrace]:
    """Yield the trace of each actuator in the single test with its largest effect.

    Yields nothing for a robot that was not simulated or whose simulation of settling failed.
    """
    evidence = robot.evidence
    if evidence is None or evidence.battery is None:
        return
    moved = moved_over_length(robot)
    for index, drive in enumerate(evidence.drives[:_MOST_ACTUATORS]):
        rows = robot.single_tests([index])
        force_n = -robot.force_n(drive)
        best = max(rows, key=robot.effect_in, default=-1)
        lengths = evidence.battery.fields["ten_length"][:, :, _target(robot, drive)] if drive.on_tendon else np.zeros(1)
        frames = moved.shape[1]
        yield ActuatorTrace(
            name=robot.actuator(drive.actuator),
            pulls=_target_name(robot, drive),
            low=drive.low,
            high=drive.high,
            effect=robot.effect_of(index),
            tension_n=max(0.0, float(force_n.max())) if drive.on_tendon else 0.0,
            stroke_m=float(np.ptp(lengths)),
            time_s=downsample(np.arange(1.0, frames + 1) * evidence.battery.frame_s) if best >= 0 else (),
            displacement=downsample(moved[best]) if best >= 0 else (),
            force_n=downsample(force_n[best]) if best >= 0 else (),
        )


def _target(robot: RobotUnderTest, drive: Drive) -> int:
    return int(robot.model.actuator_trnid[drive.actuator, 0])


def _target_name(robot: RobotUnderTest, drive: Drive) -> str:
    if drive.on_tendon:
        return robot.tendon(_target(robot, drive))
    joints = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    if int(robot.model.actuator_trntype[drive.actuator]) in joints:
        return robot.joint(_target(robot, drive))
    return name_of(robot.model, mujoco.mjtObj.mjOBJ_ACTUATOR, drive.actuator)
