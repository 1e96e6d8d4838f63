"""Documents, policies and folders with numbers that are none end every command with one sentence."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from aidsr.apps.cli import main
from scenes import small_arm, small_scene

PUBLISHED = Path(__file__).parents[3] / "benchmarks" / "builtin" / "policies"


def _mass(written: str) -> Callable[[str], str]:
    return lambda text: text.replace('mass="0.1"', f'mass="{written}"')


def _inside(element: str, new: str) -> Callable[[str], str]:
    return lambda text: text.replace(f"<{element}>", f"<{element}>{new}", 1)


_HEAP = "".join(
    f'<body name="f{i}" pos="0 0 {5 + 1e-4 * i}"><freejoint/><geom size=".05 .05 .05" type="box"/></body>'
    for i in range(60)
)
HOSTILE: dict[str, tuple[Callable[[str], str], str]] = {
    "nan(1)": (_mass("nan(1)"), 'mass="nan(1)" is not a finite number'),
    "nan(0x1)": (_mass("nan(0x1)"), 'mass="nan(0x1)" is not a finite number'),
    "nan()": (_mass("nan()"), 'mass="nan()" is not a finite number'),
    "1e999": (_mass("1e999"), 'mass="1e999" is not a finite number'),
    "1e300": (_mass("1e300"), 'mass="1e300" is too large'),
    "empty replicate": (_inside("worldbody", '<replicate count="1000000000"/>'), "1e+09, at most 20000 allowed"),
    "memory": (
        lambda text: text.replace("<worldbody>", '<size memory="99999G"/><worldbody>', 1),
        "'memory' in MiB: 102398976, at most 1024 allowed",
    ),
    "a heap of boxes": (_inside("worldbody", _HEAP), "contacts in the drawn pose, at most 2,000 can be simulated"),
}
COMMANDS: dict[str, tuple[str, ...]] = {
    "validate": ("validate", "robot.xml"),
    "view": ("view", "robot.xml"),
    "export": ("export", "robot.xml", "--out", "parts"),
    "probe": ("probe", "scene.xml", "--task", "button_pushing"),
    "train": ("train", "scene.xml", "--task", "button_pushing", "--steps", "64", "--out", "learned"),
    "design": ("design", "push", "--environment", "scene.xml", "--concepts", "1", "--runs", "runs"),
}
NEEDS = {"export": "manifold3d", "train": "stable_baselines3"}


def ended(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as exit_:
        main(list(words))
    told = capsys.readouterr()
    return int(str(exit_.value.code)), told.out, told.err


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_document_is_one_sentence(
    name: str, command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if command in NEEDS:
        pytest.importorskip(NEEDS[command])
    spoil, words = HOSTILE[name]
    monkeypatch.chdir(tmp_path)
    for file, text in (("robot.xml", small_arm()), ("scene.xml", small_scene())):
        assert spoil(text) != text
        Path(file).write_text(spoil(text))
    code, out, err = ended(capsys, *COMMANDS[command])
    assert code == (1 if command == "validate" else 2)
    assert "Traceback" not in out + err
    assert words in " ".join((out + err).split())
    assert err.count("\n") == (0 if command == "validate" else 1)


def test_a_policy_with_a_number_that_is_none_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("stable_baselines3")
    policy = tmp_path / "policy"
    shutil.copytree(next(path.parent for path in PUBLISHED.rglob("normalisation.json")), policy)
    written = policy / "normalisation.json"
    written.write_text(written.read_text().replace('"var": [', '"var": [NaN, ', 1))
    code, out, err = ended(capsys, "evaluate", str(policy), "--no-videos")
    assert code == 2
    assert "cannot be read" in err
    assert "Traceback" not in out + err


def test_folders_named_with_digits_that_are_no_numbers_are_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("stable_baselines3")
    scene = tmp_path / "scene.xml"
    scene.write_text(small_scene())
    for name in ("²", "1²", "٣"):
        (tmp_path / "learned" / name).mkdir(parents=True)
    words = ("train", str(scene), "--task", "button_pushing", "--steps", "64", "--threads", "1", "--no-evaluate")
    code, out, _ = ended(capsys, *words, "--out", str(tmp_path / "learned"))
    assert code == 0
    assert str(tmp_path / "learned" / "001") in out
