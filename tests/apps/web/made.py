"""Run folders as the pages meet them, written by hand: nothing is simulated."""

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

from aidsr.core.artifacts import (
    Brief,
    Concept,
    Critique,
    CritiqueIssue,
    EnvironmentSummary,
    EpisodeResult,
    Evaluation,
    Fault,
    Outcome,
    Placement,
    PlausibilityCheck,
    Robot,
    Scene,
    ValidationReport,
)
from aidsr.core.calls import CallRecord, Message, Question, Usage
from aidsr.core.config import RunConfig
from aidsr.fabrication.schema import Change, PartEntry, Retest, Verdict
from aidsr.runs import DesignFolder, EventLog, Run, RunRecord, new_run
from aidsr.runs.events import Finished, Started, StepDone, Waiting
from aidsr.runs.files import JsonFile, replace_file

SCRIPT = "<script>window.stolen = 1</script><img src=x onerror='window.stolen = 1'>"
"""What a hostile text would like the page to run."""

MJCF = f"""<mujoco model="made">
  <!-- {SCRIPT.replace("--", "")} -->
  <worldbody>
    <body name="robot/base"><geom size="0.01"/><body name="robot/tip"><geom size="0.01"/></body></body>
  </worldbody>
</mujoco>
"""
SUMMARY = EnvironmentSummary(
    gravity_m_s2=(0, 0, -9.81), timestep_s=0.002, mounts=(), bodies=(), sites=(), sensors=(), actuators=()
)


def png() -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(b"\0\x80\x90\xa0"))
        + chunk(b"IEND", b"")
    )


def concept(name: str) -> Concept:
    return Concept(
        name=name,
        interpretation="reach",
        morphology="a tapering arm",
        actuation="three tendons",
        functional_part="tip",
        family="tentacle",
        parameters={"length_m": 0.3},
    )


def made_run(
    folder: Path, *, name: str = "Arm", task: str = "reaching/button_pushing", designs: int = 3, waiting: bool = False,
    objective: str = "Press the button.", model: str = "builtin", started: str = "2026-01-31T10:00:00+00:00",
) -> Run:  # fmt: skip
    """Return a run whose designs went through a failed first attempt and a good second one."""
    config = RunConfig(model=model, concepts=designs, human=waiting)
    record = RunRecord(
        objective=objective, task=task, level="standard" if task else "", config=config, started=started, versions={}
    )
    run = new_run(folder, record, Brief(objective=objective, task=task, environment="<mujoco/>", summary=SUMMARY))
    with EventLog(run.events) as log:
        log.write(Started())
        log.write(StepDone(step="concepts", summary=f"{designs} concepts"))
    run.concepts.write(tuple(concept(f"{name} {number}") for number in range(1, designs + 1)))
    for number in range(1, designs + 1):
        _made_design(run.design(number), f"{name} {number}", waiting=waiting and number == 1)
    return run


def _made_design(design: DesignFolder, name: str, *, waiting: bool) -> None:
    first, second = design.iteration(1), design.iteration(2)
    fault = Fault(
        code="chatter", layer="simulate", severity="error", names=("tip",), measured=9.0, limit=1.0, unit="mm",
        message=f"the tip shakes {SCRIPT}", likely_cause="too soft", cure="stiffen it", line=4,
    )  # fmt: skip
    with EventLog(design.events) as log:
        log.write(Started())
        first.concept.write(concept(name))
        first.robot.write(Robot(mjcf=MJCF.replace("0.01", "0.02"), functional_part="tip"))
        first.robot_report.write(ValidationReport(stable=False, faults=(fault,)))
        log.write(StepDone(step="robot_report", iteration=1, summary="1 fault: chatter"))
        second.robot.write(Robot(mjcf=MJCF, functional_part="tip"))
        second.robot_report.write(ValidationReport(stable=True, measurements={"actuators": 3, "moving_mass_kg": 0.06}))
        placement = Placement(mount="mount", base="fixed")
        second.placement.write(placement)
        second.scene.write(Scene(mjcf=MJCF, placement=placement))
        second.scene_report.write(ValidationReport(stable=True, measurements={"actuators": 3, "moving_mass_kg": 0.06}))
        second.preview.write(png())
        second.critique.write(Critique(passed=True, summary=f"It reaches. {SCRIPT}"))
        log.write(StepDone(step="critique", iteration=2, summary="passed"))
        question = Question(role="coder", messages=(Message(role="user", text=f"Write it. {SCRIPT}"),))
        call = CallRecord(
            question=question, model="made:up", reply=f"Here it is. {SCRIPT}", finish="stop",
            usage=Usage(calls=1, input_tokens=1000, output_tokens=500, cost_usd=0.25, latency_s=3.0),
            started="2026-01-31T10:00:05+00:00",
        )  # fmt: skip
        JsonFile(second.path / "calls" / "0001_coder.json", CallRecord).write(call)
        if waiting:
            log.write(Waiting(iteration=2))
            return
        design.final_scene.write(MJCF.encode())
        design.final_robot.write(MJCF.encode())
        outcome = Outcome(outcome="approved", reason="The Judge passed it.", iteration=2)
        design.outcome.write(outcome)
        log.write(Finished(outcome=outcome))


