"""Published policies, evaluated from their files, do what their published verdicts say."""

import json
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from aidsr.core.artifacts import Evaluation
from aidsr.core.provenance import processor, versions_of
from aidsr.learn.episodes.policy_checks import Replays
from aidsr.learn.rl.policy import one_torch_thread
from aidsr.learn.rl.trained import FinishedTraining
from aidsr.tasks import is_current

HOME = Path(__file__).parents[3] / "benchmarks" / "builtin"
PUBLISHED = sorted(path.parent for path in (HOME / "policies").glob("*/*/evaluation.json"))


def of_today(folder: Path) -> bool:
    config = json.loads((folder / "config.json").read_text())
    return is_current(config["task"], config["benchmark_version"])


def test_policies_are_published_with_their_rows():
    rows = [json.loads(line) for path in HOME.glob("results-version*.jsonl") for line in path.read_text().splitlines()]
    known = {(row["policy_sha256"], row["scene_sha256"]) for row in rows}
    assert PUBLISHED
    for folder in PUBLISHED:
        verdict = Evaluation.model_validate_json((folder / "evaluation.json").read_bytes())
        assert (verdict.policy_sha256, verdict.scene_sha256) in known


@pytest.mark.parametrize(
    "folder",
    [
        pytest.param(
            folder,
            id=f"{folder.parent.name} {folder.name}",
            marks=pytest.mark.skipif(not of_today(folder), reason="of an earlier version of the benchmark"),
        )
        for folder in PUBLISHED
    ],
)
def test_a_published_policy_does_what_its_verdict_says(folder):
    training = FinishedTraining.load(folder)
    verdict = Evaluation.model_validate_json((folder / "evaluation.json").read_bytes())
    assert training.policy.fingerprint == verdict.policy_sha256
    assert training.scene.fingerprint == verdict.scene_sha256
    # as many rows as were evaluated, of which three are played: the last bits of a network depend on the number of rows
    variations = tuple(training.scene.task.variation("held_out", each.variation) for each in verdict.episodes)
    replays = Replays(
        training.scene, training.policy, variations, threads=1, smoothing=training.config.recipe.smoothing
    )
    with one_torch_thread():
        outcomes = replays.play(training.scene.model, only=range(3))
    for row, published in enumerate(verdict.episodes[:3]):
        again = outcomes.result(row, published.variation)
        assert again.ended == published.ended
        if verdict.processor == processor() and verdict.versions == versions_of(verdict.versions.keys() - {"python"}):
            # elsewhere the last bits differ, and with them when an episode ends
            assert again.time_s == published.time_s
            assert again.reward == pytest.approx(published.reward, abs=1e-6)
