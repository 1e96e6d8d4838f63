"""Loose cables and thin walls, on both sides of their limits."""

from __future__ import annotations

import faulty
import pytest

from aidsr.core.artifacts import Fault
from aidsr.validation import validate
from aidsr.validation.rules.slack import SLACK_SHARE


def found(text: str, code: str) -> list[Fault]:
    return [fault for fault in validate(text, realizable=True).faults if fault.code == code]


@pytest.mark.parametrize(("upper_m", "loose"), [(0.204, False), (0.206, False), (0.225, True), (0.4, True)])
def test_a_servo_may_let_out_its_stroke_and_no_more(upper_m: float, loose: bool) -> None:
    faults = found(faulty.long_servos(upper_m), "tendon_slack")
    assert bool(faults) == loose
    assert all(fault.severity == "warning" and (fault.measured or 0) > SLACK_SHARE for fault in faults)


def test_what_is_measured_is_the_share_of_commands() -> None:
    """Servos from 0.18 m, with a path that reaches 0.197 m: half of the commands to 0.219 m are idle."""
    (fault,) = found(faulty.long_servos(0.219), "tendon_slack")
    assert fault.measured == pytest.approx(0.5, abs=0.05)


def test_a_force_actuator_is_never_slack() -> None:
    assert not found(faulty.arm(), "tendon_slack")


@pytest.mark.parametrize(("thickness_mm", "thin"), [(0.4, True), (0.75, True), (0.85, False), (1.6, False)])
def test_a_wall_can_be_printed(thickness_mm: float, thin: bool) -> None:
    faults = found(faulty.thin_plate(thickness_mm / 1000), "thin_wall")
    assert [fault.names for fault in faults] == ([("plate",)] if thin else [])
    assert [fault.measured for fault in faults] == ([pytest.approx(thickness_mm)] if thin else [])


def test_decoration_has_no_walls() -> None:
    plate = faulty.thin_plate(0.0004).replace('name="plate"', 'name="plate" contype="0" conaffinity="0"')
    assert not found(plate, "thin_wall")


def _with_densities(**densities: float) -> str:
    """An arm with the densities of some geoms [kg/m3]."""
    text = faulty.arm()
    for geom, density in densities.items():
        text = faulty.swapped(rf'(<geom name="{geom}"[^>]*?) (mass|density)="[^"]*"', rf'\1 density="{density}"', text)
    return text


def test_the_worst_density_is_the_farthest_beyond_its_limit() -> None:
    (fault,) = found(_with_densities(g3=0.5, g5=4.9), "implausible_density")
    assert set(fault.names) == {"s3", "s5"}
    assert fault.measured == pytest.approx(0.5)
    (fault,) = found(_with_densities(g3=25_000, g5=0.1), "implausible_density")
    assert fault.measured == pytest.approx(0.1)
    assert fault.limit == pytest.approx(5)


def test_the_mass_of_a_fixed_base_is_no_fault() -> None:
    assert not found(_with_densities(base=50_000), "implausible_density")
