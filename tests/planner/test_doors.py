"""Arguments that a library user may pass: back ends by kind, waypoints and poses of other types; and printed values."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.guarantees import END_OPTIONS

HOME = [0.0, -1.5, 1.5, 0.0, 0.5, 0.0]
PICK = [1.0, -1.2, 1.2, 0.0, 0.5, 0.5]


@pytest.fixture(scope="module")
def robot() -> planner.Robot:
    return planner.load_robot("kuka_kr16_2")


def motion(robot: planner.Robot) -> planner.PlanningProblem:
    return planner.PlanningProblem(robot, [planner.JointWaypoint(HOME), planner.JointWaypoint(PICK)])


def durations(*plans: planner.Plan) -> set[float]:
    return {plan.trajectory.duration for plan in plans}


@pytest.mark.parametrize("kind", [kind for kind in planner.BACKENDS if kind != "min_effort"])
def test_plan_takes_the_kind_of_a_back_end(robot: planner.Robot, kind: str) -> None:
    by_kind, by_value = planner.plan(motion(robot), kind), planner.plan(motion(robot), planner.BACKENDS[kind]())
    assert by_kind.backend == by_value.backend
    assert len(durations(by_kind, by_value)) == 1


def test_compare_takes_kinds_of_back_ends(robot: planner.Robot) -> None:
    compared = planner.compare(motion(robot), ["cubic", planner.Quintic()])
    assert [one.backend.kind for one in compared] == ["cubic", "quintic"]


@pytest.mark.parametrize(
    ("value", "error", "message"),
    [
        ("rukig", ValueError, "`backend` must be one of cubic, quintic, .*; got 'rukig'"),
        (planner.Ruckig, TypeError, r"got Ruckig; write planner.Ruckig\(\)"),
        (3, TypeError, "got int"),
        (None, TypeError, "got NoneType"),
    ],
)
def test_plan_refuses_what_is_no_back_end(
    robot: planner.Robot, value: Any, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        planner.plan(motion(robot), value)


@pytest.mark.parametrize("pick", [PICK, tuple(PICK), np.array(PICK), planner.JointWaypoint(PICK)])
def test_joint_values_are_waypoints(robot: planner.Robot, pick: Any) -> None:
    problem = planner.PlanningProblem(robot, [HOME, pick])  # type: ignore[list-item]
    assert problem == motion(robot)


def test_names_of_joint_positions_are_waypoints(robot: planner.Robot) -> None:
    named = robot.derived(named_positions={"home": HOME})
    problem = planner.PlanningProblem(named, ["home", PICK])  # type: ignore[list-item]
    assert problem.waypoints[0] == planner.JointWaypoint.named(named, "home")
    with pytest.raises(planner.InvalidProblem, match="hom"):
        planner.PlanningProblem(named, ["hom", PICK])  # type: ignore[list-item]


def test_poses_of_any_type_are_waypoints_and_are_reached(robot: planner.Robot) -> None:
    """The tool ends at the pose of the joint position by Pinocchio's own forward kinematics."""
    pin.framesForwardKinematics(robot.model, robot.model.createData(), np.array(PICK))
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, np.array(PICK))
    goal = pin.SE3(data.oMf[robot.tool_frame_id])
    for pose in (goal, goal.homogeneous, goal.homogeneous.tolist(), planner.Pose(goal.translation, goal.rotation)):
        plan = planner.plan(planner.PlanningProblem(robot, [HOME, pose]))  # type: ignore[list-item]
        pin.framesForwardKinematics(robot.model, data, plan.trajectory.evaluate(plan.trajectory.duration, [0])[0])
        assert np.allclose(data.oMf[robot.tool_frame_id].homogeneous, goal.homogeneous, atol=2e-6)


