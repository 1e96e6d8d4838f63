"""`aidsr validate --fidelity` adds how far the simulation can be trusted."""

import json
from pathlib import Path

import pytest

from aidsr.apps.cli import main


def robot() -> str:
    inner = ""
    for number in reversed(range(6)):
        inner = (
            f'<body name="s{number}" pos="0 0 {0.01 if number == 0 else 0.02}">'
            f'<joint name="j{number}" axis="0 1 0" stiffness="0.5" damping="0.02"/>'
            f'<geom type="capsule" size="0.005" fromto="0 0 0 0 0 {0.01 if number == 5 else 0.02}"/>{inner}</body>'
        )
    return (
        f'<mujoco><option integrator="implicitfast"/><worldbody><body name="base">{inner}</body></worldbody></mujoco>'
    )


def run(*words: str) -> None:
    with pytest.raises(SystemExit):
        main(list(words))


def test_the_account_goes_on_with_fidelity(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "robot.xml"
    path.write_text(robot())
    run("validate", str(path))
    without = capsys.readouterr().out
    run("validate", str(path), "--fidelity")
    text = capsys.readouterr().out
    assert text.startswith(without.rstrip())
    assert "limb s0 to s5: 6 segments, 0.12 m, joints in the middles of segments" in text
    assert "verdict: under loads the tip is right to" in text


def test_json_gains_a_key(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "robot.xml"
    path.write_text(robot())
    run("validate", str(path), "--fidelity", "--json")
    answer = json.loads(capsys.readouterr().out)
    assert answer["fidelity"]["limbs"][0]["segments"] == 6
    assert "stable" in answer


def test_a_text_that_is_no_model_has_faults_and_no_fidelity(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "robot.xml"
    path.write_text("<mujoco><worldbody><geom/></worldbody></mujoco>")
    run("validate", str(path), "--fidelity")
    assert "verdict" not in capsys.readouterr().out
