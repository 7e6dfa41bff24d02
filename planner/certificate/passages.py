"""The check of the velocities with which waypoints are asked to be passed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.certificate.checks import Check

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.spatial import FloatArray
    from planner.trajectories.trajectory import Trajectory

PASSING_VELOCITY = "passing_velocity_error"
"""The quantity of the check: how far a joint's velocity is from the one that is asked, rad/s or m/s."""

CLOSE_ENOUGH = 1e-6
"""Distance from an asked velocity, as a share of the largest of all joints there, that rounding may leave."""


def certify_passages(
    trajectory: Trajectory, joint_names: Sequence[str], passed_at: Mapping[int, FloatArray]
) -> list[Check]:
    """Hold the velocities at waypoints against those asked.

    Args:
        trajectory: The trajectory to be checked.
        joint_names: The names of its joints.
        passed_at: The velocities (joints,), rad/s or m/s, that are asked, by the segment that begins at the waypoint.

    Returns:
        The check of the joint and the waypoint that are farthest off; none if no velocity is asked.
    """
    if not passed_at:
        return []
    segments, asked = list(passed_at), np.array(list(passed_at.values()))
    times = trajectory.departures[segments]
    errors = np.abs(trajectory.evaluate(times, [1])[0] - asked)
    limits = CLOSE_ENOUGH * np.abs(asked).max(axis=1)
    row, joint = np.unravel_index(int((errors / limits[:, None]).argmax()), errors.shape)
    peak, limit = float(errors[row, joint]), float(limits[row])
    return [
        Check(
            quantity=PASSING_VELOCITY,
            joint=joint_names[int(joint)],
            peak=peak,
            limit=limit,
            ratio=peak / limit,
            time=float(times[row]),
            method="exact",
            enforced=True,
            bounded=True,
        )
    ]
