"""A list of waypoints to joint positions, each on the branch nearest to the one before."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import JointPositionLimit, PlanningError, Remedy, UnreachableWaypoint
from planner.kinematics.forward import tool_pose
from planner.kinematics.inverse import InverseKinematicsResult, all_solutions, inverse_kinematics
from planner.kinematics.poses import FloatArray, Pose, poses_as_dicts
from planner.kinematics.search import is_isolated, pose_errors
from planner.problem import JointWaypoint, PoseWaypoint

if TYPE_CHECKING:
    from planner.problem import AnyWaypoint, InverseKinematicsOptions, RelativeWaypoint
    from planner.robots import Robot


POSITION_ONLY_DOF = 3
"""An arm with so few joints cannot choose its orientation: a move relative to a joint position asks for none."""


@dataclass(frozen=True, eq=False)
class SolvedWaypoint:
    """A waypoint with its joint position. Its existence means: forward kinematics have confirmed it.

    Attributes:
        name: As asked.
        position: (joints,), rad or m.
        pose: Of the tool there.
        position_error: m, from the pose asked; 0 for a joint waypoint.
        orientation_error: rad; None: no orientation was asked.
        solutions: How many isolated solutions the pose has; None: a joint waypoint, or a continuum.
    """

    name: str | None
    position: FloatArray
    pose: Pose
    position_error: float
    orientation_error: float | None
    solutions: int | None


def solve_waypoints(
    robot: Robot, waypoints: tuple[AnyWaypoint, ...], options: InverseKinematicsOptions
) -> tuple[SolvedWaypoint, ...]:
    """Joint positions of all waypoints, in order.

    Raises:
        UnreachableWaypoint: A pose has no solution; the nearest pose found comes with it.
        JointPositionLimit: A joint position lies outside the limits, or a pose has solutions only there.
    """
    solved: list[SolvedWaypoint] = []
    wanted: Pose | None = None
    for index, waypoint in enumerate(waypoints):
        if isinstance(waypoint, JointWaypoint):
            solved.append(_joint_waypoint(robot, index, waypoint))
            wanted = solved[-1].pose
            if robot.dof <= POSITION_ONLY_DOF:
                wanted = Pose(wanted.position)
            continue
        if isinstance(waypoint, PoseWaypoint):
            wanted = waypoint.pose
        else:
            assert wanted is not None  # noqa: S101 - check_problem refuses a relative first waypoint
            wanted = _moved(wanted, solved[-1].pose, waypoint)
        reference = solved[-1].position if solved else None
        solutions = all_solutions(robot, wanted, options, reference)
        if not solutions:
            result = inverse_kinematics(robot, wanted, options, reference)
            raise _unsolved(robot, index, wanted, result, is_pose=isinstance(waypoint, PoseWaypoint))
        pose = tool_pose(robot, solutions[0])
        count = len(solutions) if is_isolated(robot, wanted, solutions[0]) else None
        solved.append(SolvedWaypoint(waypoint.name, solutions[0], pose, *pose_errors(wanted, pose), count))
    return tuple(solved)


def _joint_waypoint(robot: Robot, index: int, waypoint: JointWaypoint) -> SolvedWaypoint:
    q = np.array(waypoint.position)
    lower, upper = robot.limit("lower"), robot.limit("upper")
    outside = (q < lower) | (q > upper)
    if outside.any():
        joint = int(np.argmax(outside))
        limit = float(lower[joint] if q[joint] < lower[joint] else upper[joint])
        raise JointPositionLimit(
            f"waypoint {index} puts {robot.joint_names[joint]} at {q[joint]:.6g}, its limit is {limit:.6g}",
            waypoint=index,
            joint=robot.joint_names[joint],
            value=float(q[joint]),
            limit=limit,
            remedies=[Remedy(f"/waypoints/{index}/position/{joint}", limit, "the nearest position within the limits")],
        )
    return SolvedWaypoint(waypoint.name, q, tool_pose(robot, q), 0.0, 0.0, None)


def _moved(wanted: Pose, reached: Pose, waypoint: RelativeWaypoint) -> Pose:
    """The pose before, moved. Where the pose before left its orientation open, so does this one.

    The move starts from the pose asked, not from the one reached: errors do not add up.
    """
    assert reached.rotation is not None  # noqa: S101 - forward kinematics always give one
    rotation = reached.rotation if wanted.rotation is None else wanted.rotation
    turn, shift = waypoint.move.transform()
    if waypoint.frame == "tool":
        position, turned = wanted.position + rotation @ shift, rotation @ turn
    else:
        position, turned = wanted.position + shift, turn @ rotation
    return Pose(position, None if wanted.rotation is None else turned)


def _unsolved(
    robot: Robot, index: int, wanted: Pose, result: InverseKinematicsResult, *, is_pose: bool
) -> PlanningError:
    nearest = poses_as_dicts([Pose(result.pose.position, None if wanted.rotation is None else result.pose.rotation)])[0]
    details = {
        "nearest": {
            "pose": nearest,
            "position": result.position.tolist(),
            "position_distance": result.position_error,
            "orientation_distance": result.orientation_error,
        }
    }
    away = f"{result.position_error * 1000.0:.4g} mm"
    if result.orientation_error is not None:
        away += f" and {np.degrees(result.orientation_error):.4g} deg"
    remedies = [Remedy(f"/waypoints/{index}/pose", nearest, f"the nearest reachable pose found, {away} away")]
    if result.status == "joint_position_limit":
        joint = robot.joints[robot.joint_names.index(str(result.joint))]
        value = float(result.value or 0.0)
        limit = joint.lower if value < joint.lower else joint.upper
        return JointPositionLimit(
            f"waypoint {index} can be reached only with {joint.name} at {value:.6g}, its limit is {limit:.6g}; "
            f"within the limits the nearest pose found is {away} away",
            waypoint=index,
            joint=joint.name,
            value=value,
            limit=float(limit),
            remedies=remedies if is_pose else (),
            details=details,
        )
    return UnreachableWaypoint(
        f"no joint position of {robot.id} reaches waypoint {index}; the nearest pose found is {away} away",
        waypoint=index,
        remedies=remedies if is_pose else (),
        details=details,
    )
