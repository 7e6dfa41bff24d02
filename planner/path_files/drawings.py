"""Reads DXF drawings by ezdxf: lines, polylines with bulges, arcs and circles."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from io import StringIO
from typing import Any

import numpy as np

from planner.errors import InvalidProblem
from planner.path_files.steps import Step, ToolPath, arc_steps
from planner.path_files.texts import FARTHEST, METRES, MOST_STEPS, refused
from planner.spatial import FloatArray, Pose

POLYLINES = ("LWPOLYLINE", "POLYLINE")
"""Types of entities that consist of lines and arcs."""

READ = ("LINE", "ARC", "CIRCLE")
"""Types of single entities that are read."""

CONTACT = 1e-5
"""Largest distance between the ends of two shapes that count as one path, m."""

INSERTED_UNITS = {1: METRES["inch"], 4: METRES["mm"], 5: 1e-2, 6: METRES["m"]}
"""Values of the unit in a drawing (`$INSUNITS`), in m."""

UNIT_NAME = b"$INSUNITS"
"""The name of that value in a file. For a file without it, as of DXF R12, ezdxf reports metres."""

Shape = list[Step]
"""The steps of a shape; the first is its start."""


def read_dxf(content: bytes, unit: float | None, rotation: FloatArray, lift: float) -> ToolPath:
    """Read the model space of a drawing.

    Shapes whose ends meet become one path, reversed where necessary. Other shapes follow in the order of the file; the
    tool moves straight to them, lifted against its axis.

    Args:
        content: The file.
        unit: The unit of length, in m; None: the drawing's, else mm.
        rotation: (3, 3): the orientation of the tool.
        lift: The distance of moves between shapes from their ends, m.

    Raises:
        InvalidProblem: The file cannot be read, or ezdxf is not installed.
    """
    drawing = _open(content)
    notes: list[str] = []
    if unit is None:
        unit = INSERTED_UNITS.get(drawing.units) if UNIT_NAME in content else None
        notes += [] if unit else ["the drawing names no known unit: its lengths are taken as mm"]
        unit = unit or METRES["mm"]
    shapes: list[Shape] = []
    left_out: Counter[str] = Counter()
    count = 0
    for entity in drawing.modelspace():
        try:
            shape = _shape(entity, unit, rotation)
        except InvalidProblem:
            raise
        except Exception as error:  # noqa: BLE001 - of a hostile file, ezdxf raises errors of many types
            name = f"{entity.dxftype()} #{entity.dxf.handle}"
            raise refused(f"{name}: ezdxf cannot read its points: {str(error)[:200]}") from None
        count += len(shape)
        if count > MOST_STEPS:
            raise refused(f"a drawing must have at most {MOST_STEPS} lines and arcs. Split the file.")
        if shape:
            shapes.append(shape)
        else:
            left_out[entity.dxftype()] += 1
    if left_out:
        listed = ", ".join(f"{number} {kind}" for kind, number in left_out.items())
        notes.append(f"left out {listed}: only {', '.join((*READ, *POLYLINES))} are read; explode or convert others")
    if not shapes:
        raise refused(f"must have a {', '.join(READ)} or polyline in its model space.")
    return _joined(shapes, rotation, lift, notes)


def _open(content: bytes) -> Any:
    """Open a drawing.

    Raises:
        InvalidProblem: It cannot be opened.
    """
    try:
        from ezdxf.filemanagement import read
    except ModuleNotFoundError:
        raise refused("a DXF file needs ezdxf. Install `ezdxf`, or the extra `paths`.") from None
    if content.startswith(b"AutoCAD Binary DXF"):
        raise refused("must be DXF as text; got a binary DXF. Save it as ASCII DXF.")
    try:
        return read(StringIO(content.decode("utf-8", errors="replace").replace("\r\n", "\n")))
    except Exception as error:  # noqa: BLE001 - of a hostile file, ezdxf raises errors of many types
        raise refused(f"ezdxf cannot read the file: {str(error)[:200] or type(error).__name__}") from None


def _shape(entity: Any, unit: float, rotation: FloatArray) -> Shape:
    """Return the steps of an entity; empty if its type is not read."""
    kind = entity.dxftype()
    if kind in READ:
        return _steps(entity, unit, rotation)
    if kind == "LWPOLYLINE":
        corners = entity.vertices_in_wcs()
    elif kind == "POLYLINE" and not (entity.is_polygon_mesh or entity.is_poly_face_mesh):
        corners = entity.points_in_wcs()
    else:
        return []
    parts = [_steps(part, unit, rotation) for part in entity.virtual_entities()]
    shape = [Step(Pose(_point(corner, entity, unit), rotation)) for corner, _ in zip(corners, parts[:1], strict=False)]
    for part in parts:  # ezdxf gives arcs counter-clockwise, whatever their bulge
        start, end = (np.linalg.norm(part[k].end.position - shape[-1].end.position) for k in (0, -1))
        shape += (_reversed(part) if end < start else part)[1:]
    return shape


def _steps(entity: Any, unit: float, rotation: FloatArray) -> Shape:
    """Return the start of a line, an arc or a circle, and its steps."""
    if entity.dxftype() == "LINE":
        return [Step(Pose(_point(end, entity, unit), rotation)) for end in (entity.dxf.start, entity.dxf.end)]
    first, angle = 0.0, 360.0
    if entity.dxftype() == "ARC":
        first = float(entity.dxf.start_angle)
        angle = (float(entity.dxf.end_angle) - first) % 360.0 or 360.0

    def point(share: float) -> FloatArray:
        (vertex,) = entity.vertices([first + share * angle])
        return _point(vertex, entity, unit)

    return [Step(Pose(point(0.0), rotation)), *arc_steps(point, math.radians(angle), point(1.0), rotation, None)]


def _point(vertex: Sequence[float], entity: Any, unit: float) -> FloatArray:
    """Return a point in m.

    Raises:
        InvalidProblem: It is not finite, or too far away.
    """
    point = np.array([float(value) for value in vertex]) * unit
    if not (np.abs(point) <= FARTHEST).all():
        handle = f"#{entity.dxf.handle}" if entity.dxf.handle else "of a polyline"
        raise refused(f"{entity.dxftype()} {handle}: coordinates must be finite, and at most {FARTHEST:g} m.")
    return point


def _joined(shapes: list[Shape], rotation: FloatArray, lift: float, notes: list[str]) -> ToolPath:
    """Return one path through all shapes."""
    ends = np.array([[shape[0].end.position, shape[-1].end.position] for shape in shapes])
    is_open = np.ones(len(shapes), dtype=bool)
    path, gaps, at = ToolPath(notes=notes), 0, None
    for _ in shapes:
        number, is_reversed = int(is_open.argmax()), False
        if at is not None:
            distances = np.where(is_open[:, None], np.linalg.norm(ends - at, axis=2), np.inf)
            nearest = divmod(int(distances.argmin()), 2)
            if distances[nearest] < CONTACT:
                number, is_reversed = nearest[0], nearest[1] == 1
        is_open[number] = False
        start, *steps = _reversed(shapes[number]) if is_reversed else shapes[number]
        if at is None:
            path.start = start.end
        elif np.linalg.norm(start.end.position - at) > CONTACT:
            gaps += 1
            lifted = [at, start.end.position] if lift > 0.0 else []
            path.steps += [Step(Pose(point - lift * rotation[:, 2], rotation)) for point in lifted]
            path.steps.append(start)
        path.steps += steps
        at = path.steps[-1].end.position
    if gaps:
        how = f"lifted by {lift:g} m" if lift > 0.0 else "without `lift`"
        path.notes.append(f"{gaps} move{'s' if gaps > 1 else ''} straight from shape to shape, {how}")
    return path


def _reversed(shape: Shape) -> Shape:
    """Return a shape from its end to its start."""
    ends = [step.end for step in reversed(shape)]
    return [Step(ends[0]), *(Step(end, step.via) for end, step in zip(ends[1:], shape[:0:-1], strict=True))]
