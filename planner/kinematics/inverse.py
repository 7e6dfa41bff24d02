"""Inverse kinematics: the solution nearest to a reference, all solutions, or why there is none."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Literal

import numpy as np

from planner.kinematics.configurations import Configuration, configurations
from planner.kinematics.forward import forward_kinematics, manipulability, tool_pose
from planner.kinematics.nearest import MANY, nearest_in_turn, nearest_solution
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import Search, errors_of_many, pose_errors, search_all
from planner.kinematics.turns import by_distance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from planner.robots import Robot
    from planner.spatial import FloatArray, Pose

Status = Literal["solved", "unreachable_waypoint", "joint_position_limit"]


@dataclass(frozen=True, eq=False)
class InverseKinematicsResult:
    """The result of the inverse kinematics for one pose.

    Attributes:
        status: `solved`, or why not.
        position: (joints,), rad or m: the solution, or the joint position of the nearest pose found.
        pose: The tool's pose at `position`, by forward kinematics.
        position_error: Distance of `pose` from the pose asked, m.
        orientation_error: Angle between them, rad; None: no orientation was asked.
        manipulability: The manipulability at `position`.
        configuration: The names of the configuration of `position`.
        joint: With `joint_position_limit`: the joint that would have to leave its limits.
        value: With `joint_position_limit`: where that joint would have to be, rad or m.
    """

    status: Status
    position: FloatArray
    pose: Pose
    position_error: float
    orientation_error: float | None
    manipulability: float
    configuration: Configuration
    joint: str | None = None
    value: float | None = None


def inverse_kinematics(
    robot: Robot,
    pose: Pose,
    options: InverseKinematicsOptions = InverseKinematicsOptions(),
    reference: ArrayLike | None = None,
) -> InverseKinematicsResult:
    """Solve for a joint position that brings the tool to `pose`; with a reference, for the one nearest to it.

    Nearest counts in time: the joints' distances are divided by their velocity limits. `nearest_solution` says what is
    promised for which arm. The answer is verified by forward kinematics and depends on nothing but the arguments.

    Args:
        robot: The robot, with its tool.
        pose: The tool's pose in the base frame; without a rotation, the position alone counts.
        options: Tolerances, reference and seed.
        reference: (joints,), rad or m; None: `options.reference`. Without either the first solution found is returned.

    Returns:
        The solution; or why there is none, and the nearest pose found: look at its `status`.
    """
    search = Search(robot, pose, options)
    if reference is None and options.reference is not None:
        reference = np.array(options.reference)
    solution = (
        search.first() if reference is None else nearest_solution(search, np.asarray(reference, dtype=np.float64))
    )
    return _failure(search) if solution is None else _result(robot, pose, solution, "solved")


def inverse_kinematics_many(
    robot: Robot,
    poses: Sequence[Pose],
    options: InverseKinematicsOptions = InverseKinematicsOptions(),
    reference: ArrayLike | None = None,
) -> list[InverseKinematicsResult]:
    """Solve a sequence of poses, each for the joint position nearest to that of the pose before it.

    The answers are those of `inverse_kinematics`, one pose after the other, each with the last solution as its
    reference. Of an arm with a closed form, many poses take a fraction of the time of as many calls.

    Args:
        robot: The robot, with its tool.
        poses: The tool's poses in the base frame; without a rotation, the position alone counts.
        options: Tolerances, reference and seed.
        reference: (joints,), of the first pose; None: `options.reference`. Without either the first solution found is
            the first answer.

    Returns:
        One result for each pose.
    """
    if reference is None and options.reference is not None:
        reference = np.array(options.reference)
    near = None if reference is None else np.asarray(reference, dtype=np.float64)
    results: list[InverseKinematicsResult] = []
    for _, group in groupby(poses, key=lambda pose: pose.rotation is None):
        searches = [Search(robot, pose, options) for pose in group]
        solutions = nearest_in_turn(searches, near)
        answers = _results(robot, searches, solutions)
        results += answers
        near = next((answer.position for answer in reversed(answers) if answer.status == "solved"), near)
    return results


def all_solutions(
    robot: Robot,
    pose: Pose,
    options: InverseKinematicsOptions = InverseKinematicsOptions(),
    reference: ArrayLike | None = None,
) -> tuple[FloatArray, ...]:
    """Find all isolated solutions within the limits, nearest to the reference first; of a continuum, a spread of some.

    Configurations that differ by whole turns of joints count once, turned to lie nearest to the reference.

    Args:
        robot: The robot, with its tool.
        pose: The tool's pose in the base frame; without a rotation, the position alone counts.
        options: Tolerances, reference and seed.
        reference: (joints,), rad or m; None: `options.reference`, or the middle of the limits.

    Returns:
        The solutions, each (joints,), rad or m; none where the pose cannot be reached.
    """
    return solution_layers(robot, [pose], options, None if reference is None else np.asarray(reference))[0]


def solution_layers(
    robot: Robot, poses: Sequence[Pose], options: InverseKinematicsOptions, reference: FloatArray | None = None
) -> list[tuple[FloatArray, ...]]:
    """Find `all_solutions` of many poses at once, which is faster; of an unreachable one an empty tuple."""
    return _layers([Search(robot, pose, options) for pose in poses], reference)


def solutions_or_failure(
    robot: Robot, pose: Pose, options: InverseKinematicsOptions, reference: FloatArray | None = None
) -> tuple[FloatArray, ...] | InverseKinematicsResult:
    """Find `all_solutions`, or why there is none and the nearest pose found; one search does both."""
    search = Search(robot, pose, options)
    return _layers([search], reference)[0] or _failure(search)


def _layers(searches: list[Search], reference: FloatArray | None) -> list[tuple[FloatArray, ...]]:
    if not searches:
        return []
    robot, options = searches[0].robot, searches[0].options
    if reference is None:
        reference = robot.middle if options.reference is None else np.array(options.reference)
    return [tuple(by_distance(robot, found, reference)) for found in search_all(searches, reference)]


def _failure(search: Search) -> InverseKinematicsResult:
    """Why there is no solution, and the nearest pose found."""
    robot, pose, beyond, nearest = search.robot, search.pose, search.beyond_the_limits(), search.nearest()
    if beyond is None:
        return _result(robot, pose, nearest, "unreachable_waypoint")
    joint = int(np.argmax(np.maximum(search.lower - beyond, beyond - search.upper)))
    return _result(robot, pose, nearest, "joint_position_limit", robot.joint_names[joint], float(beyond[joint]))


def _results(
    robot: Robot, searches: Sequence[Search], solutions: Sequence[FloatArray | None]
) -> list[InverseKinematicsResult]:
    """Answers with the poses, by Pinocchio's forward kinematics, and the manipulability that belong to solutions."""
    solved = [k for k, solution in enumerate(solutions) if solution is not None]
    if len(solved) < MANY:
        return [
            _failure(search) if solution is None else _result(robot, search.pose, solution, "solved")
            for search, solution in zip(searches, solutions, strict=True)
        ]
    q = np.array([solutions[k] for k in solved])
    reached = forward_kinematics(robot, q)
    errors = errors_of_many([searches[k].pose for k in solved], reached)
    of_solved = zip(q, reached, errors, manipulability(robot, q).tolist(), configurations(robot, q), strict=True)
    answers = {
        k: InverseKinematicsResult("solved", position, pose, *error, measure, configuration)
        for k, (position, pose, error, measure, configuration) in zip(solved, of_solved, strict=True)
    }
    return [answers.get(k) or _failure(search) for k, search in enumerate(searches)]


def _result(
    robot: Robot, pose: Pose, q: FloatArray, status: Status, joint: str | None = None, value: float | None = None
) -> InverseKinematicsResult:
    reached = tool_pose(robot, q)
    distance, angle = pose_errors(pose, reached)
    measure = float(manipulability(robot, q[None])[0])
    (configuration,) = configurations(robot, q[None])
    return InverseKinematicsResult(status, q, reached, distance, angle, measure, configuration, joint, value)
