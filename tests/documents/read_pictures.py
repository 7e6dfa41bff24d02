"""Reads curves out of a picture as a person does: by its tick marks. It knows nothing of how the picture was made."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.spatial import FloatArray

SVG = "{http://www.w3.org/2000/svg}"
POINT = re.compile(r"[ML] (-?[\d.]+) (-?[\d.]+)")


@dataclass(frozen=True)
class Graph:
    """The content of a graph: lines by name, and dots, in the units of the tick marks.

    Attributes:
        lines: Each (N, 2).
        dots: Each (N, 2); of the path of a tool the ends of its pieces.
        pixel: Size of a point of the picture in both directions.
    """

    lines: dict[str, FloatArray]
    dots: dict[str, FloatArray]
    pixel: FloatArray


def graphs_of(svg: bytes) -> list[Graph]:
    """Return all graphs of a picture from top to bottom; all share the time axis of the last graph."""
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))  # noqa: S314 - our own
    parser.feed(svg.decode())
    groups = [group for group in parser.close().iter(f"{SVG}g") if group.get("id", "").startswith("graph.")]
    x = _scale(groups[-1], "xtick", 0)
    return [_graph(group, x) for group in groups]


def _graph(group: ElementTree.Element, x: FloatArray) -> Graph:
    y = _scale(group, "ytick", 1)
    lines, dots = {}, {}
    for part in group.iter(f"{SVG}g"):
        name = part.get("id", "")
        drawn = [(float(use.get("x", "")), float(use.get("y", ""))) for use in part.iter(f"{SVG}use") if use.get("x")]
        if name == "workspace":
            dots[name] = _in_units(np.array(drawn), x, y)
        elif name == "path":
            pieces = [point for path in part.findall(f"{SVG}path") for point in POINT.findall(path.get("d", ""))]
            dots[name] = _in_units(np.array(pieces, dtype=float), x, y)
        elif re.fullmatch(r"\w+\.\w+", name) and not name.startswith(("graph.", "matplotlib.")):
            path = next(part.iter(f"{SVG}path")).get("d", "")
            lines[name] = _in_units(np.array(POINT.findall(path), dtype=float), x, y)
    return Graph(lines, dots, np.abs([x[0], y[0]]))


def _in_units(points: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    return np.column_stack([np.polyval(x, points[:, 0]), np.polyval(y, points[:, 1])])


def _scale(group: ElementTree.Element, ticks: str, coordinate: int) -> FloatArray:
    """Return the polynomial from a coordinate of the picture to the values at its tick marks."""
    at, values = [], []
    for tick in (part for part in group.iter(f"{SVG}g") if part.get("id", "").startswith(ticks)):
        (label,) = (part.text for part in tick.iter() if part.tag is ElementTree.Comment)
        at.append(float(POINT.findall(next(tick.iter(f"{SVG}path")).get("d", ""))[0][coordinate]))
        values.append(float(str(label).strip().replace("\N{MINUS SIGN}", "-")))
    return np.polyfit(at, values, 1)


def drawn_groups(svg: bytes) -> dict[str, FloatArray]:
    """Return the points (N, 2) of each named group of a picture, y up, from back to front."""
    found = {}
    for group in ElementTree.fromstring(svg.decode()).iter(f"{SVG}g"):  # noqa: S314 - our own
        used = [(use.get("x"), use.get("y")) for use in group.iter(f"{SVG}use") if use.get("x")]
        paths = [path.get("d", "") for path in group.findall(f"{SVG}path")]
        points = used or [point for path in paths for point in POINT.findall(path)]
        if group.get("id") and points:
            found[group.get("id", "")] = np.array(points, dtype=float) * (1.0, -1.0)
    return found
