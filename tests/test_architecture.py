"""What holds for the tree as a whole: what imports load, that every module says what it is."""

import ast
import importlib
import pkgutil
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import aidsr

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "src" / "aidsr").rglob("*.py"))
MODULES = sorted(m.name for m in pkgutil.walk_packages(aidsr.__path__, "aidsr.") if not m.name.endswith("__main__"))
PROVIDERS = {"pydantic_ai", "openai", "anthropic", "google.genai", "httpx"}
LEARNING = {"torch", "gymnasium", "stable_baselines3"}


def loaded_by(code: str) -> set[str]:
    """Return the names of all modules a fresh interpreter has loaded after running the code."""
    answer = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys\nprint(*sys.modules)"], capture_output=True, text=True, check=True
    )
    return set(answer.stdout.splitlines()[-1].split())


def test_importing_aidsr_loads_almost_nothing() -> None:
    assert not loaded_by("import aidsr") & (PROVIDERS | LEARNING | {"mujoco", "numpy", "pydantic"})


def test_validating_loads_neither_learning_nor_a_language_models_client() -> None:
    code = "import aidsr\nassert not aidsr.validate('<mujoco/>').stable"
    assert not loaded_by(code) & (PROVIDERS | LEARNING)


def test_the_loop_loads_neither_a_team_that_does_not_play_nor_mujoco() -> None:
    loaded = loaded_by("import aidsr.loop.runner, aidsr.loop.run")
    assert "mujoco" not in loaded
    assert not {name for name in loaded if name.startswith(("aidsr.teams.measuring", "aidsr.tools", "aidsr.learn"))}


@pytest.mark.parametrize("name", MODULES)
def test_every_module_says_what_it_is_and_keeps_its_promises(name: str) -> None:
    module = importlib.import_module(name)
    assert module.__doc__, f"{name} has no docstring"
    missing = [public for public in getattr(module, "__all__", ()) if not hasattr(module, public)]
    assert not missing, f"{name}.__all__ promises {missing}"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT / "src")))
def test_randomness_comes_from_an_explicit_generator(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            assert "random" not in {alias.name for alias in node.names}
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) in {"np.random", "numpy.random"}:
            assert node.attr in {"Generator", "default_rng", "SeedSequence"}, ast.unparse(node)


def test_readme_and_ci_share_their_commands() -> None:
    ci, readme = (ROOT / ".ci" / "run").read_text(), (ROOT / "README.md").read_text()
    for command in ("make check", "make test"):
        assert command in ci
        assert command in readme


def test_the_design_page_has_the_layers_of_the_contract() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    written = "\n".join("    " + re.sub(r"aidsr\.|[()]", "", layer) for layer in layers)
    assert f"\n{written}\n" in (ROOT / "docs" / "design.md").read_text()


def test_no_exception_is_swallowed() -> None:
    for path in SOURCES:
        assert not re.search(r"except( Exception| BaseException)?:\s*\n\s*(pass|continue)\b", path.read_text()), path


def test_benchmarks_import_what_exists() -> None:
    for path in sorted((ROOT / "benchmarks").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "aidsr":
                module = importlib.import_module(str(node.module))
                for alias in node.names:
                    known = hasattr(module, alias.name) or f"{node.module}.{alias.name}" in MODULES
                    assert known, f"{path.relative_to(ROOT)}: {node.module} has no {alias.name}"


def test_no_two_test_files_share_a_name() -> None:
    names = [path.name for path in (ROOT / "tests").rglob("test_*.py")]
    assert not {name for name in names if names.count(name) > 1}, "pytest cannot collect both"
