"""A second opinion on robots that shares no code with the validator: plain `mj_step` at half the time step.

trace       one simulation, step by step, everything written down
shape       where geoms reach
loop        the tests of one robot: let it settle, drive it
signs       in which direction actuators act
still       what can be measured before anything moves
passive     what it does when nobody drives it
driven      what it does when driven
building    whether cables and motors for it exist
severity    for each fault code, how large the symptom is compared with the limit
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
