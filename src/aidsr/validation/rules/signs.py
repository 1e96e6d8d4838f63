"""Rule for wrong signs of gear, gain, bias and control range, so that an actuator acts in the opposite direction."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco

from aidsr.core.artifacts import Fault
from aidsr.sim.actuator_force import servo_target
from aidsr.sim.drive import Drive, read_drives
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage

_AFFINE = int(mujoco.mjtBias.mjBIAS_AFFINE)


def _find_inverted_signs(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find actuators with positive feedback, servos with a negative target length, and actuators that push their cable.

    An actuator that pushes counts only if another cable is pulled.

    Source: MuJoCo documentation, Computation, "Actuation model": force = gain * input + bias0 + bias1 * length + bias2
    * velocity, and the length is that of the tendon times gear. A positive bias1 or bias2 amplifies any motion.
    """
    model = robot.model
    runaway = [actuator for actuator in robot.structure.actuators if _feedback(model, actuator) > 0]
    if runaway:
        yield ACTUATOR_SIGN.fault(
            "the force grows with the distance from the target, so that the actuator runs away from it",
            names=(robot.actuator(actuator) for actuator in runaway),
            measured=max(_feedback(model, actuator) for actuator in runaway),
            limit=0,
            unit="N/m or N s/m of feedback (N m/rad on a turning joint)",
            likely_cause="kp, kv or the bias has the wrong sign",
            cure="Make kp and kv positive: force = kp (command - length) - kv velocity.",
        )
    cables = {tendon.id for tendon in robot.structure.tendons if tendon.spatial}
    drives = [
        drive
        for drive in read_drives(model, robot.drawn, robot.structure)
        if drive.on_tendon and drive.ranged and int(model.actuator_trnid[drive.actuator, 0]) in cables
    ]
    backwards = [drive for drive in drives if drive.actuator not in runaway and _aims_below_zero(model, drive)]
    if backwards:
        yield ACTUATOR_SIGN.fault(
            "every command asks for a cable shorter than nothing, so that it pulls however it is commanded",
            names=(robot.actuator(drive.actuator) for drive in backwards),
            measured=len(backwards),
            limit=0,
            likely_cause="gear or ctrlrange of this servo has the wrong sign",
            cure='Give a position servo gear="1" and a ctrlrange around the length of its tendon.',
        )
    pushing = [drive for drive in drives if _only_pushes(drive)]
    if pushing and any(min(drive.force_low_n, drive.force_high_n) < 0 for drive in drives):
        yield ACTUATOR_SIGN.fault(
            "pushes its cable at every command, while the other cables are pulled",
            names=(robot.actuator(drive.actuator) for drive in pushing),
            measured=len(pushing),
            limit=0,
            likely_cause="gear or ctrlrange of this actuator has another sign than that of its neighbours",
        )


def _feedback(model: mujoco.MjModel, actuator: int) -> float:
    """Return the larger feedback of an actuator: force per length or per velocity; above 0 it amplifies the motion."""
    if int(model.actuator_biastype[actuator]) != _AFFINE:
        return 0.0
    return float(model.actuator_biasprm[actuator, 1:3].max())


def _aims_below_zero(model: mujoco.MjModel, drive: Drive) -> bool:
    """Return whether the length at which a servo gives no force is negative at every command."""
    targets = [servo_target(model, drive.actuator, command) for command in (drive.low, drive.high)]
    return all(target is not None and target < 0 for target in targets)


def _only_pushes(drive: Drive) -> bool:
    return min(drive.force_low_n, drive.force_high_n) >= 0 and max(drive.force_low_n, drive.force_high_n) > 0


ACTUATOR_SIGN = Rule(
    code="actuator_sign",
    stage=Stage.WIRING,
    finds="The sign of an actuator is inverted: a servo runs away from its target or aims at a negative length, or one "
    "actuator pushes its cable while the others pull theirs.",
    why="A servo with positive feedback tears the robot apart. A cable that pushes bends the limb to the side of its "
    "antagonist, which no built one does, and a policy trained with it fails on the robot.",
    limit="force of an actuator per length and per velocity of what it drives: at most 0; a servo's target length: "
    "not below 0 at every command; force on a cable: a pull at some command, where another cable is pulled",
    check=_find_inverted_signs,
    unit="actuators",
    cure='Let all cables pull alike: a motor with gear="-1" and ctrlrange="0 F".',
    explains=("tendon_pushes", "numerical_instability", "energy_growth", "chatter", "limit_overrun", "antagonist_lock"),
    example=Example(
        (
            (
                '<motor name="pull_front" tendon="front" gear="-1" ctrlrange="0 20"/>',
                '<motor name="pull_front" tendon="front" gear="1" ctrlrange="0 20"/>',
            ),
        )
    ),
)
