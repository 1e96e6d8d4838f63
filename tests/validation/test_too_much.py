"""Robots that ask for more memory, contacts or magnitude than can be simulated end in a report, not an exception."""

from __future__ import annotations

import pytest

from aidsr.validation import validate
from aidsr.validation.rules_page import EXAMPLE_ARM


def _with_asset(*assets: str) -> str:
    return EXAMPLE_ARM.replace("<worldbody>", f"<asset>{''.join(assets)}</asset>\n<worldbody>", 1)


def _beside(bodies: str) -> str:
    head, _, tail = EXAMPLE_ARM.rpartition("</worldbody>")
    return f"{head}{bodies}</worldbody>{tail}"


def _heap(count: int) -> str:
    boxes = (
        f'<body name="f{i}" pos="0 0 {5 + 1e-4 * i}"><freejoint/><geom size=".05 .05 .05" type="box"/></body>'
        for i in range(count)
    )
    return _beside("".join(boxes))


def _sensors(*sensors: str) -> str:
    head, _, tail = EXAMPLE_ARM.rpartition("</sensor>")
    return f"{head}{''.join(sensors)}</sensor>{tail}"


TOO_MUCH = {
    "height fields": (
        _with_asset(*(f'<hfield name="h{i}" nrow="1024" ncol="1024" size="1 1 1 1"/>' for i in range(400))),
        "forbidden",
        "samples of all height fields: 5242880, at most 4194304",
    ),
    "cubes": (
        _with_asset(*(f'<texture name="t{i}" type="cube" builtin="flat" width="4096" height="1"/>' for i in range(30))),
        "forbidden",
        "texels of all textures: 100663296, at most 33554432",
    ),
    "a cube by default": (
        _with_asset('<texture name="t" builtin="flat" width="4096" height="1"/>'),
        "forbidden",
        "texels of all textures",
    ),
    "textures": (
        _with_asset(*(f'<texture name="t{i}" type="2d" builtin="flat" width="4096" height="4096"/>' for i in range(9))),
        "forbidden",
        "texels of all textures",
    ),
    "delays of sensors": (
        _sensors(*('<clock nsample="10000" interp="linear" delay="1"/>' for _ in range(15_000))),
        "forbidden",
        "numbers kept for the delays of sensors and actuators: 1010000, at most 1000000",
    ),
    "rays": (
        _sensors('<rangefinder camera="c"/>').replace(
            "<worldbody>", '<worldbody><camera name="c" resolution="4000 4000"/>', 1
        ),
        "forbidden",
        "rays of all range finders: 16000000, at most 10000",
    ),
    "stiffness": (EXAMPLE_ARM.replace('stiffness="1"', 'stiffness="1e308"'), "bad_value", "too large"),
    "gear": (EXAMPLE_ARM.replace('gear="-1"', 'gear="-1e200"'), "bad_value", "too large"),
    "time step": (EXAMPLE_ARM.replace('timestep="0.002"', 'timestep="1e300"'), "bad_value", "too large"),
    "range": (EXAMPLE_ARM.replace('ctrlrange="0 20"', 'ctrlrange="0 1e20"'), "bad_value", "write inf where"),
    "a heap of boxes": (_heap(100), "load_error", "contacts in the drawn pose, at most 2,000"),
    "a larger heap of boxes": (_heap(400), "load_error", "contacts in the drawn pose, at most 2,000"),
    "too little memory": (
        EXAMPLE_ARM.replace("<worldbody>", '<size memory="1K"/><worldbody>', 1),
        "load_error",
        "ran out of memory",
    ),
    "memory for every simulation": (
        EXAMPLE_ARM.replace("<worldbody>", '<size memory="1G"/><worldbody>', 1),
        "load_error",
        "ran out of memory",
    ),
    "memory for the arm and not for its contacts": (
        _heap(30).replace("<worldbody>", '<size memory="400K"/><worldbody>', 1),
        "load_error",
        "ran out of memory",
    ),
}


@pytest.mark.parametrize("name", TOO_MUCH)
def test_it_is_reported(name: str) -> None:
    text, code, words = TOO_MUCH[name]
    assert text != EXAMPLE_ARM
    report = validate(text)
    assert not report.stable
    assert [fault.code for fault in report.faults if words in fault.message + fault.cure] == [code] * len(report.faults)
    assert not report.sound


def test_constraints_that_mujoco_leaves_out_are_a_fault() -> None:
    """Boxes fall on each other: the memory suffices for the contacts of the first pose, and not for later ones."""
    boxes = "".join(
        f'<body name="f{i}" pos="{0.001 * i} 0 {1 + 0.12 * i}"><freejoint/><geom size=".05 .05 .05" type="box"/></body>'
        for i in range(30)
    )
    ground = '<geom name="ground" type="plane" size="1 1 1"/>'
    report = validate(_beside(ground + boxes).replace("<worldbody>", '<size memory="130K"/><worldbody>', 1))
    assert [fault.message for fault in report.faults if "MuJoCo's memory is too small" in fault.message]
