"""A short training in a worker comes back as a verdict."""

from aidsr.artifacts import Evaluation
from aidsr.pipeline.trials import LIMITS
from aidsr.sim import isolation
from scenes import small_scene


def test_a_policy_is_trained_and_judged_in_an_isolated_process() -> None:
    subject = {"mjcf": small_scene(), "groups": [], "task": "button_pushing", "level": "standard", "goal": ""}
    learned = isolation.call("aidsr.rl.short:learn_in_worker", {**subject, "steps": 1}, LIMITS)
    evaluation = Evaluation.model_validate(learned)
    assert evaluation.task == "reaching/button_pushing"
    assert [episode.variation for episode in evaluation.episodes] == list(range(20))
    assert {"training_stable", "continuum_robot"} <= {check.name for check in evaluation.checks}
