"""Good robots of several families are not blamed, whatever their size and however they stand."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import pytest
import robots
from robots import Limb

from aidsr.validation import validate


def passing_fingers() -> str:
    """Two fingers side by side that close past each other: at full pull their tips are farther apart than at rest."""
    text = robots.gripper(Limb(segments=8, length_m=0.12, mass_kg=0.03, radius_m=0.006, tendons=2, bend_rad=2), 2)
    text = re.sub(r'(<site name="f\d_t0_\w+" pos=")0\.0048', r"\g<1>-0.0036", text)
    for name, place in (("f0_mount", "0.015 0.015"), ("f1_mount", "-0.015 -0.015")):
        text = re.sub(rf'(<body name="{name}" pos=")\S+ \S+', rf"\g<1>{place}", text)
    return text


GOOD: dict[str, Callable[[], str]] = {
    "arm": robots.arm,
    "arm of three tendons": lambda: robots.arm(Limb(tendons=3)),
    "short arm": lambda: robots.arm(Limb(segments=5, length_m=0.15, mass_kg=0.05)),
    "soft arm": lambda: robots.arm(Limb(sag=3)),
    "gripper": robots.gripper,
    "fingers that pass each other": passing_fingers,
    "crawler": robots.crawler,
    "worm": robots.worm,
    "ring": robots.ring,
}


@pytest.mark.parametrize("name", GOOD)
def test_a_good_robot_has_no_fault(name: str) -> None:
    report = validate(GOOD[name]())
    assert report.stable
    assert report.faults == ()


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_the_verdict_does_not_depend_on_size(scale: float) -> None:
    """Lengths x s, times x sqrt(s), masses x s^3: the same motion, larger."""
    for limb in (Limb(segments=8), Limb(segments=8, sag=12)):
        larger = replace(limb, length_m=limb.length_m * scale, radius_m=limb.radius_m * scale)
        larger = replace(larger, mass_kg=limb.mass_kg * scale**3, damping_s=limb.damping_s * scale**0.5)
        reports = [validate(robots.arm(limb)), validate(robots.arm(larger, timestep_s=0.002 * scale**0.5))]
        codes = [[fault.code for fault in report.faults] for report in reports]
        assert codes[0] == codes[1]


def test_same_text_same_report() -> None:
    text = robots.gripper()
    assert validate(text) == validate(text)
