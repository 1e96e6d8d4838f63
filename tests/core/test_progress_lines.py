"""The web app reads from a log what the command line wrote into it."""

import pytest

from aidsr.core.formatting import format_time_left
from aidsr.core.progress_lines import ProgressLine, evaluation_line, probe_line, read_progress


@pytest.mark.parametrize(("left_s", "told_s"), [(30.1, 30.1), (90.0, 90.0), (3725.0, 3720.0)])
def test_progress_is_read_as_it_was_written(left_s: float, told_s: float) -> None:
    left = format_time_left(left_s, 1.0)
    evaluation = read_progress(f"evaluating 100 episodes …\n{evaluation_line(12, 100, 11, f'{left}, then checks')}\n")
    assert evaluation == ProgressLine("12 of 100 episodes ended, 11 succeeded", 0.12, pytest.approx(told_s))
    probe = read_progress(probe_line(32, 128, 1, 2, 0.5, left))
    assert probe == ProgressLine("32 of 128 motions tried, 1 of 2 variations solved, progress 0.50", 0.25, told_s)


def test_a_line_without_time_left_and_a_log_without_progress() -> None:
    ended = read_progress(evaluation_line(100, 100, 70, "checking plausibility"))
    assert ended == ProgressLine("100 of 100 episodes ended, 70 succeeded; checking plausibility", 1.0, None)
    for log in (
        "",
        "\n",
        "seed 0: 1000 steps, 50/s, success 25%, about 3 min 0 s left",
        f"{evaluation_line(1, 2, 1, '–')}\nover",
    ):
        assert read_progress(log) is None
