"""A free motion to a goal region may end at any of several joint positions, all of which fulfil the request."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.free_motion.detours import MOST_REGION_GOALS, apart, ends_of_detour, find_detours
from planner.kinematics.options import Preference
from planner.problems.regions import Free, Region
from planner.robots import load_robot
from planner.scene import AttachedObject, Scene, SceneObject
from planner.shapes import Box, Sphere
from planner.spatial import FloatArray, Pose, rotation_from_rpy, rotation_z
from tests.planner.free_motion.cases import robot
from tests.planner.scene.brute_force import least_distance, point_distance

DOWN = rotation_from_rpy(np.pi, 0.0, 0.0)
SEED = 218
"""A case with 60 motions to goals of the region, and none to its nearest pose."""

MOST_CHECKS = 1000


def bar_among_boxes() -> planner.PlanningProblem:
    """Make a problem with a bar of half a metre at the tool among six boxes.

    The bar may be turned about the vertical at its goal.
    """
    rng, goal_rng = np.random.default_rng(SEED), np.random.default_rng(SEED + 1000)
    boxes = [
        SceneObject(
            f"box {k}",
            [Box(rng.uniform(0.05, 0.3, 3))],
            Pose([rng.uniform(-0.5, 0.7), rng.uniform(-0.6, 0.6), rng.uniform(0.0, 0.8)]),
        )
        for k in range(6)
    ]
    bar = AttachedObject("bar", (Box([0.5, 0.02, 0.02]),), Pose([0.0, 0.0, 0.02]))
    start = Pose([rng.uniform(0.3, 0.6), rng.uniform(-0.35, 0.35), rng.uniform(0.2, 0.5)], DOWN)
    goal = Pose([goal_rng.uniform(-0.6, 0.6), goal_rng.uniform(-0.6, 0.6), goal_rng.uniform(0.1, 0.5)], DOWN)
    free = planner.FreeMotion(most_checks=MOST_CHECKS)
    turned = planner.PoseWaypoint(goal, free=Region(rotation_z=(-np.pi, np.pi)), motion=free)
    return planner.PlanningProblem(load_robot("ur5"), [planner.PoseWaypoint(start), turned], scene=Scene(boxes, [bar]))


def test_every_goal_is_in_the_region() -> None:
    problem = bar_among_boxes()
    goal = problem.waypoints[1]
    assert isinstance(goal, planner.PoseWaypoint)
    goals = ends_of_detour(problem, (), 1).goals
    assert len(goals) > 4
    for position in goals:
        reached = planner.tool_pose(load_robot("ur5"), position)
        assert reached.rotation is not None
        np.testing.assert_allclose(reached.position, goal.pose.position, atol=1e-6)
        np.testing.assert_allclose(reached.rotation[:, 2], DOWN[:, 2], atol=1e-6)


def test_the_goal_that_is_reached_is_planned() -> None:
    """The end of the path is one of the goals, and the plan is certified."""
    problem = bar_among_boxes()
    (found,) = find_detours(problem)
    goals = ends_of_detour(problem, (), 1).goals
    assert np.abs(goals - found.positions[-1]).max(axis=1).min() < 1e-9
    plan = planner.plan(problem, "quintic")
    assert plan.certificate.clearance is not None


def test_goals_are_apart_and_few() -> None:
    rng = np.random.default_rng(3)
    positions = rng.uniform(-3.0, 3.0, (400, 6))
    found = apart(positions, np.zeros(6))
    assert len(found) == MOST_REGION_GOALS
    nearest = positions[np.linalg.norm(positions, axis=1).argmin()]
    assert (found[0] == nearest).all()
    assert len(apart(np.tile(positions[:1], (50, 1)), np.zeros(6))) == 1


MIDDLE = np.array([0.7, 0.1, 0.2])
"""Goal of the bar, m."""

HALF_BAR = 0.15

ASIDE = Pose([0.705, 0.1, 0.195])
AFTER = {
    "line": planner.LinearMotion(),
    "circle": planner.CircularMotion(ASIDE),
    "polyline": planner.PolylineMotion([ASIDE], 0.002),
    "spline": planner.SplineMotion([ASIDE]),
}


def caps_over_both_ends() -> list[SceneObject]:
    """Return two boxes without an inner side: a bar between them along the x axis cannot leave."""
    plates = {
        "top": ([0.08, 0.08, 0.01], [0.0, 0.0, 0.035]),
        "bottom": ([0.08, 0.08, 0.01], [0.0, 0.0, -0.045]),
        "left": ([0.08, 0.01, 0.08], [0.0, 0.04, 0.0]),
        "right": ([0.08, 0.01, 0.08], [0.0, -0.04, 0.0]),
        "end": ([0.01, 0.08, 0.08], [0.045, 0.0, 0.0]),
    }
    return [
        SceneObject(f"{name} {side}", [Box(size)], Pose(MIDDLE + np.array([side * (HALF_BAR - 0.01 + x), y, z])))
        for side in (-1, 1)
        for name, (size, (x, y, z)) in plates.items()
    ]


def bar_between_caps(free: Free | None, after: planner.CartesianMotion, turn: float = 0.0) -> planner.PlanningProblem:
    """Make a problem that brings a bar between the caps from above, then moves it by a centimetre."""
    bar = AttachedObject("bar", (Box([2.0 * HALF_BAR, 0.01, 0.01]),), Pose([0.0, 0.0, 0.0]))
    turned = DOWN @ rotation_z(turn)
    goal = planner.PoseWaypoint(Pose(MIDDLE, turned), free=free, motion=planner.FreeMotion(most_checks=MOST_CHECKS))
    move = planner.RelativeWaypoint(planner.CartesianMove((0.0, 0.0, -0.01)), frame="base", motion=after)
    waypoints = [planner.PoseWaypoint(Pose([0.7, 0.1, 0.5], DOWN)), goal, move]
    return planner.PlanningProblem(robot(), waypoints, scene=Scene(caps_over_both_ends(), [bar], margin=0.001))


def least_distance_of_bar(problem: planner.PlanningProblem, plan: planner.Plan) -> float:
    """Return the least distance of the bar's long edges from the plates, by dense samples and closed forms, m."""
    assert problem.scene is not None
    along = np.linspace(-HALF_BAR, HALF_BAR, 31)
    edges = np.array([[x, y, z] for x in along for y in (-0.005, 0.005) for z in (-0.005, 0.005)])
    positions = plan.trajectory.evaluate(np.linspace(0.0, plan.trajectory.duration, 400), [0])[0]
    poses = [planner.tool_pose(problem.robot, position) for position in positions]
    points = np.concatenate([pose.position + edges @ np.asarray(pose.rotation).T for pose in poses])
    return float(min(point_distance(plate)(points).min() for plate in problem.scene.objects))