def test_poses_of_any_type_are_poses_everywhere(robot: planner.Robot) -> None:
    turn = pin.SE3(pin.utils.rotate("z", 0.3), np.array([0.1, 0.2, 0.3]))
    for pose in (turn, turn.homogeneous, turn.homogeneous.tolist()):
        taken = [
            planner.PoseWaypoint(pose).pose,
            planner.PoseWaypoint(planner.Pose([0.0, 0.0, 0.0]), frame=pose).frame,
            planner.JointWaypoint(HOME, tool=pose).tool,
            planner.CircularMotion(pose).via,
            planner.PolylineMotion([pose], blend=0.01).poses[0],
            planner.SplineMotion([pose]).poses[0],
            planner.SceneObject("box", [planner.Sphere(0.1)], pose).pose,
            planner.AttachedObject("part", [planner.Sphere(0.1)], pose).pose,
        ]
        assert all(np.array_equal(planner.as_pose(one).position, turn.translation) for one in taken if one is not None)
        assert all(np.allclose(one.rotation, turn.rotation) for one in taken if one is not None)  # type: ignore[arg-type]
        assert np.allclose(robot.with_tool(pose).tool_in_tip.homogeneous, turn.homogeneous)
        assert planner.inverse_kinematics(robot, pose).status == planner.inverse_kinematics(robot, taken[0]).status  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("value", "error", "message"),
    [
        ({"x": 1}, TypeError, r"`waypoints\[1\]` must be a waypoint, a joint position, .*; got dict"),
        (None, TypeError, r"`waypoints\[1\]` .* got NoneType"),
        (np.zeros((3, 3)), TypeError, r"got ndarray"),
        (np.zeros((4, 4)), ValueError, r"`waypoints\[1\]` must have a rotation"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), ValueError, "must have a rotation"),
        (np.full((4, 4), np.nan), ValueError, "must have a rotation"),
    ],
)
def test_other_values_are_no_waypoints(robot: planner.Robot, value: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        planner.PlanningProblem(robot, [HOME, value])


def test_a_name_is_no_robot() -> None:
    with pytest.raises(TypeError, match=re.escape("Write planner.load_robot('ur5').")):
        planner.PlanningProblem("ur5", [HOME])  # type: ignore[arg-type, list-item]


def test_forward_kinematics_takes_one_joint_position(robot: planner.Robot) -> None:
    one, (first, second) = planner.forward_kinematics(robot, HOME), planner.forward_kinematics(robot, [HOME, PICK])
    assert np.array_equal(one.position, first.position)
    assert not np.array_equal(first.position, second.position)
    assert planner.forward_kinematics(robot, np.zeros((0, 6))) == []
    for wrong in ([0.0] * 5, [[0.0] * 7], [[HOME]]):
        with pytest.raises(ValueError, match=re.escape("`positions` must have shape (6,) or (N, 6)")):
            planner.forward_kinematics(robot, wrong)  # type: ignore[call-overload]


def test_values_are_short_to_read(robot: planner.Robot) -> None:
    plan = planner.plan(motion(robot))
    for value in (robot, plan, plan.problem, plan.path, plan.trajectory, planner.Pose([0.0, 0.0, 1.0])):
        assert len(repr(value)) < 120
        assert "\n" not in repr(value)
    assert repr(robot) == "Robot('kuka_kr16_2', 6 joints)"
    assert f"{plan.trajectory.duration:.6g} s" in repr(plan)


@pytest.mark.parametrize("kind", planner.BACKENDS)
def test_capabilities_say_which_options_a_back_end_has(kind: str) -> None:
    """The promised options and methods exist, and no back end has them without the capability."""
    backend = planner.BACKENDS[kind]()
    can = backend.capabilities
    assert can.moves_at_its_ends == all(hasattr(backend, name) for name in END_OPTIONS)
    assert can.leaves_straight_motions == hasattr(backend, "max_deviation")
    assert can.searches == (hasattr(backend, "without_search") and hasattr(backend, "held_nearer"))


def test_given_ramps_change_what_a_trapezoid_can_do() -> None:
    assert not planner.Trapezoidal().capabilities.is_shaped_by_duration
    assert planner.Trapezoidal(acceleration_time=0.5).capabilities.is_shaped_by_duration
