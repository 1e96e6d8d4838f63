"""Do cures cure: apply them to the example robot of every rule, as fixes by code and as their words say.

python -m benchmarks.validator.cures

Each example is the arm without a fault with one mistake. A cure has cured when the code is gone, no other error came,
and the mistake is no longer in the compiled model; one that leaves it there and silences the rule passes it.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np

from aidsr.core.artifacts import ValidationReport
from aidsr.fixes import FIXES, fix
from aidsr.validation import validate
from aidsr.validation.registry import builtin_rules
from aidsr.validation.rule import Rule
from aidsr.validation.rules_page import EXAMPLE_ARM

_HERE = Path(__file__).parent
_ROUNDS = 4
"""A fix is applied again while its fault is there: the milder ones come first."""
_WARNED = ("tendon_skips_segments", "tendon_slack", "thin_wall", "cable_shared", "overlap_hidden", "only_opens")
Outcome = Literal["cured", "not helped", "another error", "passes with the mistake inside"]
OUTCOMES: tuple[Outcome, ...] = ("cured", "not helped", "another error", "passes with the mistake inside")

WORDS: dict[str, tuple[tuple[str, str], ...]] = {
    "unknown_element": (('<hinge name="j3"/>', '<joint name="j3"/>'),),
    "bad_value": (('mass="light"', 'mass="0.01"'),),
    "invalid_joint_placement": (('<freejoint name="j3"/>', ""),),
    "keyframe_size": (('<key qpos="0 0 0 0 0 0 0"/>', '<key qpos="0 0 0 0 0 0"/>'),),
    "missing_asset": (('type="mesh" mesh="shell"', 'type="cylinder"'),),
    "load_error": (('timestep="0.0000001"', 'timestep="0.001"'),),
    "keyframe_out_of_range": (('qpos="20 20 20 20 20 20"', 'qpos="0.35 0.35 0.35 0.35 0.35 0.35"'),),
    "length_unit": (
        ('pos="0 0 25"', 'pos="0 0 0.025"'),
        ('size="11 12" pos="0 0 12.5"', 'size="0.011 0.012" pos="0 0 0.0125"'),
        ('9 0 12.5"', '0.009 0 0.0125"'),
    ),
    "mass_unit": (('mass="10"', 'density="1100"'), ('mass="50"', 'density="1100"')),
    "odd_gravity": (('gravity="0 0 -9810"', 'gravity="0 0 -9.81"'),),
    "hinges_parallel": (('<joint name="j3b"/>', '<joint name="j3b" axis="1 0 0"/>'),),
    "disconnected": (('    <body name="lost" pos="0 0 0.3">\n      <geom/>\n    </body>\n', ""),),
    "thruster": (('<motor name="jet" site="tip" gear="1 0 0 0 0 0" ctrlrange="0 1"/>', ""),),
    "motorized_joint": (('<motor name="turn" joint="j1" ctrlrange="-0.2 0.2"/>', ""),),
    "adhesion": (('<adhesion name="pad" body="s6" gain="5" ctrlrange="0 1"/>', ""),),
    "outside_force": ((' gravcomp="1"', ""),),
    "held_from_outside": (('<connect body1="s6" anchor="0 0 0.025"/>', ""),),
    "joint_locked": (('<joint joint1="j3"/>', ""),),
    "contact_margin": ((' margin="0.02"', ""),),
    "ghost_shape": ((' contype="0" conaffinity="0"', ""),),
    "contact_excluded": (('<exclude body1="world" body2="s6"/>', ""),),
    "loaded_spring": ((' springlength="0.1"', ""),),
    "same_cables": (
        *((f'<site name="back{k}" pos="0.009 0', f'<site name="back{k}" pos="-0.009 0') for k in range(7)),
    ),
    "cables_end_early": tuple(
        (f'<site site="{side}3"/>\n', "".join(f'<site site="{side}{k}"/>\n' for k in range(3, 7)))
        for side in ("front", "back")
    ),
    "cable_cancels": (
        *((f'<site name="front{k}" pos="-0.009', f'<site name="front{k}" pos="0.009') for k in (2, 3, 6)),
        *((f'<site name="back{k}" pos="0.009', f'<site name="back{k}" pos="-0.009') for k in (2, 3, 6)),
    ),
    "site_misplaced": (('<site name="front3" pos="-0.009 0', '<site name="front3" pos="0.009 0'),),
    "cable_shared": (('name="pull_back" tendon="front"', 'name="pull_back" tendon="back"'),),
    "pulley_left": (
        ('<geom geom="pulley"/>', '<geom geom="pulley" sidesite="side"/>'),
        ('<geom name="pulley"', '<site name="side" pos="0.004 0 0"/>\n            <geom name="pulley"'),
    ),
    "tendon_no_moment": (('pos="0 0.009 ', 'pos="0.009 0 '),),
    "no_grip": (('friction="0.01"', 'friction="1 0.005 0.0001" condim="3"'),),
    "overdamped": (('damping="20"', 'damping="0.05"'),),
    "armature_large": (('armature="1000"', 'armature="1e-5"'),),
    "filter_slow": (('dynprm="30"', 'dynprm="0.1"'),),
    "wedged": (('pos="0.0615 0 0.08"', 'pos="0.5 0 0.08"'), ('pos="-0.0615 0 0.08"', 'pos="-0.5 0 0.08"')),
    "tendon_skips_segments": (('<site site="front2"/>\n', '<site site="front2"/>\n      <site site="front3"/>\n'),),
    "tendon_through_body": (
        (
            '<site site="front1"/>\n',
            "".join(f'<site site="front{k}"/>\n' for k in range(1, 5)),
        ),
    ),
    "implausible_density": (('mass="0.01"/>', 'density="1200"/>'),),
    "thin_wall": (('size="0.008 0.008 0.0002"', 'size="0.008 0.008 0.002"'),),
    "tendon_slack": (('ctrlrange="0.12 0.2"', 'ctrlrange="0.12 0.15"'),),
    "actuator_speed": (
        (
            'gear="-1" ctrlrange="0 150"',
            'gear="-1" ctrlrange="0 150" dyntype="filterexact" dynprm="0.05"',
        ),
        ("<motor ", "<general "),
    ),
    "tendon_pushes": (('ctrlrange="-20 20"', 'ctrlrange="0 20"'),),
    "numerical_instability": (('damping="0"', 'damping="10"'),),
    "actuator_sign": (('gear="1"', 'gear="-1"'),),
    "zero_gear": (('gear="0"', 'gear="-1"'),),
    "limit_overrun": (('range="-6 6"', 'range="-6 6" solreflimit="0.004 1"'),),
    "passive_collapse": ((' springref="25"', ""),),
    "tendon_limit_violated": ((' range="0 0.1"', ""),),
}
"""Of a rule, its cure as an edit of its example: what the words of the cure say, literally. Rules whose cure is a
matter of design ("Make the rigid part smaller") are not here unless their words fit only one edit."""


def judge(rule: Rule, cured: str) -> tuple[Outcome, str]:
    """Return what came of a cure, and the errors that are left."""
    assert rule.example is not None
    fails = rule.example.fails(EXAMPLE_ARM)
    before, after = (validate(text, **rule.example.arguments) for text in (fails, cured))
    new = _errors(after) - _errors(before)
    still = rule.code in {fault.code for fault in (after.faults if rule.code in _WARNED else after.errors)}
    left = ", ".join(sorted(_errors(after)))
    if new:
        return "another error", left
    if still:
        return "not helped", left
    return ("passes with the mistake inside" if is_inside(fails, cured) else "cured"), left


def _errors(report: ValidationReport) -> set[str]:
    return {fault.code for fault in report.errors}


def is_inside(fails: str, cured: str) -> bool:
    """Whether every number that the mistake changed is still as the mistake has it."""
    models = [_compiled(text) for text in (EXAMPLE_ARM, fails, cured)]
    good, bad, now = models
    if bad is None or now is None or good is None:
        return False
    changed = False
    for name in dir(bad):
        arrays = [np.asarray(getattr(model, name, None)) for model in models if model is not None]
        if name.startswith("_") or arrays[1].dtype.kind not in "fi" or name in ("qpos0", "qpos_spring"):
            continue
        if _alike(arrays[0], arrays[1]):
            continue
        changed = True
        if not _alike(arrays[1], arrays[2]):
            return False
    for name in ("timestep", "viscosity", "integrator"):
        if getattr(good.opt, name) != getattr(bad.opt, name):
            changed = True
            if getattr(bad.opt, name) != getattr(now.opt, name):
                return False
    return changed


def _alike(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and bool(np.allclose(one, other, rtol=1e-6, atol=1e-12, equal_nan=True))


def _compiled(text: str) -> mujoco.MjModel | None:
    try:
        return mujoco.MjModel.from_xml_string(text)
    except ValueError:
        return None


def by_fix(rule: Rule) -> str | None:
    """Return the example as the fixes of its faults leave it; None where none applies."""
    assert rule.example is not None
    if not any(rule.code in each.cures for each in FIXES):
        return None
    text, changed = rule.example.fails(EXAMPLE_ARM), False
    for _ in range(_ROUNDS):
        report = validate(text, **rule.example.arguments)
        mine = [fault for fault in report.faults if fault.code == rule.code]
        answer = fix(text, mine)
        if not mine or not answer.notes:
            break
        text, changed = answer.mjcf, True
    return text if changed else None


def by_words(rule: Rule) -> str | None:
    """Return the example with the cure's words as an edit.

    Raises:
        ValueError: What is to be edited is not in the example.
    """
    assert rule.example is not None
    if rule.code not in WORDS:
        return None
    text = rule.example.fails(EXAMPLE_ARM)
    for old, new in WORDS[rule.code]:
        if old not in text:
            raise ValueError(f"{rule.code}: not in its example: {old!r}")
        text = text.replace(old, new)
    return text


def try_cures() -> Iterator[dict[str, str]]:
    """Yield what came of every cure of every rule that has an example, as plain values."""
    for rule in builtin_rules():
        if rule.example is None:
            continue
        for kind, cured in (("fix", by_fix(rule)), ("words", by_words(rule))):
            if cured is None:
                continue
            outcome, left = judge(rule, cured)
            yield {"code": rule.code, "cure": kind, "outcome": outcome, "errors_left": left}


def markdown(rows: Sequence[dict[str, str]]) -> str:
    """Return the page."""
    lines = [
        "# Do cures cure",
        "",
        "Made by `python -m benchmarks.validator.cures`. Every robot is the example of its rule: the arm without a",
        "fault with one mistake. *fix*: `aidsr fix` with that fault, up to four rounds. *words*: the sentence of the",
        "cure, as an edit of the example. Cured: the code is gone, no other error came, and the mistake is out of the",
        "compiled model. *Another error*: a harm, or a fault that the first one hid. The examples were made with the",
        "rules, so this is the least that can be asked of a cure, and not how often it helps.",
        "",
        "| | " + " | ".join(OUTCOMES) + " |",
        "|---|" + "---|" * len(OUTCOMES),
    ]
    for kind in ("fix", "words"):
        counts = Counter(row["outcome"] for row in rows if row["cure"] == kind)
        lines.append(f"| {kind} | " + " | ".join(str(counts[outcome]) for outcome in OUTCOMES) + " |")
    codes = {rule.code for rule in builtin_rules() if rule.example} - {row["code"] for row in rows}
    lines += ["", f"Without a cure that code or one edit could apply: {', '.join(sorted(codes))}.", ""]
    lines += ["| rule | cure | outcome | errors left |", "|---|---|---|---|"]
    lines += [f"| `{row['code']}` | {row['cure']} | {row['outcome']} | {row['errors_left']} |" for row in rows]
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Try every cure and write `cures.md` and `cures.jsonl`."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--out", type=Path, default=_HERE, help="folder of cures.md and cures.jsonl")
    options = parser.parse_args(arguments)
    rows = list(try_cures())
    (options.out / "cures.md").write_text(markdown(rows), "utf-8")
    (options.out / "cures.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows), "utf-8")


if __name__ == "__main__":
    main()
