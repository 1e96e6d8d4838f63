"""What a measurement brings: named figures with units, and lines that explain them."""

from __future__ import annotations

from aidsr.core.artifacts import Artifact
from aidsr.core.formatting import format_number

_NOTHING = 1e-6
"""Values below are rounding of the simulation. Our choice: a nanometre in mm, in every unit used here."""


def format_value(value: float) -> str:
    """Return a measured value to three digits."""
    return format_number(value if abs(value) >= _NOTHING else 0.0)


class Figure(Artifact):
    """One measured number."""

    name: str
    value: float
    unit: str = ""
    note: str = ""
    """When or where it was, in a clause."""

    @property
    def text(self) -> str:
        """The number with its unit."""
        return f"{format_value(self.value)} {self.unit}".strip()

    @property
    def cell(self) -> str:
        """The number as a cell of a table, whose column has the unit."""
        return f"{format_value(self.value)} {self.note}".strip()


class Measured(Artifact):
    """One measurement."""

    figures: tuple[Figure, ...]
    lines: tuple[str, ...] = ()
    """What the figures were read off, one thing each."""
    remark: str = ""
    """What a row of a table says behind its figures."""
    setting: str = ""
    """What sets the variation apart in which it was measured; a row of a table says it before its figures."""

    def figure(self, name: str) -> float:
        """Return the value of a figure.

        Raises:
            KeyError: There is no such figure.
        """
        return {figure.name: figure.value for figure in self.figures}[name]

    @property
    def text(self) -> str:
        """The figures in a line, then the lines."""
        return "\n".join(["; ".join(f"{each.name} {each.text}" for each in self.figures), *self.lines])
