"""What reaches a provider: keys and addresses, from the environment and nowhere else."""

from __future__ import annotations

from pydantic import AliasChoices, Field, SecretStr, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from aidsr.core.errors import UserError

__all__ = ["Access"]

_GOOGLE_KEY = AliasChoices("google_api_key", "gemini_api_key")


class Access(BaseSettings):
    """Keys and base URLs, read from environment variables of the same names in capitals.

    Keys are `SecretStr`: printing, logging or dumping this object shows asterisks.
    """

    model_config = SettingsConfigDict(frozen=True, extra="forbid", env_ignore_empty=True, populate_by_name=True)

    openai_api_key: SecretStr | None = None
    anthropic_api_key: SecretStr | None = None
    google_api_key: SecretStr | None = Field(default=None, validation_alias=_GOOGLE_KEY)
    openrouter_api_key: SecretStr | None = None
    ollama_api_key: SecretStr | None = None
    aidsr_api_key: SecretStr | None = None
    """Key for a server named by its URL, if it wants one."""

    openai_base_url: str | None = None
    anthropic_base_url: str | None = None
    google_base_url: str | None = None
    openrouter_base_url: str | None = None
    ollama_base_url: str = "http://localhost:11434/v1"

    @field_validator("*", mode="after")
    @classmethod
    def _sendable(cls, value: object) -> object:
        """Trim keys, and refuse one that cannot travel in an HTTP header, whose error would print it."""
        if not isinstance(value, SecretStr):
            return value
        key = value.get_secret_value().strip()
        if not (key.isascii() and key.isprintable()) or " " in key:
            raise UserError(
                "An API key in the environment contains a space, a line break or a sign outside ASCII, "
                "so it cannot be sent; set the *_API_KEY variable again with the key alone."
            )
        return SecretStr(key)

    def keys(self) -> tuple[str, ...]:
        """Return every key in clear, longest first, for wiping them out of texts."""
        values = (getattr(self, field) for field in type(self).model_fields)
        found = {value.get_secret_value() for value in values if isinstance(value, SecretStr)} - {""}
        return tuple(sorted(found, key=len, reverse=True))
