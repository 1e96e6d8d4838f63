"""What of an environment is alike is told once, in the pattern in which it lies, and nothing of it is lost."""

from __future__ import annotations

import re

import numpy as np
import pytest
from agent_samples import shape

from aidsr.core.artifacts import BodySummary, EnvironmentSummary, GeomSummary, Vec3
from aidsr.sim.environment_summary import summarize_environment
from aidsr.tasks import load_task, task_names
from aidsr.teams.llm.arrangements import fit_circle, row_length
from aidsr.teams.llm.describe_environment import describe_environment


def environment(*bodies: BodySummary) -> EnvironmentSummary:
    return EnvironmentSummary(
        gravity_m_s2=(0, 0, -9.81), timestep_s=0.002, mounts=(), bodies=bodies, sites=(), sensors=(), actuators=()
    )


def world(*geoms: GeomSummary) -> BodySummary:
    return BodySummary(name="world", parent="", position_m=(0, 0, 0), mass_kg=0, joints=(), geoms=geoms)


def lines(*geoms: GeomSummary) -> list[str]:
    """Return what is told of shapes, without the list's marks."""
    told = describe_environment(environment(world(*geoms))).partition("- world (does not move)\n")[2]
    return [line.lstrip("- ") for line in told.splitlines()]


def ball(name: str, *position_m: float, **more) -> GeomSummary:
    return shape(name, "sphere", (0.01,), tuple(round(float(value), 6) for value in position_m), **more)


def wall(name: str, angle: float, z: float, half_height: float = 0.1) -> GeomSummary:
    """Return one wall of a pipe of 50 mm outer radius about the z axis."""
    out = tuple(round(float(value), 6) for value in (np.cos(angle), np.sin(angle), 0.0))
    position: Vec3 = (0.048 * out[0], 0.048 * out[1], z)
    return shape(name, "box", (0.002, 0.02, half_height), position, x_axis=out)


def test_a_pipe_of_boxes_is_told_by_its_rings() -> None:
    angles = np.arange(10) * np.pi / 5
    heights = (0.1, 0.3, 0.5)
    walls = [(angle, height) for height in heights for angle in angles]
    assert lines(*(wall(f"pipe_{i}", *where) for i, where in enumerate(walls))) == [
        "3 times 10 boxes evenly in a ring, centres 0.048 from its axis, their x outwards, their z along the axis, "
        "free radius inside 0.046:",
        "pipe_0 to pipe_9: half sizes 0.002 0.02 0.1, about 0 0 0.1 with axis 0 0 1, the first at 0.048 0 0.1",
        "pipe_10 to pipe_19: half sizes 0.002 0.02 0.1, about 0 0 0.3 with axis 0 0 1, the first at 0.048 0 0.3",
        "pipe_20 to pipe_29: half sizes 0.002 0.02 0.1, about 0 0 0.5 with axis 0 0 1, the first at 0.048 0 0.5",
    ]


def test_sizes_in_a_ring_may_differ_a_little_and_not_much() -> None:
    bent = [wall("", angle, 0.1, 0.1 + 0.05 * np.cos(angle)) for angle in np.arange(8) * np.pi / 4]
    assert "half sizes 0.002 0.02 (0.05 to 0.15)" not in "\n".join(lines(*bent))
    (told,) = lines(*(wall("", a, 0.1, round(0.1 + 0.02 * np.cos(a), 6)) for a in np.arange(8) * np.pi / 4))
    assert "half sizes 0.002 0.02 (0.08 to 0.12)" in told


def test_a_ring_whose_parts_do_not_turn_with_it_has_no_width() -> None:
    standing = [wall("", angle, 0.1).model_copy(update={"x_axis": (1, 0, 0)}) for angle in np.arange(8) * np.pi / 4]
    (told,) = lines(*standing)
    assert "8 boxes evenly in a ring" in told
    assert "free radius" not in told


def test_parts_that_turn_otherwise_than_their_ring_are_told_one_by_one() -> None:
    askew = [wall(f"w_{i}", angle, 0.1) for i, angle in enumerate(np.arange(8) * np.pi / 4)]
    askew[5] = askew[5].model_copy(update={"x_axis": (1, 0, 0)})
    assert len(lines(*askew)) == 8


def test_part_of_a_circle_is_told_by_its_ends() -> None:
    angles = np.deg2rad(np.linspace(20, 110, 7))
    logs = [
        shape(f"log_{i}", "cylinder", (0.02, 0.3), (0.2 * np.cos(a), 0, 0.2 * np.sin(a)), z_axis=(0, 1, 0))
        for i, a in enumerate(angles, start=1)
    ]
    assert lines(*logs) == [
        "log_1 to log_7: 7 cylinders evenly on an arc, centres 0.2 from its axis, its z axis along 0 1 0; "
        "radius 0.02, half length 0.3, about 0 0 0 with axis 0 -1 0, from 0.1879 0 0.0684 to -0.0684 0 0.1879"
    ]


