"""Reversing, cutting, joining and resampling of trajectories, with unchanged polynomials."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import ArrayLike

from planner.errors import InvalidProblem, distinct
from planner.fields import FieldPath
from planner.limits import Limits
from planner.operations.certified import (
    CertifiedTrajectory,
    certified,
    largest_speed,
    own_ends,
    refuse_other_joints,
)
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import CONTINUITY_TOLERANCE, NEGLIGIBLE_SHARE
from planner.trajectories.polynomials import joined, shifted
from planner.trajectories.trajectory import Trajectory

MEETING_TOLERANCE = 1e-6
"""Default largest distance between the ends of joined trajectories, rad or m.

It is a micrometre at the end of an arm of 1 m, far below the repeatability of drives.
"""


@dataclass(frozen=True, eq=False)
class Junction:
    """The point where two joined trajectories meet.

    Attributes:
        time: s from the start of the whole.
        position_gap: Shift (joints,) of the later trajectory to the end of the one before, rad or m.
        velocity_gap: Difference (joints,) of the velocities, rad/s or m/s, which is rounding.
        acceleration_gap: Jump (joints,) of the accelerations, rad/s^2 or m/s^2.
    """

    time: float
    position_gap: FloatArray
    velocity_gap: FloatArray
    acceleration_gap: FloatArray


@dataclass(frozen=True, eq=False)
class JoinedTrajectory(CertifiedTrajectory):
    """Trajectories one after the other.

    Attributes:
        junctions: Where they meet, one fewer than there are trajectories.
    """

    junctions: tuple[Junction, ...]


@dataclass(frozen=True, eq=False)
class ResampledTrajectory(CertifiedTrajectory):
    """A trajectory at new times; rows are time.

    Attributes:
        time: (N,), s.
        position: (N, joints), rad or m.
        velocity: (N, joints), rad/s or m/s.
        acceleration: (N, joints), rad/s^2 or m/s^2.
        jerk: (N, joints), rad/s^3 or m/s^3.
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


def reverse_trajectory(
    robot: Robot, trajectory: Trajectory, *, limits: Limits = Limits(), enforced: Collection[str] | None = None
) -> CertifiedTrajectory:
    """Reverse a trajectory, with the same timing: q(t) becomes q(duration - t).

    Args:
        robot: The robot, with its tool and payload; its limits hold, narrowed by `limits`.
        trajectory: A trajectory of any origin.
        limits: Additional limits, no wider than the robot's.
        enforced: The quantities of `QUANTITIES` with enforced limits; None: every quantity that the trajectory bounds.

    Raises:
        InvalidProblem: Another number of joints than the robot's, limits wider than the robot's, or a position jumps.
        LimitsUnsatisfiable: An enforced limit is broken.
    """
    refuse_other_joints(robot, [trajectory])
    turned = shifted(trajectory.coefficients, trajectory.lengths[:, None])[::-1].copy()
    turned[..., 1::2] *= -1.0
    backwards = replace(
        trajectory,
        lengths=trajectory.lengths[::-1].copy(),
        coefficients=turned,
        segments=trajectory.segments.max() - trajectory.segments[::-1],
        arrivals=trajectory.duration - trajectory.departures[::-1],
        departures=trajectory.duration - trajectory.arrivals[::-1],
    )
    return certified(robot, backwards, limits, enforced, [trajectory])


def slice_trajectory(
    robot: Robot,
    trajectory: Trajectory,
    start: float = 0.0,
    end: float | None = None,
    *,
    limits: Limits = Limits(),
    enforced: Collection[str] | None = None,
) -> CertifiedTrajectory:
    """Cut out the part between two times; warn if it begins or ends in motion.

    Args:
        robot: The robot, with its tool and payload; its limits hold, narrowed by `limits`.
        trajectory: A trajectory of any origin.
        start: When the slice begins, s.
        end: When it ends, s; None: at the end of the trajectory.
        limits: Additional limits, no wider than the robot's.
        enforced: The quantities of `QUANTITIES` with enforced limits; None: every quantity that the trajectory bounds.

    Raises:
        InvalidProblem: The times are not within the trajectory, or the end is not after the start; or as for
            `reverse_trajectory`.
        LimitsUnsatisfiable: An enforced limit is broken.
    """
    refuse_other_joints(robot, [trajectory])
    return certified(robot, slice_of(trajectory, start, end), limits, enforced, [trajectory])


