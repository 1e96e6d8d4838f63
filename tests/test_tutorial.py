"""The tutorial runs from its first cell to its last, with public names only, and holds its pictures."""

import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType

import pytest

import aidsr

ROOT = Path(__file__).parents[1]
PATH = ROOT / "docs" / "tutorial.ipynb"
NOTEBOOK = json.loads(PATH.read_text(encoding="utf-8"))
CODE = [cell for cell in NOTEBOOK["cells"] if cell["cell_type"] == "code"]


def load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def kinds(notebook: dict) -> list[list[list[str]]]:
    """What each cell gave: printed text, a picture, a value."""
    return [[sorted(output.get("data", ["text"])) for output in cell.get("outputs", [])] for cell in notebook["cells"]]


def printed(notebook: dict) -> str:
    return "".join(
        line for cell in notebook["cells"] for output in cell.get("outputs", []) for line in output.get("text", [])
    )


def test_the_tutorial_uses_public_names_only() -> None:
    source = "\n".join("".join(cell["source"]) for cell in CODE)
    used = set(re.findall(r"\baidsr\.(\w+)", source))
    assert {"design", "validate", "fix", "probe", "train", "evaluate", "export"} <= used <= set(aidsr.__all__)
    assert "from aidsr" not in source


def test_the_tutorial_is_small_and_holds_its_outputs() -> None:
    assert PATH.stat().st_size < 1_500_000
    pictures = [output for cell in CODE for output in cell["outputs"] if "image/png" in output.get("data", {})]
    assert len(pictures) == 5
    assert [cell["execution_count"] for cell in CODE] == list(range(1, len(CODE) + 1))


def test_links_of_the_tutorial_lead_somewhere() -> None:
    text = "\n".join("".join(cell["source"]) for cell in NOTEBOOK["cells"] if cell["cell_type"] == "markdown")
    targets = re.findall(r"\]\(([^)#\s]+)", text)
    assert targets
    assert not [target for target in targets if not (PATH.parent / target).exists()]


def test_the_page_made_of_the_tutorial_has_every_cell_and_picture() -> None:
    text, pictures = load(ROOT / "docs" / "notebook.py").as_markdown(NOTEBOOK)
    assert text.count("```python") == len(CODE)
    assert len(pictures) == 5
    for name, picture in pictures.items():
        assert f"]({name})" in text
        assert picture.startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_tutorial_runs_and_prints_what_it_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    notebook = json.loads(PATH.read_text(encoding="utf-8"))
    load(ROOT / "benchmarks" / "readme" / "tutorial.py").run(notebook)
    assert kinds(notebook) == kinds(NOTEBOOK)
    for text, times in (
        ("approved", 3),
        ("numerical_instability at", 1),
        ("stable: no faults found", 2),
        ("buildable", 1),
    ):
        assert printed(notebook).count(text) == printed(NOTEBOOK).count(text) == times
