"""The rides of a trajectory: motions with time of their own, in the places that back ends leave for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.paths import JointPath
from planner.trajectories.polynomials import joined
from planner.trajectories.trajectory import Trajectory


def with_rides(path: JointPath, trajectory: Trajectory) -> Trajectory:
    """Return a trajectory that moves where a back end rests for the time of a ride.

    The rest relative to the object at a waypoint belongs to the segment that begins there. So an object that the robot
    takes there moves with the tool from the arrival on.
    """
    segments = np.array(sorted(path.rides), dtype=int)
    for own in np.split(segments, np.flatnonzero(np.diff(segments) > 1) + 1) if len(segments) else ():
        trajectory = _with_ride(path, trajectory, own.tolist())
    return trajectory


def _with_ride(path: JointPath, trajectory: Trajectory, segments: list[int]) -> Trajectory:
    """Return a trajectory with one ride on consecutive segments."""
    begin, end = trajectory.departures[segments[0]], trajectory.arrivals[segments[-1] + 1]
    first, last = (int(np.abs(trajectory.breakpoints - at).argmin()) for at in (begin, end))
    curves = [path.rides[k].of_segments(np.full(len(path.rides[k].lengths), k)) for k in segments]
    rows = np.arange(len(trajectory.lengths))
    whole = joined([trajectory.of(rows < first), *curves, trajectory.of(rows >= last)])
    return replace(trajectory, lengths=whole.lengths, coefficients=whole.coefficients, segments=whole.segments)
