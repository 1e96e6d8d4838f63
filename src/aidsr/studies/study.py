"""Plan of a study (tasks, arms, designs, seeds, steps), frozen in study.toml when the study starts, and its folder."""

from __future__ import annotations

import json
import shlex
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from aidsr.core.arguments import check_type
from aidsr.core.artifacts import Artifact
from aidsr.core.config import BUDGET_STEPS, VERDICT_EPISODES, Method, Protocol, RunConfig
from aidsr.core.errors import UserError
from aidsr.core.plain_tree import require_plain_tree
from aidsr.core.provenance import versions_of
from aidsr.core.text_files import parse_toml, read_text_file
from aidsr.runs import RUN_FILE, Run
from aidsr.runs.origin import mark_as_ours, require_ours
from aidsr.studies.file_errors import first_error
from aidsr.tasks import BENCHMARK_VERSION
from aidsr.teams.providers import destination
from aidsr.teams.providers.offline import REFERENCE, SEARCH

STUDY_FILE = "study.toml"
"""Name of the file with the plan of a study."""
_PACKAGES = ("aidsr", "mujoco", "numpy", "cma", "pydantic-ai-slim", "stable-baselines3", "torch")
_BASELINES = {REFERENCE.prefix: "robots designed by hand", SEARCH.prefix: "parameters found by CMA-ES"}
_METHODS: dict[Method, str] = {
    "no_judge": "no Judge",
    "no_integrator": "every robot on the first mount",
    "no_judge_or_integrator": "no Judge, every robot on the first mount",
    "no_validation": "no validation",
    "no_feedback": "no validation, no Judge",
    "direct": "one call",
}
_NAME = r"^[a-z0-9][a-z0-9_.-]*$"
_TASK = r"^\w[\w.-]*(/\w[\w.-]*)*$"
"""Pattern of task names, including those of other packages; they are used as folder names."""
_MANY = Field(min_length=1, max_length=1000)
_EARLIER_VERDICT_EPISODES = 20
"""Number of episodes of a verdict up to version 3 of the benchmark. Source: docs/tasks.md, how a design is scored."""


class Arm(Artifact):
    """One way of making designs that is compared with others: a model, and what differs from the full method."""

    name: Annotated[str, Field(pattern=_NAME)]
    after: str = ""
    """Name of the arm whose finished runs this one continues with the same designs, calls and cost; "" for none."""
    feedback: dict[str, str] = Field(default_factory=dict)
    """A person's feedback on each design, by task; it starts one more round."""
    grouping: Literal["auto", "off"] = "auto"
    """"auto" trains policies with one action for each actuator group; "off" gives each actuator its own action."""
    from_probe: bool = False
    """Whether policies first imitate the best open-loop motion, if it succeeds; see `aidsr.learn.rl.recipe.Recipe`."""
    runs: Annotated[int | None, Field(ge=1)] = None
    """Number of runs of each task, if smaller than the study's; a deterministic arm is run only once."""
    config: RunConfig

    @property
    def settings(self) -> str:
        """Settings that differ from the defaults, in one line; empty for the full method."""
        config, usual = self.config, {"model", "concepts", "early_stop", "seed", "method", "repairs", "task_feedback"}
        changed = config.model_dump(mode="json", exclude=usual, exclude_defaults=True)
        changes = [_BASELINES[config.model]] if config.model in _BASELINES else []
        if config.model == SEARCH.prefix:
            changes[0] += f" over {changed.pop('search_robots', config.search_robots)} robots"
        changes += [_METHODS[config.method]] if config.method != "full" else []
        changes += ["no automatic fixes"] * (not config.repairs)
        changes += ["tried on its task"] * config.task_feedback
        changes += [f"{key} {json.dumps(value).strip(chr(34))}" for key, value in changed.items()]
        changes += ["a person's feedback"] * bool(self.feedback) + ["no actuator groups"] * (self.grouping == "off")
        changes += ["policies start from the probe's motion"] * self.from_probe
        changes += [f"designs taken from {self.after}"] * bool(self.after)
        return ", ".join(changes)


