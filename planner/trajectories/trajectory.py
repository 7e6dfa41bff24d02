"""The one trajectory type: piecewise polynomials of time per joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike

from planner.spatial import FloatArray
from planner.tolerances import NEGLIGIBLE_SHARE
from planner.trajectories.polynomials import SegmentedPolynomial

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


@dataclass(frozen=True)
class PlanWarning:
    """Something the caller should know about a trajectory or a plan that is good all the same.

    Attributes:
        code: Stable name of the kind, in snake case.
        message: The warning, for a person.
    """

    code: str
    message: str


@dataclass(frozen=True, eq=False)
class Trajectory(SegmentedPolynomial):
    """Joint positions as piecewise polynomials of time; a path with time on it.

    Attributes:
        lengths: (pieces,), duration of each piece, s.
        coefficients: (pieces, joints, order), ascending powers of the time since the start of the piece, unrounded.
        segments: (pieces,), index of the waypoint segment that each piece belongs to. The dwell at a waypoint belongs
            to the segment that ends there; at the first waypoint, to segment 0.
        arrivals: (waypoints,), arrival time at each waypoint, s; at a blended one, the middle of its blend.
        departures: (waypoints,), departure time from each waypoint, s, after its dwell.
        warnings: Warnings of the back end.
        solver: What computed the velocity profile of `Toppra`, `kernel` or `package`; None: there is none.
    """

    arrivals: FloatArray
    departures: FloatArray
    warnings: tuple[PlanWarning, ...] = ()
    solver: str | None = None

    def __repr__(self) -> str:
        """Return duration and sizes, in one line."""
        pieces, joints, _ = self.coefficients.shape
        return f"Trajectory({self.duration:.6g} s, {pieces} pieces, {joints} joints)"

    @property
    def duration(self) -> float:
        """The time from start to end, s."""
        return float(self.breakpoints[-1])

    @cached_property
    def at_arrivals(self) -> FloatArray:
        """The joint positions (waypoints, joints) at the arrivals, rad or m."""
        return self.evaluate(self.arrivals, [0])[0]

    @property
    def moves(self) -> np.ndarray:
        """Whether (pieces,) a piece belongs to the motion of its segment, not to a dwell at a waypoint."""
        middles = self.breakpoints[:-1] + self.lengths / 2.0
        begun, ended = middles > self.departures[self.segments], middles >= self.arrivals[self.segments + 1]
        return np.asarray(begun & ~ended, dtype=bool)

    def evaluate(self, at: ArrayLike, derivatives: Sequence[int] = (0, 1, 2)) -> list[FloatArray]:
        """Evaluate positions, velocities and accelerations, or the given derivatives, at one time or at several.

        At a breakpoint where a derivative jumps, the value is the one after the jump; at the end, the one before.

        Args:
            at: A time or N times, s, within [0, duration].
            derivatives: Orders of the derivatives with respect to time: 0 is the position, 3 the jerk.

        Returns:
            One array for each order: (joints,) of a single time, (N, joints) of N; rad or m by powers of s.

        Raises:
            ValueError: A time is not a number, or outside of [0, duration] by more than rounding; an order is negative.
        """
        times = np.asarray(at, dtype=np.float64)
        if times.ndim > 1:
            raise ValueError(f"times of shape {times.shape}: one time or a row of times is evaluated")
        if any(order < 0 for order in derivatives):
            raise ValueError(f"derivatives {list(derivatives)}: orders are 0 (position), 1 (velocity), ...")
        end = self.duration
        rounding = NEGLIGIBLE_SHARE * end
        first, last = times.min(initial=0.0), times.max(initial=end)  # NaN where there is one
        if not (first >= -rounding and last <= end + rounding):
            wrong = times[~((times >= -rounding) & (times <= end + rounding))].flat[0]
            raise ValueError(f"time {wrong} s is outside of the trajectory's [0, {end}] s")
        if first < 0.0 or last > end:
            times = times.clip(0.0, end)
        rows = super().evaluate(np.atleast_1d(times), derivatives)
        return [row[0] for row in rows] if times.ndim == 0 else rows

    def __call__(self, at: ArrayLike, derivative: int = 0) -> FloatArray:
        """Return the joint positions at times, or a derivative of them: one of `evaluate`."""
        (values,) = self.evaluate(at, [derivative])
        return values

    def to_ppoly(self) -> PPoly:
        """Return the joint positions as a polynomial of scipy, a `PPoly` with values (joints,) over time.

        Its pieces and coefficients are these. Pieces of no length, as there may be at a stop, are left out.
        """
        from scipy.interpolate import PPoly  # here: planning needs none of it

        kept = self.lengths > 0.0
        times = np.append(self.breakpoints[:-1][kept], self.duration)
        return PPoly(self.coefficients[kept].transpose(2, 0, 1)[::-1], times)

    def stretched(self, factors: FloatArray | float) -> Self:
        """Run the same path in pieces `factors` times as long; waypoints stay at the breakpoints where they are."""
        slower = super().stretched(factors)
        return self.with_pieces(slower, slower.breakpoints)

    def with_pieces(self, motion: SegmentedPolynomial, times: FloatArray) -> Self:
        """Return the trajectory with other pieces; waypoints stay at the breakpoints where they are.

        Args:
            motion: The pieces.
            times: The times (breakpoints,) of this trajectory's breakpoints on the new pieces, s.
        """
        arrivals, departures = (np.interp(at, self.breakpoints, times) for at in (self.arrivals, self.departures))
        return replace(
            self,
            lengths=motion.lengths,
            coefficients=motion.coefficients,
            segments=motion.segments,
            arrivals=arrivals,
            departures=departures,
        )

    def scaled(self, factor: float) -> Trajectory:
        """Run the same path in `factor` times the time: velocities are divided by it, accelerations by its square.

        Limits are not looked at. Beyond 1 the velocities, accelerations and jerks only become smaller, but not
        always the torques: certify the result where they matter.

        Raises:
            ValueError: The factor is not a positive number.
        """
        if not 0.0 < factor < np.inf:
            raise ValueError(f"a trajectory cannot be scaled by {factor}")
        return self.stretched(factor)

    def sample_times(self, period: float) -> FloatArray:
        """Make times for `evaluate`: multiples of a period from 0, and last the duration itself.

        Args:
            period: Time between samples, s.

        Returns:
            (N,), s, strictly increasing.
        """
        steps = int(np.ceil(self.duration / period * (1.0 - NEGLIGIBLE_SHARE)))
        return np.append(np.arange(steps) * period, self.duration)
