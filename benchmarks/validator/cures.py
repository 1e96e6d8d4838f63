"""Do cures cure? Apply them to the example robot of every rule, as fixes by code and as edits by the cure's words.

python -m benchmarks.validator.cures
python -m benchmarks.validator.cures --split 'held out'

Each example is the faultless arm with one mistake. A split's mistakes are the bad robots of the corpus, compared with
the good robots from which they were made. A cure has cured if the code is gone, no other error has appeared, and the
mistake is no longer in the compiled model. "Passes with the mistake inside": the mistake is still there, but the
validator reports nothing.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import mujoco
import numpy as np
from benchmarks.validator.corpus.keeping import load_or_make
from benchmarks.validator.corpus.plans import PLANS
from benchmarks.validator.corpus.specimen import Split
from benchmarks.validator.report import WARNED

from aidsr.core.artifacts import Fault, ValidationReport
from aidsr.fixes import FIXES, fix
from aidsr.validation import validate
from aidsr.validation.fixing import fix_until_stable
from aidsr.validation.registry import builtin_rules
from aidsr.validation.rules_page import EXAMPLE_ARM

_HERE = Path(__file__).parent
_ROUNDS = 4
"""Largest number of times that fixes are applied while the fault remains: milder fixes come first."""
_FORCE = ("actuator_gear", "actuator_gainprm", "actuator_biasprm", "actuator_ctrlrange", "actuator_forcerange")
"""Numbers that determine the force of an actuator together: a longer range is as good a cure as a larger gear."""
Outcome = Literal["cured", "not helped", "another error", "passes with the mistake inside"]
OUTCOMES: tuple[Outcome, ...] = ("cured", "not helped", "another error", "passes with the mistake inside")

EXAMPLES = "examples"
"""Name of the set of the rules' examples; the other sets are the splits of the corpus."""
Row = dict[str, str]

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
    "actuator_speed": (('ctrlrange="0 150"', 'ctrlrange="0 20"'),),
    "tendon_pushes": (('ctrlrange="-20 20"', 'ctrlrange="0 20"'),),
    "numerical_instability": (
        ('integrator="Euler"', 'integrator="implicitfast"'),
        ('timestep="0.01"', 'timestep="0.002"'),
        ('damping="0"', 'damping="0.02"'),
    ),
    "actuator_sign": (('gear="1"', 'gear="-1"'),),
    "zero_gear": (('gear="0"', 'gear="-1"'),),
    "limit_overrun": (('range="-6 6"', 'range="-6 6" solreflimit="0.004 1"'),),
    "driven_overlap": (('solref="0.06 1"', 'solref="0.004 1"'),),
    "passive_collapse": ((' springref="25"', ""),),
    "tendon_limit_violated": ((' range="0 0.1"', ""),),
}
"""By rule, the cure as edits (old, new) of the rule's example, which follow the cure's words literally. Rules whose
cure is a matter of design ("Make the rigid part smaller") are missing, unless their words fit only one edit."""


@dataclass(frozen=True)
class Mistake:
    """A robot with one mistake.

    Attributes:
        code: Code of the fault.
        good: MJCF of the robot without the mistake.
        bad: MJCF of the robot with the mistake.
        arguments: Arguments for the validation.
    """

    code: str
    good: str
    bad: str
    arguments: Mapping[str, Any]

    def faults(self, mjcf: str) -> list[Fault]:
        """Return the faults of this code in a version of the robot."""
        report = validate(mjcf, **self.arguments)
        return [fault for fault in report.faults if fault.code == self.code]


def examples() -> list[Mistake]:
    """Return the example of every rule that has one."""
    rules = [(rule.code, rule.example) for rule in builtin_rules() if rule.example]
    return [Mistake(code, EXAMPLE_ARM, each.fails(EXAMPLE_ARM), each.arguments) for code, each in rules]


def of_corpus(split: Split, kept: Path, processes: int) -> list[Mistake]:
    """Return the bad robots of a split, each with the good robot that it was made from."""
    specimens = load_or_make(split, kept, processes, lambda _: None).specimens
    good = {specimen.name: specimen.mjcf for specimen in specimens if specimen.grade == "good"}
    return [
        Mistake(each.code, good[each.name.partition(" of ")[2]], each.mjcf, each.arguments)
        for each in specimens
        if each.grade == "bad"
    ]


