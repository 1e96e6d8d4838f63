"""Rules for the routing of cables, most of them based on moment arms.

They find cables that have the same effect, end early, cancel themselves, have a misplaced site, have several actuators,
or leave their pulley.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.sim.moment_arms import MomentArms
from aidsr.sim.ownership import WRAP_SURFACES, tendon_wraps
from aidsr.sim.structure import Chain, Tendon
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.thresholds import FEW_CABLES

Array = NDArray[np.float64]

SAME_CABLE = 0.99
"""Cosine between the moment arms of two cables over all poses, from which they have the same effect: 8 deg. Our choice:
in 180 robots of the corpus's writers and of the built-in team and 21 of language models the largest is 0.71."""
_ALL_BUT_EQUAL = 0.1
"""Largest relative difference between the norms of the moment arms of two cables with the same effect. Our choice: a
cable nearer to the backbone has another effect."""
_LONG_LIMB = 4
"""Fewest turning points of a limb whose cables are checked for their reach and for zigzags. Our choice."""
_A_LEVER = 0.05
"""Moment about a turning point / largest moment along the limb, above which a cable reaches the turning point. Our
choice."""
_LEAST_LEVER = 1e-3
"""Moment arm / L below which a cable runs through the axis. Our choice: 0.3 mm in a robot of 0.3 m."""
REACHED_SHARE = 0.5
WARN_REACHED_SHARE = 0.75
"""Turning points of a limb up to the last one that a cable reaches / all: up to the first value an error, below the
second a warning. Our choice: a passive tip may be intended, half a limb is a mistake; 0.91 is the least in the same
robots."""
CANCELLED_SHARE = 0.25
"""Sum of a cable's moments along a limb / the sum possible with its distance from the backbone, below which the moments
cancel out. Our choice: 0.43 is the least in the same robots."""
_CROSSINGS = 2
"""Fewest changes of side along a limb of a zigzag; a cable with one change has the shape of an S. Our choice."""


def _limbs(robot: RobotUnderTest) -> list[Chain]:
    return [chain for chain in robot.structure.chains if len(chain.bodies) >= _LONG_LIMB]


