"""Objects that touch, or slide along each other at their margin, are decided by a few distances."""

from __future__ import annotations

from itertools import product

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.robots import Robot, load_robot
from planner.scene import AttachedObject, CollisionChecker, Scene, SceneObject, clearances
from planner.scene.bodies import excursions
from planner.scene.checker import CONTACT_TOLERANCE
from planner.scene.separations import Placed, separation
from planner.shapes import Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere
from planner.spatial import FloatArray, Pose, rotation_from_rpy
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.scene.reference.bounds import Items, ReferenceChecker
from tests.planner.scene.reference.planes import Changes, approaches
from tests.planner.shapes.solids import KINDS, shape_of
from tests.sizes import SIZE

KUKA = load_robot("kuka_kr16_2")
DOWN = rotation_from_rpy(np.pi, 0.0, 0.0)
SIDE = 0.04
"""Side of the attached box, m."""

TOP = 0.3
"""Height of the surface, m."""

FEW = 1500
"""Number of distances that decide a slide of 0.4 m: one every 10 micrometres would be 40,000."""

CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))

CARRIED: dict[str, Shape] = {
    "box": Box([SIDE] * 3),
    "cylinder": Cylinder(SIDE / 2.0, SIDE),
    "hull": ConvexHull(CORNERS * SIDE),
    "sphere": Sphere(SIDE / 2.0),
}
SURFACES: dict[str, tuple[Shape, Pose]] = {
    "box": (Box([0.8, 0.8, 0.1]), Pose([1.2, 0.0, TOP - 0.05])),
    "half_space": (HalfSpace([0.0, 0.0, 1.0], TOP), Pose([0.0, 0.0, 0.0])),
    "hull": (ConvexHull(CORNERS * [0.8, 0.8, 0.1]), Pose([1.2, 0.0, TOP - 0.05])),
}


def slide(carried: Shape, surface: tuple[Shape, Pose], gap: float, margin: float = 0.0) -> planner.PlanningProblem:
    """Slide an attached box along a surface, and turn it, so much above the margin, m."""
    height = TOP + SIDE + gap + margin
    start, goal = (Pose([1.2, y, height], rotation_from_rpy(np.pi, 0.0, turn)) for y, turn in ((-0.2, 0.0), (0.2, 1.0)))
    waypoints = [planner.PoseWaypoint(start), planner.PoseWaypoint(goal, motion=planner.LinearMotion())]
    table = SceneObject("table", [surface[0]], surface[1])
    held = AttachedObject("held", (carried,), Pose([0.0, 0.0, SIDE / 2.0]))
    return planner.PlanningProblem(KUKA, waypoints, scene=Scene([table], [held], margin=margin))


@pytest.mark.long_table
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("carried", CARRIED)
def test_what_slides_at_its_margin_is_proved(carried: str, surface: str) -> None:
    for margin, gap in ((0.0, 0.0), (0.0, -5e-6), (0.02, 1e-9)):
        problem = slide(CARRIED[carried], SURFACES[surface], gap, margin)
        plan = planner.plan(problem, "quintic")
        clearance = plan.certificate.clearance
        assert clearance is not None and clearance.scene is not None
        assert margin - CONTACT_TOLERANCE <= clearance.scene.lower <= margin + gap + 1e-6
        found = clearances(CollisionChecker(KUKA, problem.scene), plan.trajectory)
        assert found.is_proved
        assert found.distances < FEW


@pytest.mark.parametrize("carried", CARRIED)
def test_what_slides_too_deep_is_a_collision(carried: str) -> None:
    trajectory = planner.plan(slide(CARRIED[carried], SURFACES["box"], -5e-6), "quintic").trajectory
    lower = slide(CARRIED[carried], (SURFACES["box"][0], Pose([1.2, 0.0, TOP - 0.05 + 1e-5])), 0.0).scene
    found = clearances(CollisionChecker(KUKA, lower), trajectory)
    assert found.hit is not None
    assert found.hit.distance == pytest.approx(-1.5e-5, abs=1e-7)
    assert found.distances < FEW


@pytest.mark.parametrize("gap", [-1.00000001e-5, -1e-5, -0.99999999e-5])
def test_what_cannot_be_told_is_refused_soon(gap: float) -> None:
    """At the limit of contact only rounding decides: further splits do not help."""
    trajectory = planner.plan(slide(CARRIED["box"], SURFACES["box"], 0.0), "quintic").trajectory
    lower = slide(CARRIED["box"], (SURFACES["box"][0], Pose([1.2, 0.0, TOP - 0.05 - gap])), 0.0).scene
    assert clearances(CollisionChecker(KUKA, lower), trajectory).distances < FEW


