"""Links end at their gaps in the robot as built, whichever round shape they are drawn with."""

import mujoco
import pytest
from fingers import finger

from aidsr.fabrication.as_built import as_built
from aidsr.fabrication.build import build_robot
from aidsr.fabrication.printers import printer_named


@pytest.mark.parametrize("kind", ["capsule", "cylinder"])
def test_links_are_as_long_as_built(kind: str) -> None:
    text = finger(["link_1", "link_2", "tip"]).replace('type="capsule"', f'type="{kind}"')
    built = mujoco.MjModel.from_xml_string(as_built(build_robot(text, [], printer_named("fdm")), text))
    skin = built.geom("skin_2")
    assert skin.type == mujoco.mjtGeom.mjGEOM_CYLINDER
    assert 2 * skin.size[1] == pytest.approx(0.02 - 2 * 0.005), "a gap of 10 mm takes 5 mm at either end"
