"""Mapping from control values to spool angles for the built robot, as JSON and as a small Python program."""

from __future__ import annotations

from typing import Any

from aidsr.fabrication.build import RobotBuild
from aidsr.fabrication.force_response import Response


def control_map(build: RobotBuild, responses: tuple[Response, ...]) -> dict[str, Any]:
    """Return the contents of control.json, which `drive.py` reads.

    They hold for each actuator the motor, the spool, and a table from control values to spool angles and torques.
    """
    known = {response.actuator: response for response in responses}
    actuators = []
    for number, winch in enumerate(build.winches, start=1):
        name = build.anatomy.cables[winch.cable].actuator
        response, radius_mm = known.get(name), 1000 * winch.fit.spool_radius_m if winch.fit else None
        if response is None or radius_mm is None or winch.fit is None:
            continue
        loss = winch.demand.at_winch_n / winch.demand.tension_n if winch.demand.tension_n else 1.0
        actuators.append(
            {
                "name": name,
                "cable": build.anatomy.cables[winch.cable].tendon,
                "motor_id": number,
                "motor": winch.fit.motor.name,
                "spool_radius_mm": round(radius_mm, 2),
                "ctrl": [round(value, 6) for value in response.ctrl],
                "spool_angle_rad": [round(length / radius_mm, 4) for length in response.reeled_in_mm],
                "torque_n_m": [round(force * loss * radius_mm / 1000, 4) for force in response.force_n],
                "largest_torque_n_m": round(winch.demand.at_winch_n * radius_mm / 1000, 4),
                "largest_angle_rad": round(1000 * winch.demand.stroke_m / radius_mm, 3),
            }
        )
    return {
        "meaning": "Angles count from the neutral length found in calibration; positive reels in. The tables hold for "
        "one cable pulled alone, at rest and without load.",
        "actuators": actuators,
    }


DRIVE = '''"""Drive the winches: turn a control of the simulation into angles of the spools. Needs only Python.

Try it without motors:      python drive.py
With motors: write `send` for your bus, calibrate (see the sheet), then call `command`.
Once you have changed this file, later exports keep it; delete it to get a new one.
"""

import json
from pathlib import Path

MAP = json.loads((Path(__file__).parent / "control.json").read_text())["actuators"]
NEUTRAL_RAD = {one["name"]: 0.0 for one in MAP}  # angles of the spools at neutral lengths, from calibration


def interpolate(x, xs, ys):
    """Return y at x on the line through points, and its ends beyond them."""
    if xs[0] > xs[-1]:
        xs, ys = xs[::-1], ys[::-1]
    if x <= xs[0]:
        return ys[0]
    for x0, x1, y0, y1 in zip(xs, xs[1:], ys, ys[1:]):
        if x <= x1:
            return y0 + (y1 - y0) * (x - x0) / (x1 - x0)
    return ys[-1]


def spool_angle(actuator, ctrl):
    """Return how far a spool is to be turned from its neutral angle, in rad, never beyond its stroke."""
    angle = interpolate(ctrl, actuator["ctrl"], actuator["spool_angle_rad"])
    return min(angle, actuator["largest_angle_rad"])


def send(motor_id, angle_rad, torque_limit_n_m):
    """Replace this by your motors' own call; set the torque limit as well, it protects cables and hinges."""
    print(f"motor {motor_id}: turn to {angle_rad:+.3f} rad, at most {torque_limit_n_m:.3f} N m")


def command(controls):
    """Send controls by actuator name; those left out go to rest."""
    for actuator in MAP:
        ctrl = controls.get(actuator["name"], actuator["ctrl"][0])
        angle = NEUTRAL_RAD[actuator["name"]] + spool_angle(actuator, ctrl)
        send(actuator["motor_id"], angle, actuator["largest_torque_n_m"])


if __name__ == "__main__":
    for actuator in MAP:
        middle = (actuator["ctrl"][0] + actuator["ctrl"][-1]) / 2
        print(f"{actuator['name']}: control {middle:g}")
        command({actuator["name"]: middle})
'''
