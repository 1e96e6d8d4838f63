"""Whether a robot is a tendon-driven continuum robot: what of a compiled model is out of scope.

In scope is a robot with sensors whose cables and soft body do the work. Cables pull, and bend limbs of three or more
joints in series; these limbs make up a fair share of its length and of its mass. Rigid parts beside them may carry
and touch, but nothing else drives or holds the robot: no motors in joints, wheels, jets, suction or magnets.

`find_out_of_scope(model, structure)` returns what it finds in a robot or in the robot of a scene. Motors, springs and
constraints of the environment are not the robot's.
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
from aidsr.sim.scope_contact import find_excluded_contacts, find_ghosts, find_margins
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
    find_limbs,
    find_fully_actuated,
)
"""In the order of the report."""


def find_out_of_scope(model: mujoco.MjModel, structure: Structure) -> tuple[ScopeFinding, ...]:
    """Return everything that makes a robot another kind than a tendon-driven continuum robot; empty for one in scope.

    Takes milliseconds: nothing is simulated.

    Args:
        model: Compiled robot, or scene in which a robot stands; all that follows is read in its reference pose.
        structure: `read_structure(model)`.
    """
    reader = ScopeReader(model, structure)
    return tuple(finding for find in _FINDERS for finding in find(reader))
