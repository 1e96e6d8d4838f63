"""Simulated limbs are as far from exact rods as theory says, and the check says so."""

from __future__ import annotations

import math
import re

import mujoco
import numpy as np
import pytest
import robots
from rods import RodChain

from aidsr.core.errors import MjcfError
from aidsr.mjcf.compile import compile_mjcf
from aidsr.sim.elastica import Rod, first_frequency, loaded_tip
from aidsr.sim.structure import read_structure
from aidsr.validation.fidelity import FidelityReport, check_fidelity
from aidsr.validation.fidelity.cables import Cable, cables_along, guides_of
from aidsr.validation.fidelity.compare import arc_of, bend_by_cable, bend_by_load, frequency_of
from aidsr.validation.fidelity.limb import Limb, read_limb
from aidsr.validation.fidelity.material import rod_of
from aidsr.validation.fidelity.refine import half_step_percent, twice_the_segments_percent
from aidsr.validation.fidelity.rewrite import rewrite

SCHEMES = {"starts": ("starts", False), "doubled": ("starts", True), "middles": ("middles", False)}


def read(chain: RodChain) -> tuple[mujoco.MjModel, Limb, Rod, tuple[Cable, ...]]:
    return read_text(chain.mjcf())


def read_text(text: str) -> tuple[mujoco.MjModel, Limb, Rod, tuple[Cable, ...]]:
    model = compile_mjcf(text)
    structure = read_structure(model)
    limb = read_limb(model, structure.chains[0])
    return model, limb, rod_of(model, structure, limb), cables_along(model, structure, limb, set())


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_chain_is_read_as_the_rod_it_was_made_from(scheme: str) -> None:
    joints_at, doubled = SCHEMES[scheme]
    _, limb, rod, cables = read(RodChain(10, joints_at, doubled))
    assert (limb.joints_at, limb.clamp_doubled) == (joints_at, doubled)
    assert limb.length_m == pytest.approx(0.3)
    assert rod.bending_stiffness_n_m2 == pytest.approx(0.04)
    assert rod.mass_kg == pytest.approx(0.1)
    assert rod.tip_mass_kg == 0.0
    assert [(cable.name, cable.pull_n) for cable in cables] == [("cable", 10.0)]


@pytest.mark.parametrize(
    ("scheme", "segments", "tip_percent", "weight_percent"),
    [
        ("middles", 5, -1.0, -2.0),
        ("middles", 10, -0.25, -0.5),
        ("middles", 20, -0.06, -0.13),
        ("doubled", 5, 2.0, 4.0),
        ("doubled", 10, 0.5, 1.0),
        ("doubled", 20, 0.12, 0.25),
        ("starts", 5, 32.0, 44.0),
        ("starts", 10, 15.5, 21.0),
        ("starts", 20, 7.6, 10.0),
    ],
)
def test_deflections_miss_the_elastica_by_the_known_laws(
    scheme: str, segments: int, tip_percent: float, weight_percent: float
) -> None:
    """Source: docs/physics.md, the table of cantilevers."""
    model, limb, rod, _ = read(RodChain(segments, *SCHEMES[scheme]))
    tip, exact = bend_by_load(model, limb, 0.02), loaded_tip(rod, load_n=0.02)
    assert tip is not None
    assert 100 * (tip.transverse_m / exact.transverse_m - 1) == pytest.approx(tip_percent, rel=0.04, abs=0.006)
    sag, exact = bend_by_load(model, limb, 0.0, gravity_m_s2=0.1), loaded_tip(rod, gravity_m_s2=0.1)
    assert sag is not None
    assert 100 * (sag.transverse_m / exact.transverse_m - 1) == pytest.approx(weight_percent, rel=0.04, abs=0.006)


def test_large_deflections_are_followed() -> None:
    model, limb, rod, _ = read(RodChain(10))
    load_n = 3 * 0.04 / 0.3**2
    tip, exact = bend_by_load(model, limb, load_n), loaded_tip(rod, load_n=load_n)
    assert tip is not None
    off = math.hypot(tip.along_m - exact.along_m, tip.transverse_m - exact.transverse_m) / 0.3
    assert 0.001 < off < 0.007
    gravity = 20 * 0.04 / (0.1 * 0.3**2)
    sag, exact = bend_by_load(model, limb, 0.0, gravity_m_s2=gravity), loaded_tip(rod, gravity_m_s2=gravity)
    assert sag is not None
    assert abs(sag.transverse_m - exact.transverse_m) / 0.3 < 0.007


