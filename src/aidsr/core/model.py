"""Interface to a language model: a name, and a method that answers one request at a time.

`aidsr.design(model=...)` takes any object with this interface; docs/models.md shows the smallest one.
"""

from __future__ import annotations

from typing import Protocol

from aidsr.core.calls import CallRecord, Question


class Model(Protocol):
    """A language model. `ask` blocks until the reply arrives, and must be safe to call from several threads."""

    @property
    def name(self) -> str:
        """Name under which a run records the model, for example "openai:gpt-6.1-sol". Never contains a key."""
        ...

    def ask(self, question: Question) -> CallRecord:
        """Return the reply to a request, with its cost.

        A reply that is cut off, refused or empty is returned unchanged, and `finish` says so: the calling role decides
        how to handle it.

        Raises:
            UserError: The user must change something, for example a key that was refused.
            ModelError: There was no reply after all retries, or the provider will never accept the request.
        """
        ...


def calls_tools(model: Model) -> bool:
    """Return whether a model accepts tools with a request, according to its optional attribute `calls_tools`.

    For other models, the prompt describes the tools, and the model calls them in the text of its replies.
    """
    return bool(getattr(model, "calls_tools", False))
