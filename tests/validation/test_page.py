"""The page about a report: everything in one file, every fault with what it was read off."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable

import faulty
import pytest
import robots
from lxml import etree

from aidsr.validation import validate
from aidsr.validation.page import Traced, page_html, traced
from aidsr.validation.page.traces import Signal

MOVING: dict[str, tuple[Callable[[], str], bool]] = {
    "numerical_instability": (faulty.unstable, False),
    "chatter": (faulty.hammering_servos, False),
    "gravity_collapse": (lambda: faulty.arm(sag=20), False),
    "passive_collapse": (faulty.sprung, False),
    "underdamped": (faulty.ringing, False),
    "base_not_attached": (faulty.fixed_but_free, False),
    "free_fall": (faulty.sliding_base, False),
    "energy_growth": (
        lambda: faulty.swapped(r'(<joint name="j2[xy]" [^>]*damping=)"[^"]*"', r'\1"-0.001"', faulty.arm()),
        False,
    ),
    "limit_overrun": (lambda: faulty.overrun(9, radius_m=0.011), False),
    "self_collision_lock": (faulty.locked_by_contact, False),
    "antagonist_lock": (faulty.locked_servos, False),
    "too_stiff": (lambda: faulty.stiff(200), False),
    "sensor_constant": (faulty.still_sensors, False),
    "tendon_pushes": (faulty.pushing, True),
    "actuator_overforce": (lambda: faulty.arm(bend_rad=3), True),
    "actuator_power": (faulty.strong_and_quick, True),
    "actuator_speed": (faulty.quick, True),
}


@functools.cache
def seen(code: str) -> Traced:
    """What a robot with one fault did; every trace costs a whole battery, and tests only read it."""
    make, realizable = MOVING[code]
    return traced(make(), realizable=realizable)


@functools.cache
def strong_arm() -> tuple[str, Traced]:
    text = faulty.arm(bend_rad=3)
    return text, traced(text)


def page(text: str, found: Traced, **options: object) -> str:
    return page_html(text, found, file="robot.xml", **options)  # type: ignore[arg-type]


@functools.cache
def good_page() -> str:
    return page(robots.arm(), traced(robots.arm()))


def words(html: str) -> str:
    return " ".join(re.sub(r"<style>.*?</style>|<[^>]+>", " ", html, flags=re.DOTALL).split())


@pytest.mark.parametrize("code", MOVING)
def test_a_fault_has_the_signal_it_was_read_off(code: str) -> None:
    found = seen(code)
    index = [fault.code for fault in found.report.faults].index(code)
    signal = found.signals[index]
    assert isinstance(signal, Signal)
    assert signal.lines
    assert signal.test
    assert all(len(line.values) == len(signal.time_s) <= 240 for line in signal.lines)


@pytest.mark.parametrize("code", ["actuator_overforce", "actuator_power", "actuator_speed", "chatter", "limit_overrun"])
def test_a_signal_crosses_its_limit(code: str) -> None:
    found = seen(code)
    signal = found.signals[[fault.code for fault in found.report.faults].index(code)]
    assert signal is not None
    assert signal.limits
    values = [value for line in signal.lines for value in line.values]
    assert max(values) > max(signal.limits) or min(values) < min(signal.limits)


def test_what_is_traced_is_what_is_validated() -> None:
    text, found = strong_arm()
    assert found.report == validate(text)


def test_a_bad_robot_has_a_page() -> None:
    text, found = strong_arm()
    html = page(text, found)
    said = words(html)
    assert "Stable, with warnings" in said
    assert "actuator_overforce" in said
    assert "limit 34.3" in said
    assert "What each actuator did" in said
    assert html.count("<svg") == 1 + 2 * 4
    assert "data:image/png;base64," in html


def test_a_good_robot_has_a_page_with_its_motors() -> None:
    said = words(good_page())
    assert "Stable no faults found" in said
    assert "Feetech" in said
    assert "What is wrong" not in said


def test_load_errors_show_their_lines() -> None:
    text = robots.arm().replace("><", ">\n<").replace("stiffness=", "stifness=", 3)
    html = page(text, traced(text))
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
    html = page(text, traced(text))
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
    assert page(text, traced(text)) == page(text, found)