def test_boxes_side_by_side() -> None:
    """A box moves down between two others, and touches both all the time."""
    start, goal = (planner.PoseWaypoint(Pose([1.2, 0.0, z], DOWN)) for z in (0.8, 0.65))
    goal = planner.PoseWaypoint(goal.pose, motion=planner.LinearMotion())
    beside = [SceneObject(f"box {k}", [Box([0.3, 0.1, 0.4])], Pose([1.2, k * 0.07, 0.2])) for k in (-1, 1)]
    scene = Scene(beside, [AttachedObject("held", (CARRIED["box"],), Pose([0.0, 0.0, 0.43]))])
    plan = planner.plan(planner.PlanningProblem(KUKA, [start, goal], scene=scene), "quintic")
    assert plan.certificate.clearance is not None
    assert clearances(CollisionChecker(KUKA, scene), plan.trajectory).distances < FEW


@pytest.mark.parametrize("first", KINDS)
@pytest.mark.parametrize("second", ["box", "hull", "cylinder"])
def test_planes_between_shapes_that_touch_prove_that_they_do(first: str, second: str) -> None:
    """Two shapes move together along a line until their supports along it meet: they only touch."""
    rng = np.random.default_rng(8)
    for _ in range(10):
        n = np.array([0.0, 0.0, 1.0])
        a, b = shape_of(first, rng), shape_of(second, rng)
        turn = rotation_from_rpy(0.0, 0.0, rng.uniform(-3.0, 3.0))
        height = float(a.support(n[None])[0] + b.support(-n[None])[0])
        for gap in (0.0, 1e-10, -1e-10):
            below, above = Placed(a, turn, np.zeros(3)), Placed(b, np.eye(3), np.array([0.0, 0.0, height + gap]))
            assert separation(below, above).proved >= gap - 1e-6


def corners_seen(robot: Robot, checker: CollisionChecker, pair: int, positions: FloatArray) -> FloatArray:
    """Return the corners of a hull (positions, corners, 3) where the other piece stands still, by Pinocchio."""
    first, second = checker.numbers_of(np.array([pair]))[0].tolist()
    body, standing = (first, 0) if pair >= checker.own_pairs else (second, checker.bodies.pieces[first].joint)
    piece = checker.bodies.pieces[body]
    assert isinstance(piece.shape, ConvexHull)
    corners = piece.shape.vertices @ piece.rotation.T + piece.translation
    data, found = robot.model.createData(), []
    for position in positions:
        pin.forwardKinematics(robot.model, data, position)
        placed = data.oMi[standing].actInv(data.oMi[piece.joint])
        found.append(corners @ placed.rotation.T + placed.translation)
    return np.array(found) @ data.oMi[standing].rotation.T + data.oMi[standing].translation


@pytest.mark.sized
@pytest.mark.parametrize("itself", [False, True])
@pytest.mark.parametrize("arm", ["kuka_kr16_2", "date_sorting_arm", "on_rail"])
def test_no_corner_comes_nearer_than_is_bounded(arm: str, itself: bool) -> None:
    """The truth is dense samples of a hull's corners along the plane's normal; the bound is of second order."""
    rail = planner.ExternalAxis("rail", "prismatic", (1, 1, 0), lower=-3.0, upper=3.0, velocity=2.0)
    robot = KUKA.derived(id=arm, external_axes=[rail]) if arm == "on_rail" else load_robot(arm)
    rng = np.random.default_rng(9)
    for _ in range(2 + SIZE.examples // 10):
        held = AttachedObject("held", (ConvexHull(rng.normal(size=(8, 3)) * 0.1),), Pose(rng.normal(size=3) * 0.2))
        thing = SceneObject("thing", [Capsule(0.1, 0.1)], Pose([5.0, 0.0, 0.0]))
        checker = ReferenceChecker(robot, Scene([thing], [held]), self_collision=itself)
        body = len(checker.bodies.pieces) - 1
        pair = checker.own_pairs + body
        if itself:
            pair = int(rng.choice(np.flatnonzero(checker.second == body)))
        coefficients = rng.normal(size=(2, robot.dof, 4)) * [1.0, 1.0, 2.0, 3.0]
        coefficients[1, :, 0] = coefficients[0].sum(axis=1)
        motion = PiecewisePolynomial(np.ones(2), coefficients)
        middles = rng.uniform(0.2, 1.8, 8)
        halves = 10.0 ** rng.uniform(-4.0, -1.0, 8)
        positions, velocities = motion.evaluate(middles, [0, 1])
        starts, ends = middles - halves, middles + halves
        reach = excursions(motion, starts, ends, positions)
        changes = Changes(velocities, halves, reach, excursions(motion, starts, ends, positions, velocities))
        placements = checker.bodies.at(positions)
        normals = rng.normal(size=(8, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        items = Items(np.arange(8), np.full(8, pair))
        bounds = approaches(checker, placements, items, normals, changes)
        for k in range(8):
            times = np.append(np.linspace(starts[k], ends[k], 301), middles[k])
            towards = -normals[k] if itself else normals[k]
            heights = (corners_seen(robot, checker, pair, motion.evaluate(times, [0])[0]) @ towards).max(axis=1)
            truth = heights.max() - heights[-1]
            assert truth <= bounds[k] + 1e-12
            if starts[k] > 1.0 or ends[k] < 1.0:  # smooth there
                assert bounds[k] <= truth + 1e4 * halves[k] ** 2
