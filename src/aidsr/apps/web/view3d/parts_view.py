"""Parts to print as a part of a page: each kind once, as it lies on the bed, drawn from its STL file."""

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
    """A letter or two that stand at it."""
    about: str
    """Tooltip."""
    address: str
    """Of its STL file, in millimetres."""
    rgb: tuple[float, float, float]


class PartsView(Element, component=_STATIC / "parts_view.js", esm={"aidsr-view3d": str(_STATIC)}):
    """Printed parts in 3-D, to be turned and pointed at. It fills its parent, which must have a height.

    Args:
        parts: What lies on the bed.
        title: What it is, for those who cannot see it and for the names of pictures.
    """

    def __init__(self, parts: Sequence[PlacedPart], *, title: str) -> None:
        super().__init__()
        self._props["parts"] = [asdict(part) for part in parts]
        self._props["title"] = title

    def choose(self, name: str) -> None:
        """Highlight a part in each watching browser, as if clicked there."""
        self.run_method("choose", name)
