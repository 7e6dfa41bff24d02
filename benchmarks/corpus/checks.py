"""The requirements on the plan of a job, checked without the certificate."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline

from benchmarks.corpus.promises import is_continuous, keeps_joint_limits, keeps_sampled_limits, times_its_actions
from benchmarks.corpus.tracing import circle, tool_at
from planner.problems.problem import (
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    PolylineMotion,
    PoseWaypoint,
    SplineMotion,
)
from planner.problems.regions import Region
from planner.problems.transitions import BlendTransition, ThroughTransition

if TYPE_CHECKING:
    from benchmarks.corpus.job import Job, Law
    from planner.plans.result import Plan
    from planner.spatial import FloatArray, Pose

MET = 2e-6
"""m and rad: twice the tolerance of inverse kinematics, by which a waypoint may be missed."""

SNAPPED = 2e-4
"""rad or m by which a start outside of a limit may be moved."""

SAMPLES = 33
"""Of a line or circle."""

CONTINUITY = {"cubic": 1, "trapezoidal": 1, "toppra": 1, "quintic": 2, "ruckig": 2, "min_effort": 2, "auto": 2}
"""Derivatives that are continuous."""

SLOW = 1.02
"""A duration of so many times the best known one is slow."""

LAWS: dict[str, Law] = {
    "cubic": "cubic",
    "quintic": "quintic",
    "trapezoidal": "trapezoidal",
    "toppra": "trapezoidal",
    "ruckig": "s_curve",
    "toppra_jerk_limited": "s_curve",
    "auto": "s_curve",
}
"""The closed form against which each back end is checked."""

FASTEST = ("toppra", "ruckig", "toppra_jerk_limited", "auto")
"""Back ends that are to take the least time; the others have a time scaling of their own or minimise something else."""

STEADY = (*FASTEST, "trapezoidal")
"""Back ends that move along a line at its speed limit, but for its ends."""

SHORT = 1e-6
"""s: a closed form is met this well where it is 0."""


def keeps_promises(plan: Plan, kind: str) -> None:
    """Check limits, continuity, waypoints, lines and circles, and the times of actions.

    Raises:
        AssertionError: Something is broken.
    """
    keeps_joint_limits(plan)
    is_continuous(plan, CONTINUITY.get(kind, 2))
    keeps_sampled_limits(plan)
    meets_waypoints(plan)
    keeps_to_lines(plan)
    times_its_actions(plan)


def meets_waypoints(plan: Plan) -> None:
    """Check every waypoint that is not blended, at its arrival."""
    trajectory = plan.trajectory
    for k, (waypoint, time) in enumerate(zip(plan.problem.waypoints, trajectory.arrivals, strict=True)):
        if isinstance(waypoint.transition, BlendTransition):
            continue
        robot = plan.problem.robots[k]
        q, v = (rows[0] for rows in trajectory.evaluate([time], [0, 1]))
        if isinstance(waypoint.transition, ThroughTransition) and waypoint.transition.velocity is not None:
            assert np.abs(v - waypoint.transition.velocity).max() <= MET, f"the velocity at waypoint {k} is missed"
        if isinstance(waypoint, PoseWaypoint) and waypoint.external:
            pinned = [q[robot.joint_names.index(name)] - pin for name, pin in waypoint.external.items()]
            assert np.abs(pinned).max() <= MET, f"an axis is not where waypoint {k} pins it"
        if isinstance(waypoint, JointWaypoint):
            assert np.abs(q - waypoint.position).max() <= (MET if k else SNAPPED), f"waypoint {k} is missed"
        elif isinstance(waypoint, PoseWaypoint) and waypoint.free is not None:
            is_in_its_region(waypoint, tool_at(robot, q))
        elif isinstance(waypoint, PoseWaypoint):
            tool = tool_at(robot, q)
            assert np.linalg.norm(tool.position - waypoint.pose.position) <= MET, f"waypoint {k} is missed"
            if waypoint.pose.rotation is not None and tool.rotation is not None:
                turned = np.linalg.norm(pin.log3(tool.rotation @ waypoint.pose.rotation.T))
                assert turned <= MET, f"the orientation at waypoint {k} is missed"


def is_in_its_region(waypoint: PoseWaypoint, tool: Pose) -> None:
    """Check that the tool is turned about its own axis only, or shifted and turned within its ranges."""
    asked, free = waypoint.pose, waypoint.free
    assert asked.rotation is not None and tool.rotation is not None
    shift, turn = asked.rotation.T @ (tool.position - asked.position), asked.rotation.T @ tool.rotation
    ranges = {} if not isinstance(free, Region) else free.ranges
    for axis, moved in zip("xyz", shift, strict=True):
        lower, upper = ranges.get(axis, (0.0, 0.0))
        assert lower - MET <= moved <= upper + MET, f"the tool is {moved:.3g} m along {axis} off its pose"
    if free == "rotation_z":
        assert np.abs(turn[2, :2]).max() <= MET, "the tool's axis is not that of its pose"
        return
    about = pin.log3(turn)
    for axis, angle in zip("xyz", about, strict=True):
        lower, upper = ranges.get(f"rotation_{axis}", (0.0, 0.0))
        assert lower - MET <= angle <= upper + MET, f"the tool is turned by {angle:.3g} rad about {axis}"


def keeps_to_lines(plan: Plan) -> None:
    """Check the tool on its lines and circles between poses, except on blends."""
    robot, trajectory, waypoints = plan.path.robot, plan.trajectory, plan.problem.waypoints
    for k in range(1, len(waypoints)):
        before, waypoint = waypoints[k - 1], waypoints[k]
        motion = waypoint.motion
        if not (
            isinstance(motion, LinearMotion | CircularMotion | PolylineMotion | SplineMotion)
            and isinstance(waypoint, PoseWaypoint)
        ):
            continue
        if not isinstance(before, PoseWaypoint) or before.free is not None or waypoint.free is not None:
            continue
        transitions = (before.transition, waypoint.transition)
        radius = max((it.radius for it in transitions if isinstance(it, BlendTransition)), default=0.0)
        times = np.linspace(trajectory.departures[k - 1], trajectory.arrivals[k], SAMPLES)
        tools = np.array([tool_at(robot, q).position for q in trajectory.evaluate(times, [0])[0]])
        start, end = before.pose.position, waypoint.pose.position
        away = _from_line(tools, start, end)
        if isinstance(motion, PolylineMotion):
            away = _from_polyline(tools, start, motion, end)
        if isinstance(motion, SplineMotion):
            away = _from_spline(tools, start, motion, end)
        if isinstance(motion, CircularMotion):
            away = _from_circle(tools, start, motion.via.position, end)
        allowed = 1.01 * motion.tolerance_position + radius
        assert away.max() <= allowed, f"the tool is {away.max():.3g} m from its way to waypoint {k}"


def _from_line(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    way = end - start
    shares = np.clip((points - start) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
    away: FloatArray = np.linalg.norm(start + shares[:, None] * way - points, axis=1)
    return away


def _from_polyline(points: FloatArray, start: FloatArray, motion: PolylineMotion, end: FloatArray) -> FloatArray:
    """Return the distances (N,) of points (N, 3) from the nearest line; none near a corner that is cut."""
    corners = [start, *(pose.position for pose in motion.poses), end]
    away: FloatArray = np.min([_from_line(points, first, last) for first, last in pairwise(corners)], axis=0)
    near = np.min([np.linalg.norm(points - corner, axis=1) for corner in corners[1:-1]], axis=0)
    return np.where(near <= motion.blend, 0.0, away)


def _from_spline(points: FloatArray, start: FloatArray, motion: SplineMotion, end: FloatArray) -> FloatArray:
    """Return the distances (N,) of points (N, 3) from the natural cubic spline that scipy makes of the poses."""
    through = np.array([start, *(pose.position for pose in motion.poses), end])
    knots = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(through, axis=0), axis=1)))
    dense = CubicSpline(knots, through, bc_type="natural")(np.linspace(0.0, knots[-1], 2_000))
    away: FloatArray = np.min([_from_line(points, *chord) for chord in pairwise(dense)], axis=0)
    return away


def _from_circle(points: FloatArray, start: FloatArray, via: FloatArray, end: FloatArray) -> FloatArray:
    center, radius, axes, _ = circle(start, via, end)
    flat = (points - center) @ axes.T
    height = np.linalg.norm((points - center) - flat @ axes, axis=1)
    away: FloatArray = np.hypot(np.linalg.norm(flat, axis=1) - radius, height)
    return away


def takes_no_longer_than_known(plan: Plan, asked: Job, kind: str) -> None:
    """Check the duration against closed forms and length over speed."""
    duration = plan.trajectory.duration
    if asked.least_duration is not None:
        assert duration >= asked.least_duration / SLOW, f"{duration:g} s is less than length over speed"
    known = (asked.durations or {}).get(LAWS[kind]) if kind in LAWS else None
    if known is not None:
        assert duration <= SLOW * known + SHORT, f"{duration:g} s, in closed form {known:g} s"
    if asked.most_duration is not None and kind in STEADY:
        most = asked.most_duration
        assert duration <= most, f"{duration:g} s, by length over speed at most {most:g} s"