def slice_of(trajectory: Trajectory, start: float, end: float | None = None) -> Trajectory:
    """Cut out the part between two times, s; without an end, until the trajectory ends.

    Raises:
        InvalidProblem: The times are not within the trajectory, or the end is not after the start.
    """
    duration = trajectory.duration
    last = duration if end is None else end
    faults: list[tuple[FieldPath, str]] = [
        ((name,), f"{time:g} s is not within the trajectory, which takes {duration:g} s")
        for name, time in (("start", start), ("end", last))
        if not -NEGLIGIBLE_SHARE * duration <= time <= duration * (1.0 + NEGLIGIBLE_SHARE)
    ]
    ends = [start, last]
    for k, time in enumerate(ends):  # beside a breakpoint, a piece would be all rounding
        nearest = float(trajectory.breakpoints[np.abs(trajectory.breakpoints - time).argmin()])
        ends[k] = nearest if abs(nearest - time) <= NEGLIGIBLE_SHARE * duration else time
    begin, finish = ends
    if not faults and finish <= begin:
        faults.append((("end",), f"the slice has to end after it begins, at {start:g} s"))
    if faults:
        raise InvalidProblem(faults)
    return _between(trajectory, begin, finish)


def _between(trajectory: Trajectory, start: float, end: float) -> Trajectory:
    """Return the part of a trajectory between two times, with the waypoints of the segments that it is on."""
    part = trajectory.between(start, end)
    first = int(trajectory.locate(np.array([start]))[0][0])
    segments = trajectory.segments[first : first + len(part.lengths)]
    waypoints = slice(int(segments[0]), int(segments[-1]) + 2)
    duration = float(part.breakpoints[-1])  # end - start, but for rounding
    arrivals, departures = (
        np.clip(times[waypoints] - start, 0.0, duration) for times in (trajectory.arrivals, trajectory.departures)
    )
    return replace(
        trajectory,
        lengths=part.lengths,
        coefficients=part.coefficients,
        segments=segments - segments[0],
        arrivals=arrivals,
        departures=departures,
        warnings=(),
    )


def join_trajectories(
    robot: Robot,
    trajectories: Sequence[Trajectory],
    *,
    tolerance: float = MEETING_TOLERANCE,
    limits: Limits = Limits(),
    enforced: Collection[str] | None = None,
) -> JoinedTrajectory:
    """Join trajectories one after the other.

    Each trajectory is shifted, by at most the tolerance, to begin exactly at the end of the one before. Otherwise its
    polynomials stay the same. Velocities must agree up to rounding. Accelerations may jump: then the jerk is not
    bounded, and the certificate only reports it.

    Args:
        robot: The robot, with its tool and payload; its limits hold, narrowed by `limits`.
        trajectories: One or more of any origin.
        tolerance: Largest distance of a joint between the end of one trajectory and the start of the next, rad or m.
        limits: Additional limits, no wider than the robot's.
        enforced: The quantities of `QUANTITIES` with enforced limits; None: every quantity that the trajectories and
            the result bound.

    Raises:
        InvalidProblem: The list is empty; two trajectories do not meet (the message has the difference); or as for
            `reverse_trajectory`.
        LimitsUnsatisfiable: An enforced limit is broken.
    """
    if not trajectories:
        raise InvalidProblem([(("trajectories",), "at least one is needed")])
    refuse_other_joints(robot, trajectories)
    ends = [own_ends(trajectory) for trajectory in trajectories]
    speeds = [largest_speed(trajectory) for trajectory in trajectories]
    shift, whole, junctions = np.zeros(robot.dof), [trajectories[0]], []
    starts = [0.0, *accumulate(trajectory.duration for trajectory in trajectories)]
    for k, (before, after) in enumerate(pairwise(trajectories), 1):
        position_gap = after.evaluate(0.0, [0])[0] - before.evaluate(before.duration, [0])[0]
        velocity_gap = ends[k].initial_velocity - ends[k - 1].final_velocity
        rounding = CONTINUITY_TOLERANCE * max(speeds[k - 1 : k + 1])
        _refuse_gap(robot, k, "position", after.evaluate(0.0, [0])[0], position_gap, tolerance)
        _refuse_gap(robot, k, "velocity", ends[k].initial_velocity, velocity_gap, rounding)
        acceleration_gap = after.evaluate(0.0, [2])[0] - before.evaluate(before.duration, [2])[0]
        junctions.append(Junction(starts[k], 0.0 - position_gap, velocity_gap, acceleration_gap))
        shift = shift - position_gap
        coefficients = after.coefficients.copy()
        coefficients[..., 0] += shift
        whole.append(replace(after, coefficients=coefficients))
    done = certified(robot, _one_after_the_other(whole, starts), limits, enforced, trajectories)
    return JoinedTrajectory(**vars(done), junctions=tuple(junctions))


