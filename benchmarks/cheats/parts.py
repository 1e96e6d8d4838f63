"""Parts of MJCF from which the cheating bodies are built, and the rules that play them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from typing import Self

import numpy as np
from benchmarks.episode_clock import EpisodeClock
from numpy.typing import NDArray

from aidsr.learn.episodes.scene import TaskScene

FloatArray = NDArray[np.float64]
Commands = Mapping[str, float | FloatArray]
"""Actions, -1 to 1, by pattern of the actuator's name without "robot/"; other actuators keep their action at rest."""
Rule = Callable[[float, FloatArray], Commands]
"""Returns the commands for a time [s] and the task's features, (n, k), of n episodes."""
MakeRule = Callable[[], Rule]
"""Makes a rule. A rule may have state, which belongs to its episodes."""


@dataclass(frozen=True)
class Parts:
    """Pieces of the sections of a robot's MJCF."""

    bodies: str = ""
    tendons: str = ""
    actuators: str = ""
    sensors: str = ""
    constraints: str = ""
    """Elements of <equality>."""
    contacts: str = ""
    """Elements of <contact>."""

    def __add__(self, other: Self) -> Self:
        return replace(self, **{name: value + getattr(other, name) for name, value in vars(self).items()})

    def document(self, root: str = "", *, attributes: str = "") -> str:
        """Return the MJCF of a robot.

        Args:
            root: Joints, geoms and sites of the only root body.
            attributes: Attributes of the root body.
        """
        sections = [
            ("tendon", self.tendons),
            ("equality", self.constraints),
            ("contact", self.contacts),
            ("actuator", self.actuators),
            ("sensor", self.sensors),
        ]
        rest = "".join(f"<{tag}>{content}</{tag}>" for tag, content in sections if content)
        return (
            '<mujoco><compiler angle="degree" autolimits="true"/>'
            '<option timestep="0.002" integrator="implicitfast" cone="elliptic"/>'
            '<default><geom density="400" solref="0.004 1"/><site size="0.002"/></default>'
            f'<worldbody><body name="root" {attributes}>{root}{self.bodies}</body></worldbody>{rest}</mujoco>'
        )


def chain(
    name: str,
    place: str,
    *,
    links: int = 5,
    link_m: float = 0.025,
    radius_m: float = 0.005,
    stiffness: float | tuple[float, ...] = 0.05,
    pull_n: float = 3.0,
    sides: tuple[str, ...] = ("front", "back"),
    geom: str = "",
    damping: float | None = None,
    end: str = "",
    last_geom: str | None = None,
) -> Parts:
    """Return a limb of links on hinges with a cable along each of its sides.

    Args:
        name: Prefix of all names.
        place: Attributes of the first body: pos, euler.
        links: Number of links.
        link_m: Length of each link [m].
        radius_m: Radius of the links [m].
        stiffness: Stiffness of the hinges, one number for all or one for each link [N m/rad].
        pull_n: Largest tension of a cable [N].
        sides: Sides with a cable: "front", "back", "left", "right". With "left", links turn about both axes.
        geom: Further attributes of the geoms.
        damping: Damping of the hinges [N m s/rad]. By default a twentieth of the stiffness, at least 0.002.
        end: Further elements of the last link.
        last_geom: Attributes of the last link's geom, instead of `geom`.
    """
    out = radius_m + 0.003
    at = {"front": (out, 0.0), "back": (-out, 0.0), "left": (0.0, out), "right": (0.0, -out)}
    each = stiffness if isinstance(stiffness, tuple) else (stiffness,) * links
    axes = ["0 1 0", "1 0 0"] if "left" in sides else ["0 1 0"]
    text = ""
    for link in reversed(range(links)):
        damped = max(each[link] * 0.05, 0.002) if damping is None else damping
        joints = "".join(
            f'<joint name="{name}_{link}_{axis}" axis="{turn}" range="-45 45" stiffness="{each[link]:g}" '
            f'damping="{damped:g}" armature="1e-5" solreflimit="0.004 1"/>'
            for axis, turn in enumerate(axes)
        )
        sites = "".join(
            f'<site name="{name}_{side}_{link}" pos="{at[side][0]} {at[side][1]} {link_m / 2}"/>' for side in sides
        )
        extra = last_geom if last_geom is not None and link == links - 1 else geom
        shape = f'<geom name="{name}_{link}" type="cylinder" size="{radius_m} {link_m * 0.48}" '
        shape += f'pos="0 0 {link_m / 2}" {extra}/>'
        where = f'pos="0 0 {link_m}"' if link else place
        inner = end + f'<site name="{name}_tip" pos="0 0 {link_m}"/>' if link == links - 1 else ""
        text = f'<body name="{name}_{link}" {where}>{joints}{shape}{sites}{inner}{text}</body>'
    base = "".join(f'<site name="{name}_{side}_base" pos="{at[side][0]} {at[side][1]} -0.002"/>' for side in sides)
    text = f'<body name="{name}_root" {place}>{base}{text.replace(place, "", 1)}</body>'
    routes = {side: [f"{name}_{side}_base", *(f"{name}_{side}_{link}" for link in range(links))] for side in sides}
    tendons = "".join(
        f'<spatial name="{name}_{side}">{"".join(f"<site site={chr(34)}{site}{chr(34)}/>" for site in route)}</spatial>'
        for side, route in routes.items()
    )
    actuators = "".join(
        f'<motor name="{name}_{side}" tendon="{name}_{side}" gear="-1" ctrlrange="0 {pull_n}"/>' for side in sides
    )
    sensors = "".join(f'<tendonpos name="{name}_{side}_length" tendon="{name}_{side}"/>' for side in sides)
    return Parts(bodies=text, tendons=tendons, actuators=actuators, sensors=sensors)


def tail(place: str = 'pos="0 0 0.02"') -> Parts:
    """Return a limb of five small links with two cables, which does nothing for the task."""
    return chain("tail", place)


def radial(number: int, of: int, span_deg: float = 360.0, start_deg: float = 0.0) -> float:
    """Return the angle [deg] of part `number` of `of` parts that are spread around the z axis."""
    return start_deg + span_deg * number / (of if span_deg == 360.0 else of - 1)


# --- rules ---


def idle(time_s: float, seen: FloatArray) -> Commands:
    """Return no commands."""
    del time_s, seen
    return {}


def constant(commands: Commands) -> Rule:
    """Return the rule that always gives the same commands."""
    return lambda _time_s, _seen: commands


def then(first: Commands, start_s: float, later: Commands) -> Rule:
    """Return the rule that gives the first commands before `start_s` [s] and the later ones from then on."""
    return lambda time_s, _seen: first if time_s < start_s else later


class Player:
    """Policy that plays a rule on the episodes of a scene; a new rule each time that they begin."""

    def __init__(self, scene: TaskScene, make: MakeRule) -> None:
        self._scene, self._make = scene, make
        self._rule, self._clock = make(), EpisodeClock(scene.task)

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return the next actions, (n, k)."""
        if self._clock.tick(observation):
            self._rule = self._make()
        task, groups = self._scene.task, self._scene.actions.groups
        features = sum(feature.size for feature in task.features)
        seen = np.asarray(observation[:, -features:], dtype=np.float64)
        action = np.tile(self._scene.actions.rest, (len(seen), 1))
        for pattern, value in self._rule(self._clock.time_s, seen).items():
            for index, group in enumerate(groups):
                if fnmatch(group.actuators[0].removeprefix("robot/"), pattern):
                    action[:, index] = value
        return action
