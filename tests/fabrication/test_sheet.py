"""The sheet tells a builder what is to be done with these pieces, and nothing else."""

from pathlib import Path

import pytest
from fingers import finger

from aidsr.core.artifacts import Fault
from aidsr.fabrication.build import build_robot
from aidsr.fabrication.package import write_package
from aidsr.fabrication.printers import printer_named
from aidsr.fabrication.schema import Retest

LONG = '<geom name="post" type="cylinder" size="0.02 0.2" pos="0 0 -0.2" mass="0.5"/>'


@pytest.mark.parametrize(
    ("robot", "glued"),
    [(finger(["link", "tip"], base=LONG), True), (finger(["arm_upper", "tip"]), False)],
    ids=["a post too long for the bed", "a body with a name as of an upper half"],
)
def test_only_pieces_that_were_cut_are_to_be_glued(robot: str, glued: bool, tmp_path: Path) -> None:
    write_package(tmp_path, build_robot(robot, [], printer_named("fdm"), material="tpu95a"), title="a finger")
    assert ("Glue the pieces that were cut" in (tmp_path / "sheet.html").read_text()) == glued


@pytest.mark.parametrize(
    ("layer", "said"), [("realizability", "moves without a fault"), ("simulate", "has faults of motion")]
)
def test_the_sheet_tells_faults_of_motion_from_those_of_winches(layer: str, said: str, tmp_path: Path) -> None:
    fault = Fault(code="actuator_overforce", layer=layer, severity="error", message="pulls too hard")
    retest = Retest(stable=layer == "realizability", reach_m=0.1, designed_reach_m=0.1, faults=(fault,))
    build = build_robot(finger(), [], printer_named("fdm"), material="tpu95a")
    write_package(tmp_path, build, title="a finger", retest=retest)
    sheet = (tmp_path / "sheet.html").read_text()
    assert f"Simulation of the robot as built: {retest.motion}, largest displacement 100 mm" in sheet
    assert retest.motion == said
