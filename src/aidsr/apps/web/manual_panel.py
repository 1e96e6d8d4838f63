"""Prompts of a run whose model is a person, to be copied and answered on the page of the run."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nicegui import app, ui

from aidsr.apps.web.live import as_action, clear_error, live, show_error
from aidsr.apps.web.site import Site
from aidsr.apps.web.widgets import box, button, long_text, notice, text
from aidsr.core.errors import UserError
from aidsr.runs import Run
from aidsr.teams.providers.manual import PendingPrompt, pending_prompts, prompts_directory

_MOST_CHARACTERS = 1_000_000
"""Maximum length of a reply. Our choice: several times the longest reply of a language model."""

_COPY_S = 10.0
"""Time for the browser to copy, in which it may ask for permission [s]. Our choice."""


@dataclass(frozen=True)
class _Prompt:
    """A prompt as the web app shows it."""

    waiting: PendingPrompt
    asked: str
    """Text of the prompt."""
    refused: str
    """Why the previous reply could not be used; empty for a first prompt."""


def prompts_of(site: Site, run: Run) -> Path | None:
    """Return the directory of prompts and replies of a run that a person answers; None for other models.

    Raises:
        UserError: The directory is outside the folder of runs, where the web app writes nothing.
    """
    directory = prompts_directory(run.asked().config.model)
    if directory is None:
        return None
    if not directory.resolve().is_relative_to(site.library.path.resolve()):
        raise UserError(
            f"the prompts of this run are in {directory}, outside the folder of runs; write the replies as files "
            "there, or start such runs from the web app"
        )
    return directory


def answer(waiting: PendingPrompt, reply: str) -> None:
    """Save a reply atomically, so that no process reads half of it.

    Raises:
        UserError: The reply is empty or too long, or the prompt already has a reply.
    """
    if not reply.strip():
        raise UserError("the reply is empty; paste the whole reply of the model")
    if len(reply) > _MOST_CHARACTERS:
        raise UserError(
            f"the reply has {len(reply):,} characters, more than {_MOST_CHARACTERS:,}; paste the reply only"
        )
    draft = waiting.reply.with_name(f".{waiting.reply.name}.{os.getpid()}.tmp")
    draft.write_text(reply, encoding="utf-8")
    try:
        os.link(draft, waiting.reply)  # unlike a rename, this never replaces a reply given in another tab
    except FileExistsError:
        raise UserError("this prompt was already answered, perhaps in another tab") from None
    finally:
        draft.unlink()


def manual_panel(site: Site, run: Run) -> None:
    """Show the waiting prompts, each with a copy button and a field for the reply."""
    if prompts_directory(run.asked().config.model):
        live(lambda: _read(site, run), lambda prompts: _draw(run, prompts))


def _read(site: Site, run: Run) -> tuple[_Prompt, ...]:
    directory = prompts_of(site, run)
    if directory is None or not site.is_running(run):
        return ()
    return tuple(
        _Prompt(one, one.prompt.read_text(encoding="utf-8"), one.answer_to_reply())
        for one in pending_prompts(directory)
    )


def _draw(run: Run, prompts: tuple[_Prompt, ...]) -> None:
    if not prompts:
        return
    many = f"{len(prompts)} prompts wait" if len(prompts) > 1 else "A prompt waits"
    with box("stack"):
        notice(f"{many} for a reply. Copy it into a language model of your choice and paste the whole reply.", "wait")
        for prompt in prompts:
            _prompt(run, prompt)


async def _copied(words: str) -> bool:
    """Copy a text to the clipboard of the browser, and return whether the browser did so."""
    write = f"navigator.clipboard.writeText({json.dumps(words)}).then(() => true, () => false)"
    try:
        return bool(await ui.run_javascript(f"navigator.clipboard ? {write} : false", timeout=_COPY_S))
    except TimeoutError:
        return False


def _prompt(run: Run, prompt: _Prompt) -> None:
    drafts: dict[str, Any] = app.storage.user.setdefault("drafts", {})
    draft: dict[str, Any] = drafts.setdefault(f"{run.name}/{prompt.waiting.prompt.name}", {"text": ""})

    async def copy() -> None:
        if await _copied(prompt.asked):
            clear_error()
            ui.notify("Copied.")
        else:
            show_error(
                UserError(
                    "this browser copies only over HTTPS or on the machine of the web app; open “Show prompt” and copy "
                    "it there"
                )
            )

    with box("sheet stack", "section"):
        with box("row apart"):
            text(f"Prompt {int(prompt.waiting.prompt.name[:4])} of the {prompt.waiting.role}", tag="h2")
            button("Copy the prompt", copy, "quiet", "content_copy")
        if prompt.refused:
            with box("stack tight"):
                text("Feedback on your last reply", "label")
                notice(prompt.refused, "wait")
        with ui.expansion("Show prompt").props("dense dense-toggle").classes("full"):
            long_text(prompt.asked, "prompt")
        field = ui.textarea("The whole reply").props("outlined").bind_value(draft, "text")
        field.props["maxlength"] = _MOST_CHARACTERS
        with box("row"):
            send = as_action(lambda: answer(prompt.waiting, str(draft["text"] or "")))
            button("Send the reply", send, "primary", "send")
