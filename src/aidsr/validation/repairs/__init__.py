"""Mechanical repairs: faults of a document with one possible meaning, put right by code so that nobody need be asked.

    markup      what keeps the text from being XML
    naming      misspelt attributes, names used twice, classes that do not exist
    shapes      fromto where it cannot be, guides named twice in a row
    ranges      limits without their flag, inverted, in degrees, of ball joints
    attachment  overlaps of a link with what it is jointed to

A robot without such faults comes back as it was, byte for byte.
"""

from aidsr.validation.repairs.repairing import REPAIRS, Repaired, leave_as_written, repair

__all__ = ["REPAIRS", "Repaired", "leave_as_written", "repair"]
