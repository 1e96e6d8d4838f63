"""Calls on a time axis: when each was, and how tokens and money added up."""

import re
from pathlib import Path

import pytest
from browser import Server, browsing, open_tab
from made import SCRIPT, made_run
from playwright.sync_api import expect

from aidsr.apps.web.call_chart import ChartedCall, call_chart_svg
from aidsr.core.calls import CallRecord, Finish, Message, Question, Usage


def call(
    role: str, started: str, latency_s: float, cost_usd: float | None = 0.1, finish: Finish = "stop"
) -> ChartedCall:
    record = CallRecord(
        question=Question(role=role, messages=(Message(role="user", text="?"),)),
        model="made:up",
        reply="!",
        finish=finish,
        usage=Usage(calls=1, input_tokens=1500, output_tokens=500, cost_usd=cost_usd, latency_s=latency_s),
        started=f"2026-01-31T{started}+00:00",
    )
    return ChartedCall(record, f"{role} {SCRIPT}", f"#{role}")


def test_calls_stand_at_their_time_and_long_breaks_are_cut() -> None:
    drawn = call_chart_svg(
        [call("judge", "23:00:00", 60.0), call("coder", "10:00:00", 100.0), call("coder", "10:01:40", 300.0)]
    )
    assert drawn.index(">coder</text>") < drawn.index(">judge</text>"), "in the order in which they begin"
    bars = [
        (float(x), float(width)) for x, width in re.findall(r'class="call" x="([\d.]+)".*? width="([\d.]+)"', drawn)
    ]
    whole_s = 100 + 300 + 600 + 60
    scale = (640 - 76 - 56) / whole_s
    wanted = [(76, 100 * scale), (76 + 100 * scale, 300 * scale), (76 + 1000 * scale, 60 * scale)]
    for bar, each in zip(bars, wanted, strict=True):
        assert bar == pytest.approx(each, abs=0.1)
    assert "6 k" in drawn
    assert "$0.30" in drawn
    assert "17 min 40 s" in drawn
    assert "<script" not in drawn


def test_what_has_no_price_or_failed_says_so() -> None:
    assert call_chart_svg([]) == ""
    drawn = call_chart_svg([call("coder", "10:00:00", 1.0, None, "length")])
    assert "cost" not in drawn
    assert "call bad" in drawn


def test_a_call_in_the_chart_leads_to_its_line(runs: Path, server: Server) -> None:
    run = made_run(runs, designs=2)
    with browsing() as visitor:
        page = visitor.new_page()
        page.goto(server.address(f"/run/{run.path.name}"))
        open_tab(page, "Log")
        calls = page.get_by_role("group", name="calls over time").get_by_role("link")
        expect(calls).to_have_count(2)
        calls.last.click()
        expect(page.locator(".entry:target")).to_contain_text("Coder called made:up")
