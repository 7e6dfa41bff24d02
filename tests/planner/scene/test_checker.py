"""Checked pairs: the arm against itself and against attached objects, allowed pairs, single joint positions."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.errors import InvalidProblem
from planner.scene import (
    AttachedObject,
    CollisionChecker,
    PointCloud,
    Scene,
    SceneObject,
    clearances,
    edge,
    is_free,
)
from planner.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere
from planner.spatial import Pose
from tests.planner.capsule_arm import CAPSULE_ARM

KUKA = CAPSULE_ARM
HOME = np.array([0.0, -1.5, 1.5, 0.0, 0.5, 0.0])
FOLDED = np.array([0.0, 0.6, 2.6, 0.0, 0.5, 0.0])
"""A joint position with the arm's hand inside its own base."""


def ahead(distance: float) -> Pose:
    """Return a pose in front of the tool at home, along its own z axis."""
    pose = planner.tool_pose(KUKA, HOME)
    assert pose.rotation is not None
    return Pose(pose.position + distance * pose.rotation[:, 2], pose.rotation)


def test_estimates_refuse_only_where_that_is_asked() -> None:
    assert CollisionChecker(KUKA).is_empty
    wrist = Scene(
        allowed_pairs=[("link_3", "link_5"), ("link_3", "link_6"), ("link_4", "link_6"), ("base_link", "link_2")]
    )
    requested = CollisionChecker(KUKA, wrist, self_collision=True)
    assert not requested.is_empty
    assert is_free(requested, np.array([HOME, FOLDED])).tolist() == [True, False]
    found = clearances(requested, edge(HOME, FOLDED))
    assert not found.is_proved
    assert (hit := found.hit) is not None
    assert len({"link_1", "base_link", "link_2"} & set(requested.names(hit.pair))) == 1


def test_what_is_carried_is_held_against_objects() -> None:
    ball = SceneObject("ball", [Sphere(0.02)], ahead(0.3))
    assert is_free(CollisionChecker(KUKA, Scene([ball])), HOME[None]).all()
    rod = AttachedObject("rod", [Box([0.02, 0.02, 0.3])], Pose([0.0, 0.0, 0.15]))
    checker = CollisionChecker(KUKA, Scene([ball], [rod]))
    assert not is_free(checker, HOME[None]).any()
    assert is_free(CollisionChecker(KUKA, Scene([ball], [rod], [("rod", "ball")])), HOME[None]).all()


def test_margins_of_objects_go_before_that_of_the_scene() -> None:
    for margin, own, free in ((0.0, None, True), (0.4, None, False), (0.4, 0.01, True), (0.0, 0.4, False)):
        ball = SceneObject("ball", [Sphere(0.02)], ahead(0.3), own)
        assert is_free(CollisionChecker(KUKA, Scene([ball], margin=margin)), HOME[None]).all() == free


def test_a_point_cloud_is_as_near_as_its_points() -> None:
    """The clearance of a cloud of thousands of points equals the clearance of its nearest point."""
    rng = np.random.default_rng(1)
    far = rng.uniform(-1.0, 1.0, (5_000, 3)) * [2.0, 2.0, 0.02] - [0.0, 0.0, 0.9]
    near = ahead(0.2).position
    cloud = SceneObject("cloud", [PointCloud(np.vstack([far, near]), radius=0.005)])
    point = SceneObject("point", [Sphere(0.005)], Pose(near))
    motion = edge(HOME, HOME + 0.1)
    bounds = [clearances(CollisionChecker(KUKA, Scene([thing])), motion, tolerance=1e-4) for thing in (cloud, point)]
    assert bounds[0].upper[1] == pytest.approx(bounds[1].upper[1], abs=1e-4)
    assert all(found.upper[1] - found.lower[1] <= 1e-4 + 1e-9 for found in bounds)