@pytest.mark.parametrize(
    ("scheme", "segments", "armature", "percent"),
    [
        ("middles", 10, 0.0, 0.23),
        ("doubled", 10, 0.0, -0.46),
        ("starts", 10, 0.0, -9.1),
        ("starts", 5, 0.0, -17.0),
        ("middles", 10, 1e-3, -6.0),
    ],
)
def test_the_first_frequency_misses_by_the_known_laws(
    scheme: str, segments: int, armature: float, percent: float
) -> None:
    model, limb, rod, _ = read(RodChain(segments, *SCHEMES[scheme], armature=armature))
    assert first_frequency(rod) / (2 * math.pi) == pytest.approx(2.154, abs=1e-3)
    assert 100 * (frequency_of(model, limb) / first_frequency(rod) - 1) == pytest.approx(percent, rel=0.06, abs=0.02)


@pytest.mark.parametrize(
    ("segments", "guides", "bend_rad", "percent"),
    [
        (5, (0.25, 0.75), 1.0, 8.4),
        (10, (0.25, 0.75), 1.0, 2.0),
        (20, (0.25, 0.75), 1.0, 0.5),
        (10, (0.0,), 1.0, 4.2),
        (10, (0.25, 0.75), 3.0, 5.1),
        (20, (0.25, 0.75), 3.0, 1.3),
    ],
)
def test_cables_bend_further_than_arcs_by_the_known_laws(
    segments: int, guides: tuple[float, ...], bend_rad: float, percent: float
) -> None:
    """Source: docs/physics.md, the table of guides."""
    end = (1.0,) if guides == (0.0,) else ()
    model, limb, _, (cable,) = read(RodChain(segments, guides=guides + end))
    arc = arc_of(model, limb, cable, bend_rad * 0.04 / (0.018 * 0.3))
    assert arc is not None
    assert arc.tip.angle_rad == pytest.approx(bend_rad)
    tip = bend_by_cable(model, limb, cable, arc)
    assert tip is not None
    assert 100 * (tip.angle_rad / bend_rad - 1) == pytest.approx(percent, rel=0.06)


def test_rest_is_where_a_simulation_settles() -> None:
    chain = RodChain(8)
    model, limb, _, (cable,) = read(chain)
    arc = arc_of(model, limb, cable, 5.0)
    assert arc is not None
    found = bend_by_cable(model, limb, cable, arc)
    assert found is not None
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    data.ctrl[:] = 5.0
    mujoco.mj_step(model, data, 4000)
    assert np.abs(data.qvel).max() < 1e-9
    assert data.qpos.sum() == pytest.approx(found.angle_rad, rel=1e-6)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_limb_written_with_twice_the_segments_is_the_finer_limb(scheme: str) -> None:
    coarse, fine = (RodChain(count, *SCHEMES[scheme]) for count in (8, 16))
    model, limb, rod, cables = read(coarse)
    chain = read_structure(model).chains[0]
    guides = {cable: guides_of(model, limb, cable) or () for cable in cables}
    for factor, expected in ((1, coarse), (2, fine)):
        written, again, its_rod, _ = read_text(rewrite(model, chain, limb, rod, guides, factor=factor))
        other, theirs, _, (cable,) = read(expected)
        assert len(again.segment_m) == expected.segments
        assert its_rod.bending_stiffness_n_m2 == pytest.approx(0.04)
        assert frequency_of(written, again) == pytest.approx(frequency_of(other, theirs), rel=1e-3)
        tips = []
        for each, its, tendon in ((written, again, Cable(0, "t0", 10.0)), (other, theirs, cable)):
            arc = arc_of(each, its, tendon, 10.0)
            assert arc is not None
            tips.append(bend_by_cable(each, its, tendon, arc))
        assert tips[0] is not None
        assert tips[1] is not None
        assert tips[0].angle_rad == pytest.approx(tips[1].angle_rad, rel=2e-3)


def test_twice_the_segments_takes_away_three_quarters_of_the_error() -> None:
    model, limb, rod, cables = read(RodChain(10))
    structure = read_structure(model)
    arc = arc_of(model, limb, cables[0])
    assert arc is not None
    tip = bend_by_cable(model, limb, cables[0], arc)
    assert tip is not None
    error = 100 * math.hypot(tip.along_m - arc.tip.along_m, tip.transverse_m - arc.tip.transverse_m) / 0.3
    moved = twice_the_segments_percent(model, structure.chains[0], limb, rod, cables)
    assert moved == pytest.approx(0.75 * error, rel=0.05)


def test_half_the_time_step_moves_a_damped_limb_little() -> None:
    model, limb, _, _ = read(RodChain(10))
    moved = half_step_percent(model, read_structure(model), [limb])
    assert moved is not None
    assert 0.0 < moved < 2.0


