"""Robots of other people: import and validate each one, and compare the verdict with a judgement.

python -m benchmarks.validator.others FOLDER

FOLDER holds checkouts as owner/name. None of the robots is part of this project; the page names their origin.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aidsr.core.artifacts import ValidationReport
from aidsr.core.errors import MjcfError, UserError
from aidsr.core.provenance import commit
from aidsr.mjcf.importing import import_mjcf
from aidsr.validation import validate
from aidsr.validation.validator import Mount

_HERE = Path(__file__).parent


@dataclass(frozen=True)
class Source:
    """A repository, the tried commit, and the licence."""

    repository: str
    commit: str
    licence: str


@dataclass(frozen=True)
class Other:
    """One robot of other people.

    Attributes:
        source: Repository of the robot.
        path: Path of its document in the repository.
        sound: Whether its physics is sound, as judged by reading the document; None for a document that is refused.
        why: Reason of the judgement.
        folder: Folder of the repository that holds the files named by the document; "" for the document's own folder.
        mount: Mount that its authors use, if the document does not state it.
    """

    source: Source
    path: str
    sound: bool | None
    why: str = ""
    folder: str = ""
    mount: Mount = "auto"

    @property
    def name(self) -> str:
        """Name of the document."""
        return Path(self.path).stem


DM_CONTROL = Source("google-deepmind/dm_control", "985d09401ea8824cec489e56cd631b24d9e32891", "Apache-2.0")
MUJOCO = Source("google-deepmind/mujoco", "a7255075b003506ff5f34b512d88e02df12a73c6", "Apache-2.0")
GYMNASIUM = Source("Farama-Foundation/Gymnasium", "3f0476a8cc224dcce2167cc4b6971ae0f04d5cfc", "MIT")
ROBOTICS = Source("Farama-Foundation/Gymnasium-Robotics", "df28ecdb8e0bfd0c52754f79a305520025306225", "MIT")
MYO_SIM = Source("MyoHub/myo_sim", "2cef885481677742e4d19adb934b1b7be438cf6a", "Apache-2.0")
ADROIT = Source("vikashplus/Adroit", "c98c9c92fc9729e92a10c8db79588348897d8fe3", "Apache-2.0")
CYPHI = Source("CyPhiLab/tendon_clf", "2016806206068085cbd0f87012791fea8c25428a", "MIT")
SPIRAL = Source(
    "IbrahimXXs/Soft-Spiral-Continuum-Robot-Manipulator-", "e47786274449a1035287578ea616c1938eff87dd", "MIT"
)

_SUITE, _GYM = "dm_control/suite", "gymnasium/envs/mujoco/assets"
_HANDS = "gymnasium_robotics/envs/assets"
_OLD_CAMERA = "written for another MuJoCo: a camera attribute that 3.17 does not know"

OTHERS: tuple[Other, ...] = (
    *(
        Other(DM_CONTROL, f"{_SUITE}/{name}.xml", True, why)
        for name, why in {
            "quadruped": "stands on springy legs",
            "humanoid": "drawn above the floor; topples, since nothing holds it",
            "humanoid_CMU": "topples likewise",
            "fish": "swims without gravity",
            "swimmer": "a template of the head; the suite adds links",
            "walker": "planar; topples",
            "cheetah": "planar, sprung",
            "hopper": "planar",
            "finger": "with a spinner",
            "manipulator": "its light fingertips swing into their stops and come back",
            "reacher": "spins",
            "acrobot": "swings: that is its task",
            "ball_in_cup": "the ball hangs on a string",
            "stacker": "with boxes to stack",
        }.items()
    ),
    Other(
        DM_CONTROL,
        f"{_SUITE}/dog.xml",
        False,
        "38 joints; topples; a toe rattles at its 5 ms, is still at 2.5 ms",
    ),
    Other(
        DM_CONTROL, "dm_control/third_party/ant/ant.xml", True, "its free joint is added by the composer", mount="free"
    ),
    Other(
        DM_CONTROL,
        "dm_control/third_party/kinova/jaco_arm.xml",
        False,
        "drawn 47 and 19 degrees outside the ranges of two joints, where its links stand in each other",
    ),
    Other(DM_CONTROL, "dm_control/third_party/kinova/jaco_hand.xml", True, "starts outside its range by 0.15 rad"),
    Other(DM_CONTROL, "dm_control/locomotion/walkers/assets/rodent.xml", True, "tendons along the spine"),
    Other(
        DM_CONTROL, "dm_control/locomotion/walkers/assets/jumping_ball/jumping_ball_with_head.xml", True, "rolls, jumps"
    ),
    *(
        Other(GYMNASIUM, f"{_GYM}/{name}.xml", True, why)
        for name, why in {
            "ant": "",
            "humanoid": "topples and lies on its arms",
            "half_cheetah": "",
            "hopper": "",
            "walker2d_v5": "its feet swing into their stops",
            "swimmer": "",
            "pusher_v5": "one of seven joints is slow",
            "reacher": "spins at tens of rad/s",
            "inverted_double_pendulum": "swings: that is its task",
        }.items()
    ),
    Other(ROBOTICS, f"{_HANDS}/adroit_hand/adroit_pen.xml", True, "the Adroit hand with a pen", folder=_HANDS),
    Other(
        ROBOTICS, f"{_HANDS}/hand/reach.xml", True, "the Shadow hand; a few small parts are too dense", folder=_HANDS
    ),
    Other(ROBOTICS, f"{_HANDS}/fetch/pick_and_place.xml", True, "the Fetch arm; heavy fingertips", folder=_HANDS),
    Other(MUJOCO, "model/humanoid/humanoid.xml", True, "topples"),
    Other(MUJOCO, "model/car/car.xml", True, "drives by friction; its wheels only spin"),
    Other(MUJOCO, "model/tendon_arm/arm26.xml", True, "an arm of six muscles"),
    Other(MUJOCO, "model/slider_crank/slider_crank.xml", True, "one degree of freedom in a loop"),
    Other(MYO_SIM, "finger/myofinger_v0.xml", False, "all muscles at once: rattles at 2 ms, is still at 0.5 ms", ".."),
    Other(MYO_SIM, "finger/finger_v0.xml", True, "no actuators", ".."),
    Other(MYO_SIM, "finger/motorfinger_v0.xml", True, "", ".."),
    Other(MYO_SIM, "hand/myohand.xml", True, "39 muscles; one has hardly a lever, one leaves its pulley", ".."),
    Other(
        MYO_SIM,
        "arm/myoarm.xml",
        False,
        "63 muscles; the upper arm's shape is drawn 20.6 mm inside the chest's, which pushes it with 1,030 N",
        "..",
    ),
    Other(
        MYO_SIM,
        "leg/myolegs.xml",
        True,
        "80 muscles; a keyframe has two joints of the left knee with the other sign, which the knee puts right",
        "..",
    ),
    Other(MYO_SIM, "elbow/myoelbow_2dof6muscles.xml", None, "asks for 500 s of simulation while it is compiled", ".."),
    Other(ADROIT, "Adroit_hand.xml", None, "written for MuJoCo 2: an option that 3.17 does not know", ".."),
    Other(CYPHI, "mujoco_models/helix/helix_control.xml", True, "no control ranges", "mujoco_models"),
    Other(CYPHI, "mujoco_models/spirob/spirob_wrapping.xml", True, "no control ranges", "mujoco_models"),
    Other(CYPHI, "mujoco_models/tendon/tendon_control.xml", None, _OLD_CAMERA, "mujoco_models"),
    Other(SPIRAL, "Long_Manipulator.xml", True, "28 segments, two cables"),
)


def try_robot(other: Other, checkouts: Path) -> dict[str, Any]:
    """Import and validate one robot, and return the row."""
    here = checkouts / other.source.repository
    row: dict[str, Any] = {
        "repository": other.source.repository,
        "commit": other.source.commit,
        "licence": other.source.licence,
        "path": other.path,
        "judged_sound": other.sound,
        "why": other.why,
        "validated_by": commit(),
    }
    try:
        imported = import_mjcf(here / other.path, (here / other.folder) if other.folder else None)
    except (MjcfError, UserError) as error:
        return {**row, "sound": None, "refused": str(error).partition("\n")[0]}
    report = validate(imported.mjcf, mount=other.mount)
    return {**row, "sound": report.sound, "files": len(imported.files), **_faults(report)}


def _faults(report: ValidationReport) -> dict[str, list[str]]:
    physics = [fault for fault in report.faults if fault.layer not in ("scope", "realizability")]
    return {
        "errors": sorted({fault.code for fault in physics if fault.severity == "error"}),
        "warnings": sorted({fault.code for fault in physics if fault.severity == "warning"}),
        "scope": sorted({fault.code for fault in report.faults if fault.layer == "scope"}),
    }


def markdown(rows: Sequence[dict[str, Any]]) -> str:
    """Return the page as Markdown."""
    judged = [row for row in rows if row["judged_sound"] is not None and row["sound"] is not None]
    false_alarms = [row for row in judged if row["judged_sound"] and not row["sound"]]
    lines = [
        "# Robots of other people",
        "",
        "Made by `python -m benchmarks.validator.others FOLDER`, where FOLDER holds checkouts of the repositories as",
        "`owner/name`. Each document went through `aidsr import` and `aidsr validate`; none is part of this project.",
        "*Judged* is what reading the document and its tests led to, no measurement. It was written after an earlier",
        "version of the validator had been tried on these robots and its false alarms on them had been mended: this is",
        "no test on robots that nobody had looked at. The judgements of dog and myoarm were changed to",
        "unsound after the validator had called them so: dog is still at half its time step, and the contact forces of",
        "myoarm were read.",
        f"Validated by {', '.join(sorted({row['validated_by'][:7] for row in rows}))}; a row that is there is kept.",
        "",
        f"{len(rows)} documents of {len({row['repository'] for row in rows})} repositories: {len(judged)} were "
        f"validated, {len(rows) - len(judged)} refused while they were read. Called unsound and judged sound: "
        f"{len(false_alarms)}. Called sound and judged unsound: "
        f"{sum(row['sound'] and not row['judged_sound'] for row in judged)}.",
        "",
        "| robot | verdict | errors | warnings | out of scope by | judged | what was seen |",
        "|---|---|---|---|---|---|---|",
    ]
    repository = ""
    for row in rows:
        if row["repository"] != repository:
            repository = row["repository"]
            lines.append(f"| **{repository}** at {row['commit'][:10]}, {row['licence']} | | | | | | |")
        if row["sound"] is None:
            lines.append(f"| {Path(row['path']).stem} | refused | {row['refused']} | | | | {row['why']} |")
            continue
        cells = (", ".join(row[kind]) for kind in ("errors", "warnings", "scope"))
        verdicts = ["sound" if row[key] else "unsound" for key in ("sound", "judged_sound")]
        lines.append(
            f"| {Path(row['path']).stem} | {verdicts[0]} | {' | '.join(cells)} | {verdicts[1]} | {row['why']} |"
        )
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Try the robots that are not in `others.jsonl` yet, and write `others.jsonl` and `others.md`."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkouts", type=Path, help="folder with checkouts as owner/name")
    parser.add_argument("--out", type=Path, default=_HERE, help="folder of others.md and others.jsonl")
    options = parser.parse_args(arguments)
    kept = options.out / "others.jsonl"
    rows = {row["path"]: row for row in map(json.loads, kept.read_text("utf-8").splitlines())} if kept.exists() else {}
    with ThreadPoolExecutor(2) as pool, kept.open("a", encoding="utf-8") as file:
        missing = [other for other in OTHERS if other.path not in rows]
        for row in pool.map(lambda other: try_robot(other, options.checkouts), missing):
            rows[row["path"]] = row
            file.write(json.dumps(row) + "\n")
            file.flush()
            write_page(rows, options.out)


def write_page(rows: dict[str, dict[str, Any]], folder: Path) -> None:
    """Write `others.md` from the rows so far, which are given by path."""
    missing = [other.name for other in OTHERS if other.path not in rows]
    text = markdown([rows[other.path] for other in OTHERS if other.path in rows])
    (folder / "others.md").write_text(text + (f"\nNot tried yet: {', '.join(missing)}.\n" if missing else ""), "utf-8")


if __name__ == "__main__":
    main()
