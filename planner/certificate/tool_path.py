"""The check of the tool's path: it keeps to its lines and circles, and near the corners that it cuts.

The poses of the tool are sampled. With the paths this check shares forward kinematics, which have tests against other
implementations; the geometry of lines, circles and corners is its own. That of polylines and splines is shared, too: it
has tests against splines of scipy and closed forms.
"""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planner.certificate.checks import Check
from planner.certificate.goal_regions import misses_of_region
from planner.certificate.lines_and_circles import Circle, Line, angles_of
from planner.certificate.on_curve import parameters_on
from planner.dynamics import SegmentDynamics
from planner.kinematics.forward import tool_poses_on
from planner.problems.problem import CartesianMotion, CircularMotion, JointMotion
from planner.problems.regions import region_of
from planner.problems.transitions import BlendTransition
from planner.spatial import rotation_vectors
from planner.tool_motions.polylines import Polyline
from planner.tool_motions.pose_splines import PoseSpline

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.certificate.waypoints import Target
    from planner.problems.problem import AnyWaypoint
    from planner.robots import Robot
    from planner.spatial import FloatArray, Pose
    from planner.trajectories.trajectory import Trajectory
    from planner.waypoints.solve import SolvedWaypoint

STEPS = 2
"""Number of Gauss-Newton steps towards the nearest point on a path."""

AHEAD = 1e-4
"""Step of the difference quotients for that, as a share of the path."""

FIRST_SAMPLES = np.array([0.25, 0.5, 0.75])
"""Unit times on each piece at which it is looked at first: the error of a quintic is largest in the middle."""

SAMPLES = np.linspace(0.0, 1.0, 9)
"""Unit times at which pieces are looked at that may have the worst deviation."""

NEAR_WORST = 0.25
"""Fraction of the largest deviation found first above which a piece may have the largest one.

Within a piece a deviation is smooth, and its value at an end is also its value on the next piece.
"""

WORTH_A_LOOK = 1e-3
"""Fraction of the allowed deviation below which a first result is final; four times as much is still small."""


