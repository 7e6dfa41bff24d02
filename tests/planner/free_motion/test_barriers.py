"""Barriers are found where the first joint is blocked, and never where a path exists."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.free_motion.barriers import find_barrier
from planner.free_motion.free_path import find_free_path
from planner.robots import DHJoint, Robot, load_robot
from planner.scene import CollisionChecker, Scene, SceneObject, is_free
from planner.shapes import Box, Cylinder, Shape, Sphere
from planner.spatial import FloatArray, Pose
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.capsule_arm import arm_of_capsules
from tests.planner.free_motion.cases import ARM, LEFT
from tests.planner.scene.brute_force import distances_over_time
from tests.sizes import SIZE

BEHIND = SceneObject("behind", [Box([1.6, 0.1, 6.0])], Pose([-1.0, 0.0, 0.0]))
"""An obstacle that leaves no path behind the arm."""

HIGH = SceneObject("high", [Box([1.6, 0.1, 6.0])], Pose([1.0, 0.0, 0.0]))
"""A wall that blocks every path over or under it."""

MARGIN = 0.02
"""The margin of random scenes, m."""

CASES = max(1, SIZE.examples // 100)
"""Number of random scenes of each arm."""


def random_thing(rng: np.random.Generator, robot: Robot, position: FloatArray) -> SceneObject:
    """Return a shape near a link at a joint position."""
    size = rng.uniform(0.1, 0.8, 3)
    kinds: list[Shape] = [Box(size), Cylinder(size[0] / 2.0, size[1]), Sphere(size[0] / 2.0)]
    where = planner.rotation_from_rpy(*rng.uniform(-3.0, 3.0, 3))
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, position)
    near = data.oMi[int(rng.integers(1, 4))].translation
    return SceneObject("thing", [kinds[int(rng.integers(3))]], Pose(near + rng.uniform(-0.2, 0.2, 3), where))


@pytest.mark.sized
@pytest.mark.parametrize("arm", ["kuka_kr16_2", "welding_arm"])
def test_every_joint_position_at_a_barrier_collides(arm: str) -> None:
    """Random walls stand around the arm; on each side of the start with a barrier, other joints cannot avoid them."""
    robot = arm_of_capsules(arm)
    rng = np.random.default_rng(4)
    lower, upper = np.maximum(robot.limit("lower"), -3.0), np.minimum(robot.limit("upper"), 3.0)
    turns = not np.isfinite(robot.limit("upper")[0])
    seen = 0
    while seen < CASES:
        walls = [random_wall(rng, name) for name in ("first", "second")]
        start, goal = rng.uniform(lower, upper, (2, robot.dof))
        checker = CollisionChecker(robot, Scene(walls, margin=MARGIN))
        if not is_free(checker, np.stack([start, goal])).all():
            continue
        if find_barrier(robot, checker, start, goal[None], joints=2) is None:
            continue
        seen += 1
        ahead = (goal[0] - start[0]) % (2.0 * np.pi)
        for end in (ahead, ahead - 2.0 * np.pi) if turns else (goal[0] - start[0],):
            others = rng.uniform(lower, upper, (20, robot.dof))
            assert any(all_collide(robot, walls, first, others) for first in start[0] + np.linspace(0.0, end, 200))


def random_wall(rng: np.random.Generator, name: str) -> SceneObject:
    """Return a wall in a plane through the axis of the first joint, or nearly so."""
    angle, inner = rng.uniform(-np.pi, np.pi), rng.uniform(0.0, 0.5)
    size = [1.6, 0.1, rng.uniform(1.0, 6.0)]
    place = np.array([(inner + 0.8) * np.cos(angle), (inner + 0.8) * np.sin(angle), size[2] / 2.0 - 0.5])
    return SceneObject(name, [Box(size)], Pose(place, planner.rotation_from_rpy(0.0, 0.0, angle + rng.normal() * 0.1)))


def all_collide(robot: Robot, things: list[SceneObject], first: float, positions: FloatArray) -> bool:
    """Tell whether at one position of the first joint all positions (N, joints) of the others collide."""
    positions[:, 0] = first
    for few in np.array_split(positions, 5):  # most end with the first few
        visits = PiecewisePolynomial(np.ones(len(few) - 1), np.stack([few[:-1], np.diff(few, axis=0)], axis=-1))
        apart = distances_over_time(robot, Scene(things), np.arange(float(len(few))), visits)  # type: ignore[arg-type]
        if not (np.nanmin(apart, axis=(1, 2)) < MARGIN).all():
            return False
    return True


@pytest.mark.parametrize(
    ("arm", "walls", "proved"),
    [
        ("welding_arm", [HIGH, BEHIND], ("behind", "high")),
        ("welding_arm", [HIGH], None),
        ("welding_arm", [BEHIND], None),
        ("kuka_kr16_2", [HIGH], ("high",)),
        ("kuka_kr16_2", [BEHIND], None),
    ],
)
def test_walls_leave_no_way_or_one(arm: str, walls: list[SceneObject], proved: tuple[str, ...] | None) -> None:
    """The first joint of one arm turns without end, so its first and last cell are neighbours; the other's does not."""
    robot = arm_of_capsules(arm)
    checker = CollisionChecker(robot, Scene(walls))
    left, right = np.zeros((2, robot.dof))
    left[0], right[0] = 1.5, -1.5
    found = find_barrier(robot, checker, left, right[None], joints=2)
    assert (found.objects if found else None) == proved
    assert find_barrier(robot, checker, left, np.stack([right, left + 0.05]), joints=2) is None


