"""Fixes of ranges: flags, order, units, width, and missing control ranges."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterator

from aidsr.core.formatting import counted
from aidsr.fixes.record import EditDocument, Fix, Request, note
from aidsr.mjcf.defaults import Setting, default_classes, is_placed, setting
from aidsr.mjcf.edit import effective_numbers, entries, gain_of, gain_sign, get_numbers, joints, set_numbers
from aidsr.mjcf.elements import Element, elements, numbers
from aidsr.mjcf.schema import actuator_elements, range_flags

_FULL_TURN_RAD = 2.0 * math.pi
_MEANT_RAD = [half_turns * math.pi for half_turns in range(2, 7)]
"""Angles of a full turn and more that may be meant in radians. Our choice: a wrist may turn three times."""
_ROUNDED_RAD = 0.05
"""Error of rounding such an angle to one decimal; no whole number of degrees is this close to one of these angles."""
_TURNING = ("hinge", "ball")

_WIDE_RAD = 0.6
"""Half the new range of a joint whose range was too narrow. Our choice: ten such joints bend a limb by a full turn."""
_RADIANS_LOOK_LIKE = 2.0 * math.pi
"""Number below which the range of a joint was meant in radians although degrees are expected. Our choice: no hinge of a
chain has a limit at 6 deg."""

TENSION_N = 15.0
"""Largest pull assumed for an actuator [N]. Our choice: a hobby servo of 0.15 N m on a 10 mm spool."""


def missing_limit_flags(root: Element, _: Request) -> Iterator[str]:
    """Write the flag of a range where `autolimits` is off and neither the element nor its class has one."""
    if not any(compiler.get("autolimits") == "false" for compiler in elements(root, "compiler")):
        return
    classes = default_classes(root)
    for element, attribute, flag in _ranges(root):
        if setting(element, flag, classes) is None and any(numbers(element.get(attribute, ""))):
            element.set(flag, "true")
            yield note(element, f'wrote {flag}="true" beside {attribute}, since autolimits is off')


def inverted_ranges(root: Element, _: Request) -> Iterator[str]:
    """Write the smaller number of a range first, unless that of a ball joint would then not begin with 0."""
    classes = default_classes(root)
    for element, attribute, flag in _ranges(root):
        ends = numbers(element.get(attribute, ""))
        limited = setting(element, flag, classes)
        if len(ends) != 2 or ends[0] <= ends[1] or (limited is not None and limited.value == "false"):
            continue
        kind = setting(element, "type", classes) if element.tag == "joint" else None
        if attribute == "ctrlrange" and _would_push(root, element, ends[1], ends[0]):
            continue
        if kind is None or kind.value != "ball" or ends[1] == 0.0:
            low_last = element.get(attribute, "").split()
            element.set(attribute, f"{low_last[1]} {low_last[0]}")
            yield note(element, f"wrote {attribute} with the smaller number first")


def ball_ranges(root: Element, _: Request) -> Iterator[str]:
    """Write the range -a to a of a ball joint as 0 to a: it limits the angle from rest, whatever the direction.

    Source: MuJoCo XML reference, body/joint/range.
    """
    for joint, found in _ball_ranges(root):
        ends = numbers(found.value)
        if len(ends) == 2 and ends[0] < 0 < ends[1] and -ends[0] == ends[1]:
            joint.set("range", f"0 {found.value.split()[1]}")
            yield note(joint, f"wrote the range of the ball joint as 0 to {ends[1]:g}")


def ball_ranges_from_zero(root: Element, _: Request) -> Iterator[str]:
    """Write 0 for the first number of a ball joint's range: it limits the angle from rest."""
    for joint, found in _ball_ranges(root):
        ends = numbers(found.value)
        if len(ends) == 2 and ends[0] != 0.0 and (widest := max(map(abs, ends))) > 0.0:
            set_numbers(joint, "range", 0.0, widest)
            yield note(joint, f"wrote 0 to {widest:g} for the range {ends[0]:g} to {ends[1]:g} of a ball joint")


