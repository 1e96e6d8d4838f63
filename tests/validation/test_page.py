"""The page about a report: everything in one file, every fault with what it was read off."""

from __future__ import annotations

import functools
import re

import faulty
import pytest
import robots
from lxml import etree

from aidsr.sandbox.isolated import _FUNCTIONS
from aidsr.validation import validate
from aidsr.validation.page import TracedReport, page_html, trace_report
from aidsr.validation.page.trace import trace_isolated
from aidsr.validation.rules_page import EXAMPLE_ARM
from aidsr.validation.validator import examine


@functools.cache
def strong_arm() -> tuple[str, TracedReport]:
    text = faulty.arm(bend_rad=3)
    return text, trace_report(text)


def page(text: str, found: TracedReport, **options: object) -> str:
    return page_html(text, found, file="robot.xml", **options)  # type: ignore[arg-type]


@functools.cache
def good_page() -> str:
    return page(robots.arm(), trace_report(robots.arm()))


def words(html: str) -> str:
    return " ".join(re.sub(r"<style>.*?</style>|<[^>]+>", " ", html, flags=re.DOTALL).split())


def test_what_is_traced_is_what_is_validated() -> None:
    text, found = strong_arm()
    assert found.report == validate(text)


def test_the_page_may_take_as_long_as_the_report() -> None:
    (validating, tracing) = (_FUNCTIONS[f"{call.__module__}:{call.__name__}"] for call in (examine, trace_isolated))
    assert tracing.limits == validating.limits


def test_the_curve_of_a_fast_cable_peaks_at_what_was_measured() -> None:
    """A slack cable far from the backbone moves faster than it does under tension."""
    text = EXAMPLE_ARM.replace('pos="-0.009 0', 'pos="-0.02 0')
    for tendon, force_n in (("front", 150), ("back", 20)):
        pull = f'tendon="{tendon}" gear="-1" ctrlrange="0 '
        text = text.replace(f"{pull}20", f"{pull}{force_n}")
    found = trace_report(text, realizable=True, select=["actuator_speed"])
    (fault,), (signal,) = found.report.faults, found.signals
    assert signal is not None
    assert fault.names == ("pull_front", "pull_back")
    assert max(max(line.values) for line in signal.lines) == pytest.approx(fault.measured, rel=1e-3)


def test_a_bad_robot_has_a_page() -> None:
    text, found = strong_arm()
    html = page(text, found)
    said = words(html)
    assert "Sound, in scope, with warnings" in said
    assert "actuator_overforce" in said
    assert "limit 34.3" in said
    assert "What each actuator did" in said
    assert html.count("<svg") == 1 + 2 * 4
    assert "data:image/png;base64," in html


def test_a_good_robot_has_a_page_with_its_motors() -> None:
    said = words(good_page())
    assert "Sound, in scope no faults found" in said
    assert "Feetech" in said
    assert "What is wrong" not in said


def test_load_errors_show_their_lines() -> None:
    text = robots.arm().replace("><", ">\n<").replace("stiffness=", "stifness=", 3)
    html = page(text, trace_report(text))
    assert "Cannot be loaded" in words(html)
    assert "3 times" in words(html)
    assert '<div class="at">' in html
    assert "<img" not in html


def test_nothing_of_the_page_is_fetched_or_run() -> None:
    html = good_page()
    assert not re.findall(r"<(?:script|link|iframe)|@import|url\(", html)
    assert not re.findall(r'(?:src|href)="(?!data:|#)', html)


def test_names_cannot_become_markup() -> None:
    """A name may hold anything; on the page and in the plots it is text."""
    evil = "&lt;script&gt;$x_{"
    text = faulty.arm(bend_rad=3).replace('"m0"', f'"{evil}"')
    html = page(text, trace_report(text))
    assert "<script" not in html
    assert "&lt;script&gt;$x_{" in html
    drawn = re.findall(r"<figure>(<svg.*?</svg>)", html, re.DOTALL)
    assert drawn
    for svg in drawn:
        etree.fromstring(svg)


def test_plots_take_the_colours_of_the_page() -> None:
    text, found = strong_arm()
    (svg,) = re.findall(r"<figure>(<svg.*?</svg>)", page(text, found), re.DOTALL)
    assert "var(--curve-1)" in svg
    assert not re.findall(r"#0[1-5]0[1-5]0\d", svg)


def test_the_same_robot_has_the_same_page() -> None:
    text, found = strong_arm()
    assert page(text, trace_report(text)) == page(text, found)


def test_the_fall_of_a_root_without_a_name_is_its_own() -> None:
    floor = '<worldbody><geom type="plane" size="1 1 1"/>'
    text = robots.crawler().replace("<worldbody>", floor).replace('name="trunk" pos="0 0 0.03"', 'pos="0 0 0.3"')
    found = trace_report(text.replace('objname="trunk"', 'objname="l0_mount"'))
    ((fault,), (signal,)) = found.report.faults, found.signals
    assert signal is not None
    assert (fault.code, fault.names) == ("base_not_attached", ("body 1",))
    assert signal.lines[0].values[-1] == pytest.approx(fault.measured, abs=1e-4)


@pytest.mark.parametrize("character", ["\u2028", "\x85", "\u2029"])
def test_lines_are_counted_as_xml_counts_them(character: str) -> None:
    text = f"<mujoco>\n<!-- a{character}b -->\r\n<worldbody>\n<geom sise='1'/>\n</worldbody></mujoco>"
    html = page(text, trace_report(text))
    assert any("sise" in marked for marked in re.findall(r'<div class="at">(.*?)</div>', html, re.DOTALL))
