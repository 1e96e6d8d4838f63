"""What is read from a compiled model: chains, tendons, actuators, one length, and what of it is the robot."""

from __future__ import annotations

from itertools import product

import mujoco
import numpy as np
import pytest

from aidsr.sim.extent import bounding_box_m
from aidsr.sim.structure import Structure, name_of, names_of, read_structure


def finger(prefix: str, joints: int = 3, axis: str = "0 1 0") -> str:
    text = ""
    for index in reversed(range(joints)):
        place = "0 0 0.1" if index else "0 0 0"
        tip = f'<site name="{prefix}tip" pos="0 0 0.1"/>' if index == joints - 1 else ""
        text = (
            f'<body name="{prefix}{index}" pos="{place}"><joint name="{prefix}j{index}" axis="{axis}"/>'
            f'<geom type="capsule" fromto="0 0 0 0 0 0.1" size="0.01" mass="0.1"/>'
            f'<site name="{prefix}l{index}" pos="0.02 0 0.05"/><site name="{prefix}r{index}" pos="-0.02 0 0.05"/>'
            f"{tip}{text}</body>"
        )
    return text


def cables(prefix: str, base: str = "base", joints: int = 3) -> tuple[str, str]:
    """Tendons on the left and right of a finger, and their motors."""
    tendons = motors = ""
    for side in "lr":
        sites = "".join(f'<site site="{prefix}{side}{index}"/>' for index in range(joints))
        tendons += f'<spatial name="{prefix}{side}"><site site="{base}_{side}"/>{sites}</spatial>'
        motors += f'<motor name="{prefix}m{side}" tendon="{prefix}{side}" gear="-1" ctrlrange="0 1"/>'
    return tendons, motors


def hand(fingers: int = 2, base: str = "", joints: int = 3) -> str:
    bodies = tendons = motors = ""
    for index in range(fingers):
        prefix = f"f{index}"
        bodies += (
            f'<body name="{prefix}base" pos="{index} 0 0"><site name="{prefix}_l" pos="0.02 0 0"/>'
            f'<site name="{prefix}_r" pos="-0.02 0 0"/>{finger(prefix, joints)}</body>'
        )
        ours = cables(prefix, prefix, joints)
        tendons += ours[0]
        motors += ours[1]
    return (
        f'<mujoco><worldbody><body name="palm">{base}<geom size="0.01" mass="1"/>{bodies}</body></worldbody>'
        f"<tendon>{tendons}</tendon><actuator>{motors}</actuator></mujoco>"
    )


def structure_of(mjcf: str) -> tuple[mujoco.MjModel, Structure]:
    model = mujoco.MjModel.from_xml_string(mjcf)
    return model, read_structure(model)


def test_chains_are_series_of_joints() -> None:
    model, structure = structure_of(hand())
    assert [names_of(model, mujoco.mjtObj.mjOBJ_BODY, chain.bodies) for chain in structure.chains] == [
        ("f00", "f01", "f02"),
        ("f10", "f11", "f12"),
    ]
    assert structure.longest_series == 3
    assert structure.chains[0].spacing_m == pytest.approx(0.1)


def test_a_universal_joint_turns_about_one_point() -> None:
    inner = '<body><joint axis="1 0 0"/><body><joint axis="0 1 0"/><geom size="0.1"/>{}</body></body>'
    body = inner.format(inner.replace("<body>", '<body pos="0 0 0.3">', 1).format(""))
    _, structure = structure_of(
        f"<mujoco><compiler inertiafromgeom='true' boundmass='0.001' boundinertia='1e-6'/>"
        f"<worldbody>{body}</worldbody></mujoco>"
    )
    assert structure.longest_series == 2
    assert len(structure.chains[0].bodies) == 2
    assert len(structure.chains[0].joints) == 4


def test_a_branch_ends_a_chain_but_not_a_series() -> None:
    trunk = '<body><joint axis="0 1 0"/><geom size="0.01"/><body pos="0 0 0.1"><joint axis="0 1 0"/><geom size="0.01"/>'
    branches = finger("a", 2) + finger("b", 2).replace('pos="0 0 0"', 'pos="0.1 0 0.1"', 1)
    moved = branches.replace('<body name="a0" pos="0 0 0">', '<body name="a0" pos="0 0 0.1">')
    _, structure = structure_of(f"<mujoco><worldbody>{trunk}{moved}</body></body></worldbody></mujoco>")
    assert [len(chain.bodies) for chain in structure.chains] == [2, 2, 2]
    assert structure.longest_series == 4


