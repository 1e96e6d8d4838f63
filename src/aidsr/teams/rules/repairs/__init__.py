"""Repairs chosen by fault code: each a small edit of the robot's text, tried in the order of the table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from aidsr.core.artifacts import Fault
from aidsr.core.errors import MjcfError
from aidsr.teams.rules.edit import Element, parse, to_text
from aidsr.teams.rules.repairs import blocks, document, motion, strength, winches

__all__ = ["REPAIRS", "Mended", "mend"]

Repair = Callable[[Element, Fault], str | None]
"""Changes a document in place and says what it did, or None where there was nothing left for it to do."""

_CALM: tuple[Repair, ...] = (
    motion.integrate_implicitly,
    motion.damp_hinges,
    winches.damp_servos,
    motion.stiffen_limits,
    motion.halve_timestep,
    winches.soften_servos,
    motion.raise_damping,
    strength.weaken,
)

REPAIRS: dict[str, tuple[Repair, ...]] = {
    # the document
    "unknown_attribute": (document.correct_attributes,),
    "undefined_reference": (document.correct_references,),
    "duplicate_name": (document.rename_duplicates,),
    "wrong_for_type": (document.drop_contradictions,),
    "joint_range_invalid": (strength.sort_ranges,),
    "ctrlrange_invalid": (strength.sort_ranges, blocks.add_control_ranges),
    "zero_mass": (blocks.add_mass,),
    # the structure
    "no_sensors": (blocks.add_sensors,),
    "sensor_constant": (blocks.add_sensors,),
    "no_actuators": (blocks.add_winches,),
    "tendons_not_actuated": (blocks.add_winches,),
    "ctrlrange_missing": (blocks.add_control_ranges,),
    "range_inverted_ignored": (strength.sort_ranges,),
    "joint_range_too_small": (strength.widen_joint_ranges,),
    # how it moves
    "numerical_instability": _CALM,
    "energy_growth": (motion.make_damping_positive, *_CALM),
    "underdamped": (motion.raise_damping,),
    "chatter": (
        motion.integrate_implicitly,
        motion.damp_hinges,
        winches.damp_servos,
        motion.stiffen_contacts,
        motion.stiffen_limits,
        winches.soften_servos,
        motion.raise_damping,
        motion.halve_timestep,
    ),
    "limit_overrun": (motion.stiffen_limits, strength.weaken),
    "initial_penetration": (motion.exclude_overlapping,),
    "self_collision_lock": (motion.exclude_overlapping, motion.pass_through_itself),
    "contact_disabled": (blocks.allow_contact,),
    "free_fall": (winches.hold_root,),
    "base_not_attached": (winches.hold_root,),
    "gravity_collapse": (strength.stiffen_springs,),
    "passive_collapse": (motion.straighten, strength.stiffen_springs),
    "tendon_limit_violated": (strength.unlimit_tendons,),
    "tendon_against_limit": (strength.unlimit_tendons, strength.widen_joint_ranges),
    # what it can do
    "zero_gear": (strength.restore_gear,),
    "actuator_too_weak": (strength.strengthen,),
    "too_stiff": (strength.soften_springs,),
    "antagonist_lock": (winches.let_go,),
    "mass_ratio": (blocks.cap_mass,),
    "tendon_pushes": (winches.pull_only,),
    "actuator_overforce": (strength.weaken,),
    "actuator_power": (strength.weaken,),
}
"""For each fault code the edits that can remove it, mildest first."""


@dataclass(frozen=True)
class Mended:
    """A robot's text after repair.

    Attributes:
        mjcf: The text, unchanged where nothing was done.
        done: One sentence for each edit.
        helpless: Codes of faults for which there is no repair, or none that still changes anything.
    """

    mjcf: str
    done: tuple[str, ...]
    helpless: tuple[str, ...]


def mend(mjcf: str, faults: Sequence[Fault]) -> Mended:
    """Repair what can be repaired, one edit a code."""
    try:
        root = parse(mjcf)
    except MjcfError as error:
        return Mended(mjcf, (), tuple(fault.code for fault in error.faults))
    done: list[str] = []
    helpless: list[str] = []
    for fault in _by_code(faults):
        said = next((words for repair in REPAIRS.get(fault.code, ()) if (words := repair(root, fault))), None)
        if said:
            done.append(f"{fault.code}: {said}")
        else:
            helpless.append(fault.code)
    return Mended(to_text(root) if done else mjcf, tuple(done), tuple(helpless))


def _by_code(faults: Sequence[Fault]) -> list[Fault]:
    """Return one fault a code, in order, with the names of all its kind."""
    merged: dict[str, Fault] = {}
    for fault in faults:
        before = merged.get(fault.code)
        names = tuple(dict.fromkeys((*(before.names if before else ()), *fault.names)))
        merged[fault.code] = (before or fault).model_copy(update={"names": names})
    return list(merged.values())