def test_a_grid_is_told_by_its_rows() -> None:
    pegs = [ball(f"peg_{i:02}", 0.05 * (i % 4), 0.1 * (i // 4), 0) for i in range(12)]
    assert lines(*pegs) == [
        "3 times 4 spheres, radius 0.01, evenly in a row:",
        "peg_00 to peg_03: from 0 0 0 to 0.15 0 0",
        "peg_04 to peg_07: from 0 0.1 0 to 0.15 0.1 0",
        "peg_08 to peg_11: from 0 0.2 0 to 0.15 0.2 0",
    ]


def test_shapes_in_no_order_share_what_they_have_in_common() -> None:
    assert lines(ball("a_1", 0, 0, 0), ball("a_2", 0.1, 0.3, 0), ball("a_3", 0.5, 0.2, 0.1)) == [
        "a_1 to a_3: 3 spheres, radius 0.01; at 0 0 0, 0.1 0.3 0, 0.5 0.2 0.1"
    ]


def test_of_very_many_in_no_order_the_bounds_are_told() -> None:
    rng = np.random.default_rng(0)
    gravel = [ball("", *place) for place in rng.uniform(-1, 1, (200, 3))]
    (told,) = lines(*gravel)
    assert told.startswith("200 spheres, radius 0.01; in no order within -0.9801 -0.9902 -0.9994 to")


@pytest.mark.parametrize(
    "other",
    [
        ball("post_2", 0.3, 0, 0, grip=((0.1, 0.005, 0.0001), 1)),
        ball("post_2", 0.3, 0, 0, solid=False),
        ball("post_3", 0.3, 0, 0),
        ball("pole_2", 0.3, 0, 0),
        ball("", 0.3, 0, 0),
    ],
    ids=["friction", "only drawn", "another number", "another name", "nameless"],
)
def test_what_is_of_another_kind_or_name_stands_by_itself(other: GeomSummary) -> None:
    first = [ball("post_0", 0.1, 0, 0), ball("post_1", 0.2, 0, 0)]
    assert lines(*first, ball("post_2", 0.3, 0, 0))[0].startswith("post_0 to post_2")
    assert "post_0 to" not in "".join(lines(*first, other))


def drawer(number: int, *, mass_kg: float = 0.2) -> tuple[BodySummary, BodySummary]:
    name, z = f"drawer_{number}", 0.1 * number
    front = shape(f"{name}_front", "box", (0.01, 0.1, 0.04), (0.3, 0, z))
    bar = shape(f"{name}_bar", "cylinder", (0.006, 0.03), (0.25, 0, z), z_axis=(0, 1, 0))
    slide = f"{name}: slide along -1 0 0, 0 to 0.1 m"
    return (
        BodySummary(
            name=name, parent="world", position_m=(0.25, 0, z), mass_kg=mass_kg, joints=(slide,), geoms=(front,)
        ),
        BodySummary(name=f"{name}_handle", parent=name, position_m=(0.25, 0, z), mass_kg=0.03, joints=(), geoms=(bar,)),
    )


def test_bodies_that_are_copies_are_told_by_name_and_place() -> None:
    text = describe_environment(environment(world(), *drawer(1), *drawer(2), *drawer(3)))
    assert text.endswith(
        "- drawer_2 with drawer_2_handle, drawer_3 with drawer_3_handle: each like drawer_1 and all that is on it, "
        "with its own number in all names, at 0.25 0 0.2, 0.25 0 0.3"
    )
    assert "drawer_2_bar" not in text


def test_a_body_that_differs_is_no_copy() -> None:
    heavier = describe_environment(environment(world(), *drawer(1), *drawer(2), *drawer(3, mass_kg=0.3)))
    assert all(f"drawer_{number}_bar" in heavier for number in (1, 2, 3))


def test_many_single_copies_are_named_in_short() -> None:
    bricks = [
        BodySummary(
            name=f"brick_{i}",
            parent="world",
            position_m=(0.1 * i, 0, 0),
            mass_kg=0.1,
            joints=(f"brick_{i}_free: free",),
            geoms=(shape(f"brick_{i}", "box", (0.02, 0.02, 0.02), (0.1 * i, 0, 0)),),
        )
        for i in range(6)
    ]
    assert describe_environment(environment(world(), *bricks)).endswith(
        "- brick_1 to brick_5: each like brick_0, with its own number in all names, "
        "evenly in a row from 0.1 0 0 to 0.5 0 0"
    )


def test_points_lie_in_a_row_or_on_a_circle_only_where_they_do() -> None:
    along = np.outer(np.arange(5), [0.1, 0.02, 0])
    assert row_length(along) == 5
    assert row_length(along[[0, 1, 3]]) == 0
    assert row_length(np.zeros((4, 3))) == 0
    angles = np.arange(9) * 2 * np.pi / 9
    ring = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    found = fit_circle(np.vstack([ring, [[1, 0, 1]]]))
    assert found is not None
    assert (found.count, found.closed) == (9, True)
    helix = ring + np.outer(np.arange(9), [0, 0, 0.01])
    assert fit_circle(helix) is None


@pytest.mark.parametrize("name", task_names())
def test_a_tasks_environment_names_what_the_task_needs_and_every_shape(name: str) -> None:
    task = load_task(name)
    summary = summarize_environment(task.environment)
    text = describe_environment(summary)
    words = set(re.split(r"[^\w]+", text))
    assert set(task.required_names) <= words
    counted = {
        f"{stem}{number}"
        for stem, first, last in re.findall(r"(\w*?)(\d+) to \1(\d+):", text)
        for number in range(int(first), int(last) + 1)
    }
    copied = {body.name for body in summary.bodies if re.search(rf"\b{body.name}\b.*: each like", text)}
    shapes = {geom.name for body in summary.bodies if body.name not in copied for geom in body.geoms if geom.name}
    assert shapes <= words | counted
    assert len(text.encode()) < 2500
