"""Values over time that the report page shows beside the report; the worker process returns them."""

from __future__ import annotations

from aidsr.core.artifacts import Artifact


class Line(Artifact):
    """One curve of a signal."""

    label: str
    values: tuple[float, ...]


class Signal(Artifact):
    """The measured quantity of a fault over the time of one test."""

    quantity: str
    unit: str
    test: str
    """Description of the test."""
    time_s: tuple[float, ...]
    lines: tuple[Line, ...]
    limits: tuple[float, ...] = ()
    first_bad_s: float | None = None
    logarithmic: bool = False
    """Whether the axis of values is logarithmic, for values that grow by orders of magnitude."""


class ActuatorTrace(Artifact):
    """The motion and force of one actuator in its own test, with all other tendons slack."""

    name: str
    pulls: str
    """Name of the tendon or joint that the actuator acts on."""
    low: float
    high: float
    effect: float
    """Largest displacement that the actuator alone causes / L."""
    tension_n: float
    """Largest tension in any test; 0 for an actuator without a tendon."""
    stroke_m: float
    time_s: tuple[float, ...] = ()
    displacement: tuple[float, ...] = ()
    """Largest displacement of any point of the robot / L, over time."""
    force_n: tuple[float, ...] = ()
    """Pulling force of the actuator, over time."""
