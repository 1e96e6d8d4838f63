"""What was asked of a run: the content of run.json, written before anything else happens and never changed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from aidsr.core.artifacts import Artifact

__all__ = ["Budget", "Method", "RunConfig", "RunRecord"]


Method = Literal[
    "full", "no_judge", "no_integrator", "no_judge_or_integrator", "no_validation", "no_feedback", "direct"
]
"""What of the method is left out; "no_feedback" is neither validation nor Judge, "direct" is one call that is told the
job."""


class Budget(Artifact):
    """What a run may use of a language model. None means without a limit."""

    tokens: Annotated[int | None, Field(ge=1)] = None
    """Tokens in and out, of all calls of the run."""
    cost_usd: Annotated[float | None, Field(gt=0)] = None
    tokens_per_design: Annotated[int | None, Field(ge=1)] = None
    """The same for one design, its share of the Designer's first call included."""
    cost_per_design_usd: Annotated[float | None, Field(gt=0)] = None

    @property
    def limits_cost(self) -> bool:
        """Whether money is limited, for which prices must be known."""
        return self.cost_usd is not None or self.cost_per_design_usd is not None


class RunConfig(Artifact):
    """Everything that steers the loop. The defaults are the paper's values where the paper names one."""

    model: str = "builtin"
    """Who plays the four roles: "builtin" for the rules, or the name of a language model. Never holds a key."""
    method: Method = "full"
    """What of the method is left out, to measure what it is worth."""
    concepts: Annotated[int, Field(ge=1, le=20)] = 3
    """How many concepts the Designer proposes; each grows into one design. Source: AID-SR, three concepts."""
    iterations: Annotated[int, Field(ge=0, le=100)] = 8
    """Repairs allowed after the first attempt, per concept and round. Source: AID-SR, eight iterations."""
    max_output_tokens: Annotated[int, Field(ge=256)] = 20_000
    """Cap on the output of one call, reasoning included. Source: AID-SR, 20,000 tokens."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the built-in rules; the same seed gives the same MJCF."""
    repairs: bool = True
    """Whether code puts right what can mean only one thing in a robot, before it is validated."""
    early_stop: bool = True
    """Whether a design ends when a role is asked for the same again and nothing got better. The paper's method has no
    such rule: studies of it switch it off."""
    search_robots: Annotated[int, Field(ge=8, le=8000, multiple_of=8)] = 32
    """Robots tried for each design by the baseline that searches, in generations of eight. Our choice: minutes of one
    core."""
    judge_pictures: bool = False
    """Whether the Judge is shown rendered pictures of the scene; only for a model that takes images."""
    task_feedback: bool = False
    """Whether a scene that the Judge passed is tried on its task, and goes back when it falls short. The paper names
    this as missing from its method."""
    task_rounds: Annotated[int, Field(ge=1, le=10)] = 2
    """How often a design may go back for that, each time with all its iterations. Our choice."""
    task_training: Annotated[int, Field(ge=0)] = 0
    """Control steps of a policy's training whose result is told beside that trial; 0 trains none."""
    budget: Budget = Budget()
    """As asked for at first; a person may give a larger one later."""
    human: bool = False
    """Whether a person answers each judged scene before it counts as approved."""
    feedback: str = ""
    """What a person said beforehand to the first scene of each design that the Judge passed; the next one is approved.
    Only in studies, where nobody sits in front of each run."""


class RunRecord(Artifact):
    """The identity of a run."""

    objective: str
    task: str = ""
    """Name of the benchmark task; empty for an objective in the user's own words."""
    level: Literal["", "standard", "hard"] = ""
    """Level of the task; empty without one."""
    config: RunConfig
    started: str
    """ISO 8601 with zone."""
    versions: dict[str, str]
    """Versions of AID-SR, Python and the libraries that shape a result."""
