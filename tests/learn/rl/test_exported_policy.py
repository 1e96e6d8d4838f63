"""A trained policy acts in the scene once more, with the robot as it would be built."""

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")
pytest.importorskip("manifold3d", reason="needs the extra fabrication")

from test_training import SMALL

import aidsr
from aidsr.core.errors import UserError
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl import isolated_learning
from aidsr.learn.rl.trained import evaluate_training
from aidsr.learn.rl.training import train
from aidsr.loop import export as exporting
from aidsr.loop.export import export


def test_a_policy_is_tried_with_the_robot_as_built(tmp_path, monkeypatch):
    design = aidsr.design(task="dynamic_catching", concepts=1, seed=1, runs=tmp_path).design(1)
    with monkeypatch.context() as unable:
        unable.setattr(exporting, "validate", None)  # nothing is worked out before
        with pytest.raises(UserError, match="train the design first"):
            export(design.path, policy=True)
    scene = TaskScene.of(design.final_scene.path, "dynamic_catching")
    recipe = SMALL.model_copy(update={"smoothing": 0.7})
    train(scene, design.path / "training" / "001", steps=64, recipe=recipe, threads=1)
    designed = evaluate_training(design.path / "training" / "001", episodes=20, threads=1, videos=False)
    run_policy, asked = isolated_learning.run_policy, []

    def noted(folder, robot, environment, placement, episodes):
        asked.append((folder, episodes))
        return run_policy(folder, robot, environment, placement, episodes)

    monkeypatch.setattr(isolated_learning, "run_policy", noted)
    retest = export(design.path, policy=True).verdict.retest
    assert asked == [(design.path / "training" / "001", 20)]
    assert retest.designed_success_share == designed.success_share
    assert 0.0 <= retest.success_share <= 1.0