class StudyPlan(Artifact):
    """All settings of a study. Two studies with equal plans can be merged."""

    tasks: Annotated[tuple[Annotated[str, Field(pattern=_TASK, max_length=200)], ...], _MANY]
    level: Literal["standard", "hard"] = "standard"
    arms: Annotated[tuple[Arm, ...], _MANY]
    runs: Annotated[int, Field(ge=1, le=1000)] = 5
    """Number of runs of each task and arm. Source: AID-SR, 15 designs per task = 5 runs of 3 concepts."""
    seeds: Annotated[int, Field(ge=0, le=100)] = 1
    """Number of policies trained for each approved design; 0 trains none."""
    steps: Annotated[int, Field(ge=1)] = BUDGET_STEPS
    """Training budget of each policy in control steps."""
    protocol: Protocol
    """Training protocol of the policies."""
    probe: bool = True
    """Whether each approved design is also probed with open-loop motions, without learning."""
    perturbed: bool = False
    """Whether successful policies are also evaluated in perturbed scenes, see docs/learning.md, robustness."""
    benchmark_version: int = BENCHMARK_VERSION
    versions: dict[str, str] = Field(default_factory=dict)

    @property
    def verdict_episodes(self) -> int:
        """Number of held-out episodes that judge each policy. It follows from the version of the benchmark."""
        return VERDICT_EPISODES if self.benchmark_version > 3 else _EARLIER_VERDICT_EPISODES

    @model_validator(mode="after")
    def _nothing_twice(self) -> Self:
        twice = sorted(task for task, count in Counter(self.tasks).items() if count > 1)
        if twice:
            raise ValueError(f"duplicate {'task' if len(twice) == 1 else 'tasks'}: {', '.join(twice)}")
        names = [arm.name for arm in self.arms]
        if len(set(names)) < len(names):
            raise ValueError(f"arm names must be unique, found {', '.join(names)}")
        for number, arm in enumerate(self.arms):
            if arm.after and arm.after not in names[:number]:
                raise ValueError(f'{arm.name} continues the designs of "{arm.after}", which must come before it')
            if arm.from_probe and self.protocol != "paper":
                raise ValueError(f'{arm.name}: from_probe needs protocol "paper" (--protocol paper)')
        return self


def fill_protocol(plain: Any) -> Any:
    """Return a plan as read from a file, with protocol "paper" where it names none.

    Earlier versions had no other protocol and did not write it.
    """
    return {"protocol": "paper", **plain} if isinstance(plain, dict) else plain


@dataclass(frozen=True)
class Cell:
    """One run of a study: an arm, a task, and the number of the repetition."""

    arm: str
    task: str
    number: int

    @property
    def name(self) -> str:
        """Path of the run within the study's folder of runs, also its name in messages."""
        return f"{self.arm}/{self.task.replace('/', '.')}/{self.number}"


@dataclass(frozen=True)
class Study:
    """A study: its folder and its plan."""

    path: Path
    plan: StudyPlan

    @property
    def quoted_path(self) -> str:
        """Path of its folder as a word of a shell command."""
        return shlex.quote(str(self.path))

    @property
    def cells(self) -> Iterator[Cell]:
        """All runs of the plan. The first run of each task and arm comes first, so that results are readable early."""
        for number in range(1, self.plan.runs + 1):
            for task in self.plan.tasks:
                for arm in self.plan.arms:
                    if number <= (arm.runs or self.plan.runs):
                        yield Cell(arm.name, task, number)

    def arm(self, name: str) -> Arm:
        """Return an arm by its name."""
        return next(arm for arm in self.plan.arms if arm.name == name)

    def continued_cell(self, cell: Cell) -> Cell | None:
        """Return the cell whose run a cell continues, or None if it starts a new run."""
        continued_arm = self.arm(cell.arm).after
        return replace(cell, arm=continued_arm) if continued_arm else None

    def followers(self, cell: Cell) -> tuple[Cell, ...]:
        """Return the cells that continue a cell's run."""
        return tuple(replace(cell, arm=arm.name) for arm in self.plan.arms if arm.after == cell.arm)

    def home(self, cell: Cell) -> Path:
        """Return the folder that holds a cell's one run."""
        return self.path / "runs" / cell.name

    def run(self, cell: Cell) -> Run | None:
        """Return a cell's run, or None if it has not started."""
        found = sorted(self.home(cell).glob(f"*/{RUN_FILE}"))
        return Run(found[0].parent) if found else None


