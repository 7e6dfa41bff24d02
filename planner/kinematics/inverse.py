"""Inverse kinematics: the solution nearest to a reference, all solutions, or the reason for having none.

In a scene, collision-free solutions come before all others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from planner.kinematics.configurations import Configuration, configurations
from planner.kinematics.forward import forward_kinematics, manipulability, tool_pose
from planner.kinematics.nearest import MANY_POSES, nearest_in_turn, nearest_solution
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import Search, errors_of_many, is_isolated, pose_errors, search_all, wide_spread
from planner.kinematics.turns import by_distance, nearest_turn
from planner.robots import Robot
from planner.spatial import FloatArray, Pose, as_pose

Status = Literal["solved", "unreachable_waypoint", "joint_position_limit"]

IsFree: TypeAlias = "Callable[[FloatArray], np.ndarray]"
"""Joint positions (N, joints) to whether the robot is proved to keep clear there (N,), bool."""


@dataclass(frozen=True, eq=False)
class InverseKinematicsResult:
    """The result of the inverse kinematics for one pose.

    Attributes:
        status: `solved`, or why not.
        position: (joints,), rad or m: the solution, or the joint position of the nearest pose found.
        pose: The tool's pose at `position`, by forward kinematics.
        position_error: Distance of `pose` from the requested pose, m.
        orientation_error: Angle between them, rad; None: the request has no orientation.
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
    is_free: IsFree | None = None,
) -> InverseKinematicsResult:
    """Solve for a joint position that brings the tool to `pose`; with a reference, for the one nearest to it.

    The distance is a time: the joints' distances divided by their velocity limits. `nearest_solution` describes the
    guarantee for each kind of arm. The answer is verified by forward kinematics and depends on nothing but the
    arguments.

    Args:
        robot: The robot, with its tool.
        pose: The tool's pose in the base frame; without a rotation, the position alone counts.
        options: Tolerances, reference and seed.
        reference: (joints,), rad or m; None: `options.reference`. Without either the first solution found is returned.
        is_free: Tells at which joint positions (N, joints) the robot keeps clear, see `planner.is_free`:
            the nearest of these solutions is returned, as long as one is found; of a continuum the nearest of a spread.
            None: nothing is known to be there.

    Returns:
        The solution; or why there is none, and the nearest pose found: look at its `status`.
    """
    search = Search(robot, as_pose(pose), options)
    reference = options.reference if reference is None else reference
    near = None if reference is None else np.asarray(reference, dtype=np.float64)
    return _answer(search, _nearest(search, near, is_free))


def inverse_kinematics_many(
    robot: Robot,
    poses: Sequence[Pose],
    options: InverseKinematicsOptions = InverseKinematicsOptions(),
    reference: ArrayLike | None = None,
    is_free: IsFree | None = None,
) -> list[InverseKinematicsResult]:
    """Solve a sequence of poses, each for the joint position nearest to that of the pose before it.

    The results equal `inverse_kinematics`, one pose after the other, each with the last solution as its reference. Of
    an arm with a closed form, many poses take a fraction of the time of as many calls.

    Args:
        robot: The robot, with its tool.
        poses: The tool's poses in the base frame; without a rotation, the position alone counts.
        options: Tolerances, reference and seed.
        reference: (joints,), of the first pose; None: `options.reference`. Without either the first solution found is
            the first answer.
        is_free: See `inverse_kinematics`.

    Returns:
        One result for each pose.
    """
    reference = options.reference if reference is None else reference
    near = None if reference is None else np.asarray(reference, dtype=np.float64)
    results: list[InverseKinematicsResult] = []
    if is_free is not None:
        for pose in poses:
            search = Search(robot, pose, options)
            solution = _nearest(search, near, is_free)
            results.append(_answer(search, solution))
            near = near if solution is None else solution
        return results
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
    is_free: IsFree | None = None,
) -> tuple[FloatArray, ...]:
    """Find all isolated solutions within the limits, nearest to the reference first; of a continuum, a spread of some.

    Configurations that differ by whole turns of joints count once, turned to lie nearest to the reference.

    Args:
        robot: The robot, with its tool.
        pose: The tool's pose in the base frame; without a rotation, the position alone counts.
        options: Tolerances, reference and seed.
        reference: (joints,), rad or m; None: `options.reference`, or the middle of the limits.
        is_free: Function that tells which joint positions (N, joints) are collision-free, see `inverse_kinematics`.
            These come first. If none of a continuum's first solutions is free, more are sought.

    Returns:
        The solutions, each (joints,), rad or m; none where the pose cannot be reached.
    """
    return _solutions(Search(robot, pose, options), None if reference is None else np.asarray(reference), is_free)


