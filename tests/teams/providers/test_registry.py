from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import aidsr
from aidsr.core.calls import Question
from aidsr.core.errors import UserError
from aidsr.runs import read_status
from aidsr.tasks import load_task
from aidsr.teams import rules
from aidsr.teams.providers import absolute_name, connect, is_offline, parse_model_name, price_usd, providers
from aidsr.teams.providers.google import GOOGLE
from aidsr.teams.providers.ollama import OLLAMA
from aidsr.teams.providers.provider import Provider
from aidsr.teams.providers.registry import BUILT_IN

DOCS = Path(__file__).parents[3] / "docs"
OPENAI = "openai:gpt-6.1-sol"


@pytest.mark.parametrize(
    ("name", "prefix", "argument"),
    [
        ("builtin", "builtin", ""),
        (OPENAI, "openai", "gpt-6.1-sol"),
        ("openai-chat:gpt-6.1-sol", "openai-chat", "gpt-6.1-sol"),
        ("anthropic:claude-sonnet-5-5", "anthropic", "claude-sonnet-5-5"),
        ("google:gemini-3.8-flash", "google", "gemini-3.8-flash"),
        ("openrouter:qwen/qwen3-coder:free", "openrouter", "qwen/qwen3-coder:free"),
        ("ollama:qwen3:32b", "ollama", "qwen3:32b"),
        ("qwen3@http://localhost:8000/v1", "", "qwen3@http://localhost:8000/v1"),
        ("Qwen/Qwen3-8B@https://example.org/v1/", "", "Qwen/Qwen3-8B@https://example.org/v1"),
        ("manual:my prompts", "manual", "my prompts"),
    ],
)
def test_a_name_has_a_provider_and_an_argument(name: str, prefix: str, argument: str) -> None:
    provider, found = parse_model_name(name)
    assert (provider.prefix, found) == (prefix, argument)
    assert provider.name_of(found) == name.rstrip("/")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("opnai:gpt-6.1-sol", f'did you mean "{OPENAI}"?'),
        ("antropic:claude-sonnet-5-5", 'did you mean "anthropic:claude-sonnet-5-5"?'),
        ("openai", f'lacks the model; write it without spaces, for example "{OPENAI}"'),
        ("gpt-6.1-sol", '"gpt-6.1-sol" is not a model name; write one of builtin, openai:MODEL, '),
        ("olama", 'did you mean "ollama:'),
        ("", "is not a model name"),
        (":", "is not a model name"),
        ("builtin:fast", 'is not a model name; write "builtin"'),
        ("openai:", "lacks the model"),
        ("openai: gpt", "without spaces"),
        ("manual:", "lacks the directory"),
        ("openrouter:qwen3", 'lacks the maker; write for example "openrouter:qwen/'),
        ("@http://localhost:8000/v1", "lacks the model"),
        ("qwen3@http:///v1", "no usable URL"),
        ("qwen3@http://[::1/v1", "no usable URL"),
        ("qwen3@http://localhost:80a/v1", "no usable URL"),
        ("qwen3@http://localhost:99999/v1", "no usable URL"),
        ("qwen3@http://local host/v1", "no usable URL"),
    ],
)
def test_a_wrong_name_is_refused_with_the_nearest_one(name: str, words: str) -> None:
    with pytest.raises(UserError) as caught:
        parse_model_name(name)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "url", ["http://me:secret@localhost/v1", "http://me:secret@localhost:80a/v1", "https://example.org/v1?key=secret"]
)
def test_a_url_with_a_secret_is_refused_without_repeating_it(url: str) -> None:
    with pytest.raises(UserError, match="AIDSR_API_KEY") as caught:
        parse_model_name(f"qwen3@{url}")
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize("provider", [each for each in BUILT_IN if each.needs_key], ids=lambda each: each.prefix)
def test_a_missing_key_is_named(provider: Provider) -> None:
    with pytest.raises(UserError, match="has no key; set the environment variable " + provider.key_variables[0]):
        connect(provider.example_name, environ={})


@pytest.mark.parametrize("provider", [each for each in BUILT_IN if each.is_offline], ids=lambda each: each.prefix)
def test_a_team_without_a_language_model_cannot_be_connected(provider: Provider) -> None:
    assert is_offline(provider.prefix)
    with pytest.raises(UserError, match="asks no language model"):
        connect(provider.prefix)


def test_a_name_of_no_provider_is_not_offline_and_has_no_price() -> None:
    assert not is_offline("my own model")
    with pytest.raises(UserError, match="is not a model name"):
        price_usd("my own model", 1, 1)


def test_keys_and_urls_come_from_the_environment() -> None:
    key = GOOGLE.key({"GOOGLE_API_KEY": "", "GEMINI_API_KEY": " key-of-google\n"})
    assert key is not None
    assert key.get_secret_value() == "key-of-google"
    assert OLLAMA.url({"OLLAMA_BASE_URL": "http://10.0.0.1:11434/v1"}) == "http://10.0.0.1:11434/v1"
    assert OLLAMA.url({"OLLAMA_BASE_URL": ""}) == OLLAMA.base_url


def test_list_prices_hold_for_the_providers_own_service_only() -> None:
    # gpt-4o has cost 2.50 USD per million input tokens and 10 USD per million output tokens since October 2024.
    assert price_usd("openai:gpt-4o", 1_000_000, 100_000, environ={}) == pytest.approx(3.5)
    assert price_usd("openai:gpt-4o", 1, 1, environ={"OPENAI_BASE_URL": "http://proxy/v1"}) is None
    assert price_usd("openai:no-such-model", 1, 1, environ={}) is None
    assert price_usd("m@http://localhost/v1", 1, 1, environ={}) is None
    assert price_usd("manual:prompts", 1, 1, environ={}) is None
    assert price_usd("replay:run", 1, 1, environ={}) == 0.0


