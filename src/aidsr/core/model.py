"""What the rest of AID-SR knows of a language model: a name, and one question answered at a time.

Any object of this form can design: `aidsr.design(model=...)` takes it, and docs/models.md shows the smallest one.
"""

from __future__ import annotations

from typing import Protocol

from aidsr.core.calls import CallRecord, Question


class Model(Protocol):
    """Answers questions. Implementations block until the reply is there and may be asked from several threads."""

    @property
    def name(self) -> str:
        """Name under which a run records the model, for example "openai:gpt-6.1-sol". Never contains a key."""
        ...

    def ask(self, question: Question) -> CallRecord:
        """Return the reply to a question together with what it cost.

        A reply that is cut off, refused or empty is returned as it is, with `finish` saying so: what to do about it
        is for the calling role to decide.

        Raises:
            UserError: Something the person must change, for example a key that was refused.
            ModelError: No reply after every retry, or a request that the provider will never accept.
        """
        ...


def calls_tools(model: Model) -> bool:
    """Return whether a model takes tools with a question, by its optional attribute `calls_tools`.

    Others are told of tools in words, and call them in the text of their replies.
    """
    return bool(getattr(model, "calls_tools", False))
