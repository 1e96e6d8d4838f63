"""Random gaits of bodies whose motion is known."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.tools.carts import cart, only, play_once

from aidsr.core.errors import UserError
from aidsr.learn.openloop.script import parse_script
from aidsr.tools.gaits import random_gaits


def test_a_body_that_cannot_turn_drifts_by_nothing(tmp_path: Path) -> None:
    found = random_gaits(only(cart(tmp_path, 9.0), "along"), gaits=4, seconds=1.0)
    assert found.figure("heading drift, largest") == pytest.approx(0.0, abs=1e-6)
    assert found.figure("mean velocity y") == pytest.approx(0.0, abs=1e-6)


def test_a_body_that_only_turns_drifts_and_does_not_travel(tmp_path: Path) -> None:
    found = random_gaits(only(cart(tmp_path, 9.0), "about"), gaits=4, seconds=1.0)
    assert found.figure("heading drift, largest") > 5.0
    assert found.figure("mean velocity x") == pytest.approx(0.0, abs=1e-3)


def test_the_best_gait_can_be_played_again(tmp_path: Path) -> None:
    scene = cart(tmp_path, 9.0)
    found = random_gaits(scene, gaits=6, seconds=2.0)
    script = found.text.partition("as a script:\n")[2]
    assert set(parse_script(script).blocks[0].tracks) == {"drive", "turn"}
    again = play_once(scene, script, seconds=2.0)
    gained = again.moments[-1].progress - again.moments[0].progress
    assert gained == pytest.approx(found.figure("progress gained, best"), abs=0.01)


def test_what_is_touched_first_is_counted(tmp_path: Path) -> None:
    near = cart(tmp_path, 9.0).mjcf.replace('pos="0.51 0 0.2"', 'pos="0.11 0 0.2"')
    found = random_gaits(cart(tmp_path, 9.0).model_copy(update={"mjcf": near}), gaits=8, seconds=2.0)
    assert "wall by cart" in found.text


def test_the_seed_decides(tmp_path: Path) -> None:
    scene = cart(tmp_path, 9.0)
    first, again, other = (random_gaits(scene, gaits=2, seconds=1.0, seed=seed).figures for seed in (0, 0, 1))
    assert first == again
    assert first != other


def test_numbers_out_of_range_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="gaits must be 1 to 64"):
        random_gaits(cart(tmp_path), gaits=0)
