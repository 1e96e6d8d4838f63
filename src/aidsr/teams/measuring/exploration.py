"""State of the exploration: the family of each body, the families measured so far, and the best measured scene.

It is derived from the recorded calls alone, so a session resumed after an interruption has the same state.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Annotated, Any

from pydantic import Field, create_model

from aidsr.core.artifacts import SUCCESSFUL_SHARE
from aidsr.core.errors import UserError
from aidsr.core.formatting import excerpt
from aidsr.teams.measuring.own_tools import family_names, proposed_families
from aidsr.teams.measuring.records import MEASURES, ToolRecord
from aidsr.tools import TOOLS, Result, Tool, Workspace
from aidsr.tools.probing import MEAN_PROGRESS

HOPELESS = 3
"""Number of robots without a measurement after which a family need not be measured. Our choice: a first robot and two
attempts to repair it."""
_BETTER = 0.05
"""Difference in progress above which another scene counts as better. Our choice: below the spread over seeds."""


def _validate(workspace: Workspace, *, family: str, **arguments: Any) -> Result:
    """Validate a robot of one of the proposed families."""
    known = family_names(each.name for each in proposed_families(workspace))
    if family.strip().lower() not in known:
        raise UserError(
            f'no family "{excerpt(family)}" was proposed; families: {", ".join(known)}; propose again to add one'
        )
    return TOOLS["validate"].function(workspace, **arguments)


_FAMILY: dict[str, Any] = {
    "family": (Annotated[str, Field(description="Which of the proposed families it is of.")], ...)
}
VALIDATE = Tool(
    "validate",
    TOOLS["validate"].description,
    create_model("validate", __base__=TOOLS["validate"].arguments, **_FAMILY),
    _validate,
)
"""The tool `validate` with an additional argument: this team has to state the family of a robot."""


@dataclass(frozen=True)
class Exploration:
    """Families and scenes of a session, derived from its recorded calls."""

    records: Sequence[ToolRecord]
    workspace: Workspace

    @property
    def done(self) -> list[ToolRecord]:
        """Records of the calls that were carried out."""
        return [record for record in self.records if record.outcome == "done"]

    def families(self) -> dict[str, str]:
        """Return the family of each robot and scene, by its name; robots that were not validated here have none."""
        found: dict[str, str] = {}
        for record in self.done:
            if record.name == "validate":
                found[record.made] = str(record.values.get("family", "")).strip().lower()
            elif record.name in ("edit", "fix", "assemble") and record.values.get("robot") in found:
                found[record.made] = found[record.values["robot"]]
        return found

    def measured(self) -> set[str]:
        """Return the names of the robots and scenes that were measured, and of the robots of these scenes."""
        robots = {record.made: str(record.values["robot"]) for record in self.done if record.name == "assemble"}
        found = {
            str(record.values.get("scene") or record.values.get("subject"))
            for record in self.done
            if record.name in MEASURES
        }
        return found | {robots[name] for name in found if name in robots}

    def proposed(self) -> list[str]:
        """Return the families of the last proposal, in lower case; empty before the first proposal."""
        asked = next((record.values["families"] for record in reversed(self.done) if record.name == "propose"), ())
        return family_names(str(family["name"]) for family in asked)

    def unmeasured(self) -> list[str]:
        """Return the proposed families without a measured body, except those with `HOPELESS` or more robots."""
        families, measured = self.families(), self.measured()
        there = {families.get(name, "") for name in measured}
        made = [family for name, family in families.items() if name.startswith("robot")]
        return [family for family in self.proposed() if family not in there and made.count(family) < HOPELESS]

    def progress_again(self, scene: str) -> float | None:
        """Return the mean progress of a scene over the seeds of its probes; None for fewer than two seeds."""
        about = [record for record in self.done if record.name == "probe" and record.values.get("scene") == scene]
        probes = [record for record in about if MEAN_PROGRESS in record.figures]
        if len({seed for record in probes for seed in seeds_of(record)}) < 2:
            return None
        return fmean([record.figures[MEAN_PROGRESS] for record in probes], [len(seeds_of(record)) for record in probes])

    def best_again(self) -> tuple[str, float] | None:
        """Return the stable scene with the most progress over several seeds, and this progress; None without one."""
        scenes = dict.fromkeys(str(record.values.get("scene")) for record in self.done if record.name == "probe")
        stable = [scene for scene in scenes if self.workspace.record(scene).stable]
        found = [(scene, far) for scene in stable if (far := self.progress_again(scene)) is not None]
        return max(found, key=lambda one: one[1], default=None)

    def better_than(self, scene: str) -> str:
        """Return a clause that says which other scene is better; "" if none is.

        A scene that was only played or trained is compared by the most progress that it came to.
        """
        again, best = self.progress_again(scene), self.best_again()
        own = self._farthest(scene) if again is None else again
        if own is None or best is None or best[1] <= own + _BETTER:
            return ""
        how = "" if again is not None else ", by what was measured of it,"
        return f"over several seeds {best[0]} came to progress {best[1]:.2f} and {scene}{how} to {own:.2f}"

    def _farthest(self, scene: str) -> float | None:
        """Return the most progress of a scene in any measurement; None without one."""
        about = (record.progress for record in self.done if record.values.get("scene") == scene)
        return max((progress for progress in about if progress is not None), default=None)

    def script_for(self, scene: str) -> str:
        """Return the script with which a training of a scene should start.

        It is the script, played or used in a training, with the highest expected share of won episodes. Empty if that
        share is less than a half, or if a training without a script has a higher one.
        """
        tried = [one for one in self.done if one.values.get("scene") == scene and one.name in ("play", "train")]
        about = [one for one in tried if "success" in one.figures]
        found = [(_expected_share(one), str(one.values.get("script", ""))) for one in reversed(about)]
        share, script = max(found, key=lambda one: one[0], default=(0.0, ""))
        return script if share >= SUCCESSFUL_SHARE else ""

    def succeeded(self) -> tuple[str, str] | None:
        """Return the first stable scene whose training succeeded, and the first line of its result; None if none."""
        for record in self.done:
            won = record.figures.get("success", 0.0) >= SUCCESSFUL_SHARE and record.figures.get("valid", 0.0)
            if record.name == "train" and won and self.workspace.record(record.values["scene"]).stable:
                return str(record.values["scene"]), record.text.partition("\n")[0]
        return None


def _expected_share(record: ToolRecord) -> float:
    """Return the expected share of won episodes among further ones; a result over few episodes has less weight.

    Source: Laplace's rule of succession.
    """
    episodes = record.figures.get("episodes", 1.0)
    return (record.figures["success"] * episodes + 1.0) / (episodes + 2.0)


def seeds_of(record: ToolRecord) -> Sequence[int]:
    """Return the seeds of a probe: those given, or the default of the tool."""
    seeds: Sequence[int] = record.values.get("seeds", TOOLS["probe"].arguments.model_fields["seeds"].default)
    return seeds
