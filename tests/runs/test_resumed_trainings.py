"""A training that was killed while learning and resumed says so wherever its verdict is shown."""

from __future__ import annotations

import json
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from aidsr.apps.cli.training import print_evaluation
from aidsr.core.artifacts import EpisodeResult, Evaluation
from aidsr.runs.trainings import Training, verdict_in_words
from aidsr.studies.outcomes import DesignRow
from aidsr.studies.report import raw_csv, resumed_in_words

EPISODE = EpisodeResult(variation=0, ended="succeeded", progress=1.0, best_progress=1.0, reward=0.0, time_s=1.0)


@pytest.mark.parametrize(("count", "said"), [(0, False), (1, True), (3, True)])
def test_its_verdict_says_so(tmp_path: Path, count: int, said: bool) -> None:
    verdict = Evaluation(task="x", level="standard", benchmark_version=4, episodes=(EPISODE,), checks=())
    (tmp_path / "evaluation.json").write_text(verdict.model_dump_json())
    (tmp_path / "training.json").write_text(json.dumps({"steps": 1, "resumed": count}))
    training = Training(tmp_path)
    assert training.resumed == count
    assert ("resumed during training" in verdict_in_words(training)) is said
    console = Console(file=StringIO(), width=300)
    print_evaluation(console, tmp_path, verdict)
    assert ("(resumed during training)" in console.file.getvalue()) is said
    (tmp_path / "evaluation.json").unlink()
    assert ("not judged; resumed during training" in verdict_in_words(training)) is said


@pytest.mark.parametrize("content", [{}, {"resumed": "often"}])
def test_results_that_do_not_tell_count_as_undisturbed(tmp_path: Path, content: dict[str, object]) -> None:
    assert Training(tmp_path).resumed == 0
    (tmp_path / "training.json").write_text(json.dumps(content))
    assert Training(tmp_path).resumed == 0


def test_the_rows_and_the_report_of_a_study_say_so() -> None:
    row = DesignRow(arm="a", task="t", run=1, design=1, seeds=2, resumed=2)
    header, line = raw_csv([row]).splitlines()
    assert dict(zip(header.split(","), line.split(","), strict=True))["resumed"] == "2"
    assert "2 policies resumed after an interruption" in resumed_in_words([row])
    assert resumed_in_words([row.model_copy(update={"resumed": 0})]) == ""
