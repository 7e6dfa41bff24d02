"""What is proved to have no way has none: balls are inside of shapes, and all postures of blocked cells collide."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.free_motion.enclosures import _Balls, find_enclosure
from planner.free_motion.inner_balls import distance_bounds, inner_balls
from planner.polynomials import PiecewisePolynomial
from planner.robots import Robot, load_robot
from planner.scene import CollisionChecker, Scene, SceneObject
from planner.shapes import Box, Cylinder, HalfSpace, Shape, Sphere
from planner.spatial import FloatArray, Pose
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
    robot = load_robot(arm)
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
        blocked = np.flatnonzero(_Balls(robot, checker, count).blocked(middles, widths) >= 0)
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
    robot = load_robot(arm)
    checker = CollisionChecker(robot, Scene(walls))
    left, right = np.zeros((2, robot.dof))
    left[0], right[0] = 1.5, -1.5
    found = find_enclosure(robot, checker, left, right[None], 700)
    assert (found.objects if found else None) == proved
    assert find_enclosure(robot, checker, left, np.stack([right, left + 0.05]), 700) is None


@pytest.mark.parametrize("shape", [Box([0.1, 0.1, 0.1]), shape_of("hull", np.random.default_rng(5))])
def test_among_many_objects_fewer_cells_are_looked_at(shape: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a search that fails among a thousand of them would take minutes instead of seconds."""
    looked = []
    blocked = _Balls.blocked

    def counting(self: _Balls, middles: FloatArray, widths: FloatArray) -> np.ndarray:
        looked.append(len(middles))
        return blocked(self, middles, widths)

    monkeypatch.setattr(_Balls, "blocked", counting)
    things = [SceneObject(f"far {k}", [shape], Pose([20.0, 0.0, k])) for k in range(200)]
    left, right = np.zeros((2, ARM.dof))
    left[0], right[0] = 1.5, -1.5
    checker = CollisionChecker(ARM, Scene([BEHIND, *things]))
    find_enclosure(ARM, checker, left, right[None], 500)
    assert 0 < sum(looked) < 300  # some 1,100 otherwise


def test_a_refusal_says_that_there_is_no_way() -> None:
    few = planner.FreeMotion(most_checks=300)
    waypoints = [planner.JointWaypoint([1.5, *LEFT[1:]]), planner.JointWaypoint([-1.5, *LEFT[1:]], motion=few)]
    problem = planner.PlanningProblem(ARM, waypoints, scene=Scene([HIGH, BEHIND]))
    with pytest.raises(planner.NoPathFound, match="there is no way") as refused:
        planner.plan(problem)
    assert refused.value.enclosed_by == ("behind", "high")
    assert refused.value.checks >= 300
