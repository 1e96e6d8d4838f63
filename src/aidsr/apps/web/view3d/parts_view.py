"""A view of printed parts as an element of a page: each kind once, as it lies on the print bed, from its STL file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from nicegui.element import Element

_STATIC = Path(__file__).parents[1] / "static" / "view3d"


@dataclass(frozen=True)
class PlacedPart:
    """One kind of part."""

    name: str
    letter: str
    """Label of one or two characters, shown at the part."""
    about: str
    """Tooltip."""
    address: str
    """Address of its STL file, which is in millimetres."""
    rgb: tuple[float, float, float]


class PartsView(Element, component=_STATIC / "parts_view.js", esm={"aidsr-view3d": str(_STATIC)}):
    """Printed parts in 3-D, which can be rotated and clicked. The view fills its parent, which must have a height.

    Args:
        parts: Parts on the print bed.
        title: Description for screen readers and for file names of saved pictures.
    """

    def __init__(self, parts: Sequence[PlacedPart], *, title: str) -> None:
        super().__init__()
        self._props["parts"] = [asdict(part) for part in parts]
        self._props["title"] = title

    def choose(self, name: str) -> None:
        """Highlight a part, given by its name, in each watching browser, as if it were clicked there."""
        self.run_method("choose", name)
