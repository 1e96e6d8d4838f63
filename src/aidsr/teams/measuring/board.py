"""The board: the summary of the work so far that each question to the model contains.

If each question repeated the whole conversation, the cost would grow with the square of its length. So each question
has the job, the last reply with its results, and a board: every body with its best figures, and the MJCF of those in
work. Nothing is lost by that: the tool `read` shows the MJCF of every body, and a repeated call returns its recorded
result and is not counted.

The board depends only on the exchanges so far, so a session resumed after an interruption asks the same questions.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from aidsr.core.calls import Message, ToolCall, ToolOutput
from aidsr.core.formatting import excerpt
from aidsr.mjcf.condense import condense
from aidsr.teams.llm.prompts import render
from aidsr.teams.measuring.calls import calls_as_text, results_as_text
from aidsr.teams.measuring.exploration import Exploration
from aidsr.teams.measuring.records import MEASURES, Exchange, ToolRecord
from aidsr.teams.measuring.toolbox import Toolbox

IN_FULL = 1
"""Number of last exchanges that are shown in full. Our choice: a second one costs a tenth more, and the board has its
results in one line each."""
_MOST_DOCUMENTS = 2
"""Maximum number of MJCF documents on the board. Our choice: the best body, and the one that is being changed."""
_LINE, _NOTE, _SCRIPT = 150, 300, 400
"""Maximum lengths of a result, of a note and of a script on the board [characters]. Our choice."""
_MOST_LINES = 8
"""Maximum number of older results of one body. Our choice."""
_INDENT = re.compile(r"\n\s+")


@dataclass(frozen=True)
class Board:
    """The summary of the exchanges of a session.

    Attributes:
        exchanges: Exchanges so far, in order.
        toolbox: Tools of the session, with its budget and the workspace that has the bodies.
        native: Whether calls and results have their own fields in a message; otherwise they are text.
    """

    exchanges: Sequence[Exchange]
    toolbox: Toolbox
    native: bool

    def turns(self) -> tuple[Message, ...]:
        """Return the messages that follow the job: the last exchanges, with the board after the last results."""
        turns: list[Message] = []
        for exchange in self.exchanges[-IN_FULL:]:
            board = self.text() if exchange is self.exchanges[-1] else ""
            turns += [self._said(exchange), self._brought(exchange, board)]
        return tuple(turns)

    def text(self) -> str:
        """Return the text of the board."""
        return render(
            "measuring_board",
            calls=sum(record.counts for record in self._records),
            most_calls=self.toolbox.budget.calls,
            # not the minutes used: a replay takes a different time for the same work, and prompts must be the same
            is_late=sum(record.seconds for record in self._records) > 30 * self.toolbox.budget.minutes,
            most_minutes=f"{self.toolbox.budget.minutes:g}",
            unmeasured=self._exploration.unmeasured() if self.toolbox.explore else [],
            kept=self._kept,
            notes=self._notes(),
            bodies=[self._body(name) for name in self._robots],
            documents=[(name, self._document(name)) for name in self.worked_on()],
        )

    def worked_on(self) -> tuple[str, ...]:
        """Return the robots of the last reply whose MJCF is shown: faulty ones, the last one made or used, the best.

        The last one is left out if the reply made or used several without a best one, or more than two: then it is just
        the last of a list. A robot is also left out if another one of these was made from it.
        """
        if not self.exchanges:
            return ()
        last = [one for one in self.exchanges[-1].results if one.outcome == "done"]
        faulty = [one.made for one in last if one.made in self._robots and ": stable" not in one.headline]
        ahead = self._kept or self._best(self._done)
        leading = self._robot_of(ahead.subject) if ahead else ""
        touched = [name for one in reversed(last) if (name := self._robot_of(one.made or one.subject))]
        changed = touched[:1] if len(set(touched)) <= (_MOST_DOCUMENTS if leading else 1) else []
        found = list(dict.fromkeys((*faulty, *changed, *([leading] if leading in touched else []))))
        told = [name for name in found if not any(name in self._ancestors(other) for other in found)]
        return tuple(told[:_MOST_DOCUMENTS])

    def _ancestors(self, robot: str) -> set[str]:
        """Return the robots from which a robot was made by edits and fixes."""
        found: set[str] = set()
        for one in reversed(self._done):
            if one.name in ("edit", "fix") and one.made in {robot, *found}:
                found.add(one.subject)
        return found

    def _document(self, robot: str) -> str:
        """Return the MJCF of a robot, condensed if possible, without indents."""
        mjcf = self.toolbox.workspace.mjcf(robot)
        return _INDENT.sub("\n", (condense(mjcf) or mjcf).strip())

    @property
    def explores(self) -> bool:
        """Whether the model still has to write bodies from scratch, as complete MJCF documents."""
        proposed = bool(self._exploration.proposed())
        return not self.exchanges or (self.toolbox.explore and (not proposed or bool(self._exploration.unmeasured())))

    @property
    def _kept(self) -> ToolRecord | None:
        """Record of the last call that kept a scene; None if there is none."""
        return next((one for one in reversed(self._done) if one.name == "keep"), None)

    @staticmethod
    def _best(results: Sequence[ToolRecord]) -> ToolRecord | None:
        """Return the measurement with the most progress, the last one of equal ones; None if none has a progress."""
        far = [one for one in reversed(results) if one.progress is not None]
        return max(far, key=lambda one: one.progress or 0.0, default=None)

    @cached_property
    def _records(self) -> list[ToolRecord]:
        """Results so far; a result that was returned again is listed once."""
        every = (record for exchange in self.exchanges for record in exchange.results)
        return list({id(record): record for record in every}.values())

    @cached_property
    def _done(self) -> list[ToolRecord]:
        return [record for record in self._records if record.outcome == "done"]

    @cached_property
    def _exploration(self) -> Exploration:
        return Exploration(tuple(self._records), self.toolbox.workspace)

    @cached_property
    def _robots(self) -> list[str]:
        """Robots in the order in which they were made."""
        return [one.made for one in self._done if one.made.startswith("robot_")]

    @cached_property
    def _in_full(self) -> set[int]:
        """Identities (`id`) of the results in the exchanges that are shown in full."""
        return {id(record) for exchange in self.exchanges[-IN_FULL:] for record in exchange.results}

    def _robot_of(self, name: str) -> str:
        """Return the robot of a scene, or the name itself if it is a robot's; "" for anything else."""
        if name.startswith("robot_"):
            return name
        return next((str(one.values.get("robot")) for one in self._done if name and one.made == name), "")

    def _notes(self) -> list[str]:
        """Return the texts beside the calls in the exchanges that are not shown in full, shortened."""
        older = (" ".join(exchange.said.split()) for exchange in self.exchanges[:-IN_FULL])
        return [excerpt(said, _NOTE) for said in older if said]

    def _body(self, robot: str) -> str:
        """Return the lines of a body, with its best measurement.

        A robot of `worked_on`, or one from which such a robot was made, has its last measurements as well.
        """
        made = next(one for one in self._done if one.made == robot)
        scenes = [one for one in self._done if one.name == "assemble" and one.values.get("robot") == robot]
        family = self._exploration.families().get(robot, "")
        at_work = robot in self.worked_on()
        size = next((line for line in made.text.splitlines() if at_work and line.startswith("length ")), "")
        lines = [f"- {robot}" + f" ({family})" * bool(family) + f": {_rest(made.headline)}" + f"; {size}" * bool(size)]
        if scenes:
            placed = (f"{one.made} {_rest(one.headline).partition(';')[0]}" for one in scenes)
            lines[0] += f"; placed as {', '.join(placed)}"
        about = [one for one in self._done if one.name in MEASURES and self._robot_of(one.subject) == robot]
        older = [one for one in about if id(one) not in self._in_full]
        best = self._best(about)
        line_of_work = at_work or any(robot in self._ancestors(name) for name in self.worked_on())
        last = older[-_MOST_LINES:] if line_of_work else []
        told = [one for one in older if one is best or any(one is each for each in last)]
        lines += [f"  - {self._line(one, best)}" for one in told]
        more = len(older) - len(told)
        return "\n".join([*lines, *([f"  - and {more} other results"] if more else [])])

    def _line(self, one: ToolRecord, best: ToolRecord | None) -> str:
        """Return a call and its result in one line; for the best result with its script."""
        line = f"{one.name} {_brief(one)}: {excerpt(one.headline, _LINE)}"
        script = str(one.values.get("script", "")) if one is best else ""
        return line + f"; script: {excerpt(' / '.join(script.splitlines()), _SCRIPT)}" * bool(script)

    def _said(self, exchange: Exchange) -> Message:
        """Return a reply as a message, unchanged except that MJCF stored under a name is left out."""
        calls = tuple(_without_kept(*pair) for pair in zip(exchange.calls, exchange.results, strict=True))
        if self.native:
            return Message(role="assistant", text=exchange.said, tool_calls=calls)
        return Message(role="assistant", text="\n\n".join(filter(None, (exchange.said, calls_as_text(calls)))))

    def _brought(self, exchange: Exchange, board: str) -> Message:
        """Return the results of a reply as the next message, with their pictures and the board."""
        pairs = zip(exchange.calls, exchange.results, strict=True)
        outputs = tuple(ToolOutput(id=call.id, name=call.name, text=one.text) for call, one in pairs)
        pictures = tuple(png for one in exchange.results for png in one.pictures)
        if not self.native:
            text = "\n\n".join(filter(None, (results_as_text(outputs), board)))
            return Message(role="user", text=text, pictures=pictures)
        shown = "The pictures of these results, in order." if pictures else ""
        text = "\n\n".join(filter(None, (board, shown)))
        return Message(role="user", text=text, pictures=pictures, tool_outputs=outputs)


def _without_kept(call: ToolCall, result: ToolRecord) -> ToolCall:
    """Return a call without its MJCF if that is stored under a name."""
    if not result.made or not isinstance(result.values.get("mjcf"), str):
        return call
    short = {**result.values, "mjcf": f"(kept as {result.made})"}
    return call.model_copy(update={"arguments": json.dumps(short, ensure_ascii=False)})


def _rest(headline: str) -> str:
    """Return a headline without the name that it begins with."""
    return headline.partition(": ")[2]


def _brief(one: ToolRecord) -> str:
    """Return the main arguments of a measurement as a short text."""
    values = one.values
    how: dict[str, Any] = values.get("how") or {}
    varied = f"{values.get('attribute', '')} of {values.get('select', '')}" if values.get("attribute") else ""
    seeds, variations = values.get("seeds"), values.get("variations") or how.get("variations")
    parts: Iterable[str] = (
        str(values.get("what", "")),
        one.subject,
        varied,
        f"seeds {seeds}" * bool(seeds),
        f"variations {variations}" * bool(variations),
        f"{values['steps']} steps" if one.name == "train" and values.get("steps") else "",
    )
    return " ".join(part for part in parts if part)
