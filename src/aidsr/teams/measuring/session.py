"""The conversation of a measuring designer: replies, calls of tools, results, until it finishes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from aidsr.core.calls import CallRecord, Message, Question, ToolCall, ToolOutput
from aidsr.core.errors import BudgetError, ReplyError
from aidsr.core.model import Model, calls_tools
from aidsr.teams.llm.conversation import complaint_about, with_complaint
from aidsr.teams.llm.prompts import render
from aidsr.teams.measuring.calls import calls_in_text, describe_tools, results_as_text
from aidsr.teams.measuring.own_tools import Chosen, chosen
from aidsr.teams.measuring.records import ToolRecord
from aidsr.teams.measuring.toolbox import Toolbox

AT_ONCE = 8
"""Calls of one reply that are carried out. Our choice: enough for what does not depend on each other."""
_USELESS = 3
"""Replies without a call, one after the other, after which a session ends. Our choice."""
_REPLIES_PER_CALL = 2
"""Replies of a session for each call it may make, at most: a bound for those that only read and repeat."""


@dataclass
class Session:
    """One design by one model with tools.

    Attributes:
        model: Is asked.
        toolbox: Its tools.
        text_tools: Whether calls are written as text also by a model that takes tools.
    """

    model: Model
    toolbox: Toolbox
    text_tools: bool = False

    def run(self, start: str) -> Chosen:
        """Return the scene that the session ends with.

        Args:
            start: Prompt of the job.

        Raises:
            ReplyError: It ended without a scene, or gave up.
            BudgetError: The budget of the run ended before a scene was kept.
            UserError, ModelError: The model gave no reply.
        """
        native = calls_tools(self.model) and not self.text_tools
        specs = self.toolbox.specs
        system = render("measuring", tools=() if native else describe_tools(specs), at_once=AT_ONCE)
        messages: tuple[Message, ...] = (Message(role="system", text=system), Message(role="user", text=start))
        useless = 0
        for _ in range(_REPLIES_PER_CALL * self.toolbox.budget.calls):
            if found := self._finished():
                return found
            try:
                record = self.model.ask(Question(role="designer", messages=messages, tools=specs if native else ()))
            except BudgetError:
                if best := self._best():
                    return best
                raise
            messages, made = self._answered(record, native)
            useless = 0 if made else useless + 1
            if useless >= _USELESS:
                return self._kept_or(f"The model called no tool in {_USELESS} replies.")
        return self._finished() or self._kept_or("The model used all its replies without finishing.")

    def _finished(self) -> Chosen | None:
        """Return what the session finished with, or the scene whose training succeeded; None while there is none.

        Raises:
            ReplyError: It gave up.
        """
        found = chosen(self.toolbox.workspace, "finished")
        if found is not None and not found.scene:
            raise ReplyError(f"The team gave up: {found.why}")
        if found is None and (trained := self.toolbox.exploration.succeeded()):
            return Chosen(scene=trained[0], why=f"Its training succeeded: {trained[1]}.")
        return found

    def _kept_or(self, reason: str) -> Chosen:
        """Return the scene that was kept.

        Raises:
            ReplyError: None was, with the reason why the session ended.
        """
        if best := self._best():
            return best
        raise ReplyError(f"{reason} It had kept no scene.")

    def _best(self) -> Chosen | None:
        """Return the scene that came farthest over several seeds, else the one that was kept; None where none was."""
        if found := self.toolbox.exploration.best_again():
            why = f"It came farthest of what was measured by several seeds, to progress {found[1]:.2f}."
            return Chosen(scene=found[0], why=why)
        return chosen(self.toolbox.workspace, "kept")

    def _answered(self, record: CallRecord, native: bool) -> tuple[tuple[Message, ...], bool]:
        """Return the conversation after a reply and its results, and whether it called a tool."""
        if complaint := complaint_about(record, needs_text=not record.tool_calls):
            return with_complaint(record, complaint), False
        try:
            calls = record.tool_calls if native else calls_in_text(record.reply)
        except ReplyError as error:
            return with_complaint(record, str(error)), False
        said = Message(role="assistant", text=record.reply, tool_calls=calls if native else ())
        if not calls:
            nudge = Message(role="user", text=render("measuring_no_call"))
            return (*record.question.messages, said, nudge), False
        results = [self._result(number, call) for number, call in enumerate(calls)]
        outputs = tuple(
            ToolOutput(id=call.id, name=call.name, text=result.text)
            for call, result in zip(calls, results, strict=True)
        )
        return (*record.question.messages, said, _next_turn(outputs, results, native)), True

    def _result(self, number: int, call: ToolCall) -> ToolRecord:
        if number < AT_ONCE:
            return self.toolbox.call(call)
        text = f"not carried out: at most {AT_ONCE} calls in a reply; call it again"
        return ToolRecord(name=call.name, arguments=call.arguments, text=text, outcome="refused", seconds=0.0)


def _next_turn(outputs: tuple[ToolOutput, ...], results: Sequence[ToolRecord], native: bool) -> Message:
    """Return the results as the next turn, with their pictures."""
    pictures = tuple(png for result in results for png in result.pictures)
    if not native:
        return Message(role="user", text=results_as_text(outputs), pictures=pictures)
    text = "The pictures of these results, in order." if pictures else ""
    return Message(role="user", text=text, pictures=pictures, tool_outputs=outputs)
