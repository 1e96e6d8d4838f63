"""Files are written once, whole, and read back equal."""

import pytest

from aidsr.core.artifacts import Concept, Placement, Robot, Scene
from aidsr.core.errors import UserError
from aidsr.runs.files import BytesFile, JsonFile, MjcfFile, WrittenTwiceError, replace_file, write_once


def test_the_same_content_again_does_nothing(tmp_path) -> None:
    path = tmp_path / "a" / "b.txt"
    write_once(path, b"one")
    before = path.stat().st_mtime_ns
    write_once(path, b"one")
    assert path.stat().st_mtime_ns == before


def test_other_content_is_an_error_and_changes_nothing(tmp_path) -> None:
    path = tmp_path / "b.txt"
    write_once(path, b"one")
    with pytest.raises(WrittenTwiceError, match=r"b\.txt"):
        write_once(path, b"two")
    assert path.read_bytes() == b"one"


def test_no_temporary_file_stays(tmp_path) -> None:
    replace_file(tmp_path / "a", b"1")
    replace_file(tmp_path / "a", b"2")
    with pytest.raises(TypeError):
        replace_file(tmp_path / "a", "text")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a").read_bytes() == b"2"


def test_what_is_not_written_reads_as_none(tmp_path) -> None:
    assert BytesFile(tmp_path / "x").read() is None
    assert JsonFile(tmp_path / "x", Concept).read() is None
    assert MjcfFile(tmp_path, "x", Robot).read() is None


def test_a_robot_and_a_scene_read_back_equal(tmp_path) -> None:
    mjcf = "<mujoco>\r\n<!-- Überprüfung ≤ 3 -->\n</mujoco>"
    robot = Robot(mjcf=mjcf, functional_part="tip", notes="two\nlines")
    scene = Scene(mjcf=mjcf, placement=Placement(mount="mount", base="free", scale=1.5), notes=("floor removed",))
    for stem, value in (("robot", robot), ("scene", scene)):
        file = MjcfFile(tmp_path, stem, type(value))
        file.write(value)
        assert file.read() == value
        assert file.xml.read() == mjcf.encode()
        assert "<mujoco" not in file.json.path.read_text()


def test_a_robot_exists_when_its_xml_does(tmp_path) -> None:
    file = MjcfFile(tmp_path, "robot", Robot)
    file.json.write({"functional_part": "tip"})
    assert file.read() is None


@pytest.mark.parametrize("content", ["", "{", '{"mount": 3}', '{"mount": "m", "base": "fixed", "color": "red"}'])
def test_a_damaged_file_is_named(tmp_path, content: str) -> None:
    (tmp_path / "placement.json").write_text(content)
    with pytest.raises(UserError, match=r"placement\.json cannot be read"):
        JsonFile(tmp_path / "placement.json", Placement).read()


@pytest.mark.parametrize("content", ["{", "[]", "{}", '{"placement": {"mount": "m", "base": "standing"}}'])
def test_of_a_damaged_scene_the_file_is_named(tmp_path, content: str) -> None:
    (tmp_path / "scene.xml").write_text("<mujoco/>")
    (tmp_path / "scene.json").write_text(content)
    with pytest.raises(UserError, match=r"scene\.json cannot be read"):
        MjcfFile(tmp_path, "scene", Scene).read()
