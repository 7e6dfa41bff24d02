"""The kernels of distances: the same verdicts as numpy, distances by least squares, and no lost error."""

from __future__ import annotations

import numpy as np
import pytest

from planner.kernels.clearance import Distances, Measured
from planner.robots import load_robot
from planner.scene import (
    CONTACT_TOLERANCE,
    AttachedObject,
    CollisionChecker,
    PointCloud,
    Scene,
    SceneObject,
    clearances,
    is_free,
)
from planner.scene.arrays import core_of, piece_arrays
from planner.scene.continuous import edge
from planner.scene.separations import Placed
from planner.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere
from planner.spatial import FloatArray, Pose, rotation_from_rpy
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.scene.least_squares import distance, random_placed
from tests.planner.scene.random_scenes import motion_between
from tests.planner.scene.reference.bounds import ReferenceChecker
from tests.planner.scene.reference.search import numpy_clearances
from tests.planner.shapes.solids import KINDS, shape_of
from tests.sizes import SIZE

ARM = load_robot("three_dof_arm")
TOLERANCE = 1e-3
"""Accuracy of measured clearances, m."""


def anywhere(rng: np.random.Generator, near: float = 0.4, far: float = 1.1) -> Pose:
    way = rng.normal(size=3)
    height = np.array([0.0, 0.0, 0.3])
    return Pose(way / np.linalg.norm(way) * rng.uniform(near, far) + height, rotation_from_rpy(*rng.uniform(-3, 3, 3)))


def random_solid(rng: np.random.Generator, size: float) -> Shape:
    match rng.integers(5):
        case 0:
            return Box(rng.uniform(0.02, size, 3))
        case 1:
            return Sphere(rng.uniform(0.02, size / 2.0))
        case 2:
            return Cylinder(rng.uniform(0.02, size / 2.0), rng.uniform(0.02, size))
        case 3:
            return Capsule(rng.uniform(0.02, size / 2.0), rng.uniform(0.02, size))
        case _:
            return ConvexHull(rng.normal(size=(rng.integers(4, 40), 3)) * size / 3.0)


def things_of(rng: np.random.Generator, kind: str) -> list[SceneObject]:
    match kind:
        case "30 boxes" | "100 boxes":
            count, far = (30, 1.1) if kind == "30 boxes" else (100, 2.5)
            sizes = rng.uniform(0.03, 0.15, (count, 3))
            return [SceneObject(f"thing_{k}", [Box(size)], anywhere(rng, far=far)) for k, size in enumerate(sizes)]
        case "cloud":
            return [SceneObject("cloud", [PointCloud(rng.normal(size=(1000, 3)) * 0.8, 0.005, 0.02)])]
    solids = [
        SceneObject(f"thing_{k}", [random_solid(rng, 0.3)], anywhere(rng), rng.choice([None, 0.02])) for k in range(5)
    ]
    return [*solids, SceneObject("wall", [HalfSpace(rng.normal(size=3), -rng.uniform(0.4, 1.0))])]


