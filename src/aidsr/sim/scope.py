"""Scope check: find the reasons why a robot is not a tendon-driven continuum robot that a policy can control.

A robot in scope has sensors and actuators, and its cables and soft body do the work. Its cables pull, and bend limbs of
three or more joints in series; these limbs make up a fair share of its length and mass. Rigid parts may carry loads and
touch objects, but nothing else drives or holds the robot: no motors in joints, wheels, jets, suction or magnets.

`find_out_of_scope(model, structure)` checks a robot alone or the robot in a scene. Motors, springs and constraints of
the environment do not count.
"""

from __future__ import annotations

import mujoco

from aidsr.sim.scope_actuation import (
    find_fully_actuated,
    find_limbs,
    find_missing_parts,
    find_other_actuators,
    find_pushing_cables,
)
from aidsr.sim.scope_contact import (
    find_excluded_contacts,
    find_ghosts,
    find_margins,
    find_part_in_the_air,
    find_surfaces,
)
from aidsr.sim.scope_holding import (
    find_axles,
    find_locked_joints,
    find_outside_forces,
    find_outside_holds,
    find_springs,
)
from aidsr.sim.scope_reader import ScopeFinding, ScopeReader
from aidsr.sim.structure import Structure

_FINDERS = (
    find_missing_parts,
    find_other_actuators,
    find_pushing_cables,
    find_axles,
    find_springs,
    find_outside_forces,
    find_outside_holds,
    find_locked_joints,
    find_ghosts,
    find_excluded_contacts,
    find_margins,
    find_part_in_the_air,
    find_surfaces,
    find_limbs,
    find_fully_actuated,
)
"""Checks in the order of the report."""


def find_out_of_scope(model: mujoco.MjModel, structure: Structure) -> tuple[ScopeFinding, ...]:
    """Return every reason why a robot is out of scope; empty for a robot in scope.

    Takes milliseconds, since nothing is simulated.

    Args:
        model: Compiled robot, or scene with a robot; it is examined in its reference pose.
        structure: Result of `read_structure(model)`.
    """
    reader = ScopeReader(model, structure)
    return tuple(finding for find in _FINDERS for finding in find(reader))
