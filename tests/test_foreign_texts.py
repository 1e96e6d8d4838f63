"""No text of others ends its reader with anything but a sentence; AIDSR_FUZZ_CASES tells how many are tried."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytest.importorskip("stable_baselines3", reason="policies need the extra rl")

import foreign_texts
from aidsr.core.errors import AidsrError

_CASES = int(os.environ.get("AIDSR_FUZZ_CASES", "12"))
NAMES = (
    "MJCF", "replies of the Designer", "replies of the Coder", "replies of the Integrator", "replies of the Judge",
    "goals", "study plans", "submissions", "replies of a provider", "decisions", "files of a run",
)  # fmt: skip


@pytest.fixture(scope="module")
def targets(tmp_path_factory: pytest.TempPathFactory) -> dict[str, foreign_texts.Target]:
    return foreign_texts.targets(tmp_path_factory.mktemp("foreign"))


@pytest.mark.parametrize("name", NAMES)
def test_a_text_is_read_or_refused_in_a_sentence(
    name: str, targets: dict[str, foreign_texts.Target], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("case")
    chosen = [
        target for each, target in targets.items() if each == name or (name == "files of a run" and each[:5] == "file ")
    ]

    @settings(
        deadline=None,
        derandomize="AIDSR_FUZZ_CASES" not in os.environ,
        database=None,
        max_examples=_CASES * (4 if len(chosen) > 1 else 1),
        suppress_health_check=list(HealthCheck),
    )
    @given(st.data())
    def check(data: st.DataObject) -> None:
        target = data.draw(st.sampled_from(chosen))
        text = data.draw(target.mutations())
        with contextlib.suppress(AidsrError):
            target.read(text, folder)

    check()


def test_every_target_reads_what_it_was_made_to_read(targets: dict[str, foreign_texts.Target], tmp_path: Path) -> None:
    for target in targets.values():
        for text in target.texts:
            target.read(text, tmp_path)