@pytest.mark.sized
@pytest.mark.parametrize("kind", ["30 boxes", "100 boxes", "solids", "attached", "cloud", "itself"])
@pytest.mark.parametrize("arm", ["ur5", "kuka_kr16_2", "date_sorting_arm", "three_dof_arm"])
def test_verdicts_and_clearances_are_those_of_numpy(arm: str, kind: str) -> None:
    robot = load_robot(arm)
    lower, upper = np.maximum(robot.limit("lower"), -2.5), np.minimum(robot.limit("upper"), 2.5)
    rng = np.random.default_rng([len(arm), len(kind)])
    for _ in range(max(2, SIZE.examples // 10)):
        scene = None
        if kind != "itself":
            held = [AttachedObject("held", [random_solid(rng, 0.15)])] if kind == "attached" else []
            pairs = [("held", "thing_0", -5e-4)] if held else []
            scene = Scene(things_of(rng, kind), held, margin=rng.choice([0.0, 0.01, 0.05]), pair_margins=pairs)
        start, goal = rng.uniform(lower, upper, (2, robot.dof))
        motion = motion_between(start, start + rng.uniform(0.1, 0.6) * (goal - start))
        checker = ReferenceChecker(robot, scene, self_collision=True)
        for tolerance in (None, TOLERANCE):
            found = clearances(checker, motion, tolerance=tolerance)
            expected = numpy_clearances(checker, motion, tolerance=tolerance)
            assert found.is_proved == expected.is_proved
            assert (found.hit is None) == (expected.hit is None)
            if found.is_proved and tolerance is not None:
                assert (np.isfinite(found.lower) == np.isfinite(expected.lower)).all()
                assert (found.lower <= expected.upper + 1e-9).all()
                assert (expected.lower <= found.upper + 1e-9).all()
                known = np.isfinite(found.lower)
                assert (found.upper[known] - found.lower[known] <= TOLERANCE + 1e-9).all()


def between(first: Placed, second: Placed) -> CollisionChecker:
    """Return a checker of two shapes alone: an arm at zero carries the first, the second is fixed."""
    tool = CollisionChecker(ARM).bodies.frames(np.zeros((1, ARM.dof)))
    frame = ARM.model.frames[ARM.tool_frame_id]
    rotation = tool[0][0, frame.parentJoint] @ frame.placement.rotation
    origin = tool[0][0, frame.parentJoint] @ frame.placement.translation + tool[1][0, frame.parentJoint]
    held = AttachedObject("held", [first.shape], Pose(first.translation, first.rotation))
    there = Pose(rotation @ second.translation + origin, rotation @ second.rotation)
    links = [(link, "thing") for link in {shape.link for shape in ARM.collision_shapes}]
    scene = Scene([SceneObject("thing", [second.shape], there)], [held], links)
    return CollisionChecker(ARM, scene, self_collision=False)


@pytest.mark.sized
def test_distances_are_those_of_least_squares() -> None:
    rng = np.random.default_rng(7)
    apart = 0
    still = edge(np.zeros(ARM.dof), np.zeros(ARM.dof))
    for _ in range(6 * SIZE.examples):
        spread = 10.0 ** rng.uniform(-1.0, 0.5)
        first, second = random_placed(rng, spread), random_placed(rng, spread)
        truth = distance(first, second)
        checker = between(first, second)
        found = clearances(checker, still, tolerance=1e-9)
        assert found.lower[1] <= truth + 1e-6
        if truth > 1e-4:
            apart += 1
            assert found.is_proved
            assert found.lower[1] >= truth - 2e-5
            assert found.upper[1] == pytest.approx(truth, abs=2e-5)
    assert apart > SIZE.examples


@pytest.mark.parametrize("kind", KINDS)
def test_the_core_of_a_shape_reaches_as_far_as_the_shape(kind: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        shape, directions = shape_of(kind, rng), rng.normal(size=(50, 3))
        core = core_of(shape)
        of_disc, of_ball = np.hypot(directions[:, 0], directions[:, 1]), np.linalg.norm(directions, axis=1)
        reach = (directions @ core.points.T).max(axis=1) + core.disc * of_disc + core.ball * of_ball
        assert reach == pytest.approx(shape.support(directions), rel=1e-12)


def test_how_deep_a_pair_overlaps_is_measured_outside_of_the_kernel() -> None:
    still = edge(np.zeros(6), np.zeros(6))
    inside = SceneObject("block", [Box([0.2, 0.2, 0.2])], Pose([1.5, 0.0, 1.0]))
    checker = CollisionChecker(load_robot("kuka_kr16_2"), Scene([inside], margin=0.5))
    found = clearances(checker, still)
    assert found.hit is not None
    placements = checker.bodies.at(np.zeros((1, 6)))
    assert found.hit.distance == pytest.approx(checker.separate(placements, 0, found.hit.pair).distance, abs=1e-7)


def two_boxes(depth: float) -> Distances:
    """Return the kernels of an attached box and a box that it overlaps, whose depth cannot be measured."""
    cube = Box([0.2, 0.2, 0.2])
    first = Placed(cube, np.eye(3), np.zeros(3))
    checker = between(first, Placed(cube, np.eye(3), np.array([0.2 - depth, 0.01, 0.02])))
    kinds = np.ones(checker.margins.shape, dtype=int)
    own = np.empty((2, 0), dtype=int)

    def measure(_rotations: FloatArray, _origins: FloatArray, pair: int) -> Measured:
        raise ZeroDivisionError(pair)

    return Distances(
        piece_arrays(checker.bodies, checker.obstacles, own, np.zeros(own.shape[1]), checker.margins, kinds), measure
    )


REQUEST = (CONTACT_TOLERANCE, TOLERANCE, 4, 1e-12, 1000, 1000)
"""Numbers of the structure `Request` of the kernels."""


def test_an_error_of_the_function_that_measures_is_raised_and_leaves_the_kernel_usable() -> None:
    still = edge(np.zeros(ARM.dof), np.zeros(ARM.dof))
    motion = still.lengths, still.coefficients, still.breakpoints
    with pytest.raises(ZeroDivisionError):
        two_boxes(0.01).prove(*motion, REQUEST)
    with pytest.raises(ZeroDivisionError):
        two_boxes(CONTACT_TOLERANCE / 2.0).first_collision(np.zeros((1, ARM.dof)), CONTACT_TOLERANCE)
    assert two_boxes(-0.01).prove(*motion, REQUEST).hit[2] == -1.0


@pytest.mark.parametrize("number", [np.nan, np.inf, 1e308])
def test_nothing_is_proved_of_a_motion_without_numbers(number: float) -> None:
    """Supports of pieces at NaN came out as infinitely far away."""
    far = SceneObject("far", [Box([0.1, 0.1, 0.1])], Pose([0.0, 0.0, 100.0]))
    checker = CollisionChecker(ARM, Scene([far]), self_collision=True)
    assert clearances(checker, edge(np.zeros(ARM.dof), np.zeros(ARM.dof))).is_proved
    for row in range(2):
        coefficients = np.zeros((2, ARM.dof, 3))
        coefficients[row, 1, 1:] = number
        motion = PiecewisePolynomial(np.full(2, 10.0), coefficients)
        for tolerance in (None, TOLERANCE):
            assert not clearances(checker, motion, tolerance=tolerance).is_proved


def test_motions_and_arrays_of_other_shapes_are_refused() -> None:
    kernels = two_boxes(-0.01)
    with pytest.raises(ValueError, match="shape"):
        kernels.prove(np.ones(1), np.zeros((1, ARM.dof + 1, 2)), np.array([0.0, 1.0]), REQUEST)
    with pytest.raises(ValueError, match="shape"):
        kernels.first_collision(np.zeros((1, ARM.dof + 1)), CONTACT_TOLERANCE)
    arrays = kernels._arrays
    with pytest.raises(ValueError, match="index"):
        Distances(arrays._replace(members=arrays.members + 1), kernels._measure)


def test_single_joint_positions_are_free_where_a_motion_that_stays_there_is_proved() -> None:
    robot = load_robot("ur5e")
    rng = np.random.default_rng(7)
    things = [SceneObject(f"thing_{k}", [random_solid(rng, 0.2)], anywhere(rng, 0.6)) for k in range(4)]
    cloud = SceneObject("cloud", [PointCloud(rng.uniform(-0.1, 0.1, (40, 3)), 0.02)], anywhere(rng, 0.6))
    wall = SceneObject("wall", [HalfSpace([0.0, 1.0, 0.0], -0.7)])
    checker = CollisionChecker(robot, Scene([*things, cloud, wall], margin=0.01))
    positions = rng.uniform(-1.5, 1.5, (300, robot.dof))
    assert 30 < is_free(checker, positions).sum() < 270
    assert is_free(checker, positions).tolist() == [clearances(checker, edge(q, q)).is_proved for q in positions]


@pytest.mark.parametrize("depth", [-1e-3, 0.0, CONTACT_TOLERANCE / 2.0, 2.0 * CONTACT_TOLERANCE, 1e-3])
def test_boxes_that_touch_are_free_up_to_the_contact_tolerance(depth: float) -> None:
    cube, still = Box([0.2, 0.2, 0.2]), np.zeros((1, ARM.dof))
    first, second = Placed(cube, np.eye(3), np.zeros(3)), Placed(cube, np.eye(3), np.array([0.2 - depth, 0.01, 0.02]))
    assert is_free(between(first, second), still).tolist() == [depth <= CONTACT_TOLERANCE]


def test_the_first_joint_position_that_collides_is_found() -> None:
    robot = load_robot("ur5e")
    rng = np.random.default_rng(6)
    things = [SceneObject(f"thing_{k}", [random_solid(rng, 0.2)], anywhere(rng, 0.6)) for k in range(4)]
    checker = CollisionChecker(robot, Scene([*things, SceneObject("wall", [HalfSpace([0.0, 1.0, 0.0], -0.7)])]))
    positions = rng.uniform(-1.5, 1.5, (200, robot.dof))
    collides = np.array([not clearances(checker, edge(q, q)).is_proved for q in positions])
    find = checker.distances.first_collision
    assert [find(q[None], CONTACT_TOLERANCE) is not None for q in positions] == collides.tolist()
    assert 20 < collides.sum() < 180
    assert find(positions, CONTACT_TOLERANCE) == int(np.argmax(collides))
    assert find(positions[~collides], CONTACT_TOLERANCE) is None
    wider = CollisionChecker(robot, Scene(checker.scene.objects, margin=0.02), self_collision=False)
    by_margin = [wider.distances.first_collision(q[None], 0.0) is not None for q in positions]
    alone = CollisionChecker(robot, checker.scene, self_collision=False)
    assert [alone.distances.first_collision(q[None], -0.02) is not None for q in positions] == by_margin
