"""docs/task_reference.md is what the tasks' fields say, and says everything about every task."""

import re
from pathlib import Path

import pytest

from aidsr.apps.cli import main
from aidsr.tasks import TASKS
from aidsr.tasks.reference import task_reference

DOCS = Path(__file__).parents[2] / "docs"
PAGE = task_reference(TASKS.values())


def test_the_page_in_the_docs_is_up_to_date(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["tasks", "--page"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == PAGE
    assert (DOCS / "task_reference.md").read_text(encoding="utf-8") == PAGE, (
        "run: aidsr tasks --page > docs/task_reference.md"
    )


@pytest.mark.parametrize("name", TASKS)
def test_every_task_has_a_section_with_a_picture_and_all_facts(name):
    section = PAGE[PAGE.index(f"## {name}\n") :].split("\n## ")[0]
    (picture,) = re.findall(r"!\[\w+\]\((images/tasks/\w+\.png)\)", section)
    assert (DOCS / picture).exists()
    for fact in ("varies", "base", "progress", "stages", "success", "penalty", "ends early", "time"):
        (text,) = re.findall(rf"^\| {fact} \| (.+) \|$", section, re.MULTILINE)
        assert len(text) > 3
    rows = re.findall(r"^\| f(\d+)(?:-f\d+)? \|", section, re.MULTILINE)
    assert rows[0] == "1"
    assert len(rows) >= 4
    assert "\nSource: " in section or name == "grasping/delicate_grasping"


@pytest.mark.parametrize("kind", TASKS.values(), ids=TASKS)
def test_stages_rise_to_the_whole_of_progress(kind):
    starts = [start for start, _ in kind.stages]
    assert starts == sorted(starts)
    assert starts[0] > 0.0
    assert starts[-1] == 1.0
