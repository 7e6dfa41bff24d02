"""COLLADA (DAE), the XML that some robots' meshes are in: triangles and polygons placed by a tree of nodes.

As in ROS, lengths follow the unit of the file and its axes are taken as they are, whichever points up. What places
triangles in another way (skins, node libraries) is refused rather than left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from xml.etree.ElementTree import Element, ParseError, TreeBuilder

import numpy as np
from defusedxml import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from planner.shapes.meshes.mesh import InvalidMesh, Mesh, check_count
from planner.spatial import FloatArray

MAX_ELEMENTS = 20_000
"""Largest number of XML elements of a file; files of robots have a few hundred."""

MAX_DEPTH = 64
"""Largest depth of nested elements; files of robots have at most 12, and coal's own reader crashes on deep ones."""

MAX_NODES = 1000
"""Number of placements of geometries that a file may have."""


class _BoundedTree(TreeBuilder):
    """A tree of elements without namespaces, as large as it may be."""

    def __init__(self) -> None:
        super().__init__()
        self.depth = 0
        self.elements = 0

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self.depth += 1
        self.elements += 1
        if self.depth > MAX_DEPTH or self.elements > MAX_ELEMENTS:
            limits = f"{MAX_ELEMENTS} elements, nested {MAX_DEPTH} deep"
            raise InvalidMesh(f"it has more than {limits}")
        return super().start(tag.rpartition("}")[2], attrs)

    def end(self, tag: str) -> Element:
        self.depth -= 1
        return super().end(tag.rpartition("}")[2])


@np.errstate(over="ignore", invalid="ignore")  # what comes of it is seen to be no number
def read_dae(data: bytes) -> Mesh:
    """Read all triangles that the scene of a COLLADA file shows.

    Raises:
        InvalidMesh: It is no such file, is too large, or places geometry in a way that is not read.
    """
    document = _parse(data)
    geometries = {f"#{geometry.get('id')}": geometry for geometry in document.iterfind("library_geometries/geometry")}
    unit = document.find("asset/unit")
    meter = _numbers("1" if unit is None else unit.get("meter", "1"), 1)[0]
    parts = []
    count = 0
    for url, placement in _instances(document):
        if url not in geometries:
            raise InvalidMesh("a node shows a geometry that is not there")
        for triangles in _triangles(geometries[url]):
            count += len(triangles)
            check_count(count)
            parts.append(triangles @ placement[:3, :3].T + placement[:3, 3])
    check_count(count)
    return Mesh.checked(np.concatenate(parts) * meter)


def _parse(data: bytes) -> Element:
    parser = DefusedXMLParser(target=_BoundedTree(), forbid_dtd=True, forbid_entities=True, forbid_external=True)
    try:
        parser.feed(data)
        document: Element = parser.close()
    except DefusedXmlException:
        raise InvalidMesh("it has a DOCTYPE or entities, which are not allowed") from None
    except (ParseError, ValueError) as error:
        if isinstance(error, InvalidMesh):
            raise
        raise InvalidMesh("it is not well-formed XML") from None
    if document.tag != "COLLADA":
        raise InvalidMesh("its root element is not <COLLADA>")
    return document


def _instances(document: Element) -> Iterator[tuple[str, FloatArray]]:
    """Yield the geometries that the scenes show, and the placement (4, 4) of each."""
    waiting = [(node, np.eye(4)) for node in document.iterfind("library_visual_scenes/visual_scene/node")]
    shown = 0
    while waiting:
        node, placement = waiting.pop()
        for child in node:
            if child.tag in ("instance_controller", "instance_node", "lookat", "skew"):
                raise InvalidMesh(f"its nodes have <{child.tag}>, which is not read")
            placement = placement @ _transform(child)
        waiting += [(child, placement) for child in node.iterfind("node")]
        for instance in node.iterfind("instance_geometry"):
            shown += 1
            if shown > MAX_NODES:
                raise InvalidMesh(f"its nodes show more than {MAX_NODES} geometries")
            yield instance.get("url", ""), placement


