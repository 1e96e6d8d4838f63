"""Settings of a run: one field each, from which the command line, the web app and `design` derive theirs."""

import json

import pytest
from pydantic import BaseModel

from aidsr.apps.cli import app
from aidsr.apps.cli.options import options_for
from aidsr.core.config import Budget, RunConfig, bounds, checked_config, run_settings
from aidsr.core.errors import UserError

WRITTEN_BEFORE = """{
  "model": "builtin", "method": "full", "concepts": 3, "iterations": 8, "max_output_tokens": 20000, "seed": 1,
  "repairs": true, "early_stop": true, "search_robots": 32, "judge_pictures": false, "task_feedback": false,
  "task_rounds": 2, "task_training": 0, "budget": {"tokens": null, "cost_usd": 1.5, "tokens_per_design": null,
  "cost_per_design_usd": null}, "human": false, "feedback": "",
  "team": "four_roles", "tool_calls": 80, "tool_minutes": 60, "text_tools": false,
  "memory": "", "memory_without_task": false
}"""


def test_a_configuration_written_before_is_read() -> None:
    assert RunConfig.model_validate_json(WRITTEN_BEFORE) == RunConfig(seed=1, budget=Budget(cost_usd=1.5))
    assert set(json.loads(WRITTEN_BEFORE)) == set(RunConfig.model_fields)


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"concept": 2}, r"unknown setting: concept; did you mean concepts\?"),
        ({"xyz": 2}, "unknown setting: xyz; settings are model, method, concepts"),
        ({"concepts": 40}, "invalid concepts: 40; it must be less than or equal to 20"),
        ({"budget": {"tokens": 0}}, r"invalid budget\.tokens: 0; it must be greater than or equal to 1"),
        ({"human": "perhaps"}, "invalid human: 'perhaps'"),
    ],
)
def test_a_mistake_names_the_setting_and_the_fix(settings: dict[str, object], sentence: str) -> None:
    with pytest.raises(UserError, match=sentence):
        checked_config(settings)


def test_settings_replace_those_of_a_configuration() -> None:
    config = RunConfig(concepts=5, budget=Budget(tokens=7))
    assert config.updated({"seed": 2}) == RunConfig(concepts=5, seed=2, budget=Budget(tokens=7))
    assert config.updated({}) == config


@pytest.mark.parametrize("kind", [RunConfig, Budget])
def test_every_setting_says_what_it_is(kind: type[BaseModel]) -> None:
    fields = run_settings() if kind is RunConfig else kind.model_fields
    for name, field in fields.items():
        assert field.description, name
        assert field.title or name == "budget", name


def test_every_setting_of_a_run_is_an_option_of_design(capsys: pytest.CaptureFixture[str]) -> None:
    app(["design", "--help"])
    told = " ".join(capsys.readouterr().out.replace("│", " ").split())
    for name, field in run_settings().items():
        if name != "budget":
            assert f"--{name.replace('_', '-')} " in told
            assert " ".join((field.description or "").split()[:3]) in told
    assert "--search-robots" not in told


def test_options_keep_defaults_and_bounds() -> None:
    assert options_for(RunConfig)().value() == RunConfig()
    assert bounds(RunConfig.model_fields["concepts"]) == {"ge": 1, "le": 20}
    assert bounds(RunConfig.model_fields["human"]) == {}
