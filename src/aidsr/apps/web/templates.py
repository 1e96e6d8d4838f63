"""Environments to start from: small, complete, with an objective and a goal."""

from __future__ import annotations

from dataclasses import dataclass

_HEAD = """<mujoco model="{name}">
  <option timestep="0.002" integrator="implicitfast" cone="elliptic"/>
  <default><geom priority="1" friction="0.9 0.005 0.0001" solref="0.004 1"/></default>
  <worldbody>
    <light pos="0.4 -0.6 1.5" dir="-0.2 0.3 -1"/>
    <geom name="floor" type="plane" size="1 1 0.05" rgba="0.85 0.87 0.88 1"/>
"""
_TAIL = """  </worldbody>
</mujoco>
"""


@dataclass(frozen=True)
class Template:
    """An environment with what is to be done in it."""

    title: str
    objective: str
    environment: str
    """MJCF."""
    goal: str
    """TOML."""


TEMPLATES = {
    "bell": Template(
        "A bell to ring",
        "Ring the bell that hangs beside the mount: touch it with at least 0.2 N.",
        _HEAD.format(name="bell")
        + """    <site name="mount" pos="0 0 0.5" euler="180 0 0"/>
    <body name="bell" pos="0.13 0 0.28">
      <geom name="bell" type="sphere" size="0.03" mass="0.2" rgba="0.85 0.65 0.2 1"/>
    </body>
"""
        + _TAIL,
        'kind = "touch"\ntarget = "bell"\nforce_n = 0.2\nvary_m = [0.02, 0.03, 0.02]\n',
    ),
    "cup": Template(
        "A cup to lift",
        "Lift the cup on the table by 50 mm and keep it raised for half a second.",
        _HEAD.format(name="cup")
        + """    <site name="mount" pos="0 0 0.5" euler="180 0 0"/>
    <geom name="table" type="box" size="0.25 0.25 0.02" pos="0 0 0.1" rgba="0.72 0.58 0.42 1"/>
    <body name="cup" pos="0 0 0.161">
      <freejoint name="cup"/>
      <geom name="cup" type="cylinder" size="0.025 0.04" mass="0.06" rgba="0.2 0.4 0.7 1"/>
    </body>
"""
        + _TAIL,
        'kind = "lift"\ntarget = "cup"\nby_m = 0.05\nvary_m = [0.02, 0.02, 0.0]\n',
    ),
    "walk": Template(
        "Level ground to cross",
        "Travel half a metre along the x axis over level ground.",
        _HEAD.format(name="walk") + _TAIL,
        'kind = "travel"\ndistance_m = 0.5\nbase = "free"\ntime_limit_s = 20\n',
    ),
}
