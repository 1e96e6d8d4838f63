"""Names of the numbers that a task's features consist of, as motion scripts call them: f1, f2 and so on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from aidsr.tasks.task import Feature


def numbers_of(features: Sequence[Feature]) -> Iterator[tuple[str, Feature]]:
    """Yield each feature with the names of its numbers, which count from 1 over all features: "f1-f3", "f4"."""
    first = 1
    for feature in features:
        last = first + feature.size - 1
        yield (f"f{first}" if feature.size == 1 else f"f{first}-f{last}"), feature
        first = last + 1


def features_in_words(features: Sequence[Feature]) -> str:
    """Return the features with the names and the unit of their numbers: "f1-f3 base to ball [m]; f4 time"."""
    return "; ".join(
        f"{names} {feature.name}" + (f" [{feature.unit}]" if feature.unit else "")
        for names, feature in numbers_of(features)
    )
