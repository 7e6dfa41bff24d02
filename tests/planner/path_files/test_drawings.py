"""DXF drawings as waypoints, beside ezdxf's own curves and beside circles."""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from ezdxf.path import make_path

from planner import CircularMotion, InvalidProblem, PathFile, PoseWaypoint, read_path
from planner.spatial import FloatArray
from tests.planner.path_files.tool_paths import (
    SPACING,
    TABLE,
    arc,
    assert_same_curve,
    curve_of,
    planned,
    tool_points,
)
from tests.sizes import SIZE

MIRRORED = (0.0, 0.0, -1.0)
"""The extrusion direction of entities that CAD has mirrored."""


def drawing(units: int = 4) -> Any:
    document = ezdxf.new("R2010")
    document.units = units
    return document


def read_drawing(document: Any, folder: Path, **options: Any) -> PathFile:
    file = folder / "path.dxf"
    document.saveas(file)
    return read_path(file, **options)


def flattened(document: Any, unit: float = 1e-3) -> FloatArray:
    """Return dense points of all entities by ezdxf's own paths, m."""
    points = []
    for entity in document.modelspace():
        corners = np.array([tuple(point) for point in make_path(entity).flattening(1e-4, 64)]) * unit
        for first, last in pairwise(corners):
            count = int(np.ceil(np.linalg.norm(last - first) / SPACING)) + 1
            points.append(first + np.linspace(0.0, 1.0, count)[:, None] * (last - first))
    return np.concatenate(points)


@pytest.mark.large_only
@pytest.mark.sized
def test_random_polylines_with_bulges_have_ezdxfs_own_curve(tmp_path: Path) -> None:
    for seed in range(SIZE.examples):
        random = np.random.default_rng(seed)
        document = drawing()
        corners = random.uniform(-40.0, 40.0, (random.integers(2, 7), 2))
        bulges = random.choice([0.0, 1.0, -1.0, 0.3, -0.7, 2.5, -4.0], len(corners))
        attributes = {"elevation": 5.0, "extrusion": MIRRORED if random.random() < 0.5 else (0.0, 0.0, 1.0)}
        if random.random() < 0.5:
            document.modelspace().add_lwpolyline(
                np.column_stack([corners, bulges]), format="xyb", close=bool(seed % 2), dxfattribs=attributes
            )
        else:
            attributes["elevation"] = (0.0, 0.0, 5.0)
            document.modelspace().add_polyline2d(
                np.column_stack([corners, bulges]), format="xyb", close=bool(seed % 2), dxfattribs=attributes
            )
        read = read_drawing(document, tmp_path)
        assert_same_curve(curve_of(read), flattened(document), 1e-6 + SPACING)
        assert read.notes == ()


@pytest.mark.sized
def test_shapes_in_any_order_and_direction_become_one_path(tmp_path: Path) -> None:
    """A rounded outline of lines and arcs, cut into entities as CAD exports it."""
    for seed in range(SIZE.examples):
        random = np.random.default_rng(seed)
        document = drawing()
        outline = (
            drawing()
            .modelspace()
            .add_lwpolyline(
                [(10, 0, 0), (40, 0, np.tan(np.pi / 8)), (50, 10, 0), (50, 30, -0.4), (10, 30, 0.6), (0, 10, 0)],
                format="xyb",
                close=True,
            )
        )
        entities = list(outline.virtual_entities())
        for k in random.permutation(len(entities)):
            entity = entities[k]
            if entity.dxftype() == "LINE" and random.random() < 0.5:
                entity.dxf.start, entity.dxf.end = entity.dxf.end, entity.dxf.start
            document.modelspace().add_entity(entity)
        read = read_drawing(document, tmp_path)
        assert read.notes == ()
        assert len(read.waypoints) == len(entities) + 1
        assert_same_curve(curve_of(read), flattened(document), 1e-5 + SPACING)
        ends = [
            each.pose.position for each in (read.waypoints[0], read.waypoints[-1]) if isinstance(each, PoseWaypoint)
        ]
        np.testing.assert_allclose(*ends, atol=1e-9)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize(("first", "last"), [(20.0, 110.0), (350.0, 250.0), (0.0, 360.0)])
def test_the_tool_follows_the_analytic_circle_of_an_arc(
    tmp_path: Path, first: float, last: float, mirrored: bool
) -> None:
    document = drawing()
    extrusion = MIRRORED if mirrored else (0.0, 0.0, 1.0)
    space, attributes = document.modelspace(), {"extrusion": extrusion}
    if last == 360.0:
        space.add_circle((30, 20, 0), 40, dxfattribs=attributes)
    else:
        space.add_arc((30, 20, 0), 40, first, last, dxfattribs=attributes)
    read = read_drawing(document, tmp_path, frame=TABLE)
    assert len(read.waypoints) == (2 if last == 110.0 else 3)
    assert all(isinstance(each.motion, CircularMotion) for each in read.waypoints[1:])
    turn = np.radians((last - first) % 360.0 or 360.0)
    circle = arc((0.03, 0.02, 0.0), 0.04, np.radians(first), turn)
    if mirrored:  # x of the entity's own axes is -x of the drawing
        circle[:, 0] *= -1.0
    _, points = tool_points(planned(read))
    assert_same_curve(points, circle, 1.3e-4)


