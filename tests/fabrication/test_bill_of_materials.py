"""Rods are bought by the metre: they weigh in the robot as built, and are no plastic in bill and list of parts."""

import json
import math
from pathlib import Path

import pytest
from fingers import finger

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
