"""The check of how far the tool goes from straight joint motions, where a back end is free to leave them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.certificate.checks import Check
from planner.problem import JointMotion, StopTransition
from planner.tool_motions.ways import CHORDS, farthest_from_way

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.problem import AnyWaypoint
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.trajectory import Trajectory


TOOL_DEVIATION = "tool_deviation"
"""The quantity of this check."""


def certify_joint_motions(
    trajectory: Trajectory,
    robot: Robot,
    waypoints: Sequence[AnyWaypoint],
    positions: FloatArray,
    limit: float | None,
) -> list[Check]:
    """Find the largest distance of the tool from straight joint motions.

    The limit is enforced from stop to stop. Where a waypoint is passed, any smooth motion leaves the straight ones.

    Args:
        trajectory: The trajectory to be checked.
        robot: The robot, with its tool.
        waypoints: The waypoints as they are asked.
        positions: (waypoints, joints), their joint positions, rad or m.
        limit: The largest distance that is allowed, m; None: any.

    Returns:
        The check of the worst segment; none if there is no joint motion.
    """
    checks = []
    passed = [not isinstance(waypoint.transition, StopTransition) for waypoint in waypoints]
    for segment in np.flatnonzero(np.diff(positions, axis=0).any(axis=1)).tolist():
        if not isinstance(waypoints[segment + 1].motion, JointMotion):
            continue
        first, last = float(trajectory.departures[segment]), float(trajectory.arrivals[segment + 1])
        straight = np.linspace(positions[segment], positions[segment + 1], CHORDS + 1)
        away, time = farthest_from_way(robot, trajectory, first, last, straight)
        checks.append(
            Check(
                quantity=TOOL_DEVIATION,
                joint=None,
                peak=away,
                limit=limit,
                ratio=None if limit is None else away / limit,
                time=time,
                method="sampled",
                enforced=not (passed[segment] or passed[segment + 1]),
                bounded=True,
            )
        )
    return [max(checks, key=lambda check: (check.enforced and not check.satisfied, check.peak))] if checks else []
