"""An overlap explains a divergence only where the robot does not diverge without it."""

from __future__ import annotations

import faulty

from aidsr.validation import validate


def _with_ball(text: str) -> str:
    """A sphere around a segment, in which the next but one stands."""
    ball = '<geom name="ball" type="sphere" size="0.03" mass="0.001"/>'
    return faulty.swapped(r'(<body name="s4" [^>]*>)', rf"\1{ball}", text)


def test_a_divergence_that_the_overlap_causes_is_told_with_it() -> None:
    """Contacts so stiff that the overlap throws the robot apart."""
    report = validate(faulty.swapped(r'<geom solref="0.004 1"/>', '<geom solref="-1e8 -1"/>', _with_ball(faulty.arm())))
    (fault,) = report.faults
    assert fault.code == "initial_penetration"
    assert "no longer does without the contacts" in fault.message
    assert report.measurements["overlap_explains_divergence"] is True


def test_a_divergence_with_a_cause_of_its_own_stands_beside_the_overlap() -> None:
    report = validate(_with_ball(faulty.unstable()))
    overlap, divergence = report.faults
    assert (overlap.code, divergence.code) == ("initial_penetration", "numerical_instability")
    assert "just so without the contacts" in divergence.message
    assert divergence.likely_cause.startswith("too stiff for the time step")
    assert report.measurements["overlap_explains_divergence"] is False


def test_without_a_divergence_nothing_is_tried() -> None:
    report = validate(_with_ball(faulty.arm()))
    assert [fault.code for fault in report.faults] == ["initial_penetration"]
    assert "overlap_explains_divergence" not in report.measurements
