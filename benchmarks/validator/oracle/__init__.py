"""A second opinion on robots that shares no code with the validator: plain `mj_step` at half the time step.

trace       one simulation, with a record of every time step
shape       extents of geoms
loop        the tests of one robot: let it settle, drive it
signs       direction in which actuators act
still       measures that need no motion
levers      lever arms of cables
constants   unusual constants, and causes of slow motion
passive     behaviour without driving
driven      behaviour when driven
building    whether cables and motors for the robot exist
severity    size of the symptom relative to the limit, for each fault code
"""

from __future__ import annotations

from benchmarks.validator.oracle.severity import (
    BUILDING_SEVERITIES,
    SEVERITIES,
    examine_good,
    first_symptom,
    measure_of,
    severity_of,
)

__all__ = ["BUILDING_SEVERITIES", "SEVERITIES", "examine_good", "first_symptom", "measure_of", "severity_of"]
