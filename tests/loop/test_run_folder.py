"""What a whole run leaves behind: the files of the layout and no others, and a page that needs nothing else."""

import re
from html.parser import HTMLParser

import pytest

from aidsr import runs
from aidsr.core.artifacts import Decision
from aidsr.core.config import RunConfig
from aidsr.loop.human import DecisionFile
from aidsr.loop.runner import run_designs
from aidsr.runs import LAYOUT, Run, RunRecord, write_summary
from aidsr.runs.events import Waiting
from aidsr.studies.jobs import VERIFIED
from aidsr.studies.planned import training_folder_of
from scripted import Script, Scripted, brief, new_run, parts


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Run:
    """Approved after a mechanical repair and a refinement with mark-up in them; never stable; stopped by a bug."""
    scripts = [
        Script(robots=["chatter", "misspelt"], verdicts=["integrator", "pass"]),
        Script(robots=["no_effect<b>"]),
        Script(placements=[ZeroDivisionError("by <zero>")]),
    ]
    run = new_run(tmp_path_factory.mktemp("runs"), concepts=3, iterations=2, human=True)

    def decide(number, event) -> None:
        if isinstance(event, Waiting):
            first = not list(run.path.rglob("decision.json"))
            answer = Decision(verdict="refine", text="<i>longer</i>") if first else Decision(verdict="approve")
            run.design(number).iteration(event.iteration).decision.write(answer)

    run_designs(run, parts(Scripted(scripts), person=DecisionFile(poll_s=0.01)), decide)
    return run


def pattern(text: str) -> re.Pattern[str]:
    expression = re.escape(text).replace("NNNN", r"\d{4}").replace("ROLE", "(designer|coder|integrator|judge)")
    expression = expression.replace("/II/", r"/\d\d/").replace("/N/", r"/\d+/").replace("/NNN/", r"/\d{3}/")
    return re.compile(expression + ".+" if text.endswith("/") else expression)


def test_every_file_is_in_the_layout(run) -> None:
    patterns = [pattern(text) for text, _ in LAYOUT]
    files = {path.relative_to(run.path).as_posix() for path in run.path.rglob("*") if path.is_file()}
    assert not [file for file in files if not any(each.fullmatch(file) for each in patterns)]
    missing = [text for text, _ in LAYOUT if not any(pattern(text).fullmatch(file) for file in files)]
    asked_for = {
        "goal.toml",
        "starting_robot.xml",
        "budget.json",
        "designs/N/outcome_before_M.json",
        "designs/N/export/",
    }
    calls = {f"{home}calls/NNNN_ROLE{end}" for home in ("", "designs/N/II/") for end in (".json", ".unusable.json")}
    later = {
        "search.json",
        "designs/N/probe.json",
        "designs/N/probe.png",
        "designs/N/probe.mp4",
        "designs/N/II/task_report.json",
        "designs/N/export/",
    }
    later |= {"designs/N/II/measured_again.json"}
    learned = {"designs/N/training/NNN/", "designs/N/verified.json"}
    measured = {"designs/N/II/tools/NNNN_TOOL.json", "designs/N/II/work/"}
    assert set(missing) == {*asked_for, *calls, *later, *learned, *measured}


def test_what_a_study_adds_is_in_the_layout(run) -> None:
    patterns, design = [pattern(text) for text, _ in LAYOUT], run.design(1)
    for added in (design.path / VERIFIED, training_folder_of(design, 0) / "config.json"):
        assert any(each.fullmatch(added.relative_to(run.path).as_posix()) for each in patterns)


class Page(HTMLParser):
    """What a page shows and where it points."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.tags: list[str] = []
        self.words = ""
        self.feed(html)

    def handle_starttag(self, tag, attrs) -> None:
        self.tags.append(tag)
        self.addresses += [value for name, value in attrs if name in ("href", "src")]

    def handle_data(self, data) -> None:
        self.words += " ".join(data.split()) + " "


@pytest.fixture(scope="module")
def page(run) -> Page:
    return Page(run.summary.read_text())


def test_the_page_needs_nothing_but_the_run(run, page) -> None:
    inline = [address for address in page.addresses if address.startswith("data:image/png;base64,")]
    others = set(page.addresses) - set(inline)
    assert inline
    assert all((run.path / address).is_file() for address in others)
    assert "designs/1/final.xml" in others
    assert "://" not in re.sub(r"data:[^\"]+", "", run.summary.read_text())
    assert "script" not in page.tags


def test_the_page_says_what_happened(page) -> None:
    assert "1 of 3" in page.words
    for said in (
        "not a language model",
        "approved",
        "invalid",
        "stopped",
        "chatter was seen",
        "Too short.",
        "by <zero>",
        "automatic fixes 2",
        "Automatic fix: <robot>: renamed",
    ):
        assert said in page.words, said


def test_what_others_wrote_is_shown_and_not_obeyed(page) -> None:
    assert "<i>longer</i>" in page.words
    assert "no_effect<b>" in page.words
    assert not {"i", "b", "robot"} & set(page.tags[page.tags.index("h2") :])


def test_a_run_that_waits_says_what_to_do_and_reloads(tmp_path) -> None:
    run, seen = new_run(tmp_path, human=True), []

    def look(number, event) -> None:
        if isinstance(event, Waiting):
            seen.append(write_summary(run).read_text())
            run.design(number).iteration(event.iteration).decision.write(Decision(verdict="approve"))

    run_designs(run, parts(Scripted(), person=DecisionFile(poll_s=0.01)), look)
    assert "waiting for you" in seen[0]
    assert "designs/1/01/decision.json" in seen[0]
    assert 'http-equiv="refresh"' in seen[0]
    assert 'http-equiv="refresh"' not in run.summary.read_text()


def test_a_language_model_is_named_on_the_page(tmp_path) -> None:
    config = RunConfig(model="tiny@http://localhost:9/v1")
    record = RunRecord(objective="reach", config=config, started="2026-01-31T10:02:59+01:00", versions={})
    page = write_summary(runs.new_run(tmp_path, record, brief())).read_text()
    assert "tiny@http://localhost:9/v1" in page
    assert "not a language model" not in page
