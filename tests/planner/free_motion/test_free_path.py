"""A returned path is collision-free at dense samples, whatever the scene; and it is the same every time."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from planner.free_motion import FreePath, find_free_path
from planner.free_motion.edges import FreeEdges
from planner.free_motion.rrt_connect import LEAST_RADIUS, Trees
from planner.free_motion.tree import Tree
from planner.kinematics.forward import tool_pose
from planner.kinematics.inverse import inverse_kinematics
from planner.robots import Robot
from planner.scene import CONTACT_TOLERANCE, CollisionChecker, Scene, SceneObject, clearances, edge
from planner.shapes import Box, Cylinder, Sphere
from planner.spatial import FloatArray, Pose
from tests.planner.free_motion.cases import ARM, LEFT, RIGHT, WALL
from tests.planner.scene.brute_force import distances_over_time
from tests.sizes import SIZE

SAMPLES = 200
"""Number of closely checked joint positions of a leg: the tool moves some 5 mm between them."""


def path_among(
    things: list[SceneObject],
    start: FloatArray,
    goals: list[FloatArray],
    robot: Robot = ARM,
    margin: float = 0.0,
    **more: int,
) -> FreePath:
    checker = CollisionChecker(robot, Scene(things, margin=margin), self_collision=False)
    return find_free_path(robot, checker, start, goals, **more)


def least_distance(path: FreePath, things: list[SceneObject], robot: Robot = ARM) -> float:
    """Return the least distance of the arm from the objects along the path, by dense samples of capsules, m."""
    times = np.linspace(0.0, 1.0, SAMPLES)
    legs = [edge(start, goal) for start, goal in pairwise(path.positions)]
    return min(float(np.nanmin(distances_over_time(robot, Scene(things), times, leg))) for leg in legs)  # type: ignore[arg-type]


def assert_leads(path: FreePath, start: FloatArray, goal: FloatArray, robot: Robot = ARM) -> None:
    assert path.status == "found"
    assert (path.positions[0] == start).all()
    assert (path.positions[-1] == goal).all()
    assert (path.positions >= robot.limit("lower")).all()
    assert (path.positions <= robot.limit("upper")).all()


def test_around_a_wall_in_the_plane_of_symmetry() -> None:
    path = path_among([WALL], LEFT, [RIGHT], margin=0.02)
    assert_leads(path, LEFT, RIGHT)
    assert len(path.positions) > 2
    assert least_distance(path, [WALL]) > 0.02 - CONTACT_TOLERANCE


def test_straight_where_nothing_is_in_the_way() -> None:
    path = path_among([SceneObject("far", [Sphere(0.1)], Pose([9.0, 0.0, 0.0]))], LEFT, [RIGHT])
    assert path.checks == 1
    assert (path.positions == np.stack([LEFT, RIGHT])).all()


def test_the_same_way_for_the_same_seed_and_another_for_another() -> None:
    first, again, other = (path_among([WALL], LEFT, [RIGHT], seed=seed).positions for seed in (3, 3, 4))
    assert first.tobytes() == again.tobytes()
    assert first.shape != other.shape or (first != other).any()


def test_an_end_without_room_is_told_apart() -> None:
    block = SceneObject("block", [Box([0.5, 0.5, 0.5])], Pose(tool_pose(ARM, LEFT).position))
    assert path_among([block], LEFT, [RIGHT]).status == "start_not_free"
    assert path_among([block], RIGHT, [LEFT]).status == "no_goal_free"


def test_the_goal_that_has_room_is_taken() -> None:
    block = SceneObject("block", [Box([0.5, 0.5, 0.5])], Pose(tool_pose(ARM, LEFT).position))
    beyond = np.array([-1.4, *LEFT[1:]])
    path = path_among([block], RIGHT, [LEFT, beyond])
    assert path.goal == 1
    assert_leads(path, RIGHT, beyond)


def test_of_two_goals_the_one_that_can_be_reached() -> None:
    """The nearer goal is on the other side of two walls that block the first joint."""
    walls = [SceneObject(f"wall {k}", [Box([4.0, 0.1, 6.0])], Pose([2.2, y, 1.0])) for k, y in enumerate((-0.5, 0.5))]
    between = np.array([0.0, -1.2, 1.2, 0.0, 0.8, 0.0])
    nearer, farther = np.array([-0.7, *between[1:]]), np.array([0.1, -0.9, 0.6, 0.0, 0.6, 0.0])
    path = path_among(walls, between, [nearer, farther], most_checks=300)
    assert path.status == "found"
    assert path.goal == 1


def test_how_far_it_got_where_there_is_no_way() -> None:
    """The robot stands between two walls without end: the other side cannot be reached."""
    walls = [SceneObject(f"wall {k}", [Box([30.0, 0.1, 30.0])], Pose([0.0, y, 0.0])) for k, y in enumerate((-0.7, 0.7))]
    start, goal = np.array([0.0, -1.2, 1.2, 0.0, 0.8, 0.0]), np.array([3.0, -1.2, 1.2, 0.0, 0.8, 0.0])
    path = path_among(walls, start, [goal], most_checks=60)
    assert path.status == "budget_spent"
    assert path.checks >= 60
    assert (path.positions[0] == start).all()
    assert 0.0 < path.left < np.linalg.norm(goal - start)


@pytest.mark.large_only
def test_through_a_slit() -> None:
    """The forearm leaves a slit between two plates, goes up and enters the one above."""
    plates = [SceneObject(f"plate {k}", [Box([0.7, 1.6, 0.03])], Pose([1.6, 0.0, 0.3 + 0.75 * k])) for k in range(3)]
    forward = Pose.from_rpy(np.zeros(3), [0.0, np.pi / 2.0, 0.0]).rotation
    start, goal = (inverse_kinematics(ARM, Pose([1.5, 0.0, z], forward), reference=RIGHT).position for z in (0.7, 1.4))
    path = path_among(plates, start, [goal])
    assert_leads(path, start, goal)
    assert len(path.positions) > 2
    assert least_distance(path, plates) > -CONTACT_TOLERANCE


@pytest.mark.large_only
@pytest.mark.sized
def test_random_ways_are_free_where_dense_samples_look() -> None:
    rng = np.random.default_rng(5)
    found = 0
    for _ in range(max(2, SIZE.requests // 12)):
        things = []
        for k in range(6):
            direction = rng.normal(size=2)
            at = direction / np.linalg.norm(direction) * rng.uniform(0.9, 1.5)
            shape = Box(rng.uniform(0.1, 0.5, 3)) if k % 2 else Cylinder(rng.uniform(0.05, 0.2), rng.uniform(0.2, 1.5))
            things.append(
                SceneObject(f"thing {k}", [shape], Pose.from_rpy([*at, rng.uniform(0.0, 1.6)], rng.normal(size=3)))
            )
        lower, upper = np.maximum(ARM.limit("lower"), -2.5), np.minimum(ARM.limit("upper"), 2.5)
        start, goal = rng.uniform(lower, upper, (2, ARM.dof))
        path = path_among(things, start, [goal], margin=0.01, most_checks=400)
        if path.status == "found":
            found += 1
            assert_leads(path, start, goal)
            assert least_distance(path, things) > 0.01 - CONTACT_TOLERANCE
    assert found


def test_the_quick_check_says_what_proofs_say() -> None:
    """The quick check may miss a few collisions, as many would make searches long; everything it rejects collides."""
    checker = CollisionChecker(ARM, Scene([WALL], margin=0.05))
    rng = np.random.default_rng(1)
    lower, upper = np.maximum(ARM.limit("lower"), -1.5), np.minimum(ARM.limit("upper"), 1.5)
    positions = rng.uniform(lower, upper, (100, ARM.dof))
    proved = np.array([not clearances(checker, edge(q, q)).is_proved for q in positions])
    seen = np.array([checker.distances.first_collision(q[None], CONTACT_TOLERANCE) is not None for q in positions])
    assert (seen == proved).all()
    assert 5 < seen.sum() < 95


def way_back(position: tuple[float, ...] | None, led_from: dict[tuple[float, ...], Any]) -> list[tuple[float, ...]]:
    back = []
    while position is not None:
        back.append(position)
        position = led_from[position]
    return back


def test_what_is_cut_from_a_tree_goes_with_all_that_it_led_to() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        roots = rng.uniform(size=(3, 2))
        tree = Tree(roots, np.ones(2))
        led_from: dict[tuple[float, ...], tuple[float, ...] | None] = {tuple(root): None for root in roots.tolist()}
        for _ in range(30):
            origin = int(rng.integers(len(tree)))
            before, new = tuple(tree.positions[origin].tolist()), rng.uniform(size=2)
            tree.add(new, origin)
            led_from[tuple(new.tolist())] = before
        row = int(rng.integers(len(roots), len(tree)))
        gone = tuple(tree.positions[row].tolist())
        tree.cut(row)
        kept = {position for position in led_from if gone not in way_back(position, led_from)}
        assert {tuple(position) for position in tree.positions.tolist()} == kept
        for k, position in enumerate(tree.positions.tolist()):
            branch = [tuple(tree.positions[b].tolist()) for b in tree.branch(k)]
            assert branch == way_back(tuple(position), led_from)


def test_levers_are_how_far_what_a_joint_moves_goes_from_its_axis() -> None:
    """A small turn of a joint moves no end of a capsule further than the lever, and one nearly as far."""
    edges = FreeEdges(CollisionChecker(ARM, Scene([WALL])), 100)
    bodies, turn = CollisionChecker(ARM, Scene([WALL])).bodies, 1e-6
    for position in (np.zeros(6), LEFT):
        turned = position + turn * np.eye(6)
        ends, moved = (bodies.at(q).spheres[..., [0, -1], :] for q in (position[None], turned))
        axes = np.linalg.norm(moved - ends, axis=-1).max(axis=(1, 2)) / turn
        levers = edges.levers(position[None])[0]
        assert (levers >= axes - 1e-6).all()
        assert (levers <= axes + bodies.radii.max() + 1e-6).all()


def test_near_is_what_joints_with_short_levers_lead_to() -> None:
    tree = Tree(np.array([[0.3, 0.0], [0.0, 1.0]]), np.array([1.0, 0.1]))
    assert tree.nearest(np.zeros((1, 2))) == [1]
    assert Tree(tree.positions, np.ones(2)).nearest(np.zeros((1, 2))) == [0]


def test_what_holds_a_tree_up_is_kept_when_it_is_cut() -> None:
    """Beside an obstacle, new positions are within a radius, which is never tiny."""
    wall = CollisionChecker(ARM, Scene([WALL]))
    trees = Trees(FreeEdges(wall, 2000), LEFT, RIGHT[None], (ARM.limit("lower"), ARM.limit("upper")))
    assert trees.find_meeting(np.random.default_rng(0)) is not None
    grown = [radius for tree in (trees.from_start, trees.from_goals) for radius in tree.radii if np.isfinite(radius)]
    assert grown
    assert min(grown) >= LEAST_RADIUS
    tree = Tree(np.zeros((1, 2)), np.ones(2))
    for row in range(3):
        tree.add(np.full(2, row + 1.0), row)
    tree.radii[:] = [4.0, 3.0, 2.0, 1.0]
    tree.cut(3)
    assert tree.radii.tolist() == [4.0, 3.0, 2.0]
    row = tree.add(np.ones(2), 0)
    assert tree.radii[row] == np.inf


def test_the_first_motion_that_is_not_free_is_the_one_through_the_wall() -> None:
    edges = FreeEdges(CollisionChecker(ARM, Scene([WALL])), 100)
    away, near = np.array([[1.4, *LEFT[1:]], [1.1, *LEFT[1:]]])
    assert edges.first_unproved(np.stack([away, LEFT, near, LEFT])) is None
    assert edges.first_unproved(np.stack([away, LEFT, near, RIGHT])) == 2
    assert edges.first_unproved(np.stack([LEFT, RIGHT, RIGHT])) == 0
    assert not edges.seems_free(LEFT, RIGHT)
    edges.keep_room(1.0, 100)
    assert not edges.has_room(LEFT[None])
    assert edges.checked == 1
