"""Motors do what the tests recorded, and what none can do is told."""

import math
from pathlib import Path

import pytest
from exported import ROBOTS, made, report

from aidsr.core.artifacts import ValidationReport
from aidsr.core.motors import fastest_motor
from aidsr.fabrication.anatomy import Anatomy, Cable, Part
from aidsr.fabrication.bill_of_materials import bill
from aidsr.fabrication.package import write_package
from aidsr.fabrication.printers import printer_named
from aidsr.fabrication.stations import seat_of, station
from aidsr.fabrication.winches import MOST_EXTRA, Demand, Winch, choose_winches, demands, winch_faults


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


def _winches(asked: dict[str, Demand]) -> tuple[Winch, ...]:
    """Return the winches of a held robot's cables with these demands, each as long as the others."""
    turn = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    base = Part(
        name="base",
        bodies=("base",),
        body_ids=(1,),
        shapes=(),
        position_mm=(0, 0, 0),
        rotation=turn,
        mass_kg=1,
        held=True,
    )
    cables = tuple(
        Cable(tendon=name, actuator=name, guides=(), wraps=False, length_mm=100.0, largest_pull_n=10.0, torques_mm={})
        for name in asked
    )
    return choose_winches(Anatomy(parts=(base,), joints=(), cables=cables), asked, {})


ANTAGONISTS = {"curl": Demand(25.7, 0.1185, 0.0562), "uncurl": Demand(15.42, 0.0646, 0.0536)}
"""What the cables of a tentacle with two antagonists demand, of which the cheapest motors are of two types."""


@pytest.mark.parametrize("speed_m_s", [0.01, 0.1, 0.3, 1.0, 5.0])
@pytest.mark.parametrize("tension_n", [2.0, 20.0, 80.0])
def test_each_motor_can_be_commanded_to_the_positions_of_the_control_table(tension_n: float, speed_m_s: float) -> None:
    (winch,) = _winches({"pull": Demand(tension_n, speed_m_s, 0.3)})
    assert winch.fit is not None
    assert winch.fit.motor.position_turns is not None
    assert winch.fit.turns <= winch.fit.motor.position_turns


def test_antagonists_have_one_type_of_motor() -> None:
    alone = {one.fit.motor.name for name, asked in ANTAGONISTS.items() for one in _winches({name: asked}) if one.fit}
    assert len(alone) == 2
    assert len({winch.fit.motor.name for winch in _winches(ANTAGONISTS) if winch.fit}) == 1


def test_motors_differ_where_one_type_would_cost_more_than_twice_as_much() -> None:
    asked = {"strong": Demand(150.0, 0.1, 0.1)} | {f"weak_{n}": Demand(10.0, 0.01, 0.02) for n in range(3)}
    prices = {name: winch.fit.motor.price_usd for name, winch in zip(asked, _winches(asked), strict=True) if winch.fit}
    assert 4 * prices["strong"] > MOST_EXTRA * sum(prices.values())
    assert prices["weak_0"] < prices["strong"]


def test_a_cable_that_is_too_fast_for_all_motors_gets_the_fastest() -> None:
    (winch,) = _winches({"pull": Demand(20.0, 5.0, 0.05)})
    fastest = fastest_motor(winch.demand.at_winch_n, 0.05, cable_m=winch.line.diameter_mm / 1000, by_position=True)
    assert winch.fit == fastest
    assert not winch.fast_enough


def test_cables_are_cut_for_the_spools_that_alike_motors_share() -> None:
    asked = {"slow": Demand(10.0, 0.01, 0.02), "quick": Demand(10.0, 0.12, 0.05)}
    winches = _winches(asked)
    assert len({(winch.fit.motor.name, winch.fit.spool_radius_m) for winch in winches}) == 1
    for winch in winches:
        radius_mm = 1000 * winch.fit.spool_radius_m
        stand = station(seat_of(winch.fit.motor), winch.drum, winch.sheath, printer_named("fdm"))
        to_sheath = stand.bounding_box()[3] - 5.0 - 6.0
        wound = 1.5 * 2 * math.pi * radius_mm + 1000 * winch.demand.stroke_m
        assert 0 <= winch.cut_mm - (100.0 + 300.0 + to_sheath + wound + 60.0) < 10.0


def test_a_robot_that_nothing_holds_drags_longer_sheaths(tmp_path: Path) -> None:
    held, free = made("gripper"), made("crawler")
    assert {winch.sheath_mm for winch in held.winches} == {300.0}
    assert {winch.sheath_mm for winch in free.winches} == {2000.0}
    assert all(winch.cut_mm > winch.inside_mm + 2000.0 for winch in free.winches)
    (item,) = [item for item in bill(free) if item.used_for == "sheaths"]
    assert item.amount == f"{len(free.winches)} x 2000 mm"
    write_package(tmp_path, free, title="a crawler")
    assert "include the sheath of 2000 mm" in (tmp_path / "sheet.html").read_text()


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
