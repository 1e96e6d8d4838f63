"""Fixes of an MJCF document by code: one record for each, keyed by the fault codes that it cures.

    fix = aidsr.fix(mjcf)                        every fix with only one possible meaning, no question asked
    fix = aidsr.fix(mjcf, faults=report.errors)  for each fault the first fix that changes something, mildest first

    markup    what keeps the text from being XML
    naming    misspelt attributes, names used twice, references to nothing
    shapes    fromto where it cannot be, attributes that contradict each other, guides named twice in a row
    ranges    limits without their flag, inverted, in degrees, too narrow, missing
    contact   overlaps, contact within the robot, shapes that touch nothing
    parts     missing sensors, actuators and mass; roots that fall
    motion    integrator, damping, time step, stiffness of limits and contacts
    strength  forces, gains and springs

To add one: a function in the module of its subject, and its record at the end of that module.
"""

from aidsr.fixes.engine import fix, leave_as_written
from aidsr.fixes.record import Fix, FixResult
from aidsr.fixes.registry import FIXES

__all__ = ["FIXES", "Fix", "FixResult", "fix", "leave_as_written"]
