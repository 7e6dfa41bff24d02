"""What the library found out about poses and waypoints becomes what is answered about them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from api.answers import pose_answer
from planner.kinematics import forward_kinematics, manipulability, pose_errors

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.kinematics import FloatArray, InverseKinematicsResult, Pose
    from planner.problem import AnyWaypoint
    from planner.robots import Robot
    from planner.waypoints.reachability import Reachability


def solutions_answer(robot: Robot, pose: Pose, positions: Sequence[FloatArray]) -> list[dict[str, Any]]:
    """Joint positions that reach a pose, by how much the tool misses it, and how well it can move there."""
    reached = forward_kinematics(robot, np.array(positions))
    errors = [pose_errors(pose, there) for there in reached]
    measures = manipulability(robot, np.array(positions)).tolist()
    return [
        {
            "position": position,
            "position_error": distance,
            "orientation_error": angle,
            "manipulability": measure,
        }
        for position, (distance, angle), measure in zip(positions, errors, measures, strict=True)
    ]


def nearest_answer(result: InverseKinematicsResult) -> dict[str, Any]:
    """The nearest that the robot gets to a pose that it cannot reach."""
    return {
        "position": result.position,
        "pose": pose_answer(result.pose),
        "position_error": result.position_error,
        "orientation_error": result.orientation_error,
    }


def reachability_answer(waypoints: Sequence[AnyWaypoint], found: Sequence[Reachability]) -> dict[str, Any]:
    """The answer of which waypoints can be reached."""
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
