"""Convex pieces in views: the points that they hide, and their parts."""

from __future__ import annotations

import numpy as np
import pytest

from planner.plots.space.surroundings import STANDING, Piece, Thing
from planner.plots.view import VIEWS
from planner.shapes import Box
from planner.shapes.surfaces import surface
from planner.spatial import FloatArray, rotation_from_rpy


def box(size: FloatArray, turn: FloatArray, at: FloatArray) -> Piece:
    return Piece(*surface(Box(size))).moved(turn, at)


@pytest.mark.parametrize(("name", "toward"), [("xy", (0, 0, 1)), ("xz", (0, -1, 0)), ("yz", (1, 0, 0))])
def test_views_look_along_their_axis(name: str, toward: tuple[int, int, int]) -> None:
    assert VIEWS[name].toward == pytest.approx(np.array(toward))


def test_the_isometric_view_shows_all_axes_from_above() -> None:
    view = VIEWS["isometric"]
    assert view.directions @ view.directions.T == pytest.approx(np.eye(2))
    assert view.toward == pytest.approx([0.5198, -0.7424, 0.4226], abs=1e-4)  # 25 degrees above, 55 from the x axis


@pytest.mark.parametrize("name", VIEWS)
def test_a_piece_hides_what_is_behind_it(name: str) -> None:
    """Lines of sight enter and leave a box where they cross the slabs between its faces."""
    rng, view = np.random.default_rng(3), VIEWS[name]
    for _ in range(5):
        size, turn, at = rng.uniform(0.1, 0.5, 3), rotation_from_rpy(*rng.uniform(-3.0, 3.0, 3)), rng.uniform(-1, 1, 3)
        points = at + rng.uniform(-0.5, 0.5, (400, 3))
        origins, way = (points - at) @ turn, view.toward @ turn
        ends = np.sort(np.stack([(-size / 2.0 - origins) / way, (size / 2.0 - origins) / way]), axis=0)
        begin, end = ends[0].max(axis=1), ends[1].min(axis=1)
        truth = np.where(begin < end, np.where(end > 0.0, 1, -1), 0)
        assert (box(size, turn, at).sides(points, view) == truth).all()
        assert {-1, 0, 1} == set(truth.tolist())


def test_pieces_of_one_thing_hide_each_other_s_edges() -> None:
    """A small box inside a large one has no edges; a box that sticks out has the visible ones."""
    large, inside = box(np.ones(3), np.eye(3), np.zeros(3)), box(np.full(3, 0.2), np.eye(3), np.zeros(3))
    half_out = box(np.full(3, 0.2), np.eye(3), np.array([0.0, 0.0, 0.5]))
    ends = np.full(3, -2.0), np.full(3, 2.0)
    alone = Thing("", STANDING, (large,)).edges(VIEWS["xz"], *ends)

    def length(thing: Thing) -> float:
        edges = thing.edges(VIEWS["xz"], *ends)
        return float(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).sum())

    assert length(Thing("", STANDING, (large, inside))) == pytest.approx(length(Thing("", STANDING, (large,))))
    assert np.ptp(alone[..., 2]) == pytest.approx(1.0)
    edges = Thing("", STANDING, (large, half_out)).edges(VIEWS["xz"], *ends)
    assert edges[..., 2].max() == pytest.approx(0.6)
    inner = edges[(np.abs(edges[..., 0]) < 0.15).all(axis=1) & (edges[..., 2].max(axis=1) < 0.49)]
    assert len(inner[np.abs(inner[..., 1]).max(axis=1) < 0.15]) == 0


def test_points_before_and_behind_a_thing_are_told_apart() -> None:
    thing = box(np.array([1.0, 1.0, 1.0]), np.eye(3), np.zeros(3))
    points = np.array([[0.0, 0.0, 2.0], [0.1, 0.3, 0.6], [0.0, 0.0, -0.7], [2.0, 0.0, -0.7], [0.0, 0.0, 0.0]])
    assert thing.sides(points, VIEWS["xy"]).tolist() == [-1, -1, 1, 0, 1]
    assert thing.sides(points, VIEWS["xz"]).tolist() == [0, 0, 0, 0, 1]


def test_a_part_of_a_thing_is_on_its_side_of_the_plane() -> None:
    thing = box(np.array([2.0, 2.0, 2.0]), rotation_from_rpy(0.3, 0.2, 0.1), np.array([0.5, 0.0, 0.0]))
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


def volume(solid: Piece) -> float:
    a, b, c = (solid.vertices[solid.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
