"""The sheet tells a builder what is to be done with these pieces, and nothing else."""

from pathlib import Path

import pytest
from fingers import finger

from aidsr.fabrication.build import build_robot
from aidsr.fabrication.package import write_package
from aidsr.fabrication.printers import printer_named

LONG = '<geom name="post" type="cylinder" size="0.02 0.2" pos="0 0 -0.2" mass="0.5"/>'


@pytest.mark.parametrize(
    ("robot", "glued"),
    [(finger(["link", "tip"], base=LONG), True), (finger(["arm_upper", "tip"]), False)],
    ids=["a post too long for the bed", "a body with a name as of an upper half"],
)
def test_only_pieces_that_were_cut_are_to_be_glued(robot: str, glued: bool, tmp_path: Path) -> None:
    write_package(tmp_path, build_robot(robot, [], printer_named("fdm"), material="tpu95a"), title="a finger")
    assert ("Glue pieces that were cut" in (tmp_path / "sheet.html").read_text()) == glued
