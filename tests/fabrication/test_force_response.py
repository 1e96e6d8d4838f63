"""How far a cable is reeled in: in the direction that pulls, with the force that the cable feels."""

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
