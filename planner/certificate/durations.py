"""The check of the requested durations: of segments, of dwells and of the whole trajectory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.certificate.checks import Check
from planner.problems.problem import AnyWaypoint
from planner.problems.rides import RideMotion
from planner.spatial import FloatArray
from planner.tolerances import LIMIT_TOLERANCE, POSITION_TOLERANCE, ROUNDING
from planner.trajectories.polynomials import cumulative_sums, powers
from planner.trajectories.trajectory import Trajectory

DURATION_ERROR = "duration_error"
"""The quantity of the check: the difference of a duration or an arrival from the requested one or its bound, s."""


def certify_durations(trajectory: Trajectory, waypoints: Sequence[AnyWaypoint], whole: float | None) -> list[Check]:
    """Check durations, minimum durations, dwells and arrivals against the request.

    `whole` is the requested duration of the whole trajectory, s; None: none.

    Returns:
        The check of the duration that is farthest off; none if no duration is requested.
    """
    arrivals, departures = trajectory.arrivals, trajectory.departures
    exact = [(k, w.duration) for k, w in enumerate(waypoints[1:], 1) if w.duration is not None]
    least = [(k, w.minimum_duration) for k, w in enumerate(waypoints[1:], 1) if w.minimum_duration > 0.0]
    dwells = [(k, w.dwell) for k, w in enumerate(waypoints) if w.dwell > 0.0]
    earliest = [(k, w.earliest_arrival) for k, w in enumerate(waypoints) if w.earliest_arrival > 0.0]
    latest = [(k, w.latest_arrival) for k, w in enumerate(waypoints) if w.latest_arrival is not None]
    if not (exact or least or dwells or earliest or latest or whole is not None):
        return []
    took = arrivals.copy()
    took[1:] -= departures[:-1]
    rows = [(took[k] - requested, requested, arrivals[k]) for k, requested in exact]
    rows += [(min(took[k] - requested, 0.0), requested, arrivals[k]) for k, requested in least]
    rows += [(min(arrivals[k] - requested, 0.0), requested, arrivals[k]) for k, requested in earliest]
    rows += [(max(arrivals[k] - requested, 0.0), requested, arrivals[k]) for k, requested in latest]
    if dwells:
        stood = _standing_times(trajectory, arrivals, departures)
        for k, w in enumerate(waypoints[1:]):
            if isinstance(w.motion, RideMotion):
                stood[k] = departures[k] - arrivals[k]  # relative to the object, which `certify_rides` checks
        rows += [(stood[k] - requested, requested, departures[k]) for k, requested in dwells]
    if whole is not None:
        rows.append((trajectory.duration - whole, whole, trajectory.duration))
    errors, requested, times = np.abs(np.array(rows, dtype=np.float64)).T
    limits = LIMIT_TOLERANCE * requested + ROUNDING * trajectory.duration
    worst = int((errors / limits).argmax())
    return [
        Check(
            quantity=DURATION_ERROR,
            joint=None,
            peak=float(errors[worst]),
            limit=float(limits[worst]),
            ratio=float(errors[worst] / limits[worst]),
            time=float(times[worst]),
            method="exact",
            enforced=True,
            bounded=True,
        )
    ]


def _standing_times(trajectory: Trajectory, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Return the time (N,), s, during which no joint moves between times (N,) and (N,)."""
    sizes = np.abs(trajectory.coefficients) * powers(trajectory.lengths, trajectory.coefficients.shape[2])[:, None]
    stands = sizes[..., 1:].max(axis=(1, 2), initial=0.0) <= POSITION_TOLERANCE
    until = cumulative_sums(np.where(stands, trajectory.lengths, 0.0))
    return np.interp(ends, trajectory.breakpoints, until) - np.interp(starts, trajectory.breakpoints, until)
