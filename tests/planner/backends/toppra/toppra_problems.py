"""Problems shared by tests of toppra, and the used share of a plan's limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.dynamics import inverse_dynamics
from planner.kinematics import tool_speeds
from planner.kinematics.forward import VELOCITIES, tool_pose
from planner.limits import Limits
from planner.plans.result import Plan
from planner.problems.problem import CircularMotion, JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.transitions import StopTransition, ThroughTransition
from planner.robots import Robot, load_robot
from planner.spatial import Pose
from tests.planner.problems_of_tests import problem_of

KUKA, KUKA_START = "kuka_kr16_l6_2", (0.2, -1.3, 1.6, 0.3, 0.9, 0.1)


def through(robot_id: str, seed: int, count: int, scale: float = 1.0, transition: object = None) -> PlanningProblem:
    """Return random joint waypoints, all inner ones passed without stopping."""
    problem = problem_of(robot_id, seed, count, scale)
    passing = transition or ThroughTransition()
    inner = tuple(replace(waypoint, transition=passing) for waypoint in problem.waypoints[1:-1])
    return replace(problem, waypoints=(problem.waypoints[0], *inner, problem.waypoints[-1]))


def joint_problem(
    robot_id: str, positions: list[list[float]], passing: bool = True, **fields: object
) -> PlanningProblem:
    last = len(positions) - 1
    waypoints = tuple(
        JointWaypoint(
            position=tuple(q), transition=ThroughTransition() if passing and 0 < k < last else StopTransition()
        )
        for k, q in enumerate(positions)
    )
    return PlanningProblem(load_robot(robot_id), waypoints, **fields)  # type: ignore[arg-type]


def tool_problem(transition: object, **fields: object) -> PlanningProblem:
    """Return two lines of the tool with a corner between them, and a circle."""
    robot = load_robot(KUKA)
    start = tool_pose(robot, np.array(KUKA_START))
    corner = start.position + np.array([0.0, 0.25, 0.0])
    end = corner + np.array([0.2, 0.05, 0.1])
    via = Pose(end + np.array([0.05, -0.1, 0.0]), None)
    last = Pose(end + np.array([0.0, -0.2, 0.0]), start.rotation)
    waypoints = (
        JointWaypoint(position=KUKA_START),
        PoseWaypoint(pose=Pose(corner, start.rotation), motion=LinearMotion(), transition=transition),  # type: ignore[arg-type]
        PoseWaypoint(pose=Pose(end, start.rotation), motion=LinearMotion()),
        PoseWaypoint(pose=last, motion=CircularMotion(via=via)),
    )
    return PlanningProblem(robot, waypoints, **fields)  # type: ignore[arg-type]


def middles(length: float, count: int) -> tuple[np.ndarray, float]:
    return (np.arange(count) + 0.5) * length / count, length / count


def robot_limits(robot: Robot, torque_scale: float = 1.0) -> Limits:
    torque = robot.limit("torque") * torque_scale
    requested = tuple(torque.tolist()) if robot.has_dynamics else None
    return Limits(
        tuple(robot.limit("velocity").tolist()), tuple(robot.limit("acceleration").tolist()), torque=requested
    )


def worst_ratio(result: Plan, count: int = 10_000) -> float:
    """Return the worst ratio of all limited quantities, on samples evenly spaced in time."""
    trajectory, limits, robot = result.trajectory, result.path.limits, result.path.robot
    times = np.linspace(0.0, trajectory.duration, count)
    pieces, _ = trajectory.locate(times)
    rows = trajectory.segments[pieces]
    q, dq, ddq = trajectory.evaluate(times)
    ratios = [np.abs(dq) / limits.velocity.narrower[rows], np.abs(ddq) / limits.acceleration.narrower[rows]]
    if robot.has_dynamics and np.isfinite(limits.torque.narrower).any():
        ratios.append(np.abs(inverse_dynamics(robot, q, dq, ddq)) / limits.torque.narrower[rows])
    for name, speed in zip(VELOCITIES, tool_speeds(robot, q, dq), strict=True):
        ratios.append(speed / limits.magnitudes(name)[rows, 0])
    return max(float(np.max(ratio)) for ratio in ratios)