def test_bounds_never_exceed_distances() -> None:
    """All pairs within the requested distance are found in groups of obstacles; no bound exceeds a proved distance."""
    rng = np.random.default_rng(4)
    things = [
        SceneObject(f"ball_{k}", [Sphere(rng.uniform(0.01, 0.1))], Pose(rng.uniform(-2.0, 2.0, 3))) for k in range(40)
    ]
    things.append(SceneObject("cloud", [PointCloud(rng.uniform(-1.5, 1.5, (300, 3)), 0.03)], ahead(0.2), margin=0.4))
    things.append(SceneObject("floor", [HalfSpace([0.0, 0.0, 1.0], 0.1)]))
    scene = Scene(things, allowed_pairs=[("link_3", "cloud")], margin=0.3)
    checker = CollisionChecker(KUKA, scene, self_collision=True)
    positions, reach = HOME + rng.uniform(-0.5, 0.5, (3, 6)), rng.uniform(0.0, 0.05, (3, 6))
    placements = checker.bodies.at(positions)
    moved = checker.bodies.displacements(placements, reach).sum(axis=2)
    found = checker.near_items(positions, reach, checker.margins, -np.inf)
    shape = (3, *checker.margins.shape)
    low = np.array(
        [checker.separate(placements, k, checker.own_pairs + n).proved for k, n in np.ndindex(3, shape[1] * shape[2])]
    )
    low = low.reshape(shape)
    bodies, obstacles = np.divmod(found.pairs - checker.own_pairs, shape[2])
    near = np.zeros(shape, dtype=bool)
    near[found.rows, bodies, obstacles] = True
    assert near.sum() == len(found.rows)
    requested = np.broadcast_to(np.isfinite(checker.margins), shape)
    assert not (near & ~requested).any()
    assert near[requested & (low - moved[..., None] < checker.margins)].all()
    assert 0 < near.sum() < requested.sum()
    np.testing.assert_allclose(found.motions, moved[found.rows, bodies], rtol=1e-9)
    assert (found.bounds <= low[found.rows, bodies, obstacles] + 1e-9).all()
    own = checker.near_items(positions, np.zeros((3, 6)), np.full(checker.margins.shape, -np.inf), 0.3)
    distances = np.array(
        [[checker.separate(placements, k, n).proved for n in range(checker.own_pairs)] for k in range(3)]
    )
    near_each_other = np.zeros(distances.shape, dtype=bool)
    near_each_other[own.rows, own.pairs] = True
    assert near_each_other[distances < 0.3].all()
    assert (own.bounds <= distances[own.rows, own.pairs] + 1e-9).all()


def test_bounds_never_exceed_how_deep_things_overlap() -> None:
    """For overlapping boxes, the bound was minus the radius of the link, however deep the overlap."""
    rng = np.random.default_rng(5)
    deep = [Box([0.5, 0.6, 0.7]), Cylinder(0.4, 0.6), Capsule(0.3, 0.5), Sphere(0.4), HalfSpace([0.0, 0.0, 1.0])]
    poses = [Pose.from_rpy(ahead(-0.3).position, rng.uniform(-np.pi, np.pi, 3)) for _ in deep]
    things = [SceneObject(f"thing_{k}", [shape], pose) for k, (shape, pose) in enumerate(zip(deep, poses, strict=True))]
    checker = CollisionChecker(KUKA, Scene(things))
    positions = HOME + rng.uniform(-0.5, 0.5, (5, 6))
    placements = checker.bodies.at(positions)
    found = checker.near_items(positions, np.zeros((5, 6)), np.where(np.isfinite(checker.margins), 10.0, -np.inf), 10.0)
    pairs = list(zip(found.rows.tolist(), found.pairs.tolist(), strict=True))
    distances = np.array([checker.separate(placements, row, pair).distance for row, pair in pairs])
    obstacles = (found.pairs - checker.own_pairs) % len(things)
    deepest = [distances[(found.pairs >= checker.own_pairs) & (obstacles == k)].min() for k in range(len(things))]
    assert max(deepest) < -0.1
    assert (found.bounds <= distances + 1e-9).all()