def solution_layers(
    robot: Robot, poses: Sequence[Pose], options: InverseKinematicsOptions, reference: FloatArray | None = None
) -> list[tuple[FloatArray, ...]]:
    """Find `all_solutions` of many poses at once, which is faster; of an unreachable one an empty tuple."""
    return _layers([Search(robot, pose, options) for pose in poses], reference)


def solutions_or_failure(
    robot: Robot,
    pose: Pose,
    options: InverseKinematicsOptions,
    reference: FloatArray | None = None,
    is_free: IsFree | None = None,
) -> tuple[FloatArray, ...] | InverseKinematicsResult:
    """Find `all_solutions`, or why there is none and the nearest pose found; one search does both."""
    search = Search(robot, pose, options)
    return _solutions(search, reference, is_free) or _failure(search)


def _solutions(search: Search, reference: FloatArray | None, is_free: IsFree | None) -> tuple[FloatArray, ...]:
    (found,) = _layers([search], reference)
    if not found or is_free is None:
        return found
    return free_first(with_free_ones(search, found, is_free, reference), is_free)


def free_first(solutions: Sequence[FloatArray], is_free: IsFree) -> tuple[FloatArray, ...]:
    """Sort solutions (joints,): collision-free ones first, otherwise in the given order."""
    order = np.argsort(~is_free(np.array(solutions)), kind="stable")
    return tuple(solutions[k] for k in order.tolist())


def with_free_ones(
    search: Search, solutions: tuple[FloatArray, ...], is_free: IsFree, reference: FloatArray | None = None
) -> tuple[FloatArray, ...]:
    """Return all solutions (joints,) of a pose, with more of a continuum if none is collision-free."""
    robot = search.robot
    if is_free(np.array(solutions)).any() or is_isolated(robot, search.pose, solutions[0]):
        return solutions
    reference = _reference(search, reference)
    more = [nearest_turn(robot, q, reference) for q in wide_spread(search)]
    return tuple(by_distance(robot, [*solutions, *more], reference))


def _nearest(search: Search, reference: FloatArray | None, is_free: IsFree | None) -> FloatArray | None:
    """Return the solution nearest to the reference at which the robot keeps clear; where it does at none, the nearest.

    Without a reference the first solution found, or else the free one that is nearest to the middle of the limits.
    """
    nearest = search.first() if reference is None else nearest_solution(search, reference)
    if nearest is None or is_free is None or is_free(nearest[None])[0]:
        return nearest
    (found,) = _layers([search], reference)
    found = with_free_ones(search, found or (nearest,), is_free, reference)
    free = is_free(np.array(found))
    return found[int(free.argmax())] if free.any() else nearest


def _layers(searches: list[Search], reference: FloatArray | None) -> list[tuple[FloatArray, ...]]:
    if not searches:
        return []
    reference = _reference(searches[0], reference)
    return [tuple(by_distance(searches[0].robot, found, reference)) for found in search_all(searches, reference)]


def _reference(search: Search, reference: FloatArray | None) -> FloatArray:
    """Return the joint position that solutions are turned nearest to: (joints,), rad or m."""
    if reference is not None:
        return reference
    return search.robot.middle if search.options.reference is None else np.array(search.options.reference)


def _answer(search: Search, solution: FloatArray | None) -> InverseKinematicsResult:
    return _failure(search) if solution is None else _result(search.robot, search.pose, solution, "solved")


def _failure(search: Search) -> InverseKinematicsResult:
    """Build the result without a solution: the reason, and the nearest pose found."""
    robot, pose, beyond, nearest = search.robot, search.pose, search.beyond_the_limits(), search.nearest()
    if beyond is None:
        return _result(robot, pose, nearest, "unreachable_waypoint")
    joint = int(np.argmax(np.maximum(search.lower - beyond, beyond - search.upper)))
    return _result(robot, pose, nearest, "joint_position_limit", robot.joint_names[joint], float(beyond[joint]))


def _results(
    robot: Robot, searches: Sequence[Search], solutions: Sequence[FloatArray | None]
) -> list[InverseKinematicsResult]:
    """Build results with the poses, by Pinocchio's forward kinematics, and the manipulability of solutions."""
    solved = [k for k, solution in enumerate(solutions) if solution is not None]
    if len(solved) < MANY_POSES:
        return [_answer(search, solution) for search, solution in zip(searches, solutions, strict=True)]
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
