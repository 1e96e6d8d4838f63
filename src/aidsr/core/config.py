"""`RunConfig`: the single definition of every setting of a run, used by the API, command line, web app and studies.

To add a setting, add a field. Its description becomes the help text of the command line and its title the label in the
web app; its bounds apply everywhere; its default is used for files written before the setting existed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, ValidationError
from pydantic.fields import FieldInfo

from aidsr.core.artifacts import Artifact
from aidsr.core.errors import UserError
from aidsr.core.suggestions import closest_name

BUILTIN = "builtin"
"""Model name of the built-in rules, which are not a language model, need no API key and cost nothing."""

BUDGET_STEPS = 300_000
"""Control steps of a training, the same for every design and task. Source: docs/tasks.md, how a design is scored."""

VERDICT_EPISODES = 100
"""Number of episodes of a verdict. Source: docs/tasks.md, how a design is scored: at a share of one half the confidence
interval is 40 to 60 %."""

LEAST_EPISODES = 20
"""Minimum number of episodes of an evaluation; enough for feedback to designers. At a share of one half the confidence
interval is 30 to 70 %."""

PROMISING_SHARE = 0.3
"""Smallest share of successes of a short training that lets a scene pass.

Our choice, by the learning curves of benchmarks/learning: after 30,000 steps the scenes whose training ends below 50 %
had at most 20 %, those whose training ends above it at least 40 %. How well it tells other designs is measured in
benchmarks/trial.
"""

STUDY_ONLY = "study only"
"""Marker of a field that only studies and scripts set; the command line and the web app do not offer it."""

Method = Literal[
    "full", "no_judge", "no_integrator", "no_judge_or_integrator", "no_validation", "no_feedback", "direct"
]
"""The full method, or an ablation: "no_feedback" has neither validation nor Judge; "direct" is a single model call."""

StudyMethod = Literal[
    "full",
    "human",
    "human_only",
    "no_judge",
    "no_integrator",
    "no_judge_or_integrator",
    "no_validation",
    "direct",
    "no_repairs",
    "no_groups",
    "from_probe",
    "task_feedback",
    "measuring",
]
"""Methods that a study can compare.

From the paper: the full method ("full"); with a person's feedback as an additional round on the same designs ("human")
or as the only feedback ("human_only"); and ablations ("no_judge", "no_integrator", "no_judge_or_integrator",
"no_validation", "direct"). Additional: without automatic fixes ("no_repairs"), without actuator groups
("no_groups"), with training from a probed motion ("from_probe"), with feedback from the task ("task_feedback"), and
with one model that measures instead of the four roles ("measuring")."""

Protocol = Literal["best", "paper"]
"""How a policy is trained, see `aidsr.learn.rl.recipe.PROTOCOLS`. "best" is soft actor-critic with held actions;
studies, tables and the benchmark use it. "paper" is PPO, for comparison with published results and old study plans."""


Kind = TypeVar("Kind", bound=Artifact)


class Budget(Artifact):
    """Limits on a run's use of language models; None: no limit. A call that might exceed one is not made."""

    tokens: Annotated[
        int | None,
        Field(
            ge=1,
            title="Maximum tokens of the run",
            description="Maximum tokens of the run, input and output together.",
        ),
    ] = None
    cost_usd: Annotated[
        float | None,
        Field(
            gt=0,
            title="Maximum cost of the run [USD]",
            description="Maximum cost of the run in dollars; the price of the model must be known.",
        ),
    ] = None
    tokens_per_design: Annotated[
        int | None,
        Field(
            ge=1,
            title="Maximum tokens per design",
            description="Maximum tokens of one design, input and output together.",
        ),
    ] = None
    cost_per_design_usd: Annotated[
        float | None,
        Field(
            gt=0,
            title="Maximum cost per design [USD]",
            description="Maximum cost of one design in dollars, including its share of the Designer's first call.",
        ),
    ] = None

    @property
    def limits_cost(self) -> bool:
        """Whether cost is limited, which requires known prices."""
        return self.cost_usd is not None or self.cost_per_design_usd is not None


