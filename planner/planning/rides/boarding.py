"""Rides at given times: the joints follow the tool along with the object."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.errors import ConfigurationChange, LimitsUnsatisfiable, PlanningError, UnreachableWaypoint
from planner.guarantees import JOINT_DERIVATIVES
from planner.kinematics.configurations import configurations, in_configuration
from planner.kinematics.inverse import all_solutions, inverse_kinematics
from planner.kinematics.turns import counted_velocity, nearest_turn
from planner.paths import solved_waypoints
from planner.problems.any_of import requested_paths
from planner.problems.problem import (
    CartesianMotion,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
)
from planner.problems.rides import Ride, velocity_in_base
from planner.scene.scene import HERE
from planner.spatial import FloatArray
from planner.tool_motions.errors import limit_error, lost_error
from planner.tool_motions.follow import Lost, Track, follow
from planner.tool_motions.position_limits import first_beyond
from planner.tool_motions.ride_paths import RidePath
from planner.trajectories.extrema import derivatives_on_unit_time, largest_magnitudes
from planner.trajectories.polynomials import PiecewisePolynomial, quintics_through

FIRST_DURATION = 0.3
"""The duration of each part of a ride with which the search for the shortest one begins, s."""

SHORTEST_PART = 0.02
"""The shortest duration of a part of a ride, s."""

USED = (0.93, 0.99)
"""The least and the largest ratio of the shortest duration within the limits to that of each part of a ride.

