"""The record of a validation rule: all information about one kind of fault."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any, Literal

from aidsr.core.artifacts import Fault, Layer

if TYPE_CHECKING:
    from aidsr.validation.robot_under_test import RobotUnderTest
    from aidsr.validation.signals import Signal

Severity = Literal["error", "warning"]
Check = Callable[["RobotUnderTest"], Iterable[Fault]]
"""Finds one kind of fault, or several kinds that one measurement distinguishes."""


class Stage(Enum):
    """Stages in which rules are applied, in this order; each has the layer of its faults and a title."""

    DOCUMENT = "load", "Load: the document"
    RANGES = "structure", "Structure: ranges"
    TOPOLOGY = "structure", "Structure: one body"
    SCOPE = "scope", "Scope: a tendon-driven continuum robot"
    WIRING = "simulate", "Simulate: wiring"
    INITIAL_POSE = "simulate", "Simulate: the initial pose"
    DIVERGENCE = "simulate", "Simulate: divergence"
    PASSIVE = "simulate", "Simulate: passive"
    DRIVEN = "simulate", "Simulate: driven"
    EFFECT = "simulate", "Simulate: the effect of the actuators"
    SENSORS = "simulate", "Simulate: sensors"
    DRAWING = "realizability", "Realizability: as drawn"
    BUILDING = "realizability", "Realizability: as driven"
    """Applied only to robots without errors, scope errors aside: forces of a falling robot do not show which motors it
    needs."""

    def __init__(self, layer: Layer, title: str) -> None:
        self.layer = layer
        self.title = title


@dataclass(frozen=True)
class Example:
    """A fault that is produced by changing the example arm (`examples/arm.xml`), which has no fault.

    Attributes:
        changes: Pairs of a text in the arm and the faulty text that replaces it; every occurrence is replaced.
        arguments: Keyword arguments of `validate` with which the fault shows.
    """

    changes: tuple[tuple[str, str], ...]
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def fails(self, passes: str) -> str:
        """Return the MJCF `passes` changed so that it has the fault.

        Raises:
            ValueError: A text to change is not in `passes`.
        """
        text = passes
        for old, new in self.changes:
            if old not in text:
                raise ValueError(f"not in the example arm: {old!r}")
            text = text.replace(old, new)
        return text


@dataclass(frozen=True, kw_only=True, eq=False)
class Rule:
    """One kind of fault, in one record: the report, the order, the page and the documentation are derived from it.

    Attributes:
        code: Name of the fault in reports.
        stage: Stage in which the rule is applied; determines the layer.
        finds: What is wrong, in one sentence.
        why: Why it matters, in one or two sentences.
        limit: The measured quantity and the value beyond which it is a fault.
        check: Function that finds the fault. Rules that share a check share one measurement; the check runs once. None
            if the fault is found while the document is read.
        severity: Severity of the fault, unless the check sets another.
        unit: Unit of the measured value, unless the check sets another.
        cure: The usual cure, unless the check sets another.
        explains: Codes of the faults that are consequences of this one. They are not reported if this one is an error.
        explained_by: Codes of the faults of which this one is a consequence; for rules of other packages, which cannot
            edit the record of the cause.
        blame: Role that repairs the fault in a scene whose robot is stable when tested alone.
        signal: Function that returns the curve that shows the fault over time, for the report page; None if the fault
            has no course over time.
        example: Change to the example arm that produces the fault; None if no document can, for example for a worker
            that died.
    """

    code: str
    stage: Stage
    finds: str
    why: str
    limit: str
    check: Check | None = None
    severity: Severity = "error"
    unit: str = ""
    cure: str = ""
    explains: tuple[str, ...] = ()
    explained_by: tuple[str, ...] = ()
    blame: Literal["coder", "integrator"] = "coder"
    signal: Callable[[RobotUnderTest, Fault], Signal | None] | None = None
    example: Example | None = None

    @property
    def layer(self) -> Layer:
        """Layer of the fault: what is examined to find it."""
        return self.stage.layer

    def fault(
        self,
        message: str,
        *,
        names: Iterable[str] = (),
        measured: float | None = None,
        limit: float | None = None,
        unit: str | None = None,
        whole: float | None = None,
        whole_unit: str = "",
        severity: Severity | None = None,
        likely_cause: str = "",
        cure: str | None = None,
        first_time_s: float | None = None,
    ) -> Fault:
        """Return a fault of this kind; see `aidsr.core.artifacts.Fault` for the fields."""
        return Fault(
            code=self.code,
            layer=self.layer,
            severity=self.severity if severity is None else severity,
            names=tuple(names),
            measured=measured,
            limit=limit,
            unit=self.unit if unit is None else unit,
            whole=whole,
            whole_unit=whole_unit,
            message=message,
            likely_cause=likely_cause,
            cure=self.cure if cure is None else cure,
            first_time_s=first_time_s,
        )