def test_objects_stand_in_the_world() -> None:
    """An arm on the ceiling meets an object below it in the world, which is above it in its own frame."""
    ceiling = KUKA.derived(mounting=Pose.from_rpy([0.0, 0.0, 3.0], [np.pi, 0.0, 0.0]))
    tool = planner.tool_pose(KUKA, HOME).from_frame(Pose.from_rpy([0.0, 0.0, 3.0], [np.pi, 0.0, 0.0]))
    scene = Scene([SceneObject("ball", [Sphere(0.05)], tool)])
    assert not is_free(CollisionChecker(ceiling, scene), HOME[None]).any()
    assert is_free(CollisionChecker(KUKA, scene), HOME[None]).all()


@pytest.mark.parametrize(
    ("scene", "field"),
    [
        (Scene([SceneObject("link_1", [Sphere(0.1)])]), ("scene", "objects", 0, "id")),
        (Scene([SceneObject("a", [Sphere(0.1)])] * 2), ("scene", "objects", 1, "id")),
        (Scene(attached=[AttachedObject("a", [Sphere(0.1)], link="hand")]), ("scene", "attached", 0, "link")),
        (
            Scene(attached=[AttachedObject("a", [Sphere(0.1)], touch_links=["hand"])]),
            ("scene", "attached", 0, "touch_links", 0),
        ),
        (Scene(attached=[AttachedObject("a", [HalfSpace([0, 0, 1])])]), ("scene", "attached", 0, "shapes", 0)),
        (Scene(allowed_pairs=[("link_1", "moon")]), ("scene", "allowed_pairs", 0)),
    ],
)
def test_names_that_mean_nothing_are_refused(scene: Scene, field: tuple[str | int, ...]) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        CollisionChecker(KUKA, scene)
    assert [fault.field for fault in refusal.value.faults] == [field]


def test_invalid_joint_positions_are_refused_and_an_empty_list_is_free() -> None:
    """The position of an arm at NaN is unknown: it is not proved collision-free."""
    checker = CollisionChecker(KUKA, Scene([SceneObject("ball", [Sphere(0.02)], ahead(0.1))]))
    assert is_free(checker, [HOME.tolist()]).shape == (1,)
    assert is_free(checker, np.empty((0, 6))).shape == (0,)
    assert planner.collisions_at(checker, np.empty((0, 6))) == ()
    for positions in (HOME, np.zeros((2, 5)), [[*HOME[:5], np.nan]], np.full((1, 6), np.inf)):
        for ask in (is_free, planner.collisions_at):
            with pytest.raises(InvalidProblem, match="positions: rows of 6 numbers are needed"):
                ask(checker, positions)


NOWHERE = Pose([np.nan, 0.0, 0.0])
STRETCHED = Pose([1.0, 0.0, 0.0], np.diag([2.0, 1.0, 1.0]))
MIRRORED = Pose([1.0, 0.0, 0.0], np.diag([-1.0, 1.0, 1.0]))


@pytest.mark.parametrize(
    ("scene", "field"),
    [
        *((Scene(margin=margin), ("margin",)) for margin in (np.nan, np.inf, -0.001)),
        (Scene([SceneObject("a", [Sphere(0.1)], margin=np.nan)]), ("objects", 0, "margin")),
        (Scene(attached=[AttachedObject("a", [Sphere(0.1)], margin=np.nan)]), ("attached", 0, "margin")),
        (Scene(pair_margins=[("link_1", "a", np.nan)]), ("pair_margins", 0)),
        *((Scene([SceneObject("a", [Sphere(0.1)], pose)]), ("objects", 0, "pose")) for pose in (NOWHERE, STRETCHED)),
        (Scene(attached=[AttachedObject("a", [Sphere(0.1)], MIRRORED)]), ("attached", 0, "pose")),
    ],
)
def test_margins_and_poses_that_are_none_are_refused(scene: Scene, field: tuple[str | int, ...]) -> None:
    """With a NaN as margin or position, every request would be proved free."""
    with pytest.raises(InvalidProblem) as refusal:
        CollisionChecker(KUKA, scene)
    assert [fault.field for fault in refusal.value.faults] == [("scene", *field)]
