"""The convex pieces of a mesh cover it, and fill little else."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull as Qhull

from planner.robots.catalogue import _package_robots
from planner.shapes.meshes.files import mesh_pieces, read_mesh
from planner.shapes.meshes.mesh import Mesh
from planner.shapes.meshes.pieces import MOST_PIECES, convex_pieces, split
from tests.planner.shapes.mesh_files import bodies, stl, surface_of

BODIES = bodies()
COVERED_WITHIN = 1e-9


def outside(points: np.ndarray, pieces: tuple) -> np.ndarray:
    """Return the distances of points (N, 3) outside the piece that each is deepest in, by scipy's hulls."""
    depths = []
    for piece in pieces:
        planes = Qhull(piece.vertices).equations
        depths.append((points @ planes[:, :3].T + planes[:, 3]).max(axis=1))
    nearest: np.ndarray = np.min(depths, axis=0)
    return nearest


@pytest.mark.long_table
@pytest.mark.parametrize("name", BODIES)
def test_pieces_cover_the_surface(name: str) -> None:
    triangles = BODIES[name]
    pieces = convex_pieces(Mesh.checked(triangles))
    assert 1 <= len(pieces) <= MOST_PIECES
    points = surface_of(triangles[:: 1 + len(triangles) // 500], 1_000, np.random.default_rng(1))
    assert outside(points, pieces).max() < COVERED_WITHIN * max(1.0, np.abs(points).max())


def test_pieces_cover_the_inside_of_a_closed_mesh() -> None:
    rng = np.random.default_rng(2)
    legs = np.concatenate([rng.uniform(0, [0.5, 0.1, 0.1], (2000, 3)), rng.uniform(0, [0.1, 0.1, 0.5], (2000, 3))])
    assert outside(legs, convex_pieces(Mesh.checked(BODIES["l_shape"]))).max() < COVERED_WITHIN


def test_pieces_leave_room_beside_a_thin_middle() -> None:
    pieces = convex_pieces(Mesh.checked(BODIES["dumbbell"]))
    assert 3 <= len(pieces) <= 4
    assert outside(np.array([[0.04, 0.0, 0.25], [0.0, 0.03, 0.2]]), pieces).min() > 0.005
    assert len(convex_pieces(Mesh.checked(BODIES["box"]))) == 1


def test_both_sides_of_a_cut_make_the_whole() -> None:
    """The areas of the triangles below and above add up, and none crosses the cut, even with corners in the plane."""
    rng = np.random.default_rng(4)
    for triangles in (rng.normal(size=(300, 3, 3)), rng.integers(-2, 3, (300, 3, 3)).astype(float)):
        below, above = split(triangles, 1, 0.0)
        areas = [
            np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum()
            for t in (triangles, below, above)
        ]
        flat = (triangles[:, :, 1] == 0.0).all(axis=1)
        assert areas[1] + areas[2] == pytest.approx(areas[0], rel=1e-12)
        assert below[:, :, 1].max() < 1e-12
        assert above[:, :, 1].min() > -1e-12
        assert flat.sum() == (below[:, :, 1] == 0.0).all(axis=1).sum() or not flat.any()


def test_the_same_mesh_is_cut_once() -> None:
    data = stl(BODIES["dumbbell"])
    assert mesh_pieces("a.stl", data) is mesh_pieces("b.stl", bytes(data))
    assert mesh_pieces("a.stl", data) is not mesh_pieces("a.stl", data, (1.0, 1.0, 2.0))


@pytest.mark.long_table
@pytest.mark.parametrize(
    "file",
    [
        *(
            f"ur_description/meshes/ur5/collision/{link}.stl"
            for link in ("base", "shoulder", "upperarm", "forearm", "wrist1")
        ),
        *(f"panda_description/meshes/collision/{link}.stl" for link in ("link0", "link5", "hand")),
        *(f"xarm_description/meshes/xarm7/visual/{link}.stl" for link in ("link_base", "link2", "link5")),
        *(f"kinova_description/meshes/{link}.dae" for link in ("arm", "forearm", "hand_2finger")),
        "z1_description/meshes/collision/z1_GripperMover.STL",
        "so_arm_description/meshes/so100/Base.stl",
    ],
)
def test_pieces_cover_the_links_of_real_robots(file: str) -> None:
    folder = _package_robots()
    if folder is None:
        pytest.skip("the package example-robot-data is not installed")
    mesh = read_mesh(file, (folder / file).read_bytes())
    pieces = mesh_pieces(file, (folder / file).read_bytes())
    points = surface_of(mesh.triangles[:: 1 + len(mesh.triangles) // 500], 1_500, np.random.default_rng(3))
    assert outside(points, pieces.hulls).max() < COVERED_WITHIN


def test_the_forearm_of_a_ur5_is_as_tight_as_six_slabs() -> None:
    """One hull of it has 1.55 times its volume, and refuses the ends of a fifth of the problems of the trial."""
    folder = _package_robots()
    if folder is None:
        pytest.skip("the package example-robot-data is not installed")
    data = (folder / "ur_description/meshes/ur5/collision/forearm.stl").read_bytes()
    triangles = read_mesh("forearm.stl", data).triangles
    low, high = triangles[:, :, 2].min(), triangles[:, :, 2].max()
    slabs, rest = [], triangles
    for height in np.linspace(low, high, 7)[1:-1]:
        slab, rest = split(rest, 2, float(height))
        slabs.append(slab)
    six = sum(Qhull(slab.reshape(-1, 3)).volume for slab in [*slabs, rest])
    ours = sum(Qhull(hull.vertices).volume for hull in mesh_pieces("forearm.stl", data).hulls)
    assert ours <= 1.001 * six