def empty_joint_ranges(root: Element, _: Request) -> Iterator[str]:
    """Replace a joint range without width by the most common range of joints of its type; drop it if there is none."""
    classes = default_classes(root)

    def kind_of(joint: Element) -> str:
        kind = setting(joint, "type", classes)
        return kind.value if kind else "hinge"

    placed = [joint for joint in elements(root, "joint") if is_placed(joint)]
    wide = Counter[tuple[str, str]]()
    empty = []
    for joint in placed:
        found = setting(joint, "range", classes)
        ends = numbers(found.value) if found else []
        if len(ends) == 2 and ends[0] < ends[1]:
            wide[kind_of(joint), found.value if found else ""] += 1
        elif len(ends) == 2 and ends[0] == ends[1] and "range" in joint.attrib:
            empty.append(joint)
    for joint in empty:
        usual = next((ends for (kind, ends), _count in wide.most_common() if kind == kind_of(joint)), "")
        before = joint.get("range", "")
        if usual:
            joint.set("range", usual)
            yield note(joint, f"wrote the range {usual} of most other joints for {before}, which has no width")
        else:
            del joint.attrib["range"]
            joint.attrib.pop("limited", "")
            yield note(joint, f"dropped the range {before}, which has no width")


def degrees_in_radians(root: Element, _: Request) -> Iterator[str]:
    """Turn degrees into radians where the compiler reads radians and an angle is beyond a full turn.

    A rounded number of half turns is left alone, and so is a hinge that an actuator drives directly: it may be a spool
    with many turns.
    """
    if not any(compiler.get("angle") == "radian" for compiler in elements(root, "compiler")):
        return
    yield from _turn_ranges(root)
    for element in elements(root):
        euler, turn = numbers(element.get("euler", "")), numbers(element.get("axisangle", ""))
        if _are_degrees(euler):
            element.set("euler", _radians(euler))
            yield note(element, "read euler as degrees, since it is beyond a full turn in radians")
        if len(turn) == 4 and _are_degrees(turn[3:]):
            element.set("axisangle", " ".join([*element.get("axisangle", "").split()[:3], _radians(turn[3:])]))
            yield note(element, "read the angle of axisangle as degrees, since it is beyond a full turn in radians")


def _turn_ranges(root: Element) -> Iterator[str]:
    classes = default_classes(root)
    actuators = elements(root, *actuator_elements())
    driven = {actuator.get("joint") or actuator.get("jointinparent") for actuator in actuators}
    users: dict[Element, list[tuple[Element, Setting]]] = defaultdict(list)
    for joint in elements(root, "joint"):
        found = setting(joint, "range", classes) if is_placed(joint) else None
        if found is not None:
            users[found.holder].append((joint, found))

    def is_meant(joint: Element) -> bool:
        kind = setting(joint, "type", classes)
        return (kind.value if kind else "hinge") in _TURNING and joint.get("name", "") not in driven

    for holder, placed in users.items():
        ends = numbers(placed[0][1].value)
        if not _are_degrees(ends):
            continue
        meant = [joint for joint, _ in placed if is_meant(joint)]
        for element in [holder] if len(meant) == len(placed) else meant:
            element.set("range", _radians(ends))
            yield note(element, "read range as degrees, since it is beyond a full turn in radians")


def _ranges(root: Element) -> Iterator[tuple[Element, str, str]]:
    """Yield each element with a range, the name of the range attribute and the name of its flag."""
    for element in elements(root):
        for attribute in [str(name) for name in element.attrib]:
            flag = range_flags().get((str(element.tag), attribute))
            if flag:
                yield element, attribute, flag


