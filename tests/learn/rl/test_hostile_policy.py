"""A policy's folder from a stranger: nothing in it is executed, and what is wrong is one sentence."""

from __future__ import annotations

import io
import json
import os
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from aidsr.core.errors import UserError
from aidsr.learn.rl.policy import TrainedPolicy
from aidsr.learn.rl.recipe import Recipe

GOOD = {"mean": [0.0, 0.0], "var": [1.0, 1.0]} | dict.fromkeys(
    ("count", "return_mean", "return_var", "return_count", "clip", "epsilon"), 1.0
)


class _Command:
    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, ("executed",)


def _saved(value: object) -> bytes:
    file = io.BytesIO()
    torch.save(value, file)
    return file.getvalue()


def policy(folder: Path, weights: bytes, normalisation: str = json.dumps(GOOD)) -> Path:
    with zipfile.ZipFile(folder / "policy.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("policy.pth", weights)
    (folder / "normalisation.json").write_text(normalisation, "utf-8")
    return folder


@pytest.mark.parametrize(
    "weights",
    [
        pytest.param(lambda: b"", id="nothing"),
        pytest.param(lambda: b"\x00" * 100, id="zeros"),
        pytest.param(lambda: pickle.dumps(_Command()), id="a command"),
        pytest.param(lambda: _saved(_Command()), id="a command inside"),
        pytest.param(lambda: _saved(3), id="a number"),
        pytest.param(lambda: _saved({"x": torch.zeros(2)}), id="other names"),
        pytest.param(lambda: _saved({1: "x"}), id="no weights"),
        pytest.param(lambda: b"0" * (65 * 2**20), id="much in little"),
    ],
)
def test_weights_that_are_none(weights: Callable[[], bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match="the policy in"):
        TrainedPolicy.load(policy(tmp_path, weights()), Recipe(), 2)
    assert not Path("executed").exists()


@pytest.mark.parametrize(
    "normalisation",
    ["", "[]", "{}", "3", "{" * 5000]
    + [json.dumps(GOOD | change) for change in (
        {"mean": [[0.0]]}, {"mean": ["x", 1]}, {"mean": [np.nan, 0.0]}, {"count": "x"}, {"count": 1e999}, {"more": 1.0},
        {"count": 10**400}, {"mean": [10**400, 0]},
    )],
)  # fmt: skip
def test_normalisations_that_are_none(normalisation: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="policy in"):
        TrainedPolicy.load(policy(tmp_path, _saved({}), normalisation), Recipe(), 2)
