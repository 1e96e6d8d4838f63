"""Whole runs with a language model that is a server on this machine, and everything else real."""

import json
from pathlib import Path

import pytest

import aidsr
from aidsr.core.calls import CallRecord
from aidsr.loop.run import resume
from aidsr.runs import read_status
from loopback import Act, Fail, Loopback, Received, Say

CANARY = "canary-0123456789abcdef"
CONCEPT = {
    "name": "Bending rod",
    "family": "arm",
    "morphology": "A chain of segments.",
    "actuation": "Three tendons.",
    "functional_part": "tip",
}


def arm(*, tendons: bool = True) -> str:
    """A hanging chain of 8 segments, with three tendons or with motors at no tendon at all."""
    segments, closing = "", ""
    for index in range(8):
        sites = "".join(
            f'<site name="t{tendon}_{index}" pos="{x} {y} 0.02"/>'
            for tendon, (x, y) in enumerate([(0.008, 0), (-0.004, 0.007), (-0.004, -0.007)])
        )
        joints = "".join(
            f'<joint name="j{axis}{index}" type="hinge" axis="{vector}" range="-30 30" stiffness="0.6" damping="0.02"/>'
            for axis, vector in (("x", "1 0 0"), ("y", "0 1 0"))
        )
        segments += (
            f'<body name="s{index}" pos="0 0 {0.04 if index else 0.01}">{joints}{sites}'
            '<geom type="capsule" fromto="0 0 0.005 0 0 0.035" size="0.006" mass="0.01"/>'
        )
        closing += "</body>"
    base = "".join(
        f'<site name="t{tendon}_base" pos="{x} {y} 0.005"/>'
        for tendon, (x, y) in enumerate([(0.008, 0), (-0.004, 0.007), (-0.004, -0.007)])
    )
    spatial = "".join(
        f'<spatial name="t{tendon}">'
        + "".join(f'<site site="t{tendon}_{place}"/>' for place in ("base", *range(8)))
        + "</spatial>"
        for tendon in range(3)
    )
    motors = "".join(f'<motor name="m{i}" tendon="t{i}" gear="-1" ctrlrange="0 12"/>' for i in range(3))
    sensors = "".join(f'<tendonpos name="l{i}" tendon="t{i}"/>' for i in range(3))
    if not tendons:
        spatial, motors, sensors = "", '<motor name="m0" joint="jx0" ctrlrange="-1 1"/>', '<jointpos joint="jx0"/>'
    tip = '<site name="tip" pos="0 0 0.04"/>'
    return (
        '<mujoco model="rod"><option timestep="0.002" integrator="implicitfast"/><worldbody><body name="base">'
        f'<geom type="cylinder" size="0.015 0.005" mass="0.05"/>{base}{segments}{tip}{closing}</body></worldbody>'
        f"<tendon>{spatial}</tendon><actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"
    )


class Provider:
    """Answers each role by its system prompt: a first robot without tendons, then a good one."""

    def __init__(self, working_for: int) -> None:
        self.working_for = working_for
        self.robots = 0

    def __call__(self, received: Received) -> Act:
        if self.working_for <= 0:
            return Fail(401, f"the key {CANARY} is not known")
        self.working_for -= 1
        role = received.body["messages"][0]["content"].split("\n", 1)[0].lower()
        if "designer" in role:
            return Say(json.dumps({"interpretation": "Reach sideways.", "concepts": [CONCEPT]}), cost_usd=None)
        if "coder" in role:
            self.robots += 1
            return Say(f'{{"functional_part": "tip"}}\n```xml\n{arm(tendons=self.robots > 1)}\n```')
        if "integrator" in role:
            return Say('{"mount": "mount", "base": "fixed", "reason": "It hangs."}')
        return Say('{"passed": true, "summary": "It can reach."}')


@pytest.mark.parametrize("answered_first", [1, 4])
def test_a_refused_key_stops_the_run_and_resuming_asks_only_what_is_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, answered_first: int
) -> None:
    monkeypatch.setenv("AIDSR_API_KEY", CANARY)
    provider = Provider(working_for=answered_first)
    with Loopback(provider) as server:
        run = aidsr.design(
            task="button_pushing",
            model=f"loop@{server.url}/v1",
            concepts=1,
            iterations=1,
            max_output_tokens=5_000,
            runs=tmp_path,
        )
        stopped = read_status(run)
        assert stopped.state == "stopped"
        assert stopped.usage.calls == answered_first
        provider.working_for = 100
        run = resume(run.path)
    status = read_status(run)
    assert status.designs[0].outcome.outcome == "approved", status.designs[0].outcome.reason
    assert status.designs[0].iteration == 2
    assert status.usage.calls == 5
    assert status.usage.cost_usd is None
    assert len(server.requests) == 5 + 1, "five questions, one of them refused once"
    assert {request.body["max_tokens"] for request in server.requests} == {5_000}
    assert "no_tendons" in run.design(1).iteration(1).robot_report.path.read_text()
    assert [file.name for file in sorted(run.design(1).path.rglob("calls/*"))] == [
        "0001_coder.json",
        "0001_coder.json",
        "0002_integrator.json",
        "0003_judge.json",
    ]
    call = CallRecord.model_validate_json((run.path / "calls" / "0001_designer.json").read_text())
    assert call.usage.input_tokens == 100
    for path in run.path.rglob("*"):
        assert path.is_dir() or CANARY.encode() not in path.read_bytes(), path
