"""The record of a rule: everything there is to know about one kind of fault."""

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
"""Looks for one kind of fault, or for several that one measurement distinguishes."""


class Stage(Enum):
    """When rules are applied, in this order, and the layer of their faults."""

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
    """Applied only to robots without an error: forces of a robot that falls say nothing about its motors."""

    def __init__(self, layer: Layer, title: str) -> None:
        self.layer = layer
        self.title = title


@dataclass(frozen=True)
class Example:
    """A fault brought about by changing the example arm (`examples/arm.xml`), which has none.

    Attributes:
        changes: Pairs of text: what passes, and what fails in its place; every occurrence is replaced.
        arguments: Keywords of `validate`.
    """

    changes: tuple[tuple[str, str], ...]
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def fails(self, passes: str) -> str:
        """Return MJCF with the fault.

        Raises:
            ValueError: The text to change is not in `passes`.
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
        code: Name of the fault, as in reports.
        stage: When it is looked for; gives the layer.
        finds: What is wrong, in one sentence.
        why: Why that matters, in a sentence or two.
        limit: What is measured, and from where it is a fault.
        check: Looks for the fault. Rules that share a check share one measurement; it runs once. None where the fault
            is found while the document is read.
        severity: Of the fault, unless the check says otherwise.
        unit: Of the measured value, unless the check says otherwise.
        cure: The usual cure, unless the check says otherwise.
        explains: Codes of faults that are consequences of this one: where it is an error they are not reported.
        explained_by: Codes of faults of which this one is a consequence; for rules of other packages, which cannot
            edit the record of the cause.
        blame: Role that repairs it in a scene whose robot is stable alone.
        signal: Returns the curve that shows a fault over time, for the page of the report; None where time plays no
            part.
        example: A change to the example arm that brings it about; None where no document can, as for a worker that
            died.
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
        """What has to be looked at to find the fault."""
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
