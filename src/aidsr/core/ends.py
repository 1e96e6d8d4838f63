"""Results of episodes in words: stage reached, time for which the goal was held, limits exceeded, penalties."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from aidsr.core.artifacts import EpisodeResult, Evaluation, ExceededLimit


def ends_in_words(episodes: Sequence[EpisodeResult], hold_s: float) -> list[str]:
    """Return a line for each way in which episodes ended, the most frequent first, and one for each exceeded limit.

    Args:
        episodes: The episodes.
        hold_s: Time for which the goal has to hold without interruption [s].

    Returns:
        The lines; none for episodes of older results, which do not record where they ended.
    """
    alike: dict[str, list[EpisodeResult]] = {}
    for episode in episodes:
        if episode.reached:
            alike.setdefault(_words(episode), []).append(episode)
    exceeded: dict[str, list[ExceededLimit]] = {}
    for episode in episodes:
        for limit in episode.exceeded_limits:
            exceeded.setdefault(limit.limit, []).append(limit)
    lines = [f"{len(some)} of {len(episodes)}: {_stage(some, hold_s)}" for some in sorted(alike.values(), key=_fewer)]
    for some in exceeded.values():
        worst = max(some, key=lambda limit: limit.worst)
        longest = worst.model_copy(update={"time_s": max(limit.time_s for limit in some)})
        lines.append(f"a limit exceeded in {len(some)} of {len(episodes)}, worst: {longest.text}")
    return lines


def evaluation_in_words(evaluation: Evaluation) -> list[str]:
    """Return lines on how the episodes of an evaluation ended, on penalties and on the constant mean action."""
    return [
        *ends_in_words(evaluation.episodes, evaluation.hold_s),
        *_penalty_in_words(evaluation),
        *_mean_action_in_words(evaluation),
    ]


def _penalty_in_words(evaluation: Evaluation) -> list[str]:
    share = evaluation.penalized_share
    return [f"the task's penalty applied in {share:.1%} of the time of the successful episodes"] if share else []


def _mean_action_in_words(evaluation: Evaluation) -> list[str]:
    found = evaluation.mean_action
    if found is None:
        return []
    needed = " (no policy is needed)" if found.suffices else ""
    return [
        f"the constant mean action of the policy wins {found.succeeded} of {found.of} episodes that the policy "
        f"wins{needed}"
    ]


def rules_in_words(episodes: Sequence[EpisodeResult], *, time_limit_s: float, failure: str) -> str:
    """Return a line that counts episodes by the rule that ended them.

    Args:
        episodes: The episodes.
        time_limit_s: Time limit of the task [s].
        failure: Condition that ends an episode of the task as failed, as a sentence; empty if there is none.
    """
    rule = f"the task's own rule ({failure.rstrip('.')})" if failure else "the task's own rule"
    rules = {
        "succeeded": "success",
        "out_of_time": f"the time limit of {time_limit_s:g} s",
        "failed": rule,
        "diverged": "a simulation that diverged",
    }
    counts = Counter(episode.ended for episode in episodes)
    told = ", ".join(f"{count} by {rules[ended]}" for ended, count in counts.most_common())
    return f"{len(episodes)} episodes ended: {told}"


def _fewer(episodes: Sequence[EpisodeResult]) -> int:
    return -len(episodes)


def _words(episode: EpisodeResult) -> str:
    ended = {"failed": ", failed by the task's own rule", "diverged": ", then the simulation diverged"}
    return episode.reached + ended.get(episode.ended, "")


def _stage(alike: Sequence[EpisodeResult], hold_s: float) -> str:
    """Return the result of episodes that ended alike, in words, with the longest time for which the goal was held."""
    words, held_s = _words(alike[0]), max(episode.held_s for episode in alike)
    if alike[0].ended == "succeeded" or not (held_s and hold_s):
        return words
    return f"{words}; held for at most {held_s:.3g} s of {hold_s:.3g} s"
