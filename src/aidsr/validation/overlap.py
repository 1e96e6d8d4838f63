"""Decide by a counterfactual simulation whether an overlap causes a divergence, instead of assuming it."""

from __future__ import annotations

import copy
from collections.abc import Sequence

from aidsr.core.artifacts import Fault
from aidsr.validation.counterfactuals import without_contacts_of
from aidsr.validation.protocol import gather_evidence
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rules.initial_pose import overlaps

REFUTED = frozenset({("initial_penetration", "numerical_instability")})
"""The explanation, as (cause, consequence), that is wrong if the robot also diverges without its overlapping
contacts."""

_ADDED = {
    ("initial_penetration", True): "; the simulation fails, and no longer does without the contacts of these parts",
    ("numerical_instability", False): ", and just so without the contacts of the parts that overlap",
}


def overlap_explains_divergence(robot: RobotUnderTest) -> bool | None:
    """Return whether a robot with an overlap and a divergence no longer diverges without the overlapping contacts.

    None if the robot does not have both errors. The whole protocol is run again on a changed copy of the model.
    """
    codes = {fault.code for fault in robot.found if fault.severity == "error"}
    if not {"initial_penetration", "numerical_instability"} <= codes:
        return None
    changed = copy.copy(robot.model)
    ours = {geom for overlap in overlaps(robot) if overlap.acts for geom in overlap.geoms}
    without_contacts_of(sorted(ours & set(robot.structure.geoms)))(changed)
    evidence = gather_evidence(changed, robot.structure)
    return not RobotUnderTest(model=changed, structure=robot.structure, evidence=evidence).diverges


def with_verdict(faults: Sequence[Fault], explains: bool) -> list[Fault]:
    """Return the faults, with the result of the counterfactual added to the messages of overlap and divergence."""
    added = {code: text for (code, verdict), text in _ADDED.items() if verdict == explains}
    return [
        fault.model_copy(update={"message": fault.message + added[fault.code]})
        if fault.code in added and fault.severity == "error"
        else fault
        for fault in faults
    ]
