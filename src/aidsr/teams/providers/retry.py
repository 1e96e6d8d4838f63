"""Retries when a provider is busy, broken or unreachable: how often, how long, and when to give up."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from pydantic import Field, ValidationError
from pydantic_settings import BaseSettings, SettingsConfigDict

from aidsr.core.calls import FailedAttempt, Usage
from aidsr.core.errors import ModelError, UserError

T = TypeVar("T")


class TransientError(Exception):
    """A failure of one attempt; another attempt may succeed.

    Attributes:
        retry_after_s: Pause requested by the provider [s]; None if it requested none.
        usage: Billed usage of the attempt, as far as it is known.
        cure: What a person can do if no attempt succeeds, as a sentence without its full stop; empty if the message
            says it.
    """

    def __init__(
        self, message: str, retry_after_s: float | None = None, usage: Usage | None = None, cure: str = ""
    ) -> None:
        self.retry_after_s = retry_after_s
        self.cure = cure
        self.usage = usage or Usage()
        super().__init__(message)


class NoReplyInTimeError(TransientError):
    """The time limit of an attempt passed; the model may have written a reply, which is billed."""


class RetryPolicy(BaseSettings):
    """Attempts, pauses and time limits; each has an environment variable: AIDSR_ followed by its name in capitals."""

    model_config = SettingsConfigDict(frozen=True, extra="forbid", env_prefix="AIDSR_", env_ignore_empty=True)

    attempts: int = Field(default=6, ge=1)
    """Maximum number of attempts at one call. Source: our choice; with the pauses below, six attempts outlast a failure
    of half a minute."""
    attempt_timeout_s: float = Field(default=900.0, gt=0)
    """Time limit of one attempt [s]. Source: our choice; 20,000 tokens at 25 tokens a second take 800 s."""
    deadline_s: float = Field(default=3600.0, gt=0)
    """Time limit of all attempts and pauses of one call [s]. Source: our choice."""
    first_wait_s: float = Field(default=1.0, ge=0)
    """Pause after the first failure [s]; doubled after each further failure."""
    longest_wait_s: float = Field(default=30.0, ge=0)
    """Longest pause [s]; a provider may request a longer one by Retry-After, which is limited by the deadline only."""

    @classmethod
    def from_environment(cls) -> RetryPolicy:
        """Return the defaults, overridden by the environment variables that are set.

        Raises:
            UserError: A variable is not a number in its range.
        """
        try:
            return cls()
        except ValidationError as error:
            problem = error.errors()[0]
        variable = f"AIDSR_{problem['loc'][0]}".upper()
        raise UserError(f'invalid environment variable {variable}="{problem["input"]}": {problem["msg"]}')


@dataclass(frozen=True)
class Clock:
    """Time source of the retries; tests pass one that does not wait."""

    now: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep


def call_with_retries(
    name: str, attempt: Callable[[float], T], policy: RetryPolicy, clock: Clock, failed: list[FailedAttempt]
) -> T:
    """Return the result of the first attempt that succeeds.

    Args:
        name: Name of the model, for error messages.
        attempt: Function that makes one attempt. It is called with its time limit [s] and raises TransientError if
            another attempt may help.
        policy: Attempts, pauses and time limits.
        clock: Time source.
        failed: List to which every failed attempt is appended, in order, also if no attempt succeeds.

    Raises:
        ModelError: The attempts or the time are used up. Any other exception of `attempt` passes through.
    """
    end = clock.now() + policy.deadline_s
    while True:
        try:
            return attempt(min(policy.attempt_timeout_s, end - clock.now()))
        except TransientError as error:
            failure = error
        wait = _wait_s(failure, len(failed), policy)
        last = FailedAttempt(error=str(failure), waited_s=0.0, usage=failure.usage)
        if len(failed) + 1 >= policy.attempts:
            failed.append(last)
            raise ModelError(
                f"{name} gave no reply in {policy.attempts} attempts; the last one failed: {_with_cure(failure)}"
            )
        if clock.now() + wait >= end:
            failed.append(last)
            raise ModelError(
                f"{name} gave no reply within {policy.deadline_s:g} s; attempt {len(failed)} failed, and the "
                f"next would have to wait {wait:.0f} s: {_with_cure(failure)}"
            )
        failed.append(last.model_copy(update={"waited_s": wait}))
        clock.sleep(wait)


def _with_cure(failure: TransientError) -> str:
    return f"{str(failure).rstrip('.')}. {failure.cure}" if failure.cure else str(failure)


def _wait_s(failure: TransientError, failures_before: int, policy: RetryPolicy) -> float:
    """Return the pause before the next attempt [s]: the provider's request, else doubled with each failure."""
    if failure.retry_after_s is not None and failure.retry_after_s >= 0:  # neither negative nor NaN
        return failure.retry_after_s
    return min(policy.first_wait_s * 2.0**failures_before, policy.longest_wait_s)
