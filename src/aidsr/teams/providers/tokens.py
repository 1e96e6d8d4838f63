"""Tokens of a text, estimated where the provider does not count them."""

from __future__ import annotations

import math

from aidsr.core.calls import Question

_BYTES_PER_TOKEN = 3
"""Our choice: English and MJCF take 3 to 4 bytes a token with current tokenizers, so this rather counts too many."""
_TOKENS_PER_PICTURE = 1600
"""Our choice, rather too many: providers count 250 to 1,600 for pictures of the sizes that we draw."""


def estimate_tokens(text: str) -> int:
    """Return about how many tokens a text has, from its bytes."""
    return math.ceil(len(text.encode()) / _BYTES_PER_TOKEN)


def estimate_input_tokens(question: Question) -> int:
    """Return about how many tokens a question has, its pictures and tools included."""
    pictures = sum(len(message.pictures) for message in question.messages)
    texts = [message.text for message in question.messages]
    for message in question.messages:
        texts += [call.name + call.arguments for call in message.tool_calls]
        texts += [output.text for output in message.tool_outputs]
    texts += [tool.model_dump_json() for tool in question.tools]
    return estimate_tokens("\n".join(texts)) + _TOKENS_PER_PICTURE * pictures
