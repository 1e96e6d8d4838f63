"""`aidsr` offers functions that take a path, a text or an object, and the arguments of the command line."""

import dataclasses
import inspect
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import get_args, get_type_hints

import pytest

import aidsr
from aidsr.api import find_scene
from aidsr.core.artifacts import Outcome, Robot
from aidsr.core.config import Budget, RunConfig, run_settings
from aidsr.core.errors import MjcfError, UserError
from aidsr.loop.run import create_run, make_brief
from aidsr.runs import Run
from aidsr.runs.folders import DesignFolder

ARM = """<mujoco>
  <worldbody><body name="arm"><joint name="hinge" axis="0 1 0"/>
    <geom name="link" type="capsule" size="0.01" fromto="0 0 0 0 0 0.2"/>
    <site name="tip" pos="0 0 0.2"/></body></worldbody>
  <actuator><position name="pull" joint="hinge" kp="1" ctrlrange="-1 1"/></actuator>
</mujoco>"""


def test_all_public_names_exist_and_nothing_else() -> None:
    assert dir(aidsr) == sorted(aidsr.__all__)
    assert all(hasattr(aidsr, name) for name in aidsr.__all__)
    with pytest.raises(AttributeError, match="it offers Evolution, Library, Memory, Model, Run"):
        aidsr.nothing  # noqa: B018 - the name is looked up


def test_validate_takes_a_text_a_path_or_an_object(tmp_path: Path) -> None:
    file = tmp_path / "robot.xml"
    file.write_text(ARM)
    expected = aidsr.validate(ARM)
    for given in (file, str(file), Robot(mjcf=ARM, functional_part="tip")):
        assert aidsr.validate(given) == expected
    with pytest.raises(UserError, match=r"absent\.xml"):
        aidsr.validate(str(tmp_path / "absent.xml"))


def test_assemble_takes_a_text_a_path_or_an_object_and_a_task(tmp_path: Path) -> None:
    file = tmp_path / "robot.xml"
    file.write_text(ARM)
    task = aidsr.load_task("button_pushing")
    expected = aidsr.assemble(Robot(mjcf=ARM, functional_part="tip"), task)
    assert expected.placement.mount == "mount"
    for given in (ARM, f"The robot:\n{ARM}", file, str(file)):
        assert aidsr.assemble(given, task, functional_part="tip") == expected
    alone = aidsr.assemble(ARM, task.brief().environment, expected.placement, functional_part="tip")
    assert "robot/tip" in alone.mjcf
    assert len(alone.mjcf) < len(expected.mjcf), "an environment alone brings no sensors of a task"


def test_a_scene_is_given_as_a_text_a_path_or_an_object(tmp_path: Path) -> None:
    task = aidsr.load_task("button_pushing")
    scene = aidsr.assemble(ARM, task, functional_part="tip")
    file = tmp_path / "scene.xml"
    file.write_text(scene.mjcf)
    for given in (scene, scene.mjcf, file, str(file)):
        found = find_scene(given, task).for_learning("auto")
        assert (found.mjcf, found.task) == (scene.mjcf, task)
        with pytest.raises(UserError, match="has no task; name one"):
            find_scene(given)


@pytest.mark.parametrize("kind", [str, Path, DesignFolder])
def test_what_is_no_approved_design_is_named(kind: type, tmp_path: Path) -> None:
    given = kind(tmp_path) if kind is not DesignFolder else DesignFolder(tmp_path)
    with pytest.raises(UserError, match=r"is not an approved design: final\.xml not found"):
        aidsr.probe(given, "gap")


def test_a_task_and_a_goal_exclude_each_other() -> None:
    with pytest.raises(UserError, match="both a task and a goal"):
        aidsr.train(ARM, "gap", goal="goal.toml")


DESIGN = DesignFolder(Path("nowhere/designs/1"))

