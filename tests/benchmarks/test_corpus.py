"""The corpus builder: what it writes loads, what it breaks is broken as it says, and seeds decide everything."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from benchmarks.validator.corpus.faults import DOCUMENT, INJECTIONS, Injection, UnsuitableError
from benchmarks.validator.corpus.making import grade_of, make_mistake
from benchmarks.validator.corpus.physique import Physique
from benchmarks.validator.corpus.specimen import Specimen
from benchmarks.validator.corpus.writers import ALL_WRITERS, TUNING_WRITERS, Writer
from benchmarks.validator.corpus.writers.hinges import HingeArms
from benchmarks.validator.corpus.writers.loops import write_loop
from benchmarks.validator.oracle import BUILDING_SEVERITIES, SEVERITIES, severity_of

from aidsr.validation import validate

ARM = HingeArms(
    Physique(length_m=0.3, segments=6, mass_kg=0.1, radius_m=0.02, sag=0.8, damping_ratio=0.3, bend_rad=1.5)
)
BASES = [ARM.document()] + [ALL_WRITERS[name](np.random.default_rng(1)).mjcf for name in ("balls", "ground", "loops")]
STILL = {
    "no_tendons", "no_actuators", "no_sensors", "tendons_not_actuated", "no_soft_chain", "disconnected", "segments_gap",
    "fully_actuated", "ctrlrange_missing", "range_inverted_ignored", "joint_range_too_small", "tendon_limit_violated",
    "tendon_one_body", "tendon_no_moment", "implausible_density", "same_cables", "cables_end_early", "cable_cancels",
    "site_misplaced", "hinges_parallel", "length_unit", "mass_unit", "odd_gravity", "keyframe_out_of_range",
}  # fmt: skip
"""Codes whose symptom is measured without simulating."""


@pytest.mark.parametrize("name", ALL_WRITERS)
def test_a_writer_writes_robots_with_tendons_that_load_and_repeats_itself(name: str) -> None:
    writer: Writer = ALL_WRITERS[name]
    written = writer(np.random.default_rng(8))
    model = mujoco.MjModel.from_xml_string(written.mjcf)
    assert min(model.ntendon, model.nu, model.nsensor) > 0
    assert written == writer(np.random.default_rng(8))


def test_some_writers_are_kept_for_the_end() -> None:
    assert set(ALL_WRITERS) - set(TUNING_WRITERS) == {"hands", "frames"}


@pytest.mark.filterwarnings("ignore:Inertia matrix is too close to singular")  # of two hinges about one axis
@pytest.mark.parametrize("injection", [i for i in INJECTIONS if i.code in STILL], ids=lambda i: i.code)
def test_what_is_broken_by_construction_is_measured_so_by_the_oracle(injection: Injection) -> None:
    suitable = 0
    for mjcf in BASES:
        rng = np.random.default_rng(2)
        try:
            changed, words = injection.change(mjcf, rng, injection.draw_size("bad", rng))
        except UnsuitableError:
            continue
        suitable += grade_of(severity_of(injection.code, changed)) == "bad"
        assert words
        assert changed != mjcf
    assert suitable


def test_a_sag_is_bad_when_half_the_weight_is_too_much_and_none_when_twice_is_not() -> None:
    limb = Physique(length_m=0.3, segments=6, mass_kg=0.1, radius_m=0.02, sag=1.0, damping_ratio=0.3, bend_rad=1.5)
    assert grade_of(severity_of("gravity_collapse", HingeArms(limb, pose="lying").document())) == "near miss"
    soft = Physique(length_m=0.3, segments=6, mass_kg=0.1, radius_m=0.02, sag=60, damping_ratio=0.3, bend_rad=1.5)
    assert grade_of(severity_of("gravity_collapse", HingeArms(soft, pose="lying").document())) == "bad"


def test_every_code_that_is_injected_has_an_oracle() -> None:
    assert {injection.code for injection in INJECTIONS} <= set(SEVERITIES | BUILDING_SEVERITIES)


def test_mistakes_are_refused_by_mujoco() -> None:
    base = Specimen("arm", "tuning", "arm", "hinges", ARM.document())
    refused = {DOCUMENT[number].code for number in range(len(DOCUMENT)) if make_mistake(number, 1, "tuning", [base])[0]}
    assert refused >= {"xml_syntax", "forbidden", "bad_value", "duplicate_name", "undefined_reference", "zero_mass"}
    made, put_aside = make_mistake(0, 1, "tuning", [base])
    assert made == make_mistake(0, 1, "tuning", [base])[0]
    assert put_aside == {}
    with pytest.raises(ValueError, match="XML"):
        mujoco.MjSpec.from_string(made[0].mjcf)


@pytest.mark.parametrize("index", [0, 13])
def test_a_ring_may_touch_at_its_seam_and_roll_on_late(index: int) -> None:
    """Where a chain is closed by a constraint, links meet as at the stop of a joint; one way down is no swing."""
    report = validate(write_loop(np.random.default_rng([1000, 1172857409, index, 0])).mjcf)
    assert not report.errors
