"""Cables are measured on the finished solids: all of a duct, and all of the way from part to part."""

import numpy as np
import pytest
from fingers import finger
from manifold3d import Manifold

from aidsr.fabrication.build import build_robot
from aidsr.fabrication.cut_parts import Piece
from aidsr.fabrication.inspect_parts import passages
from aidsr.fabrication.materials import line_for, material_for, sheath_for
from aidsr.fabrication.printers import printer_named
from aidsr.fabrication.routing import Duct, bore_for
from aidsr.fabrication.shape_parts import Shaping

FDM = printer_named("fdm")
PETG = material_for(FDM, "petg")[0]
UP = np.array([0.0, 0.0, 1.0])


def test_the_wall_of_a_duct_is_found_all_the_way_to_its_sheath() -> None:
    line = line_for(10.0)
    bore = bore_for(line, sheath_for(line), FDM)
    path = np.array([38 * UP, 39 * UP])
    duct = Duct(0, 0, 1, path, 37 * UP, 40 * UP, sheathed=True, ends=False, seat=0 * UP, open_mm=0.0)
    block = Manifold.cube((20, 20, 40)).translate((-10, -10, 0))
    for hole in duct.drills(bore):
        block -= hole
    shaping = Shaping((Piece("base", (0,), block, UP, PETG),), (), (duct,), 0.0)
    (found,) = passages(shaping, (bore,), (line.diameter_mm / 2,))
    assert found.sound, found


@pytest.mark.parametrize(
    ("robot", "names"),
    [
        (finger(cable_m=0.006), ()),
        (
            finger(cable_m=0.006, unguided=["link_2"]),
            ("flex between link_1 and link_3", "extend between link_1 and link_3"),
        ),
    ],
    ids=["guided everywhere", "through a link without a guide"],
)
def test_cables_are_checked_on_their_way_from_guide_to_guide(robot: str, names: tuple[str, ...]) -> None:
    faults = build_robot(robot, [], FDM, material="tpu95a").faults
    blocked = [fault for fault in faults if fault.code == "tendon_through_body"]
    assert [fault.names for fault in blocked] == [names] * bool(names)