MISTAKES: list[tuple[Callable[[], object], type[Exception], str]] = [
    (lambda: aidsr.train(ARM, "gap", steps=0), UserError, "steps must be at least 1: 0"),
    (lambda: aidsr.train(ARM, "gap", steps="many"), TypeError, "steps must be a whole number, not 'many'"),
    (lambda: aidsr.train(ARM, "gap", seed=-1), UserError, "seed must be at least 0: -1"),
    (lambda: aidsr.train(ARM, "gap", smoothing=2), UserError, "smoothing must be from 0 to below 1: 2"),
    (lambda: aidsr.train("nope"), UserError, "nope does not exist; give a design's folder or a scene"),
    (lambda: aidsr.train("nope", "gap"), UserError, "nope does not exist; give a design's folder or a scene"),
    (lambda: aidsr.probe("nope"), UserError, "nope does not exist; give a design's folder or a scene"),
    (lambda: aidsr.probe(ARM), UserError, "the scene has no task; name one (aidsr tasks lists them), or give a goal"),
    (lambda: aidsr.probe(None), TypeError, "design must be a design, its folder, or a scene, not None"),
    (lambda: aidsr.probe(ARM, 5), TypeError, "task must be a task or its name, not 5"),
    (lambda: aidsr.probe(ARM, "gap", candidates="many"), TypeError, "candidates must be a whole number, not 'many'"),
    (lambda: aidsr.evaluate(DESIGN), UserError, f"{DESIGN.path} has no finished training; train it first"),
    (lambda: aidsr.evaluate(3), TypeError, "training must be a training, its folder, or a design, not 3"),
    (lambda: aidsr.export(ARM), UserError, "a robot to export must be a file, not MJCF text; save the text and give"),
    (lambda: aidsr.export(None), TypeError, "design must be a design, its folder, or the file of a robot, not None"),
    (
        lambda: aidsr.validate(None),
        TypeError,
        "mjcf must be MJCF text, the path of a file, a Robot or a Scene, not None",
    ),
    (
        lambda: aidsr.validate(b"<a/>"),
        TypeError,
        "mjcf must be MJCF text, the path of a file, a Robot or a Scene, not b",
    ),
    (
        lambda: aidsr.validate(DESIGN),
        TypeError,
        "mjcf must be MJCF text, the path of a file, a Robot or a Scene, not D",
    ),
    (lambda: aidsr.validate(ARM, select="to_stiff"), UserError, "no such rule: to_stiff; did you mean too_stiff?"),
    (lambda: aidsr.fix(None), TypeError, "mjcf must be MJCF text, the path of a file, a Robot or a Scene, not None"),
    (lambda: aidsr.fix(ARM, ["too_stiff"]), TypeError, "faults must be a report or faults of one, not 'too_stiff'"),
    (lambda: aidsr.fix(ARM, "too_stiff"), TypeError, "faults must be a report or faults of one, not 'too_stiff'"),
    (
        lambda: aidsr.fix(ARM, only="inverted_range"),
        UserError,
        "no such fix: inverted_range; did you mean inverted_rang",
    ),
    (lambda: aidsr.load_task(3), TypeError, "task must be the name of a task, not 3"),
    (lambda: aidsr.design(task=5), TypeError, "task must be the name of a task, not 5"),
    (
        lambda: aidsr.design("press", environment=ARM, goal={"kind": "reach"}),
        TypeError,
        "goal must be the path of a TOML file, not {'kind': 'reach'}",
    ),
    (
        lambda: aidsr.design("press", environment=5),
        TypeError,
        "the environment must be MJCF text or the path of a file, not 5",
    ),
    (lambda: aidsr.Run(5), TypeError, "a run must be given as the path of its folder, not 5"),
    (
        lambda: aidsr.assemble(ARM, aidsr.load_task("button_pushing")),
        MjcfError,
        "no functional_part given; name a body, site or geom of the robot: arm, tip, link",
    ),
    (
        lambda: aidsr.assemble(ARM, aidsr.load_task("button_pushing"), functional_part="tipp"),
        MjcfError,
        'the functional part "tipp" is not a name of the robot; did you mean tip?',
    ),
]


@pytest.mark.parametrize(("mistake", "kind", "sentence"), MISTAKES)
def test_a_mistake_is_one_sentence(mistake: Callable[[], object], kind: type[Exception], sentence: str) -> None:
    with pytest.raises(kind) as caught:
        mistake()
    assert str(caught.value).startswith(sentence)


def test_one_name_needs_no_list_and_a_report_stands_for_its_faults() -> None:
    assert aidsr.validate(ARM, select="chatter") == aidsr.validate(ARM, select=["chatter"])
    report = aidsr.validate(ARM)
    assert aidsr.fix(ARM, report) == aidsr.fix(ARM, report.faults)
    assert aidsr.fix(ARM, only="inverted_ranges") == aidsr.fix(ARM, only=["inverted_ranges"])