class RunConfig(Artifact):
    """All settings of a run. The defaults are those of the paper where the paper gives one.

        config = aidsr.RunConfig(concepts=5, seed=1)
        run = aidsr.design(task="gap", config=config)
        run = aidsr.design(task="gap", concepts=5, seed=1)  # the same

    Raises:
        ValidationError: A value is out of bounds, or a setting does not exist.
    """

    model: Annotated[
        str,
        Field(
            title="Model",
            description='Who designs: "builtin" for the built-in rules, which need no API key, or a language model, '
            "for example openai:gpt-5, anthropic:…, google:…, openrouter:…, ollama:…, or MODEL@URL for a compatible "
            "server; manual:DIRECTORY to answer prompts in files, replay:RUN to reuse recorded replies. No API is "
            "called unless you name a model.",
        ),
    ] = BUILTIN
    """Never holds a key."""
    method: Annotated[
        Method, STUDY_ONLY, Field(description="The full method, or an ablation that leaves part of it out.")
    ] = "full"
    concepts: Annotated[
        int,
        Field(
            ge=1,
            le=20,
            title="Number of concepts",
            description="Number of concepts, which are designed in parallel.",
        ),
    ] = 3
    """Source: AID-SR, three concepts."""
    iterations: Annotated[
        int,
        Field(
            ge=0,
            le=100,
            title="Maximum iterations after the first",
            description="Maximum number of iterations after the first, per concept and round.",
        ),
    ] = 8
    """Source: AID-SR, eight iterations."""
    max_output_tokens: Annotated[
        int,
        Field(
            ge=256,
            title="Maximum output tokens per call",
            description="Maximum output tokens of one call to a language model, including reasoning.",
        ),
    ] = 20_000
    """Source: AID-SR, 20,000 tokens."""
    seed: Annotated[
        int,
        Field(
            ge=0,
            title="Seed of the built-in rules",
            description="Seed of the built-in rules; the same seed gives the same robots.",
        ),
    ] = 0
    repairs: Annotated[
        bool,
        Field(
            title="Fix unambiguous mistakes automatically",
            description="Fix unambiguous mistakes of a robot automatically before it is validated, without a call to a "
            "model and without an iteration.",
        ),
    ] = True
    early_stop: Annotated[
        bool,
        Field(
            title="Stop early without improvement",
            description="Stop a design when a role gets the same request again and nothing has improved.",
        ),
    ] = True
    """The paper's method has no such rule; studies of that method switch it off."""
    search_robots: Annotated[
        int,
        STUDY_ONLY,
        Field(
            ge=8,
            le=8000,
            multiple_of=8,
            description='Number of robots that the baseline "search" tries for each design, in generations of eight; '
            "each robot takes seconds on one core.",
        ),
    ] = 32
    """Our choice: takes minutes on one core."""
    judge_pictures: Annotated[
        bool,
        Field(
            title="Show pictures to the Judge",
            description="Show the Judge pictures of the scene, and let the measuring team request pictures; only for "
            "models that accept images.",
        ),
    ] = False
    task_feedback: Annotated[
        bool,
        Field(
            title="Task feedback: try each stable scene on its task",
            description="Try each stable scene on its task with open-loop motions, show the result to the Judge, and "
            "send a scene that falls short back to the responsible role; requires a task or a goal.",
        ),
    ] = False
    """The paper states that its method lacks this."""
    task_rounds: Annotated[
        int,
        Field(
            ge=1,
            le=10,
            title="Task feedback rounds",
            description="Maximum number of times that task feedback sends a design back, each time with all its "
            "iterations.",
        ),
    ] = 2
    """Our choice."""
    task_training: Annotated[
        int,
        Field(
            ge=0,
            title="Task feedback training steps (0: none)",
            description="Control steps of a policy that task feedback trains if no motion succeeds; the scene passes "
            f"if the policy wins {100 * PROMISING_SHARE:g} % of {LEAST_EPISODES} variations, in a valid way. 0 trains "
            'none. Requires task feedback and the extra "rl".',
        ),
    ] = 0
    budget: Annotated[Budget, Field(description="Limits of tokens and cost of a model.")] = Budget()
    """Budget at the start of the run; a later one may replace it, see `aidsr.resume`."""
    team: Annotated[
        Literal["four_roles", "measuring"],
        Field(
            title="Team",
            description="The four roles of the paper, or one model that makes robots and measures them with tools "
            "until one does the task; see docs/designing.md.",
        ),
    ] = "four_roles"
    tool_calls: Annotated[
        int,
        Field(
            ge=4,
            le=1000,
            title="Maximum tool calls per design",
            description="Maximum number of tool calls for each design, with --team measuring.",
        ),
    ] = 80
    """Our choice: twice the number that a design measured by hand took."""
    tool_minutes: Annotated[
        int,
        Field(
            ge=1,
            title="Maximum tool minutes per design",
            description="Maximum running time of the tools for each design in minutes, with --team measuring.",
        ),
    ] = 60
    """Our choice."""
    memory: Annotated[
        str,
        Field(
            title="Memory file",
            description="File with measurements of earlier runs, written by `aidsr memory add`; the designer gets the "
            "lessons of the most similar jobs. Empty for none.",
        ),
    ] = ""
    """Benchmarks leave it empty unless they measure its effect."""
    memory_without_task: Annotated[
        bool, STUDY_ONLY, Field(description="Leave out the lessons of the run's own task.")
    ] = False
    """Used to measure whether lessons transfer to a task that they do not come from."""
    text_tools: Annotated[
        bool,
        Field(
            title="Tool calls as text",
            description="Let the measuring team write its tool calls as text, for servers without support for tools.",
        ),
    ] = False
    human: Annotated[
        bool,
        Field(
            title="Ask me to review each design that the Judge passed",
            description="Ask a person about each scene that the Judge passed: approve, refine or quit.",
        ),
    ] = False
    feedback: Annotated[
        str,
        STUDY_ONLY,
        Field(
            description="Feedback on the first scene of each design that the Judge passed, in place of a person; the "
            "next scene is approved."
        ),
    ] = ""

    def updated(self, settings: Mapping[str, Any]) -> RunConfig:
        """Return this configuration with some settings replaced.

        Raises:
            UserError: A setting does not exist, or a value is out of bounds.
        """
        return checked_config({**dict(self), **settings})


