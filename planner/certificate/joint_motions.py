"""Checks of the deviation of tool and joints from straight joint motions, for back ends that may leave them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.certificate.checks import Check
from planner.problems.problem import JointMotion
from planner.problems.transitions import StopTransition
from planner.tool_motions.path_distances import CHORDS, farthest_from_path, joints_farthest_from_path

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.dynamics import SegmentDynamics
    from planner.guarantees import LeavesStraightMotions
    from planner.problems.problem import AnyWaypoint
    from planner.spatial import FloatArray
    from planner.trajectories.trajectory import Trajectory

TOOL_DEVIATION = "tool_deviation"
"""The quantity of the check of the tool."""

JOINT_DEVIATION = "joint_deviation"
"""The quantity of the check of the joints."""


def certify_joint_motions(
    trajectory: Trajectory,
    dynamics: SegmentDynamics,
    waypoints: Sequence[AnyWaypoint],
    positions: FloatArray,
    allowed: LeavesStraightMotions,
) -> list[Check]:
    """Find the largest distances of the tool and of the joints from straight joint motions.

    The distance of two joint positions is the largest of any joint. The distance from a motion is the distance from its
    nearest joint position. The limits are enforced from stop to stop: at a passed waypoint, any smooth motion leaves
    the straight ones.

    Args:
        trajectory: The trajectory to be checked.
        dynamics: The robot with its tool on each segment.
        waypoints: The requested waypoints.
        positions: (waypoints, joints), their joint positions, rad or m.
        allowed: The largest distances that are allowed.

    Returns:
        The checks of the tool and of the joints on their worst segments; none if there is no joint motion.
    """
    of_tool, of_joints = [], []
    passed = [not isinstance(waypoint.transition, StopTransition) for waypoint in waypoints]
    for segment in np.flatnonzero(np.diff(positions, axis=0).any(axis=1)).tolist():
        if not isinstance(waypoints[segment + 1].motion, JointMotion):
            continue
        robot = dynamics.robot_on(segment)
        first, last = float(trajectory.departures[segment]), float(trajectory.arrivals[segment + 1])
        straight = np.linspace(positions[segment], positions[segment + 1], CHORDS + 1)
        stops = not (passed[segment] or passed[segment + 1])
        found = farthest_from_path(robot, trajectory, first, last, straight)
        of_tool.append(_check(TOOL_DEVIATION, None, found, allowed.max_deviation, stops))
        found = joints_farthest_from_path(trajectory, first, last, straight)
        away = np.abs(trajectory.evaluate(np.array([found[1]]), [0])[0] - straight)
        joint = robot.joint_names[int(away[away.max(axis=1).argmin()].argmax())]
        of_joints.append(_check(JOINT_DEVIATION, joint, found, allowed.max_joint_deviation, stops))
    return [
        max(checks, key=lambda check: (check.enforced and not check.satisfied, check.peak))
        for checks in (of_tool, of_joints)
        if checks
    ]


def _check(quantity: str, joint: str | None, found: tuple[float, float], limit: float | None, stops: bool) -> Check:
    """Return the check of a segment from its largest distance and time; enforced from stop to stop only."""
    away, time = found
    return Check(
        quantity=quantity,
        joint=joint,
        peak=away,
        limit=limit,
        ratio=None if limit is None else away / limit,
        time=time,
        method="sampled",
        enforced=stops,
        bounded=True,
    )