@pytest.mark.parametrize("kind", [aidsr.Run, aidsr.Library, aidsr.Memory, aidsr.Evolution])
def test_a_folder_or_file_is_given_as_a_string_or_a_path(kind: type, tmp_path: Path) -> None:
    assert kind(str(tmp_path)) == kind(tmp_path)
    assert kind(str(tmp_path)).path == tmp_path
    with pytest.raises(TypeError, match="must be given as the path of"):
        kind(5)


def test_runs_are_listed_and_read_from_their_folders(tmp_path: Path) -> None:
    run = create_run(make_brief(task="button_pushing"), RunConfig(), level="standard", runs=tmp_path)
    assert aidsr.Library(str(tmp_path)).runs() == (run,)
    for given in (run, run.path, str(run.path)):
        assert aidsr.read_status(given).record.task == "reaching/button_pushing"
        assert aidsr.lessons_of(given) == ()
    folder = run.design(1).path / "training" / "001"
    folder.mkdir(parents=True)
    (folder / "config.json").write_text("{}")
    for design in (run.design(1), str(run.design(1).path)):
        assert [training.path for training in aidsr.trainings_of(design)] == [folder]


LIMITS = set(Budget.model_fields)
STUDY_ONLY_SETTINGS = RunConfig.model_fields.keys() - run_settings().keys()
ALONE: dict[str, tuple[set[str], set[str]]] = {
    "design": (LIMITS | {"dry_run", "train", "steps", "seeds"}, STUDY_ONLY_SETTINGS | {"budget", "config", "listen"}),
    "resume": (LIMITS, {"budget", "model", "listen"}),
    "probe": ({"out", "film", "json"}, {"groups", "listen"}),
    "train": ({"seeds", "first_seed", "evaluate", "videos"}, {"seed", "listen"}),
    "evaluate": ({"json"}, {"listen"}),
    "export": (set(), set()),
    "benchmark": ({"dry_run", "max_cost", "max_tokens"}, {"budget", "listen"}),
    "evolve": (
        LIMITS,
        STUDY_ONLY_SETTINGS | {"budget", "config", "listen", "follow", "task_feedback", "memory", "human"},
    ),
}
"""By command: options that only the command line has, and arguments that only Python has."""
SAID_BY_NONE = {"tasks": "all", "model": "builtin", "method": "full", "script": "own"}
"""Defaults that one of the two states as None."""


def defaults_of_command(name: str) -> dict[str, object]:
    command = getattr(import_module(f"aidsr.apps.cli.{name}"), name)
    found: dict[str, object] = {}
    for option, hint in list(get_type_hints(command).items())[1:]:
        if option == "return":
            continue
        group = next((kind for kind in (hint, *get_args(hint)) if dataclasses.is_dataclass(kind)), None)
        many = {each.name: each.default for each in dataclasses.fields(group)} if group else {}
        found |= many or {option: inspect.signature(command).parameters[option].default}
    return found


def defaults_of_function(name: str) -> dict[str, object]:
    settings = {field: info.default for field, info in RunConfig.model_fields.items()}
    found: dict[str, object] = {}
    for parameter in list(inspect.signature(getattr(aidsr, name)).parameters.values())[1:]:
        is_any_setting = parameter.kind is parameter.VAR_KEYWORD
        found = settings | found if is_any_setting else found | {parameter.name: parameter.default}
    return found


@pytest.mark.parametrize("name", ALONE)
def test_a_function_has_the_arguments_and_defaults_of_its_command(name: str) -> None:
    told, known = defaults_of_command(name), defaults_of_function(name)
    assert (told.keys() - known.keys(), known.keys() - told.keys()) == ALONE[name]

    def shown(option: str, value: object) -> object:
        if value in (None, "", ()):
            return SAID_BY_NONE.get(option)
        return str(value) if isinstance(value, Path) else value

    shared = sorted(told.keys() & known.keys())
    assert [(one, shown(one, told[one])) for one in shared] == [(one, shown(one, known[one])) for one in shared]


def test_a_refused_design_is_called_refused_with_its_reason(tmp_path: Path) -> None:
    design = Run(tmp_path).design(1)
    design.outcome.write(Outcome(outcome="invalid", reason="No motion of this body wins.", iteration=2))
    with pytest.raises(UserError, match=r"was not approved \(invalid\): No motion of this body wins\. Only") as told:
        find_scene(design)
    assert "runs/…/designs/1" not in str(told.value)
