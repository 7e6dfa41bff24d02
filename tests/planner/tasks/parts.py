"""Parts of the tests of tasks: an arm, and waypoints over a table."""

from __future__ import annotations

import numpy as np

import planner

ROBOT = planner.load_robot("ur5e")
HOME = ROBOT.named_positions["home"]
LIMITS = ROBOT.limit("velocity"), ROBOT.limit("acceleration")
DOWN = np.diag([1.0, -1.0, -1.0])


def joint_waypoint(position: np.ndarray | tuple[float, ...]) -> planner.JointWaypoint:
    return planner.JointWaypoint(tuple(position))


def random_position(random: np.random.Generator) -> tuple[float, ...]:
    return tuple((np.array(HOME) + random.uniform(-1.0, 1.0, 6)).tolist())


def over_table(x: float, y: float, z: float = 0.1) -> planner.Pose:
    return planner.Pose(np.array([x, y, z]), DOWN)
