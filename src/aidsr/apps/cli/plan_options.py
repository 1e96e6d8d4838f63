"""Options that define the plan of a new study."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.apps.cli.options import setting
from aidsr.core.config import BUDGET_STEPS, Protocol, RunConfig, StudyMethod

if TYPE_CHECKING:
    from aidsr.studies.study import StudyPlan


@Parameter(name="*")
@dataclass(frozen=True)
class PlanOptions:
    """Options of a study's plan; to resume the study, they must be the same or all left out."""

    tasks: Annotated[
        list[str] | None,
        Parameter(negative="", consume_multiple=True, help='Names of tasks; default: "all".'),
    ] = None
    level: Annotated[Literal["standard", "hard"], Parameter(help="Level of the tasks.")] = "standard"
    model: Annotated[
        list[str] | None,
        Parameter(
            negative="",
            consume_multiple=True,
            help='Models to compare; "builtin" for the built-in rules. Each model is an arm of the study.',
        ),
    ] = None
    method: Annotated[
        list[StudyMethod] | None,
        Parameter(
            negative="",
            consume_multiple=True,
            help="Methods to compare: the full method, or variants with parts removed or added. Each method is an arm "
            "for each model.",
        ),
    ] = None
    feedback: Annotated[
        Path | None,
        Parameter(
            help='TOML file with a person\'s feedback on the designs of each task, for the methods "human" and '
            '"human_only".'
        ),
    ] = None
    baseline: Annotated[
        list[Literal["reference", "search"]] | None,
        Parameter(
            negative="",
            consume_multiple=True,
            help='Baselines: "reference" for hand-designed robots, one per task; "search" for CMA-ES over the '
            'parameters of a built-in family, one design per run (extra "search"). Each baseline is an arm.',
        ),
    ] = None
    search_robots: Annotated[int, setting("search_robots")] = RunConfig.model_fields["search_robots"].default
    designs: Annotated[
        int,
        Parameter(validator=Number(gte=1), help="Number of designs for each task and model, in runs of --concepts."),
    ] = 15
    concepts: Annotated[int, setting("concepts")] = RunConfig.model_fields["concepts"].default
    seeds: Annotated[
        int,
        Parameter(
            validator=Number(gte=0, lte=100),
            help="Number of policies to train for each approved design; 0 trains none.",
        ),
    ] = 1
    steps: Annotated[
        int, Parameter(validator=Number(gte=1), help="Maximum control steps (actions) for each policy.")
    ] = BUDGET_STEPS
    protocol: Annotated[
        Protocol,
        Parameter(
            help='Algorithm and its settings. "best" is soft actor-critic, each action held for three control steps; '
            '"paper" is PPO, for comparison.'
        ),
    ] = "best"
    probe: Annotated[bool, Parameter(help="Also probe each approved design without learning.")] = True
    perturbed: Annotated[
        bool,
        Parameter(
            negative="",
            show_default=False,
            help="Also run successful policies in perturbed scenes; the verdict does not change.",
        ),
    ] = False

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the options whose value differs from the default, as written on the command line."""
        return tuple(
            f"--{each.name.replace('_', '-')}" for each in fields(self) if getattr(self, each.name) != each.default
        )

    def plan(self) -> StudyPlan:
        """Return the plan that the options describe.

        Raises:
            UserError: A name is unknown, or options contradict each other.
        """
        from aidsr.core.errors import UserError
        from aidsr.studies.arms import make_plan

        empty = [name for name in ("tasks", "model", "method", "baseline") if getattr(self, name) == []]
        if empty:
            raise UserError(f"--{empty[0]} requires a name; leave it out for the default")
        return make_plan(
            self.tasks or ["all"],
            self.model or ["builtin"],
            self.method or ["full"],
            level=self.level,
            feedback=self.feedback,
            baselines=self.baseline or [],
            search_robots=self.search_robots,
            designs=self.designs,
            concepts=self.concepts,
            seeds=self.seeds,
            steps=self.steps,
            protocol=self.protocol,
            probe=self.probe,
            perturbed=self.perturbed,
        )
