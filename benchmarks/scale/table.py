"""Estimate the cost of the paper's whole study from the jobs of a smaller study: the table of docs/studies.md.

    python benchmarks/scale/table.py build/builtin-60000

Hours come from the study's trainings, tokens from benchmarks/manual/results.md and from the paper, dollars from list
prices. Nothing is measured here.
"""

from __future__ import annotations

import argparse
import re
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

from aidsr.core.config import BUDGET_STEPS
from aidsr.studies.outcomes import DesignRow, read_outcomes
from aidsr.studies.planned import training_folder_of
from aidsr.studies.study import Study, open_study
from aidsr.studies.tables import PAPER
from aidsr.tasks import TASKS_IN_SAMPLE
from aidsr.teams.providers import price_usd

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "studies.md"
MANUAL = ROOT / "benchmarks" / "manual" / "results.md"
MARKS = "<!-- made by benchmarks/scale/table.py -->", "<!-- to here -->"
DESIGNS = 15
ARMS = 8
"""Number of arms of the paper: full, with a person, a person only, four without a part, direct."""
CORES = (2, 64, 1000)
MODELS = ("openai:gpt-5", "openai:gpt-5-mini", "anthropic:claude-sonnet-4-5", "google:gemini-2.5-pro")


@dataclass(frozen=True)
class Costs:
    """Seconds of one core for one design, mean over the tasks."""

    design_s: float
    training_s: float
    judging_s: float
    longest_s: float
    policies: int
    tasks: int

    @property
    def total_s(self) -> float:
        """Seconds of one core for a design that is trained once."""
        return self.design_s + self.training_s + self.judging_s


def measured(study: Study) -> Costs:
    """Return the mean costs of a study's designs, with trainings scaled to the benchmark's whole budget of steps."""
    cells = {(cell.arm, cell.task, cell.number): cell for cell in study.cells}
    by_task: dict[str, list[tuple[float, float, float]]] = {}
    for row in read_outcomes(study):
        run = study.run(cells[row.arm, row.task, row.run])
        if row.evaluations and run:
            judging = _judging_s(training_folder_of(run.design(row.design), 0))
            by_task.setdefault(row.task, []).append((row.latency_s, _to_the_budget(row), judging))
    means = [tuple(fmean(values) for values in zip(*rows, strict=True)) for rows in by_task.values()]
    design_s, training_s, judging_s = (fmean(values) for values in zip(*means, strict=True))
    longest = max(training for _, training, _ in means)
    return Costs(design_s, training_s, judging_s, longest, sum(map(len, by_task.values())), len(by_task))


def _to_the_budget(row: DesignRow) -> float:
    return row.training_s / row.steps * BUDGET_STEPS


def _judging_s(training: Path) -> float:
    """Return the duration of a policy's evaluation [s], without the films.

    It is the time between the last changes of training.json and evaluation.json.
    """
    ended, judged = (training / name for name in ("training.json", "evaluation.json"))
    seconds = judged.stat().st_mtime - ended.stat().st_mtime
    return max(0.0, seconds)


def visible_tokens() -> tuple[float, float]:
    """Return the mean input and output tokens of a design, over the designs answered by hand."""
    rows = re.findall(r"\| ([\d,]+) \| ([\d,]+) \|$", MANUAL.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return tuple(fmean(int(row[column].replace(",", "")) for row in rows) for column in (0, 1))  # type: ignore[return-value]


def table(study: Study) -> str:
    """Return the tables as Markdown."""
    costs, tasks = measured(study), len(TASKS_IN_SAMPLE)
    designs = tasks * DESIGNS
    lines = [
        f"Measured: {costs.policies} policies of the built-in team on {costs.tasks} of {tasks} tasks, one or two "
        f"jobs at a time on two shared cores ({study.plan.steps:,} steps a policy, stretched to the budget of "
        f"{BUDGET_STEPS:,}; as if all were approved, and none ended early). Mean over tasks, seconds of one core: "
        f"designing {costs.design_s:.0f}, training {costs.training_s:,.0f}, judging {costs.judging_s:.0f}; the slowest "
        f"task trains {costs.longest_s:,.0f}.",
        "",
        "| study | designs | core hours | " + " | ".join(f"{cores:,} cores" for cores in CORES) + " |",
        "|---|---:|---:|" + "---:|" * len(CORES),
        _hours("one arm, one seed", designs, costs),
        _hours(f"the paper's {ARMS} arms, one seed", ARMS * designs, costs),
        _hours(f"the paper's {ARMS} arms, five seeds", ARMS * designs, costs, seeds=5),
        "",
        "| what a design takes | tokens in | tokens out | model | a design | one arm | all arms |",
        "|---|---:|---:|---|---:|---:|---:|",
        _dollars("published", f"{PAPER.tokens:,} in all", "", "GPT-5", PAPER.cost_usd, designs),
    ]
    tokens_in, tokens_out = visible_tokens()
    for model in MODELS:
        price = price_usd(model, round(tokens_in), round(tokens_out))
        lines.append(
            _dollars("visible tokens, measured", f"{tokens_in:,.0f}", f"{tokens_out:,.0f}", model, price, designs)
        )
    return "\n".join(lines)


def _hours(name: str, designs: int, costs: Costs, seeds: int = 1) -> str:
    hours = designs * (costs.design_s + seeds * (costs.training_s + costs.judging_s)) / 3600
    # a study takes at least as long as its slowest training
    shown = [max(hours / cores, costs.longest_s / 3600) for cores in CORES]
    return f"| {name} | {designs:,} | {hours:,.0f} | " + " | ".join(f"{each:,.1f} h" for each in shown) + " |"


def _dollars(name: str, tokens_in: str, tokens_out: str, model: str, each: float | None, designs: int) -> str:
    shown = (
        ["unknown"] * 3
        if each is None
        else [f"${each:.2f}", f"${designs * each:,.0f}", f"${ARMS * designs * each:,.0f}"]
    )
    return "| " + " | ".join([name, tokens_in, tokens_out, model, *shown]) + " |"


def main() -> None:
    """Write the tables into docs/studies.md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path, help="a study with trained designs")
    study = open_study(parser.parse_args().study)
    before, rest = PAGE.read_text(encoding="utf-8").split(MARKS[0])
    after = rest.split(MARKS[1])[1]
    PAGE.write_text(f"{before}{MARKS[0]}\n{table(study)}\n{MARKS[1]}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
