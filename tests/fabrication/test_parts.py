"""The pieces to print: closed, of the right mass, cables in their ducts, and read back by an independent reader."""

import lib3mf
import numpy as np
import pytest
from exported import ROBOTS, Mesh, made
from fingers import hand

from aidsr.fabrication.build import build_robot
from aidsr.fabrication.files import stl, three_mf
from aidsr.fabrication.printers import printer_named
from aidsr.fabrication.solids import Triangles, first_hits, rounded, union
from aidsr.fabrication.weld import is_watertight

KINDS = [(robot, material) for robot in ROBOTS for material in ("tpu95a", "petg")]


def read_3mf(data: bytes) -> Mesh:
    model = lib3mf.get_wrapper().CreateModel()
    model.QueryReader("3mf").ReadFromBuffer(data)
    objects = model.GetMeshObjects()
    assert objects.MoveNext()
    mesh = objects.GetCurrentMeshObject()
    points = np.array([list(vertex.Coordinates) for vertex in mesh.GetVertices()])
    unit = model.GetUnit().name
    return Mesh(unit, mesh.GetTriangleCount(), mesh.IsManifoldAndOriented(), tuple(np.ptp(points, axis=0)))


@pytest.mark.parametrize(("robot", "material"), KINDS)
def test_every_part_is_closed_and_read_back_by_another_reader(robot: str, material: str) -> None:
    for part in made(robot, material).parts:
        assert part.lying.watertight, part.name
        found = read_3mf(three_mf(part.lying.surface, part.name))
        assert found.manifold, part.name
        assert found.unit.lower() == "millimeter"
        assert found.triangles == len(part.lying.surface.faces)
        assert found.size_mm == pytest.approx(part.lying.size_mm, abs=0.01)


@pytest.mark.parametrize(("robot", "material"), KINDS)
def test_moving_mass_is_that_of_the_simulation(robot: str, material: str) -> None:
    robot_made = made(robot, material)
    held = {part.name for part in robot_made.anatomy.parts if part.held}
    moving = [part for part in robot_made.robot_parts if not held & set(part.used_for)]
    built = sum(part.weight.mass_kg * len(part.used_for) for part in moving)
    simulated = sum(part.weight.simulated_kg * len(part.used_for) for part in moving)
    assert simulated == pytest.approx(robot_made.anatomy.moving_mass_kg, rel=0.01)
    assert built == pytest.approx(simulated, rel=0.15)


@pytest.mark.parametrize(
    ("printer", "infills"), [("fdm", {"station": 0.15, "spool": 1.0}), ("sla", {"station": 1.0, "spool": 1.0})]
)
def test_stations_are_filled_least_and_spools_fully(printer: str, infills: dict[str, float]) -> None:
    bench = [part for part in made("arm", None, printer).parts if part.what != "robot"]
    assert {part.what: part.weight.infill for part in bench} == infills


@pytest.mark.parametrize(("robot", "material"), KINDS)
def test_every_cable_runs_inside_its_duct(robot: str, material: str) -> None:
    robot_made = made(robot, material)
    visits = sum(len({g.part for g in cable.guides}) for cable in robot_made.anatomy.cables)
    assert len(robot_made.passages) == visits + visits - len(robot_made.anatomy.cables)
    assert [one for one in robot_made.passages if not one.sound] == []


def test_a_cable_that_lies_in_plastic_is_told() -> None:
    from aidsr.fabrication.inspect_parts import duct_faults, passages

    whole = made("arm", "petg")
    bores = whole.bores
    thick = passages(whole.shaping, bores, tuple(bore.radius_mm + 0.5 for bore in bores))
    codes = {fault.code: fault.severity for fault in duct_faults(whole.anatomy, thick)}
    assert codes["tendon_through_body"] == "error"


@pytest.mark.parametrize("robot", ROBOTS)
def test_parts_fit_the_bed_and_have_printable_walls(robot: str) -> None:
    robot_made = made(robot, "tpu95a")
    assert all(part.lying.fits for part in robot_made.parts)
    assert min(part.lying.wall_mm for part in robot_made.robot_parts) >= robot_made.printer.wall_mm


def test_a_surface_with_a_hole_or_a_turned_triangle_is_not_closed() -> None:
    surface = made("arm", "petg").parts[0].lying.surface
    assert not is_watertight(Triangles(surface.points, surface.faces[1:]))
    turned = surface.faces.copy()
    turned[0] = turned[0][::-1]
    assert not is_watertight(Triangles(surface.points, turned))


def test_stl_holds_every_triangle() -> None:
    surface = made("arm", "petg").parts[0].lying.surface
    data = stl(surface, "base")
    assert int.from_bytes(data[80:84], "little") == len(surface.faces)
    assert len(data) == 84 + 50 * len(surface.faces)


def test_alike_fingers_share_one_file() -> None:
    fingers = [part for part in made("gripper", "tpu95a").robot_parts if len(part.used_for) == 3]
    assert [len(part.used_for) for part in fingers] == [3]


@pytest.mark.parametrize("material", ["tpu95a", "petg"])
def test_fingers_of_one_shape_and_different_masses_are_different_parts(material: str) -> None:
    """Otherwise the one would be printed with the infill of the other, and the robot as built have a wrong mass."""
    left = 'name="skin left" type="capsule" fromto="0 0 0 0 0 0.02" size="0.006" mass="0.002"'
    mjcf = hand()
    assert left in mjcf
    heavy = mjcf.replace(left, left.replace("0.002", "0.005"))
    made = build_robot(heavy, [], printer_named("fdm"), material=material)
    of = {name: part for part in made.robot_parts for name in part.used_for}
    assert of["left"] is not of["right"]
    for name, mass_kg in (("left", 0.005), ("right", 0.002)):
        assert of[name].weight.simulated_kg == pytest.approx(mass_kg)
    assert of["left"].weight.infill > of["right"].weight.infill
    alike = mjcf.replace(left, left.replace("0.002", "0.00202"))
    parts = build_robot(alike, [], printer_named("fdm"), material=material).robot_parts
    (shared,) = [part for part in parts if "left" in part.used_for]
    assert shared.used_for == ("left", "right")


def test_a_ray_counts_the_walls_it_passes() -> None:
    up = np.array([0.0, 0.0, 1.0])
    pipe = rounded(0 * up, 10 * up, 5.0) - union([rounded(-1 * up, 11 * up, 3.0)])
    hits = first_hits(pipe, np.array([-20.0, 0.0, 5.0]), np.array([1.0, 0.0, 0.0]), 100.0)
    assert hits == pytest.approx([15, 17, 23, 25], abs=0.1)