@pytest.mark.parametrize(
    ("insunits", "units", "unit"),
    [(4, None, 1e-3), (1, None, 0.0254), (6, None, 1.0), (5, None, 0.01), (4, "inch", 0.0254)],
)
def test_lengths_are_in_the_drawings_unit_or_the_given_one(
    tmp_path: Path, insunits: int, units: str | None, unit: float
) -> None:
    document = drawing(insunits)
    document.modelspace().add_line((1, 2, 3), (4, 6, 3))
    read = read_drawing(document, tmp_path, units=units)
    ends = [each.pose.position for each in read.waypoints if isinstance(each, PoseWaypoint)]
    np.testing.assert_allclose(ends, np.array([(1, 2, 3), (4, 6, 3)]) * unit)
    assert read.notes == ()


def test_a_drawing_without_a_unit_is_in_millimetres_with_a_note(tmp_path: Path) -> None:
    document = drawing(0)
    document.modelspace().add_line((1, 2, 3), (4, 6, 3))
    read = read_drawing(document, tmp_path)
    assert "taken as mm" in read.notes[0]
    assert isinstance(read.waypoints[0], PoseWaypoint)
    np.testing.assert_allclose(read.waypoints[0].pose.position, [0.001, 0.002, 0.003])


@pytest.mark.parametrize("lift", [0.0, 0.05])
def test_moves_between_shapes_are_lifted_against_the_tool_axis(tmp_path: Path, lift: float) -> None:
    document = drawing()
    document.modelspace().add_line((0, 0), (10, 0))
    document.modelspace().add_circle((30, 0), 10)
    read = read_drawing(document, tmp_path, lift=lift, tool_axis=(0.0, 1.0, 0.0))
    found = [each.pose.position.tolist() for each in read.waypoints if isinstance(each, PoseWaypoint)]
    between = [[0.01, -0.05, 0.0], [0.04, -0.05, 0.0]] if lift else []
    expected = [[0, 0, 0], [0.01, 0, 0], *between, [0.04, 0, 0], [0.02, 0, 0], [0.04, 0, 0]]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert read.notes == (f"1 move straight from shape to shape, {'lifted by 0.05 m' if lift else 'without `lift`'}",)


def test_other_entities_are_left_out_with_a_note(tmp_path: Path) -> None:
    document = drawing()
    space = document.modelspace()
    space.add_text("title")
    space.add_point((1, 1))
    space.add_line((0, 0), (10, 0))
    space.add_ellipse((0, 0), (5, 0), 0.5)
    space.add_point((2, 1))
    read = read_drawing(document, tmp_path)
    assert len(read.waypoints) == 2
    assert read.notes[0].startswith("left out 1 TEXT, 2 POINT, 1 ELLIPSE: only LINE, ")


def test_a_drawing_without_lines_is_refused(tmp_path: Path) -> None:
    document = drawing()
    document.modelspace().add_point((1, 1))
    with pytest.raises(InvalidProblem, match="must have a LINE, ARC, CIRCLE or polyline"):
        read_drawing(document, tmp_path)


@pytest.mark.parametrize("value", ["nan", "inf", "1e300", "-1e9"])
def test_coordinates_that_no_robot_reaches_are_refused(tmp_path: Path, value: str) -> None:
    document = drawing()
    document.modelspace().add_line((0, 0), (77, 0))
    document.modelspace().add_lwpolyline([(0, 0), (77, 0), (5, 5)])
    file = tmp_path / "path.dxf"
    document.saveas(file)
    text = file.read_text()
    assert text.count("\n77.0\n") == 2
    for number in (1, 2):
        changed = (
            text.replace("\n77.0\n", f"\n{value}\n", number) if number == 1 else value.join(text.rsplit("77.0", 1))
        )
        file.write_text(changed)
        with pytest.raises(InvalidProblem, match="coordinates must be finite"):
            read_path(file)


@pytest.mark.parametrize("content", [b"", b"0\nSECTION\n", b"\x00\xff" * 50, b"AutoCAD Binary DXF\r\n\x1a\x00", b"{}"])
def test_a_file_that_is_no_drawing_is_refused(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "path.dxf"
    file.write_bytes(content)
    with pytest.raises(InvalidProblem):
        read_path(file)


def test_without_ezdxf_the_message_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ezdxf.filemanagement", None)
    file = tmp_path / "path.dxf"
    file.write_text("0\nEOF\n")
    with pytest.raises(InvalidProblem, match="Install `ezdxf`, or the extra `paths`"):
        read_path(file)


def test_a_drawing_of_r12_without_a_unit_is_in_mm(tmp_path: Path) -> None:
    """For it, ezdxf reports metres."""
    document = ezdxf.new("R12")
    document.modelspace().add_line((0, 0), (100, 0))
    file = tmp_path / "old.dxf"
    document.saveas(file)
    text = file.read_text()
    assert "$INSUNITS" not in text
    read = read_path(file)
    np.testing.assert_allclose(read.waypoints[-1].pose.position, [0.1, 0.0, 0.0])
    assert "taken as mm" in read.notes[0]
