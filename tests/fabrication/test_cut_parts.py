"""Pieces that exceed the bed are cut, with pins in the plastic on both sides; what gives pins no room stays whole."""

import numpy as np
import pytest
from fingers import finger
from manifold3d import Manifold

from aidsr.fabrication.build import build_robot
from aidsr.fabrication.cut_parts import Piece, cut_across
from aidsr.fabrication.materials import material_for
from aidsr.fabrication.printers import printer_named

FDM = printer_named("fdm")
PETG = material_for(FDM, "petg")[0]


def piece(solid: Manifold) -> Piece:
    return Piece("post", (0,), solid, np.array([0.0, 0.0, 1.0]), PETG)


def test_a_piece_that_fits_stays_whole() -> None:
    whole = piece(Manifold.cube((20, 20, 100)))
    assert cut_across(whole, FDM) == (whole,)


def test_a_long_post_is_cut_until_it_fits_and_loses_only_the_pins_holes() -> None:
    post = Manifold.cube((20, 30, 700))
    halves = cut_across(piece(post), FDM)
    assert [half.name for half in halves] == [f"post_slice_{n}" for n in range(1, 5)]
    assert all(half.cut for half in halves)
    for half in halves:
        x0, y0, z0, x1, y1, z1 = half.solid.bounding_box()
        assert FDM.fits((x1 - x0, y1 - y0, z1 - z0)) or FDM.fits((y1 - y0, z1 - z0, x1 - x0))
    kept = sum(half.solid.volume() for half in halves)
    hole_mm3 = np.pi * ((1.75 + FDM.fit_mm) / 2) ** 2 * 10.0
    assert post.volume() - kept == pytest.approx(2 * hole_mm3 * (len(halves) - 1), rel=0.1)


def test_a_thin_pipe_without_room_for_pins_stays_whole() -> None:
    pipe = Manifold.cylinder(400, 10, 10, 64) - Manifold.cylinder(400, 9, 9, 64)
    whole = piece(pipe)
    assert cut_across(whole, FDM) == (whole,)


POST = '<geom name="post" type="cylinder" size="0.02 0.35" pos="0 0 -0.35" mass="0.8"/>'
BRACKET = '<geom name="bracket" type="box" size="0.05 0.02 0.01" pos="0.03 0 -0.25" mass="0.01"/>'


@pytest.mark.parametrize(
    ("robot", "names"),
    [
        (finger(base=POST + BRACKET), {"base_slice_1", "base_slice_2", "base_slice_3", "base_slice_4", "link_1"}),
        (
            finger(["base_slice_2", "tip"], base=POST + BRACKET),
            {"base_slice_1", "base_slice_2", "base_slice_3", "base_slice_4", "base_slice_2_2"},
        ),
        (finger([f"link_{n}" for n in range(16)]), {"base", "link_0_slice_1", "link_0_slice_2"}),
        (finger(["solid_base", "tip"], base_name="solid base"), {"solid_base", "solid_base_2"}),
        (finger(["arm_upper", "tip"]), {"base", "arm_upper"}),
    ],
    ids=[
        "a long post",
        "a body named as a slice",
        "a long limb",
        "names that are one as a file",
        "a body with a name of before",
    ],
)
def test_every_piece_has_a_name_and_a_file_of_its_own(robot: str, names: set[str]) -> None:
    made = build_robot(robot, [], FDM, material="tpu95a")
    assert len({piece.name for piece in made.shaping.pieces}) == len(made.shaping.pieces)
    assert {part.name for part in made.parts} == names
    assert any(piece.cut for piece in made.shaping.pieces) == ("_slice_1" in "".join(names))
