"""The check of the tool's path: it keeps to its lines and circles, and near the corners that it cuts.

Deviations are bounded at all times. In a tolerance region, the path consists of the poses of the region nearest to the
motion. Forward kinematics are shared with the paths, and have tests against other implementations. So is the geometry
of polylines and splines, which has tests against splines of scipy and closed forms.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Literal, NamedTuple

import numpy as np

from planner.certificate.checks import Check
from planner.certificate.goal_regions import nearest_in_region
from planner.certificate.lines_and_circles import Circle, Line
from planner.certificate.path_bounds import bound_deviations
from planner.certificate.path_parts import PathParts, polynomial_parts
from planner.certificate.waypoints import Target
from planner.dynamics import SegmentDynamics
from planner.kinematics.forward import tool_poses, tool_poses_on
from planner.problems.problem import AnyWaypoint, CartesianMotion, CircularMotion, JointMotion
from planner.problems.regions import Region, region_of
from planner.problems.transitions import BlendTransition
from planner.robots import Robot
from planner.spatial import FloatArray, Pose
from planner.tool_motions.polylines import Polyline
from planner.tool_motions.pose_splines import PoseSpline
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.trajectories.trajectory import Trajectory
from planner.waypoints.solve import SolvedWaypoint

PATH_DEVIATIONS = ("path_position_deviation", "path_orientation_deviation")
"""The quantities of deviations from paths, in m and rad."""


class _Deviation(NamedTuple):
    """The largest deviation from some requested paths.

    Attributes:
        quantity: Name of the check that it belongs to.
        value: The deviation, m or rad.
        limit: The largest deviation allowed, m or rad.
        time: The time of the deviation, s.
        method: How it was found, as in `Check`.
        lower: A deviation that is reached at that time, if `value` is a bound at all times; None: another method.
    """

    quantity: str
    value: float
    limit: float
    time: float
    method: Literal["exact", "bounded"]
    lower: float | None = None


def certify_tool_path(
    trajectory: Trajectory,
    robots: Sequence[Robot],
    waypoints: Sequence[AnyWaypoint],
    solved: Sequence[SolvedWaypoint],
    targets: Sequence[Target],
) -> list[Check]:
    """Find the largest deviations from the requested lines and circles, and the largest distances from blended corners.

    Within the radius of a blend the tool may leave its line or circle. At the middle of the blend, where it passes the
    waypoint, it must be within the radius.

    Args:
        trajectory: The trajectory to be checked.
        robots: The robot with the tool of each waypoint.
        waypoints: The requested waypoints.
        solved: The solved waypoints, with the curves that their motions follow.
        targets: The request's targets of the tool at the waypoints.
    """
    worst: dict[str, _Deviation] = {}
    for deviation in _deviations(trajectory, robots, waypoints, solved, targets):
        known = worst.setdefault(deviation.quantity, deviation)
        worst[deviation.quantity] = max(known, deviation, key=lambda each: each.value / each.limit)
    return [
        Check(
            quantity=quantity,
            joint=None,
            peak=deviation.value,
            limit=deviation.limit,
            ratio=deviation.value / deviation.limit,
            time=deviation.time,
            method=deviation.method,
            enforced=True,
            bounded=True,
            lower=deviation.lower,
        )
        for quantity, deviation in sorted(worst.items(), reverse=True)
    ]


def _deviations(
    trajectory: Trajectory,
    robots: Sequence[Robot],
    waypoints: Sequence[AnyWaypoint],
    solved: Sequence[SolvedWaypoint],
    targets: Sequence[Target],
) -> Iterator[_Deviation]:
    """Give worst of each kind: near blended waypoints, and along all lines and all circles, with and without turns."""
    with_tool = [k - 1 for k, waypoint in enumerate(waypoints) if k and not isinstance(waypoint.motion, JointMotion)]
    if not (with_tool or any(isinstance(waypoint.transition, BlendTransition) for waypoint in waypoints)):
        return
    on_segments = SegmentDynamics.of_robots([*(robots[1:] or robots), robots[-1]])
    centers = np.array([target.pose.position for target in targets])
    radii = np.array([w.transition.radius if isinstance(w.transition, BlendTransition) else -1.0 for w in waypoints])
    blended = np.flatnonzero(radii > 0.0)
    if len(blended):
        times = trajectory.arrivals[blended]
        tools = tool_poses_on(on_segments, blended, trajectory.evaluate(times, [0])[0])[0]
        away = np.linalg.norm(tools - centers[blended], axis=1)
        worst = int(np.argmax(away / radii[blended]))
        value, limit, time = (float(part[worst]) for part in (away, radii[blended], times))
        yield _Deviation("blend_deviation", value, limit, time, "exact")
    tolerances = _tolerances(waypoints)
    paths = requested_paths(robots, waypoints, solved, targets)
    bounded: dict[int, PathParts] = {}
    in_regions: set[int] = set()
    for segment, path in paths.items():
        pieces = np.flatnonzero(trajectory.segments == segment)
        motion, requested = solved[segment + 1].tool_motion, waypoints[segment + 1].motion
        free = requested.free if isinstance(requested, CartesianMotion) else None
        if motion and free and len(pieces):
            nearest = partial(nearest_poses, region_of(free), path, motion.curve, on_segments.robot_on(segment))
            bounded[segment] = polynomial_parts(nearest, motion.curve.breakpoints)
            in_regions.add(segment)
        elif len(pieces):
            bounded[segment] = _parts(path)
    if not bounded:
        return
    segments = np.array(list(bounded))
    allowed = tolerances[segments + 1].copy()
    allowed[[not path.has_rotations for path in bounded.values()], 1] = np.inf
    left_out = np.column_stack([centers, radii])[segments[:, None] + [0, 1]]
    for quantity, found in zip(
        PATH_DEVIATIONS, bound_deviations(trajectory, on_segments, bounded, allowed, left_out), strict=True
    ):
        if found and found.peak > 0.0:  # otherwise the tool may leave its path at all times
            segment = int(trajectory.segments[trajectory.locate(np.array([found.time]))[0][0]])
            # From a tolerance region, the tool may be nearer than from the pose in it that was chosen.
            lower = 0.0 if segment in in_regions else found.lower
            yield _Deviation(quantity, found.peak, found.limit, found.time, "bounded", lower)


def nearest_poses(
    region: Region, path: Line | Circle | Polyline | PoseSpline, curve: PiecewisePolynomial, robot: Robot, u: FloatArray
) -> tuple[FloatArray, FloatArray | None]:
    """Return the poses in the tolerance region of a path nearest to the tool at parameters (N,) of a curve.

    Args:
        region: The tolerance region.
        path: The requested path.
        curve: The joint positions that the motion follows.
        robot: The robot with its tool.
        u: Parameters of the curve and of the path.
    """
    points, axes = path.poses(u)
    if axes is None:
        return points, None
    return nearest_in_region(region, points, axes, *tool_poses(robot, curve.evaluate(u, [0])[0]))


def _parts(path: Line | Circle | Polyline | PoseSpline) -> PathParts:
    """Return the parts of a path for bounds on the deviation from it, whatever the speed along it."""
    if isinstance(path, Polyline):
        return polynomial_parts(path.poses, path.breakpoints)
    if isinstance(path, PoseSpline):
        return polynomial_parts(path.poses_on_curve, path.curve.breakpoints)
    return path.parts


def requested_paths(
    robots: Sequence[Robot],
    waypoints: Sequence[AnyWaypoint],
    solved: Sequence[SolvedWaypoint],
    targets: Sequence[Target],
) -> dict[int, Line | Circle | Polyline | PoseSpline]:
    """Return the requested path of the tool on each segment that has one; see `certify_tool_path`."""
    changes = enumerate(zip(targets, robots, robots[1:], strict=False))
    return {
        k: _path(solved[k + 1], waypoints[k + 1], target.seen_with(robot, other).start, targets[k + 1].pose)
        for k, (target, robot, other) in changes
        if not isinstance(waypoints[k + 1].motion, JointMotion)
    }


def _path(
    solved: SolvedWaypoint, waypoint: AnyWaypoint, start: Pose, end: Pose
) -> Line | Circle | Polyline | PoseSpline:
    """Return the requested path to a waypoint, from its start to its end."""
    if solved.tool_motion and isinstance(solved.tool_motion.path, Polyline | PoseSpline):
        return solved.tool_motion.path
    if isinstance(waypoint.motion, CircularMotion):
        return Circle.through(start, waypoint.motion.via, end)
    return Line.between(start, end)


def _tolerances(waypoints: Sequence[AnyWaypoint]) -> FloatArray:
    """Return the tolerances (waypoints, 2), m and rad, of the motion to each waypoint; infinite for a joint motion."""
    return np.array(
        [
            (waypoint.motion.tolerance_position, waypoint.motion.tolerance_orientation)
            if isinstance(waypoint.motion, CartesianMotion)
            else (np.inf, np.inf)
            for waypoint in waypoints
        ]
    )
