"""The form for a new study: tasks, arms, number of designs, training, and cost limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args

from nicegui import app, ui

from aidsr.apps.web.addresses import study_address
from aidsr.apps.web.form_values import limit, limit_field, whole_number, whole_number_field
from aidsr.apps.web.frame import frame
from aidsr.apps.web.live import live, working
from aidsr.apps.web.site import Site
from aidsr.apps.web.studies import JOBS
from aidsr.apps.web.widgets import box, button, fact, text
from aidsr.core.config import BUDGET_STEPS, BUILTIN, Budget, Protocol, StudyMethod
from aidsr.core.errors import UserError
from aidsr.core.formatting import format_duration, task_title
from aidsr.loop.teams import check_model
from aidsr.runs.library import is_name
from aidsr.studies.arms import Baseline, make_plan
from aidsr.studies.budget import check_budget, set_budget
from aidsr.studies.estimate import StudyEstimate, estimate_study
from aidsr.studies.study import Study, create_study
from aidsr.tasks import task_names
from aidsr.teams.providers import providers

_ALL = "all"
_METHODS = tuple(name for name in get_args(StudyMethod) if not name.startswith("human"))
"""Methods on offer. Those with a person's feedback are left out: they need a file with it, see `aidsr benchmark
--feedback`."""
_PROTOCOLS = get_args(Protocol)
_NUMBERS = {
    "designs": ("Designs per task and arm", 1, 1),
    "concepts": ("Concepts per run", 1, 1),
    "seeds": ("Policies per design", 0, 1),
    "steps": ("Control steps per policy", 1, 10_000),
    "jobs": ("Parallel jobs", 1, 1),
}
"""Title, minimum and step of each number field."""
_LIMITS = {"cost_usd": ("Maximum cost [USD]", False), "tokens": ("Maximum tokens", True)}
"""Title of each limit, and whether it is a whole number."""

FRESH: dict[str, Any] = {
    "name": "",
    "tasks": [_ALL],
    "level": "standard",
    "models": [BUILTIN],
    "methods": ["full"],
    "baselines": [],
    "designs": 3,
    "concepts": 3,
    "seeds": 1,
    "steps": BUDGET_STEPS,
    "protocol": "best",
    "jobs": JOBS,
    "probe": True,
    "cost_usd": None,
    "tokens": None,
}
"""Default values of the form; a visitor's input, except the name, is kept for the next visit."""
Form = dict[str, Any]


@dataclass(frozen=True)
class _Asked:
    """The study that a valid form describes, its budget, and the number of parallel jobs."""

    study: Study
    budget: Budget
    jobs: int


def add_study_form(site: Site) -> None:
    """Add the page at /studies/new."""

    @ui.page("/studies/new")
    def new_study() -> None:
        form: Form = app.storage.user.setdefault("study", {})
        for key, value in FRESH.items():
            form.setdefault(key, value)
        with frame("New study", ("Runs", "/"), ("Activity", "/work"), site=site):
            with box("stack tight"):
                text("New study", tag="h1")
                text("A study compares many runs. It continues if you close this page.", "soft", "p")
            _what(form)
            _how(form)
            _start(site, form)


def asked(site: Site, form: Form) -> _Asked:
    """Return the study that a filled-in form describes; nothing is written.

    Raises:
        UserError: An entry is missing or unknown, or entries do not fit together.
    """
    name = str(form["name"] or "").strip()
    if not name:
        raise UserError("the study has no name; enter one, which becomes the name of a folder in the folder of runs")
    if not is_name(name):
        raise UserError(f'"{name[:80]}" cannot be used as a folder name; use letters, digits, spaces, -, _ and .')
    path = site.library.path / name
    if path.exists():
        raise UserError(f"{name} already exists; choose another name")
    numbers = {key: whole_number(title, form[key], least=least) for key, (title, least, _) in _NUMBERS.items()}
    empty = [title for key, title in (("tasks", "task"), ("models", "model"), ("methods", "method")) if not form[key]]
    if empty:
        raise UserError(f"no {empty[0]} is selected; select at least one")
    plan = make_plan(
        [_ALL] if _ALL in form["tasks"] else form["tasks"],
        form["models"],
        form["methods"],
        level=form["level"],
        baselines=form["baselines"],
        designs=numbers["designs"],
        concepts=numbers["concepts"],
        seeds=numbers["seeds"],
        steps=numbers["steps"],
        protocol=form["protocol"],
        probe=bool(form["probe"]),
    )
    limits = {key: limit(title, form[key], whole=whole) for key, (title, whole) in _LIMITS.items()}
    found = _Asked(Study(path, plan), Budget.model_validate(limits), numbers["jobs"])
    check_budget(found.study, found.budget)
    return found


def _what(form: Form) -> None:
    with box("sheet stack"):
        ui.input("Study name").props("outlined dense").bind_value(form, "name")
        tasks = {_ALL: "all tasks", **{name: task_title(name) for name in task_names()}}
        _several("Tasks", tasks, form, "tasks")
        ui.toggle(["standard", "hard"]).props("dense unelevated no-caps").bind_value(form, "level")
        offered = [provider.example_name for provider in providers() if provider.connect and not provider.takes_path]
        known = dict.fromkeys([BUILTIN, *form["models"], *offered])
        models = ui.select(list(known), label="Models (builtin, PROVIDER:MODEL or MODEL@URL)", multiple=True)
        models.props("outlined dense use-chips use-input new-value-mode=add-unique").bind_value(form, "models")
        _several("Methods", {name: name.replace("_", " ") for name in _METHODS}, form, "methods")
        _several("Baselines", {name: name for name in get_args(Baseline)}, form, "baselines")
        text("Each combination of model and method is an arm. Each baseline is also an arm.", "small soft")


def _several(title: str, options: dict[str, str], form: Form, key: str) -> None:
    field = ui.select(options, label=title, multiple=True).props("outlined dense use-chips")
    field.bind_value(form, key)


def _how(form: Form) -> None:
    with box("sheet stack"):
        with box("form"):
            for key, (title, least, step) in _NUMBERS.items():
                whole_number_field(title, least=least, step=step).bind_value(form, key)
            for key, (title, whole) in _LIMITS.items():
                limit_field(title, step=1, whole=whole).bind_value(form, key)
        text("Each job uses one core. The limits apply to the whole study.", "small soft")
        with box("row"):
            text("Training protocol", "small")
            protocol = ui.toggle(list(_PROTOCOLS)).props('dense unelevated no-caps role=group aria-label="protocol"')
            protocol.bind_value(form, "protocol")
            text('The method "from probe" requires "paper".', "small soft")
        ui.switch("Also probe each approved design (without learning)").bind_value(form, "probe")


def _start(site: Site, form: Form) -> None:
    with box("stack", aria_live="polite"):
        live(lambda: _estimated(site, form), _forecast, first=tuple)

    def begin() -> str:
        found = asked(site, form)
        for arm in found.study.plan.arms:
            check_model(arm.config, arm.config.budget)
        create_study(found.study.path, found.study.plan)
        if found.budget != Budget():
            set_budget(found.study, found.budget)
        key = found.study.path.name
        site.studies.resume(key, found.jobs)
        return key

    def opened(key: str) -> None:
        form["name"] = ""
        ui.navigate.to(study_address(key))

    with box("row"):
        go = button("Start the study", lambda: working(go, begin, opened), "primary", "play_arrow")


def _estimated(site: Site, form: Form) -> tuple[tuple[StudyEstimate, int], ...]:
    """Return the estimated effort of the study in a form and the number of parallel jobs; empty while it is incomplete.

    What it lacks is told when the study is started.
    """
    try:
        found = asked(site, {**form, "name": "estimated only"})
        return ((estimate_study(found.study), found.jobs),)
    except UserError:
        return ()


def _forecast(estimated: tuple[tuple[StudyEstimate, int], ...]) -> None:
    if not estimated:
        return
    ((found, jobs),) = estimated
    text("Estimated effort", "label")
    with box("facts"):
        for stage, number in found.jobs.items():
            if number:
                fact(f"{stage} jobs", str(number))
        fact("core hours", f"{found.core_hours:.1f}")
        fact("on this machine", f"about {format_duration(3600 * found.core_hours / jobs)}")
        fact("cost", f"about ${found.cost_usd:.2f}" if found.cost_usd else "$0")
        fact("disk", f"about {found.disk_mb:.0f} MB")
    if found.published_costs:
        text("No design of this study has been measured yet. The cost is the published figure for GPT-5.", "small soft")
