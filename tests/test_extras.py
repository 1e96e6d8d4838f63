"""What is said where an optional library is missing: the same sentence everywhere, before anything is begun."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

from aidsr.core.extras import EXTRAS, installing, missing_extra, require_extra

ROOT = Path(__file__).parents[1]
STUDY = ("benchmark", "study", "--tasks", "gap", "--designs", "3", "--dry-run")
ASKED = (
    ("rl", ("train", "robot.xml")),
    ("rl", ("evaluate", "training")),
    ("rl", ("design", "--task", "gap", "--train")),
    ("rl", ("design", "--task", "gap", "--task-feedback", "--task-training", "10")),
    ("rl", STUDY),
    ("search", (*STUDY, "--seeds", "0", "--baseline", "search")),
    ("ray", (*STUDY, "--ray", "auto")),
    ("fabrication", ("export", "robot.xml")),
    ("mcp", ("mcp",)),
    ("web", ("web", "--no-browser")),
)
WITHOUT = f"""
import contextlib, io, json, sys
sys.modules.update(dict.fromkeys({[module for modules in EXTRAS.values() for module in modules]!r}))
from aidsr.apps.cli import main
answers = []
for words in json.loads(sys.argv[1]):
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        try:
            main(words)
        except SystemExit as ended:
            answers.append((ended.code, " ".join(said.getvalue().split())))
print(json.dumps(answers))
"""


def test_every_command_says_which_extra_it_lacks_and_begins_nothing(tmp_path: Path) -> None:
    words = json.dumps([words for _, words in ASKED])
    done = subprocess.run([sys.executable, "-c", WITHOUT, words], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    answers = json.loads(done.stdout)
    assert len(answers) == len(ASKED)
    for (extra, asked), (code, said) in zip(ASKED, answers, strict=True):
        module = EXTRAS[extra][0]
        sentence = f'needs the extra "{extra}", and module {module} is not installed: {installing(extra)}'
        assert code == 2, (asked, said)
        assert sentence in said, (asked, said)
    assert list(tmp_path.iterdir()) == []


def test_what_is_there_is_not_missed() -> None:
    assert missing_extra("rl", "training") == ""
    require_extra("rl", "training")


def test_one_missing_module_of_several_is_named() -> None:
    code = (
        'import sys; sys.modules["torch"] = None; from aidsr.core.extras import missing_extra; '
        'print(missing_extra("rl", "training"))'
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said == f'training needs the extra "rl", and module torch is not installed: {installing("rl")}\n'


def test_an_extra_is_installed_into_this_python_from_where_aidsr_came(tmp_path: Path) -> None:
    command = shlex.split(installing("rl"))
    assert command[:4] == [sys.executable, "-m", "pip", "install"]
    assert command[4:] == ["-c", str(ROOT / "constraints.txt"), "-e", f"{ROOT}[rl]"]
    elsewhere = installing("rl", tmp_path)
    assert "from where you got it" in elsewhere
    assert f'"{sys.executable}" -m pip' in elsewhere
    assert "aidsr[" not in elsewhere, "the name is on no index"


def test_extras_are_those_of_the_installation() -> None:
    offered = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    brought_by = packages_distributions()
    for extra, modules in EXTRAS.items():
        packages = {re.split(r"[\[<>=~ ]", each)[0].replace("-", "_") for each in offered[extra]}
        for module in modules:
            if module in brought_by:
                assert packages & {each.replace("-", "_") for each in brought_by[module]}, (
                    f"{module} is not brought by {extra}"
                )


def test_nobody_else_looks_for_modules() -> None:
    for path in sorted((ROOT / "src" / "aidsr").rglob("*.py")):
        if path.name != "extras.py":
            assert not re.search(r"find_spec|except (ModuleNotFound|Import)Error as", path.read_text()), path


def test_playing_and_its_words_need_no_learning_library(tmp_path: Path) -> None:
    """`assemble` says what keeps a policy from being valid, and `play` whether one would be: both without training."""
    blocked = list(EXTRAS["rl"])
    code = (
        f"import sys; sys.modules.update(dict.fromkeys({blocked!r}))\n"
        "import aidsr.learn.episodes.plausibility, aidsr.tools.recording, aidsr.tools.playing, aidsr.tools.motions\n"
        "aidsr.tools.recording.validity_in_words([])\n"
        "print(any(name.startswith('aidsr.learn.rl') for name in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, "False"), done.stderr