def _transform(element: Element) -> FloatArray:
    """Return the transform (4, 4) that an element of a node is; the identity for any other."""
    transform = np.eye(4)
    match element.tag:
        case "matrix":
            transform = _numbers(element.text, 16).reshape(4, 4)
        case "translate":
            transform[:3, 3] = _numbers(element.text, 3)
        case "scale":
            transform[:3, :3] = np.diag(_numbers(element.text, 3))
        case "rotate":
            x, y, z, degrees = _numbers(element.text, 4)
            length = max(np.hypot(np.hypot(x, y), z), 1e-300)
            axis = np.array([x, y, z]) / length
            skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
            angle = np.radians(degrees)
            transform[:3, :3] += np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew
    return transform


def _triangles(geometry: Element) -> Iterator[FloatArray]:
    """Yield the triangles (T, 3, 3) of each part of a geometry."""
    mesh = geometry.find("mesh")
    if mesh is None:
        raise InvalidMesh("a geometry is no <mesh>")
    positions = _positions(mesh)
    for part in mesh:
        if part.tag in ("polygons", "trifans", "tristrips"):
            raise InvalidMesh(f"a geometry has <{part.tag}>, which is not read")
        if part.tag not in ("triangles", "polylist"):
            continue
        inputs = {item.get("semantic"): item for item in part.iterfind("input")}
        if "VERTEX" not in inputs:
            raise InvalidMesh("a geometry has triangles without corners")
        indices = _integers(part.findtext("p"))
        step = 1 + max(int(_numbers(item.get("offset", "0"), 1)[0]) for item in inputs.values())
        offset = int(_numbers(inputs["VERTEX"].get("offset", "0"), 1)[0])
        corners = indices[offset::step] if 0 <= offset < step <= 64 else np.array([], int)
        if not len(corners) or len(indices) % step or corners.min() < 0 or corners.max() >= len(positions):
            raise InvalidMesh("a geometry names points that are not there")
        yield positions[_as_triangles(corners, part)]


def _as_triangles(corners: np.ndarray, part: Element) -> np.ndarray:
    """Return the triangles (T, 3) of a row of corners, polygons as fans."""
    if part.tag == "triangles":
        if len(corners) % 3:
            raise InvalidMesh("a geometry has a triangle without three corners")
        return corners.reshape(-1, 3)
    sizes = _integers(part.findtext("vcount"))
    if not len(sizes) or sizes.min() < 3 or sizes.max() > len(corners) or sizes.sum() != len(corners):
        raise InvalidMesh("a geometry has polygons whose corners do not add up")
    starts = np.repeat(np.cumsum(sizes) - sizes, sizes - 2)
    steps = np.arange((sizes - 2).sum()) - np.repeat(np.cumsum(sizes - 2) - (sizes - 2), sizes - 2)
    fans: np.ndarray = corners[np.stack([starts, starts + steps + 1, starts + steps + 2], axis=1)]
    return fans


def _positions(mesh: Element) -> FloatArray:
    """Return the points (N, 3) of a geometry."""
    sources: Mapping[str, Element] = {f"#{source.get('id')}": source for source in mesh.iterfind("source")}
    named = mesh.find("vertices/input[@semantic='POSITION']")
    source = None if named is None else sources.get(named.get("source", ""))
    array = None if source is None else source.find("float_array")
    accessor = None if source is None else source.find("technique_common/accessor")
    if array is None or (accessor is not None and accessor.get("stride", "3") != "3"):
        raise InvalidMesh("a geometry has no points of three numbers")
    numbers = _numbers(array.text, None)
    if len(numbers) % 3:
        raise InvalidMesh("a geometry has no points of three numbers")
    return numbers.reshape(-1, 3)


def _numbers(text: str | None, count: int | None) -> FloatArray:
    """Return so many numbers (any number: None) that a text is made of."""
    try:
        numbers = np.array([float(word) for word in (text or "").split()])
    except ValueError:
        raise InvalidMesh("it has text where numbers belong") from None
    if count is not None and len(numbers) != count:
        raise InvalidMesh(f"it has {len(numbers)} numbers where {count} belong")
    if not np.isfinite(numbers).all():
        raise InvalidMesh("it has a number that is not finite")
    return numbers


def _integers(text: str | None) -> np.ndarray:
    """Return the whole numbers that a text is made of."""
    try:
        return np.array([int(word) for word in (text or "").split()], dtype=np.int64)
    except (ValueError, OverflowError):
        raise InvalidMesh("it has text where whole numbers belong") from None
