"""Motors do what the tests recorded, and what none can do is told."""

import math

import pytest
from exported import ROBOTS, made, report

from aidsr.core.artifacts import ValidationReport
from aidsr.fabrication.anatomy import Anatomy, Cable
from aidsr.fabrication.printers import printer_named
from aidsr.fabrication.stations import seat_of, station
from aidsr.fabrication.winches import Demand, choose_winches, demands, winch_faults


@pytest.mark.parametrize("robot", ROBOTS)
def test_motors_hold_the_recorded_forces_speeds_and_strokes(robot: str) -> None:
    robot_made, recorded = made(robot), report(robot).measurements["motors"]
    assert len(robot_made.winches) == len(recorded)
    for winch in robot_made.winches:
        asked = recorded[robot_made.anatomy.cables[winch.cable].actuator]
        fit, radius = winch.fit, winch.fit.spool_radius_m
        assert fit.torque_share <= 1
        assert fit.motor.torque_n_m("held") >= asked["tension_n"] * radius
        assert fit.motor.speed_rad_s(asked["tension_n"] * radius) * radius >= asked["speed_m_s"]
        assert fit.turns * 2 * 3.1416 * radius >= asked["stroke_m"] * 0.999


def test_cables_are_cut_for_the_spools_that_alike_motors_share() -> None:
    asked = {"slow": Demand(10.0, 0.01, 0.02), "quick": Demand(10.0, 0.12, 0.05)}
    cables = tuple(
        Cable(tendon=name, actuator=name, guides=(), wraps=False, length_mm=100.0, largest_pull_n=10.0, torques_mm={})
        for name in asked
    )
    winches = choose_winches(Anatomy(parts=(), joints=(), cables=cables), asked, {})
    assert len({(winch.fit.motor.name, winch.fit.spool_radius_m) for winch in winches}) == 1
    for winch in winches:
        radius_mm = 1000 * winch.fit.spool_radius_m
        stand = station(seat_of(winch.fit.motor), winch.drum, winch.sheath, printer_named("fdm"))
        to_sheath = stand.bounding_box()[3] - 5.0 - 6.0
        wound = 1.5 * 2 * math.pi * radius_mm + 1000 * winch.demand.stroke_m
        assert 0 <= winch.cut_mm - (100.0 + 300.0 + to_sheath + wound + 60.0) < 10.0


def test_a_scenes_report_names_the_same_actuators() -> None:
    whole = made("arm")
    name, asked = next(iter(report("arm").measurements["motors"].items()))
    scene = ValidationReport(stable=True, measurements={"motors": {f"robot/{name}": asked | {"tension_n": 99.0}}})
    assert demands(whole.anatomy, [report("arm"), scene])[name].tension_n == 99.0


def test_pulls_that_no_motor_holds_are_told() -> None:
    anatomy = made("arm").anatomy
    strong = {
        name: asked | {"tension_n": 5000.0, "speed_m_s": 0.1}
        for name, asked in report("arm").measurements["motors"].items()
    }
    asked = demands(anatomy, [ValidationReport(stable=True, measurements={"motors": strong})])
    codes = {fault.code for fault in winch_faults(anatomy, choose_winches(anatomy, asked, {}))}
    assert codes == {"cable_stroke", "cable_strength"}


def test_an_actuator_nobody_tested_is_told() -> None:
    anatomy = made("arm").anatomy
    faults = list(winch_faults(anatomy, choose_winches(anatomy, demands(anatomy, []), {})))
    assert [fault.code for fault in faults] == ["cable_stroke"]
    assert len(faults[0].names) == len(anatomy.cables)


def test_each_winch_fault_says_how_to_cure_it() -> None:
    anatomy = made("arm").anatomy
    idle = tuple(cable.model_copy(update={"actuator": ""}) for cable in anatomy.cables)
    untested = list(winch_faults(anatomy, ()))
    undriven = list(winch_faults(anatomy.model_copy(update={"cables": idle}), ()))
    strong = {cable.actuator: Demand(5000.0, 0.1, 0.02) for cable in anatomy.cables}
    quick = {cable.actuator: Demand(10.0, 5.0, 0.02) for cable in anatomy.cables}
    overloaded = [
        fault for asked in (strong, quick) for fault in winch_faults(anatomy, choose_winches(anatomy, asked, {}))
    ]
    cures = {(fault.code, fault.measured is None): fault.cure for fault in (*untested, *undriven, *overloaded)}
    assert "errors" in cures["cable_stroke", True]
    assert "actuator" in cures["cable_idle", True]
    assert "shorten their stroke" in cures["cable_stroke", False]
    assert "damping" in cures["actuator_speed", False]
    assert len(set(cures.values())) == len(cures) == 5