The rest is room for rounding."""

MOST_FITS = 12
"""The most trials until the durations of a ride use the limits."""

LARGEST_CHANGE = 4.0
"""The largest factor between the durations of two such trials."""

SAMPLES_OF_REST = 9
"""The number of samples of each rest relative to the object."""

MOST_SOLUTIONS_TRIED = 4
"""The most solutions of the inverse kinematics from which a ride is tried, the nearest ones."""


@dataclass(frozen=True, eq=False)
class Boarding:
    """A ride with its times.

    Attributes:
        time: Time of arrival at the first waypoint on the object, s.
        path: The path of the tool.
        curve: Joint positions over the time since the robot begins to get on, s.
    """

    time: float
    path: RidePath
    curve: PiecewisePolynomial

    @property
    def begin(self) -> float:
        """The time at which the robot begins to get on, s."""
        return self.time - self.path.lead_in

    @property
    def start(self) -> FloatArray:
        """The joint position (joints,) where it does, rad or m."""
        return np.asarray(self.curve.coefficients[0, :, 0])


class _Use(NamedTuple):
    """The largest shares of limits in each part of a ride.

    Attributes:
        scales: (parts,), factors on the durations with which the limits would just be used, about.
        worst: (parts,), the largest share of any limit.
        speed: The largest share of a velocity limit at the speed of the object alone.
        joint: Index of its joint.
        value: The velocity there, rad/s or m/s.
        limit: Its limit.
    """

    scales: FloatArray
    worst: FloatArray
    speed: float
    joint: int
    value: float
    limit: float


class Boardings:
    """The rides of a problem at any time.

    Args:
        problem: The problem.
        ride: One of its rides; joint positions replace those before.

    Attributes:
        number: Index in the request of the first waypoint of the ride, for refusals.
    """

    def __init__(self, problem: PlanningProblem, ride: Ride) -> None:
        self.problem, self.ride = problem, ride
        self.number = int(requested_paths(problem)[ride.first][1])
        self.robot, self.base = problem.robots[ride.first], problem.robot.mounting or HERE
        self.velocity = velocity_in_base(ride.thing, self.base)
        self.limits = problem.segment_limits()
        self.waypoints = [w for w in problem.waypoints[ride.first : ride.last + 1] if isinstance(w, PoseWaypoint)]
        self.slowness = 1.0
        self.durations = np.full(len(self.waypoints) + 1, FIRST_DURATION)

    @cached_property
    def before(self) -> FloatArray:
        """The joint position (joints,) at the waypoint before the ride, rad or m.

        Raises:
            PlanningError: A waypoint before the ride cannot be solved.
        """
        before = replace(self.problem, waypoints=self.problem.waypoints[: self.ride.first], actions=())
        return solved_waypoints(before)[1][-1].position

    @property
    def holds(self) -> FloatArray:
        """The times (waypoints,) of the rests relative to the object, s."""
        return np.array([waypoint.dwell for waypoint in self.waypoints])

    def path(self, time: float, durations: FloatArray) -> RidePath:
        """Return the path of the tool with a time of arrival, s, and durations (parts,), s, without the rests."""
        there = self.ride.thing.pose_at(time).to_frame(self.base)
        poses = [waypoint.pose.from_frame(there) for waypoint in self.waypoints]
        return RidePath(poses, self.velocity, durations[0], self.holds, durations[1:-1], durations[-1])

    def at(self, time: float) -> Boarding | PlanningError:
        """Return the shortest ride found with a time of arrival, s, or why there is none.

        The search begins with the durations of the ride found last.
        """
        refusal: PlanningError | None = None
        first = self.waypoints[0]
        path = self.path(time, self.durations)
        options = self.problem.inverse_kinematics
        solutions = all_solutions(self.robot, path.pose(0.0), options, self.before)
        starts = in_configuration(self.robot, solutions, first.configuration)
        for start in starts[:MOST_SOLUTIONS_TRIED]:
            found = self._fitted(time, nearest_turn(self.robot, start, self.before))
            if isinstance(found, Boarding):
                return found
            refusal = refusal or found
            if isinstance(found, UnreachableWaypoint):
                break  # no solution of the inverse kinematics reaches farther than another
        name = f"the motion with {self.ride.thing.id!r}"
        return refusal or UnreachableWaypoint(
            f"{name} cannot be reached by {self.robot.id} at its start", waypoint=self.number
        )

    def _fitted(self, time: float, start: FloatArray) -> Boarding | PlanningError:
        """Return the ride from near a joint position (joints,), or why there is none."""
        fixed = np.array([np.nan, *(w.duration or np.nan for w in self.waypoints[1:]), np.nan])
        least = np.array([0.0, *(w.minimum_duration for w in self.waypoints[1:]), 0.0])
        durations = np.where(np.isnan(fixed), self.durations, fixed)
        fits: Boarding | PlanningError | None = None
        for _ in range(MOST_FITS):
            boarding = self._followed(time, durations, start)
            if isinstance(boarding, PlanningError):
                return fits or boarding
            use = self._use(boarding)
            if use.speed > 1.0:
                return self._too_fast(use)
            is_free = np.isnan(fixed) & (durations > np.maximum(least, SHORTEST_PART))
            if (use.scales <= USED[1]).all():
                self.durations, fits = durations, boarding
                if not (is_free & (use.scales < USED[0])).any():
                    break
            scales = np.clip(use.scales / np.mean(USED), 1.0 / LARGEST_CHANGE, LARGEST_CHANGE)
            wanted = np.maximum(durations * scales, np.maximum(least, SHORTEST_PART))
            durations = np.where(np.isnan(fixed), wanted, fixed)
        if fits is None:
            return LimitsUnsatisfiable(
                f"the motion with {self.ride.thing.id!r} would use {use.worst.max():.4g} times a limit of a joint",
                segment=self.number - 1 + int(use.worst.argmax()),
            )
        if self.slowness == 1.0:
            return fits
        slower = np.where(np.isnan(fixed), self.durations * self.slowness, fixed)
        return self._followed(time, slower, start)

    def _followed(self, time: float, durations: FloatArray, start: FloatArray) -> Boarding | PlanningError:
        """Follow the path of the tool from near a joint position (joints,)."""
        path = self.path(time, durations)
        robot, options, name = self.robot, self.problem.inverse_kinematics, f"the motion with {self.ride.thing.id!r}"
        near = inverse_kinematics(robot, path.pose(0.0), options, start)
        segment, waypoint = self.number - 1, self.number
        if near.status != "solved":
            return UnreachableWaypoint(
                f"{name} cannot be reached by {robot.id} at its start", segment=segment, waypoint=waypoint
            )
        motions = [own.motion for own in self.waypoints[1:] if isinstance(own.motion, CartesianMotion)]
        tolerances = [
            (motion.tolerance_position, motion.tolerance_orientation) for motion in (*motions, LinearMotion())
        ]
        tolerance = tuple(np.min(tolerances, axis=0).tolist())
        curve = follow(Track(robot, path, nearest_turn(robot, near.position, start), None, tolerance))
        if isinstance(curve, Lost):
            return lost_error(name, robot, path, curve, options, "refuse").with_fields(
                segment=segment, waypoint=waypoint
            )
        if (beyond := first_beyond(robot, curve)) is not None:
            return limit_error(name, robot, *beyond).with_fields(segment=segment, waypoint=waypoint)
        boarding = Boarding(time, path, _from_rest_to_rest(curve.stretched(path.duration)))
        arrivals = boarding.curve.evaluate(path.knots[1:-1:2], [0])[0]
        for k, (own, reached) in enumerate(zip(self.waypoints, configurations(robot, arrivals), strict=True)):
            if not own.configuration.allows(reached):
                text = f"{name} comes to waypoint {{waypoint}} with {reached}, not with {own.configuration}"
                return ConfigurationChange(text, segment=segment + k, waypoint=waypoint + k)
        return boarding

    def _use(self, boarding: Boarding) -> _Use:
        """Return the shares of the limits of velocity, acceleration and jerk that a ride uses."""
        knots, curve = boarding.path.knots, boarding.curve
        middles = curve.breakpoints[:-1] + curve.lengths / 2.0
        of_piece = np.searchsorted(knots, middles, side="right") - 1  # even: a part, odd: a rest
        derivatives = derivatives_on_unit_time(curve, len(JOINT_DERIVATIVES))
        parts = len(knots) // 2
        scales, worst = np.zeros(parts), np.zeros(parts)
        for order, quantity in list(enumerate(JOINT_DERIVATIVES))[1:]:
            limits = self.limits.bounds(quantity).narrower[self.ride.first - 1 : self.ride.last + 1]
            own = limits[np.minimum(of_piece // 2, parts - 1)]
            found = largest_magnitudes(derivatives[order], own, np.arange(len(middles)))
            shares = np.abs(found.values) / own[np.arange(len(middles)), found.joints]
            for part in range(parts):
                share = float(shares[of_piece == 2 * part].max(initial=0.0))
                worst[part] = max(worst[part], share)
                # Getting on and off, the speed that is reached is given; it changes in the time that is sought.
                power = order if 0 < part < parts - 1 else order - 1
                scales[part] = max(scales[part], share ** (1.0 / power) if power else 0.0)
        rests = [np.linspace(knots[2 * k + 1], knots[2 * k + 2], SAMPLES_OF_REST) for k in range(len(self.waypoints))]
        speeds = np.abs(curve.evaluate(np.concatenate(rests), [1])[0])
        limit = self.limits.velocity.narrower[self.ride.first - 1 : self.ride.last + 1].min(axis=0)
        row, joint = np.unravel_index(int((speeds / limit).argmax()), speeds.shape)
        value = float(speeds[row, joint])
        return _Use(scales, worst, value / float(limit[joint]), int(joint), value, float(limit[joint]))

    def _too_fast(self, use: _Use) -> LimitsUnsatisfiable:
        name, speed = self.robot.joint_names[use.joint], float(np.linalg.norm(self.velocity))
        return LimitsUnsatisfiable(
            f"{self.ride.thing.id!r} is too fast: to move along at {speed:.4g} m/s, {name} would move at "
            f"{use.value:.4g}, its limit is {use.limit:.4g}",
            waypoint=self.number,
            joint=name,
            value=use.value,
            limit=use.limit,
        )

    def travel_time(self, boarding: Boarding) -> float:
        """Return a lower bound on the time from the start of the trajectory until getting on can begin, s."""
        rests = 0.0
        for waypoint in self.problem.waypoints[: self.ride.first]:
            arrival = max(rests + (waypoint.duration or waypoint.minimum_duration), waypoint.earliest_arrival)
            rests = arrival + waypoint.dwell
        speeds = counted_velocity(self.robot.limit("velocity"))
        away = np.abs(boarding.start - self.before)
        limited = np.isfinite(self.robot.limit("velocity"))
        return rests + float((away / speeds)[limited].max(initial=0.0))


def _from_rest_to_rest(curve: PiecewisePolynomial) -> PiecewisePolynomial:
    """Return a curve whose velocity and acceleration are exactly 0 at its ends, where they are but for rounding."""
    states = [rows.copy() for rows in curve.evaluate(curve.breakpoints, [0, 1, 2])]
    for rows in states[1:]:
        rows[[0, -1]] = 0.0
    return quintics_through(curve.lengths, *states)
