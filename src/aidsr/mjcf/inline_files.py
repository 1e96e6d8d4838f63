"""Inlining of the files that a document names: includes, meshes and height fields.

The functions work on text and bytes that the caller has read; they open no files.
"""

from __future__ import annotations

import posixpath
import re
from dataclasses import dataclass, field

import mujoco
import numpy as np
from lxml import etree

from aidsr.core.errors import UserError
from aidsr.mjcf.compile import load_mjcf, warnings_as_notes
from aidsr.mjcf.defaults import default_classes, setting
from aidsr.mjcf.elements import Element, attributes, elements
from aidsr.mjcf.read import SIZE_LIMITS, parse_document
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits

MOST_INCLUDES = 100
"""Largest number of includes. Our choice: the largest public robot model has a dozen."""
_KEPT_FACES = 1000
"""Largest number of triangles of a mesh that is kept unchanged. MuJoCo collides every mesh as its convex hull. Our
choice."""
_HULL_VERTICES = 128
"""Largest number of vertices of the convex hull that replaces a larger mesh. Our choice."""
_DIGITS = 9
_DENSITY_KG_M3 = 1000.0
"""MuJoCo's default density of a geom without mass and density."""
_INCLUDE_ROOT = re.compile(r"<(/?)mujocoinclude(?=[\s/>])")
_FILE_ATTRIBUTES = re.compile(r"file\w*|content_type")
_FOLDERS = {"mesh": "meshdir", "hfield": "meshdir"}


@dataclass(frozen=True)
class FileUse:
    """A file that a document names.

    Attributes:
        element: Tag of the element that names it.
        name: Name of that element.
        path: Path of the file relative to the folder of the main document.
    """

    element: str
    name: str
    path: str


