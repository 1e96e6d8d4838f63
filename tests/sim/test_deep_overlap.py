"""How deep bodies are in each other, as a share of half the thinner one."""

from __future__ import annotations

import mujoco
import pytest

from aidsr.sim.deep_overlap import DeepOverlap, deepest_overlap, half_thickness_m

BALLS = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body pos="0 0 0.11"><freejoint/><geom name="large" size="0.1"/></body>
    <body pos="0 0.12 0.18"><freejoint/><geom name="small" size="0.05"/></body>
    <body pos="0 1 0.04"><freejoint/><geom name="sunk" size="0.05"/></body>
  </worldbody>
</mujoco>"""


def look(*names: str) -> DeepOverlap | None:
    model = mujoco.MjModel.from_xml_string(BALLS)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return deepest_overlap(data, half_thickness_m(model), {model.geom(name).id for name in names})


def test_it_counts_by_half_the_thinner_part() -> None:
    found = look("large")
    assert found is not None
    assert found.geoms == (1, 2)
    assert found.depth_m == pytest.approx(0.15 - (0.12**2 + 0.07**2) ** 0.5)
    assert found.share == pytest.approx(found.depth_m / 0.05)


def test_a_plane_is_as_thick_as_any() -> None:
    found = look("sunk")
    assert found is not None
    assert found.geoms == (0, 3)
    assert found.share == pytest.approx(0.01 / 0.05)


def test_what_is_not_the_robots_does_not_count() -> None:
    assert look() is None
