"""Exact answers for elastic rods, against published and closed-form ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

from aidsr.sim.beam import CLAMPED_FREE_FIRST_MODE, first_bending_frequency
from aidsr.sim.elastica import Rod, curved_tip, first_frequency, loaded_tip


def uniform_rod(length_m: float, bending_stiffness_n_m2: float, mass_kg: float = 0.0) -> Rod:
    """Return a rod of one piece."""
    return Rod(np.array([length_m]), np.array([bending_stiffness_n_m2]), np.array([mass_kg / length_m]))


@pytest.mark.parametrize(("alpha", "transverse"), [(1.0, 0.30172), (2.0, 0.49346), (3.0, 0.60325), (10.0, 0.81061)])
def test_a_tip_load_bends_as_published(alpha: float, transverse: float) -> None:
    """Bisshopp and Drucker, Quarterly of Applied Mathematics 3 (1945), 272: large deflections of cantilevers."""
    tip = loaded_tip(uniform_rod(0.3, 0.04), load_n=alpha * 0.04 / 0.3**2)
    assert tip.transverse_m / 0.3 == pytest.approx(transverse, abs=2e-5)


def test_weight_bends_as_measured_in_the_docs() -> None:
    rod = uniform_rod(0.3, 0.04, mass_kg=20 * 0.04 / (9.81 * 0.3**2))
    assert loaded_tip(rod, gravity_m_s2=9.81).transverse_m / 0.3 == pytest.approx(0.830, abs=5e-4)


def test_small_loads_bend_linearly() -> None:
    rod = uniform_rod(0.5, 2.0, mass_kg=0.2)
    assert loaded_tip(rod, load_n=1e-3).transverse_m == pytest.approx(1e-3 * 0.5**3 / (3 * 2.0), rel=1e-6)
    gravity = 1e-3
    assert loaded_tip(rod, gravity_m_s2=gravity).transverse_m == pytest.approx(
        0.2 * gravity * 0.5**3 / (8 * 2.0), rel=1e-6
    )
    assert loaded_tip(rod).transverse_m == 0.0


def test_pieces_of_one_rod_are_that_rod() -> None:
    whole = uniform_rod(0.4, 0.1, mass_kg=0.2)
    cut = Rod(np.array([0.1, 0.25, 0.05]), np.full(3, 0.1), np.full(3, 0.5))
    assert loaded_tip(cut, load_n=1.0, gravity_m_s2=9.81).transverse_m == pytest.approx(
        loaded_tip(whole, load_n=1.0, gravity_m_s2=9.81).transverse_m, rel=1e-7
    )
    assert first_frequency(cut) == pytest.approx(first_frequency(whole), rel=1e-5)


def test_a_weight_at_the_tip_is_a_tip_load() -> None:
    rod = Rod(np.array([0.3]), np.array([0.04]), np.zeros(1), tip_mass_kg=0.1)
    loaded = loaded_tip(uniform_rod(0.3, 0.04), load_n=0.981)
    assert loaded_tip(rod, gravity_m_s2=9.81).transverse_m == pytest.approx(loaded.transverse_m)
    longer = Rod(np.array([0.3]), np.array([0.04]), np.zeros(1), tip_mass_kg=0.1, tip_offset_m=0.02)
    assert loaded_tip(longer, gravity_m_s2=9.81).transverse_m > loaded_tip(rod, gravity_m_s2=9.81).transverse_m


def test_the_first_frequency_is_the_textbooks() -> None:
    assert first_frequency(uniform_rod(0.3, 0.04, 0.1)) == pytest.approx(
        first_bending_frequency(0.04, 0.1 / 0.3, 0.3), rel=2e-4
    )
    assert first_frequency(uniform_rod(1.0, 1.0, 1.0)) == pytest.approx(CLAMPED_FREE_FIRST_MODE, rel=2e-4)


def test_a_heavy_tip_swings_like_a_mass_on_a_spring() -> None:
    rod = Rod(np.array([0.3]), np.array([0.04]), np.array([1e-6]), tip_mass_kg=1.0)
    assert first_frequency(rod) == pytest.approx(math.sqrt(3 * 0.04 / 0.3**3), rel=1e-4)


def test_arcs_end_where_circles_do() -> None:
    tip = curved_tip(np.array([0.1, 0.2]), np.array([5.0, 5.0]))
    assert (tip.along_m, tip.transverse_m) == pytest.approx((math.sin(1.5) / 5, (1 - math.cos(1.5)) / 5))
    assert tip.angle_rad == pytest.approx(1.5)
    assert curved_tip(np.array([0.1]), np.zeros(1)).along_m == pytest.approx(0.1)
