"""The conversation of a measuring designer: replies, tool calls and results, until it finishes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from aidsr.core.calls import CallRecord, Message, Question, ToolCall
from aidsr.core.errors import BudgetError, ReplyError
from aidsr.core.model import Model, calls_tools
from aidsr.teams.llm.conversation import complaint_about, with_complaint
from aidsr.teams.llm.prompts import render
from aidsr.teams.measuring.board import Board
from aidsr.teams.measuring.calls import calls_in_text, describe_tools, prose_of
from aidsr.teams.measuring.own_tools import Chosen, chosen
from aidsr.teams.measuring.records import Exchange, ToolRecord
from aidsr.teams.measuring.toolbox import MAKES, Toolbox

AT_ONCE = 24
"""Maximum number of calls of one reply that are carried out. Our choice: enough to propose, write, place and measure
six families."""
_USELESS = 3
"""Number of consecutive replies without a call after which a session ends. Our choice."""
_REPLIES_PER_CALL = 2
"""Maximum number of replies of a session per call that it may make: a bound for sessions that only read and repeat."""

_NAME = re.compile(r"\b(?:robot|scene)_\d+\b")


@dataclass
class Session:
    """One design by one model with tools.

    Attributes:
        model: The language model.
        toolbox: Tools of the session.
        text_tools: Whether calls are written as text even if the model supports tools.
        may_continue: Whether the run may get another budget, so that a spent one ends the session without a result.
    """

    model: Model
    toolbox: Toolbox
    text_tools: bool = False
    may_continue: bool = False

    def run(self, start: str) -> Chosen:
        """Return the scene that the session ends with.

        Args:
            start: Prompt of the job.

        Raises:
            ReplyError: The session ended without a scene, or the model gave up.
            BudgetError: The budget of the run ended, and it may get another one, or there was no scene to return, see
                `_best`.
            UserError, ModelError: The model gave no reply.
        """
        native = calls_tools(self.model) and not self.text_tools
        specs = self.toolbox.specs
        exchanges: list[Exchange] = []
        messages, useless = self.told(start, exchanges, native), 0
        for _ in range(_REPLIES_PER_CALL * self.toolbox.budget.calls):
            if found := self._finished():
                return found
            try:
                record = self.model.ask(Question(role="designer", messages=messages, tools=specs if native else ()))
            except BudgetError as error:
                best = None if self.may_continue else self._best(str(error))
                if best is None:
                    raise
                return best
            calls, complaint = _calls_of(record, native)
            if calls:
                said = record.reply if native else prose_of(record.reply)
                exchanges.append(Exchange(said.strip(), calls, self._results(calls, exchanges)))
                messages, useless = self.told(start, exchanges, native), 0
                continue
            messages, useless = complaint, useless + 1
            if useless >= _USELESS:
                return self._kept_or(f"The model called no tool in {_USELESS} replies.")
        return self._finished() or self._kept_or("The model used all its replies without finishing.")

    def told(self, start: str, exchanges: Sequence[Exchange], native: bool) -> tuple[Message, ...]:
        """Return the messages of the next question: system prompt, job, and the summary of the exchanges so far."""
        board = Board(exchanges, self.toolbox, native)
        tools = () if native else describe_tools(self.toolbox.specs)
        system = render("measuring", tools=tools, at_once=AT_ONCE, explores=board.explores)
        return (Message(role="system", text=system), Message(role="user", text=start), *board.turns())

    def _finished(self) -> Chosen | None:
        """Return the scene with which the session finished, or the scene whose training succeeded; None if neither.

        While recorded results are left, the session has not come to its end again: the recorded replies are asked for
        first, so that a replay checks every prompt.

        Raises:
            ReplyError: The model gave up.
        """
        if self.toolbox.has_unused_records:
            return None
        found = chosen(self.toolbox.workspace, "finished")
        if found is not None and not found.scene:
            raise ReplyError(f"The team gave up: {found.why}")
        if found is None and (trained := self.toolbox.exploration.succeeded()):
            scene, result = trained
            return Chosen(scene=scene, why=f"{result[0].upper()}{result[1:]}.", ended="Its training succeeded.")
        if found is not None and not found.ended:
            spent = self.toolbox.spent
            ended = f"{spent.capitalize()}." if spent else "It finished before its budget ended."
            return found.model_copy(update={"ended": ended})
        return found

    def _kept_or(self, reason: str) -> Chosen:
        """Return the best scene so far, see `_best`.

        Raises:
            ReplyError: There is none; the message has the reason why the session ended.
        """
        if best := self._best(reason):
            return best
        raise ReplyError(f"{reason} It had kept no scene.")

    def _best(self, ended: str) -> Chosen | None:
        """Return the scene with the most progress over several seeds, else the scene that was kept; None if neither."""
        if found := self.toolbox.exploration.best_again():
            why = f"It came farthest of what was measured by several seeds, to progress {found[1]:.2f}."
            return Chosen(scene=found[0], why=why, ended=ended)
        kept = chosen(self.toolbox.workspace, "kept")
        return kept.model_copy(update={"ended": ended}) if kept else None

    def _results(self, calls: Sequence[ToolCall], exchanges: Sequence[Exchange]) -> tuple[ToolRecord, ...]:
        """Carry out the calls of a reply, in order.

        A call may name robots and scenes that earlier calls of the same reply make. If one of those repeats a previous
        call, it returns what that call made, or its failure, and uses up no name, so the names that follow differ from
        those that the model expected. Later
        calls of the reply are then not carried out if they name anything that did not exist before the reply.
        """
        known = {one.made for exchange in exchanges for one in exchange.results}
        made = set(known)
        results: list[ToolRecord] = []
        before = [one for exchange in exchanges for one in exchange.results]
        shifted = ""
        for number, call in enumerate(calls, 1):
            new = set(_NAME.findall(call.arguments)) - known
            if number > AT_ONCE:
                one = _not_carried_out(call, f"at most {AT_ONCE} calls in a reply; call it again")
            elif shifted and new:
                one = _not_carried_out(call, f"{shifted}, so names are other than you thought; call it again")
            else:
                one = self.toolbox.call(call)
            if one.made in made - {""} and not shifted:
                shifted = f"call {number}, {call.name}, was made before and brought {one.made} again"
            elif call.name in MAKES and not one.made and any(one is each for each in before) and not shifted:
                shifted = f"call {number}, {call.name}, failed before and uses up no other name"
            made.add(one.made)
            results.append(one)
            before.append(one)
        return tuple(results)


def _not_carried_out(call: ToolCall, why: str) -> ToolRecord:
    return ToolRecord(
        name=call.name, arguments=call.arguments, text=f"not carried out: {why}", outcome="refused", seconds=0.0
    )


def _calls_of(record: CallRecord, native: bool) -> tuple[tuple[ToolCall, ...], tuple[Message, ...]]:
    """Return the calls of a reply; if it has none, also the conversation continued by a complaint."""
    if complaint := complaint_about(record, needs_text=not record.tool_calls):
        return (), with_complaint(record, complaint)
    try:
        calls = record.tool_calls if native else calls_in_text(record.reply)
    except ReplyError as error:
        return (), with_complaint(record, str(error))
    said = Message(role="assistant", text=record.reply)
    nudge = Message(role="user", text=render("measuring_no_call"))
    return calls, () if calls else (*record.question.messages, said, nudge)