@pytest.mark.parametrize("gap", [0.0005, -0.0005])
def test_a_link_that_grazes_an_object_is_held_up(gap: float) -> None:
    """The furthest point turned by the first joint follows a circle, and a ball barely reaches into it."""
    bodies = CollisionChecker(ARM).bodies
    ends = bodies.at(np.zeros((1, ARM.dof))).spheres[0][bodies.joints == 1][:, [0, -1]]
    reach = np.hypot(ends[..., 0], ends[..., 1]) + bodies.radii[bodies.joints == 1, None]
    furthest = ends[np.unravel_index(np.argmax(reach), reach.shape)]
    ball = SceneObject("ball", [Sphere(0.05)], Pose([reach.max() + 0.05 + gap, 0.0, furthest[2]]))
    left, right = np.array([[1.5, *LEFT[1:]], [-1.5, *LEFT[1:]]])
    found = find_barrier(ARM, CollisionChecker(ARM, Scene([ball])), left, right[None], joints=2)
    assert found == (None if gap > 0.0 else (ARM.joint_names[0], ("ball",)))


def test_a_turn_further_the_same_walls_are_in_the_way() -> None:
    """The second joint of a UR5 is beside the axis of the first, which turns twice: each time the walls block it.

    From the start, the shoulder meets the wall on the side of -x first.
    """
    robot = load_robot("ur5")
    walls = [SceneObject(f"wall {k}", [Box([0.6, 0.02, 2.0])], Pose([0.42 * k, 0.0, 0.0])) for k in (-1, 1)]
    checker = CollisionChecker(robot, Scene(walls))
    start, near, further = np.tile([0.0, -np.pi / 2.0, 0.0, 0.0, 0.0, 0.0], (3, 1))
    near[0], further[0] = 0.02, 2.0 * np.pi - 0.02
    assert is_free(checker, np.stack([start, near, further])).all()
    assert find_barrier(robot, checker, start, near[None], joints=2) is None
    found = find_barrier(robot, checker, start, further[None], joints=2)
    assert found is not None
    assert found.objects == ("wall -1",)
    assert find_barrier(robot, checker, start, further[None], joints=1) is None


@pytest.mark.sized
@pytest.mark.parametrize("arm", ["kuka_kr16_2", "welding_arm", "date_sorting_arm"])
def test_no_barrier_is_found_where_a_path_exists(arm: str) -> None:
    """Objects are put beside a straight motion, some of them very near to it."""
    robot = arm_of_capsules(arm)
    rng = np.random.default_rng(6)
    lower, upper = np.maximum(robot.limit("lower"), -3.0), np.minimum(robot.limit("upper"), 3.0)
    beside = 0
    for _ in range(CASES):
        start, goal = rng.uniform(lower, upper, (2, robot.dof))
        way = PiecewisePolynomial(np.ones(1), np.stack([start, goal - start], axis=-1)[None])
        drawn = [replace(random_thing(rng, robot, rng.uniform(lower, upper)), id=f"thing {k}") for k in range(30)]
        times = np.linspace(0.0, 1.0, 100)
        apart = {k: distances_over_time(robot, Scene([one]), times, way) for k, one in enumerate(drawn)}  # type: ignore[arg-type]
        things = [drawn[k] for k, distances in apart.items() if np.nanmin(distances) > 0.0]
        beside += len(things)
        assert find_barrier(robot, CollisionChecker(robot, Scene(things)), start, goal[None], joints=2) is None
    assert beside > 3 * CASES


def test_a_refusal_says_that_there_is_no_way() -> None:
    few = planner.FreeMotion(most_checks=300)
    waypoints = [planner.JointWaypoint([1.5, *LEFT[1:]]), planner.JointWaypoint([-1.5, *LEFT[1:]], motion=few)]
    problem = planner.PlanningProblem(ARM, waypoints, scene=Scene([HIGH, BEHIND]))
    with pytest.raises(planner.NoPathFound, match="no path exists") as refused:
        planner.plan(problem)
    assert refused.value.enclosed_by == ("high",)  # the limits of the first joint keep it from the other side
    assert refused.value.checks == 1  # the straight motion: the proof comes before the search


@pytest.mark.parametrize("arm", ["kuka_kr16_2", "ur5"])
def test_a_blocked_rail_is_proved_before_any_search(arm: str) -> None:
    """A wall stands across a rail of 3 m: one joint is enough to prove that no path leads to the other side."""
    rail = planner.ExternalAxis("rail", "prismatic", (1, 0, 0), lower=0.0, upper=3.0, velocity=1.0, acceleration=2.0)
    robot = load_robot(arm).derived(id="on_rail", external_axes=[rail])
    wall = SceneObject("wall", [Box([0.2, 6.0, 6.0])], Pose([1.5, 0.0, 0.0]))
    start, goal = np.tile(robot.middle, (2, 1))
    start[:2], goal[0] = (0.0, np.pi), 3.0
    way = find_free_path(robot, CollisionChecker(robot, Scene([wall])), start, [goal])
    assert way.status == "enclosed"
    assert way.checks == 1
    assert way.barrier == ("rail", ("wall",))
    assert way.left == pytest.approx(np.linalg.norm(goal - start))


def test_an_arm_of_one_joint_has_a_barrier() -> None:
    """It has no second joint; a box stands on the circle of its tip."""
    arm = Robot.from_dh([DHJoint("revolute", a=0.5, lower=-3.0, upper=3.0, velocity=1.0)])
    robot = replace(arm, collision=replace(arm.collision, link_radii=(0.05, 0.05)))
    box = SceneObject("box", [Box([0.2, 0.02, 0.2])], Pose([0.4, 0.0, 0.0]))
    found = find_barrier(robot, CollisionChecker(robot, Scene([box])), np.array([1.0]), np.array([[-1.0]]), joints=2)
    assert found == (robot.joint_names[0], ("box",))
