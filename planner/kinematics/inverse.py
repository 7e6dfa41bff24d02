"""Inverse kinematics: the solution nearest to a reference, all solutions, or why there is none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from planner.kinematics.forward import manipulability, tool_pose
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import QUICK, Search, pose_errors, search_all
from planner.kinematics.turns import by_distance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from planner.robots import Robot
    from planner.spatial import FloatArray, Pose

Status = Literal["solved", "unreachable_waypoint", "joint_position_limit"]

JUMP = 0.5
"""rad or m: a descent from the reference that moves no joint by more has found the solution that goes with it."""


@dataclass(frozen=True, eq=False)
class InverseKinematicsResult:
    """What was found for one pose.

    Attributes:
        status: `solved`, or why not.
        position: (joints,): the solution, or the joint position of the nearest pose found.
        pose: Of the tool at `position`, by forward kinematics.
        position_error: Distance of `pose` from the pose asked, m.
        orientation_error: Angle between them, rad; None: no orientation was asked.
        manipulability: At `position`.
        joint: With `joint_position_limit`: the joint that would have to leave its limits.
        value: With `joint_position_limit`: where that joint would have to be, rad or m.
    """

    status: Status
    position: FloatArray
    pose: Pose
    position_error: float
    orientation_error: float | None
    manipulability: float
    joint: str | None = None
    value: float | None = None


def inverse_kinematics(
    robot: Robot,
    pose: Pose,
    options: InverseKinematicsOptions = InverseKinematicsOptions(),
    reference: ArrayLike | None = None,
) -> InverseKinematicsResult:
    """Solve for a joint position that brings the tool to `pose`; with a reference, for the one nearest to it.

    Nearest counts in time: the joints' distances are divided by their velocity limits. What a descent from the
    reference reaches without a jump is taken as the nearest, else all solutions are compared. The answer is verified
    by forward kinematics and depends on nothing but the arguments.

    Args:
        robot: With its tool.
        pose: In the base frame; without a rotation, the position alone counts.
        options: Tolerances, reference and seed.
        reference: (joints,), rad or m; None: `options.reference`. Without either the first solution found is returned.

    Returns:
        The solution; or why there is none, and the nearest pose found: look at its `status`.
    """
    search = Search(robot, pose, options)
    if reference is None and options.reference is not None:
        reference = np.array(options.reference)
    solution = search.first() if reference is None else _nearest(search, np.asarray(reference, dtype=np.float64))
    return _failure(search) if solution is None else _result(robot, pose, solution, "solved")


def all_solutions(
    robot: Robot,
    pose: Pose,
    options: InverseKinematicsOptions = InverseKinematicsOptions(),
    reference: ArrayLike | None = None,
) -> tuple[FloatArray, ...]:
    """All isolated solutions within the limits, nearest to the reference first; of a continuum, a spread of some.

    Configurations that differ by whole turns of joints count once, turned to lie nearest to the reference.

    Args:
        robot: With its tool.
        pose: In the base frame; without a rotation, the position alone counts.
        options: Tolerances, reference and seed.
        reference: (joints,); None: `options.reference`, or the middle of the limits.
    """
    return solution_layers(robot, [pose], options, None if reference is None else np.asarray(reference))[0]


def solution_layers(
    robot: Robot, poses: Sequence[Pose], options: InverseKinematicsOptions, reference: FloatArray | None = None
) -> list[tuple[FloatArray, ...]]:
    """`all_solutions` of many poses at once, which is faster; of an unreachable one an empty tuple."""
    return _layers([Search(robot, pose, options) for pose in poses], reference)


def solutions_or_failure(
    robot: Robot, pose: Pose, options: InverseKinematicsOptions, reference: FloatArray | None = None
) -> tuple[FloatArray, ...] | InverseKinematicsResult:
    """`all_solutions`, or why there is none and the nearest pose found; one search for both."""
    search = Search(robot, pose, options)
    return _layers([search], reference)[0] or _failure(search)


def _layers(searches: list[Search], reference: FloatArray | None) -> list[tuple[FloatArray, ...]]:
    if not searches:
        return []
    robot, options = searches[0].robot, searches[0].options
    if reference is None:
        reference = robot.middle if options.reference is None else np.array(options.reference)
    return [tuple(by_distance(robot, found, reference)) for found in search_all(searches, reference)]


def _nearest(search: Search, reference: FloatArray) -> FloatArray | None:
    """The solution nearest to the reference."""
    solution = search.solve(np.clip(reference, search.lower, search.upper), **QUICK)
    if solution is not None and np.abs(solution - reference).max() <= JUMP:
        return solution
    solutions = search_all([search], reference)[0]
    return by_distance(search.robot, solutions, reference)[0] if solutions else None


def _failure(search: Search) -> InverseKinematicsResult:
    """Why there is no solution, and the nearest pose found."""
    robot, pose, beyond, nearest = search.robot, search.pose, search.beyond_the_limits(), search.nearest()
    if beyond is None:
        return _result(robot, pose, nearest, "unreachable_waypoint")
    joint = int(np.argmax(np.maximum(search.lower - beyond, beyond - search.upper)))
    return _result(robot, pose, nearest, "joint_position_limit", robot.joint_names[joint], float(beyond[joint]))


def _result(
    robot: Robot, pose: Pose, q: FloatArray, status: Status, joint: str | None = None, value: float | None = None
) -> InverseKinematicsResult:
    reached = tool_pose(robot, q)
    distance, angle = pose_errors(pose, reached)
    measure = float(manipulability(robot, q[None])[0])
    return InverseKinematicsResult(status, q, reached, distance, angle, measure, joint, value)
