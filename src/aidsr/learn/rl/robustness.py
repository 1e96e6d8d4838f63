"""Robustness of a policy: success that remains where the scene differs from its model, as a real robot does."""

from __future__ import annotations

from aidsr.core.artifacts import Evaluation, PerturbationKind, PerturbedEpisodes
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.perturbation import CABLE_FRICTIONS, DELAY_S, KINDS, TOLERANCE, perturbed
from aidsr.learn.episodes.rollout import Policy, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.structure import read_structure

_OFF = f"off by up to {TOLERANCE:.0%}"
SUMMARIES: dict[PerturbationKind, str] = {
    "stiffness": f"stiffness of joints {_OFF}",
    "damping": f"damping of joints {_OFF}",
    "friction": f"friction of contacts {_OFF}",
    "mass": f"masses of the robot {_OFF}",
    "cable_force": f"force of each cable {_OFF}",
    "delay": f"actions {1000 * DELAY_S:g} ms late",
    "low_cable_friction": f"cable friction {CABLE_FRICTIONS[0]:g}",
    "high_cable_friction": f"cable friction {CABLE_FRICTIONS[1]:g}",
    "combined": f"all parameters, delay, cable friction {CABLE_FRICTIONS[0]:g}",
}
"""Description of each perturbation."""


def perturbed_episodes(
    scene: TaskScene, policy: Policy, evaluation: Evaluation, *, threads: int = 0, smoothing: float = 0.0
) -> tuple[PerturbedEpisodes, ...]:
    """Play the variations of an evaluation again, with each kind of perturbation.

    Args:
        scene: Scene of the evaluation.
        policy: Policy of the evaluation.
        evaluation: Evaluation without perturbations; it lists the variations.
        threads: Native threads; 0 takes all processors.
        smoothing: Smoothing of actions with which the policy was trained.
    """
    structure, split = read_structure(scene.model), evaluation.split
    indices = [episode.variation for episode in evaluation.episodes]
    won = sum(episode.ended == "succeeded" for episode in evaluation.episodes)
    results = []
    for kind in KINDS:
        variations = [perturbed(scene.task, structure, kind, split, index) for index in indices]
        episodes = Episodes(scene.model, scene.task, scene.actions, variations, threads=threads, smoothing=smoothing)
        outcomes = rollout(episodes, policy)
        results.append(
            PerturbedEpisodes(
                kind=kind,
                summary=SUMMARIES[kind],
                episodes=len(indices),
                succeeded=tuple(
                    index for index, success in zip(indices, outcomes.success.tolist(), strict=True) if success
                ),
                diverged=int(outcomes.diverged.sum()),
                nominal_successes=won,
            )
        )
    return tuple(results)
