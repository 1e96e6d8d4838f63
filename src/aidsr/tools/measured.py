"""Result of a measurement: named figures with units, and lines of explanation."""

from __future__ import annotations

from aidsr.core.artifacts import Artifact
from aidsr.core.formatting import format_number

_NOTHING = 1e-6
"""Absolute value below which a value counts as zero, in any unit. Our choice: a nanometre in mm; smaller values are
rounding errors of the simulation."""


def format_value(value: float) -> str:
    """Return a measured value as text with three digits."""
    return format_number(value if abs(value) >= _NOTHING else 0.0)


class Figure(Artifact):
    """One measured number."""

    name: str
    value: float
    unit: str = ""
    note: str = ""
    """Time or place of the measurement, in a clause."""

    @property
    def text(self) -> str:
        """The value with its unit."""
        return f"{format_value(self.value)} {self.unit}".strip()

    @property
    def cell(self) -> str:
        """The value and note for a cell of a table; the unit is in the column's title."""
        return f"{format_value(self.value)} {self.note}".strip()


class Measured(Artifact):
    """The result of one measurement."""

    figures: tuple[Figure, ...]
    lines: tuple[str, ...] = ()
    """Lines of details behind the figures."""
    remark: str = ""
    """Remark after the figures in a row of a table."""
    setting: str = ""
    """Description of the variation, before the figures in a row of a table."""

    def figure(self, name: str) -> float:
        """Return the value of a figure.

        Raises:
            KeyError: There is no such figure.
        """
        return {figure.name: figure.value for figure in self.figures}[name]

    @property
    def text(self) -> str:
        """One line with all figures, followed by `lines`."""
        return "\n".join(["; ".join(f"{each.name} {each.text}" for each in self.figures), *self.lines])
