"""Bad robots, each made from a good one by one change that causes exactly one fault."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import robots
from robots import Limb

from aidsr.validation.registry import require_rule
from aidsr.validation.rules_page import EXAMPLE_ARM

ARM = Limb(segments=8, length_m=0.2, mass_kg=0.07)


@dataclass(frozen=True)
class Bad:
    """A robot with one fault.

    Attributes:
        code: The one fault expected.
        mjcf: Makes the text.
        arguments: How it is validated.
        severity: Of the fault.
        beside: Errors that belong to the same change.
        warned: Warnings that do.
    """

    code: str
    mjcf: Callable[[], str]
    arguments: dict[str, Any] = field(default_factory=dict)
    severity: str = "error"
    beside: tuple[str, ...] = ()
    warned: tuple[str, ...] = ()


def arm(**changes: Any) -> str:
    return robots.arm(replace(ARM, **changes))


def swapped(pattern: str, new: str, text: str, count: int = 0) -> str:
    changed, hits = re.subn(pattern, new, text, count=count)
    assert hits, f"nothing to change for {pattern}"
    return changed


def within(element: str, new: str, text: str) -> str:
    return swapped(rf"<{element}>.*</{element}>", new, text)


def _without_tendons() -> str:
    joints = "".join(f'<motor name="m{i}" joint="j{i}x" gear="0.5" ctrlrange="-1 1"/>' for i in range(4))
    text = within("tendon", "", arm())
    return within(
        "sensor",
        "<sensor><framepos objtype='site' objname='tip'/></sensor>",
        within("actuator", f"<actuator>{joints}</actuator>", text),
    )


def _joint_motors() -> str:
    joints = "".join(f'<motor name="m{i}" joint="j{i}x" gear="0.5" ctrlrange="-1 1"/>' for i in range(4))
    return within("actuator", f"<actuator>{joints}</actuator>", arm())


def _side_by_side_chain() -> str:
    """Two segments only."""
    return arm(segments=2)


def _closed_too_early() -> str:
    """The fifth segment hangs from the world instead of from the fourth."""
    text = arm()
    head, tail = text.split('<body name="s4" pos="0 0 0.025">', 1)
    inner, rest = tail.split("</body>" * 9, 1)
    moved = f'<body name="s4" pos="0 0 0.1">{inner}' + "</body>" * 4
    return head + "</body>" * 5 + moved + rest


def _gaps() -> str:
    return swapped(r'(<geom name="g\d+" type="cylinder" size="0\.011) 0\.01125"', r'\1 0.004"', arm())


def _degrees_for_radians() -> str:
    return swapped(r'range="-45 45"', 'range="-0.6 0.6"', arm())


def _overlap() -> str:
    return swapped(r'(<geom name="base" [^>]*) pos="0 0 -0.0105"', r'\1 pos="0 0 0"', arm())


def _sphere_in_the_way() -> str:
    """A shell around the middle of the arm that its neighbours stand in: overlap is no fault of neighbours by name."""
    return swapped(r'(<body name="s4" [^>]*>)', r'\1<geom name="ball" type="sphere" size="0.03" mass="0.001"/>', arm())


def _tendon_limit() -> str:
    return swapped(r'<spatial name="t0"', '<spatial name="t0" limited="true" range="0 0.13"', arm())


def _no_contacts() -> str:
    return swapped(r"<geom ", '<geom contype="0" conaffinity="0" ', robots.crawler())


def unstable() -> str:
    """Stiff joints without damping at a coarse time step."""
    return swapped(r' damping="[^"]*"', "", robots.arm(replace(ARM, sag=0.02)))


def sprung() -> str:
    return swapped(r'(<joint name="j\d+x" )', r'\1springref="25" ', arm())


def _falling() -> str:
    return swapped(
        r"<worldbody>", "<worldbody><geom type='plane' size='0 0 1' pos='0 0 -2' name='floor'/>", robots.crawler()
    )


def fixed_but_free() -> str:
    """A floor a little below a robot with a free joint."""
    return swapped(
        r"<worldbody>", "<worldbody><geom type='plane' size='0 0 1' pos='0 0 -0.2' name='floor'/>", robots.crawler()
    )


def lying(text: str) -> str:
    return swapped(r'<body name="base">', '<body name="base" euler="0 90 0">', text)


def hanging(text: str) -> str:
    return swapped(r'<body name="base">', '<body name="base" euler="180 0 0">', text)


def ringing() -> str:
    """Hardly damped, and let go from straight."""
    return lying(robots.arm(replace(ARM, segments=6, damping_s=2e-4), timestep_s=0.0005))


def negative_damping() -> str:
    return swapped(r'(<joint name="j2[xy]" [^>]*damping=)"', r'\1"-', arm(damping_s=0.02))


def sliding_base() -> str:
    return swapped(r'<body name="base">', '<body name="base"><joint name="lift" type="slide" axis="0 0 1"/>', arm())


def overrun(bend_rad: float, radius_m: float) -> str:
    text = swapped(r' solreflimit="0.004 1"', "", arm(bend_rad=bend_rad, radius_m=radius_m))
    return swapped(r'range="-45 45"', 'range="-5 5"', text)


def hammering_servos() -> str:
    """Servos whose velocity gain the explicit integrator cannot follow: they hammer between their force limits."""
    servo = "".join(
        f'<position name="m{i}" tendon="t{i}" kp="2000" kv="20000" ctrlrange="0.18 0.2" forcerange="-40 0"/>'
        for i in range(4)
    )
    text = swapped("implicitfast", "Euler", arm())
    return within("actuator", f"<actuator>{servo}</actuator>", text)


def _zero_gear() -> str:
    return swapped(r'(<motor name="m0" [^>]*)gear="-1"', r'\1gear="0"', arm())


def _tendon_on_base() -> str:
    return swapped(r'(<spatial name="t0"[^>]*>).*?(</spatial>)', r'\1<site site="t0_3a"/><site site="t0_3b"/>\2', arm())


def _tendon_on_axis() -> str:
    return swapped(r'(<site name="t0_\w+" pos=)"[^ ]+ [^ ]+ ', r'\1"0 0 ', arm())


def locked_by_contact() -> str:
    """Shells around every second segment that meet before the arm can bend."""

    def shell(half_m: float, height_m: float) -> str:
        return "".join(
            f'<geom type="box" size="0.002 0.002 {half_m}" pos="{x} {y} {height_m}" mass="0.0001"/>'
            for x, y in ((0.016, 0), (-0.016, 0), (0, 0.016), (0, -0.016))
        )

    text = swapped(r'(<body name="s\d*[13579]" [^>]*>)', rf"\1{shell(0.0248, 0.0125)}", arm())
    return swapped(r'(<body name="base">)', rf"\1{shell(0.006, 0.006)}", text)


def _servos(upper: float) -> str:
    servo = "".join(
        f'<position name="m{i}" tendon="t{i}" kp="2000" kv="20" ctrlrange="0.15 {upper}"/>' for i in range(4)
    )
    return within("actuator", f"<actuator>{servo}</actuator>", arm())


def locked_servos() -> str:
    return _servos(0.156)


def _against_limit() -> str:
    """Joints that may only bend away from the only tendon's side."""
    text = robots.arm(replace(ARM, tendons=1, bend_rad=0.3))
    return swapped(r'(<joint name="j\d+y" [^>]*)range="-45 45"', r'\1range="-45 0.1"', text)