def _are_degrees(angles: list[float]) -> bool:
    """Return whether an angle exceeds a full turn in radians and is not a rounded number of half turns."""
    return any(
        abs(angle) > _FULL_TURN_RAD
        and not any(math.isclose(abs(angle), turn, abs_tol=_ROUNDED_RAD) for turn in _MEANT_RAD)
        for angle in angles
    )


def _radians(degrees: list[float]) -> str:
    return " ".join(f"{math.radians(angle):.9g}" for angle in degrees)


def widen_joint_ranges(root: Element, request: Request) -> Iterator[str]:
    """Read joint ranges that were meant in radians as such, or open them to 34 degrees to both sides.

    Only hinges and balls have such ranges. If the fault names joints, only theirs are changed.
    """
    in_degrees = all(compiler.get("angle", "degree") == "degree" for compiler in elements(root, "compiler"))
    classes, placed = default_classes(root), [joint for joint in elements(root, "joint") if is_placed(joint)]
    named = set(request.names) if {joint.get("name") for joint in placed}.issuperset(request.names) else set()
    wanted: dict[Element, list[tuple[Element, tuple[float, float] | None]]] = defaultdict(list)
    for joint in placed:
        found, kind = setting(joint, "range", classes), setting(joint, "type", classes)
        ends = numbers(found.value) if found else []
        if found is None or len(ends) != 2:
            continue
        turns = (kind.value if kind else "hinge") in _TURNING and (not named or joint.get("name") in named)
        is_ball = kind is not None and kind.value == "ball"
        wider = _wider(ends[0], ends[1], in_degrees=in_degrees, is_ball=is_ball) if turns else None
        wanted[found.holder].append((joint, wider))
    changed = 0
    for holder, users in wanted.items():
        ranges = {wider for _joint, wider in users}
        for element, wider in [(holder, users[0][1])] if len(ranges) == 1 else users:
            before = effective_numbers(root, element, "range")
            if wider is not None:
                set_numbers(element, "range", *wider)
                changed += effective_numbers(root, element, "range") != before
    if changed:
        yield f"widened the ranges of {counted(changed, 'joint')}"


def _wider(low: float, high: float, *, in_degrees: bool, is_ball: bool) -> tuple[float, float]:
    """Return the range that a hinge or ball joint gets for a range that is too narrow, in the document's unit."""
    if in_degrees and max(abs(low), abs(high)) < _RADIANS_LOOK_LIKE:
        return math.degrees(low), math.degrees(high)
    wide = math.degrees(_WIDE_RAD) if in_degrees else _WIDE_RAD
    return (0.0 if is_ball else min(low, -wide)), max(high, wide)


def _ball_ranges(root: Element) -> Iterator[tuple[Element, Setting]]:
    """Yield each ball joint with a range, and its range, which is from the joint itself or from a default entry."""
    classes = default_classes(root)
    for joint in elements(root, "joint"):
        kind, found = setting(joint, "type", classes), setting(joint, "range", classes)
        if is_placed(joint) and kind is not None and kind.value == "ball" and found is not None:
            yield joint, found


def include_drawn_pose(root: Element, request: Request) -> Iterator[str]:
    """Extend the range of a joint that starts outside it, so that its limit does not throw it back."""
    for joint in elements(root, "joint"):
        if not is_placed(joint) or joint.get("name") not in request.names:
            continue
        ends = effective_numbers(root, joint, "range")
        drawn = (effective_numbers(root, joint, "ref") or [0.0])[0]
        if len(ends) == 2 and not ends[0] <= drawn <= ends[1]:
            set_numbers(joint, "range", min(ends[0], drawn), max(ends[1], drawn))
            yield note(joint, f"opened its range to {drawn:g}, where it is drawn")


def unlimit_tendons(root: Element, request: Request) -> Iterator[str]:
    """Drop the length limits of the tendons in question: a rest length outside them pulls from the start."""
    changed = 0
    for tendon in elements(root, "spatial", "fixed"):
        if tendon.get("range") and (not request.names or tendon.get("name") in request.names):
            del tendon.attrib["range"]
            tendon.attrib.pop("limited", "")
            changed += 1
    if changed:
        yield f"dropped the length limits of {counted(changed, 'tendon')}"


