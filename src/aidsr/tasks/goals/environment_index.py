"""Look-up of names in the environment of a goal, and checks of what they name."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from aidsr.core.artifacts import BodySummary, EnvironmentSummary, Vec3
from aidsr.core.errors import UserError
from aidsr.core.suggestions import closest_name
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.mechanism import JointFacts, Mechanism, farthest_m, read_mechanism

_ROUNDING = 1.005
"""Largest ratio of required distance to distance allowed by joints. Our choice: the latter is found on a grid."""


@dataclass(frozen=True)
class EnvironmentIndex:
    """An environment, or a scene that contains one; parts of the robot are ignored."""

    mjcf: str
    summary: EnvironmentSummary

    @cached_property
    def mechanism(self) -> Mechanism:
        """Joints and actuators of the environment, and the centres of mass of its bodies."""
        return read_mechanism(self.mjcf)

    @property
    def bodies(self) -> list[str]:
        """Names of the environment's bodies."""
        return [body.name for body in self.summary.bodies if _is_environment(body.name)]

    @property
    def sites(self) -> dict[str, Vec3]:
        """Positions of the environment's sites at the start, by name [m]."""
        return {site.name: site.position_m for site in self.summary.sites if _is_environment(site.name)}

    def body(self, name: str, kind: str) -> BodySummary:
        """Return a body by its name.

        Raises:
            UserError: There is no body of that name.
        """
        if name not in self.bodies:
            self._refuse_geom(name)
            raise unknown("target", name, f"a {kind} goal needs a body of the environment", self.bodies)
        return next(body for body in self.summary.bodies if body.name == name)

    def _refuse_geom(self, name: str) -> None:
        """Refuse the name of a geom where a body is needed.

        Raises:
            UserError: A geom of the environment has this name.
        """
        holders = [body.name for body in self.summary.bodies for geom in body.geoms if name and geom.name == name]
        if holders:
            there = _is_environment(holders[0])
            cure = f'name its body, "{holders[0]}"' if there else f'put it into a <body name="{name}">'
            raise UserError(f'"{name}" is a geom, not a body; {cure}')

    def require_place(self, name: str, kind: str) -> None:
        """Refuse a name of neither a site nor a body.

        Raises:
            UserError: The name is neither.
        """
        known = [*self.sites, *self.bodies]
        if name not in known:
            self._refuse_geom(name)
            raise unknown("target", name, f"a {kind} goal needs a site or a body of the environment", known)

    def require_movable(self, name: str, kind: str) -> None:
        """Refuse a body that no joint can move.

        Raises:
            UserError: No joint can move the body, or there is no such body.
        """
        if not self.body(name, kind).movable:
            raise UserError(
                f'the body "{name}" cannot move: no joint carries it, or it turns about its own centre of mass, the '
                "point whose way is measured; name a body that can, such as a part of it beside the axis"
            )

    def require_way(self, name: str, direction: tuple[float, ...], wanted_m: float) -> None:
        """Refuse a distance that the joints of a body do not allow.

        Raises:
            UserError: The centre of mass cannot move that far in the direction.
        """
        most_m = farthest_m(self.mjcf, name, direction)
        if wanted_m > most_m * _ROUNDING + 1e-6:
            along = "up" if direction == (0.0, 0.0, 1.0) else "along " + " ".join(f"{each:g}" for each in direction)
            joints = ", ".join(joint.name or "one without a name" for joint in self.mechanism.carrying(name))
            raise UserError(
                f'"{name}" cannot get {wanted_m:g} m {along}: its joints ({joints}) let its centre of mass go at most '
                f"{most_m:.3g} m that way; ask for less, or name another target or direction"
            )

    def require_solid(self, name: str, kind: str) -> None:
        """Refuse a body without a solid shape of its own: sensors do not measure the bodies that it carries.

        Raises:
            UserError: There is no solid shape, or no such body.
        """
        self.body(name, kind)
        part = self.solid_part(name)
        if not part:
            raise UserError(f'"{name}" cannot be touched: it has no solid shape (contype and conaffinity are 0)')
        if part != name:
            raise UserError(
                f'"{name}" has no solid shape of its own, and touches of what it carries are not measured; name its '
                f'body "{part}"'
            )

    def solid_part(self, name: str) -> str:
        """Return the first body with a solid shape among a body and those that it carries; "" if there is none."""
        carried = {name}
        for body in self.summary.bodies:  # parents come first
            if body.name in carried or (body.parent in carried and _is_environment(body.name)):
                carried.add(body.name)
                if any(geom.solid for geom in body.geoms):
                    return body.name
        return ""

    def matching(self, patterns: Sequence[str], kind: str) -> tuple[str, ...]:
        """Return the bodies that match names or patterns such as "pellet_*", each once.

        Raises:
            UserError: A name or pattern matches no body.
        """
        found: list[str] = []
        for pattern in patterns:
            names = fnmatch.filter(self.bodies, pattern)
            if not names:
                self._refuse_geom(pattern)
                raise unknown("target", pattern, f"a {kind} goal needs bodies of the environment", self.bodies)
            found += names
        return tuple(dict.fromkeys(found))

    def only_joint(self, body: str) -> JointFacts | None:
        """Return the only joint that moves a body if it is a hinge or a slide on a named body, otherwise None."""
        carrying = self.mechanism.carrying(body)
        if len(carrying) != 1 or carrying[0].kind not in ("hinge", "slide") or not carrying[0].body:
            return None
        return carrying[0]

    def joint(self, name: str) -> JointFacts:
        """Return a joint by its name.

        Raises:
            UserError: There is no joint of that name.
        """
        joints = {joint.name: joint for joint in self.mechanism.joints if _is_environment(joint.name)}
        if name not in joints:
            raise unknown("joint", name, "a turn goal needs a hinge of the environment", list(joints))
        return joints[name]


def unknown(what: str, name: str, needs: str, known: Iterable[str]) -> UserError:
    """Return the error for a name that does not exist."""
    known = list(known)
    near = closest_name(name, known)
    hint = f'; did you mean "{near}"?' if near else f"; it has {', '.join(known) or 'none'}"
    return UserError(f'unknown {what} "{name}": {needs}{hint}')


def _is_environment(name: str) -> bool:
    return bool(name) and name != "world" and not name.startswith(ROBOT_PREFIX)