def versions_now() -> dict[str, str]:
    """Return the versions of the packages that influence results; packages that are not installed are left out."""
    return versions_of(_PACKAGES)


def create_study(path: Path, plan: StudyPlan) -> Study:
    """Return the study in a folder, creating it if there is none.

    Raises:
        UserError: The folder holds a study with another plan.
    """
    file = path / STUDY_FILE
    if file.exists():
        found = open_study(path)
        if _frozen_options(found.plan) != _frozen_options(plan):
            changed = [key for key, value in _frozen_options(plan).items() if value != _frozen_options(found.plan)[key]]
            raise UserError(
                f"{path} holds a study with other {', '.join(changed)}; a plan cannot be changed after its study "
                "has started. Use the same options, or another folder"
            )
        return found
    path.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(".part")
    part.write_text(_toml(plan.model_dump(mode="json")), encoding="utf-8")
    part.replace(file)
    mark_as_ours(file)
    return Study(path, plan)


def require_study_is_ours(study: Study, *, trust: bool) -> None:
    """Refuse to resume a study that was made elsewhere and sends data to other machines, unless the user trusts it.

    A study whose folder does not exist yet is not refused.

    Raises:
        ForeignFolderError: The study is such a study and `trust` is false.
    """
    if not (study.path / STUDY_FILE).exists():
        return
    require_ours(study.path / STUDY_FILE, [destination(arm.config.model) for arm in study.plan.arms], trust=trust)


def open_study(path: str | Path) -> Study:
    """Return the study in a folder.

        study = aidsr.open_study("studies/first")
        print(study.plan.tasks, [arm.name for arm in study.plan.arms])

    Raises:
        TypeError: `path` has another type.
        UserError: The folder holds no study, its plan cannot be read, or it contains links or other special files.
    """
    check_type(path, (str, Path), "a study must be given as the path of its folder")
    path = Path(path)
    if not (path / STUDY_FILE).exists():
        a_run = f"it is a run: aidsr show {shlex.quote(str(path))}" if (path / RUN_FILE).exists() else ""
        cure = a_run or "give the folder of a study, as studies/first"
        raise UserError(f"{path} is not a study folder: study.toml not found; {cure}")
    require_plain_tree(path)
    try:
        text = read_text_file(path / STUDY_FILE, max_bytes=_MAX_BYTES)
        return Study(path, StudyPlan.model_validate(fill_protocol(parse_toml(text))))
    except ValidationError as error:
        raise UserError(f"{path / 'study.toml'} is not a study plan: {first_error(error)}; {_RESTORE}") from None
    except ValueError as error:
        raise UserError(f"{path / 'study.toml'} cannot be read as TOML: {error}; {_RESTORE}") from None


def as_study(study: str | Path | Study) -> Study:
    """Return a study that is given as an object or by its folder; errors are those of `open_study`."""
    return study if isinstance(study, Study) else open_study(study)


_MAX_BYTES = 4 * 2**20
_RESTORE = "do not edit a plan: restore the file, or start another study"


def _frozen_options(plan: StudyPlan) -> dict[str, object]:
    """Return the plan without the package versions, which may change while a study runs."""
    return plan.model_dump(exclude={"versions"})


def _toml(values: dict[str, object]) -> str:
    """Return a plan as TOML: plain values first, then versions, then one table for each arm."""

    def value(of: object) -> str:
        if isinstance(of, dict):
            return (
                "{" + ", ".join(f"{value(key)} = {value(each)}" for key, each in of.items() if each is not None) + "}"
            )
        return json.dumps(of, ensure_ascii=False)

    def lines(of: dict[str, object]) -> list[str]:
        return [f"{key} = {value(each)}" for key, each in of.items() if each is not None and each != {}]

    versions, arms = dict(values["versions"]), list(values["arms"])  # type: ignore[call-overload]
    plain = {key: each for key, each in values.items() if key not in ("versions", "arms")}
    text = [*lines(plain), "", "[versions]", *(f"{value(key)} = {value(each)}" for key, each in versions.items())]
    for arm in arms:
        config = arm.pop("config")
        text += ["", "[[arms]]", *lines(arm), "[arms.config]", *lines(config)]
    return "\n".join(text) + "\n"
