"""Every file of every family, read by a library that did not write it, is closed and its triangles have an area."""

import io

import numpy as np
import pytest
import trimesh
from exported import _JOBS, made

from aidsr.fabrication.files import stl, three_mf
from aidsr.fabrication.solids import Triangles
from aidsr.fabrication.weld import GRID_MM, is_watertight, on_grid
from aidsr.teams.rules.families import BUILT_IN


def read(data: bytes, kind: str) -> trimesh.Trimesh:
    return trimesh.load(io.BytesIO(data), file_type=kind, force="mesh")


def test_all_families_are_tried() -> None:
    assert {family for _, family in _JOBS.values()} == set(BUILT_IN)


@pytest.mark.parametrize("robot", _JOBS)
def test_another_reader_finds_every_part_closed(robot: str) -> None:
    for part in made(robot, "tpu95a").parts:
        for surface, kinds in ((part.lying.surface, ("stl", "3mf")), (part.full, ("stl",))):
            for kind in kinds if surface is not None else ():
                mesh = read((stl if kind == "stl" else three_mf)(surface, part.name), kind)
                assert mesh.is_watertight, (part.name, kind)
                assert mesh.is_winding_consistent, (part.name, kind)
                assert mesh.area_faces.min() > 0, (part.name, kind)
                assert len(mesh.faces) == len(surface.faces), (part.name, kind)


CUBE = Triangles(
    np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]),
    np.array(
        [
            [0, 1, 3],
            [0, 3, 2],
            [4, 7, 5],
            [4, 6, 7],
            [0, 5, 1],
            [0, 4, 5],
            [2, 3, 7],
            [2, 7, 6],
            [0, 2, 6],
            [0, 6, 4],
            [1, 5, 7],
            [1, 7, 3],
        ]
    ),
)


def split(surface: Triangles, edge: tuple[int, int], at: np.ndarray) -> Triangles:
    """Cut the two triangles of an edge at a point."""
    new, faces = len(surface.points), []
    for face in surface.faces.tolist():
        if set(edge) <= set(face):
            for end in edge:
                faces.append([new if corner == end else corner for corner in face])
        else:
            faces.append(face)
    return Triangles(np.vstack([surface.points, at]), np.array(faces))


def test_corners_that_fall_together_leave_a_closed_surface() -> None:
    near = split(CUBE, (0, 1), np.array([0.0, 0.0, GRID_MM / 5]))
    assert is_watertight(near)
    assert len(near.faces) == 14
    assert read(stl(near, "near"), "stl").area_faces.min() < 1e-4
    found = on_grid(near)
    assert is_watertight(found)
    assert len(found.faces) == 12
    assert read(stl(found, "found"), "stl").is_watertight


def test_triangles_in_a_line_are_taken_out_with_the_corner_they_hold() -> None:
    # a corner just beside the diagonal 0 - 3: on the grid it lies on it
    beside = Triangles(
        np.vstack([CUBE.points, [0.0, 0.5, 0.5 + GRID_MM / 4]]),
        np.array([[0, 1, 8], [1, 3, 8], [0, 8, 3], *CUBE.faces.tolist()[1:]]),
    )
    assert is_watertight(beside)
    found = on_grid(beside)
    assert is_watertight(found)
    mesh = read(stl(found, "found"), "stl")
    assert mesh.area_faces.min() > 0
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(1.0)
