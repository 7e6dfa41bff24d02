"""The check that the trajectory meets every waypoint, with targets derived anew from the request.

It shares only forward kinematics and the request with the search for joint positions. It trusts no target, no choice
and no error of the search.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from planner.certificate.checks import Check
from planner.certificate.goal_regions import nearest_in_region
from planner.certificate.lines_and_circles import angles_of
from planner.kinematics.forward import tool_pose
from planner.kinematics.turns import TURN
from planner.problems.motion_around import as_requested
from planner.problems.problem import (
    AnyWaypoint,
    JointMotion,
    JointWaypoint,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
    ViaWaypoint,
)
from planner.problems.regions import Region, region_of
from planner.problems.transitions import BlendTransition
from planner.robots import Robot
from planner.spatial import FloatArray, Pose
from planner.tolerances import POSITION_TOLERANCE
from planner.trajectories.trajectory import Trajectory

PASSING_VELOCITY = "passing_velocity_error"
"""The quantity of the check: difference of a joint's velocity from the requested one, rad/s or m/s."""

CLOSE_ENOUGH = 1e-6
"""Rounding error of a requested velocity, relative to the largest of all joints there."""


@dataclass(frozen=True, eq=False)
class Target:
    """The target of the tool at one waypoint, by the request and the trajectory before it.

    Attributes:
        pose: The pose requested; of a region its nearest; without a rotation any orientation will do.
        start: The start pose of a motion or a relative waypoint: the requested pose, with its open coordinates as
            reached.
        tolerance: Largest deviation of the tool from it, m and rad.
        is_open: Whether something of the pose is left open.
    """

    pose: Pose
    start: Pose
    tolerance: tuple[float, float]
    is_open: bool

    def seen_with(self, robot: Robot, other: Robot) -> Target:
        """Return the target with the tool of `other` in place of that of `robot`."""
        if robot is other:
            return self
        shift = robot.tool_in_tip.actInv(other.tool_in_tip)

        def moved(pose: Pose, axes: FloatArray) -> Pose:
            rotation = None if pose.rotation is None else pose.rotation @ shift.rotation
            return Pose(pose.position + axes @ shift.translation, rotation)

        axes = _axes(self.start)
        distance, angle = self.tolerance
        far = distance + angle * float(np.linalg.norm(shift.translation))
        return Target(moved(self.pose, axes), moved(self.start, axes), (far, angle), self.is_open)


@dataclass(frozen=True, eq=False)
class MetWaypoints:
    """The waypoints of a problem compared with a trajectory.

    Attributes:
        targets: The target of the tool at each waypoint; None: the request has none.
        positions: (waypoints, joints), required joint positions at the arrivals, rad or m. NaN at blended waypoints and
            at pose waypoints, except for external axes that the request fixes.
        errors: The distance, m, and the angle, rad, from the target of each waypoint; None: no orientation is
            requested.
        checks: The worst of each kind.
    """

    targets: tuple[Target, ...]
    positions: FloatArray
    errors: tuple[tuple[float, float | None], ...]
    checks: tuple[Check, ...]


def certify_waypoints(
    trajectory: Trajectory, problem: PlanningProblem, corners: FloatArray, blended: Collection[int]
) -> MetWaypoints:
    """Compare the positions of a trajectory at the arrivals with the requested waypoints.

    A relative waypoint starts from the requested pose before it. Open coordinates of that pose count as reached; its
    tolerance then adds to the waypoint's own.

    Args:
        trajectory: The trajectory to be checked.
        problem: Its problem; waypoints fixed later count as requested.
        corners: Joint positions (waypoints, joints) of the waypoints, which count only where those are blended.
        blended: Indices of the waypoints that are not to be met.
    """
    met = trajectory.at_arrivals.copy()
    is_met = np.ones(len(met), dtype=bool)
    is_met[list(blended)] = False
    met[~is_met] = corners[~is_met]
    to_meet = np.full_like(met, np.nan)
    requested = [as_requested(waypoint) for waypoint in problem.waypoints]
    wanted, is_same = _requested_positions(problem, requested, met)
    names_tool = any(not isinstance(waypoint, JointWaypoint) for waypoint in requested) or any(
        isinstance(w.transition, BlendTransition) or not isinstance(w.motion, JointMotion) for w in problem.waypoints
    )
    targets: list[Target] = []
    errors: list[tuple[float, float | None]] = []
    checked: list[tuple[int, tuple[float, float | None], tuple[float, float]]] = []
    before: Target | None = None
    for k, (robot, waypoint) in enumerate(zip(problem.robots, requested, strict=True)):
        if is_met[k] and isinstance(waypoint, JointWaypoint):
            to_meet[k] = wanted[k]
        if is_same[k] and not names_tool:
            errors.append((0.0, 0.0))
            continue
        if before is not None:
            before = before.seen_with(problem.robots[k - 1], robot)
        options = problem.inverse_kinematics
        tolerance = options.tolerance_position, options.tolerance_orientation
        if isinstance(waypoint, JointWaypoint):
            target = _of_position(robot, wanted[k])
            error = (0.0, 0.0) if is_same[k] else _error(target.pose, tool_pose(robot, met[k]))
        else:
            reached = tool_pose(robot, met[k])
            region = region_of(waypoint.free) if isinstance(waypoint, PoseWaypoint) and waypoint.free else None
            if isinstance(waypoint, PoseWaypoint):
                target = _of_pose(waypoint.pose_in_base, region, reached, tolerance)
                for name, position in (waypoint.external or {}).items() if is_met[k] else ():
                    to_meet[k, robot.joint_names.index(name)] = position
            else:
                assert before is not None  # noqa: S101 - the check of the problem refuses a relative first waypoint
                target = _moved(before, waypoint, reached, tolerance)
            error = _error(target.pose, reached)
            checked += [(k, error, target.tolerance)] if is_met[k] else []
        targets.append(target)
        errors.append(error)
        # A corner of a way is nothing that the request has: a relative waypoint goes on from what it has before.
        before = before if isinstance(waypoint, ViaWaypoint) else target
    targets = targets if names_tool else []
    return MetWaypoints(tuple(targets), to_meet, tuple(errors), tuple(_checks(checked, trajectory.arrivals)))


