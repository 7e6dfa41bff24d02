"""Tools that change during a trajectory: poses and lines of each by Pinocchio, with the tool's frame added by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from planner.backends import BACKENDS
from planner.errors import InvalidProblem
from planner.export import FORMATS, ExportOptions
from planner.kinematics.options import InverseKinematicsOptions
from planner.limits import Limits
from planner.paths import solve_path
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.problems.transitions import BlendTransition
from planner.robots import Robot, load_robot
from planner.spatial import FloatArray, Pose
from planner.waypoints.reachability import reachability
from tests.planner.problems_of_tests import backend_of

ROBOT = load_robot("kuka_kr16_l6_2")
START = (0.2, -1.2, 1.4, 0.2, 0.6, 0.1)
GRIPPER, CAMERA = Pose.from_rpy([0.0, 0.0, 0.2], [0.0, 0.0, 0.5]), Pose.from_rpy([0.1, 0.05, 0.08], [0.3, -0.4, 0.2])


def flange(robot: Robot, q: FloatArray) -> pin.SE3:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, np.asarray(q))
    return data.oMf[robot.model.getFrameId(robot.tip_frame)]


def tool_at(robot: Robot, q: FloatArray, tool: Pose) -> pin.SE3:
    rotation = np.eye(3) if tool.rotation is None else tool.rotation
    return flange(robot, q) * pin.SE3(rotation, tool.position)


def inspected_part() -> tuple[PlanningProblem, list[Pose]]:
    """Make a problem that inspects a part with a camera and grips it; return also each waypoint's tool."""
    home, seen = tool_at(ROBOT, np.array(START), GRIPPER), tool_at(ROBOT, np.array(START), CAMERA)
    goal = Pose(seen.translation + np.array([0.1, -0.15, 0.05]), seen.rotation @ pin.exp3(np.array([0.1, 0.2, -0.3])))
    via = Pose(seen.translation + np.array([0.0, 0.05, 0.1]))
    waypoints = [
        JointWaypoint(START, tool=GRIPPER),
        PoseWaypoint(goal, tool=CAMERA, motion=LinearMotion()),
        PoseWaypoint(Pose(seen.translation, goal.rotation), motion=CircularMotion(via)),
        RelativeWaypoint(CartesianMove((0.0, 0.0, 0.08)), tool=GRIPPER, motion=LinearMotion()),
        PoseWaypoint(Pose(home.translation, home.rotation), motion=LinearMotion()),
    ]
    return PlanningProblem(ROBOT, waypoints), [GRIPPER, CAMERA, CAMERA, GRIPPER, GRIPPER]


def goes_straight(made: Plan, segment: int, tool: Pose) -> None:
    """Assert that this tool moves straight between the waypoints of a segment, to the tolerance of lines."""
    times = np.linspace(made.trajectory.departures[segment], made.trajectory.arrivals[segment + 1], 60)
    reached = [tool_at(made.problem.robot, q, tool) for q in made.trajectory.evaluate(times, [0])[0]]
    start, end = reached[0], reached[-1]
    way = end.translation - start.translation
    turn = pin.log3(start.rotation.T @ end.rotation)
    for there in reached:
        share = (there.translation - start.translation) @ way / (way @ way)
        assert np.linalg.norm(there.translation - start.translation - share * way) <= 1e-4
        due = start.rotation @ pin.exp3(share * turn)
        assert np.linalg.norm(pin.log3(due.T @ there.rotation)) <= 1.1e-3


@pytest.mark.long_table
@pytest.mark.parametrize("kind", list(BACKENDS))
def test_poses_lines_and_speeds_are_those_of_the_tool_of_each_waypoint(kind: str) -> None:
    problem, tools = inspected_part()
    problem = replace(problem, limits=Limits(tcp_linear_velocity=0.1))
    made = plan(problem, backend_of(kind))
    positions = made.path.positions
    for index in (1, 2, 4):
        waypoint = problem.waypoints[index]
        assert isinstance(waypoint, PoseWaypoint)
        there = tool_at(ROBOT, positions[index], tools[index])
        assert np.linalg.norm(there.translation - waypoint.pose.position) < 2e-6
        assert np.linalg.norm(pin.log3(there.rotation.T @ waypoint.pose.rotation)) < 2e-6
    before, after = (tool_at(ROBOT, positions[k], GRIPPER) for k in (2, 3))
    assert after.translation == pytest.approx(before.act(np.array([0.0, 0.0, 0.08])), abs=3e-6)
    for segment in (0, 2, 3):
        goes_straight(made, segment, tools[segment + 1])
    rows = made.samples(0.004, ["tcp_pose", "tcp_velocity"])
    assert rows.tcp_position is not None and rows.tcp_velocity is not None
    for k in range(0, len(rows.time), 7):
        tool = tools[rows.segment[k] + 1]
        assert rows.tcp_position[k] == pytest.approx(tool_at(ROBOT, rows.position[k], tool).translation, abs=1e-9)
        step = 1e-6
        ahead, behind = (tool_at(ROBOT, rows.position[k] + s * step * rows.velocity[k], tool) for s in (1.0, -1.0))
        velocity = (ahead.translation - behind.translation) / (2.0 * step)
        assert rows.tcp_velocity[0][k] == pytest.approx(velocity, abs=1e-6)
        assert np.linalg.norm(velocity) <= 0.1 * (1.0 + 1e-6)
    (check,) = (one for one in made.certificate.checks if one.quantity == "tcp_linear_velocity")
    assert 0.99 <= (check.ratio or 0.0) <= 1.0 + 1e-6


