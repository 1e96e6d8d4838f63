"""A goal in a file: success measured in any environment, without a line of Python.

    kind = "lift"
    target = "lid"
    by_m = 0.05

docs/environments.md has a worked example. `aidsr.tasks.goal_task` makes the task of it.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, TypeAdapter, ValidationError, field_validator, model_validator

from aidsr.core.arguments import check_type
from aidsr.core.artifacts import Artifact, Base
from aidsr.core.errors import UserError
from aidsr.core.suggestions import closest_name
from aidsr.core.text_files import parse_toml, read_text_file

GOAL_VERSION = 2
"""Of what goals measure. It changes where a policy trained before would be judged by something else than it learned."""

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Goal(Artifact):
    """Fields of every kind of goal."""

    target: str = ""
    """Site or body of the environment."""

    hold_s: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.5
    """How long success must last before it counts [s]."""
    time_limit_s: Positive = 10.0
    """How long an episode lasts at most [s]."""
    base: Base = "any"
    """What holds the robot's root: "fixed", "free", "moving" with its mount, or "any"."""
    vary_m: tuple[Annotated[float, Field(ge=0, allow_inf_nan=False)], ...] = (0.0, 0.0, 0.0)
    """How far the target's place differs between episodes, to either side along x, y and z [m]."""

    @field_validator("vary_m", "direction", check_fields=False)
    @classmethod
    def _three(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if len(value) != 3:
            raise ValueError(f"{len(value)} numbers instead of three, for x, y and z")
        return value

    @model_validator(mode="after")
    def _held_in_time(self) -> Goal:
        if self.hold_s >= self.time_limit_s:
            raise ValueError(f"hold_s ({self.hold_s:g} s) must be shorter than time_limit_s ({self.time_limit_s:g} s)")
        return self


class Reach(Goal):
    """The functional part comes to a site, or to the origin of a body."""

    kind: Literal["reach"]
    target: str
    """Site or body of the environment."""
    within_m: Positive = 0.02
    """How near is there [m]."""


class Lift(Goal):
    """A body's centre of mass is raised."""

    kind: Literal["lift"]
    target: str
    """Body of the environment that can move."""
    by_m: Positive = 0.05
    """How high over where it stood at the start [m]."""


class Travel(Goal):
    """The centre of mass of the robot, or of a body, gets somewhere along a straight line."""

    kind: Literal["travel"]
    target: str = ""
    """Body of the environment that is to be moved; the robot's own centre of mass where none is named."""
    distance_m: Positive
    """How far [m]."""
    direction: tuple[float, ...] = (1.0, 0.0, 0.0)
    """In world axes, of any length."""

    @field_validator("direction")
    @classmethod
    def _somewhere(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if not 1e-6 < math.hypot(*value) < math.inf:
            raise ValueError(f"no direction: {list(value)}; use a finite one other than zero")
        return value


class Touch(Goal):
    """A body is touched with a force between two limits."""

    kind: Literal["touch"]
    target: str
    """Body of the environment."""
    force_n: Positive = 0.1
    """Net force that counts [N]."""
    at_most_n: Positive | None = None
    """Net force beyond which it does not [N]."""
    part: Literal["functional_part", "robot"] = "functional_part"
    """Which part must touch it."""

    @model_validator(mode="after")
    def _a_band(self) -> Touch:
        if self.at_most_n is not None and self.at_most_n <= self.force_n:
            raise ValueError(f"at_most_n ({self.at_most_n:g} N) must be more than force_n ({self.force_n:g} N)")
        return self


AnyGoal = Annotated[Reach | Lift | Travel | Touch, Field(discriminator="kind")]

_KINDS: dict[str, type[Goal]] = {"reach": Reach, "lift": Lift, "travel": Travel, "touch": Touch}


_MAX_BYTES = 2**20


def read_goal(path: str | Path) -> AnyGoal:
    """Return the goal in a file.

    Raises:
        TypeError: The path is none.
        UserError: There is no such file, or it is no goal.
    """
    check_type(path, (str, Path), "goal must be the path of a TOML file")
    try:
        text = read_text_file(Path(path), max_bytes=_MAX_BYTES)
    except FileNotFoundError:
        raise UserError(f"goal not found: {path}; give a TOML file as docs/environments.md shows") from None
    except OSError as error:
        raise UserError(f"cannot read {path} as TOML: {error.strerror}") from None
    return parse_goal(text, str(path))


def parse_goal(text: str, name: str = "the goal") -> AnyGoal:
    """Return the goal in a TOML text.

    Args:
        text: The TOML.
        name: Of the goal, for messages.

    Raises:
        UserError: It is no goal.
    """
    try:
        values = parse_toml(text)
    except ValueError as error:
        raise UserError(f"cannot read {name} as TOML: {error}") from None
    kind = values.get("kind")
    if not isinstance(kind, str) or kind not in _KINDS:
        raise UserError(
            f"{name} has {'no kind' if kind is None else f'an unknown kind {kind!r}'}"
            + (_near(str(kind), _KINDS) if kind is not None else "")
            + '; use "reach", "lift", "travel" or "touch"'
        )
    try:
        goal: AnyGoal = TypeAdapter(AnyGoal).validate_python(values)
    except ValidationError as error:
        raise UserError(f"{name}: {_sentence(error, _KINDS[kind])}") from None
    return goal


def _sentence(error: ValidationError, kind: type[Goal]) -> str:
    """Return the first mistake in one sentence."""
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"][1:])
    keys = [key for key in kind.model_fields if key != "kind"]
    match first["type"]:
        case "extra_forbidden":
            return f'unknown key "{place}"{_near(place, keys)}; this kind has {", ".join(keys)}'
        case "missing":
            return f'missing key "{place}"; this kind of goal needs it'
        case "value_error":
            return (f"{place}: " if place else "") + str(first["ctx"]["error"])
        case _:
            what = first["msg"][:1].lower() + first["msg"][1:]
            return f"{place}: {what}; found {first['input']!r}"


def _near(name: str, known: dict[str, type[Goal]] | list[str]) -> str:
    near = closest_name(name, known)
    return f' (did you mean "{near}"?)' if near else ""