def _refuse_gap(robot: Robot, index: int, quantity: str, begins: FloatArray, gap: FloatArray, most: float) -> None:
    joint = int(np.abs(gap).argmax())
    if abs(gap[joint]) <= most:
        return
    here, there = distinct(float(begins[joint]), float(begins[joint] - gap[joint]))
    message = (
        f"the {quantity} of {robot.joint_names[joint]} is {here} at its start, but {there} at the end of the one "
        f"before: {abs(gap[joint]):.6g} apart, where {most:.3g} is allowed"
    )
    raise InvalidProblem([(("trajectories", index), message)])


def _one_after_the_other(trajectories: Sequence[Trajectory], starts: Sequence[float]) -> Trajectory:
    """Return the whole of trajectories that meet; the last waypoint of one is the first of the next."""
    counts = [len(trajectory.arrivals) - 1 for trajectory in trajectories]
    numbered = [
        replace(trajectory, segments=trajectory.segments + before)
        for trajectory, before in zip(trajectories, accumulate([0, *counts[:-1]]), strict=True)
    ]
    arrivals = [trajectory.arrivals + start for trajectory, start in zip(trajectories, starts, strict=False)]
    departures = [trajectory.departures + start for trajectory, start in zip(trajectories, starts, strict=False)]
    return replace(
        joined(numbered),
        arrivals=np.concatenate([arrivals[0], *(times[1:] for times in arrivals[1:])]),
        departures=np.concatenate([*(times[:-1] for times in departures[:-1]), departures[-1]]),
        warnings=(),
    )


def resample_trajectory(
    robot: Robot,
    trajectory: Trajectory,
    at: ArrayLike,
    *,
    limits: Limits = Limits(),
    enforced: Collection[str] | None = None,
) -> ResampledTrajectory:
    """Evaluate a trajectory, with its derivatives, at a period or at given times.

    Args:
        robot: The robot, with its tool and payload; its limits hold, narrowed by `limits`.
        trajectory: A trajectory of any origin; samples become one by `interpolated`.
        at: The time between samples, s, the last of which is at the end; or times (N,), s, strictly increasing.
        limits: Additional limits, no wider than the robot's.
        enforced: The quantities of `QUANTITIES` with enforced limits; None: every quantity that the trajectory bounds.

    Raises:
        InvalidProblem: A time is not within the trajectory, or times do not increase; or as for `reverse_trajectory`.
        LimitsUnsatisfiable: An enforced limit is broken.
    """
    refuse_other_joints(robot, [trajectory])
    requested, duration = np.asarray(at, dtype=np.float64), trajectory.duration
    if requested.ndim == 0 and not requested > 0.0:
        raise InvalidProblem([(("period",), "must be greater than 0")])
    times = trajectory.sample_times(float(requested)) if requested.ndim == 0 else requested
    outside = np.flatnonzero(~((times >= -NEGLIGIBLE_SHARE * duration) & (times <= duration * (1 + NEGLIGIBLE_SHARE))))
    backwards = np.flatnonzero(np.diff(times) <= 0.0) + 1
    faults: list[tuple[FieldPath, str]] = [
        (("times", k), f"{times[k]:g} s is not within the trajectory, which takes {duration:g} s")
        for k in outside[:1].tolist()
    ]
    faults += [(("times", k), "time must increase strictly") for k in backwards[:1].tolist()]
    if faults:
        raise InvalidProblem(faults)
    done = certified(robot, trajectory, limits, enforced)
    position, velocity, acceleration, jerk = trajectory.evaluate(times, range(4))
    return ResampledTrajectory(
        **vars(done), time=times, position=position, velocity=velocity, acceleration=acceleration, jerk=jerk
    )
