"""A short training in a worker comes back as a verdict."""

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from aidsr.learn.rl.short_training import train_briefly
from aidsr.learn.rl.training import DEVELOPMENT
from scenes import small_scene


def test_a_policy_is_trained_and_judged_in_an_isolated_process() -> None:
    evaluation = train_briefly(small_scene(), steps=1, task="button_pushing")
    assert evaluation.task == "reaching/button_pushing"
    assert evaluation.split == "development"  # held-out variations score designs, and make none
    assert [episode.variation for episode in evaluation.episodes] == list(range(DEVELOPMENT, DEVELOPMENT + 20))
    assert {"training_stable", "continuum_robot"} <= {check.name for check in evaluation.checks}
