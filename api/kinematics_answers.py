"""What the library found out about poses and waypoints becomes what is answered about them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from api.answers import pose_answer
from planner.kinematics import configurations, forward_kinematics, manipulability, pose_errors

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.kinematics import Configuration, FloatArray, InverseKinematicsResult, Pose
    from planner.problem import AnyWaypoint
    from planner.robots import Robot
    from planner.waypoints.reachability import Reachability


def best_answer(result: InverseKinematicsResult) -> dict[str, Any]:
    """Write the solution of a pose that the library chose, or why there is none and how near the robot gets."""
    if result.status != "solved":
        return _unsolved(result)
    errors = result.position_error, result.orientation_error
    solution = _solution(result.position, errors, result.manipulability, result.configuration)
    return {"status": "solved", "solutions": [solution]}


def all_answer(robot: Robot, pose: Pose, found: tuple[FloatArray, ...] | InverseKinematicsResult) -> dict[str, Any]:
    """Write all solutions of a pose, or why there is none and how near the robot gets."""
    if not isinstance(found, tuple):
        return _unsolved(found)
    positions = np.array(found)
    errors = [pose_errors(pose, there) for there in forward_kinematics(robot, positions)]
    measures = manipulability(robot, positions).tolist()
    names = configurations(robot, positions)
    return {"status": "solved", "solutions": [*map(_solution, found, errors, measures, names)]}


def _solution(
    position: FloatArray, errors: tuple[float, float | None], measure: float, configuration: Configuration
) -> dict[str, Any]:
    """Write a joint position, by how much the tool misses the pose there, how well it can move, its configuration."""
    distance, angle = errors
    return {
        "position": position,
        "position_error": distance,
        "orientation_error": angle,
        "manipulability": measure,
        "configuration": vars(configuration),
    }


def _unsolved(result: InverseKinematicsResult) -> dict[str, Any]:
    return {"status": result.status, "solutions": [], "nearest": nearest_answer(result)}


def nearest_answer(result: InverseKinematicsResult) -> dict[str, Any]:
    """Write the nearest that the robot gets to a pose that it cannot reach."""
    return {
        "position": result.position,
        "pose": pose_answer(result.pose),
        "position_error": result.position_error,
        "orientation_error": result.orientation_error,
    }


def reachability_answer(waypoints: Sequence[AnyWaypoint], found: Sequence[Reachability]) -> dict[str, Any]:
    """Write which waypoints can be reached."""
    return {
        "reachable": all(waypoint.error is None for waypoint in found),
        "waypoints": [
            {"index": index, "name": waypoint.name} | _reachability(reached)
            for index, (waypoint, reached) in enumerate(zip(waypoints, found, strict=True))
        ],
    }


def _reachability(found: Reachability) -> dict[str, Any]:
    answer: dict[str, Any] = {
        "status": "reachable" if found.error is None else found.error.code,
        "detail": None if found.error is None else found.error.message,
        "solutions": found.solutions,
        "limit_margin": None if found.limit_margin is None else found.limit_margin._asdict(),
        "manipulability": found.manipulability,
    }
    return answer if found.nearest is None else answer | {"nearest": nearest_answer(found.nearest)}