def _axes(pose: Pose) -> FloatArray:
    assert pose.rotation is not None  # noqa: S101 - the start of a motion has one
    return pose.rotation


def _requested_positions(
    problem: PlanningProblem, requested: Sequence[AnyWaypoint], met: FloatArray
) -> tuple[FloatArray, np.ndarray]:
    """Return the requested joint positions (waypoints, joints), and whether (waypoints,) they are met.

    A requested position is within the limits, and as many turns away as the trajectory is. NaN: a waypoint is a pose.
    """
    robot, none = problem.robot, np.full(met.shape[1], np.nan)
    position = np.array([w.position if isinstance(w, JointWaypoint) else none for w in requested], dtype=np.float64)
    inside = position.clip(robot.limit("lower"), robot.limit("upper"))
    wanted = np.where(np.abs(position - inside) <= problem.start_tolerance, inside, position)
    wanted[1:] += TURN * np.where(robot.is_continuous, np.round((met[1:] - wanted[1:]) / TURN), 0.0)
    return wanted, np.asarray((np.abs(met - wanted) <= POSITION_TOLERANCE).all(axis=1))


def _of_position(robot: Robot, position: FloatArray) -> Target:
    """Return the target of a joint position (joints,)."""
    pose = tool_pose(robot, position)
    requested = Pose(pose.position) if robot.is_position_only else pose
    return Target(requested, pose, (0.0, 0.0), is_open=False)


def _of_pose(pose: Pose, region: Region | None, reached: Pose, tolerance: tuple[float, float]) -> Target:
    """Return the target of a pose, of which a region may be left open, where the tool is."""
    if region is not None:
        points, axes = nearest_in_region(
            region, pose.position[None], _axes(pose)[None], reached.position[None], _axes(reached)[None]
        )
        nearest = Pose(points[0], axes[0])
        return Target(nearest, nearest, tolerance, is_open=True)
    if pose.rotation is None:
        return Target(pose, Pose(pose.position, reached.rotation), tolerance, is_open=True)
    return Target(pose, pose, tolerance, is_open=False)


def _moved(before: Target, waypoint: RelativeWaypoint, reached: Pose, tolerance: tuple[float, float]) -> Target:
    """Return the target of a relative waypoint from the one before it, where the tool is."""
    turn, shift = waypoint.move.transform()
    position, rotation = before.start.position, before.pose.rotation
    rotation = _axes(before.start) if rotation is None and waypoint.turns_tool else rotation
    if waypoint.frame == "base":
        position, rotation = position + shift, None if rotation is None else turn @ rotation
    else:
        position = position + _axes(before.start) @ shift
        rotation = None if rotation is None else rotation @ turn
    pose = Pose(position, rotation)
    if before.is_open:
        distance, angle = before.tolerance
        tolerance = tolerance[0] + distance + angle * float(np.linalg.norm(shift)), tolerance[1] + angle
    start = pose if rotation is not None else Pose(position, reached.rotation)
    return Target(pose, start, tolerance, before.is_open)


def _error(pose: Pose, reached: Pose) -> tuple[float, float | None]:
    """Return the tool's distance, m, and angle, rad, from a pose; no angle without a requested orientation."""
    distance = float(np.linalg.norm(pose.position - reached.position))
    if pose.rotation is None:
        return distance, None
    return distance, float(angles_of((pose.rotation.T @ _axes(reached))[None])[0])


def _checks(
    checked: list[tuple[int, tuple[float, float | None], tuple[float, float]]], arrivals: FloatArray
) -> list[Check]:
    """Return the checks of the waypoints with the largest deviations, relative to the allowed ones."""
    found = []
    for column, quantity in enumerate(("waypoint_position_error", "waypoint_orientation_error")):
        known = [
            (value / allowed[column], k, value, allowed[column])
            for k, error, allowed in checked
            if (value := error[column]) is not None
        ]
        if known:
            ratio, k, peak, limit = max(known)
            time = float(arrivals[k])
            found.append(Check(quantity, None, peak, limit, ratio, time, "exact", enforced=True, bounded=True))
    return found


def certify_passages(
    trajectory: Trajectory, joint_names: Sequence[str], passed_at: Mapping[int, FloatArray]
) -> list[Check]:
    """Check the velocities at waypoints against the requested ones.

    Args:
        trajectory: The trajectory to be checked.
        joint_names: The names of its joints.
        passed_at: The requested velocities (joints,), rad/s or m/s, by the segment that begins at the waypoint.

    Returns:
        The check of the joint and waypoint with the largest deviation; none without a requested velocity.
    """
    if not passed_at:
        return []
    segments, requested = list(passed_at), np.array(list(passed_at.values()))
    times = trajectory.departures[segments]
    errors = np.abs(trajectory.evaluate(times, [1])[0] - requested)
    limits = CLOSE_ENOUGH * np.abs(requested).max(axis=1)
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
