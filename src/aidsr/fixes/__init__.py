"""Automatic fixes of an MJCF document. Each fix has one record, with the fault codes that it cures.

    fix = aidsr.fix(mjcf)                        apply all safe fixes: those with only one possible meaning
    fix = aidsr.fix(mjcf, faults=report.errors)  for each fault, apply the mildest fix that changes something

    markup    text that is not well-formed XML
    naming    misspelt attributes, duplicate names, references to names that do not exist
    shapes    fromto with a wrong type, contradicting attributes, faulty paths of tendons
    ranges    ranges that have no flag or are inverted, in degrees, too narrow or missing
    contact   overlaps, contact within the robot, geoms that cannot touch anything
    parts     missing sensors, actuators and mass; roots that fall
    motion    integrator, damping, time step, stiffness of limits and contacts
    strength  forces, gains and springs

To add a fix, write a function in the module of its subject, and its record at the end of that module.
"""

from aidsr.fixes.engine import fix, leave_as_written
from aidsr.fixes.record import Fix, FixResult
from aidsr.fixes.registry import FIXES

__all__ = ["FIXES", "Fix", "FixResult", "fix", "leave_as_written"]
