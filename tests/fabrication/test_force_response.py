"""How far a cable is reeled in: in the direction that pulls, with the force that the cable feels."""

import mujoco
import pytest
from fingers import finger

from aidsr.fabrication.force_response import responses

DRIVES = {
    "winch": ('<general tendon="flex" ctrlrange="0 1" gainprm="-10"/>', 1.0),
    "both ways": ('<motor tendon="flex" gear="10" ctrllimited="true" ctrlrange="-1 1"/>', -1.0),
    "geared": ('<motor tendon="flex" gear="-10" ctrllimited="true" ctrlrange="0 1"/>', 1.0),
}


@pytest.mark.parametrize("drive", DRIVES)
def test_a_table_ends_where_the_cable_is_pulled_hardest(drive: str) -> None:
    actuator, end = DRIVES[drive]
    (found,) = responses(finger(actuators=actuator))
    assert found.ctrl[-1] == end
    assert found.force_n[-1] == pytest.approx(10.0)
    assert found.reeled_in_mm[-1] > 1.0


def test_a_servo_pulls_its_cable_alone_from_its_drawn_length() -> None:
    servos = "".join(
        f'<position name="{name}" tendon="{tendon}" kp="2000" kv="20" ctrlrange="0.025 0.06" forcerange="-10 0"/>'
        for name, tendon in (("bend", "flex"), ("straighten", "extend"))
    )
    alone = mujoco.MjModel.from_xml_string(finger(actuators=servos.split("/>")[0] + "/>"))
    data = mujoco.MjData(alone)
    mujoco.mj_forward(alone, data)
    drawn_m = data.ten_length[0]
    data.ctrl[0] = 0.025
    alone.opt.gravity[:] = 0
    mujoco.mj_step(alone, data, 2000)
    bent, straightened = responses(finger(actuators=servos))
    for found in (bent, straightened):
        assert found.ctrl[0] == pytest.approx(drawn_m), "the control at which the servo holds the initial pose"
        assert found.ctrl[-1] == 0.025
        assert found.reeled_in_mm[0] == pytest.approx(0.0, abs=0.01)
        assert found.force_n[0] == pytest.approx(0.0, abs=0.01)
        assert found.reeled_in_mm[-1] == pytest.approx(1000 * (drawn_m - data.ten_length[0]), abs=0.1)
