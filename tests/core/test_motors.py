"""The motor catalogue is sound, and the motor found for a cable can pull it."""

from __future__ import annotations

import math

import pytest

from aidsr.core.motors import CONTINUOUS_SHARE, Motor, catalogue, cheapest_motor, fastest_motor, fit

SERVO = Motor(
    name="servo",
    voltage_v=12,
    stall_torque_n_m=2.0,
    no_load_speed_rpm=60,
    price_usd=10,
    price_date="2026",
    source="test",
)


@pytest.mark.parametrize("motor", catalogue(), ids=lambda motor: motor.name)
def test_every_motor_is_a_motor(motor: Motor) -> None:
    held, brief = motor.torque_n_m("held"), motor.torque_n_m("brief")
    assert 0 < held <= brief < math.inf
    assert 0 < motor.speed_rad_s(held) < 100
    assert held * motor.speed_rad_s(held) < 50, "W; nothing of this size gives more"
    assert motor.source
    assert (motor.price_usd is None) == (motor.price_date == "")
    assert motor.mass_kg is None or 0.005 < motor.mass_kg < 0.5


def test_the_catalogue_is_sorted_by_price_and_has_the_families() -> None:
    prices = [motor.price_usd or math.inf for motor in catalogue()]
    assert prices == sorted(prices)
    assert len({motor.name for motor in catalogue()}) == len(prices) >= 20
    makers = {motor.name.split()[0] for motor in catalogue()}
    assert {"ROBOTIS", "Feetech", "TowerPro", "Pololu"} <= makers


def test_torque_and_speed_follow_the_straight_line() -> None:
    assert SERVO.torque_n_m("held") == pytest.approx(CONTINUOUS_SHARE * 2.0)
    assert SERVO.torque_n_m("brief") == pytest.approx(1.0)
    assert SERVO.speed_rad_s(0.0) == pytest.approx(2 * math.pi)
    assert SERVO.speed_rad_s(1.0) == pytest.approx(math.pi)
    assert SERVO.speed_rad_s(3.0) == 0.0


def test_a_fit_holds_what_it_promises() -> None:
    found = fit(SERVO, 20.0, 0.05, 0.1)
    assert found is not None
    assert found.torque_n_m == pytest.approx(20.0 * found.spool_radius_m)
    assert found.torque_share <= 1.0
    assert found.speed_m_s == pytest.approx(SERVO.speed_rad_s(found.torque_n_m) * found.spool_radius_m)
    assert found.turns * 2 * math.pi * found.spool_radius_m == pytest.approx(0.1)
    assert found.power_w == pytest.approx(20.0 * found.speed_m_s)
    smaller = found.spool_radius_m - 0.0005
    assert SERVO.speed_rad_s(20.0 * smaller) * smaller < 0.05, "a smaller spool would have done"


def test_a_thick_cable_bends_around_ten_times_its_diameter() -> None:
    found = fit(SERVO, 20.0, 0.0, 0.1, cable_m=0.0016)
    assert found is not None
    assert found.spool_radius_m == pytest.approx(0.009), "a drum of 8.2 mm, and half of the cable"
    assert fit(SERVO, 20.0, 0.0, 0.1, cable_m=0.006) is None
    thinner = cheapest_motor(20.0, 0.0, 0.1)
    assert thinner is not None
    assert thinner.spool_radius_m < found.spool_radius_m


@pytest.mark.parametrize(("force", "speed", "stroke"), [(100.0, 0.01, 0.01), (20.0, 0.2, 0.01), (20.0, 0.01, 5.0)])
def test_too_much_force_speed_or_stroke_does_not_fit(force: float, speed: float, stroke: float) -> None:
    assert fit(SERVO, force, speed, stroke) is None


def test_a_servo_that_does_not_turn_endlessly_has_little_stroke() -> None:
    hobby = SERVO.model_copy(update={"travel_deg": 180.0})
    assert fit(hobby, 10.0, 0.0, 0.05) is not None
    assert fit(hobby, 10.0, 0.0, 0.2) is None
    assert fit(SERVO, 10.0, 0.0, 0.2) is not None


def test_the_cheapest_is_taken_first() -> None:
    found = cheapest_motor(20.0, 0.02, 0.05)
    assert found is not None
    for motor in catalogue()[: catalogue().index(found.motor)]:
        assert fit(motor, 20.0, 0.02, 0.05) is None
    assert found.motor.name in str(found)


def test_strong_worms_need_drives_and_impossible_cables_nothing() -> None:
    strong = cheapest_motor(150.0, 0.1, 0.1)
    assert strong is not None
    assert strong.motor.rated_speed_rpm is not None
    assert cheapest_motor(150.0, 3.0, 0.1) is None
    fastest = fastest_motor(150.0, 0.1)
    assert fastest is not None
    assert 0.1 < fastest.speed_m_s < 3.0
    assert fastest_motor(5000.0) is None


def test_only_motors_with_their_own_controller_are_commanded_to_positions() -> None:
    assert {motor.name.split()[0] for motor in catalogue() if motor.position_turns is None} == {"Pololu", "TowerPro"}
    assert fit(SERVO, 10.0, 0.0, 0.02) is not None
    assert fit(SERVO, 10.0, 0.0, 0.02, by_position=True) is None
    controlled = SERVO.model_copy(update={"position_turns": 2.0})
    found = fit(controlled, 10.0, 0.0, 0.1, by_position=True)
    assert found is not None
    assert found.turns <= 2.0
    smallest = fit(controlled, 10.0, 0.0, 0.1)
    assert smallest is not None
    assert smallest.turns > 2.0


def test_what_is_given_for_moments_may_be_more_than_what_is_held() -> None:
    assert fit(SERVO, 80.0, 0.01, 0.02) is not None
    assert fit(SERVO, 120.0, 0.01, 0.02) is None
    assert fit(SERVO, 120.0, 0.01, 0.02, load="brief") is not None