def made_export(design: DesignFolder, *, verdict: str = "buildable with changes") -> Path:
    """Write an export with one part, a tetrahedron, and a sheet that would like to run a script."""
    folder = design.path / "export"
    (folder / "parts").mkdir(parents=True)
    corners = ((0, 0, 0), (20, 0, 0), (0, 20, 0), (0, 0, 20))
    faces = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
    records = [struct.pack("<12fH", 0, 0, 0, *(x for corner in face for x in corners[corner]), 0) for face in faces]
    stl = bytes(80) + struct.pack("<I", len(records)) + b"".join(records)
    (folder / "parts" / "tip_x2.stl").write_bytes(stl)
    part = PartEntry(
        file="tip_x2", title="tip", what="robot", copies=2, used_for=("tip", "other"), material="tpu95a",
        infill=0.5, mass_g=12.3, simulated_g=12.0, size_mm=(20, 20, 20), support_cm3=0, thinnest_wall_mm=1.2,
        watertight=True, fits_bed=False,
    )  # fmt: skip
    (folder / "parts.json").write_text(f"[{part.model_dump_json()}]")
    (folder / "sheet.html").write_text(f"<h1>How to build it</h1>{SCRIPT}")
    wide = Fault(
        code="part_exceeds_bed", layer="realizability", severity="error", names=("tip_x2",), measured=268.0,
        limit=250.0, unit="mm", message=f"does not fit the bed {SCRIPT}",
    )  # fmt: skip
    told = Verdict.model_validate(
        {
            "verdict": verdict, "reasons": [wide] if verdict == "not buildable" else [],
            "changes": [Change(what="foot", simulated="held by the world", built=f"a flange {SCRIPT}")],
            "printer": "fdm", "material": "tpu95a", "simulated_g": 24.0, "built_g": 24.6, "moving_simulated_g": 24.0,
            "moving_built_g": 24.6, "winches_g": 280.0, "cost_usd": 108.25, "unpriced": [],
            "retest": Retest(stable=True, reach_m=0.108, designed_reach_m=0.11, faults=()),
        }
    )  # fmt: skip
    (folder / "verdict.json").write_text(told.model_dump_json())
    return folder


def blamed() -> Critique:
    return Critique(passed=False, issues=(CritiqueIssue(blame="coder", component="tip", problem=SCRIPT),))


def made_training(
    design: DesignFolder, won: Sequence[bool] = (False,), checks: tuple[PlausibilityCheck, ...] = ()
) -> Path:
    """Write the first judged training of a design, and return its folder; `won` says so of each held-out episode."""
    episodes = [
        EpisodeResult(
            variation=i, ended="succeeded" if each else "failed", progress=0.9, best_progress=1, reward=5, time_s=2
        )
        for i, each in enumerate(won)
    ]
    verdict = Evaluation(
        task="reaching/button_pushing", level="standard", benchmark_version=2, episodes=tuple(episodes), checks=checks
    )
    folder = design.path / "training" / "001"
    replace_file(folder / "config.json", b'{"steps": 4000, "seed": 7}')
    replace_file(folder / "evaluation.json", verdict.model_dump_json().encode())
    return folder
