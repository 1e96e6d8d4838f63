"""Making of the corpus: good robots from writers, bad robots from good ones, each confirmed by the oracle.

A robot counts as good if the oracle finds no symptom above half its limit, as bad if the symptom of its own fault is at
least twice its limit, and as a near miss if this symptom is at most half its limit. A robot that does not have the
intended grade is put aside and counted. The same holds for a robot with a driven fault that shows at half the time step
but not at the robot's own time step, or that diverges: its real fault is an instability.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import mujoco
import numpy as np
from benchmarks.validator.corpus.faults import DOCUMENT, INJECTIONS, Injection, UnsuitableError
from benchmarks.validator.corpus.specimen import Grade, Specimen, Split
from benchmarks.validator.corpus.writers import ALL_WRITERS
from benchmarks.validator.oracle import examine_good, first_symptom, measure_of
from benchmarks.validator.oracle.driven import plainly_diverges
from benchmarks.validator.oracle.loop import Bench

Made = tuple[list[Specimen], dict[str, int]]
"""Robots, and the number of attempts that were put aside, by reason."""

_DRIVEN = frozenset(
    {
        "chatter",
        "limit_overrun",
        "self_collision_lock",
        "antagonist_lock",
        "tendon_against_limit",
        "mass_ratio",
        "actuator_too_weak",
        "too_stiff",
        "no_effect",
        "overdamped",
        "armature_large",
        "filter_slow",
        "sensor_constant",
    }
)
"""Codes whose symptom is a driven robot's behaviour. If the simulation diverges, that is the fault and no other."""
_WORKING = frozenset(
    {
        "tendon_through_body",
        "tendon_pushes",
        "actuator_overforce",
        "actuator_power",
        "actuator_speed",
        "cable_stroke",
        "tendon_slack",
    }
)
"""Codes about the load that a working robot puts on its cables and motors. A robot that falls, shakes or diverges needs
other forces than intended, so a bad robot of these codes must have no other fault."""
_PASSIVE = frozenset({"gravity_collapse", "underdamped"})
"""Codes whose symptom is a passive robot's behaviour, as long as it does not diverge."""
_FIRST = ("joint_range_too_small", "initial_penetration", "passive_collapse", "gravity_collapse")
"""Codes of faults that show before a robot is driven. A robot that has one of them too does not show the effect of its
change when driven."""
_CAUSES = ("tendon_against_limit", "mass_ratio", "actuator_too_weak", "too_stiff")
"""Codes of faults that explain why driving has no effect. The code `no_effect` means that none of them does."""
_LOOKS = 10
"""Number of robots examined per attempt: few have the parts that some changes need, such as servos."""
_FIRST_SEED: dict[Split, int] = {"tuning": 1000, "held out": 2000, "third": 3000, "fourth": 4000}


def grade_of(severity: float) -> Grade:
    """Return the grade of a robot by the measured severity of its symptom."""
    if severity >= 2:
        return "bad"
    return "near miss" if severity <= 0.5 else "band"


def make_good(writer: str, split: Split, index: int, patience: int) -> Made:
    """Write robots until the oracle finds no fault in one, at most `patience` times."""
    put_aside: dict[str, int] = {}
    for attempt in range(patience):
        rng = np.random.default_rng([_FIRST_SEED[split], _number(writer), index, attempt])
        written = ALL_WRITERS[writer](rng)
        found, symptoms = examine_good(written.mjcf)
        if found:
            reason = f"good, {writer}: {next(iter(found))}"
            put_aside[reason] = put_aside.get(reason, 0) + 1
            continue
        name = f"{writer}-{index}"
        made = Specimen(name, split, written.family, writer, written.mjcf, symptoms=symptoms)
        return [made], put_aside
    return [], put_aside


