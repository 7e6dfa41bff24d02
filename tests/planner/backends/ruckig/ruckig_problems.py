"""Helpers of the tests of the Ruckig back end."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import ThroughTransition
from planner.robots import Joint, Robot, load_robot

RATES = ("velocity", "acceleration", "jerk")


def passing(problem: PlanningProblem) -> PlanningProblem:
    """Return the same waypoints, the inner ones passed without stopping."""
    first, *inner, last = problem.waypoints
    inner = [replace(waypoint, transition=ThroughTransition()) for waypoint in inner]
    return replace(problem, waypoints=(first, *inner, last))


def with_durations(problem: PlanningProblem, durations: dict[int, Any]) -> PlanningProblem:
    """Return a problem with durations, given by waypoint."""
    waypoints = [replace(w, duration=durations.get(i, w.duration)) for i, w in enumerate(problem.waypoints)]
    return replace(problem, waypoints=tuple(waypoints))


def durations_of(result: Plan) -> np.ndarray:
    return result.trajectory.arrivals[1:] - result.trajectory.departures[:-1]


def one_joint(**limits: float) -> Robot:
    """Make an arm with these limits at the first joint, wide ones at the others, and no position limits."""
    robot = load_robot("three_dof_arm")
    wide = {"velocity": 1e3, "acceleration": 1e4, "jerk": 1e6}
    own = [Joint(joint.name, joint.kind, **(limits if i == 0 else wide)) for i, joint in enumerate(robot.joints)]
    return replace(robot, joints=tuple(own))


def line(robot: Robot, *angles: float) -> PlanningProblem:
    """Return a problem that moves the first joint to these angles; the others stand still."""
    waypoints = tuple(JointWaypoint(position=(angle, 0.0, 0.0)) for angle in angles)
    return PlanningProblem(robot, waypoints)


def assert_within_limits(result: Plan) -> None:
    """Assert limits by 20,000 samples, and the expected states at the waypoints, without the certificate."""
    trajectory, limits = result.trajectory, result.path.limits
    times = np.linspace(0.0, trajectory.duration, 20001)
    position, *rates = trajectory.evaluate(times, [0, 1, 2, 3])
    segments = trajectory.segments[trajectory.locate(times)[0]]
    assert (position >= limits.position.lower - 1e-9).all()
    assert (position <= limits.position.upper + 1e-9).all()
    for quantity, values in zip(RATES, rates, strict=True):
        assert (np.abs(values) / limits.magnitudes(quantity)[segments]).max() <= 1.0 + 2e-9, quantity
    met = trajectory.evaluate(trajectory.arrivals, [0])[0]
    assert np.abs(met - result.path.positions).max() <= 1e-9
    assert result.certificate.continuity == "C2"


def shortest_time(d: float, v: float, a: float, j: float) -> float:
    """Compute the duration, s, of a jerk-limited motion from rest to rest, by bisection on the cruise speed.

    The ramps follow the two cases of a textbook.
    """

    def ramp(speed: float) -> float:
        return 2.0 * np.sqrt(speed / j) if speed <= a**2 / j else speed / a + a / j

    low, high = 0.0, v
    for _ in range(200):
        middle = (low + high) / 2.0
        low, high = (middle, high) if middle * ramp(middle) <= d else (low, middle)
    return 2.0 * ramp(low) + (d - low * ramp(low)) / low