def _weak() -> str:
    return swapped(r'ctrlrange="0 [^"]*"', 'ctrlrange="0 0.3"', arm())


def stiff(stiffness_n_m_rad: float) -> str:
    springs = f'stiffness="{stiffness_n_m_rad}" damping="{0.05 * stiffness_n_m_rad}"'
    return swapped(r'stiffness="[^"]*" damping="[^"]*"', springs, arm())


def _heavy_tip() -> str:
    return hanging(swapped(r'(<geom name="g7" [^>]*) mass="[^"]*"', r'\1 mass="60"', arm()))


def still_sensors() -> str:
    return within("sensor", '<sensor><framepos objtype="body" objname="base"/></sensor>', arm())


def _skipping() -> str:
    return swapped(r'<site site="t\d_[1357][ab]"/>', "", arm(segments=9, offset_share=1.2, bend_rad=0.7))


def _through_parts() -> str:
    """Tendons on two sides from the base straight to the middle, inside the segments between."""
    text = arm(damping_s=0.2)
    for tendon in (0, 2):
        path = rf'(<spatial name="t{tendon}"[^>]*><site site="t{tendon}_basea"/>).*?(<site site="t{tendon}_4a"/>)'
        text = swapped(path, r"\1\2", text)
    return text


def pushing() -> str:
    return swapped(r'ctrlrange="0 ([^"]*)"', r'ctrlrange="-\1 \1"', arm())