def checked_config(settings: Mapping[str, Any]) -> RunConfig:
    """Return the configuration with these settings and the defaults for all others.

    Raises:
        UserError: A setting does not exist (the message suggests the closest name), or a value is out of bounds.
    """
    for name in settings:
        if name not in RunConfig.model_fields:
            near = closest_name(name, RunConfig.model_fields)
            hint = f"did you mean {near}?" if near else f"settings are {', '.join(RunConfig.model_fields)}"
            raise UserError(f"unknown setting: {name}; {hint}")
    return checked(RunConfig, settings)


def checked(kind: type[Kind], values: Mapping[str, Any]) -> Kind:
    """Return an artifact with these values, which a user gave as arguments.

    Raises:
        UserError: A value is out of bounds or has the wrong type.
    """
    try:
        return kind.model_validate(dict(values))
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(str(part) for part in first["loc"])
        message = first["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
        raise UserError(f"invalid {name}: {first['input']!r}; it must be {message}") from None


def run_settings() -> dict[str, FieldInfo]:
    """Return the settings that the command line and the web app offer, by name."""
    return {name: field for name, field in RunConfig.model_fields.items() if STUDY_ONLY not in field.metadata}


def bounds(field: FieldInfo) -> dict[str, float]:
    """Return the bounds that a field has, by name: "ge", "gt", "le" and "multiple_of"."""
    names = ("ge", "gt", "le", "multiple_of")
    return {name: getattr(each, name) for each in field.metadata for name in names if hasattr(each, name)}
