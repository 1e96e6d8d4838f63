"""Submissions that somebody made to hang, to fill or to mark up the leaderboard."""

from __future__ import annotations

import hashlib
import json
import time
from pathlib import Path
from typing import Any

import pytest

from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.studies.leaderboard import leaderboard
from aidsr.studies.outcomes import DesignRow
from aidsr.studies.study import Arm, StudyPlan
from aidsr.studies.submission import Submission, with_hash
from aidsr.studies.tables import task_lines

MARKUP = "a|b<script>alert(1)</script>[x](javascript:y)\n| c"


def submission(tasks: tuple[str, ...], model: str = "builtin") -> Submission:
    plan = StudyPlan(
        tasks=tasks,
        arms=(Arm(name="rules", config=RunConfig(concepts=1, model=model)),),
        runs=1,
        seeds=0,
        protocol="best",
        probe=False,
    )
    designs = tuple(DesignRow(arm="rules", task=task, run=1, design=1, outcome="invalid") for task in tasks)
    lines = {"rules": task_lines(designs, "rules")}
    return with_hash(Submission(plan=plan, designs=designs, scenes_sha256={}, lines=lines))


def written(path: Path, content: dict[str, Any]) -> Path:
    path.write_text(json.dumps(content))
    return path


def test_a_hundred_thousand_tasks_are_refused_at_once(tmp_path: Path) -> None:
    content = submission(("gap",)).model_dump(mode="json")
    content["plan"]["tasks"] = [f"task{i}" for i in range(100_000)]
    content["designs"] = [{**content["designs"][0], "task": f"task{i}"} for i in range(100_000)]
    began_s = time.process_time()
    with pytest.raises(UserError, match=r'"plan.tasks": expected .*at most 1000 items') as refused:
        leaderboard([written(tmp_path / "many.json", content)])
    assert len(str(refused.value)) < 500
    assert time.process_time() - began_s < 10  # hours, when each task was counted among all


def test_one_without_its_hash_is_refused_in_a_sentence(tmp_path: Path) -> None:
    content = submission(("gap",)).model_dump(mode="json")
    del content["sha256"]
    with pytest.raises(UserError, match="its hash does not match; write it again with aidsr submit"):
        leaderboard([written(tmp_path / "bare.json", content)])


def test_a_plan_that_asks_for_billions_of_designs_is_refused_at_the_first_that_is_missing(tmp_path: Path) -> None:
    content = submission(("gap",)).model_dump(mode="json")
    arm = content["plan"]["arms"][0]
    content["plan"]["arms"] = [arm, *({**arm, "name": f"arm{i}"} for i in range(999))]
    content["plan"]["tasks"] = [f"task{i}" for i in range(1000)]
    content["plan"]["runs"] = 1000
    path = written(tmp_path / "large.json", content)
    whole = with_hash(Submission.model_validate_json(path.read_text()))
    path.write_text(whole.model_dump_json())
    with pytest.raises(UserError, match="its designs do not match its plan"):
        leaderboard([path])


def test_as_many_tasks_as_are_allowed_are_merged_in_time(tmp_path: Path) -> None:
    path = tmp_path / "most.json"
    path.write_text(submission(tuple(f"made/task{i}" for i in range(1000))).model_dump_json())
    began_s = time.process_time()
    assert "1000 tasks" in leaderboard([path])
    assert time.process_time() - began_s < 20


@pytest.mark.parametrize("name", ["..", "../../etc", "a/../b", "<script>", "a|b", "a\nb", "$x^{$", ""])
def test_a_task_whose_name_is_no_name_of_a_folder_is_refused(tmp_path: Path, name: str) -> None:
    content = submission(("gap",)).model_dump(mode="json")
    content["plan"]["tasks"] = [name]
    with pytest.raises(UserError, match=r'"plan.tasks\[1\]": expected string should match pattern'):
        leaderboard([written(tmp_path / "name.json", content)])


def test_markup_in_the_name_of_a_model_or_of_a_file_stays_text(tmp_path: Path) -> None:
    path = tmp_path / "a|<b>.json"
    path.write_text(submission(("gap",), model=MARKUP).model_dump_json())
    table = leaderboard([path])
    rows = [line for line in table.splitlines() if "script" in line]
    assert len(rows) == 1
    assert rows[0].replace(r"\|", "").count("|") == 10
    assert "<" not in table.replace(r"\<", "")
    assert "](" not in table.replace(r"\](", "")


@pytest.mark.parametrize("field", ["input_tokens", "output_tokens", "calls", "cost_usd", "latency_s"])
@pytest.mark.parametrize("number", [10**400, -1, float("nan"), float("inf")])
def test_numbers_past_all_bounds_are_one_sentence(tmp_path: Path, field: str, number: float) -> None:
    content = submission(("gap",)).model_dump(mode="json")
    content["designs"][0]["usage"][field] = number
    del content["sha256"]
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"))
    path = written(tmp_path / "numbers.json", {**content, "sha256": hashlib.sha256(canonical.encode()).hexdigest()})
    with pytest.raises(UserError):
        leaderboard([path])
