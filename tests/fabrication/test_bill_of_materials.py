"""Rods are bought by the metre: they weigh in the robot as built, and are no plastic in bill and list of parts."""

import json
import math
from pathlib import Path

import pytest
from exported import made
from fingers import finger

from aidsr.fabrication.bill_of_materials import bill
from aidsr.fabrication.build import build_robot
from aidsr.fabrication.package import write_package
from aidsr.fabrication.printers import printer_named


def test_rods_weigh_in_the_robot_and_are_not_printed(tmp_path: Path) -> None:
    made = build_robot(finger(), [], printer_named("sla"))  # which prints full, so that volume says what plastic weighs
    assert made.shaping.rods
    rods_kg = 0.0
    for rod in made.shaping.rods:
        backbone = made.hinges.backbones[rod.backbone]
        rods_kg += math.pi / 4 * backbone.diameter_mm**2 * rod.length_mm * 1e-9 * backbone.rod.density_kg_m3
    plastic_kg = sum(piece.solid.volume() for piece in made.shaping.pieces) * 1e-9 * made.material.density_kg_m3
    verdict = write_package(tmp_path, made, title="a finger")
    assert verdict.built_g == pytest.approx(1000 * (plastic_kg + rods_kg), rel=0.003)
    listed = json.loads((tmp_path / "parts.json").read_text())
    assert sum(part["mass_g"] * part["copies"] for part in listed) == pytest.approx(1000 * plastic_kg, rel=0.005)
    (printed,) = [item for item in json.loads((tmp_path / "bill.json").read_text()) if "to print" in item["what"]]
    assert printed["cost_usd"] == pytest.approx(plastic_kg * made.material.cost_usd_kg, abs=0.01)


@pytest.mark.parametrize(
    ("base", "screws"),
    [("base", [("4", "foot")]), ("free", [])],
)
def test_a_robot_without_winches_needs_screws_only_for_its_foot(base: str, screws: list[tuple[str, str]]) -> None:
    mjcf = finger(actuators="")
    if base == "free":
        mjcf = mjcf.replace('<body name="base">', '<body name="base"><freejoint/>')
    items = bill(build_robot(mjcf, [], printer_named("sla")))
    assert [(item.amount, item.used_for) for item in items if item.what.startswith("screw")] == screws
    assert not [item for item in items if item.amount == "0"]


def test_screws_and_sleeves_are_counted_for_each_winch() -> None:
    amounts = {item.what: (item.amount, item.used_for) for item in bill(made("arm"))}
    winches = len(made("arm").winches)
    assert amounts["crimp sleeve or bead, 2 mm"] == (str(winches), "tied ends")
    assert amounts["screw M4 x 12"] == (str(4 * winches + 4), "motor mounts, foot")


def test_servos_are_strapped_into_their_mounts_and_their_spools_screwed_on(tmp_path: Path) -> None:
    items = {item.what: (item.amount, item.used_for) for item in bill(made("gripper"))}
    winches = len(made("gripper").winches)
    assert items["cable tie, at most 5 mm wide"] == (str(winches), "motors in their mounts")
    assert items["screw for the horn or output flange of a motor"] == (str(4 * winches), "spools")
    assert "cable tie, at most 5 mm wide" not in {item.what for item in bill(made("arm"))}, "whose motors are no boxes"
    write_package(tmp_path, made("gripper"), title="a gripper")
    sheet = (tmp_path / "sheet.html").read_text()
    assert "cable tie through the slot" in sheet
    assert "four screws" in sheet[sheet.index("cable tie through") :]


def test_what_drives_and_fixes_the_winches_is_listed_without_a_price(tmp_path: Path) -> None:
    unpriced = {item.what: item.used_for for item in bill(made("arm", "tpu95a")) if item.cost_usd is None}
    (motor,) = {winch.fit.motor for winch in made("arm", "tpu95a").winches if winch.fit}
    for expected in (
        f"power supply of {motor.voltage_v:g} V",
        f"adapter from USB to {motor.name.split()[0]} motors",
        "board",
        "cyanoacrylate with primer for elastomers",
    ):
        assert expected in unpriced
    verdict = write_package(tmp_path, made("arm", "tpu95a"), title="an arm")
    assert set(verdict.unpriced) == set(unpriced)
    assert f"USD, without {', '.join(verdict.unpriced)}" in (tmp_path / "sheet.html").read_text()


def test_a_robot_without_winches_needs_no_power_and_no_board() -> None:
    items = [item.what for item in bill(build_robot(finger(actuators=""), [], printer_named("sla")))]
    assert not [what for what in items if what.startswith(("power", "adapter", "board"))]
    assert "cyanoacrylate or epoxy" in items, "its rods are glued"


def test_prices_are_whole_cents() -> None:
    costs = [item.cost_usd for item in bill(made("gripper")) if item.cost_usd is not None]
    assert costs == [round(cost, 2) for cost in costs]
