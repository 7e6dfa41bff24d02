"""Poses take collision-free configurations only, as long as there is one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from planner.certificate.clearance import at_rest
from planner.errors import Collision
from planner.kinematics.inverse import all_solutions
from planner.paths import solved_waypoints
from planner.robots import load_robot
from planner.scene import Scene, SceneObject
from planner.shapes import Box, Sphere
from planner.spatial import FloatArray, Pose
from tests.planner.capsule_arm import CAPSULE_ARM
from tests.planner.scene.brute_force import distances_over_time

ARM = CAPSULE_ARM
RADIUS = 0.05
ELBOW = 3


def keeps_clear(scene: Scene, position: FloatArray) -> bool:
    distances = distances_over_time(ARM, scene, np.zeros(1), at_rest(position))
    return bool(np.nanmin(distances) > scene.margin)


def balls(positions: list[FloatArray]) -> Scene:
    """Return a ball at the elbow of the arm for each joint position."""
    elbows = [planner.CollisionChecker(ARM).bodies.at(position[None]).origins[0, ELBOW] for position in positions]
    things = [SceneObject(f"ball_{k}", [Sphere(RADIUS)], Pose(elbow)) for k, elbow in enumerate(elbows)]
    return Scene(things, margin=0.01)


def is_same(first: FloatArray, second: FloatArray) -> bool:
    turns = (first - second) / (2.0 * np.pi)
    return bool(np.abs(turns - np.round(turns)).max() < 1e-6)


@pytest.mark.large_only
def test_what_is_chosen_is_free_wherever_one_of_all_configurations_is() -> None:
    rng = np.random.default_rng(6)
    counts = {"as before": 0, "another": 0, "none": 0}
    lower, upper = np.maximum(ARM.limit("lower"), -2.0), np.minimum(ARM.limit("upper"), 2.0)
    for _ in range(10):
        pose = planner.tool_pose(ARM, rng.uniform(lower, upper))
        solutions = list(all_solutions(ARM, pose))
        start = planner.JointWaypoint(rng.uniform(lower, upper).tolist())
        blocked = rng.permutation(len(solutions))[:1].tolist()
        scene = balls([solutions[k] for k in blocked])
        problem = planner.PlanningProblem(ARM, [start, planner.PoseWaypoint(pose)], scene=scene)
        before = solved_waypoints(replace(problem, scene=None))[1][1].position
        chosen = solved_waypoints(problem)[1][1]
        assert any(is_same(chosen.position, solution) for solution in solutions)
        free = [solution for solution in solutions if keeps_clear(scene, solution)]
        if not free:
            counts["none"] += 1
            assert is_same(chosen.position, before)
        else:
            counts["as before" if keeps_clear(scene, before) else "another"] += 1
            assert keeps_clear(scene, chosen.position)
            assert chosen.solutions == len(free)
            assert is_same(chosen.position, before) or not keeps_clear(scene, before)
    assert min(counts.values()) > 0, counts


def test_a_line_begins_where_it_keeps_clear() -> None:
    """Both ends of the line are poses; the nearest configuration collides at its elbow."""
    home = np.array([0.0, -1.2, 1.4, 0.3, 0.6, 0.0])
    there = planner.tool_pose(ARM, home)
    ahead = Pose(there.position + np.array([0.0, 0.05, 0.0]), there.rotation)
    waypoints = [planner.PoseWaypoint(there), planner.PoseWaypoint(ahead, motion=planner.LinearMotion())]
    problem = planner.PlanningProblem(ARM, waypoints)
    before = solved_waypoints(problem)[1][0].position
    scene = balls([before])
    assert not keeps_clear(scene, before)
    plan = planner.plan(replace(problem, scene=scene))
    assert not is_same(plan.path.positions[0], before)
    assert all(keeps_clear(scene, position) for position in plan.path.positions)


def test_an_arm_with_seven_joints_takes_a_free_joint_position_of_its_continuum() -> None:
    robot = load_robot("fr3")
    rng = np.random.default_rng(4)
    lower, upper = robot.limit("lower"), robot.limit("upper")
    for _ in range(3):
        position = lower + (upper - lower) * rng.uniform(0.3, 0.7, robot.dof)
        pose = planner.tool_pose(robot, position)
        problem = planner.PlanningProblem(robot, [planner.JointWaypoint(position.tolist()), planner.PoseWaypoint(pose)])
        before = solved_waypoints(problem)[1][1].position
        elbow = planner.CollisionChecker(robot).bodies.at(before[None]).origins[0, 4]
        scene = Scene([SceneObject("ball", [Sphere(RADIUS)], Pose(elbow))])
        chosen = solved_waypoints(replace(problem, scene=scene))[1][1].position
        checker = planner.CollisionChecker(robot, scene)
        assert not planner.scene.is_free(checker, before[None])[0]
        assert planner.scene.is_free(checker, chosen[None])[0]


def test_where_no_configuration_is_free_the_plan_is_refused() -> None:
    pose = planner.tool_pose(ARM, [0.0, -1.2, 1.4, 0.3, 0.6, 0.0])
    block = SceneObject("block", [Box([0.2, 0.2, 0.2])], Pose(pose.position))
    start = planner.JointWaypoint([1.5, -1.2, 1.4, 0.3, 0.6, 0.0])
    with pytest.raises(Collision):
        planner.plan(planner.PlanningProblem(ARM, [start, planner.PoseWaypoint(pose)], scene=Scene([block])))


def test_what_is_taken_at_a_pose_may_touch_there() -> None:
    pose = planner.tool_pose(ARM, [0.0, -1.2, 1.4, 0.3, 0.6, 0.0])
    part = SceneObject("part", [Box([0.1, 0.1, 0.1])], Pose(pose.position))
    start = planner.JointWaypoint([1.5, -1.2, 1.4, 0.3, 0.6, 0.0])
    pick = planner.PoseWaypoint(pose, attach=[planner.Attach("part")])
    problem = planner.PlanningProblem(ARM, [start, pick], scene=Scene([part], allowed_pairs=[("part", "link_6")]))
    before = solved_waypoints(replace(problem, scene=None))[1][1]
    chosen = solved_waypoints(problem)[1][1]
    assert chosen.solutions == before.solutions
    assert is_same(chosen.position, before.position)
