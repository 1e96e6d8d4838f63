"""How deep bodies are in each other, as a share of half the thinner one."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from aidsr.sim.deep_overlap import DEEP, DeepOverlap, OverlapProbe, half_thickness_m, passing_pairs
from aidsr.sim.extent import half_width_m
from aidsr.sim.structure import read_structure

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
    structure = replace(read_structure(model), geoms=tuple(model.geom(name).id for name in names))
    return OverlapProbe(model, structure).look(mujoco.MjData(model), model.qpos0)


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


def test_a_height_field_is_as_thick_as_a_plane() -> None:
    hills = '<asset><hfield name="flat" nrow="8" ncol="8" size="1 1 0.01 0.001"/></asset>'
    ground = '<geom name="floor" type="hfield" hfield="flat"/>'
    model = mujoco.MjModel.from_xml_string(
        BALLS.replace("<worldbody>", f"{hills}<worldbody>").replace(
            '<geom name="floor" type="plane" size="1 1 1"/>', ground
        )
    )
    structure = replace(read_structure(model), geoms=(model.geom("sunk").id,))
    found = OverlapProbe(model, structure).look(mujoco.MjData(model), model.qpos0)
    assert found is not None
    assert found.share == pytest.approx(0.01 / 0.05, rel=0.01)


def test_half_the_thickness_of_every_shape_is_half_its_width() -> None:
    model = mujoco.MjModel.from_xml_string("""
        <mujoco>
          <asset>
            <hfield name="flat" nrow="8" ncol="8" size="1 1 0.1 0.01"/>
            <mesh name="wedge" vertex="0 0 0  0.1 0 0  0 0.1 0  0 0 0.1"/>
          </asset>
          <worldbody>
            <geom type="plane" size="1 1 1"/> <geom type="hfield" hfield="flat"/>
            <geom type="sphere" size="0.1"/> <geom type="capsule" size="0.1 0.2"/>
            <geom type="ellipsoid" size="0.1 0.2 0.3"/> <geom type="cylinder" size="0.1 0.05"/>
            <geom type="box" size="0.3 0.2 0.1"/> <geom type="mesh" mesh="wedge"/>
          </worldbody>
        </mujoco>""")
    assert half_thickness_m(model).tolist() == [half_width_m(model, geom) for geom in range(model.ngeom)]
    assert np.isinf(half_thickness_m(model)).tolist() == [True, True] + 6 * [False]


def test_what_is_not_the_robots_does_not_count() -> None:
    assert look() is None


GRIPPER = """
<mujoco>
  <default><geom type="capsule" size="0.01" contype="1" conaffinity="0"/></default>
  <worldbody>
    <body name="palm"><geom name="palm" type="box" size="0.05 0.02 0.01" contype="0"/>
      <body pos="-0.03 0 0.03"><joint axis="0 1 0"/><geom name="left" fromto="0 0 0 0 0 0.05"/>
        <body name="left_tip" pos="0 0 0.07"><joint name="left" axis="0 1 0"/>
          <geom name="left_tip" fromto="0 0 0 0 0 0.05"/></body></body>
      <body pos="0.03 0 0.03"><joint axis="0 1 0"/><geom name="right" fromto="0 0 0 0 0 0.05"/>
        <body name="right_tip" pos="0 0 0.07"><joint name="right" axis="0 1 0"/>
          <geom name="right_tip" fromto="0 0 0 0 0 0.05"/></body></body>
    </body>
  </worldbody>
</mujoco>"""
EXCLUDED = '</worldbody><contact><exclude body1="left_tip" body2="right_tip"/></contact>'
PAIRED = '</worldbody><contact><pair geom1="left_tip" geom2="right_tip"/></contact>'
JOINED = '</worldbody><equality><weld body1="left_tip" body2="right_tip"/></equality>'


def passing(text: str) -> set[frozenset[str]]:
    model = mujoco.MjModel.from_xml_string(text)
    pairs = passing_pairs(model, read_structure(model))
    return {frozenset(model.geom(geom).name for geom in pair) for pair in pairs}


def test_fingers_pass_through_each_other_by_contype_and_conaffinity() -> None:
    """The fingers are neighbours, up to two steps apart, and so are the palm and each tip."""
    assert passing(GRIPPER) == {
        frozenset({"left", "right_tip"}),
        frozenset({"left_tip", "right"}),
        frozenset({"left_tip", "right_tip"}),
    }
    assert passing(GRIPPER.replace('conaffinity="0"', 'conaffinity="1"')) == set()


@pytest.mark.parametrize("end", [EXCLUDED, PAIRED, JOINED], ids=["excluded", "paired", "joined"])
def test_pairs_that_the_document_names_do_not_pass(end: str) -> None:
    assert frozenset({"left_tip", "right_tip"}) not in passing(GRIPPER.replace("</worldbody>", end))


def test_geoms_that_touch_nothing_do_not_pass() -> None:
    assert passing(GRIPPER.replace('contype="1"', 'contype="0"')) == set()


@pytest.mark.parametrize("affinity", [0, 1], ids=["contact off", "contact on"])
def test_tips_in_each_other_overlap_as_deep_with_contact_off(affinity: int) -> None:
    model = mujoco.MjModel.from_xml_string(GRIPPER.replace('conaffinity="0"', f'conaffinity="{affinity}"'))
    probe, data = OverlapProbe(model, read_structure(model)), mujoco.MjData(model)
    assert probe.look(data, model.qpos0) is None
    bent = np.zeros(model.nq)
    bent[[model.joint("left").qposadr[0], model.joint("right").qposadr[0]]] = 0.9, -0.9
    found = probe.look(data, bent)
    assert found is not None
    assert {model.geom(geom).name for geom in found.geoms} == {"left_tip", "right_tip"}
    assert found.share == pytest.approx(2.0, abs=0.05)
    assert found.share > DEEP
    assert found.passes == (affinity == 0)
