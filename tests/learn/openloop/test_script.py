"""The notation of motion scripts: what each line means at which time, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from aidsr.core.errors import UserError
from aidsr.learn.openloop.script import GRAMMAR, parse_script
from aidsr.learn.openloop.script_policy import played_by

GROUPS = ("left: a", "robot/right", "neck")
REST = np.array([-1.0, -1.0, 0.0])


def actions(text: str, *times_s: float) -> np.ndarray:
    (block,) = played_by(parse_script(text), GROUPS, REST, 0.04).blocks
    return np.array([block.at(time_s) for time_s in times_s])


def test_waypoints_are_joined_by_straight_lines_and_held_at_both_ends() -> None:
    found = actions("neck: t=1 0.0, t=3 0.8", 0.0, 1.0, 2.0, 3.0, 9.0)
    assert found[:, 2] == pytest.approx([0.0, 0.0, 0.4, 0.8, 0.8])
    assert np.all(found[:, :2] == -1.0), "groups that are not named stay at rest"


def test_a_sine_has_its_mean_amplitude_frequency_and_phase() -> None:
    found = actions("right: mean 0.2 amplitude 0.5 hz 1.5 phase 90", 0.0, 1 / 3, 1 / 6)
    assert found[0, 1] == pytest.approx(0.7)
    assert found[1, 1] == pytest.approx(0.2 - 0.5), "half a period later"
    assert found[2, 1] == pytest.approx(0.2), "a quarter of a period later"


def test_a_sine_may_stand_on_a_number_as_the_grammar_shows_it() -> None:
    example = "-0.2, amplitude 0.5 hz 1.5 phase 90"
    assert f'"{example}"' in GRAMMAR
    assert actions(f"right: {example}", 0.0)[0, 1] == pytest.approx(0.3)


def test_a_sine_may_stand_on_waypoints_for_a_while_and_is_cut_off() -> None:
    found = actions("neck: t=0 0, t=2 1; amplitude 1 hz 0.25 from 1 until 2", 0.5, 1.0, 1.5, 2.0)
    assert found[:, 2] == pytest.approx([0.25, 1.0, 1.0, 1.0])


def test_one_number_is_held_and_a_star_is_for_all_others() -> None:
    found = actions("left: a: 0.5\n# a comment\n*: -0.25  # the others", 4.0)
    assert found[0] == pytest.approx([0.5, -0.25, -0.25])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the script is empty"),
        ("neck t=0 1", "line 1 of the script has no group"),
        ("neck: __import__('os')", "cannot read"),
        ("neck: mean 0.2 speed 3", 'unknown word "speed"'),
        ("neck: t=2 0, t=1 1", "times of waypoints must rise"),
        ("neck: t=0 0 mean 1", "both waypoints and a mean"),
        ("neck: amplitude 1", "a sine needs both amplitude and hz"),
        ("neck: 1\nneck: 0", "has a line already"),
        ("neck: hz 1 hz 2 amplitude 1", "given twice"),
        ("neck: 1e9", "not finite or too large"),
        ("neck: " + "1" * 20_000, "characters"),
    ],
)
def test_what_is_no_script_is_refused_with_its_line(text: str, message: str) -> None:
    with pytest.raises(UserError, match=message):
        parse_script(text)


def test_an_unknown_group_is_refused_with_those_that_exist() -> None:
    with pytest.raises(UserError, match=r'no group "nek" in this scene\. Did you mean "neck"'):
        actions("nek: 1", 0.0)