def half_step_of(actuator: str) -> float | None:
    model, limb, _, _ = read_text(re.sub("<motor [^>]*>", actuator, RodChain(10).mjcf()))
    return half_step_percent(model, read_structure(model), [limb])


def test_a_filtered_servo_that_is_told_to_hold_still_moves_nothing() -> None:
    model, *_ = read(RodChain(10))
    rest_m = model.tendon_length0[0]
    servo = f'<position tendon="cable" kp="1000" timeconst="0.05" ctrlrange="{rest_m:.12g} {rest_m + 1e-9:.12g}"/>'
    assert half_step_of(servo) == pytest.approx(0.0, abs=1e-4)


def test_a_winch_without_a_range_is_driven_too() -> None:
    unlimited, limited = (half_step_of(f'<motor tendon="cable" gear="-9" {end}/>') for end in ("", 'ctrlrange="0 1"'))
    assert unlimited == limited
    assert unlimited


def test_a_limb_that_diverges_says_nothing_about_its_time_step() -> None:
    report = check_fidelity(RodChain(10, mass_kg=0.001, damping_s=0.0).mjcf())
    assert report.half_step_percent is None
    assert "error unknown, a simulation diverged" in report.account()


def test_a_limb_that_nothing_drives_says_nothing_about_its_time_step() -> None:
    text = re.sub("<actuator>.*</actuator>", "", RodChain(6).mjcf())
    assert "error unknown, no tendon is driven" in check_fidelity(text).account()


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda text: re.sub(r'stiffness="[^"]*"', "", text), "without stiffness"),
        (lambda text: text.replace('<body name="s4"', '<body name="s4" euler="0 10 0"'), "curved at rest"),
        (lambda text: RodChain(2).mjcf(), "2 joints in series"),
        (lambda text: RodChain(125).mjcf(), "125 ways"),
        (lambda text: text.replace('axis="0 1 0"', 'axis="0 0 1"'), "about one axis across it"),
        (lambda text: text.replace('<body name="s4" pos="0 0 0.03"', '<body name="s4" pos="0 0 0.055"'), "uneven"),
    ],
)
def test_what_is_no_straight_elastic_rod_is_said(change, why: str) -> None:
    report = check_fidelity(change(RodChain(10).mjcf()))
    assert report.limbs == ()
    assert report.trust_percent is None
    assert why in report.left_out[0]
    assert why in report.account()


def test_a_twisting_limb_is_compared_but_not_cut() -> None:
    text = re.sub(
        r'(<joint name="j3" [^>]*>)', r'\1<joint name="twist" axis="0 0 1" stiffness="1"/>', RodChain(8).mjcf()
    )
    (limb,) = check_fidelity(text).limbs
    assert limb.twice_the_segments_percent is None
    assert "twist" in limb.not_cut
    assert limb.load_error_percent is not None


@pytest.fixture(scope="module")
def arm() -> FidelityReport:
    return check_fidelity(robots.arm())


def test_the_whole_check_of_an_arm(arm: FidelityReport) -> None:
    (limb,) = arm.limbs
    assert limb.name == "s0 to s11"
    assert [each.quantity for each in limb.comparisons] == [
        "tip load",
        "weight",
        "first frequency",
        *(f"cable t{number}" for number in range(4)),
    ]
    assert limb.load_error_percent is not None
    assert limb.load_error_percent < 0.5
    assert limb.cable_error_percent is not None
    assert arm.trust_percent is not None
    assert arm.trust_percent >= max(limb.load_error_percent, limb.cable_error_percent)
    assert check_fidelity(robots.arm()) == arm


def test_the_account_says_what_to_trust_and_what_was_not_modelled(arm: FidelityReport) -> None:
    text = arm.account()
    assert text.startswith("limb s0 to s11: 12 segments, 0.3 m, joints at the starts of segments\n")
    assert "verdict: under loads the tip is right to" in text
    assert "the worst of 4 cables" in text
    assert "with half of it tips move by at most" in text
    assert "cable friction" in text
    assert max(map(len, text.splitlines())) < 250


def test_limbs_of_one_build_are_looked_at_once() -> None:
    (limb,) = check_fidelity(robots.gripper()).limbs
    assert len(limb.alike) == 2
    assert "and 2 like it" in limb.account()


def test_a_free_robot_is_held_by_its_root() -> None:
    report = check_fidelity(robots.crawler())
    assert len(report.limbs[0].alike) == 3
    assert "fixed root" in report.notes[0]


def test_no_model_no_verdict() -> None:
    with pytest.raises(MjcfError):
        check_fidelity("<mujoco><worldbody><geom/></worldbody></mujoco>")
