"""Scenes whose motion is known: a cart driven at a given speed, and a turntable."""

from collections.abc import Sequence
from pathlib import Path

from aidsr.tools.playing import play_variations
from aidsr.tools.recording import Recording
from aidsr.tools.scene import MeasuredScene

CART = """
<mujoco model="cart">
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1"/>
    <geom name="wall" type="box" size="0.01 0.5 0.2" pos="0.51 0 0.2"/>
    <site name="mark" pos="0.3 0 0.1"/>
    <body name="robot/cart" pos="0 0 0.1">
      <joint name="robot/along" type="slide" axis="1 0 0"/>
      <joint name="robot/about" type="hinge" axis="0 0 1"/>
      <geom name="robot/cart" type="sphere" size="0.05" mass="1"/>
      <site name="robot/nose"/>
      <site name="robot/functional_part"/>
    </body>
  </worldbody>
  <actuator>
    <velocity name="robot/drive" joint="robot/along" kv="1000" ctrlrange="-0.5 0.5"/>
    <velocity name="robot/turn" joint="robot/about" kv="10" ctrlrange="-1.5707963 1.5707963"/>
  </actuator>
</mujoco>"""


def cart(folder: Path, distance_m: float = 0.4) -> MeasuredScene:
    """A cart 0.45 m of travel away from a wall, whose goal is to travel."""
    goal = folder / "goal.toml"
    goal.write_text(f'kind = "travel"\ndistance_m = {distance_m}\ntime_limit_s = 4\nhold_s = 0.2\n')
    return MeasuredScene(mjcf=CART, goal=goal)


def only(scene: MeasuredScene, joint: str) -> MeasuredScene:
    """The same with one of its two joints and the other's actuator taken away."""
    gone = {"along": ("robot/about", "robot/turn"), "about": ("robot/along", "robot/drive")}[joint]
    lines = [line for line in scene.mjcf.splitlines() if not any(f'name="{name}"' in line for name in gone)]
    return scene.model_copy(update={"mjcf": "\n".join(lines)})


def play_once(
    scene: MeasuredScene,
    script: str,
    *,
    variation: int = 0,
    seconds: float = 0.0,
    distances: Sequence[tuple[str, str]] = (),
) -> Recording:
    """Play a script in one variation."""
    (found,) = play_variations(scene, script, variations=(variation,), seconds=seconds, distances=distances)
    return found