def make_bad(number: int, grade: Grade, batch: range, split: Split, bases: Sequence[Specimen], patience: int) -> Made:
    """Apply one injection to good robots until enough of them have the intended grade."""
    injection, made, put_aside = INJECTIONS[number], list[Specimen](), dict[str, int]()
    rng = np.random.default_rng(
        [_FIRST_SEED[split], 1, number, _number(grade), *([batch.start] if batch.start else [])]
    )
    attempts = len(batch) * patience
    for _ in range(_LOOKS * attempts):
        if len(made) == len(batch) or not attempts:
            break
        base, attempts = bases[int(rng.integers(len(bases)))], attempts - 1
        try:
            mjcf, words = injection.change(base.mjcf, rng, injection.draw_size(grade, rng))
            bench = Bench(mjcf)
            severity = measure_of(injection.code)(bench)
        except UnsuitableError:
            attempts += 1
            continue
        except ValueError as error:  # MuJoCo refuses the changed robot
            reason = f"{injection.code}, {grade}: refused, {str(error)[:60]}"
            put_aside[reason] = put_aside.get(reason, 0) + 1
            continue
        if grade_of(severity) != grade or not _is_as_named(injection, mjcf):
            reason = f"{injection.code}, {grade}: came out as {grade_of(severity)}"
            put_aside[reason] = put_aside.get(reason, 0) + 1
            continue
        if grade == "bad" and (why := _is_something_else(injection.code, bench)):
            put_aside[f"{injection.code}: {why}"] = put_aside.get(f"{injection.code}: {why}", 0) + 1
            continue
        made.append(_changed(base, injection, number, batch[len(made)], grade, mjcf, words, severity))
    return made, put_aside


def _is_something_else(code: str, halved: Bench) -> str:
    """Return why the robot's real fault is another one, or none at its own time step; "" if the fault is `code`."""
    if code not in _DRIVEN | _WORKING | _PASSIVE:
        return ""
    if code in _DRIVEN and any(measure_of(cause)(halved) > 1 for cause in _FIRST):
        return "has a cause of its own"
    if code in _WORKING and (symptom := first_symptom(halved, ceiling=1.0)):
        return f"does not work, {next(iter(symptom))}"
    if code == "no_effect" and any(measure_of(cause)(halved) > 0.5 for cause in _CAUSES):
        return "has a cause of its own"
    bench = Bench(halved.mjcf, 1.0)
    if halved.failed or measure_of(code)(bench) < 2 or (code in _WORKING and measure_of("chatter")(bench) > 1):
        return "not at both time steps"
    return "diverges" if bench.failed or (code not in _PASSIVE and plainly_diverges(bench)) else ""


def _is_as_named(injection: Injection, mjcf: str) -> bool:
    """Return whether a dropping robot lands as its code says: "base_not_attached" must land, "free_fall" must not."""
    from benchmarks.validator.oracle.passive import lands

    if injection.code == "base_not_attached":
        return lands(mjcf)
    return injection.code != "free_fall" or not lands(mjcf)


def make_mistake(number: int, count: int, split: Split, bases: Sequence[Specimen]) -> Made:
    """Make documents with one mistake. MuJoCo must refuse all of them, except those that the project forbids."""
    injection, made, put_aside = DOCUMENT[number], list[Specimen](), dict[str, int]()
    rng = np.random.default_rng([_FIRST_SEED[split], 2, number])
    for base in (bases[int(k)] for k in rng.permutation(len(bases))):
        if len(made) == count:
            break
        try:
            mjcf, words = injection.change(base.mjcf, rng, 1.0)
        except UnsuitableError:
            continue
        if injection.code != "forbidden" and _loads(mjcf):
            reason = f"{injection.code}: MuJoCo accepts it"
            put_aside[reason] = put_aside.get(reason, 0) + 1
            continue
        made.append(_changed(base, injection, number, len(made), "bad", mjcf, words, None, loads=False))
    return made, put_aside


def _changed(
    base: Specimen,
    injection: Injection,
    number: int,
    index: int,
    grade: Grade,
    mjcf: str,
    words: str,
    severity: float | None,
    *,
    loads: bool = True,
) -> Specimen:
    return Specimen(
        name=f"{injection.code}-{number}-{grade.replace(' ', '-')}-{index} of {base.name}",
        split=base.split,
        family=base.family,
        style=base.style,
        mjcf=mjcf,
        grade=grade,
        code=injection.code,
        change=words,
        arguments=dict(injection.arguments),
        severity=severity,
        loads=loads,
    )


def _loads(mjcf: str) -> bool:
    try:
        mujoco.MjSpec.from_string(mjcf).compile()
    except ValueError:
        return False
    return True


def _number(text: str) -> int:
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "little")