def add_control_ranges(root: Element, request: Request) -> Iterator[str]:
    """Give an actuator a control range: tendons are pulled, joints turned both ways, servos get that of their joint."""
    changed = 0
    for actuator in entries(root, "actuator"):
        if request.names and actuator.get("name") not in request.names:
            continue
        if wanted := _control_range(root, actuator):
            set_numbers(actuator, "ctrlrange", *wanted)
            actuator.attrib.pop("ctrllimited", "")
            changed += 1
    if changed:
        yield f"gave {counted(changed, 'actuator')} a control range"


def _control_range(root: Element, actuator: Element) -> tuple[float, float] | None:
    """Return the control range that fits an actuator, or None if only its author can know it."""
    written = get_numbers(actuator, "ctrlrange")
    if len(written) == 2 and written[0] > written[1] and not _would_push(root, actuator, written[1], written[0]):
        return written[1], written[0]
    if actuator.tag == "position" and actuator.get("tendon"):
        alike = _range_of_another(root, actuator)
        return (alike[0], alike[1]) if alike else None
    if actuator.tag == "position":
        driven = [joint for joint in joints(root) if joint.get("name") == actuator.get("joint")]
        limits = effective_numbers(root, driven[0], "range") if driven else []
        return (limits[0], limits[1]) if len(limits) == 2 else None
    if actuator.tag == "muscle":
        return 0.0, 1.0
    if actuator.tag not in ("motor", "general"):
        return None
    if not actuator.get("tendon"):
        return -1.0, 1.0
    gain = gain_of(root, actuator)
    forces_n = effective_numbers(root, actuator, "forcerange")
    if any(forces_n) or not (strongest := max(map(abs, _range_of_another(root, actuator)), default=0.0)):
        strongest = float(f"{max(map(abs, forces_n), default=TENSION_N) / (abs(gain) or 1.0):.6g}")
    return (0.0, strongest) if gain < 0 else (-strongest, 0.0)


def _would_push(root: Element, actuator: Element, low: float, high: float) -> bool:
    """Return whether a motor on a tendon could push with this control range."""
    if actuator.tag not in ("motor", "general") or not actuator.get("tendon"):
        return False
    sign = gain_sign(root, actuator)
    return max(sign * low, sign * high) > 0


def _range_of_another(root: Element, actuator: Element) -> list[float]:
    """Return the first control range of another actuator of the same kind on a tendon; empty if there is none."""
    for other in entries(root, "actuator"):
        if other is not actuator and other.tag == actuator.tag and other.get("tendon"):
            given = effective_numbers(root, other, "ctrlrange")
            if len(given) == 2 and given[0] < given[1]:
                return given
    return []


FIXES: tuple[Fix[EditDocument], ...] = (
    Fix(missing_limit_flags, cures=("ctrlrange_missing",), safe=True),
    Fix(inverted_ranges, cures=("joint_range_invalid", "ctrlrange_invalid", "range_inverted_ignored"), safe=True),
    Fix(ball_ranges, cures=("joint_range_invalid",), safe=True),
    Fix(degrees_in_radians, cures=(), safe=True),
    Fix(ball_ranges_from_zero, cures=("joint_range_invalid",)),
    Fix(empty_joint_ranges, cures=("joint_range_invalid",)),
    Fix(include_drawn_pose, cures=("loaded_spring",)),
    Fix(unlimit_tendons, cures=("tendon_limit_violated", "tendon_against_limit")),
    Fix(widen_joint_ranges, cures=("joint_range_too_small", "tendon_against_limit")),
    Fix(add_control_ranges, cures=("ctrlrange_invalid", "ctrlrange_missing")),
)