def judge(mistake: Mistake, cured: str) -> tuple[Outcome, str]:
    """Return the outcome of a cure, and the codes of the errors that are left."""
    before, after = (validate(text, **mistake.arguments) for text in (mistake.bad, cured))
    new = _errors(after) - _errors(before)
    still = mistake.code in {fault.code for fault in (after.faults if mistake.code in WARNED else after.errors)}
    left = ", ".join(sorted(_errors(after)))
    if new:
        return "another error", left
    if not is_inside(mistake, cured):
        return ("not helped" if still else "cured"), left
    return ("not helped" if still or left else "passes with the mistake inside"), left


def _errors(report: ValidationReport) -> set[str]:
    return {fault.code for fault in report.errors}


def is_inside(mistake: Mistake, cured: str) -> bool:
    """Return whether the mistake is still in the model: all numbers that it changed are as in the bad robot."""
    models = [_compiled(text) for text in (mistake.good, mistake.bad, cured)]
    good, bad, now = models
    if bad is None or now is None or good is None:
        return False
    changed = False
    for name in dir(bad):
        arrays = [np.asarray(getattr(model, name, None)) for model in models if model is not None]
        if name.startswith("_") or arrays[1].dtype.kind not in "fi" or name == "qpos0":
            continue
        if _alike(arrays[0], arrays[1]):
            continue
        changed = True
        together = _FORCE if name in _FORCE else (name,)
        if not all(_alike(np.asarray(getattr(bad, each)), np.asarray(getattr(now, each))) for each in together):
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


def by_fix(mistake: Mistake) -> str | None:
    """Return the robot after the fixes of its fault; None if no fix applies."""
    if not any(mistake.code in each.cures for each in FIXES):
        return None
    text, changed = mistake.bad, False
    for _ in range(_ROUNDS):
        mine = mistake.faults(text)
        answer = fix(text, mine)
        if not mine or not answer.notes:
            break
        text, changed = answer.mjcf, True
    return text if changed else None


def until_stable(mistake: Mistake) -> str | None:
    """Return the robot after `aidsr.fix_until_stable`; None if its own fault has no fix."""
    if not any(mistake.code in each.cures for each in FIXES):
        return None
    return fix_until_stable(mistake.bad, also=mistake.code, **mistake.arguments).mjcf


def by_words(mistake: Mistake) -> str | None:
    """Return the example of a rule, edited as the cure's words say; None if `WORDS` has no edit for the rule.

    Raises:
        ValueError: The text that is to be edited is not in the example.
    """
    if mistake.code not in WORDS:
        return None
    text = mistake.bad
    for old, new in WORDS[mistake.code]:
        if old not in text:
            raise ValueError(f"{mistake.code}: not in its example: {old!r}")
        text = text.replace(old, new)
    return text


def try_cures(mistakes: Iterable[Mistake], ways: Mapping[str, Callable[[Mistake], str | None]]) -> Iterator[Row]:
    """Yield a row with the outcome of every cure of every mistake."""
    for mistake in mistakes:
        for kind, way in ways.items():
            if (cured := way(mistake)) is not None:
                outcome, left = judge(mistake, cured)
                yield {"code": mistake.code, "cure": kind, "outcome": outcome, "errors_left": left}


def markdown(rows: Sequence[Row]) -> str:
    """Return the page as Markdown."""
    lines = [
        "# Do cures cure",
        "",
        "*fix*: `aidsr fix` with the fault, up to four rounds. *words*: the sentence of the cure, as an edit of the",
        "text. Cured: the code is gone, no other error came, and the mistake is out of the compiled model. *Another",
        "error*: a harm, or a fault that the first one hid.",
    ]
    for name in (EXAMPLES, *PLANS):
        if mine := [row for row in rows if row["robots"] == name]:
            lines += ["", *(_of_examples(mine) if name == EXAMPLES else _of_split(name, mine))]
    return "\n".join(lines) + "\n"


