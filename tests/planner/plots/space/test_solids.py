"""Which thing hides which, held against lines of sight; cameras, against points that they see."""

from __future__ import annotations

import numpy as np
import pytest

from planner.plots.space.camera import Camera
from planner.plots.space.solids import Solid, painted_order
from planner.shapes import Box
from planner.shapes.surfaces import surface
from planner.spatial import FloatArray, rotation_from_rpy

ABOVE, SIDE, END = (Camera.onto(columns) for columns in ((0, 1), (0, 2), (1, 2)))


def perspective(eye: FloatArray, turn: FloatArray) -> Camera:
    """A pinhole at a point that looks along -z of its own axes, the columns of a rotation."""
    right, up, back = turn.T
    rows = np.array([right, up, -back])
    return Camera(np.column_stack([rows, -rows @ eye]))


CAMERAS = {
    "xy": ABOVE,
    "xz": SIDE,
    "yz": END,
    "near": perspective(np.array([1.0, -3.0, 2.5]), rotation_from_rpy(0.9, 0.1, 0.3)),
    "far": perspective(np.array([20.0, -60.0, 50.0]), rotation_from_rpy(0.9, 0.0, 0.3)),
}


def box(name: str, size: FloatArray, turn: FloatArray, at: FloatArray) -> Solid:
    vertices, faces = surface(Box(size))
    return Solid(name, vertices @ turn.T + at, faces)


@pytest.mark.parametrize(("camera", "toward"), [(ABOVE, (0, 0, 1)), (SIDE, (0, -1, 0)), (END, (1, 0, 0))])
def test_views_look_along_their_axis(camera: Camera, toward: tuple[int, int, int]) -> None:
    assert camera.eye == pytest.approx([*toward, 0.0])
    assert camera.nearness(np.array(toward, dtype=float)) > camera.nearness(np.zeros(3))


def test_the_eye_of_a_pinhole_is_where_it_is() -> None:
    eye = np.array([1.0, -3.0, 2.5])
    camera = perspective(eye, rotation_from_rpy(0.9, 0.1, 0.3))
    assert camera.eye == pytest.approx([*eye, 1.0])
    sides = camera.sides(np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]), np.array([2.0, 0.0]))
    assert sides == pytest.approx([0.5, -3.0])
    assert camera.nearness(np.zeros(3)) == pytest.approx(-np.linalg.norm(eye))


