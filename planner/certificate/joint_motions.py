"""Checks of the deviation of tool and joints from straight joint motions, for back ends that may leave them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from planner.certificate.checks import Check
from planner.certificate.path_bounds import bound_deviations
from planner.certificate.path_parts import polynomial_parts
from planner.dynamics import SegmentDynamics
from planner.guarantees import LeavesStraightMotions
from planner.kinematics.forward import tool_poses
from planner.problems.problem import AnyWaypoint, JointMotion
from planner.problems.rides import RideMotion
from planner.problems.transitions import StopTransition
from planner.spatial import FloatArray
from planner.tool_motions.pose_paths import ONE_PIECE
from planner.trajectories.extrema import UnitPolynomials, derivatives_on_unit_time, largest_magnitudes
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.trajectories.trajectory import Trajectory

TOOL_DEVIATION = "tool_deviation"
"""The quantity of the check of the tool."""

JOINT_DEVIATION = "joint_deviation"
"""The quantity of the check of the joints."""

UNLIMITED_SCALE = 1.0
"""Distance, m, by which a deviation without a limit counts."""

NO_SPHERES = np.zeros((1, 2, 4))
"""No spheres in which the tool may leave its path, for one path."""


class _Distance(NamedTuple):
    """A largest distance: its values as in `Check`.

    Attributes:
        peak: m or rad.
        time: s.
        method: How it was found.
        lower: A distance that is reached, if the method is `bounded`.
    """

    peak: float
    time: float
    method: Literal["exact", "bounded"]
    lower: float | None


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
        motion = waypoints[segment + 1].motion
        if not isinstance(motion, JointMotion) or isinstance(motion, RideMotion):
            continue
        robot = dynamics.robot_on(segment)
        start, end = positions[segment : segment + 2]
        stops = not (passed[segment] or passed[segment + 1])
        found = _farthest_tool(trajectory, dynamics, segment, (start, end), allowed.max_deviation)
        of_tool.append(_check(TOOL_DEVIATION, None, found, allowed.max_deviation, stops))
        pieces = trajectory.segments == segment
        away, since, farthest = farthest_joint(trajectory.of(pieces), start, end)
        time = float(trajectory.breakpoints[pieces.argmax()]) + since
        joint, found = robot.joint_names[farthest], _Distance(away, time, "exact", None)
        of_joints.append(_check(JOINT_DEVIATION, joint, found, allowed.max_joint_deviation, stops))
    return [
        max(checks, key=lambda check: (check.enforced and not check.satisfied, check.peak))
        for checks in (of_tool, of_joints)
        if checks
    ]


def farthest_joint(motion: PiecewisePolynomial, start: FloatArray, end: FloatArray) -> tuple[float, float, int]:
    """Find the largest distance of any joint from the straight motion between two joint positions, exactly.

    Let r be the joint position less `start`, and d the straight motion. A distance is enough if for each joint some u
    from 0 to 1 has |r_i - u d_i| within it. These u are an interval for each joint, and intervals have a common point
    if any two of them have one (Helly's theorem). So the distance is the largest of |r_i d_j - r_j d_i| / (|d_i| +
    |d_j|) for two joints, and of the distances of r_i from the range of u d_i for one joint: polynomials of time.

    Args:
        motion: Joint positions by time.
        start: (joints,), rad or m.
        end: (joints,), another joint position, rad or m.

    Returns:
        The distance, rad or m, its time since the start of the motion, s, and the index of the joint.
    """
    way = end - start
    size, moving, fixed = np.abs(way), np.flatnonzero(way), np.flatnonzero(way == 0.0)
    one = np.eye(len(way))
    first, second = moving[np.column_stack(np.triu_indices(len(moving), 1))].T
    pairs = (one[first] * way[second, None] - one[second] * way[first, None]) / (size[first] + size[second])[:, None]
    ahead = one[moving] * np.sign(way[moving])[:, None]
    rows = np.concatenate([pairs, one[fixed], -ahead, ahead])
    beyond = np.zeros(len(rows))
    beyond[len(rows) - len(moving) :] = size[moving]
    positions = derivatives_on_unit_time(motion, 1)[0].minus(start)
    distances = UnitPolynomials(rows @ positions.coefficients, rows @ positions.bernstein).minus(beyond)
    # Before the start and beyond the end only positive values are distances.
    directions = np.ones((2, *distances.bernstein.shape[:2]))
    directions[0, :, len(rows) - 2 * len(moving) :] = 0.0
    found = largest_magnitudes(distances, directions[1], np.zeros(len(motion.lengths), dtype=int), directions)
    piece, row, unit = int(found.pieces[0]), int(found.joints[0]), float(found.units[0])
    time = float(motion.breakpoints[piece] + unit * motion.lengths[piece])
    joint = int(np.concatenate([first, fixed, moving, moving])[row])
    is_distance = directions[0, 0, row] or found.values[0] > 0.0
    return abs(float(found.values[0])) if is_distance else 0.0, time, joint


def _farthest_tool(
    trajectory: Trajectory,
    dynamics: SegmentDynamics,
    segment: int,
    ends: tuple[FloatArray, FloatArray],
    limit: float | None,
) -> _Distance:
    """Bound the distance of the tool from its path on the straight motion between two joint positions (joints,)."""
    robot, (start, end) = dynamics.robot_on(segment), ends

    def poses(u: FloatArray) -> tuple[FloatArray, None]:
        """Return the tool's positions (N, 3), m, at fractions (N,) of the straight motion."""
        return tool_poses(robot, start + u[:, None] * (end - start))[0], None

    path = {segment: polynomial_parts(poses, ONE_PIECE)}
    allowed = np.array([[UNLIMITED_SCALE if limit is None else limit, np.inf]])
    found, _ = bound_deviations(trajectory, dynamics, path, allowed, NO_SPHERES)
    assert found is not None  # noqa: S101 - a finite distance is allowed
    return _Distance(found.peak, found.time, "bounded", found.lower)


def _check(quantity: str, joint: str | None, found: _Distance, limit: float | None, stops: bool) -> Check:
    """Return the check of a segment from its largest distance; enforced from stop to stop only."""
    return Check(
        quantity=quantity,
        joint=joint,
        peak=found.peak,
        limit=limit,
        ratio=None if limit is None else found.peak / limit,
        time=found.time,
        method=found.method,
        enforced=stops,
        bounded=True,
        lower=found.lower,
    )
