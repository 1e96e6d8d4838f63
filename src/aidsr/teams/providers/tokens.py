"""Estimates of token counts, for providers that do not report them."""

from __future__ import annotations

import math

from aidsr.core.calls import Question

_BYTES_PER_TOKEN = 3
"""Bytes of text per token. Our choice: English and MJCF have 3 to 4 bytes per token with current tokenizers, so
estimates are rather too high."""
_TOKENS_PER_PICTURE = 1600
"""Tokens of one picture. Our choice, rather too many: providers count 250 to 1,600 for pictures of the sizes drawn
here."""


def estimate_tokens(text: str) -> int:
    """Return an estimate of the number of tokens of a text, from its number of bytes."""
    return math.ceil(len(text.encode()) / _BYTES_PER_TOKEN)


def estimate_input_tokens(question: Question) -> int:
    """Return an estimate of the number of tokens of a question, its pictures and tools included."""
    pictures = sum(len(message.pictures) for message in question.messages)
    texts = [message.text for message in question.messages]
    for message in question.messages:
        texts += [call.name + call.arguments for call in message.tool_calls]
        texts += [output.text for output in message.tool_outputs]
    texts += [tool.model_dump_json() for tool in question.tools]
    return estimate_tokens("\n".join(texts)) + _TOKENS_PER_PICTURE * pictures
