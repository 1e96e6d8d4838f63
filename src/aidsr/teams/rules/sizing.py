"""Sizing rules the families share: lengths from the job, stiffness and damping from beam theory."""

from __future__ import annotations

import math

import numpy as np

from aidsr.sim import beam
from aidsr.teams.rules.job import Job
from aidsr.teams.rules.orientation import stands_in_front

_DAMPING_TIME_RANGE_S = (0.02, 0.1)
"""Recommended damping times beta = c / k [s]. Source: docs/physics.md, recommendation."""

_MORE_DAMPING = 1.4
"""Ratio of damping times when more damping is requested. Our choice."""

_SPRING_STEEL_PA = 200e9
"""Young's modulus of spring steel. Source: EN 10270-1 wire, 206 GPa; rounded down for the effect of fittings."""

_DEFAULT_LENGTH_M = 0.35
"""Length of an arm if the environment has no target [m]. Our choice: middle of the benchmark's 0.1 to 0.6 m."""

LENGTH_RANGE_M = (0.15, 0.7)
"""Shortest and longest arm that is made for a target [m]. Our choice: around the benchmark's 0.1 to 0.6 m."""
_START_GAP_M = 0.018
"""Gap at the start to a target in front of a mount that can move towards it [m]. Our choice."""


def reach_length(job: Job, rng: np.random.Generator) -> float:
    """Return the length of an arm that just bends to the target [m]: 3 to 9 % more than the straight distance.

    Source: 160 random pulls by each of three arms at four positions of the benchmark's button. 8 % of them pressed it
    with 1.03 times the straight distance, 6 % with 1.09, 4 % with 1.15; longer arms have to fold up first.

    An arm that has to lie along the target is twice as long: half of it for the way, half on the surface. In a search
    of constant pulls for six positions of the benchmark's surface, arms of three sections lay there with at most 0.33
    of their length if they only just reached it, and with 0.53 if they were twice as long.

    An arm whose mount moves towards the target must start clear of it and is accordingly shorter.
    """
    if job.target is None:
        return _DEFAULT_LENGTH_M * rng.uniform(0.95, 1.1)
    if job.kind == "conform":
        return float(np.clip(job.target.distance_m * rng.uniform(1.9, 2.1), *LENGTH_RANGE_M))
    if job.kind == "insert":
        return float(np.clip(job.target.near_m - rng.uniform(0.03, 0.05), *LENGTH_RANGE_M))
    if stands_in_front(job) and job.approach_m > 0:
        free = job.target.along_m - job.target.half_width_m - _START_GAP_M
        return float(np.clip(free - rng.uniform(0.0, 0.012), *LENGTH_RANGE_M))
    return float(np.clip(job.target.distance_m * rng.uniform(1.03, 1.09), *LENGTH_RANGE_M))


def bending_stiffness(tension_n: float, offset_m: float, length_m: float, full_bend_rad: float) -> float:
    """Return the bending stiffness with which full tension bends such a section by `full_bend_rad` [N m^2]."""
    return beam.cable_bending(tension_n, offset_m, length_m, full_bend_rad)


def damping_time(
    bending_stiffness_n_m2: float, density_kg_m3: float, radius_m: float, length_m: float, *, damping_ratio: float
) -> float:
    """Return the damping time beta with which a limb's first mode has this damping ratio, within its range [s]."""
    mass_per_length = density_kg_m3 * math.pi * radius_m**2
    frequency = beam.first_bending_frequency(bending_stiffness_n_m2, mass_per_length, length_m)
    return float(np.clip(beam.stiffness_damping_time(damping_ratio, frequency), *_DAMPING_TIME_RANGE_S))


def more_damping(time_s: float) -> float:
    """Return the damping time after a request for more damping [s]: 1.4 times as much, up to the most."""
    return round(min(time_s * _MORE_DAMPING, beam.MOST_DAMPING_TIME_S), 3)


def rod(bending_stiffness_n_m2: float) -> str:
    """Return the spring-steel rod of this bending stiffness as text, such as "a spring-steel rod of 1.2 mm"."""
    return f"a spring-steel rod of {1000.0 * beam.rod_diameter(bending_stiffness_n_m2, _SPRING_STEEL_PA):.1f} mm"