def test_an_equal_tool_is_no_other_tool() -> None:
    own = ROBOT.with_tool(GRIPPER)
    same = Pose(GRIPPER.position + 1e-15, GRIPPER.rotation)
    there = [JointWaypoint(START), JointWaypoint(np.array(START) + 0.1, tool=same), JointWaypoint(START, tool=GRIPPER)]
    assert all(robot is own for robot in PlanningProblem(own, there).robots)


def test_a_tool_without_axes_has_those_of_the_flange() -> None:
    point = Pose([0.1, 0.0, 0.3])
    goal = tool_at(ROBOT, np.array(START) + 0.1, point)
    there = [JointWaypoint(START), PoseWaypoint(Pose(goal.translation, goal.rotation), tool=point)]
    reached = tool_at(ROBOT, solve_path(PlanningProblem(ROBOT, there)).positions[1], point)
    assert np.linalg.norm(reached.translation - goal.translation) < 2e-6
    assert np.linalg.norm(reached.rotation - goal.rotation) < 2e-6


@pytest.mark.parametrize("arm", ["three_dof_arm", "kuka_kr16_l6_2"])
def test_a_line_after_a_position_alone_begins_where_the_tool_is(arm: str) -> None:
    """The position of another tool depends on the open orientation: the joint position before is chosen first."""
    robot, tool = load_robot(arm), Pose([0.0, 0.05, 0.1])
    q = np.array([0.3, 0.2, 0.4]) if robot.dof == 3 else np.array(START)
    other, shift = tool_at(robot, q, tool), (0.005, -0.01, 0.005)
    waypoints = [
        JointWaypoint(q),
        PoseWaypoint(Pose(flange(robot, q + 0.1).translation)),
        RelativeWaypoint(CartesianMove(shift), "base", tool=tool, motion=LinearMotion()),
        PoseWaypoint(Pose(other.translation), motion=LinearMotion()),
    ]
    made = plan(PlanningProblem(robot, waypoints))
    before, after = (tool_at(robot, made.path.positions[k], tool).translation for k in (1, 2))
    assert after - before == pytest.approx(shift, abs=3e-6)
    for segment in (1, 2):
        times = np.linspace(made.trajectory.departures[segment], made.trajectory.arrivals[segment + 1], 30)
        points = [tool_at(robot, p, tool).translation for p in made.trajectory.evaluate(times, [0])[0]]
        way = (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])
        assert max(np.linalg.norm(np.cross(point - points[0], way)) for point in points) <= 1e-4
    assert np.linalg.norm(points[-1] - other.translation) < 2e-6
    found = reachability(robot, waypoints, InverseKinematicsOptions())
    assert all(one.error is None for one in found)
    assert found[3].best is not None
    assert np.linalg.norm(tool_at(robot, found[3].best, tool).translation - other.translation) < 2e-6


def test_a_free_turn_is_about_the_axis_of_its_own_tool() -> None:
    aim = tool_at(ROBOT, np.array(START) + 0.05, CAMERA)
    pose = Pose(aim.translation, aim.rotation @ pin.exp3(np.array([0.0, 0.0, 2.0])))
    there = [JointWaypoint(START), PoseWaypoint(pose, free="rotation_z", tool=CAMERA)]
    reached = tool_at(ROBOT, solve_path(PlanningProblem(ROBOT, there)).positions[1], CAMERA)
    assert np.linalg.norm(reached.translation - aim.translation) < 2e-6
    assert np.linalg.norm(reached.rotation[:, 2] - aim.rotation[:, 2]) < 2e-6


def test_a_tool_changes_only_where_the_robot_stops() -> None:
    problem, _ = inspected_part()
    waypoints = list(problem.waypoints)
    waypoints[2] = replace(waypoints[2], transition=BlendTransition(0.01))
    with pytest.raises(InvalidProblem, match="the tool changes here") as refused:
        plan(replace(problem, waypoints=waypoints))
    assert [fault.field for fault in refused.value.faults] == [("waypoints", 2, "transition")]


def test_a_program_of_lines_sets_the_tools() -> None:
    robot = load_robot("ngv_refuelling_arm")
    q, tool = np.array([1.6, 1.0, -0.3, 0.0, 2.4, 0.3]), Pose.from_rpy([0.0, 0.01, 0.1], [0.0, 0.0, np.pi])
    line = RelativeWaypoint(CartesianMove((0.0, 0.02, 0.0)), tool=tool, motion=LinearMotion())
    program = FORMATS["urscript_moves"].render(plan(PlanningProblem(robot, [JointWaypoint(q), line])), ExportOptions())
    set_tcp = [row.strip() for row in program.decode().splitlines() if "set_tcp" in row or "movel" in row]
    values = set_tcp[0].removeprefix("set_tcp(p[").removesuffix("])").split(",")
    assert [float(value) for value in values] == pytest.approx([0.0, 0.01, 0.1, 0.0, 0.0, np.pi])
    assert set_tcp[1].startswith("movel(")