class _Deviation(NamedTuple):
    """The deviation of a sample from the requested path.

    Attributes:
        quantity: Name of the check that it belongs to.
        value: The deviation, m or rad.
        limit: The largest deviation allowed, m or rad.
        time: The time of the sample, s.
    """

    quantity: str
    value: float
    limit: float
    time: float


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
        known = worst.get(deviation.quantity)
        if known is None or deviation.value / deviation.limit > known.value / known.limit:
            worst[deviation.quantity] = deviation
    return [
        Check(
            quantity=quantity,
            joint=None,
            peak=deviation.value,
            limit=deviation.limit,
            ratio=deviation.value / deviation.limit,
            time=deviation.time,
            method="sampled",
            enforced=True,
            bounded=True,
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
        yield _worst("blend_deviation", np.linalg.norm(tools - centers[blended], axis=1), radii[blended], times)
    tolerances = _tolerances(waypoints)
    changes = zip(targets, robots, robots[1:], strict=False)
    starts = [target.seen_with(robot, other).start for target, robot, other in changes]

    def sampled(pieces: np.ndarray, units: FloatArray) -> _Samples:
        """Return the samples of pieces, but for those within the radius of a blend."""
        samples = _samples(trajectory, on_segments, pieces, units)
        kept = np.ones(len(samples.times), dtype=bool)
        for end in (samples.segments, samples.segments + 1):
            kept &= np.linalg.norm(samples.positions - centers[end], axis=1) > radii[end]
        return _Samples(*(part[kept] for part in samples))

    kinds: dict[tuple[type, bool], dict[int, Line | Circle]] = {}
    for segment in with_tool:
        pieces = np.flatnonzero(trajectory.segments == segment)
        motion, asked = solved[segment + 1].tool_motion, waypoints[segment + 1].motion
        free = asked.free if isinstance(asked, CartesianMotion) else None
        if motion and (free or isinstance(motion.path, Polyline | PoseSpline)):
            of_curve = sampled(pieces, SAMPLES)
            if len(of_curve.times):
                u = parameters_on(motion.curve, of_curve.joints)
                if isinstance(motion.path, Polyline | PoseSpline):
                    points, axes = motion.path.poses(u)
                else:
                    path = _path(waypoints[segment + 1], starts[segment], targets[segment + 1].pose)
                    points, axes = _of_samples([path], np.zeros(len(u), dtype=int)).poses(u)
                allowed = np.broadcast_to(tolerances[segment + 1], (len(u), 2))
                if free and axes is not None:
                    region, reached = region_of(free), (of_curve.positions, of_curve.rotations)
                    yield from _path_deviations(
                        *misses_of_region(region, points, axes, *reached), allowed, of_curve.times
                    )
                else:
                    found = _misses(points, axes, of_curve.positions, of_curve.rotations)
                    yield from _path_deviations(*found, allowed, of_curve.times)
        elif len(pieces):
            path = _path(waypoints[segment + 1], starts[segment], targets[segment + 1].pose)
            kinds.setdefault((type(path), path.start is None), {})[segment] = path
    for paths in kinds.values():
        pieces = np.flatnonzero(np.isin(trajectory.segments, list(paths)))
        for units in (FIRST_SAMPLES, SAMPLES):
            samples = sampled(pieces, units)
            if not len(samples.times):
                break
            path = _of_samples(list(paths.values()), np.searchsorted(list(paths), samples.segments))
            allowed = tolerances[samples.segments + 1]
            found = _distances(path, samples.positions, samples.rotations, allowed)
            yield from _path_deviations(*found, allowed, samples.times)
            pieces = np.unique(samples.pieces[_near_worst(found, allowed)])
            if not len(pieces):
                break


def _near_worst(found: tuple[FloatArray, FloatArray | None], allowed: FloatArray) -> np.ndarray:
    """Return which samples (N,) are near the largest ratio of distance or angle to the allowed one (N, 2)."""
    near = np.zeros(len(allowed), dtype=bool)
    for values, limits in zip(found, allowed.T, strict=True):
        if values is not None:
            near |= values / limits >= max(NEAR_WORST * float((values / limits).max()), WORTH_A_LOOK)
    return near


def _path_deviations(
    distances: FloatArray, angles: FloatArray | None, allowed: FloatArray, times: FloatArray
) -> Iterator[_Deviation]:
    """Yield the largest ratio of distances (N,) and of angles (N,) to the allowed ones (N, 2), at times (N,)."""
    yield _worst("path_position_deviation", distances, allowed[:, 0], times)
    if angles is not None:
        yield _worst("path_orientation_deviation", angles, allowed[:, 1], times)


def _worst(quantity: str, values: FloatArray, limits: FloatArray, times: FloatArray) -> _Deviation:
    """Return the value (N,) that is largest by its limit (N,)."""
    worst = int(np.argmax(values / limits))
    return _Deviation(quantity, float(values[worst]), float(limits[worst]), float(times[worst]))


def _path(waypoint: AnyWaypoint, start: Pose, end: Pose) -> Line | Circle:
    """Return the requested line or circle to a waypoint, from its start to its end."""
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


class _Samples(NamedTuple):
    """Samples of a trajectory.

    Attributes:
        pieces: (N,), index of the piece of each.
        segments: (N,), its segment.
        times: (N,), s.
        joints: (N, joints), rad or m.
        positions: (N, 3), m, of the tool.
        rotations: (N, 3, 3), of the tool.
    """

    pieces: np.ndarray
    segments: np.ndarray
    times: FloatArray
    joints: FloatArray
    positions: FloatArray
    rotations: FloatArray


def _samples(trajectory: Trajectory, dynamics: SegmentDynamics, pieces: np.ndarray, units: FloatArray) -> _Samples:
    """Sample pieces of a trajectory at unit times on each."""
    starts, lengths = trajectory.breakpoints[pieces], trajectory.lengths[pieces]
    times = (starts[:, None] + units * lengths[:, None]).ravel()
    own = np.repeat(pieces, len(units))
    joints = trajectory.evaluate(times, [0])[0]
    segments = trajectory.segments[own]
    return _Samples(own, segments, times, joints, *tool_poses_on(dynamics, segments, joints))


def _distances(
    path: Line | Circle, positions: FloatArray, rotations: FloatArray, tolerances: FloatArray
) -> tuple[FloatArray, FloatArray | None]:
    """Compute distances (N,), m, and angles (N,), rad, from the nearest points of paths, relative to tolerances.

    The Gauss-Newton method finds these points, starting from the points nearest in position.

    Args:
        path: The requested path at each sample.
        positions: Positions (N, 3) of the tool, m.
        rotations: Rotations (N, 3, 3) of the tool.
        tolerances: Tolerances (N, 2), m and rad.
    """

    def missed(u: FloatArray) -> FloatArray:
        """Return the tool's deviations (N, 3 or 6) from the path at fractions (N,), relative to their tolerances."""
        position, rotation = path.poses(u)
        parts = [(position - positions) / tolerances[:, :1]]
        if rotation is not None:
            parts.append(rotation_vectors(rotation.transpose(0, 2, 1) @ rotations) / tolerances[:, 1:])
        return np.hstack(parts)

    u = path.nearest(positions)
    for _ in range(STEPS):
        here, ahead = missed(u), missed(u + AHEAD)
        slope = (ahead - here) / AHEAD
        squared = (slope**2).sum(axis=1)
        step = (slope * here).sum(axis=1) / np.where(squared > 0.0, squared, 1.0)
        u = np.where(squared > 0.0, np.clip(u - step, 0.0, 1.0), u)
    return _misses(*path.poses(u), positions, rotations)


def _misses(
    asked: FloatArray, turned: FloatArray | None, positions: FloatArray, rotations: FloatArray
) -> tuple[FloatArray, FloatArray | None]:
    """Return distances (N,), m, and angles (N,), rad, of the tool from requested positions and rotations."""
    distances: FloatArray = np.linalg.norm(asked - positions, axis=1)
    return distances, None if turned is None else angles_of(turned.transpose(0, 2, 1) @ rotations)


def _of_samples(paths: Sequence[Line | Circle], rows: np.ndarray) -> Line | Circle:
    """Return the path of each sample (N,), of paths of one kind, all with rotations or all without."""

    def stacked(name: str) -> Any:
        values = [getattr(path, name) for path in paths]
        return None if values[0] is None else np.array(values)[rows]

    return type(paths[0])(*(stacked(field.name) for field in fields(paths[0])))
