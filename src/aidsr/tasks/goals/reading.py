"""Goals in TOML files: success criteria for any environment, without Python code.

    kind = "lift"
    target = "lid"
    by_m = 0.05

docs/goals.md describes every kind. `aidsr.tasks.goal_task` makes a task from a goal.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, get_args

from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from aidsr.core.arguments import check_type
from aidsr.core.errors import UserError
from aidsr.core.suggestions import closest_name
from aidsr.core.text_files import parse_toml, read_text_file
from aidsr.tasks.goals.bring import Bring
from aidsr.tasks.goals.goal import Goal
from aidsr.tasks.goals.limits import AnyLimit, Limit
from aidsr.tasks.goals.stages import Stage, Stages

AnyGoal = Annotated[Stage | Stages, Field(discriminator="kind")]


def _by_word(kinds: tuple[type[BaseModel], ...]) -> dict[str, Any]:
    return {get_args(kind.model_fields["kind"].annotation)[0]: kind for kind in kinds}


KINDS: dict[str, type[Goal]] = _by_word((*get_args(get_args(Stage)[0]), Stages))
"""All kinds of goal, by the value of their key `kind`."""
_WITHOUT_TARGET = (Bring, Stages)
"""Kinds of goal without the key `target` of their base class."""
_VECTORS = frozenset({"vary_m", "direction", "axis", "center_m", "size_m", "path_m"})
"""Keys with three numbers, or with points of three numbers."""
_LEAST = {"greater_than": " above 0", "greater_than_equal": " of at least 0"}
"""Bound of a number by the type of its error."""
_LIMITS: dict[str, type[Limit]] = _by_word(get_args(get_args(AnyLimit)[0]))

_MAX_BYTES = 2**20


def read_goal(path: str | Path) -> AnyGoal:
    """Return the goal in a file.

    Raises:
        TypeError: The path is not a string or a `Path`.
        UserError: The file does not exist, cannot be read, or is not a valid goal.
    """
    check_type(path, (str, Path), "goal must be the path of a TOML file")
    try:
        text = read_text_file(Path(path), max_bytes=_MAX_BYTES)
    except FileNotFoundError:
        raise UserError(f"goal not found: {path}; give a TOML file as docs/goals.md shows") from None
    except OSError as error:
        raise UserError(
            f"cannot read {path} as TOML: {error.strerror}; give a TOML file as docs/goals.md shows"
        ) from None
    return parse_goal(text, str(path))


def parse_goal(text: str, name: str = "the goal") -> AnyGoal:
    """Return the goal in a TOML text.

    Args:
        text: The TOML text.
        name: Name of the goal for messages.

    Raises:
        UserError: The text is not a valid goal.
    """
    try:
        values = parse_toml(text)
    except ValueError as error:
        raise UserError(f"cannot read {name} as TOML: {error}") from None
    _check_kind(values, KINDS, name)
    if "by_s" in values:
        raise UserError(f"{name}: by_s belongs to a stage; the whole ends after time_limit_s")
    for key, kinds in (("stages", {word: KINDS[word] for word in KINDS if word != "stages"}), ("limits", _LIMITS)):
        parts = values.get(key)
        for number, part in enumerate(parts if isinstance(parts, list) else [], start=1):
            _check_kind(part, kinds, f"{name}: {key} {number}")
            _check_target(part, f"{name}: {key} {number}")
    _check_target(values, name)
    try:
        goal: AnyGoal = TypeAdapter(AnyGoal).validate_python(values)
    except ValidationError as error:
        raise UserError(f"{name}: {_sentence(error, KINDS[values['kind']])}") from None
    return goal


def _check_kind(values: Any, kinds: dict[str, Any], name: str) -> None:
    """Refuse a table without a known kind.

    Raises:
        UserError: The kind is missing or unknown.
    """
    kind = values.get("kind") if isinstance(values, dict) else None
    if isinstance(kind, str) and kind in kinds:
        return
    *first, last = (f'"{word}"' for word in kinds)
    raise UserError(
        f"{name} has {'no kind' if kind is None else f'an unknown kind {kind!r}'}"
        + (_near(str(kind), kinds) if kind is not None else "")
        + f"; use {', '.join(first)} or {last}"
    )


def _check_target(values: dict[str, Any], name: str) -> None:
    """Refuse the key `target` in a kind of goal without it; the base class has it, so it would be ignored.

    Raises:
        UserError: The key is there.
    """
    kind = KINDS.get(values["kind"])
    if kind in _WITHOUT_TARGET and "target" in values:
        cure = (
            "a stage has a target, not the whole goal"
            if kind is Stages
            else f'rename it to "targets", a list: targets = {values["target"]!r}'
            if isinstance(values["target"], list)
            else f'rename it to "targets", a list: targets = ["{values["target"]}"]'
        )
        raise UserError(f'{name}: unknown key "target"; {cure}')


def _sentence(error: ValidationError, kind: type[Goal]) -> str:
    """Return the first validation error as one sentence."""
    # an unknown key comes first: it is often a misspelling of the missing key
    first = min(error.errors(), key=lambda each: each["type"] != "extra_forbidden")
    places = [str(part) for part in first["loc"][1:]]
    record, shown = _record_at(kind, places)
    place = ".".join(shown)
    match first["type"]:
        case "extra_forbidden":
            hidden = {"kind", "by_s", *({"target"} if record in _WITHOUT_TARGET else set())}
            keys = [key for key in record.model_fields if key not in hidden]
            return f'unknown key "{place}"{_near(shown[-1], keys)}; this kind has {", ".join(keys)}'
        case "missing":
            return f'missing key "{place}"; this kind of goal needs it'
        case "value_error":
            return (f"{place}: " if place else "") + str(first["ctx"]["error"])
        case kind_of_error if vector := next((key for key in shown if key in _VECTORS), ""):
            numbers = f"three numbers{_LEAST.get(kind_of_error, '')}, [x, y, z]{' in metres' * vector.endswith('_m')}"
            return f"{place}: {numbers}{' for each point' * (vector == 'path_m')}; found {first['input']!r}"
        case "tuple_type":
            return f"{place}: it must be a list, in brackets; found {first['input']!r}"
        case _:
            what = first["msg"][:1].lower() + first["msg"][1:]
            return f"{place}: {what}; found {first['input']!r}"


def _record_at(kind: type[BaseModel], places: list[str]) -> tuple[type[BaseModel], list[str]]:
    """Return the record that contains an error, and the error's place without the parts that only name a kind."""
    record, shown = kind, list[str]()
    for index, place in enumerate(places):
        known = KINDS | _LIMITS
        if index and places[index - 1].isdigit() and place in known:
            record = known[place]
            continue
        field = record.model_fields.get(place)
        if field is not None:
            nested = [each for each in (field.annotation, *get_args(field.annotation)) if _is_record(each)]
            record = nested[0] if nested and index + 1 < len(places) else record
        shown.append(str(int(place) + 1) if place.isdigit() else place)
    return record, shown


def _is_record(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _near(name: str, known: Iterable[str]) -> str:
    near = closest_name(name, list(known))
    return f' (did you mean "{near}"?)' if near else ""
