"""The tools of a session: every call is recorded, a repeated call returns its record, and a budget limits the calls."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from aidsr.core.calls import ToolCall, ToolSpec
from aidsr.core.errors import IsolationError, MjcfError, UserError
from aidsr.mjcf.kept_parts import changes_in_words, changes_to_kept_parts
from aidsr.runs.files import JsonFile
from aidsr.teams.measuring.exploration import HOPELESS, VALIDATE, Exploration, seeds_of
from aidsr.teams.measuring.own_tools import OWN_TOOLS, READ, has_families
from aidsr.teams.measuring.records import FREE, TOOLS_FOLDER, ToolRecord, recorded_calls
from aidsr.tools import TOOLS, Result, Tool, Workspace

_FEWEST_SEEDS, _FEWEST_VARIATIONS = 2, 3
"""Minimum number of probe seeds, or of variations of a played script, with which a scene has to be measured again
before it can be the result. Our choice."""
MAKES: dict[str, Literal["robot", "scene"]] = {
    "validate": "robot",
    "edit": "robot",
    "fix": "robot",
    "assemble": "scene",
}
"""Tools that make a robot or a scene, with what they make."""
_OF_AN_OWNER = ("task", "level", "realizable")
"""Arguments that are of no use to a team, which works for one job."""


@dataclass(frozen=True)
class ToolBudget:
    """Limits for the use of tools in a session: number of calls, and their total duration [min]."""

    calls: int
    minutes: float


@dataclass
class Toolbox:
    """The tools of one session.

    Attributes:
        workspace: Workspace with the robots and scenes.
        folder: Folder whose subfolder "tools" has the recorded calls.
        budget: Limits for the calls.
        pictures: Whether the model accepts pictures; if not, it has no tool that draws.
        explore: Whether a body of each family has to be measured before one is refined; False to repair a robot.
        clock: Time source [s].
    """

    workspace: Workspace
    folder: Path
    budget: ToolBudget
    pictures: bool = False
    explore: bool = True
    clock: Callable[[], float] = time.monotonic
    _records: list[ToolRecord] = field(default_factory=list)
    _unused: list[ToolRecord] = field(default_factory=list)
    """Records of an interrupted or replayed session that no call of this process has used yet."""

    def __post_init__(self) -> None:
        self._records = recorded_calls(self.folder)
        self._unused = list(self._records)

    def remove_unrecorded(self, kept: Collection[str] = ()) -> None:
        """Remove robots and scenes that no recorded call made: those of a call that was interrupted.

        The call is carried out again; it and all later ones then make the names that they would have made.

        Args:
            kept: Names that no call made.
        """
        self.workspace.remove_except({*kept, *(record.named for record in self._records)})

    @property
    def tools(self) -> dict[str, Tool]:
        """The tools by name, in the order in which the model sees them."""
        propose, *others = OWN_TOOLS.values()
        here = {tool.name: tool for tool in (VALIDATE, READ)}
        known = {propose.name: propose, **TOOLS, **here, **{tool.name: tool for tool in others}}
        return {name: tool for name, tool in known.items() if self.pictures or name != "look"}

    @property
    def specs(self) -> tuple[ToolSpec, ...]:
        """The tools as they are described to the model."""
        return tuple(
            ToolSpec(name=tool.name, description=tool.description, parameters=_of_a_team(tool.schema))
            for tool in self.tools.values()
        )

    @property
    def has_unused_records(self) -> bool:
        """Whether there are records of an interrupted or replayed session that no call of this process used yet."""
        return bool(self._unused)

    @property
    def calls_made(self) -> int:
        """Number of calls that count towards the budget."""
        return sum(record.counts for record in self._records)

    @property
    def minutes_used(self) -> float:
        """Total duration of the calls [min]."""
        return sum(record.seconds for record in self._records) / 60

    def call(self, call: ToolCall) -> ToolRecord:
        """Carry out a call and record it, or return the record of the same call before.

        A mistake in a call is a result as well. If the call should have made a robot or a scene, its name is used up,
        so that later calls of the reply make the names that the model expects. A resumed session first uses the records
        of the interrupted session, each once; after that, a call that was carried out before is not carried out again.
        """
        known = [record for record in self._unused if (record.name, record.arguments) == (call.name, call.arguments)]
        if known:
            self._unused.remove(known[0])
            return known[0]
        for record in self._records:
            same = (record.name, record.arguments) == (call.name, call.arguments)
            if same and record.outcome != "refused" and record.name not in OWN_TOOLS:
                return record
        self._unused.clear()  # a new call: from here on the conversation is another one than the recorded one
        record = self._carried_out(call)
        if call.name in MAKES and not record.made:
            unmade = self.workspace.skip(MAKES[call.name])
            record = record.model_copy(
                update={"text": f"{record.text}\n{unmade} does not exist: this call made nothing"}
            )
        number = len(self._records) + 1
        name = call.name if call.name in self.tools else "unknown"
        JsonFile(self.folder / TOOLS_FOLDER / f"{number:04d}_{name}.json", ToolRecord).write(record)
        self._records.append(record)
        return record

    def _carried_out(self, call: ToolCall) -> ToolRecord:
        def record(outcome: Literal["done", "failed", "refused"], text: str, found: Result | None = None) -> ToolRecord:
            seconds = round(self.clock() - began, 3)
            return ToolRecord(
                name=call.name,
                arguments=call.arguments,
                text=text,
                pictures=found.pictures if found else (),
                outcome=outcome,
                seconds=seconds,
                figures=found.figures if found else {},
            )

        began = self.clock()
        tool = self.tools.get(call.name)
        if tool is None:
            return record("refused", f"no tool {call.name!r}; tools: {', '.join(self.tools)}")
        try:
            arguments = json.loads(call.arguments or "{}")
        except (ValueError, RecursionError) as error:
            return record("refused", f"not carried out: the arguments are no JSON: {error}")
        if not isinstance(arguments, dict):
            return record("refused", "not carried out: the arguments are no JSON object")
        if reason := self._refused(call.name, arguments):
            return record("refused", f"not carried out: {reason}")
        try:
            result = tool.call(self.workspace, arguments)
        except (UserError, MjcfError, IsolationError) as error:
            return record("failed", f"failed: {error}")
        return record("done", result.text, result)

    def _refused(self, name: str, arguments: dict[str, Any]) -> str:
        """Return why a call is not carried out now; "" if it is."""
        named = (str(arguments.get(key, "")) for key in ("subject", "scene", "robot"))
        if unmade := next(filter(self.workspace.is_skipped, named), ""):
            return f"{unmade} does not exist: the call that was to make it made nothing"
        if name != "propose" and not has_families(self.workspace):
            return "propose families of bodies first"
        if name not in FREE and self.spent:
            return f"{self.spent}: finish with the best scene"
        if reason := self._too_early(name, arguments):
            return reason
        if name == "assemble" and (changes := self._changes_to_kept_parts(str(arguments.get("robot", "")))):
            return f"{changes} Restore what is to be kept, then assemble it"
        scene = arguments.get("scene")
        if name == "finish" and scene and not self.spent and not self._measured_again(scene):
            return (
                f"{scene} was not measured again: probe it with {_FEWEST_SEEDS} seeds or more, play a script in "
                f"{_FEWEST_VARIATIONS} variations or more, or train it; then finish"
            )
        if name == "finish" and scene and (better := self.exploration.better_than(str(scene))):
            return f"{better}: finish with the better one, or measure both by more seeds"
        return ""

    def _changes_to_kept_parts(self, robot: str) -> str:
        """Return the changes of a robot to parts that a person wants to keep, so that no scene has them; "" if none."""
        job = self.workspace.job
        if job is None or not job.brief.keep:
            return ""
        try:
            mjcf = self.workspace.mjcf(robot)
            return changes_in_words(changes_to_kept_parts(job.brief.starting_robot, mjcf, job.brief.keep))
        except (UserError, MjcfError, IsolationError):  # the tool itself says what is wrong with the robot
            return ""

    def _too_early(self, name: str, arguments: dict[str, Any]) -> str:
        """Return why it is too early to refine, train or finish with a body: families are unmeasured; "" if not."""
        if not self.explore or self.spent:
            return ""
        left = self.exploration.unmeasured()
        refines = name == "edit" and str(arguments.get("robot")) in self.exploration.measured()
        ends = name == "finish" and bool(arguments.get("scene"))
        if not left or not (refines or ends or name in ("sweep", "train")):
            return ""
        return (
            f"measure a body of each family before one is refined, trained or finished with; not yet: "
            f"{', '.join(left)} (a family of which {HOPELESS} robots came to no measurement counts as measured)"
        )

    @property
    def exploration(self) -> Exploration:
        """Families and scenes, derived from the calls so far."""
        return Exploration(tuple(self._records), self.workspace)

    @property
    def spent(self) -> str:
        """Clause that says which part of the budget is used up; "" while none is."""
        if self.calls_made >= self.budget.calls:
            return f"all {self.budget.calls} calls are used"
        return f"all {self.budget.minutes:g} minutes are used" if self.minutes_used >= self.budget.minutes else ""

    def _measured_again(self, scene: object) -> bool:
        """Whether a scene was measured with several seeds or variations, or trained."""
        about = [record for record in self.exploration.done if record.values.get("scene") == scene]
        seeds = {seed for record in about if record.name == "probe" for seed in seeds_of(record)}
        played = [record.values for record in about if record.name == "play"]
        variations = {one for each in played for one in each.get("variations") or [each.get("variation", 0)]}
        trained = any(record.name == "train" for record in about)
        return trained or len(seeds) >= _FEWEST_SEEDS or len(variations) >= _FEWEST_VARIATIONS


def _of_a_team(schema: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a tool's arguments without those that are of no use to a team, see `_OF_AN_OWNER`."""
    kept = {key: one for key, one in schema["properties"].items() if key not in _OF_AN_OWNER}
    used: dict[str, Any] = _short({**schema, "properties": kept})
    return used


def _short(value: Any) -> Any:
    """Return a part of a schema without entries that are of no use to a model: each question repeats the schemas."""
    if isinstance(value, dict):
        # a title repeats the name, a maximum length is never reached, the fields of an object have their own defaults
        idle = {"title": str, "maxLength": int, "default": dict}
        return {key: _short(one) for key, one in value.items() if not isinstance(one, idle.get(key, ()))}
    return [_short(one) for one in value] if isinstance(value, list) else value
