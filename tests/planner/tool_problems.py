"""Waypoints of an arm under limits of the tool's accelerations and jerks: joint motions, and lines with a blend."""

from __future__ import annotations

from planner.problems.moves import CartesianMove
from planner.problems.problem import JointWaypoint, LinearMotion, RelativeWaypoint
from planner.problems.transitions import BlendTransition, ThroughTransition
from planner.robots import load_robot

ROBOT = load_robot("kuka_kr16_2")
START = (0.3, -1.2, 1.4, 0.2, 0.6, 0.1)
JOINTS = [
    JointWaypoint(START),
    JointWaypoint((0.8, -1.0, 1.1, 0.5, 0.4, -0.3), transition=ThroughTransition()),
    JointWaypoint((0.2, -0.7, 1.3, 0.1, 0.8, 0.2)),
]
LINE = [JointWaypoint(START), RelativeWaypoint(CartesianMove((0.0, -0.3, 0.0)), "base", motion=LinearMotion())]
CORNER = [
    JointWaypoint(START),
    RelativeWaypoint(CartesianMove((0.0, -0.3, 0.0)), "base", motion=LinearMotion(), transition=BlendTransition(0.1)),
    RelativeWaypoint(CartesianMove((0.0, 0.0, -0.3)), "base", motion=LinearMotion()),
]
