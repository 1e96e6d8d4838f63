"""A real server process with a model made here: two layers of random weights, which say nothing of use.

Needs the extra "serving"; without it, loopback servers are all that the other tests speak to.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

import aidsr
from aidsr.core.calls import CallRecord, Message, Question
from aidsr.core.errors import ReplyError
from aidsr.runs import Run, read_status
from aidsr.runs.answered_calls import calls_in
from aidsr.teams.providers import connect

transformers = pytest.importorskip("transformers", reason='pip install -e ".[rl,serving]" brings the server')
pytestmark = pytest.mark.slow

START_S = 180.0
"""Time that the server has to start; it imports torch."""
STRICT = (
    "{% if messages[0].role != 'system' %}{{ raise_exception('the system message comes first') }}{% endif %}"
    "{% for m in messages %}"
    "{% if loop.index0 and (m.role == 'user') != (loop.index0 % 2 == 1) %}"
    "{{ raise_exception('user and assistant take turns') }}{% endif %}"
    "{% if not m.content is string or not m.content.strip() %}{{ raise_exception('no empty turns') }}{% endif %}"
    "<s>{{ m.role }}\n{{ m.content }}</s>{% endfor %}<s>assistant\n"
)


def make_model(home: Path) -> None:
    """Write a tokenizer trained on our own prompts, and a Llama of two layers with random weights."""
    import torch
    from tokenizers import Tokenizer, decoders, models, pre_tokenizers, trainers

    text = Tokenizer(models.BPE())
    text.pre_tokenizer, text.decoder = pre_tokenizers.ByteLevel(add_prefix_space=False), decoders.ByteLevel()
    prompts = [page.read_text() for page in Path(aidsr.__file__).parent.joinpath("agents").glob("*.md")]
    alphabet = pre_tokenizers.ByteLevel.alphabet()
    special = ["<s>", "</s>"]
    text.train_from_iterator(
        prompts, trainers.BpeTrainer(vocab_size=1000, special_tokens=special, initial_alphabet=alphabet)
    )
    tokenizer = transformers.PreTrainedTokenizerFast(tokenizer_object=text, bos_token="<s>", eos_token="</s>")
    tokenizer.chat_template = STRICT
    tokenizer.save_pretrained(home)
    shape = {"hidden_size": 32, "intermediate_size": 64, "num_hidden_layers": 2, "max_position_embeddings": 32768}
    heads = {"num_attention_heads": 2, "num_key_value_heads": 2}
    tokens = {"vocab_size": len(tokenizer), "bos_token_id": 0, "eos_token_id": 1, "pad_token_id": 1}
    torch.manual_seed(0)
    transformers.LlamaForCausalLM(transformers.LlamaConfig(**shape, **heads, **tokens)).save_pretrained(home)


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Name of the model at the server, as `--model` takes it."""
    home = tmp_path_factory.mktemp("tiny")
    make_model(home)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    start = "from transformers.cli.transformers import main; main()"
    command = [sys.executable, "-c", start, "serve", str(home), "--device", "cpu", "--host", "127.0.0.1"]
    with (home / "server.log").open("wb") as log:
        server = subprocess.Popen(
            [*command, "--port", str(port)], stdout=log, stderr=log, env={**os.environ, "HF_HUB_OFFLINE": "1"}
        )
    try:
        _wait_for(f"http://127.0.0.1:{port}/health", server, home / "server.log")
        yield f"{home}@http://127.0.0.1:{port}/v1"
    finally:
        server.terminate()
        server.wait()


def _wait_for(address: str, server: subprocess.Popen[bytes], log: Path) -> None:
    direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    end = time.monotonic() + START_S
    while time.monotonic() < end and server.poll() is None:
        try:
            direct.open(address, timeout=5).close()
        except (urllib.error.URLError, TimeoutError):
            time.sleep(0.5)
        else:
            return
    pytest.fail(f"the server did not start:\n{log.read_text()[-3000:]}")


def asked(model: str, *messages: tuple[str, str], cap: int) -> CallRecord:
    turns = tuple(Message(role=role, text=text) for role, text in messages)
    return connect(model).ask(Question(role="designer", messages=turns, max_output_tokens=cap))


def test_our_client_reaches_it_and_its_cap_holds(model: str) -> None:
    record = asked(model, ("system", "You design robots."), ("user", "Design one."), cap=24)
    assert (record.finish, record.usage.output_tokens) == ("length", 24)
    assert record.reply
    assert record.usage.input_tokens > 5
    assert record.usage.cost_usd is None, "no price is known for a server of one's own"


def test_a_conversation_passes_a_strict_chat_template(model: str) -> None:
    turns = (("system", "You design robots."), ("user", "Design one."), ("assistant", "Hm."), ("user", "Again."))
    assert asked(model, *turns, cap=8).usage.output_tokens == 8


def test_a_run_records_its_garbage_and_says_why_it_ends(model: str, tmp_path: Path) -> None:
    with pytest.raises(ReplyError, match="No usable reply in 3 attempts"):
        aidsr.design(task="button_pushing", model=model, concepts=1, max_output_tokens=256, runs=tmp_path)
    (folder,) = tmp_path.iterdir()
    records = calls_in(folder)
    assert [record.finish for record in records] == ["length"] * 3
    assert [record.usage.output_tokens for record in records] == [256] * 3
    assert all(record.reply for record in records)
    status = read_status(Run(folder))
    assert status.usage.output_tokens == 3 * 256
