"""A person's decision on a design: approve it, request a change of a part or of the whole, or quit it."""

from __future__ import annotations

from functools import partial
from typing import Any

from nicegui import app, ui

from aidsr.apps.web.live import as_action, live
from aidsr.apps.web.site import Site
from aidsr.apps.web.widgets import box, button, long_text, text
from aidsr.core.artifacts import Decision
from aidsr.core.config import BUILTIN
from aidsr.core.errors import AidsrError, UserError
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.runs import DesignFolder, IterationFolder, Run
from aidsr.runs.files import WrittenTwiceError
from aidsr.runs.status import decided, newest
from aidsr.teams.rules.apply_feedback import UNDERSTOOD


class Draft:
    """Text about an iteration that a person has typed and not sent yet; kept over reloads and restarts."""

    def __init__(self, run: Run, iteration: IterationFolder) -> None:
        drafts: dict[str, Any] = app.storage.user.setdefault("drafts", {})
        key = "/".join((run.name, *iteration.path.parts[-2:]))
        self.kept: dict[str, Any] = drafts.setdefault(key, {"text": "", "about": ""})

    def pin(self, name: str) -> None:
        """Store the name of the body or tendon that the text is about."""
        self.kept["about"] = name


def refinement(words: str, about: str) -> Decision:
    """Return the decision that requests a change.

    Raises:
        UserError: The text is empty.
    """
    if not words.strip():
        raise UserError("a refinement needs text: describe what should change")
    comment = f"About {about}: {words.strip()}" if about else words.strip()
    return Decision(verdict="refine", text=comment)


def decide(site: Site, run: Run, iteration: IterationFolder, decision: Decision) -> None:
    """Write a decision, and resume the run if no process works on it.

    Raises:
        UserError: Another decision was written in the meantime, or one that cannot be read.
    """
    try:
        iteration.decision.write(decision)
    except WrittenTwiceError:
        iteration.decision.read()
        raise UserError(
            "a decision on this design was already made, perhaps in another tab; reload the page to see it"
        ) from None
    if not site.is_running(run):
        site.resume(run)


def _unused(site: Site, run: Run, iteration: IterationFolder) -> str | None:
    """Return the last output of the run's process if no process works with a written decision; None otherwise."""
    if not iteration.decision.path.exists() or site.is_running(run):
        return None
    return site.unexplained_output(run, site.view(run))


def _tell_unused(site: Site, run: Run, output_tail: str | None) -> None:
    if output_tail is None:
        return
    with box("notice wait", role="status"), box("row apart"):
        text("Your decision is written, but no process works on this run.")
        button("Resume", as_action(lambda: site.resume(run)), "primary", "play_arrow")
    if output_tail:
        text("Output of the last process of this run:", "label")
        long_text(output_tail, "last output", "last")


def review_panel(site: Site, run: Run, design: DesignFolder, number: int, names: list[str]) -> None:
    """Show the form for the decision on an iteration that waits for one; `names` are the parts to refer to."""
    iteration = design.iteration(number)
    draft = Draft(run, iteration)

    def take(decision: Decision) -> None:
        decide(site, run, iteration, decision)
        ui.notify({"approve": "Approved.", "refine": "Sent to the Designer.", "quit": "Design quit."}[decision.verdict])

    def refine() -> None:
        take(refinement(str(draft.kept["text"] or ""), str(draft.kept["about"] or "")))

    def give_up() -> None:
        sure.close()
        take(Decision(verdict="quit"))

    with ui.dialog() as sure, ui.card().classes("stack"):
        text("Quit this design?", tag="h2")
        text(
            "No further iterations are made. This cannot be undone. The files of the design are kept, and the other "
            "designs of the run continue.",
            "",
            "p",
        )
        with box("row"):
            button("Quit design", as_action(give_up), "danger", "close")
            button("Cancel", sure.close)
    live(lambda: _unused(site, run, iteration), partial(_tell_unused, site, run))
    with box("sheet stack review", "section", aria_label="your decision"):
        text("Your decision", tag="h2")
        text(
            "This design is stable and the Judge passed it. Pull its tendons and watch its motion, then decide.", "soft"
        )
        _what_became(design, number)
        with box("stack"):
            field = ui.textarea("What should change?").props("outlined autogrow")
            field.bind_value(draft.kept, "text")
            field.props.update({"maxlength": 4000, "placeholder": "Make the last segment shorter and the tip broader."})
            if run.asked().config.model == BUILTIN:
                text(f"The built-in rules understand only: {UNDERSTOOD}.", "small soft", "p")
            kept = str(draft.kept["about"] or "")
            gone = [kept] if kept and kept not in names else []
            about = ui.select([*gone, *names], label="Part (click it in the view, or select it here)", with_input=True)
            about.props("outlined dense clearable").bind_value(
                draft.kept, "about", forward=lambda name: name or "", backward=lambda name: name or None
            )  # None is an empty field; "" would be one to clear
        with box("row"):
            button("Approve", as_action(lambda: take(Decision(verdict="approve"))), "primary", "check")
            button(
                "Refine", as_action(refine), "quiet", "edit", "Sends your text to the Designer and starts a new round"
            )
            button(
                "Quit this design",
                sure.open,
                "danger",
                "close",
                "Ends this design, not the run",
            )


def _what_became(design: DesignFolder, number: int) -> None:
    """Show a person's last words about a design, and what the Designer writes of the body that followed."""
    before = [decided(each) for each in design.leading_to(number) if each.number < number]
    asked = next((each for each in before if each is not None and each.text), None)
    concept = newest(each.concept.read() for each in design.leading_to(number))
    if asked is None or concept is None:
        return
    with box("stack tight"):
        text("What became of your last words", "label")
        text(f"“{asked.text}”", "small", "p")
        text(concept.rationale, "small soft", "p")


def part_names(mjcf: str) -> list[str]:
    """Return the names of bodies and tendons of a robot, or of a scene's robot, with the safe parser.

    Empty where the MJCF cannot be read.
    """
    from aidsr.mjcf.read import read_mjcf

    try:
        root = read_mjcf(mjcf).root
    except AidsrError:
        return []
    found = [
        str(node.get("name"))
        for node in root.iter("body", "spatial", "fixed")
        if node.get("name") and node.getparent() is not None
    ]
    ours = [name for name in found if name.startswith(ROBOT_PREFIX)]
    return ours or found
