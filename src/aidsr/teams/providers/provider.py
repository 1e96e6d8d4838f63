"""The record of a provider: everything about one kind of name that `--model` accepts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pydantic import SecretStr

from aidsr.core.errors import UserError
from aidsr.core.model import Model
from aidsr.teams.providers.retry import Clock, RetryPolicy

if TYPE_CHECKING:
    from aidsr.core.config import RunConfig
    from aidsr.core.roles import Team
    from aidsr.runs import Run


@dataclass(frozen=True)
class Endpoint:
    """One model of a provider, with everything needed to call it.

    Attributes:
        provider: The provider.
        name: Full name of the model, as it is recorded in a run: "anthropic:claude-sonnet-5-5".
        argument: The name without its prefix: the model's name at its provider, or a path.
        base_url: Address of the service; empty for a provider without one.
        key: The API key; None if none is set.
        secrets: Every API key in the environment, longest first, to be redacted in error texts.
        retry: Attempts, pauses and time limits of a call.
        clock: Time source for the retries.
    """

    provider: Provider
    name: str
    argument: str
    base_url: str = ""
    key: SecretStr | None = None
    secrets: tuple[SecretStr, ...] = ()
    retry: RetryPolicy = field(default_factory=RetryPolicy)
    clock: Clock = field(default_factory=Clock)

    @property
    def key_value(self) -> str | None:
        """The API key in clear text; None if none is set."""
        return self.key.get_secret_value() if self.key else None

    @property
    def has_list_price(self) -> bool:
        """Whether the provider's list prices apply: they do for its own service, not for a proxy or a local server."""
        return self.provider.price_id is not None and self.base_url == self.provider.base_url


@dataclass(frozen=True, kw_only=True)
class Provider:
    """One provider of models; docs/add_a_provider.md shows how to add one.

    Exactly one of `connect` and `team` is given: a provider either has models that answer questions, or it has a team
    that plays the roles without a language model.

    Attributes:
        prefix: Part of a model name before the colon: "anthropic" in "anthropic:claude-sonnet-5-5".
        title: Name of the provider for display.
        doc: One or two sentences that add to the title.
        argument: Kind of text after the colon, in capitals: "MODEL", "DIRECTORY"; empty if the prefix is the full name.
        example: Example of the argument.
        connect: Function that returns the model of an endpoint, without sending anything.
        team: Function that returns the team of a run that needs no language model.
        normalize: Function that returns the argument as it is recorded, or raises UserError if it is unusable.
        key_variables: Environment variables for the API key; the first one that is set is used.
        needs_key: Whether the provider refuses calls without a key.
        base_url: Default address of the service.
        base_url_variable: Environment variable that overrides `base_url`, for a proxy or another machine.
        price_id: Name of the provider in genai-prices whose list prices apply; None if prices are unknown.
        is_free: Whether calls cost nothing.
        takes_path: Whether the argument is a path, which a run records as absolute.
        extra: Optional dependency that the provider needs, see pyproject.toml.
    """

    prefix: str
    title: str
    doc: str = ""
    argument: str = ""
    example: str = ""
    connect: Callable[[Endpoint], Model] | None = None
    team: Callable[[Run, RunConfig], Team] | None = None
    normalize: Callable[[str], str] = str
    key_variables: tuple[str, ...] = ()
    needs_key: bool = False
    base_url: str = ""
    base_url_variable: str = ""
    price_id: str | None = None
    is_free: bool = False
    takes_path: bool = False
    extra: str = ""

    def __post_init__(self) -> None:
        """Raise ValueError unless exactly one of `connect` and `team` is given."""
        if (self.connect is None) == (self.team is None):
            raise ValueError(f"provider {self.prefix}: give either connect or team")

    @property
    def is_offline(self) -> bool:
        """Whether the provider asks no language model: fixed rules, reference robots, a search."""
        return self.team is not None

    @property
    def form(self) -> str:
        """Format of the provider's model names, such as "anthropic:MODEL"."""
        return self.name_of(self.argument)

    @property
    def example_name(self) -> str:
        """Example of a full model name."""
        return self.name_of(self.example)

    def name_of(self, argument: str) -> str:
        """Return the full name of the model with this argument."""
        return f"{self.prefix}:{argument}" if self.prefix and self.argument else self.prefix or argument

    def key(self, environ: Mapping[str, str]) -> SecretStr | None:
        """Return the API key in the environment variables `environ`; None if none is set.

        Raises:
            UserError: The key cannot be sent in an HTTP header; the client's own error would print the key.
        """
        for variable in self.key_variables:
            key = environ.get(variable, "").strip()
            if key and (not (key.isascii() and key.isprintable()) or " " in key):
                raise UserError(
                    f"{variable} cannot be sent: it contains a space, a line break or a character outside ASCII; "
                    "set it to the key alone"
                )
            if key:
                return SecretStr(key)
        return None

    def url(self, environ: Mapping[str, str]) -> str:
        """Return the address of the service, given the environment variables `environ`."""
        return environ.get(self.base_url_variable, "") or self.base_url
