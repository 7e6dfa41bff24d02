"""The check of rides: the tool keeps its pose on its object, or its straight line relative to it, at all times.

Seen from the object, the base of the robot slides backwards. There, a robot on a rail has to keep to lines that stand
still. So the bound on deviations from paths of the tool holds on rides, too. The check trusts neither the times nor the
curves that the planner chose.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.certificate.checks import Check
from planner.certificate.lines_and_circles import Line, angles_of
from planner.certificate.path_bounds import bound_deviations
from planner.dynamics import SegmentDynamics
from planner.kinematics.forward import tool_pose
from planner.problems.motion_around import as_requested
from planner.problems.problem import CartesianMotion, LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.rides import RideMotion, velocity_in_base
from planner.robots import Robot
from planner.robots.derived.external_axes import ExternalAxis
from planner.scene.scene import HERE, SceneObject
from planner.spatial import FloatArray, Pose
from planner.tolerances import NEGLIGIBLE_SHARE
from planner.trajectories.polynomials import PiecewisePolynomial, joined
from planner.trajectories.trajectory import Trajectory

RIDE_DEVIATIONS = ("object_position_deviation", "object_orientation_deviation")
"""The quantities of deviations from poses and lines on a moving object, in m and rad."""

RAIL = "seen_from_the_object"
"""The name of the axis on which the base slides backwards."""


def certify_rides(trajectory: Trajectory, problem: PlanningProblem) -> list[Check]:
    """Find the largest deviations of the tool from its poses and lines on an object that it rides on.

    Relative to the object, the tool is at rest at its waypoints, and on a straight line between two of them.

    Args:
        trajectory: The trajectory to be checked.
        problem: Its problem, with the motions of the ride.
    """
    riding = np.array([k for k, waypoint in enumerate(problem.waypoints) if isinstance(waypoint.motion, RideMotion)])
    rides = np.split(riding, np.flatnonzero(np.diff(riding) > 1) + 1) if len(riding) else []
    found = [check for ride in rides for check in _certify_ride(trajectory, problem, ride[:-1].tolist())]
    of_both = ([check for check in found if check.quantity == quantity] for quantity in RIDE_DEVIATIONS)
    return [max(checks, key=lambda check: check.ratio or 0.0) for checks in of_both if checks]


def _certify_ride(trajectory: Trajectory, problem: PlanningProblem, riding: list[int]) -> list[Check]:
    """Find the largest deviations on one ride, with waypoints of some indices on the object."""
    first = riding[0]
    motion = problem.waypoints[first].motion
    assert isinstance(motion, RideMotion)  # noqa: S101 - chosen so
    thing, base, begin = motion.thing, problem.robot.mounting or HERE, float(trajectory.arrivals[first])
    velocity = velocity_in_base(thing, base)
    there = thing.pose_at(begin).to_frame(base)
    poses, allowed = [], []
    for k in riding:
        requested = as_requested(problem.waypoints[k])
        assert isinstance(requested, PoseWaypoint)  # noqa: S101 - only poses are on objects
        poses.append(requested.pose.from_frame(there))
        own = requested.motion if isinstance(requested.motion, CartesianMotion) else LinearMotion()
        allowed.append((own.tolerance_position, own.tolerance_orientation))
    lines, parts, limits = [], [], []
    for row, k in enumerate(riding):
        times = trajectory.arrivals[k], trajectory.departures[k]
        if times[1] - times[0] > NEGLIGIBLE_SHARE * trajectory.duration:
            lines.append(Line.between(poses[row], poses[row]))
            parts.append(trajectory.between(*times))
            limits.append(allowed[row])
        if row + 1 < len(riding):
            lines.append(Line.between(poses[row], poses[row + 1]))
            parts.append(trajectory.between(trajectory.departures[k], trajectory.arrivals[riding[row + 1]]))
            limits.append(allowed[row + 1])
    if not parts:
        return _at_arrival(trajectory, problem.robots[first], poses[0], allowed[0], begin)
    seen = _seen_from_object(parts, float(np.linalg.norm(velocity)))
    robot = _on_rail(problem.robots[first], velocity)
    dynamics = SegmentDynamics.of_robots([robot] * (len(parts) + 1))
    left_out = np.tile([0.0, 0.0, 0.0, -1.0], (len(parts), 2, 1))
    paths = {k: line.parts for k, line in enumerate(lines)}
    found = bound_deviations(seen, dynamics, paths, np.array(limits), left_out)
    slip = _slip(thing, base, velocity, begin, _free_until(trajectory, problem, riding))
    slip += max(_late_release(trajectory, problem, k) for k in riding) * float(np.linalg.norm(velocity))
    return [
        Check(
            quantity=quantity,
            joint=None,
            peak=worst.peak + extra,
            limit=worst.limit,
            ratio=(worst.peak + extra) / worst.limit,
            time=begin + worst.time,
            method="bounded",
            enforced=True,
            bounded=True,
            lower=worst.lower,
        )
        for quantity, worst, extra in zip(RIDE_DEVIATIONS, found, (slip, 0.0), strict=True)
        if worst is not None
    ]


def _at_arrival(
    trajectory: Trajectory, robot: Robot, pose: Pose, allowed: tuple[float, float], time: float
) -> list[Check]:
    """Return the checks of a tool that is at a pose on its object at one time, s, only."""
    reached = tool_pose(robot, trajectory.evaluate(time, [0])[0])
    assert reached.rotation is not None  # noqa: S101 - the tool has one
    assert pose.rotation is not None  # noqa: S101 - the check of the problem refuses poses without one
    away = float(np.linalg.norm(reached.position - pose.position))
    turned = float(angles_of((pose.rotation.T @ reached.rotation)[None])[0])
    return [
        Check(quantity, None, value, limit, value / limit, time, "exact", enforced=True, bounded=True)
        for quantity, value, limit in zip(RIDE_DEVIATIONS, (away, turned), allowed, strict=True)
    ]


def _seen_from_object(parts: list[PiecewisePolynomial], speed: float) -> Trajectory:
    """Return consecutive parts of a trajectory, one segment each, of a robot on a rail with a speed, m/s."""
    curves = [part.of_segments(np.full(len(part.lengths), k)) for k, part in enumerate(parts)]
    whole = joined(curves)
    rail = np.zeros((len(whole.lengths), 1, whole.coefficients.shape[2]))
    rail[:, 0, 0] = -speed * whole.breakpoints[:-1]
    if rail.shape[2] == 1:
        rail = np.concatenate([rail, np.zeros_like(rail)], axis=2)
    rail[:, 0, 1] = -speed
    coefficients = np.concatenate([rail, whole.padded(rail.shape[2]).coefficients], axis=1)
    at = np.array([0.0, *np.cumsum([part.breakpoints[-1] for part in parts])])
    return Trajectory(whole.lengths, coefficients, whole.segments, at, at)


def _on_rail(robot: Robot, velocity: FloatArray) -> Robot:
    """Return a robot whose base slides along a velocity (3,) in its base frame."""
    rail = ExternalAxis(RAIL, "prismatic", velocity.tolist(), lower=-1.0, upper=1.0)
    return robot.derived(external_axes=[rail], mounting=robot.mounting or HERE)


def _free_until(trajectory: Trajectory, problem: PlanningProblem, riding: list[int]) -> float:
    """Return the time until which the object moves by itself: it is taken, or the robot leaves it."""
    motion = problem.waypoints[riding[0]].motion
    assert isinstance(motion, RideMotion)  # noqa: S101 - chosen so
    taken = (k for k in riding if any(take.id == motion.thing.id for take in problem.waypoints[k].attach))
    k = next(taken, None)
    return float(trajectory.departures[riding[-1]] if k is None else trajectory.arrivals[k])


def _late_release(trajectory: Trajectory, problem: PlanningProblem, waypoint: int) -> float:
    """Return how late the robot puts down objects, s, compared with their motion in the scene."""
    motion = problem.waypoints[waypoint].motion
    if not isinstance(motion, RideMotion) or not problem.waypoints[waypoint].detach:
        return 0.0
    return abs(float(trajectory.arrivals[waypoint]) - motion.end)


def _slip(thing: SceneObject, base: Pose, velocity: FloatArray, begin: float, end: float) -> float:
    """Return the largest distance, m, of an object from where its velocity would take it."""

    def gaps() -> Iterator[float]:
        start = thing.pose_at(begin).to_frame(base).position
        for time in {begin, end}:
            there = thing.pose_at(time).to_frame(base).position
            yield float(np.linalg.norm(there - start - (time - begin) * velocity))

    return max(gaps())
