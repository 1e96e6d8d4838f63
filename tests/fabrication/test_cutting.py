"""Pieces that exceed the bed are cut, with pins in the plastic on both sides; what gives pins no room stays whole."""

import numpy as np
import pytest
from manifold3d import Manifold

from aidsr.fabrication.cutting import Piece, cut_across
from aidsr.fabrication.materials import material_for
from aidsr.fabrication.printers import printer_named

FDM = printer_named("fdm")
PETG = material_for(FDM, "petg")[0]


def piece(solid: Manifold) -> Piece:
    return Piece("post", (0,), solid, np.array([0.0, 0.0, 1.0]), PETG)


def test_a_piece_that_fits_stays_whole() -> None:
    whole = piece(Manifold.cube((20, 20, 100)))
    assert list(cut_across(whole, FDM)) == [whole]


def test_a_long_post_is_cut_until_it_fits_and_loses_only_the_pins_holes() -> None:
    post = Manifold.cube((20, 30, 700))
    halves = list(cut_across(piece(post), FDM))
    assert [half.name for half in halves] == ["post", "post_upper", "post_upper", "post_upper_upper"][: len(halves)]
    for half in halves:
        x0, y0, z0, x1, y1, z1 = half.solid.bounding_box()
        assert FDM.fits((x1 - x0, y1 - y0, z1 - z0)) or FDM.fits((y1 - y0, z1 - z0, x1 - x0))
    kept = sum(half.solid.volume() for half in halves)
    hole_mm3 = np.pi * ((1.75 + FDM.fit_mm) / 2) ** 2 * 10.0
    assert post.volume() - kept == pytest.approx(2 * hole_mm3 * (len(halves) - 1), rel=0.1)


def test_a_thin_pipe_without_room_for_pins_stays_whole() -> None:
    pipe = Manifold.cylinder(400, 10, 10, 64) - Manifold.cylinder(400, 9, 9, 64)
    assert len(list(cut_across(piece(pipe), FDM))) == 1
