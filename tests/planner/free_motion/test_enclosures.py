"""What is proved to have no way has none: balls are inside of shapes, and all postures of blocked cells collide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.free_motion.blocked_cells import BlockedCells, Looked
from planner.free_motion.enclosures import find_enclosure
from planner.free_motion.inner_balls import distance_bounds, inner_balls
from planner.free_motion.way import find_way
from planner.robots import Robot, load_robot
from planner.scene import CollisionChecker, Scene, SceneObject, is_free
from planner.shapes import Box, Cylinder, HalfSpace, Shape, Sphere
from planner.spatial import FloatArray, Pose
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.capsule_arm import arm_of_capsules
from tests.planner.free_motion.cases import ARM, LEFT
from tests.planner.scene.brute_force import distances_over_time
from tests.planner.shapes.solids import KINDS, shape_of
from tests.sizes import SIZE

BEHIND = SceneObject("behind", [Box([1.6, 0.1, 6.0])], Pose([-1.0, 0.0, 0.0]))
"""What leaves no way behind the arm."""

HIGH = SceneObject("high", [Box([1.6, 0.1, 6.0])], Pose([1.0, 0.0, 0.0]))
"""A wall that nothing gets over or under."""


def directions(rng: np.random.Generator, count: int = 300) -> FloatArray:
    found = rng.normal(size=(count, 3))
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


@pytest.mark.sized
def test_balls_are_inside_and_points_as_near_as_they_are_said_to_be() -> None:
    """A convex shape with a ball in it reaches further along every n; a point is n . x - support(n) away or more."""
    rng = np.random.default_rng(3)
    for _ in range(SIZE.examples):
        shape = shape_of(KINDS[int(rng.integers(len(KINDS)))], rng)
        n = directions(rng)
        centers, radii = inner_balls(shape)
        assert len(radii) > 0
        assert (centers @ n.T + radii[:, None] <= shape.support(n) + 1e-9).all()
        points = rng.normal(size=(50, 3)) * 0.3
        assert (distance_bounds(shape, points)[:, None] >= points @ n.T - shape.support(n) - 1e-9).all()
        plane = HalfSpace(n[0], 0.1)
        assert distance_bounds(plane, points) == pytest.approx(points @ n[0] - 0.1)


def random_thing(rng: np.random.Generator, robot: Robot, posture: FloatArray) -> SceneObject:
    """Something near a link in a posture."""
    size = rng.uniform(0.1, 0.8, 3)
    kinds: list[Shape] = [Box(size), Cylinder(size[0] / 2.0, size[1]), Sphere(size[0] / 2.0)]
    where = planner.rotation_from_rpy(*rng.uniform(-3.0, 3.0, 3))
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, posture)
    near = data.oMi[int(rng.integers(1, 4))].translation
    return SceneObject("thing", [kinds[int(rng.integers(3))]], Pose(near + rng.uniform(-0.2, 0.2, 3), where))


@pytest.mark.sized
@pytest.mark.parametrize("arm", ["kuka_kr16_2", "date_sorting_arm"])
def test_all_postures_of_a_blocked_cell_collide(arm: str) -> None:
    robot = arm_of_capsules(arm)
    rng = np.random.default_rng(4)
    seen = 0
    for _ in range(SIZE.examples // 3):
        margin, count = float(rng.choice([0.0, 0.03])), int(rng.integers(1, 4))
        lower, upper = np.maximum(robot.limit("lower"), -3.0), np.minimum(robot.limit("upper"), 3.0)
        postures = rng.uniform(lower, upper, (20, robot.dof))
        thing = random_thing(rng, robot, postures[0])
        checker = CollisionChecker(robot, Scene([thing], margin=margin))
        widths = rng.uniform(0.01, 0.2, count)
        middles = postures[0, :count] + widths * rng.normal(size=(40, count))
        blocked = np.flatnonzero(BlockedCells(robot, checker, count).look(middles, widths).by >= 0)
        seen += len(blocked)
        for cell in blocked[:2].tolist():
            corners = rng.choice([-0.5, 0.5], (20, count))
            postures[:, :count] = middles[cell] + corners * widths
            visits = PiecewisePolynomial(np.ones(19), np.stack([postures[:-1], np.diff(postures, axis=0)], axis=-1))
            apart = distances_over_time(robot, Scene([thing]), np.arange(20.0), visits)  # type: ignore[arg-type]
            assert (np.nanmin(apart, axis=(1, 2)) < margin).all()
    assert seen > SIZE.examples // 3


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
    """The first arm turns without end: its first cell is beside its last one. The other one cannot turn all around."""
    robot = arm_of_capsules(arm)
    checker = CollisionChecker(robot, Scene(walls))
    left, right = np.zeros((2, robot.dof))
    left[0], right[0] = 1.5, -1.5
    found = find_enclosure(robot, checker, left, right[None], 700)
    assert (found.objects if found else None) == proved
    assert find_enclosure(robot, checker, left, np.stack([right, left + 0.05]), 700) is None


@pytest.mark.parametrize("gap", [0.0005, -0.0005])
def test_a_link_that_grazes_an_object_is_held_up(gap: float) -> None:
    """The furthest point of what the first joint turns goes along a circle, and a ball reaches into it by a hair."""
    bodies = CollisionChecker(ARM).bodies
    ends = bodies.at(np.zeros((1, ARM.dof))).spheres[0][bodies.joints == 1][:, [0, -1]]
    reach = np.hypot(ends[..., 0], ends[..., 1]) + bodies.radii[bodies.joints == 1, None]
    furthest = ends[np.unravel_index(np.argmax(reach), reach.shape)]
    ball = SceneObject("ball", [Sphere(0.05)], Pose([reach.max() + 0.05 + gap, 0.0, furthest[2]]))
    left, right = np.array([[1.5, *LEFT[1:]], [-1.5, *LEFT[1:]]])
    found = find_enclosure(ARM, CollisionChecker(ARM, Scene([ball])), left, right[None], 4000)
    assert found == (None if gap > 0.0 else (1, ("ball",)))


def test_a_turn_further_the_same_walls_are_in_the_way() -> None:
    """The second joint of a UR5 is beside the axis of the first, which turns twice: each time walls are in its way.

    From the end of the range the last wall but one of these turns is in the way: the one on the side of x.
    """
    robot = load_robot("ur5")
    walls = [SceneObject(f"wall {k}", [Box([0.6, 0.02, 2.0])], Pose([0.42 * k, 0.0, 0.0])) for k in (-1, 1)]
    checker = CollisionChecker(robot, Scene(walls))
    start, near, further = np.tile([0.0, -np.pi / 2.0, 0.0, 0.0, 0.0, 0.0], (3, 1))
    near[0], further[0] = 0.02, 2.0 * np.pi - 0.02
    assert is_free(checker, np.stack([start, near, further])).all()
    assert find_enclosure(robot, checker, start, near[None], 20_000) is None
    found = find_enclosure(robot, checker, start, further[None], 20_000)
    assert found is not None
    assert found.objects == ("wall 1",)


@pytest.mark.sized
@pytest.mark.parametrize("arm", ["kuka_kr16_2", "welding_arm", "date_sorting_arm"])
def test_no_enclosure_where_there_is_a_way(arm: str) -> None:
    """Things are put beside a straight motion, some of them within a hair of it."""
    robot = arm_of_capsules(arm)
    rng = np.random.default_rng(6)
    lower, upper = np.maximum(robot.limit("lower"), -3.0), np.minimum(robot.limit("upper"), 3.0)
    beside, motions = 0, 2 + SIZE.examples // 20
    for _ in range(motions):
        start, goal = rng.uniform(lower, upper, (2, robot.dof))
        way = PiecewisePolynomial(np.ones(1), np.stack([start, goal - start], axis=-1)[None])
        drawn = [replace(random_thing(rng, robot, rng.uniform(lower, upper)), id=f"thing {k}") for k in range(30)]
        times = np.linspace(0.0, 1.0, 200)
        apart = {k: distances_over_time(robot, Scene([one]), times, way) for k, one in enumerate(drawn)}  # type: ignore[arg-type]
        things = [drawn[k] for k, distances in apart.items() if np.nanmin(distances) > 0.0]
        beside += len(things)
        assert find_enclosure(robot, CollisionChecker(robot, Scene(things)), start, goal[None], 4000) is None
    assert beside > 3 * motions


@pytest.mark.parametrize("shape", [Box([0.1, 0.1, 0.1]), shape_of("hull", np.random.default_rng(5))])
def test_among_many_objects_fewer_cells_are_looked_at(shape: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a search that fails among a thousand of them would take minutes instead of seconds."""
    looked = []
    look = BlockedCells.look

    def counting(self: BlockedCells, middles: FloatArray, widths: FloatArray) -> Looked:
        looked.append(len(middles))
        return look(self, middles, widths)

    monkeypatch.setattr(BlockedCells, "look", counting)
    things = [SceneObject(f"far {k}", [shape], Pose([20.0, 0.0, k])) for k in range(200)]
    left, right = np.zeros((2, ARM.dof))
    left[0], right[0] = 1.5, -1.5
    checker = CollisionChecker(ARM, Scene([BEHIND, *things]))
    find_enclosure(ARM, checker, left, right[None], 3000)
    assert 0 < sum(looked) < 300  # some 2,300 otherwise


