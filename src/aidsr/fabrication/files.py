"""Conversion of surfaces to STL and 3MF files, both in millimetres. 3MF states its unit; STL has none."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Iterator
from xml.sax.saxutils import quoteattr

import numpy as np

from aidsr.fabrication.solids import Triangles

_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
_DATE = (1980, 1, 1, 0, 0, 0)
"""Timestamp of every entry in the archive; constant, so that the same part always gives the same file."""


def stl(surface: Triangles, name: str) -> bytes:
    """Return a surface as binary STL."""
    normals = surface.normals
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    record = np.zeros(len(surface.faces), dtype=[("numbers", "<f4", (4, 3)), ("attribute", "<u2")])
    record["numbers"] = np.concatenate([normals[:, None], surface.corners], axis=1)
    return name.encode("ascii", "replace")[:79].ljust(80) + struct.pack("<I", len(record)) + record.tobytes()


def three_mf(surface: Triangles, name: str) -> bytes:
    """Return a surface as 3MF.

    Source: 3MF Core Specification 1.3: a package of three files, one of which holds the vertices and triangles.
    """
    package = io.BytesIO()
    with zipfile.ZipFile(package, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, text in (
            ("[Content_Types].xml", _TYPES),
            ("_rels/.rels", _RELATIONS),
            ("3D/3dmodel.model", "".join(_model(surface, name))),
        ):
            archive.writestr(zipfile.ZipInfo(path, _DATE), text, zipfile.ZIP_DEFLATED)
    return package.getvalue()


def _exact(number: float) -> str:
    """Return a coordinate as text with all its decimals; coordinates lie on the grid of `weld.GRID_MM`."""
    return f"{number:.10f}".rstrip("0").rstrip(".")


def _model(surface: Triangles, name: str) -> Iterator[str]:
    yield f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" xml:lang="en" xmlns="{_CORE}">'
    yield f'<resources><object id="1" type="model" name={quoteattr(name)}><mesh><vertices>'
    for x, y, z in surface.points.tolist():
        yield f'<vertex x="{_exact(x)}" y="{_exact(y)}" z="{_exact(z)}"/>'
    yield "</vertices><triangles>"
    for a, b, c in surface.faces.tolist():
        yield f'<triangle v1="{a}" v2="{b}" v3="{c}"/>'
    yield '</triangles></mesh></object></resources><build><item objectid="1"/></build></model>'