def _find_same_cables(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find cables with about equal moment arms in every pose, as of two cables on the same side of a limb.

    The heads of one muscle run side by side on purpose, so a group of muscles is only a warning.
    """
    cables = robot.moment_arms
    n = len(cables.tendons)
    flat = np.array([cables.led_m[:, k].ravel() for k in range(n)])
    norms = [float(np.linalg.norm(arms)) for arms in flat]
    alike: list[set[int]] = []
    largest = 0.0
    for one in range(n):
        for other in range(one + 1, n):
            if not norms[one] * norms[other]:
                continue
            cosine = float(flat[one] @ flat[other] / (norms[one] * norms[other]))
            if cosine < SAME_CABLE or abs(norms[one] - norms[other]) > _ALL_BUT_EQUAL * max(norms[one], norms[other]):
                continue
            largest = max(largest, cosine)
            group = next((group for group in alike if one in group), None)
            if group is None:
                alike.append(group := {one})
            group.add(other)
    if alike:
        yield SAME_CABLES.fault(
            "these cables bend the same joints by the same amounts: "
            + "; ".join(" and ".join(_names(robot, cables, group)) for group in alike),
            names=(name for group in alike for name in _names(robot, cables, group)),
            severity="warning" if all(_are_muscles(robot, cables, group) for group in alike) else "error",
            measured=largest,
            limit=SAME_CABLE,
            likely_cause="antagonists routed on the same side, or two cables that were to add their pulls",
        )


def _are_muscles(robot: RobotUnderTest, cables: MomentArms, members: set[int]) -> bool:
    gains, muscle = robot.model.actuator_gaintype, int(mujoco.mjtGain.mjGAIN_MUSCLE)
    return all(int(gains[actuator]) == muscle for index in members for actuator in cables.tendons[index].actuators)


def _names(robot: RobotUnderTest, cables: MomentArms, members: set[int]) -> list[str]:
    return [robot.tendon(cables.tendons[index].id) for index in sorted(members)]


SAME_CABLES = Rule(
    code="same_cables",
    stage=Stage.WIRING,
    finds="Two driven cables have the same moment arms about every joint.",
    why="The second one adds a motor and no motion. Usually it was meant for the other side of the limb.",
    limit="cosine between the moment arms of two cables over a straight and six bent poses, where they differ in size "
    f"by at most {100 * _ALL_BUT_EQUAL:g} %: below {SAME_CABLE:g}; joints that an equality couples count as one; a "
    "warning where all of them are muscles, whose heads run side by side",
    check=_find_same_cables,
    unit="(cosine)",
    cure="Move the sites of one of them to the side that no cable runs along, or remove it and its actuator; one cable "
    "with the pull of both does as much.",
    example=Example((('pos="-0.009 0', 'pos="0.009 0'),)),
)


def _find_short_cables(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find limbs that cables bend only in the part near the root."""
    cables = robot.moment_arms
    short: dict[int, tuple[float, int, list[Tendon]]] = {}
    for chain in _limbs(robot):
        moments = [np.linalg.norm(cables.along(robot.model, chain, k), axis=1) for k in range(len(cables.tendons))]
        largest = max((float(moment.max()) for moment in moments), default=0.0)
        if largest < _LEAST_LEVER * robot.length_m:
            continue
        reached = [int(np.flatnonzero(moment > _A_LEVER * largest).max(initial=-1)) + 1 for moment in moments]
        share = max(reached) / len(chain.bodies)
        if share < WARN_REACHED_SHARE:
            driven = [cables.tendons[k] for k, to in enumerate(reached) if to]
            short[chain.bodies[max(reached)]] = share, len(chain.bodies), driven
    if short:
        least, joints, _ = min(short.values(), key=lambda limb: limb[0])
        yield CABLES_END_EARLY.fault(
            f"no cable bends the limb from {' and '.join(robot.body(body) for body in short)} on",
            names=dict.fromkeys(robot.tendon(tendon.id) for *_, tendons in short.values() for tendon in tendons),
            measured=least,
            limit=REACHED_SHARE if least <= REACHED_SHARE else WARN_REACHED_SHARE,
            whole=joints,
            whole_unit="joints",
            severity="error" if least <= REACHED_SHARE else "warning",
            likely_cause="the cables end long before the limb does",
        )


CABLES_END_EARLY = Rule(
    code="cables_end_early",
    stage=Stage.WIRING,
    finds="All cables of a limb end long before the limb does.",
    why="What is beyond their last site is a passive tail: no command bends it, and it sags and swings.",
    limit="joints of a limb up to the last that a cable has a lever about / all of them: an error up to "
    f"{REACHED_SHARE:g}, a warning below {WARN_REACHED_SHARE:g}; limbs of {_LONG_LIMB} joints or more",
    check=_find_short_cables,
    unit="of the limb's joints",
    cure="Route at least one cable and its antagonist up to the last segment.",
    example=Example(
        tuple((f'      <site site="{side}{index}"/>\n', "") for side in ("front", "back") for index in (4, 5, 6))
    ),
)


def _find_cancelling_cables(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find cables that change sides along a limb, so that the bends they cause cancel each other."""
    cables = robot.moment_arms
    shares: dict[bool, dict[str, tuple[float, float]]] = {True: {}, False: {}}
    for chain in _limbs(robot):
        for k, tendon in enumerate(cables.tendons):
            moments = cables.along(robot.model, chain, k)
            points, offsets = _offsets_m(robot, chain, tendon)
            if not points or np.linalg.norm(moments, axis=1).max() < _LEAST_LEVER * robot.length_m:
                continue
            passed = max(points) + 1 - min(points)
            possible_m = passed * float(np.median(np.linalg.norm(offsets, axis=1)))
            if passed < _LONG_LIMB or not possible_m:
                continue
            crossings = sum(float(one @ other) < 0 for one, other in pairwise(offsets))
            share = float(np.linalg.norm(moments.sum(axis=0))) / possible_m
            if share < CANCELLED_SHARE and crossings:
                shares[crossings >= _CROSSINGS][robot.tendon(tendon.id)] = share, possible_m
    for zigzags, found in shares.items():
        if found:
            least, possible_m = min(found.values())
            yield CABLE_CANCELS.fault(
                "runs from side to side, so that what it bends at one joint it bends back at the next"
                if zigzags
                else "bends one part of the limb against another",
                names=found,
                measured=least,
                limit=CANCELLED_SHARE,
                whole=possible_m,
                whole_unit="m",
                severity="error" if zigzags else "warning",
                likely_cause="its sites alternate between two sides of the limb" if zigzags else "",
            )


def _offsets_m(robot: RobotUnderTest, chain: Chain, tendon: Tendon) -> tuple[list[int], Array]:
    """Return, for each site of a cable on a limb, the turning point before it and its offset from the limb's line.

    Returns:
        Indices of the turning points, n_sites, and offsets, (n_sites, 3) [m].
    """
    along = np.diff(chain.anchors_m, axis=0)
    along = np.vstack([along, along[-1:]])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    points, offsets = list[int](), list[Array]()
    for site in tendon.sites:
        body = int(robot.model.site_bodyid[site])
        if body in chain.bodies:
            point = chain.bodies.index(body)
            away = robot.drawn.site_xpos[site] - chain.anchors_m[point]
            points.append(point)
            offsets.append(away - (away @ along[point]) * along[point])
    return points, np.array(offsets)


CABLE_CANCELS = Rule(
    code="cable_cancels",
    stage=Stage.WIRING,
    finds="A cable changes sides along a limb, so that what it bends cancels out.",
    why="A zigzag compresses the limb and bends it nowhere. Half to one side and half to the other makes an S, which "
    "may be meant: a warning.",
    limit="sum of the moments along a limb / joints passed x the cable's distance from the limb's line: at least "
    f"{CANCELLED_SHARE:g}; an error where the cable changes sides {_CROSSINGS} times or more",
    check=_find_cancelling_cables,
    unit="of what its distance from the limb could give",
    cure="Route the cable along one side of the limb from its first to its last site.",
    example=Example(
        tuple(
            (f'<site name="{side}{k}" pos="{sign}0.009', f'<site name="{side}{k}" pos="{other}0.009')
            for k in (2, 3, 6)
            for side, sign, other in (("front", "", "-"), ("back", "-", ""))
        )
    ),
)

MISPLACED_SHARE = 0.5
"""Largest distance of a site from the line between its neighbours / the cable's median moment arm. Our choice."""
_REGULAR_SHARE = 0.2
"""Upper bound of the same quantity for all other sites after the misplaced one is removed: in a cable that is curved
everywhere, no site is misplaced. Our choice."""
_MANY_SITES = 5


def _find_misplaced_sites(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find cables with one site that is off the line of the others."""
    cables = robot.moment_arms
    worst: dict[str, tuple[float, float]] = {}
    tendons: list[str] = []
    for k, tendon in enumerate(cables.tendons):
        arms = np.abs(cables.arms_m[0, k])
        arms = arms[arms > _A_LEVER * arms.max(initial=0.0)]
        if len(tendon.sites) < _MANY_SITES or not arms.size:
            continue
        points = robot.drawn.site_xpos[list(tendon.sites)]
        lever_m = float(np.median(arms))
        if (found := _outlier(points, lever_m)) is not None:
            site, share = found
            worst[robot.site(tendon.sites[site])] = share, lever_m
            tendons.append(robot.tendon(tendon.id))
    if worst:
        share, lever_m = max(worst.values())
        yield SITE_MISPLACED.fault(
            f"off the line of the other sites of {' and '.join(tendons)}",
            names=worst,
            measured=share,
            limit=MISPLACED_SHARE,
            whole=lever_m,
            whole_unit="m",
            likely_cause="a sign or a coordinate of this one site is wrong",
        )


def _outlier(points: Array, lever_m: float) -> tuple[int, float] | None:
    """Return the index of the only point off the line of the others, and its distance / `lever_m`.

    None if no point or more than one point is off the line.
    """
    off = _off_line_m(points) / lever_m
    at = int(off.argmax()) + 1
    others = _off_line_m(np.delete(points, at, axis=0)) / lever_m
    if off[at - 1] > MISPLACED_SHARE and others.max() < _REGULAR_SHARE:
        return at, float(off[at - 1])
    return None


def _off_line_m(points: Array) -> Array:
    """Return the distance of each inner point from the line through its neighbours, (n - 2,) [m]."""
    chords = points[2:] - points[:-2]
    lengths_m = np.linalg.norm(chords, axis=1)
    crossed = np.linalg.norm(np.cross(points[1:-1] - points[:-2], chords), axis=1)
    return np.asarray(np.divide(crossed, lengths_m, out=np.zeros_like(crossed), where=lengths_m > 0))


SITE_MISPLACED = Rule(
    code="site_misplaced",
    stage=Stage.WIRING,
    finds="One site of a cable is off the line of all others.",
    why="The cable pulls its two joints to another side than the rest of the limb.",
    limit="distance of a site from the line between its neighbours / the cable's median moment arm: at most "
    f"{MISPLACED_SHARE:g}, where all others are within {_REGULAR_SHARE:g} without it; cables of {_MANY_SITES} sites or "
    "more",
    check=_find_misplaced_sites,
    unit="of the cable's lever",
    cure="Give this site the same offset from the backbone as its neighbours.",
    example=Example((('<site name="front3" pos="0.009 0', '<site name="front3" pos="-0.009 0'),)),
)


def _find_shared_cables(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find cables with several actuators in a robot in which another cable has none."""
    tendons = [tendon for tendon in robot.structure.tendons if tendon.spatial]
    shared = [motors for tendon in tendons if len(motors := _motors(robot.model, tendon)) > 1]
    idle = [tendon for tendon in tendons if not tendon.actuators]
    if shared and idle:
        yield CABLE_SHARED.fault(
            f"several actuators pull the same cable, and none pulls "
            f"{' and '.join(robot.tendon(tendon.id) for tendon in idle)}",
            names=(robot.actuator(motor) for motors in shared for motor in motors),
            measured=max(len(motors) for motors in shared),
            limit=1,
            likely_cause="an actuator names the wrong tendon",
        )


def _motors(model: mujoco.MjModel, tendon: Tendon) -> list[int]:
    """Return the actuators of a tendon that pull a cable at rest; a damper beside a servo is not a second motor."""
    used = {int(mujoco.mjtGain.mjGAIN_FIXED): 1, int(mujoco.mjtGain.mjGAIN_AFFINE): 2}  # the third is of the velocity
    return [
        actuator
        for actuator in tendon.actuators
        if (count := used.get(int(model.actuator_gaintype[actuator]))) is None
        or model.actuator_gainprm[actuator, :count].any()
    ]


CABLE_SHARED = Rule(
    code="cable_shared",
    stage=Stage.WIRING,
    finds="Several actuators pull one cable, while another cable has none.",
    why="Usually an actuator names the wrong tendon: what was meant as its antagonist pulls along with it.",
    limit="actuators of a cable, where another cable has none: at most 1, always a warning",
    check=_find_shared_cables,
    severity="warning",
    unit="actuators",
    cure="Let each actuator name its own tendon.",
    example=Example((('name="pull_back" tendon="back"', 'name="pull_back" tendon="front"'),)),
)

_PULLEY_SHARE = 0.25
"""Moment arm about a joint / the cable's largest, below which the joint is not checked: at a universal joint the cable
lies in the plane of one axis and changes its side as the other axis turns. Our choice."""
TURNED_SHARE = 0.1
"""Largest moment arm about a joint in the opposite direction / largest moment arm about it, above which the cable
changes its side of the pulley. Our choice."""


def _find_left_pulleys(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find cables around a pulley whose moment arm has different signs in different poses."""
    cables = robot.moment_arms
    left: dict[str, tuple[float, float]] = {}
    for k, tendon in enumerate(cables.tendons):
        if not any(kind in WRAP_SURFACES for kind, _ in tendon_wraps(robot.model, tendon.id)):
            continue
        arms = cables.led_m[:, k]
        smaller = np.minimum(arms.max(axis=0), -arms.min(axis=0))
        largest = np.abs(arms).max(axis=0)
        passed = np.flatnonzero(largest > max(_LEAST_LEVER * robot.length_m, _PULLEY_SHARE * largest.max(initial=0.0)))
        if not passed.size:
            continue
        worst = passed[np.argmax(smaller[passed] / largest[passed])]
        share = float(smaller[worst] / largest[worst])
        if share > TURNED_SHARE:
            left[robot.tendon(tendon.id)] = share, float(largest[worst])
    if left:
        share, lever_m = max(left.values())
        yield PULLEY_LEFT.fault(
            "the cable passes its pulley now on one side, now on the other",
            names=left,
            severity="error" if len(left) > FEW_CABLES * len(cables.tendons) else "warning",
            measured=share,
            limit=TURNED_SHARE,
            whole=lever_m,
            whole_unit="m",
            likely_cause="the wrapping geom has no sidesite, or is smaller than the way the cable moves",
        )


PULLEY_LEFT = Rule(
    code="pulley_left",
    stage=Stage.WIRING,
    finds="A cable leaves its pulley: it passes it on one side in one pose and on the other in another.",
    why="The same pull then bends the joint to the other side, from one moment to the next.",
    limit="moment arm about a joint to the other side in any of a straight and six bent poses / its largest: at most "
    f"{TURNED_SHARE:g}; cables with a wrapping geom, joints about which they have a quarter of their largest moment "
    f"arm; a warning for at most {100 * FEW_CABLES:g} % of the cables",
    check=_find_left_pulleys,
    unit="of the largest moment arm",
    cure="Give the wrapping geom a sidesite on the side where the cable shall run.",
    example=Example(
        (
            (
                '<geom name="g3"/>',
                '<geom name="g3"/>\n'
                '            <geom name="pulley" type="sphere" size="0.003" pos="0 0 0" mass="0.001"/>',
            ),
            ('<site name="front2" pos="0.009', '<site name="front2" pos="0'),
            ('<site name="front3" pos="0.009', '<site name="front3" pos="0'),
            ('      <site site="front3"/>', '      <geom geom="pulley"/>\n      <site site="front3"/>'),
        )
    ),
)