def sight(camera: Camera, seen: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Origin and direction, away from the eye, of a line of sight through a point (2,) of the picture."""
    if camera.eye[3] == 0.0:
        origin = np.linalg.lstsq(camera.matrix[:2, :3], seen - camera.matrix[:2, 3], rcond=None)[0]
        return origin + 100.0 * camera.eye[:3], -camera.eye[:3]
    way = np.linalg.solve(camera.matrix[:, :3], [*seen, 1.0])
    return camera.eye[:3], way / np.linalg.norm(way)


def met(size: FloatArray, turn: FloatArray, at: FloatArray, origin: FloatArray, way: FloatArray) -> float | None:
    """How far along a line a box begins, by the slabs between its faces."""
    o, w = turn.T @ (origin - at), turn.T @ way
    with np.errstate(divide="ignore"):
        ends = np.sort(np.stack([(-size / 2.0 - o) / w, (size / 2.0 - o) / w]), axis=0)
    return float(ends[0].max()) if ends[0].max() < ends[1].min() else None


def separated(rows: list[tuple[FloatArray, FloatArray, FloatArray]], row: tuple[FloatArray, ...]) -> bool:
    """Whether the spheres around boxes are apart, or those of aligned ones themselves."""
    size, turn, at = row
    return all(
        np.linalg.norm(at - other) > 0.5 * (np.linalg.norm(size) + np.linalg.norm(s))
        or ((turn == t).all() and (np.abs(at - other) >= 0.5 * (size + s)).any())
        for s, t, other in rows
    )


def assert_hides_what_is_behind(
    rows: list[tuple[FloatArray, FloatArray, FloatArray]], camera: Camera, random: np.random.Generator
) -> int:
    """Along lines of sight, what is met first is painted last; returns how many pairs were seen."""
    order = painted_order([box(str(k), *row) for k, row in enumerate(rows)], camera)
    assert sorted(order) == list(range(len(rows)))
    rank = np.argsort(order)
    pairs = 0
    for size, turn, at in rows:
        for _ in range(15):
            through = at + turn @ (random.uniform(-0.49, 0.49, 3) * size)
            origin, way = sight(camera, camera.project(through[None])[0])
            begins = {k: begin for k, row in enumerate(rows) if (begin := met(*row, origin, way)) is not None}
            nearest_first = sorted(begins, key=lambda k: begins[k])
            painted = [int(rank[k]) for k in nearest_first]
            assert painted == sorted(painted, reverse=True)
            pairs += len(painted) - 1
    return pairs


@pytest.mark.parametrize("name", CAMERAS)
def test_what_is_met_first_is_painted_last(name: str) -> None:
    random, pairs = np.random.default_rng(3), 0
    for _ in range(3):
        rows: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        while len(rows) < 12:
            size = random.uniform(0.1, 0.5, 3)
            row = size, rotation_from_rpy(*random.uniform(-3.0, 3.0, 3)), random.uniform(-1.0, 1.0, 3)
            if separated(rows, row):
                rows.append(row)
        pairs += assert_hides_what_is_behind(rows, CAMERAS[name], random)
    assert pairs > 50


@pytest.mark.parametrize("name", CAMERAS)
def test_things_on_a_large_table_are_painted_over_it(name: str) -> None:
    """Middles of boxes tell nothing here: that of the table is nearer than things at its far end."""
    turn = np.eye(3)
    rows = [(np.array([4.0, 4.0, 0.1]), turn, np.array([0.0, 0.0, -0.05]))]
    rows += [(np.array([0.2, 0.2, 0.3]), turn, np.array([x, y, 0.15])) for x in (-1.8, 0.0, 1.8) for y in (-1.8, 1.8)]
    rows += [(np.array([0.2, 0.2, 0.1]), turn, np.array([x, 1.8, 0.35])) for x in (-1.8, 0.0)]
    assert assert_hides_what_is_behind(rows, CAMERAS[name], np.random.default_rng(1)) > 50


def test_of_many_things_the_nearest_is_painted_last() -> None:
    """More than are ordered by planes: a row of 300 boxes along the line of sight, in any order."""
    vertices, faces = surface(Box([0.5, 0.01, 0.5]))
    places = np.random.default_rng(0).permutation(300)
    solids = [Solid(str(k), vertices + np.array([0.0, 0.02 * k, 0.0]), faces) for k in places.tolist()]
    order = painted_order(solids, SIDE)
    assert [solids[k].name for k in order] == [str(k) for k in range(299, -1, -1)]


def test_rings_of_things_that_hide_each_other_are_painted_all_the_same() -> None:
    """Three bars in a ring, each over the next: no order is right, and every one is an answer."""
    bars = []
    for k in range(3):
        angle = 2.0 * np.pi * k / 3.0
        turn = rotation_from_rpy(0.0, 0.0, angle) @ rotation_from_rpy(0.0, 0.15, 0.0)
        bars.append(box(str(k), np.array([2.0, 0.1, 0.1]), turn, turn @ [0.0, 0.4, 0.0]))
    assert sorted(painted_order(bars, ABOVE)) == [0, 1, 2]


def test_points_before_and_behind_a_thing_are_told_apart() -> None:
    thing = box("", np.array([1.0, 1.0, 1.0]), np.eye(3), np.zeros(3))
    points = np.array([[0.0, 0.0, 2.0], [0.1, 0.3, 0.6], [0.0, 0.0, -0.7], [2.0, 0.0, -0.7], [0.0, 0.0, 0.0]])
    assert thing.hidden(points, ABOVE) == (1, 2)
    assert thing.hidden(points, SIDE) == (0, 0)


def test_a_part_of_a_thing_is_on_its_side_of_the_plane() -> None:
    thing = box("", np.array([2.0, 2.0, 2.0]), rotation_from_rpy(0.3, 0.2, 0.1), np.array([0.5, 0.0, 0.0]))
    normal = np.array([0.6, 0.0, 0.8])
    part = thing.cut(normal, 0.1)
    assert part is not None
    heights = part.vertices @ normal
    assert heights.max() == pytest.approx(0.1)
    assert heights.min() == pytest.approx((thing.vertices @ normal).min())
    rest = thing.cut(-normal, -0.1)
    assert rest is not None
    assert volume(part) + volume(rest) == pytest.approx(8.0)
    assert thing.cut(normal, 10.0) is thing
    assert thing.cut(normal, -10.0) is None


def volume(solid: Solid) -> float:
    a, b, c = (solid.vertices[solid.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
