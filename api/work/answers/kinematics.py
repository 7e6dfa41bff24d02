"""Answers about poses and waypoints, from the library's values.

Where the robot is checked against a scene or itself, a `checker` names the collisions at each joint position.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from api.work.answers.values import pose_answer
from planner.kinematics import configurations, forward_kinematics, manipulability, pose_errors
from planner.scene import collisions_at

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.kinematics import Configuration, FloatArray, InverseKinematicsResult, Pose
    from planner.problems.problem import AnyWaypoint
    from planner.robots import Robot
    from planner.scene import CollisionChecker
    from planner.waypoints.reachability import Reachability


def best_answer(result: InverseKinematicsResult, checker: CollisionChecker | None) -> dict[str, Any]:
    """Write the chosen solution of a pose, or the reason why there is none and the nearest pose."""
    if result.status != "solved":
        return _unsolved(result, checker)
    errors = result.position_error, result.orientation_error
    solution = _solution(result.position, errors, result.manipulability, result.configuration)
    return {"status": "solved", "solutions": [solution | _collisions(checker, result.position[None])[0]]}


def all_answer(
    robot: Robot,
    pose: Pose,
    found: tuple[FloatArray, ...] | InverseKinematicsResult,
    checker: CollisionChecker | None,
) -> dict[str, Any]:
    """Write all solutions of a pose, or why there is none and how near the robot gets."""
    if not isinstance(found, tuple):
        return _unsolved(found, checker)
    positions = np.array(found)
    errors = [pose_errors(pose, there) for there in forward_kinematics(robot, positions)]
    measures = manipulability(robot, positions).tolist()
    names = configurations(robot, positions)
    collisions = _collisions(checker, positions)
    solutions = map(_solution, found, errors, measures, names)
    return {"status": "solved", "solutions": [one | more for one, more in zip(solutions, collisions, strict=True)]}


def _solution(
    position: FloatArray, errors: tuple[float, float | None], measure: float, configuration: Configuration
) -> dict[str, Any]:
    """Write a joint position with the error of the tool, the manipulability and the configuration."""
    distance, angle = errors
    return {
        "position": position,
        "position_error": distance,
        "orientation_error": angle,
        "manipulability": measure,
        "configuration": vars(configuration),
    }


def _unsolved(result: InverseKinematicsResult, checker: CollisionChecker | None) -> dict[str, Any]:
    nearest = nearest_answer(result) | _collisions(checker, result.position[None])[0]
    return {"status": result.status, "solutions": [], "nearest": nearest}


def _collisions(checker: CollisionChecker | None, positions: FloatArray) -> list[dict[str, Any]]:
    """Write the collisions at joint positions (N, joints), if a checker is given."""
    if checker is None:
        return [{}] * len(positions)
    found = collisions_at(checker, positions)
    return [{"collision": None if collision is None else vars(collision)} for collision in found]


def nearest_answer(result: InverseKinematicsResult) -> dict[str, Any]:
    """Write the nearest that the robot gets to a pose that it cannot reach."""
    return {
        "position": result.position,
        "pose": pose_answer(result.pose),
        "position_error": result.position_error,
        "orientation_error": result.orientation_error,
    }


def reachability_answer(waypoints: Sequence[AnyWaypoint], found: Sequence[Reachability]) -> dict[str, Any]:
    """Write which waypoints can be reached, and whether free of collisions, if requested."""
    held = found[0].free is not None
    free = {"free": all(waypoint.free for waypoint in found)} if held else {}
    return {
        "reachable": all(waypoint.error is None for waypoint in found),
        **free,
        "waypoints": [
            {"index": index, "name": waypoint.name} | _reachability(reached)
            for index, (waypoint, reached) in enumerate(zip(waypoints, found, strict=True))
        ],
    }


def _reachability(found: Reachability) -> dict[str, Any]:
    hindered_by = [vars(collision) for collision in found.hindered_by]
    free = {"free": found.free, "free_solutions": found.free_solutions, "hindered_by": hindered_by}
    answer: dict[str, Any] = {
        "status": "reachable" if found.error is None else found.error.code,
        "detail": None if found.error is None else found.error.message,
        "solutions": found.solutions,
        **({} if found.free is None else free),
        "limit_margin": None if found.limit_margin is None else found.limit_margin._asdict(),
        "manipulability": found.manipulability,
    }
    return answer if found.nearest is None else answer | {"nearest": nearest_answer(found.nearest)}
