"""`aidsr import`: several files become one document of the same physics, and nothing else is read."""

from __future__ import annotations

import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest

from aidsr.apps.cli import main
from aidsr.core.errors import UserError
from aidsr.mjcf.importing import import_mjcf
from aidsr.mjcf.inline_files import FileUse, read_shape

MAIN = """
<mujoco>
  <compiler meshdir="meshes" angle="radian"/>
  <include file="parts/defaults.xml"/>
  <asset>
    <mesh name="wedge" file="wedge.stl" class="small"/>
    <mesh file="ball.stl"/>
    <texture name="skin" type="2d" file="skin.png"/>
    <material name="painted" texture="skin"/>
  </asset>
  <worldbody>
    <include file="parts/body.xml"/>
  </worldbody>
</mujoco>"""
DEFAULTS = """
<mujocoinclude>
  <default>
    <geom density="700"/>
    <default class="small"><mesh scale="0.5 0.5 0.5"/></default>
  </default>
</mujocoinclude>"""
BODY = """
<mujocoinclude>
  <body name="arm">
    <joint name="bend" axis="0 1 0" stiffness="0.1"/>
    <geom type="mesh" mesh="wedge" material="painted"/>
    <body name="hand" pos="0.1 0 0">
      <geom type="mesh" mesh="ball"/>
    </body>
  </body>
</mujocoinclude>"""


def stl(triangles: np.ndarray) -> bytes:
    """A binary STL of triangles, (n, 3, 3)."""
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0) for triangle in triangles)
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + rows


def wedge() -> np.ndarray:
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.08, 0], [0, 0, 0.05]])
    return corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]


def ball(rings: int = 30) -> np.ndarray:
    """A sphere of 2 x 30 x 58 triangles."""
    theta = np.linspace(0, np.pi, rings + 1)
    phi = np.linspace(0, 2 * np.pi, 2 * rings + 1)
    grid = 0.03 * np.stack(
        [
            np.outer(np.sin(theta), np.cos(phi)),
            np.outer(np.sin(theta), np.sin(phi)),
            np.outer(np.cos(theta), 1 + 0 * phi),
        ],
        axis=-1,
    )
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    lower, upper = np.stack([a, b, c], axis=2)[:-1], np.stack([a, c, d], axis=2)[1:]
    return np.concatenate([lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3)])


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    files = {"robot.xml": MAIN, "parts/defaults.xml": DEFAULTS, "parts/body.xml": BODY}
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/wedge.stl").write_bytes(stl(wedge()))
    (tmp_path / "meshes/ball.stl").write_bytes(stl(ball()))
    return tmp_path / "robot.xml"


def test_the_imported_robot_has_the_same_physics(robot: Path, tmp_path: Path) -> None:
    imported = import_mjcf(robot)
    with_files = robot.read_text(encoding="utf-8").replace('file="skin.png"', 'builtin="flat" width="8" height="8"')
    (tmp_path / "plain.xml").write_text(with_files, encoding="utf-8")
    original = mujoco.MjModel.from_xml_path(str(tmp_path / "plain.xml"))
    model = mujoco.MjModel.from_xml_string(imported.mjcf)
    np.testing.assert_allclose(model.body_mass, original.body_mass, rtol=1e-5)
    np.testing.assert_allclose(model.body_inertia[1], original.body_inertia[1], rtol=1e-5)
    # the sphere's hull has fewer points, and so a little less inertia at the same mass
    np.testing.assert_allclose(model.body_inertia[2], original.body_inertia[2], rtol=0.05)
    assert [each.path for each in imported.files] == [
        "robot.xml", "parts/defaults.xml", "parts/body.xml", "meshes/wedge.stl", "meshes/ball.stl"
    ]  # fmt: skip
    assert imported.notes[0] == "Left out 1 textures from files: they are only looks."
    assert imported.notes[1].startswith("Mesh ball: its convex hull of 128 points stands for 3,")


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('"parts/body.xml"', '"../secret.xml"', "../secret.xml is outside"),
        ('"parts/body.xml"', '"/etc/hostname"', "/etc/hostname is outside"),
        ('"parts/body.xml"', '"parts/gone.xml"', "cannot read parts/gone.xml"),
        ('"parts/body.xml"', '"parts/linked.xml"', "is or goes through a link"),
        ('"parts/body.xml"', '"robot.xml"', "in a circle"),
        ('"wedge.stl"', '"../../etc/hostname"', "is outside"),
        ('"ball.stl"', '"broken.stl"', "meshes/broken.stl cannot be read as a mesh"),
    ],
)
def test_a_file_that_may_not_or_cannot_be_read_is_named(robot: Path, old: str, new: str, problem: str) -> None:
    (robot.parent.parent / "secret.xml").write_text(BODY, encoding="utf-8")
    (robot.parent / "parts/linked.xml").symlink_to(robot.parent / "parts/body.xml")
    (robot.parent / "meshes/broken.stl").write_bytes(b"solid nonsense")
    text = robot.read_text(encoding="utf-8")
    assert old in text
    robot.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(UserError, match=problem.replace(".", r"\.")):
        import_mjcf(robot)


def test_the_command_writes_one_document_with_its_origin(
    robot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "one.xml"
    with pytest.raises(SystemExit) as ended:
        main(["import", str(robot), "--out", str(target)])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert "5 files, written to" in said
    text = target.read_text(encoding="utf-8")
    assert text.startswith("<!-- Imported by aidsr ")
    assert "meshes/wedge.stl" in text.partition("-->")[0]
    assert mujoco.MjModel.from_xml_string(text).nmesh == 2
    with pytest.raises(SystemExit) as ended:
        main(["import", str(robot), "--out", str(target)])
    assert ended.value.code == 2
    assert "exists" in capsys.readouterr().err


def test_a_file_that_the_document_does_not_name_is_an_error() -> None:
    with pytest.raises(UserError, match="no <mesh> named other with a file"):
        read_shape(FileUse("mesh", "other", "other.stl"), "<mujoco/>", b"")
