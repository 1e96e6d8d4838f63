"""Axes of curves have a few round ticks."""

import pytest

pytest.importorskip("nicegui", reason="needs the extra web")

from aidsr.apps.web.curve import round_ticks


@pytest.mark.parametrize(
    ("most", "ticks"),
    [
        (1, (0, 0.2, 0.4, 0.6, 0.8, 1)),
        (3, (0, 1, 2, 3)),
        (4288, (0, 1000, 2000, 3000, 4000)),
        (300_000, (0, 100_000, 200_000, 300_000)),
        (0.37, (0, 0.1, 0.2, 0.3)),
        (0.011, (0, 0.005, 0.01)),
    ],
)
def test_ticks_are_round_and_three_to_six(most: float, ticks: tuple[float, ...]) -> None:
    assert round_ticks(most) == pytest.approx(ticks)


@pytest.mark.parametrize("most", [10 ** (power / 20) for power in range(-60, 140)])
def test_no_axis_has_fewer_than_three_ticks_or_more_than_six(most: float) -> None:
    assert 3 <= len(round_ticks(most)) <= 6