def quick() -> str:
    """Tendons far from the backbone of a limb that bends a lot."""
    return robots.arm(Limb(length_m=0.5, mass_kg=0.5, radius_m=0.08, bend_rad=4))


def strong_and_quick() -> str:
    return robots.arm(Limb(tendons=2, length_m=1, mass_kg=2, radius_m=0.1, bend_rad=1.6, damping_s=0.005))


def _wide_and_strong() -> str:
    """So far from the backbone that a strong cable has half a metre to take up."""
    return robots.arm(Limb(length_m=1.2, mass_kg=2.5, radius_m=0.15, bend_rad=1.9, damping_s=0.2))


def long_servos(upper: float) -> str:
    """Servos that may only pull, told to let out more cable than the arm ever takes up."""
    text = _servos(upper).replace('kp="2000"', 'forcerange="-6 0" kp="2000"')
    return swapped(r"ctrlrange=\"0\.15", 'ctrlrange="0.18', text)


def thin_plate(thickness_m: float) -> str:
    plate = f'<geom name="plate" type="box" size="0.008 0.008 {thickness_m / 2}" pos="0 0 0.0125" mass="0.0001"/>'
    return swapped(r'(<body name="s4" [^>]*>)', rf"\1{plate}", arm())


def _of_lead_and_more() -> str:
    return swapped(r'(<geom name="g7" type="cylinder" size=")[^"]*"', r'\g<1>0.001 0.002"', arm())


def _two_on_one_side() -> str:
    """The cable opposite the first one, moved to its side."""
    return swapped(r'(<site name="t2_\w+" pos=")-', r"\1", arm())


def _half_cabled() -> str:
    """No cable beyond the third of eight segments."""
    return swapped(r'<site site="t\d_[3-7][ab]"/>', "", arm())


def _backs_only() -> str:
    """Both cables of each finger on its outer side."""
    return swapped(r'(<site name="f\d_t1_\w+" pos=")-0\.0048', r"\g<1>0.0036", robots.gripper())


def example(code: str) -> str:
    """The example of a rule."""
    shown = require_rule(code).example
    assert shown is not None
    return shown.fails(EXAMPLE_ARM)


SHOWN = (
    "few_bent_joints",
    "cable_on_linkage",
    "mostly_rigid",
    "motorized_joint",
    "thruster",
    "wheel",
    "loaded_spring",
    "outside_force",
    "held_from_outside",
    "joint_locked",
    "ghost_shape",
    "contact_excluded",
    "contact_margin",
    "part_in_the_air",
    "fully_actuated",
    "driven_overlap",
    "implausible_inertia",
    "actrange_missing",
    "moving_surface",
)
"""Codes whose example has that fault and no other."""

REALIZABLE = {"realizable": True}

