"""What recorded conversations cost with prompts as a session builds them now."""

from __future__ import annotations

from pathlib import Path

from benchmarks.teams.prompt_size import TRANSCRIPTS, cost, table

README = Path(__file__).parents[2] / "benchmarks" / "teams" / "README.md"


def test_the_recorded_conversations_cost_less_than_half_and_as_much_as_the_page_says() -> None:
    costs = [cost(folder) for folder in sorted(TRANSCRIPTS.iterdir())]
    assert len(costs) == 6
    assert table(costs) in README.read_text(encoding="utf-8"), "run: python -m benchmarks.teams.prompt_size"
    longest = max(costs, key=lambda one: one.calls)
    assert longest.now < longest.recorded / 2
    assert max(longest.prompts) < 1.5 * min(longest.prompts), "a prompt grows with the number of calls"
