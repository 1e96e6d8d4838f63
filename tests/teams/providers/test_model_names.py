from __future__ import annotations

import subprocess
import sys

import pytest

from aidsr.core.errors import UserError
from aidsr.teams.providers import Access, connect
from aidsr.teams.providers.model_names import Address, parse_address


@pytest.mark.parametrize(
    ("name", "address"),
    [
        ("openai:gpt-6.1-sol", Address("openai", "gpt-6.1-sol")),
        ("openai-chat:gpt-6.1-sol", Address("openai-chat", "gpt-6.1-sol")),
        ("anthropic:claude-sonnet-5-5", Address("anthropic", "claude-sonnet-5-5")),
        ("google:gemini-3.8-flash", Address("google", "gemini-3.8-flash")),
        ("openrouter:qwen/qwen3-coder:free", Address("openrouter", "qwen/qwen3-coder:free")),
        ("ollama:qwen3:32b", Address("ollama", "qwen3:32b")),
        ("qwen3@http://localhost:8000/v1", Address("url", "qwen3", "http://localhost:8000/v1")),
        ("Qwen/Qwen3-8B@https://example.org/v1/", Address("url", "Qwen/Qwen3-8B", "https://example.org/v1")),
    ],
)
def test_names_that_are_understood(name: str, address: Address) -> None:
    assert parse_address(name) == address
    assert str(address) == name.rstrip("/")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("opnai:gpt-6.1-sol", 'did you mean "openai:gpt-6.1-sol"?'),
        ("antropic:claude-sonnet-5-5", 'did you mean "anthropic:claude-sonnet-5-5"?'),
        ("openai", 'for example "openai:gpt-6.1-sol"'),
        ("gpt-6.1-sol", "write PROVIDER:MODEL"),
        ("olama", 'for example "ollama:'),
        ("", "write PROVIDER:MODEL"),
        ("openai:", "lacks the model"),
        ("openai: gpt", "without spaces"),
        ("openrouter:qwen3", 'for example "openrouter:qwen/'),
        ("@http://localhost:8000/v1", "lacks the model"),
        ("qwen3@http:///v1", "no usable URL"),
        ("qwen3@http://[::1/v1", "no usable URL"),
        ("qwen3@http://localhost:80a/v1", "no usable URL"),
        ("qwen3@http://localhost:99999/v1", "no usable URL"),
        ("qwen3@http://local host/v1", "no usable URL"),
    ],
)
def test_names_that_are_not(name: str, words: str) -> None:
    with pytest.raises(UserError) as caught:
        parse_address(name)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "url", ["http://me:secret@localhost/v1", "http://me:secret@localhost:80a/v1", "https://example.org/v1?key=secret"]
)
def test_a_url_with_a_secret_is_refused_without_repeating_it(url: str) -> None:
    with pytest.raises(UserError, match="AIDSR_API_KEY") as caught:
        parse_address(f"qwen3@{url}")
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "variable"),
    [
        ("openai:gpt-6.1-sol", "OPENAI_API_KEY"),
        ("openai-chat:gpt-6.1-sol", "OPENAI_API_KEY"),
        ("anthropic:claude-sonnet-5-5", "ANTHROPIC_API_KEY"),
        ("google:gemini-3.8-flash", "GOOGLE_API_KEY"),
        ("openrouter:qwen/qwen3-coder", "OPENROUTER_API_KEY"),
    ],
)
def test_a_missing_key_is_named(name: str, variable: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for each in ("OPENAI", "ANTHROPIC", "GOOGLE", "GEMINI", "OPENROUTER"):
        monkeypatch.delenv(f"{each}_API_KEY", raising=False)
    with pytest.raises(UserError, match=f"set the environment variable {variable}"):
        connect(name)


def test_keys_and_urls_come_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("GOOGLE_API_KEY", raising=False)
    monkeypatch.setenv("GEMINI_API_KEY", " key-of-google\n")
    monkeypatch.setenv("OLLAMA_BASE_URL", "http://10.0.0.1:11434/v1")
    access = Access()
    assert access.google_api_key is not None
    assert access.google_api_key.get_secret_value() == "key-of-google"
    assert access.ollama_base_url == "http://10.0.0.1:11434/v1"


def test_importing_the_room_loads_no_provider() -> None:
    code = (
        "import sys, aidsr.teams.providers, aidsr.teams.llm; "
        "heavy = 'pydantic_ai openai anthropic google.genai torch mujoco'; "
        "print([module for module in heavy.split() if module in sys.modules])"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.strip() == "[]"