def test_a_refusal_says_that_there_is_no_way() -> None:
    few = planner.FreeMotion(most_checks=300)
    waypoints = [planner.JointWaypoint([1.5, *LEFT[1:]]), planner.JointWaypoint([-1.5, *LEFT[1:]], motion=few)]
    problem = planner.PlanningProblem(ARM, waypoints, scene=Scene([HIGH, BEHIND]))
    with pytest.raises(planner.NoPathFound, match="there is no way") as refused:
        planner.plan(problem)
    assert refused.value.enclosed_by == ("behind", "high")
    assert refused.value.checks == 1  # the straight motion: the proof comes before the search


@pytest.mark.parametrize("arm", ["kuka_kr16_2", "ur5"])
def test_a_blocked_rail_is_proved_before_any_search(arm: str) -> None:
    """A wall stands across a rail of 3 m: one joint is enough to prove that no path leads to the other side."""
    rail = planner.ExternalAxis("rail", "prismatic", (1, 0, 0), lower=0.0, upper=3.0, velocity=1.0, acceleration=2.0)
    robot = load_robot(arm).derived(id="on_rail", external_axes=[rail])
    wall = SceneObject("wall", [Box([0.2, 6.0, 6.0])], Pose([1.5, 0.0, 0.0]))
    start, goal = np.tile(robot.middle, (2, 1))
    start[:2], goal[0] = (0.0, np.pi), 3.0
    way = find_way(robot, CollisionChecker(robot, Scene([wall])), start, [goal])
    assert way.status == "enclosed"
    assert way.checks == 1
    assert way.enclosure == (1, ("wall",))
    assert way.left == pytest.approx(np.linalg.norm(goal - start))
