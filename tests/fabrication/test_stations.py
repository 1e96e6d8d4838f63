"""A spool is sized for its line: bent gently, tied through a hole it fits, wound in one layer, with sound walls."""

import math

import numpy as np
import pytest

from aidsr.core.motors import catalogue
from aidsr.fabrication.anatomy import Anatomy, Cable
from aidsr.fabrication.checks import thinnest_wall_mm
from aidsr.fabrication.materials import lines
from aidsr.fabrication.printers import PRINTERS, Printer
from aidsr.fabrication.solids import rounded
from aidsr.fabrication.stations import Drum, seat_of, spool
from aidsr.fabrication.winches import Demand, choose_winches

SEATS = {motor.name: seat_of(motor) for motor in catalogue()}
HORN, SHAFT = SEATS["Feetech STS3215-C018"], SEATS["Pololu 25D gearmotor 20.4:1 HP 12 V"]


@pytest.mark.parametrize("printer", PRINTERS, ids=lambda printer: printer.name)
@pytest.mark.parametrize("reach_mm", [5.0, 6.5, 7.0, 8.5, 9.0, 10.0, 12.5, 13.0, 30.0])
def test_no_wall_of_a_spool_is_thinner_than_printers_make(reach_mm: float, printer: Printer) -> None:
    for line in (line for line in lines() if reach_mm >= 5.5 * line.diameter_mm):
        for seat in (HORN, SHAFT):
            solid = spool(seat, Drum(reach_mm, line.diameter_mm), printer)
            assert len(solid.decompose()) == 1
            assert thinnest_wall_mm(solid) >= printer.wall_mm


@pytest.mark.parametrize("line", lines(), ids=lambda line: line.label)
def test_a_line_can_be_tied_to_its_spool(line) -> None:
    solid = spool(HORN, Drum(10.0, line.diameter_mm), PRINTERS[0])
    across = np.array([20.0, 0.0, 0.0])
    probes = [
        rounded(h - across, h + across, line.diameter_mm / 2) for h in np.outer(np.arange(1.5, 6, 0.1), [0, 0, 1])
    ]
    assert min((probe ^ solid).volume() for probe in probes) == 0.0


@pytest.mark.parametrize("pull_n", [10.0, 60.0, 120.0, 200.0])
def test_a_spool_bends_its_line_gently_and_holds_it_in_one_layer(pull_n: float) -> None:
    cable = Cable(tendon="a", actuator="a", guides=(), wraps=False, length_mm=100, largest_pull_n=pull_n, torques_mm={})
    asked = Demand(pull_n, 0.02, 0.3)
    (winch,) = choose_winches(Anatomy(parts=(), joints=(), cables=(cable,)), {"a": asked}, {})
    drum, line = winch.drum, winch.line
    assert 2 * drum.radius_mm >= 10 * line.diameter_mm
    assert drum.radius_mm + line.diameter_mm / 2 == pytest.approx(1000 * winch.fit.spool_radius_m)
    assert drum.width_mm >= (winch.fit.turns + 1.5) * line.diameter_mm
    _, _, low, _, _, high = spool(HORN, drum, PRINTERS[0]).bounding_box()
    assert high - low == pytest.approx(drum.width_mm + 3.0 + 3.0)
    assert math.degrees(math.atan(drum.width_mm / 2 / drum.free_run_mm)) < 7
