"""Force, gear and command of an actuator, beside one with three controls and three outputs."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from aidsr.fixes.strength import read_pull
from aidsr.mjcf.read import parse_document
from aidsr.sim.actuator_force import affine_force, control_of, end_forces, gear_of, output_of, servo_target
from aidsr.sim.drive import read_drives
from aidsr.sim.scope_reader import ScopeReader
from aidsr.sim.structure import read_structure
from aidsr.validation.fidelity.cables import _pull_n
from scenes import small_arm

SERVOS = (
    '<position name="near" tendon="left" kp="300" gear="2" ctrlrange="0.1 0.3" forcerange="-7 1"/>'
    '<motor name="far" tendon="right" gear="-1" ctrlrange="0 9"/>'
)
HEAD = '<body name="head" pos="0 0 0.3"><joint name="neck" type="ball"/><geom size="0.01" mass="0.01"/></body>'


def arm(first: str = "") -> str:
    """An arm with a servo and a motor on its tendons and a head on a ball joint; `first` is its first actuator."""
    text = small_arm()
    start, end = text.index("<actuator>"), text.index("</actuator>")
    return text[:start].replace("</worldbody>", f"{HEAD}</worldbody>") + f"<actuator>{first}{SERVOS}" + text[end:]


PLAIN, TURNED = arm(), arm('<orientation name="turn" joint="neck" kp="0.001"/>')
"""The same arm, where the second one's first actuator has three controls and outputs."""


def model_of(text: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(text)


def ids(model: mujoco.MjModel) -> list[int]:
    return [model.actuator(name).id for name in ("near", "far")]


def test_indices_of_outputs_and_controls_follow_those_of_an_actuator_with_three() -> None:
    model = model_of(TURNED)
    assert (model.nactuator, model.nout, model.nu) == (3, 5, 5)
    assert [output_of(model, actuator) for actuator in ids(model)] == [3, 4]
    assert [control_of(model, actuator) for actuator in ids(model)] == [3, 4]
    assert [gear_of(model, actuator)[0] for actuator in ids(model)] == [2, -1]


@pytest.mark.parametrize("text", [PLAIN, TURNED], ids=["plain", "turned"])
def test_the_force_is_that_of_mujoco(text: str) -> None:
    model = model_of(text)
    data = mujoco.MjData(model)
    for actuator in ids(model):
        control, output = control_of(model, actuator), output_of(model, actuator)
        low, high = model.actuator_ctrlrange[control]
        measured = []
        for command in (low, high):
            data.ctrl[control] = command
            mujoco.mj_forward(model, data)
            measured.append(data.actuator_force[output] * gear_of(model, actuator)[0])
        assert end_forces(model, actuator, float(data.actuator_length[output]), low, high) == pytest.approx(measured)


def test_a_servo_aims_at_the_length_without_force() -> None:
    model = model_of(TURNED)
    near, far = ids(model)
    target = servo_target(model, near, 0.2)
    assert target == pytest.approx(0.1)  # a gear of 2
    slope, offset = affine_force(model, near, 2 * target) or (np.nan, np.nan)
    assert slope * 0.2 + offset == pytest.approx(0)
    assert servo_target(model, far, 0.2) is None


def test_an_orientation_servo_changes_nothing_of_the_other_actuators() -> None:
    rows = []
    for text in (PLAIN, TURNED):
        model = model_of(text)
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        structure = read_structure(model)
        drives = {drive.actuator: drive for drive in read_drives(model, data, structure)}
        pushes = ScopeReader(model, structure).pushes
        commands = [
            (drive.low, drive.high, drive.neutral, drive.pull, drive.force_low_n, drive.force_high_n)
            for drive in (drives[actuator] for actuator in ids(model))
        ]
        fidelity = [_pull_n(model, data, (actuator,)) for actuator in ids(model)]
        pull = read_pull(parse_document(text).root, ("near", "far"))
        assert pull is not None
        rows.append(
            np.array([*np.ravel(commands), *np.ravel([pushes[i] for i in ids(model)]), *fidelity, pull.force_n])
        )
    np.testing.assert_allclose(rows[1], rows[0])


@pytest.mark.parametrize(
    ("attributes", "ends"),
    [
        ('dyntype="integrator" ctrlrange="-80 800" actlimited="true" actrange="0 40"', (0, -40)),
        ('dyntype="integrator" ctrlrange="-1 800" actlimited="true" actrange="-30 40"', (30, -40)),
        ('dyntype="integrator" ctrlrange="0 800" actlimited="true" actrange="-30 40"', (0, -40)),
        ('dyntype="filter" dynprm="0.1" ctrlrange="0 800" actlimited="true" actrange="0 40"', (0, -40)),
        ('dyntype="filter" dynprm="0.1" ctrlrange="0 30" actlimited="true" actrange="0 40"', (0, -30)),
        ('dyntype="muscle" ctrlrange="0 800"', (0, -1)),
    ],
)
def test_a_held_command_pulls_as_hard_as_the_activation_allows(attributes, ends):
    text = small_arm().replace("<actuator>", f'<actuator><general name="pull" tendon="left" gear="-1" {attributes}/>')
    model = model_of(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    drive = next(one for one in read_drives(model, data, read_structure(model)) if one.actuator == 0)
    assert (drive.force_low_n, drive.force_high_n) == ends
    assert end_forces(model, 0, float(data.actuator_length[0]), drive.low, drive.high) == list(ends)