@dataclass(frozen=True)
class Merged:
    """A document with its includes inlined.

    Attributes:
        mjcf: MJCF text; empty if includes are missing.
        missing: Includes whose text was not given, as paths relative to the folder of the main document.
        uses: Files of meshes and height fields that the document names.
        notes: Omissions, one sentence each.
    """

    mjcf: str
    missing: tuple[str, ...] = ()
    uses: tuple[FileUse, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Shape:
    """Numeric data of a mesh or height field.

    Attributes:
        attributes: MJCF attributes that replace the file in its element.
        volume_m3: Volume of a mesh [m^3]; 0 for a height field.
        note: Sentence about a simplification; empty if there was none.
    """

    attributes: dict[str, str] = field(default_factory=dict)
    volume_m3: float = 0.0
    note: str = ""


@isolated(limits=Limits(wall_s=20.0))
def merge_includes(main: str, included: dict[str, str]) -> Merged:
    """Return a document with its includes inlined, or the includes whose text is missing.

    Textures and skins from files are left out, since they only affect the appearance.

    Args:
        main: MJCF text of the main document.
        included: Text of each included file by its path relative to the folder of the main document.

    Raises:
        MjcfError: A text is not MJCF.
        UserError: Files include each other in a cycle, or there are more than `MOST_INCLUDES` includes.
    """
    root = parse_document(main).root
    missing: list[str] = []
    _put_in(root, "", included, missing)
    if missing:
        return Merged("", tuple(dict.fromkeys(missing)))
    notes = _drop_looks(root)
    uses = tuple(_uses(root))
    return Merged(_text(root), uses=uses, notes=tuple(notes))


def _put_in(root: Element, folder: str, included: dict[str, str], missing: list[str]) -> None:
    count = 0
    waiting: list[tuple[Element, tuple[str, ...]]] = [(element, ()) for element in list(elements(root, "include"))]
    while waiting:
        element, above = waiting.pop(0)
        path = posixpath.normpath(posixpath.join(folder, element.get("file", "")))
        count += 1
        if path in above or count > MOST_INCLUDES:
            raise UserError(f"{path} is included in a circle, or files are included more than {MOST_INCLUDES} times")
        if path not in included:
            missing.append(path)
            continue
        inner = parse_document(_INCLUDE_ROOT.sub(r"<\1mujoco", included[path])).root
        parent = element.getparent()
        if parent is None:
            raise UserError("the document's root is an <include>; name the file that it includes")
        place = parent.index(element)
        parent.remove(element)
        for child in reversed(list(inner)):
            parent.insert(place, child)
            found = [child] if child.tag == "include" else list(elements(child, "include"))
            waiting += [(each, (*above, path)) for each in found]


def _drop_looks(root: Element) -> list[str]:
    """Remove textures and skins from files, and references to them; return notes about it."""
    notes = []
    gone = [
        each
        for each in elements(root, "texture")
        if any(_FILE_ATTRIBUTES.fullmatch(name) for name, _ in attributes(each))
    ]
    names = {each.get("name") or _stem(each.get("file", "")) for each in gone}
    for material in elements(root, "material"):
        if material.get("texture") in names:
            del material.attrib["texture"]
    for layer in list(elements(root, "layer")):
        if layer.get("texture") in names:
            _remove(layer)
    if gone:
        notes.append(f"Left out {len(gone)} textures from files: they are only looks.")
    skins = [each for each in elements(root, "skin") if each.get("file") is not None]
    if skins:
        notes.append(f"Left out {len(skins)} skins: they are only looks.")
    for each in [*gone, *skins]:
        _remove(each)
    return notes


def _uses(root: Element) -> list[FileUse]:
    folders = {name: value for compiler in elements(root, "compiler") for name, value in attributes(compiler)}
    strip = folders.get("strippath") == "true"
    found = []
    for tag, folder in _FOLDERS.items():
        for element in elements(root, tag):
            file = element.get("file")
            if file is None or "default" in {ancestor.tag for ancestor in element.iterancestors()}:
                continue
            inside = folders.get(folder, folders.get("assetdir", ""))
            path = posixpath.join(str(inside), posixpath.basename(str(file)) if strip else str(file))
            found.append(FileUse(tag, element.get("name") or _stem(str(file)), posixpath.normpath(path)))
    return found


@isolated(limits=Limits(wall_s=30.0))
def read_shape(use: FileUse, mjcf: str, content: bytes) -> Shape:
    """Return the numeric data of a mesh or height field of a document.

    A mesh of more than 1,000 triangles is replaced by its convex hull, which MuJoCo uses for collisions in any case.

    Args:
        use: Use of the file in the document.
        mjcf: MJCF text of the document.
        content: Content of the file.

    Raises:
        UserError: MuJoCo cannot read the file, or a height field is too large.
    """
    root = parse_document(mjcf).root
    element = _element_of_use(root, use)
    file = f"shape{posixpath.splitext(use.path)[1].lower()}"
    written = {name: value for name, value in attributes(element) if name not in ("class", "name", "file")}
    if use.element == "mesh" and (scale := setting(element, "scale", default_classes(root))) is not None:
        written["scale"] = scale.value
    alone = etree.Element("mujoco")
    assets, place = etree.SubElement(alone, "asset"), etree.SubElement(alone, "worldbody")
    shape = etree.SubElement(assets, use.element, {**written, "name": "shape", "file": file})
    if use.element == "mesh":
        shape.set("maxhullvert", str(_HULL_VERTICES))
        place = etree.SubElement(place, "body")
    etree.SubElement(place, "geom", {"type": use.element, use.element: "shape", "density": "1"})
    text = etree.tostring(alone, encoding="unicode")
    try:
        with warnings_as_notes():
            model = mujoco.MjSpec.from_string(text, assets={file: content}).compile()
    except ValueError as error:
        raise UserError(f"{use.path} cannot be read as a {use.element}: {str(error).splitlines()[0][:200]}") from None
    return _mesh(model, use) if use.element == "mesh" else _height_field(model, use)


def _mesh(model: mujoco.MjModel, use: FileUse) -> Shape:
    turned = np.zeros(9)
    mujoco.mju_quat2Mat(turned, model.mesh_quat[0])
    points = model.mesh_vert @ turned.reshape(3, 3).T + model.mesh_pos[0]
    faces, note = model.mesh_face, ""
    attributes = {}
    if len(faces) > _KEPT_FACES and model.mesh_graphadr[0] >= 0:
        first = int(model.mesh_graphadr[0])
        count = int(model.mesh_graph[first])
        ids = model.mesh_graph[first + 2 + count : first + 2 + 2 * count]
        note = f"Mesh {use.name}: its convex hull of {count} points stands for {len(faces):,} triangles."
        points, faces = points[ids], np.zeros((0, 3), dtype=int)
    attributes["vertex"] = " ".join(f"{value:.{_DIGITS}g}" for value in points.ravel())
    if len(faces):
        attributes["face"] = " ".join(map(str, faces.ravel()))
    return Shape(attributes, float(model.body_mass[1]), note)


def _height_field(model: mujoco.MjModel, use: FileUse) -> Shape:
    rows, columns = int(model.hfield_nrow[0]), int(model.hfield_ncol[0])
    if rows * columns > SIZE_LIMITS.numbers:
        raise UserError(
            f"{use.path} has {rows} x {columns} heights, at most {SIZE_LIMITS.numbers:,} can be put into a document; "
            "make it coarser"
        )
    # MJCF lists the far row first, MjModel the near row
    heights = model.hfield_data.reshape(rows, columns)[::-1].ravel()
    written = " ".join(f"{value:.{_DIGITS}g}" for value in heights)
    return Shape({"nrow": str(rows), "ncol": str(columns), "elevation": written})


@isolated(limits=Limits(wall_s=30.0))
def put_in_shapes(merged: Merged, shapes: list[Shape]) -> str:
    """Return a document with its meshes and height fields as numbers; it is checked and compiled once.

    Args:
        merged: The document with its includes inlined.
        shapes: Data of each file in `merged.uses`, in the same order.

    Raises:
        MjcfError: The document has faults; the error holds all of them.
        UserError: The document is too large; the message names the largest meshes and height fields.
    """
    root = parse_document(merged.mjcf).root
    volumes: dict[str, float] = {}
    for use, shape in zip(merged.uses, shapes, strict=True):
        element = _element_of_use(root, use)
        for attribute in ("file", "content_type", "scale", "refpos", "refquat", "class"):
            _drop(element, attribute)
        element.set("name", use.name)
        for name, value in shape.attributes.items():
            element.set(name, value)
        if shape.note:
            volumes[use.name] = shape.volume_m3
    for default in elements(root, "default"):
        for mesh in default.iterchildren("mesh"):
            _drop(mesh, "scale")
    _keep_masses(root, volumes)
    for compiler in elements(root, "compiler"):
        for attribute in ("meshdir", "texturedir", "assetdir", "strippath"):
            _drop(compiler, attribute)
    text = _text(root)
    if len(text) > SIZE_LIMITS.characters:
        sizes = {
            use.name: sum(map(len, shape.attributes.values())) for use, shape in zip(merged.uses, shapes, strict=True)
        }
        largest = sorted(sizes, key=lambda name: -sizes[name])[:3]
        raise UserError(
            f"the document has {len(text):,} characters, at most {SIZE_LIMITS.characters:,} are read; the largest are "
            + ", ".join(f"{name} ({sizes[name]:,})" for name in largest)
        )
    load_mjcf(text)
    return text


def _keep_masses(root: Element, volumes: dict[str, float]) -> None:
    """Give geoms whose mesh was replaced by its convex hull the mass of the original mesh.

    `volumes` holds the volumes of these meshes by name [m^3].
    """
    known = default_classes(root)
    for geom in elements(root, "geom"):
        mesh = setting(geom, "mesh", known)
        if mesh is None or mesh.value not in volumes or setting(geom, "mass", known) is not None:
            continue
        density = setting(geom, "density", known)
        kg_m3 = float(density.value) if density is not None else _DENSITY_KG_M3
        geom.set("mass", f"{kg_m3 * volumes[mesh.value]:.{_DIGITS}g}")


def _element_of_use(root: Element, use: FileUse) -> Element:
    for element in elements(root, use.element):
        file = element.get("file")
        if file is not None and (element.get("name") or _stem(file)) == use.name:
            return element
    raise UserError(f"the document has no <{use.element}> named {use.name} with a file")


def _stem(file: str) -> str:
    return posixpath.splitext(posixpath.basename(file))[0]


def _drop(element: Element, attribute: str) -> None:
    if attribute in element.attrib:
        del element.attrib[attribute]


def _remove(element: Element) -> None:
    parent = element.getparent()
    if parent is not None:
        parent.remove(element)


def _text(root: Element) -> str:
    etree.indent(root)
    return etree.tostring(root, encoding="unicode") + "\n"
