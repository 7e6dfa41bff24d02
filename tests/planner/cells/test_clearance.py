"""No clearance between two machines is proved that dense samples contradict, and none is refused that they find."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.scene import CONTACT_TOLERANCE
from planner.spatial import Pose
from tests.planner.capsule_arm import arm_of_capsules
from tests.planner.cells.brute_force import (
    World,
    distance,
    facing_arms,
    least_distance,
    random_plan,
    robot_world,
    sliding_world,
)
from tests.sizes import SIZE

SAMPLING_ERROR = 0.01
"""Largest error of least distances at the samples of these tests, m: both arms move by less between two of them."""


def clearance_or_none(first: planner.Mover, second: planner.Mover, margin: float, skew: float) -> float | None:
    """Return the proved lower bound, m; None: the pair is refused."""
    try:
        return planner.clearance_between(first, second, margin=margin, skew=skew).clearance.lower
    except planner.Collision as refusal:
        assert refusal.depth > CONTACT_TOLERANCE
        return None


@pytest.mark.sized
def test_proofs_agree_with_dense_samples_of_time_and_skew() -> None:
    rng = np.random.default_rng(28)
    arm = arm_of_capsules("ur5e")
    proved = refused = 0
    for _ in range(max(1, SIZE.requests // 40)):
        first, second = facing_arms(arm, rng.uniform(0.7, 1.2))
        plans = random_plan(first, rng, 3), random_plan(second, rng, 3)
        worlds = [robot_world(plan.problem.robot, plan.trajectory) for plan in plans]
        movers = [planner.Mover.of_plan(name, plan) for name, plan in zip("ab", plans, strict=True)]
        skew = float(rng.choice([0.0, 0.03, 0.2]))
        skews = np.linspace(-skew, skew, 5) if skew else np.zeros(1)
        whole = max(plan.trajectory.duration for plan in plans) + skew
        truth = least_distance(*worlds, np.linspace(-skew, whole, 40), skews)
        for margin in (0.0, max(truth - 0.02, 0.0), max(truth + 0.002, 0.0)):
            found = clearance_or_none(*movers, margin, skew)
            if found is None:
                refused += 1
                assert truth - SAMPLING_ERROR < margin, "a motion that is clearly free is refused"
            else:
                proved += 1
                assert truth > margin - CONTACT_TOLERANCE
                assert margin - CONTACT_TOLERANCE <= found <= truth + 1e-6
    assert proved and refused


def test_refusals_name_a_time_a_skew_and_a_pair_at_which_both_touch() -> None:
    rng = np.random.default_rng(3)
    arm = arm_of_capsules("ur5e")
    first, second = facing_arms(arm, 0.6)
    refusals = 0
    for _ in range(5):
        plans = random_plan(first, rng, 3), random_plan(second, rng, 3)
        movers = [planner.Mover.of_plan(name, plan) for name, plan in zip("ab", plans, strict=True)]
        try:
            planner.clearance_between(*movers)
        except planner.Collision as refusal:
            refusals += 1
            worlds = [robot_world(plan.problem.robot, plan.trajectory) for plan in plans]
            assert refusal.time is not None
            found = distance(*(world(refusal.time) for world in worlds))
            assert found <= refusal.limit - refusal.depth + 1e-4
            assert refusal.pair[0].startswith("a/")
            assert refusal.pair[1].startswith("b/")
    assert refusals


def passing_parts(gap: float, late: float) -> tuple[planner.Mover, planner.Mover]:
    """Return two balls on crossing belts; the second reaches the crossing later than the first."""
    ball, side = planner.Sphere(0.1), 1.0 + late * 0.5
    first = planner.Mover.sliding("x", [ball], Pose([-1.0, 0.0, 0.0]), [0.5, 0.0, 0.0], 4.0)
    return first, planner.Mover.sliding("y", [ball], Pose([0.0, -side, gap]), [0.0, 0.5, 0.0], 5.0)


@pytest.mark.parametrize(
    ("late", "skew", "is_free"), [(0.8, 0.0, True), (0.8, 0.22, True), (0.8, 0.25, False), (0.5, 0.0, False)]
)
def test_crossing_balls_are_free_exactly_up_to_the_critical_skew(late: float, skew: float, *, is_free: bool) -> None:
    # Two points on crossing lines at one speed are at least speed * delay / sqrt(2) apart.
    least = 0.5 * (late - skew) / np.sqrt(2.0) - 0.2
    assert (least > 0.0) == is_free
    first, second = passing_parts(0.0, late)
    found = clearance_or_none(first, second, 0.0, skew)
    assert (found is not None) == is_free
    if found is not None and not skew:
        assert found == pytest.approx(least, abs=1.1e-3)


def test_a_skew_counts_in_both_directions() -> None:
    first, second = passing_parts(0.0, -0.8)
    assert clearance_or_none(first, second, 0.0, 0.22) is not None
    assert clearance_or_none(first, second, 0.0, 0.25) is None
    assert clearance_or_none(second, first, 0.0, 0.25) is None


def test_machines_rest_before_their_start_and_after_their_end() -> None:
    block = [planner.Box([0.2, 0.2, 0.2])]
    early = planner.Mover.sliding("early", block, Pose([-1.0, 0.0, 0.0]), [0.5, 0.0, 0.0], 2.0)
    late = planner.Mover.sliding("late", block, Pose([0.0, -1.0, 0.0]), [0.0, 0.5, 0.0], 2.0, start=10.0)
    assert clearance_or_none(early, late, 0.0, 0.0) is None
    aside = planner.Mover.sliding("late", block, Pose([0.25, -1.0, 0.0]), [0.0, 0.5, 0.0], 4.0, start=10.0)
    assert clearance_or_none(early, aside, 0.0, 0.0) == pytest.approx(0.05, abs=1.1e-3)
    assert clearance_or_none(early, aside, 0.04, 1.0) == pytest.approx(0.045, abs=0.0051)


def test_two_robots_on_one_base_are_refused_at_the_start() -> None:
    arm = arm_of_capsules("ur5e").derived(mounting=Pose([30.0, 0.0, 0.0], np.eye(3)))
    plan = random_plan(arm, np.random.default_rng(0), 2)
    movers = [planner.Mover.of_plan(name, plan) for name in "ab"]
    with pytest.raises(planner.StartInCollision, match="before both start") as refused:
        planner.clearance_between(*movers)
    assert refused.value.time == 0.0
    assert refused.value.point is not None and abs(refused.value.point[0] - 30.0) < 2.0  # in the world


def test_turned_shapes_slide_as_they_stand() -> None:
    rng = np.random.default_rng(5)
    for _ in range(6):
        box, ball = planner.Box(rng.uniform(0.1, 0.4, 3)), planner.Sphere(0.1)
        pose = Pose.from_rpy(rng.normal(size=3) * 0.5, rng.normal(size=3))
        velocity, other = rng.normal(size=(2, 3)) * 0.3
        worlds: list[World] = [
            sliding_world(box, pose, velocity, 0.5, 2.0),
            sliding_world(ball, Pose([0.4, 0.0, 0.0]), other, 0.0, 1.0),
        ]
        truth = least_distance(*worlds, np.linspace(0.0, 2.5, 2000))
        first = planner.Mover.sliding("box", [box], pose, velocity, 2.0, start=0.5)
        second = planner.Mover.sliding("ball", [ball], Pose([0.4, 0.0, 0.0]), other, 1.0)
        found = clearance_or_none(first, second, 0.0, 0.0)
        assert (found is None) == (truth < 0.0)
        if found is not None:
            assert found <= truth + 1e-6
            assert found == pytest.approx(truth, abs=2e-3)


def test_carried_objects_count() -> None:
    arm = arm_of_capsules("ur5e")
    rod = planner.Capsule(0.02, 1.0)
    held = planner.AttachedObject("rod", [rod])
    plan = random_plan(arm, np.random.default_rng(1), 2)
    scene = planner.Scene(attached=[held])
    with_rod = planner.Mover.of_trajectory("arm", arm, plan.trajectory, scene)
    tool = robot_world(arm, plan.trajectory, [rod])
    start = tool(0.0)[-1][1]
    at_tip = Pose(start.act(np.array([0.0, 0.0, 0.45])))
    ball = planner.Mover.sliding("ball", [planner.Sphere(0.05)], at_tip, [0.0, 0.0, 0.0], 1.0)
    with pytest.raises(planner.StartInCollision, match="rod"):
        planner.clearance_between(with_rod, ball)
    world = sliding_world(planner.Sphere(0.05), at_tip, np.zeros(3), 0.0, 1.0)
    without = robot_world(arm, plan.trajectory)
    free = least_distance(without, world, np.linspace(0.0, plan.trajectory.duration, 200))
    bare = planner.Mover.of_trajectory("arm", arm, plan.trajectory)
    assert (clearance_or_none(bare, ball, 0.0, 0.0) is None) == (free < 0.0)


def test_an_object_counts_where_the_robot_has_put_it_down() -> None:
    arm = arm_of_capsules("ur5e")
    positions = random_plan(arm, np.random.default_rng(1), 3).path.positions
    scene = planner.Scene(attached=[planner.AttachedObject("part", [planner.Sphere(0.05)], Pose([0.0, 0.0, 0.3]))])
    waypoints = [planner.JointWaypoint(position) for position in positions]
    waypoints[1] = planner.JointWaypoint(positions[1], detach=["part"])
    plan = planner.plan(planner.PlanningProblem(arm, waypoints, scene=scene))
    there = robot_world(arm, plan.trajectory)(0.0)
    assert there
    world = robot_world(arm, plan.trajectory, [planner.Sphere(0.05)])
    placed = world(float(plan.trajectory.arrivals[1]))[-1][1]
    left = Pose(placed.act(np.array([0.0, 0.0, 0.3])))
    late = float(plan.trajectory.departures[1]) + 5.0
    velocity = np.array([0.0, -1.0, 0.0])
    start = Pose(left.position - velocity * 2.0)
    ball = planner.Mover.sliding("ball", [planner.Sphere(0.02)], start, velocity, 2.0, start=late)
    with pytest.raises(planner.Collision, match="part") as refused:
        planner.clearance_between(planner.Mover.of_plan("arm", plan), ball)
    assert refused.value.time > late


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
@pytest.mark.parametrize("field", ["margin", "skew"])
def test_margins_and_skews_are_finite_and_not_negative(field: str, value: float) -> None:
    first, second = passing_parts(1.0, 0.0)
    with pytest.raises(planner.InvalidProblem, match=field):
        planner.clearance_between(first, second, **{field: value})


def test_sliding_objects_refuse_half_spaces_and_velocities_that_are_none() -> None:
    with pytest.raises(planner.InvalidProblem, match="bounded"):
        planner.Mover.sliding("door", [planner.HalfSpace([0.0, 0.0, 1.0])], Pose([0.0, 0.0, 0.0]), [0.1, 0.0, 0.0], 1.0)
    for velocity, duration in (([np.nan, 0.0, 0.0], 1.0), ([0.1, 0.0], 1.0), ([0.1, 0.0, 0.0], 0.0)):
        with pytest.raises(planner.InvalidProblem):
            planner.Mover.sliding("door", [planner.Sphere(0.1)], Pose([0.0, 0.0, 0.0]), velocity, duration)


def test_pairs_that_may_touch_are_left_out_and_all_others_are_proved() -> None:
    arm = arm_of_capsules("ur5e")
    robots = facing_arms(arm, 0.9)
    rng = np.random.default_rng(2)
    plans = [random_plan(robot, rng, 2) for robot in robots]
    movers = [planner.Mover.of_plan(name, plan) for name, plan in zip("ab", plans, strict=True)]
    allowed: list[tuple[str, str]] = []
    with pytest.raises(planner.Collision):
        planner.clearance_between(movers[0], movers[1])
    while True:
        try:
            proved = planner.clearance_between(movers[1], movers[0], allowed_pairs=allowed).clearance.lower
            break
        except planner.Collision as refusal:
            assert refusal.pair is not None
            assert tuple(refusal.pair[::-1]) not in allowed
            allowed.append((refusal.pair[1], refusal.pair[0]))
    links = [[body.link for body in robot.collision_shapes] for robot in robots]
    worlds = [robot_world(plan.problem.robot, plan.trajectory) for plan in plans]
    least = np.inf
    for time in np.linspace(0.0, max(plan.trajectory.duration for plan in plans), 40).tolist():
        for one, shape in zip(links[0], worlds[0](time), strict=True):
            for other, thing in zip(links[1], worlds[1](time), strict=True):
                if (f"a/{one}", f"b/{other}") not in allowed:
                    least = min(least, distance([shape], [thing]))
    assert allowed
    assert proved - 1e-6 <= least
    assert least > -CONTACT_TOLERANCE
    with pytest.raises(planner.InvalidProblem, match=r"allowed_pairs\[0\]: must have a name `a/body`"):
        planner.clearance_between(movers[0], movers[1], allowed_pairs=[("a/link_1", "link_2")])
