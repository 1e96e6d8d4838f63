"""Mass and inertia belong to the shapes of a body."""

from __future__ import annotations

import pytest

from aidsr.validation import validate
from aidsr.validation.rules_page import EXAMPLE_ARM

CODE = "implausible_inertia"


def _faults(new: str, old: str = '<geom name="g6"/>'):
    assert old in EXAMPLE_ARM
    return validate(EXAMPLE_ARM.replace(old, new), select=[CODE]).faults


def _inertial(pos: str, mass: float, diagonal: str) -> str:
    return f'<geom name="g6"/><inertial pos="{pos}" mass="{mass}" diaginertia="{diagonal}"/>'


@pytest.mark.parametrize("mass", [0.01, 1e-9])
def test_a_body_that_turns_harder_than_its_mass_can_is_found(mass):
    (fault,) = _faults(_inertial("0 0 0.0125", mass, "100 100 0.001"))
    assert fault.names == ("s6",)
    assert "moment of inertia" in fault.message


def test_a_mass_away_from_its_body_is_found():
    (fault,) = _faults(_inertial("0 0 -0.3", 0.01, "1e-7 1e-7 1e-7"))
    assert fault.names == ("s6",)
    assert "centre of mass" in fault.message
    assert fault.measured == pytest.approx(0.3 / (2 * (0.011**2 + 0.011**2 + 0.012**2) ** 0.5), rel=0.01)


def test_a_weight_at_the_edge_of_its_body_is_none():
    assert not _faults(_inertial("0 0 0.024", 0.01, "1e-8 1e-8 1e-8"))


def test_geoms_of_a_welded_child_are_shapes_of_the_body():
    assert not _faults(
        '<inertial pos="0 0 0.1" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/>'
        '<body name="long"><geom name="g6" size="0.011 0.06" pos="0 0 0.06"/></body>'
    )


def test_a_body_without_shapes_has_the_room_of_its_neighbours():
    ring = '<body name="ring" pos="0 0 0.025"><joint name="jr"/>'
    ring += '<inertial pos="0 0 {}" mass="0.01" diaginertia="{}"/></body>'
    assert not _faults('<geom name="g6"/>' + ring.format("0", "1e-6 1e-6 1e-6"))
    assert _faults('<geom name="g6"/>' + ring.format("0.2", "1e-6 1e-6 1e-6"))
    assert _faults('<geom name="g6"/>' + ring.format("0", "1e-3 1e-3 1e-3"))


@pytest.mark.parametrize("attribute", ["stiffness", "damping", "frictionloss", "armature"])
def test_a_free_joint_that_resists_is_found(attribute):
    free = EXAMPLE_ARM.replace('<body name="base">', f'<body name="base"><joint type="free" {attribute}="0.1"/>')
    (fault,) = validate(free, select=["free_joint_resists"], mount="free").faults
    assert attribute in fault.message


def test_a_free_joint_without_defaults_is_free():
    free = EXAMPLE_ARM.replace('<body name="base">', '<body name="base"><freejoint/>')
    assert not validate(free, select=["free_joint_resists"], mount="free").faults