@pytest.mark.parametrize("name", ["builtin", "openai:gpt-5", "m@http://localhost:8000/v1", "manual:", "manual:/there"])
def test_a_name_without_a_relative_path_is_recorded_as_it_is(name: str) -> None:
    assert absolute_name(name) == name
    assert absolute_name("manual:letters") == f"manual:{Path.cwd() / 'letters'}"


def test_a_provider_either_connects_or_has_a_team() -> None:
    with pytest.raises(ValueError, match="either connect or team"):
        Provider(prefix="neither", title="")


def test_the_table_of_the_docs_is_that_of_the_records() -> None:
    rows = ["| name | what it is | key | address |", "|---|---|---|---|", *map(_row, providers())]
    expected = "\n".join(rows)
    assert expected in (DOCS / "models.md").read_text(), f"put this table into docs/models.md:\n{expected}"


def _row(provider: Provider) -> str:
    key = " or ".join(f"`{variable}`" for variable in provider.key_variables)
    key = key and (key if provider.needs_key else f"optional, {key}")
    url = f"`{provider.base_url}`, or `{provider.base_url_variable}`" if provider.base_url else ""
    what = f"{provider.title}. {provider.doc}" if provider.doc else provider.title
    return f"| `{provider.form}` | {what} | {key or 'none'} | {url} |"


def test_importing_the_providers_loads_no_client_library() -> None:
    code = (
        "import sys, aidsr.teams.providers, aidsr.teams.llm; "
        "heavy = 'pydantic_ai openai anthropic google.genai torch mujoco'; "
        "print([module for module in heavy.split() if module in sys.modules])"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.strip() == "[]"


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The package of docs/add_a_provider.md, as an installer leaves it: a module beside its dist-info."""
    page = (DOCS / "add_a_provider.md").read_text()
    module, project = (re.search(rf"```{kind}[^\n]*\n(.*?)```", page, re.DOTALL)[1] for kind in ("python", "toml"))
    entry = re.search(r'\[project.entry-points."aidsr.models"\]\n(.*?)\n', project)[1].replace('"', "")
    info = tmp_path / "aidsr_answers-0.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: aidsr-answers\nVersion: 0.1\n")
    (info / "entry_points.txt").write_text(f"[aidsr.models]\n{entry}\n")
    (tmp_path / "aidsr_answers.py").write_text(module)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_a_package_adds_a_provider_that_designs_a_robot(package: Path, tmp_path: Path) -> None:
    answers = tmp_path / "answers"
    write_answers(answers, "button_pushing")
    assert "answers" in [provider.prefix for provider in providers()]
    with pytest.raises(UserError, match="unknown provider"):
        parse_model_name("answer:x")
    run = aidsr.design(task="button_pushing", model=f"answers:{answers}", concepts=1, iterations=1, runs=package)
    status = read_status(run)
    assert status.designs[0].outcome.outcome == "approved", status.designs[0].outcome.reason
    assert (status.usage.calls, status.usage.cost_usd) == (4, 0.0)
    (answers / "judge.md").unlink()
    with pytest.raises(UserError, match=r"cannot read .*judge.md"):
        connect(f"answers:{answers}").ask(Question(role="judge", messages=()))


def write_answers(folder: Path, task: str) -> None:
    """Write what the built-in rules design for a task as the replies of a language model."""
    brief, roles = load_task(task).brief(), rules.team(seed=0)
    (concept,) = roles.designer.propose(brief, 1)
    robot = roles.coder.write(brief, concept)
    idea = concept.model_dump(mode="json", exclude={"interpretation"})
    placement = roles.integrator.place(brief, concept, robot)
    folder.mkdir()
    (folder / "designer.md").write_text(json.dumps({"interpretation": concept.interpretation, "concepts": [idea]}))
    header = robot.model_dump_json(exclude={"mjcf", "script"})
    (folder / "coder.md").write_text(f"```json\n{header}\n```\n```xml\n{robot.mjcf}\n```\n")
    (folder / "integrator.md").write_text(placement.model_dump_json())
    (folder / "judge.md").write_text('{"passed": true, "summary": "It can reach."}')


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("answers = aidsr_answers:NOTHING", 'cannot load provider "answers" of aidsr-answers (AttributeError'),
        ("answers = no_such_module:PROVIDER", 'cannot load provider "answers" of aidsr-answers (ModuleNotFoundError'),
        (
            "replies = aidsr_answers:PROVIDER",
            'cannot load provider "replies" of aidsr-answers (its prefix is "answers"; use one name)',
        ),
        (
            "openai = aidsr.teams.providers.openai:OPENAI",
            "duplicate provider: openai is built in; uninstall aidsr-answers",
        ),
    ],
)
def test_a_broken_package_is_named_and_leaves_the_built_in_providers_alone(
    package: Path, entry: str, words: str
) -> None:
    (package / "aidsr_answers-0.1.dist-info" / "entry_points.txt").write_text(f"[aidsr.models]\n{entry}\n")
    with pytest.raises(UserError) as caught:
        providers()
    assert words in str(caught.value)
    assert parse_model_name(OPENAI)[0].prefix == "openai"