BAD = (
    Bad("no_tendons", _without_tendons),
    Bad("no_actuators", lambda: within("actuator", "", arm())),
    Bad("no_sensors", lambda: within("sensor", "", arm())),
    Bad("tendons_not_actuated", _joint_motors),
    Bad("no_soft_chain", _side_by_side_chain),
    Bad("disconnected", _closed_too_early),
    Bad("segments_gap", _gaps),
    *(Bad(code, partial(example, code)) for code in SHOWN),
    Bad("adhesion", partial(example, "adhesion"), warned=("no_effect",)),
    Bad(
        "free_joint_resists",
        lambda: swapped(r"<freejoint[^>]*/>", '<joint type="free" damping="0.01"/>', robots.crawler()),
    ),
    Bad("ctrlrange_missing", lambda: swapped(r' ctrlrange="[^"]*"', "", arm())),
    Bad("ctrlrange_missing", lambda: swapped(r'ctrlrange="0 [^"]*"', 'ctrlrange="6 0"', arm())),
    Bad("range_inverted_ignored", lambda: swapped(r'range="-45 45"', 'range="45 -45"', arm(), count=2)),
    Bad("joint_range_too_small", _degrees_for_radians),
    Bad("initial_penetration", _overlap),
    Bad("initial_penetration", _sphere_in_the_way),
    Bad("tendon_limit_violated", _tendon_limit),
    Bad("contact_disabled", _no_contacts),
    Bad(
        "contact_disabled",
        lambda: swapped(r"<geom ", '<geom contype="0" conaffinity="0" ', arm()),
        {"needs_contact": True},
    ),
    Bad("numerical_instability", unstable),
    Bad("gravity_collapse", lambda: arm(sag=20)),
    Bad("gravity_collapse", lambda: lying(arm(sag=4)), severity="warning"),
    Bad("passive_collapse", sprung),
    Bad("base_not_attached", fixed_but_free),
    Bad("base_not_attached", _falling),
    Bad("free_fall", sliding_base),
    Bad("energy_growth", negative_damping),
    Bad("underdamped", ringing),
    Bad("chatter", hammering_servos),
    Bad("limit_overrun", lambda: overrun(3, radius_m=0.025), severity="warning"),
    Bad("limit_overrun", lambda: overrun(9, radius_m=0.011)),
    Bad("zero_gear", _zero_gear),
    Bad("actuator_sign", partial(example, "actuator_sign")),
    Bad("tendon_one_body", _tendon_on_base),
    Bad("tendon_no_moment", _tendon_on_axis),
    Bad("same_cables", _two_on_one_side),
    Bad("cables_end_early", _half_cabled),
    Bad("cable_cancels", partial(example, "cable_cancels")),
    Bad("site_misplaced", lambda: swapped(r'(<site name="t0_4a" pos=")', r"\1-", arm())),
    Bad("cable_shared", partial(example, "cable_shared"), severity="warning"),
    Bad("pulley_left", partial(example, "pulley_left")),
    Bad("hinges_parallel", lambda: swapped('name="j3y" axis="0 1 0"', 'name="j3y" axis="1 0 0"', arm())),
    Bad("only_opens", _backs_only, severity="warning"),
    Bad("self_collision_lock", locked_by_contact),
    Bad("antagonist_lock", locked_servos),
    Bad("tendon_against_limit", _against_limit),
    Bad("actuator_too_weak", _weak),
    Bad("wedged", partial(example, "wedged")),
    Bad("too_stiff", lambda: stiff(200)),
    Bad("too_stiff", lambda: stiff(4000)),
    Bad("no_effect", lambda: swapped('timestep="', 'viscosity="1e5" timestep="', arm())),
    Bad("overdamped", lambda: arm(damping_s=20)),
    Bad("armature_large", lambda: swapped('armature="[^"]*"', 'armature="1000"', arm())),
    Bad("filter_slow", partial(example, "filter_slow")),
    Bad("length_unit", partial(example, "length_unit")),
    Bad("mass_unit", partial(example, "mass_unit")),
    Bad("odd_gravity", partial(example, "odd_gravity")),
    Bad("overlap_hidden", partial(example, "overlap_hidden"), severity="warning"),
    Bad("keyframe_out_of_range", partial(example, "keyframe_out_of_range")),
    Bad("no_grip", partial(example, "no_grip")),
    Bad("segments_gap", lambda: swapped(r'(<body name="f\d_mount" pos="[^"]*) 0\.011"', r'\1 0.06"', robots.gripper())),
    Bad("mass_ratio", _heavy_tip),
    Bad("sensor_constant", still_sensors),
    Bad("tendon_skips_segments", _skipping, REALIZABLE, severity="warning"),
    Bad("tendon_through_body", _through_parts, REALIZABLE, warned=("tendon_skips_segments",)),
    Bad("tendon_pushes", pushing),
    Bad("tendon_slack", lambda: long_servos(0.3), REALIZABLE, severity="warning"),
    Bad("thin_wall", lambda: thin_plate(0.0004), REALIZABLE, severity="warning"),
    Bad("actuator_overforce", lambda: arm(bend_rad=3), REALIZABLE),
    Bad("actuator_overforce", lambda: arm(bend_rad=3), severity="warning"),
    # while commands are random its end meets its base, about as deep as is warned of
    Bad("actuator_power", strong_and_quick, {**REALIZABLE, "ignore": ("driven_overlap",)}, beside=("cable_stroke",)),
    Bad("actuator_speed", quick, REALIZABLE),
    Bad("cable_stroke", _wide_and_strong, REALIZABLE),
    Bad("implausible_density", _of_lead_and_more, REALIZABLE),
)
