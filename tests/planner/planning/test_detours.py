"""Plans with free motions: found, timed on the ladder and certified, or refused with the progress of the search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.backends import BACKENDS
from planner.paths import solve_path
from planner.spatial import FloatArray
from tests.planner.free_motion.cases import ARM, LEFT, RIGHT, WALL
from tests.planner.problems_of_tests import certified_plan
from tests.planner.scene.brute_force import least_distance

SCENE = planner.Scene([WALL], margin=0.01)
FREE = planner.FreeMotion()
PROBLEM = planner.PlanningProblem(
    ARM, [planner.JointWaypoint(LEFT), planner.JointWaypoint(RIGHT, motion=FREE, name="there")], scene=SCENE
)


@pytest.fixture(scope="module")
def around() -> planner.Plan:
    return planner.plan(PROBLEM, planner.Toppra())


def test_the_plan_is_free_between_its_samples(around: planner.Plan) -> None:
    assert least_distance(ARM, SCENE, around.trajectory) > 0.01 - 2e-5
    assert around.certificate.satisfied
    assert around.certificate.clearance is not None
    assert (around.path.positions[0] == LEFT).all()
    assert (around.path.positions[-1] == RIGHT).all()


def test_what_was_found_is_said(around: planner.Plan) -> None:
    (way,) = around.detours
    assert way.waypoint == 1
    assert len(around.problem.waypoints) == len(way.positions) > 2
    assert list(around.problem.numbers) == [0, *[1] * (len(way.positions) - 1)]


def test_a_joint_motion_would_collide() -> None:
    straight = replace(PROBLEM, waypoints=[planner.JointWaypoint(LEFT), planner.JointWaypoint(RIGHT)])
    with pytest.raises(planner.Collision):
        certified_plan(straight, planner.Quintic(), solve_path(straight))


@pytest.mark.parametrize(
    "kind",
    [
        "ruckig",
        *(pytest.param(kind, marks=pytest.mark.large_only) for kind in BACKENDS if kind not in ("ruckig", "toppra")),
    ],
)
def test_every_back_end_keeps_clear(kind: str) -> None:
    made = planner.plan(PROBLEM, BACKENDS[kind]())
    assert least_distance(ARM, SCENE, made.trajectory, coarse=0.02) > 0.01 - 2e-5


def test_what_mends_one_fault_of_two_is_a_hint() -> None:
    """The start exceeds a limit, and the goal is out of reach: neither change by itself leads to a plan."""
    robot = planner.load_robot("kuka_kr16_2")
    beyond = planner.JointWaypoint([0.0, 3.0, 1.5, 0.0, 0.5, 0.0])
    far = planner.PoseWaypoint(planner.Pose([10.0, 0.0, 0.0], np.eye(3)), motion=FREE)
    with pytest.raises(planner.JointPositionLimit) as refused:
        planner.plan(planner.PlanningProblem(robot, [beyond, far]))
    assert not refused.value.remedies
    assert refused.value.hints


def test_without_anything_in_the_way_it_is_a_joint_motion() -> None:
    made = planner.plan(replace(PROBLEM, scene=None), planner.Quintic())
    joint = planner.plan(
        replace(PROBLEM, scene=None, waypoints=[planner.JointWaypoint(LEFT), planner.JointWaypoint(RIGHT)]),
        planner.Quintic(),
    )
    assert made.trajectory.coefficients.tobytes() == joint.trajectory.coefficients.tobytes()


@pytest.mark.parametrize("travel", [1e3 + 1.0, 1e6, 1e15])
def test_a_motion_of_a_million_radians_is_refused(travel: float) -> None:
    """The search needed a joint position for each tenth of a radian: more memory than a worker has."""
    start = [0.3, 0.4, -0.5]
    far = planner.JointWaypoint([0.3, 0.4 - travel, -0.5], motion=planner.FreeMotion())
    ball = planner.SceneObject("ball", [planner.Sphere(0.03)], planner.Pose([1.0, 0.3, 0.3]))
    requested = planner.PlanningProblem(
        planner.load_robot("three_dof_arm"), [planner.JointWaypoint(start), far], scene=planner.Scene([ball])
    )
    with pytest.raises(planner.InvalidProblem, match="free motion is sought up to 1000"):
        planner.plan(requested)


def elbow(position: FloatArray) -> FloatArray:
    data = ARM.model.createData()
    pin.forwardKinematics(ARM.model, data, position)
    return data.oMi[3].translation.copy()


def test_a_pose_in_any_configuration_that_has_room() -> None:
    """A ball is at the elbow of the nearest configuration; others are collision-free."""
    pose = planner.tool_pose(ARM, RIGHT)
    nearest = planner.inverse_kinematics(ARM, pose, reference=LEFT).position
    ball = planner.SceneObject("ball", [planner.Sphere(0.1)], planner.Pose(elbow(nearest)))
    problem = replace(PROBLEM, scene=planner.Scene([ball]))
    start = planner.JointWaypoint([1.6, *LEFT[1:]])
    straight = replace(problem, waypoints=[start, planner.JointWaypoint(nearest.tolist())])
    with pytest.raises(planner.Collision):
        certified_plan(straight, planner.Quintic(), solve_path(straight))
    for motion in (FREE, planner.JointMotion()):
        made = planner.plan(replace(problem, waypoints=[start, planner.PoseWaypoint(pose, motion=motion)]))
        reached = planner.tool_pose(ARM, made.path.positions[-1])
        assert np.abs(reached.position - pose.position).max() < 1e-5
        assert np.linalg.norm(elbow(made.path.positions[-1]) - elbow(nearest)) > 0.1


def test_a_way_begins_in_the_configuration_that_it_was_found_for() -> None:
    """Behind a thin wall, the path to another configuration was free from one start only, and was lost."""
    ends = [planner.Pose.from_rpy([1.2, y, 0.7], [0.0, np.pi, 0.0]) for y in (-0.6, 0.6)]
    thin = planner.SceneObject("wall", [planner.Box([0.3, 0.05, 0.4])], planner.Pose([1.2, 0.0, 0.5]))
    scene = planner.Scene([thin])
    waypoints = [planner.PoseWaypoint(ends[0]), planner.PoseWaypoint(ends[1], motion=FREE)]
    made = planner.plan(planner.PlanningProblem(ARM, waypoints, scene=scene), planner.Toppra())
    assert least_distance(ARM, scene, made.trajectory) > -2e-5
    for end, position in zip(ends, made.path.positions[[0, -1]], strict=True):
        assert np.abs(planner.tool_pose(ARM, position).position - end.position).max() < 1e-5


def test_lists_go_on_after_a_free_motion_and_actions_move_with_their_waypoints() -> None:
    lift = planner.RelativeWaypoint(
        planner.CartesianMove((0.0, 0.0, 0.05)), frame="base", motion=planner.LinearMotion(), dwell=0.2
    )
    action = planner.SetOutput(planner.AtWaypoint(1), "grip", True)
    made = planner.plan(replace(PROBLEM, waypoints=[*PROBLEM.waypoints, lift], actions=[action]), planner.Toppra())
    number = len(made.problem.waypoints) - 2
    assert number > 1
    assert made.actions[0].time == pytest.approx(made.trajectory.arrivals[number])


def test_refusals_say_where() -> None:
    block = planner.SceneObject("block", [planner.Box([0.4] * 3)], planner.Pose(planner.tool_pose(ARM, RIGHT).position))
    with pytest.raises(planner.Collision, match="at waypoint 1") as goal:
        planner.plan(replace(PROBLEM, scene=planner.Scene([block])))
    assert goal.value.waypoint == 1
    turned = [planner.JointWaypoint(RIGHT), planner.JointWaypoint(LEFT, motion=FREE)]
    with pytest.raises(planner.StartInCollision):
        planner.plan(replace(PROBLEM, scene=planner.Scene([block]), waypoints=turned))
    few = replace(PROBLEM.waypoints[1], motion=planner.FreeMotion(most_checks=2))
    with pytest.raises(planner.NoPathFound) as lost:
        planner.plan(replace(PROBLEM, waypoints=[PROBLEM.waypoints[0], few]))
    assert lost.value.segment == 0
    assert lost.value.checks >= 2
    assert lost.value.path_point is not None
    timed = replace(PROBLEM.waypoints[1], duration=3.0)
    with pytest.raises(planner.InvalidProblem, match="cannot have a duration of its own"):
        planner.plan(replace(PROBLEM, waypoints=[PROBLEM.waypoints[0], timed]))


def test_a_whole_duration() -> None:
    made = planner.plan(replace(PROBLEM, duration=12.0), planner.Quintic())
    assert made.trajectory.duration == pytest.approx(12.0)
