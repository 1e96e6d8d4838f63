"""The docs are true: links lead somewhere, Python examples run, command lines exist."""

import pkgutil
import re
import shlex
from pathlib import Path

import pytest

import aidsr
from aidsr.apps.cli import app

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
RESULTS = [page for page in sorted((ROOT / "benchmarks").rglob("*.md")) if "transcript" not in page.as_posix()]
LINKED = [ROOT / "CHANGELOG.md", *PAGES, *RESULTS]
"""Pages whose links are tested. Records of what a language model read and wrote have the links of their day."""
ENTRY_POINT_GROUPS = ("aidsr.tasks", "aidsr.families", "aidsr.models", "aidsr.rules")
BLOCK = re.compile(r"^```(\w+)[^\n]*\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(language: str) -> list[pytest.param]:
    return [
        pytest.param(text, id=f"{page.name}-{number}", marks=[pytest.mark.slow] * ("aidsr.train(" in text))
        for page in PAGES
        for number, (kind, text) in enumerate(BLOCK.findall(page.read_text()), 1)
        if kind == language
    ]


@pytest.mark.parametrize("page", LINKED, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page: Path) -> None:
    broken = []
    for target in re.findall(r"\]\(([^)\s]+)", page.read_text()):
        path, _, anchor = target.partition("#")
        there = page.parent / path if path else page
        if "://" not in target and not (there.exists() and (not anchor or anchor in anchors(there))):
            broken.append(target)
    assert not broken


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub makes them."""
    titles = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.strip().lower()).replace(" ", "-") for title in titles}


def test_every_page_of_the_docs_is_in_the_navigation() -> None:
    navigation = (ROOT / "mkdocs.yml").read_text().partition("\nnav:")[2]
    pages = [page.relative_to(ROOT / "docs").as_posix() for page in sorted((ROOT / "docs").rglob("*.md"))]
    assert [page for page in pages if not re.search(rf": {re.escape(page)}$", navigation, re.MULTILINE)] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_names_of_code_and_files_exist(page: Path) -> None:
    assert unknown_names(page) == []


def test_names_that_the_code_cites_exist() -> None:
    found = {file.relative_to(ROOT).as_posix(): unknown_names(file) for file in sorted((ROOT / "src").rglob("*.py"))}
    assert {file: names for file, names in found.items() if names} == {}


def unknown_names(page: Path) -> list[str]:
    """Names that do not exist, such as `aidsr.sim.beam.solref` and `tests/sim/test_beam.py`."""
    text = page.read_text()
    names = re.findall(r"`(aidsr(?:\.\w+)+)(?:\([^`]*)?`", text)
    files = re.findall(r"`((?:src|docs|benchmarks|tests|aidsr)/[\w/.-]+\.(?:py|md|toml|jsonl?|xml))`", text)
    files += re.findall(r"\bdocs/[a-z_]+\.md\b", text)
    return [
        *(name for name in names if name not in ENTRY_POINT_GROUPS and not exists(name)),
        *(file for file in files if not any((ROOT / folder / file).exists() for folder in ("", "src"))),
    ]


def exists(name: str) -> bool:
    """Whether a dotted name is a module, an attribute of one, or a field of a class in one."""
    parent, _, last = name.rpartition(".")
    try:
        pkgutil.resolve_name(name)
    except ImportError:
        return False
    except AttributeError:
        return exists(parent) and last in getattr(pkgutil.resolve_name(parent), "__annotations__", {})
    return True


@pytest.mark.parametrize("text", blocks("python"))
def test_python_examples_run(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(text, "example", "exec"), {"__name__": "__main__"})


def test_the_script_of_the_api_runs_without_its_training(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    script = re.search(r"^```python\n(.*?)^```", (ROOT / "docs" / "api.md").read_text(), re.MULTILINE | re.DOTALL)[1]
    before, _, after = script.partition("# 5 ")
    code = before + "# 6 " + after.partition("# 6 ")[2]
    assert "aidsr.export(" in code
    exec(compile(code, "api.md", "exec"), {"__name__": "__main__"})
    assert list(tmp_path.glob("runs/*/designs/1/export/sheet.html"))


def test_the_page_of_the_api_has_every_public_name() -> None:
    page = (ROOT / "docs" / "api.md").read_text()
    assert [name for name in aidsr.__all__ if name != "__version__" and f"::: aidsr.{name}\n" not in page] == []
    assert all(getattr(aidsr, name).__doc__ for name in aidsr.__all__ if name != "__version__")


def test_the_readme_shows_what_its_example_prints(capsys: pytest.CaptureFixture[str]) -> None:
    code, shown = (
        re.search(rf"^```{language}\n(.*?)^```", (ROOT / "README.md").read_text(), re.MULTILINE | re.DOTALL)[1]
        for language in ("python", "text")
    )
    exec(compile(code, "README.md", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out.split() == shown.split()


@pytest.mark.parametrize("text", blocks("bash") + blocks("console") + blocks("sh"))
def test_command_lines_exist(text: str) -> None:
    for line in text.replace("\\\n", " ").splitlines():
        words = shlex.split(line.removeprefix("$ "), comments=True)
        if words[:1] == ["aidsr"]:
            app.parse_args(words[1:], exit_on_error=False, print_error=False)