@pytest.mark.parametrize(
    "after",
    [
        pytest.param(after, id=name, marks=[pytest.mark.large_only] if name in ("circle", "polyline") else [])
        for name, after in AFTER.items()
    ],
)
def test_a_region_before_a_motion_of_the_tool_is_reached_at_another_pose(after: planner.CartesianMotion) -> None:
    """The nearest pose of the region is enclosed; across the caps a fixed turn is planned."""
    across = bar_between_caps(None, after, np.pi / 2.0)
    assert planner.plan(across, "quintic").certificate.satisfied
    problem = bar_between_caps("rotation_z", after)
    plan = planner.plan(problem, "quintic")
    assert plan.certificate.satisfied
    assert plan.problem.scene is not None
    assert least_distance(robot(), plan.problem.scene, plan.trajectory) > 0.001 - 1e-5
    assert least_distance_of_bar(problem, plan) > 0.001 - 1e-5


def test_without_a_region_the_enclosed_pose_is_refused() -> None:
    """The test before therefore shows the effect of the region."""
    with pytest.raises(planner.NoPathFound):
        planner.plan(bar_between_caps(None, AFTER["line"]), "quintic", budget=planner.Budget(attempts=1))


@pytest.mark.parametrize("prefer", ["manipulability", "far_from_limits"])
def test_a_free_motion_ends_at_the_preferred_solution_if_a_path_leads_there(prefer: Preference) -> None:
    """In the open, it ends where a joint motion ends; behind walls around that solution, at another one."""
    arm, aside = load_robot("ur5e"), SceneObject("aside", [Box([0.1, 0.1, 0.1])], Pose([2.0, 2.0, 0.5]))
    start, end = np.random.default_rng(0).uniform(-1.5, 1.5, (2, 6))
    pose = planner.forward_kinematics(arm, end)
    options = planner.InverseKinematicsOptions(prefer=prefer)

    def end_of(motion: planner.JointMotion | planner.FreeMotion, thing: SceneObject) -> FloatArray:
        waypoints = [planner.JointWaypoint(start.tolist()), planner.PoseWaypoint(pose, motion=motion)]
        problem = planner.PlanningProblem(arm, waypoints, scene=Scene([thing]), inverse_kinematics=options)
        return planner.plan(problem).path.positions[-1]

    preferred = end_of(planner.JointMotion(), aside)
    np.testing.assert_array_equal(end_of(planner.FreeMotion(), aside), preferred)
    elbow = arm.model.createData()
    pin.forwardKinematics(arm.model, elbow, preferred)
    ball = SceneObject("ball", [Sphere(0.05)], Pose(elbow.oMi[3].translation))
    assert np.abs(end_of(planner.FreeMotion(most_checks=4000), ball) - preferred).max() > 0.1
