"""Limbs of an elastomer are plugged into what they grow from, at rest or moving, and nothing is in one place twice."""

from itertools import combinations

import numpy as np
import pytest
from fingers import BASE, finger, hand
from manifold3d import Manifold

from aidsr.fabrication.build import build_robot
from aidsr.fabrication.cut_parts import Piece
from aidsr.fabrication.inspect_parts import overlap_faults
from aidsr.fabrication.materials import material_for
from aidsr.fabrication.printers import printer_named

FDM = printer_named("fdm")


@pytest.mark.parametrize(
    ("robot", "holders"),
    [(finger(), {"link_1": "base"}), (hand(), {"link_1": "base", "left": "link_1", "right": "link_1"})],
    ids=["finger", "hand"],
)
def test_each_limb_has_a_plug_in_a_socket_of_the_piece_it_grows_from(robot: str, holders: dict[str, str]) -> None:
    made = build_robot(robot, [], FDM, material="tpu95a")
    pieces = {piece.name: piece.solid for piece in made.shaping.pieces}
    assert set(pieces) == {"base", *holders}
    for one, other in combinations(pieces.values(), 2):
        assert (one ^ other).volume() < 0.1
    assert all(len(solid.decompose()) == 1 for solid in pieces.values())
    for limb, holder in holders.items():
        plug = pieces[limb].hull() ^ pieces[holder].hull()
        assert (plug ^ pieces[limb]).volume() > 100.0


def test_pieces_in_one_place_are_told() -> None:
    up, petg = np.array([0.0, 0.0, 1.0]), material_for(FDM, "petg")[0]

    def piece(name: str, x: float) -> Piece:
        return Piece(name, (0,), Manifold.cube((10, 10, 10)).translate((x, 0, 0)), up, petg)

    (fault,) = overlap_faults((piece("a", 0), piece("b", 9), piece("c", 19)))
    assert (fault.code, fault.names, fault.measured) == ("parts_overlap", ("a and b",), pytest.approx(100.0))


def test_a_shape_of_the_base_that_lies_in_a_limb_is_told() -> None:
    post = '<geom name="post" type="box" size="0.004 0.004 0.035" pos="0.006 0 0.03" mass="0.01"/>'
    codes = {fault.code for fault in build_robot(finger(base=BASE + post), [], FDM, material="tpu95a").faults}
    assert "parts_overlap" in codes
