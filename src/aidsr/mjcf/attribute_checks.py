"""Checks of attribute values: `fromto` that does not fit its element, also from a default class, and bad numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.mjcf.defaults import default_classes, is_placed, setting
from aidsr.mjcf.elements import Element, attributes, elements, load_fault, numbers
from aidsr.mjcf.names import REFERENCES

_STRETCHED = frozenset({"capsule", "cylinder", "box", "ellipsoid"})
"""Geom and site types that can be given by `fromto`. Source: MuJoCo XML reference, body/geom/fromto."""
LARGEST = 1e15
"""Largest allowed magnitude of a number. Our choice: the stiffness of steel in SI units is 1e11, and products of a few
such numbers stay finite."""
_TEXT = frozenset({"name", "prefix", "sep", "model", "data", "objname", "refname", *REFERENCES})
"""Attributes that hold text, not numbers."""


def check_fromto(root: Element) -> Iterator[Fault]:
    """Yield a fault for each geom or site with a `fromto` that does not fit its type, or with both `fromto` and `pos`.

    MuJoCo treats a `pos` of zeros as absent and uses `fromto`, so this is no fault.
    """
    classes = default_classes(root)
    for element in elements(root, "geom", "site"):
        if not is_placed(element):
            continue
        fromto, pos = (setting(element, name, classes) for name in ("fromto", "pos"))
        kind = setting(element, "type", classes)
        shape = kind.value if kind else "sphere"
        if fromto and shape not in _STRETCHED:
            yield load_fault(
                "wrong_for_type",
                element,
                f"has fromto{fromto.origin} and is a {shape}{kind.origin if kind else ''}, which has no two ends",
                cure='use pos, or type="capsule" with one radius in size',
            )
        elif fromto and pos and any(numbers(pos.value)):
            yield load_fault(
                "wrong_for_type",
                element,
                f"has both fromto{fromto.origin} and pos{pos.origin}",
                cure="keep one of them: fromto already says where it is",
            )


def check_finite(root: Element) -> Iterator[Fault]:
    """Yield a fault for each NaN, infinity that is not the open end of a range, and number larger than `LARGEST`."""
    for element in elements(root):
        for attribute, value in attributes(element):
            if attribute in _TEXT:
                continue
            found = numbers(value)
            if any(map(math.isnan, found)) or (not attribute.endswith("range") and any(map(math.isinf, found))):
                yield load_fault("bad_value", element, f'{attribute}="{value[:60]}" is not a finite number')
            elif any(LARGEST < abs(number) < math.inf for number in found):
                problem = f'{attribute}="{value[:60]}" is too large: numbers are at most {LARGEST:g}'
                cure = "write inf where a range is open" if attribute.endswith("range") else "use SI units"
                yield load_fault("bad_value", element, problem, cure=cure)
