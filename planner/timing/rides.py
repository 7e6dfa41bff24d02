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
    if not path.rides:
        return trajectory
    segments = sorted(path.rides)
    begin, end = trajectory.departures[segments[0]], trajectory.arrivals[segments[-1] + 1]
    first, last = (int(np.abs(trajectory.breakpoints - at).argmin()) for at in (begin, end))
    curves = [path.rides[k].of_segments(np.full(len(path.rides[k].lengths), k)) for k in segments]
    rows = np.arange(len(trajectory.lengths))
    whole = joined([trajectory.of(rows < first), *curves, trajectory.of(rows >= last)])
    return replace(trajectory, lengths=whole.lengths, coefficients=whole.coefficients, segments=whole.segments)