def test_length_of_a_straight_limb_and_of_a_folded_one() -> None:
    _, structure = structure_of(f"<mujoco><worldbody>{finger('f')}</worldbody></mujoco>")
    assert structure.characteristic_length_m == pytest.approx(0.31)
    zigzag = finger("f").replace('pos="0 0 0.1"><joint', 'pos="0 0 0.1" euler="0 180 0"><joint')
    _, folded = structure_of(f"<mujoco><worldbody>{zigzag}</worldbody></mujoco>")
    assert folded.characteristic_length_m < 0.2


def test_lengths_scale_with_the_robot() -> None:
    small = f"<mujoco><worldbody>{finger('f')}</worldbody></mujoco>"
    large = small
    for number, double in (("0.1", "0.2"), ("0.02", "0.04"), ("0.05", "0.1"), ("0.01", "0.02")):
        large = large.replace(f"{number} ", f"{double}~").replace(f'{number}"', f'{double}"')
    large = large.replace("~", " ")
    ratio = structure_of(large)[1].characteristic_length_m / structure_of(small)[1].characteristic_length_m
    assert ratio == pytest.approx(2, rel=0.05)


def test_tendons_know_what_they_span_and_who_pulls_them() -> None:
    model, structure = structure_of(hand(fingers=1))
    tendon = structure.tendons[0]
    assert tendon.spatial
    assert tendon.spans == 4
    assert names_of(model, mujoco.mjtObj.mjOBJ_BODY, tendon.bodies) == ("f0base", "f00", "f01", "f02")
    assert names_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, tendon.actuators) == ("f0ml",)


def test_antagonists_and_mirrored_fingers() -> None:
    model, structure = structure_of(hand(fingers=3))
    assert structure.opposite_pairs == ((0, 1), (2, 3), (4, 5))
    groups = [names_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, group) for group in structure.symmetric_groups]
    assert groups == [("f0ml", "f1ml", "f2ml"), ("f0mr", "f1mr", "f2mr")]


def test_free_root() -> None:
    _, structure = structure_of(hand(base="<freejoint/>"))
    assert structure.free_roots == structure.roots
    assert structure.mass_kg == pytest.approx(1.6)


def test_a_scene_is_split_by_names() -> None:
    robot = mujoco.MjSpec.from_string(hand(fingers=1))
    scene = mujoco.MjSpec.from_string(
        '<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/><site name="mount"/>'
        '<body name="ball" pos="1 0 1"><freejoint/><geom size="0.1"/><site name="on_ball"/></body></worldbody>'
        '<actuator><motor name="kick" site="on_ball"/></actuator></mujoco>'
    )
    scene.attach(robot, prefix="robot/", site=scene.site("mount"))
    model = scene.compile()
    structure = read_structure(model)
    assert structure.is_scene
    assert [name_of(model, mujoco.mjtObj.mjOBJ_BODY, root) for root in structure.roots] == ["robot/palm"]
    assert structure.free_roots == ()
    assert len(structure.actuators) == len(structure.tendons) == 2
    assert structure.mass_kg == pytest.approx(0.3)


@pytest.mark.parametrize(("equality", "owned"), [("", 1), ('<joint joint1="one" joint2="other"/>', 2)])
def test_a_finger_that_is_coupled_to_another_is_no_loose_object(equality: str, owned: int) -> None:
    fingers = "".join(
        f'<body name="{name}" pos="{x} 0 0"><joint name="{name}"/><geom size="0.01"/></body>'
        for x, name in enumerate(("one", "other"))
    )
    _, structure = structure_of(
        f"<mujoco><worldbody>{fingers}</worldbody><equality>{equality}</equality>"
        f'<actuator><motor joint="one"/></actuator></mujoco>'
    )
    assert len(structure.bodies) == owned


def test_the_box_of_a_mesh_is_that_of_its_vertices() -> None:
    """The centre of mass of a wedge, at which MuJoCo puts the geom's origin, is not the centre of its box."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><asset><mesh name="wedge" vertex="0 0 0  0.3 0 0  0 0.2 0  0 0 0.1"/></asset><worldbody>'
        '<body pos="1 0 0" euler="0 0 90"><geom type="mesh" mesh="wedge"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    vertices = model.mesh_vert @ data.geom_xmat[0].reshape(3, 3).T + data.geom_xpos[0]
    low, high = bounding_box_m(model, data, [1])
    # the box of the geom is along its principal axes of inertia and encloses the vertices
    assert (low <= vertices.min(axis=0) + 1e-9).all()
    assert (high >= vertices.max(axis=0) - 1e-9).all()
    corners = np.array(list(product((-1, 1), repeat=3))) * model.geom_aabb[0, 3:] + model.geom_aabb[0, :3]
    corners = corners @ data.geom_xmat[0].reshape(3, 3).T + data.geom_xpos[0]
    assert low == pytest.approx(corners.min(axis=0))
    assert high == pytest.approx(corners.max(axis=0))