def _of_examples(rows: Sequence[Row]) -> list[str]:
    codes = {rule.code for rule in builtin_rules() if rule.example} - {row["code"] for row in rows}
    return [
        "## The examples of the rules",
        "",
        "Made by `python -m benchmarks.validator.cures`: the arm without a fault with one mistake. Fixes were looked",
        "at with these robots, so this is the least that can be asked of a cure, and not how often it helps.",
        "",
        *_counts("cure", {kind: [row for row in rows if row["cure"] == kind] for kind in ("fix", "words")}),
        "",
        f"Without a cure that code or one edit could apply: {', '.join(sorted(codes))}.",
        "",
        "| rule | cure | outcome | errors left |",
        "|---|---|---|---|",
        *(f"| `{row['code']}` | {row['cure']} | {row['outcome']} | {row['errors_left']} |" for row in rows),
    ]


def _of_split(split: str, rows: Sequence[Row]) -> list[str]:
    alone = [row for row in rows if row["cure"] == "fix"]
    by_code: dict[str, list[Row]] = {
        "its own fault alone": alone,
        "until stable": [row for row in rows if row["cure"] == "until stable"],
    }
    for row in alone:
        by_code.setdefault(f"`{row['code']}` alone", []).append(row)
    left = Counter(
        (row["cure"], row["code"], row["outcome"], row["errors_left"]) for row in rows if row["outcome"] != "cured"
    )
    return [
        f"## Robots of the corpus, {split}",
        "",
        f"Made by `python -m benchmarks.validator.cures --split '{split}'`: the bad robots with a fault that a fix by",
        "code can be tried on. *Alone*: `aidsr.fix` is given that fault, as above. *Until stable*:",
        "`aidsr.fix_until_stable`, which keeps the best version, and none with an error that the robot did not have.",
        "",
        *_counts("fixed", by_code),
        *(["", "| fixed | not cured | outcome | errors left | robots |", "|---|---|---|---|---|"] if left else []),
        *(
            f"| {'alone' if cure == 'fix' else cure} | `{code}` | {outcome} | {errors} | {count} |"
            for (cure, code, outcome, errors), count in sorted(left.items())
        ),
    ]


def _counts(title: str, groups: Mapping[str, Sequence[Row]]) -> list[str]:
    lines = [f"| {title} | " + " | ".join(OUTCOMES) + " |", "|---|" + "---|" * len(OUTCOMES)]
    for name, rows in groups.items():
        counts = Counter(row["outcome"] for row in rows)
        lines.append(f"| {name} | " + " | ".join(str(counts[outcome]) for outcome in OUTCOMES) + " |")
    return lines


def main(arguments: Sequence[str] | None = None) -> None:
    """Try every cure and write `cures.md` and `cures.jsonl`. Results of the other sets of robots are kept."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--split", choices=list(PLANS), help="bad robots of the corpus instead of the examples")
    parser.add_argument("--processes", type=int, default=2, help="that make the corpus and try cures")
    parser.add_argument("--kept", type=Path, default=Path("build/validator"), help="where made corpora are kept")
    parser.add_argument("--out", type=Path, default=_HERE, help="folder of cures.md and cures.jsonl")
    options = parser.parse_args(arguments)
    mujoco.set_mju_user_warning(lambda _message: None)
    if options.split:
        mistakes, ways = (
            of_corpus(options.split, options.kept, options.processes),
            {"fix": by_fix, "until stable": until_stable},
        )
    else:
        mistakes, ways = examples(), {"fix": by_fix, "words": by_words}
    with ThreadPoolExecutor(options.processes) as pool:
        tried = pool.map(lambda mistake: list(try_cures([mistake], ways)), mistakes)
        fresh = [{"robots": options.split or EXAMPLES, **row} for rows in tried for row in rows]
    kept = options.out / "cures.jsonl"
    known = [json.loads(line) for line in kept.read_text("utf-8").splitlines()] if kept.exists() else []
    rows = fresh + [row for row in known if row["robots"] != fresh[0]["robots"]]
    (options.out / "cures.md").write_text(markdown(rows), "utf-8")
    kept.write_text("".join(json.dumps(row) + "\n" for row in rows), "utf-8")


if __name__ == "__main__":
    main()
