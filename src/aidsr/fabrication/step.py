"""Conversion of surfaces to STEP files, for further work in a CAD program.

Needs the extra "cad", which no other module needs. Curved faces stay faceted; coplanar neighbouring triangles are
merged into one face.
"""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from manifold3d import Manifold, Mesh64

from aidsr.core.extras import require_extra
from aidsr.fabrication.solids import Triangles, triangles

_SHORT_MM = 0.01
"""Size below which detail is removed. Our choice: far below what printers resolve, far above a CAD program's tolerance
of 1e-7 mm."""


def step(surface: Triangles) -> bytes:
    """Return a closed surface as a solid in a STEP file, in millimetres.

    Raises:
        UserError: The extra "cad" is not installed.
    """
    require_extra("cad", "writing STEP")
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Message import Message
    from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    Message.DefaultMessenger_s().ChangePrinters().Clear()  # otherwise it prints its progress to stdout
    merged = ShapeUpgrade_UnifySameDomain(_solid(_simplified(surface)), True, True, False)
    merged.Build()
    writer, data = STEPControl_Writer(), io.BytesIO()
    writer.Transfer(merged.Shape(), STEPControl_StepModelType.STEPControl_AsIs)
    if writer.WriteStream(data) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise RuntimeError("Open CASCADE did not write the solid")
    return data.getvalue()


def _simplified(surface: Triangles) -> Triangles:
    """Return the surface without edges so short that a CAD program would merge their ends."""
    return triangles(Manifold(Mesh64(surface.points, surface.faces.astype(np.uint64))).simplify(_SHORT_MM))


def _solid(surface: Triangles) -> Any:
    """Return an OpenCASCADE solid of flat triangles that share their corners and edges."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeVertex
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeWire as MakeWire
    from OCP.gp import gp_Pnt
    from OCP.TopoDS import TopoDS, TopoDS_Shell, TopoDS_Solid

    corners = [BRepBuilderAPI_MakeVertex(gp_Pnt(x, y, z)).Vertex() for x, y, z in surface.points.tolist()]
    edges: dict[tuple[int, int], Any] = {}

    def edge(a: int, b: int) -> Any:
        key = (min(a, b), max(a, b))
        if key not in edges:
            edges[key] = BRepBuilderAPI_MakeEdge(corners[key[0]], corners[key[1]]).Edge()
        return edges[key] if a < b else TopoDS.Edge(edges[key].Reversed())

    builder, shell, solid = BRep_Builder(), TopoDS_Shell(), TopoDS_Solid()
    builder.MakeShell(shell)
    for a, b, c in surface.faces.tolist():
        outline = MakeWire(edge(a, b), edge(b, c), edge(c, a)).Wire()
        builder.Add(shell, BRepBuilderAPI_MakeFace(outline, True).Face())
    builder.MakeSolid(solid)
    builder.Add(solid, shell)
    return solid
