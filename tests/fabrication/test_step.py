"""STEP, where the optional library is: read back as one valid solid of the same volume."""

import pytest
from manifold3d import Manifold

from aidsr.fabrication.solids import triangles
from aidsr.fabrication.step import step


def test_a_part_is_read_back_as_a_valid_solid_of_its_volume(tmp_path) -> None:
    pytest.importorskip("OCP", reason='the extra "cad" is not installed; it is optional and large')
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader

    part = Manifold.cylinder(30, 8, 8, 32) - Manifold.cylinder(30, 3, 3, 16).translate((2, 0, 0))
    path = tmp_path / "part.step"
    path.write_bytes(step(triangles(part)))
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    solid, properties = reader.OneShape(), GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, properties)
    assert BRepCheck_Analyzer(solid).IsValid()
    assert properties.Mass() == pytest.approx(part.volume(), rel=1e-4)
    middle = properties.CentreOfMass()
    assert middle.Z() == pytest.approx(15.0, abs=1e-3)
    assert path.read_bytes().count(b"ADVANCED_FACE") == 32 + 16 + 2
