"""Polynomial laws for what is passed without stopping: splines through the waypoints, or along the curve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.backends.along_curve import (
    DURATION_TOLERANCE,
    CurveLaw,
    ToolSpeeds,
    demands,
    follow_curve,
    stretched,
)
from planner.backends.demands import infeasible_duration, nothing_limits
from planner.backends.splines import Degree, interpolating_spline
from planner.errors import InfeasibleDuration, Remedy
from planner.polynomials import PiecewisePolynomial, differentiate, horner

if TYPE_CHECKING:
    from planner.backends.along_curve import Demand
    from planner.backends.assembly import TimedPieces
    from planner.kinematics.poses import FloatArray
    from planner.paths import JointPath, Run

SAMPLES = 24
"""Of a law on each of its intervals while its shape is sought; the shape that is found is then checked exactly."""

ROUNDS, PACE = 40, 0.5
"""Of the search for a shape, and the power of its own excess by which an interval is lengthened in each."""

MOST_LENGTHENINGS = 30
"""Times that segments without a duration are lengthened beside such with one."""

UNHURRIED = 1.0005
"""What they are lengthened by beyond their need."""


def time_run(path: JointPath, run: Run, degree: Degree, guarantees: frozenset[str]) -> TimedPieces:
    """A law s(t) of the degree along the run: the spline through its waypoints and the ends of its blends.

    The intervals between them share the time so that each comes as near to its limits as it can; a single law over
    the whole run, which is such a spline too, is where the search for that begins.

    Raises:
        InfeasibleDuration: An asked duration is shorter than its limits allow, or no law without a way back has it.
        LimitsUnsatisfiable: Nothing limits the durations, or gravity exceeds a torque limit.
    """
    return _RunTiming(path, run, degree, guarantees).time()


class _RunTiming:
    def __init__(self, path: JointPath, run: Run, degree: Degree, guarantees: frozenset[str]) -> None:
        self.path, self.run, self.degree, self.guarantees = path, run, degree, guarantees
        marks = np.union1d(run.stations, run.corners)
        self.places = run.curve.breakpoints[marks]
        self.segments = run.owners[marks[:-1]]
        self.asked = path.durations[self.segments]  # of the segment that each interval belongs to
        self.speeds = ToolSpeeds(path, run)

    def time(self) -> TimedPieces:
        """The pieces."""
        shape = self._shape(self._single_law(), np.ones(len(self.segments), dtype=bool))
        free = np.isnan(self.asked)
        if free.all():
            pieces, needed = self._exactly(shape)
            factor = max(demand.factor for demand in needed.values())
            if factor <= 0.0:
                raise nothing_limits(self.run.first)
            return stretched(pieces, factor)
        shares = shape / np.array([shape[self.segments == segment].sum() for segment in self.segments])
        durations = np.where(free, shape, shares * self.asked)
        if free.any():
            durations = self._shape(durations, free)
        for _ in range(MOST_LENGTHENINGS):
            if not self._ascends(durations):
                raise self._runs_backwards()
            pieces, needed = self._exactly(durations)
            excess = np.array([needed[segment].factor for segment in self.segments])
            if (excess <= 1.0 + DURATION_TOLERANCE).all():
                return pieces
            if not (free & (excess > 1.0)).any():
                break
            durations = np.where(free, durations * np.maximum(excess, 1.0) * UNHURRIED, durations)
        raise self._infeasible(needed)

    def _single_law(self) -> FloatArray:
        """Durations of the intervals under one law from rest to rest over the whole run, in all 1 s."""
        rest_to_rest = interpolating_spline(np.array([[0.0], [1.0]]), np.ones(1), self.degree)[0, 0]
        times = np.linspace(0.0, 1.0, 2001)
        return np.diff(np.interp(self.places / self.places[-1], horner(rest_to_rest, times), times))

    def _law(self, durations: FloatArray) -> PiecewisePolynomial:
        return PiecewisePolynomial(durations, interpolating_spline(self.places[:, None], durations, self.degree))

    def _exactly(self, durations: FloatArray) -> tuple[TimedPieces, dict[int, Demand]]:
        pieces = follow_curve(self.run, CurveLaw(self._law(durations), self.segments))
        return pieces, demands(self.path, pieces, self.guarantees)

    def _shape(self, durations: FloatArray, free: np.ndarray) -> FloatArray:
        """The durations of the best law found, those that are free changed.

        All free: any multiple of them is as good. Else those that need the least time to keep the limits.
        """
        best, least = durations, np.inf
        for _ in range(ROUNDS if len(durations) > 1 else 0):
            excess, ascends = self._excess(durations)
            worst = float(excess.max())
            if worst <= 0.0:
                break
            total = float(durations.sum()) * (worst if free.all() else 1.0 if worst <= 1.0 else 1e3 * worst)
            if ascends.all() and total < least:
                best, least = durations, total
            change = np.where(ascends, (excess / (worst if free.all() else 1.0)) ** PACE, 0.7)
            durations = np.where(free, durations * np.clip(change, 0.5, 2.0), durations)
        return best

    def _excess(self, durations: FloatArray) -> tuple[FloatArray, np.ndarray]:
        """For each interval: the factor on its time that its limits ask, from samples, and whether it only ascends."""
        law, curve, limits = self._law(durations), self.run.curve, self.path.limits
        t = np.linspace(0.0, 1.0, SAMPLES) * durations[:, None]
        s, ds, dds, ddds = (horner(differentiate(law.coefficients, k), t)[..., None] for k in range(4))
        places = np.clip(s.ravel(), 0.0, curve.breakpoints[-1])
        shape = (*t.shape, -1)
        dq, ddq, dddq = (value.reshape(shape) for value in curve.evaluate(places, [1, 2, 3]))
        motion = {
            "velocity": dq * ds,
            "acceleration": ddq * ds**2 + dq * dds,
            "jerk": dddq * ds**3 + 3.0 * ddq * ds * dds + dq * ddds,
        }
        excess = self.speeds.excess(places).reshape(t.shape) * np.abs(ds[..., 0])
        factors = [excess.max(axis=1)]
        for order, (quantity, values) in enumerate(motion.items(), 1):
            if quantity in self.guarantees:
                ratios = np.abs(values) / getattr(limits, quantity)[self.segments][:, None]
                factors.append(ratios.max(axis=(1, 2)) ** (1.0 / order))
        return np.max(factors, axis=0), ds[..., 0].min(axis=1) >= -1e-9 * ds.max()

    def _ascends(self, durations: FloatArray) -> bool:
        return bool(self._excess(durations)[1].all())

    def _runs_backwards(self) -> InfeasibleDuration:
        given = np.unique(self.segments[~np.isnan(self.asked)])
        segment = int(given[0])
        return InfeasibleDuration(
            f"with the durations asked around segment {segment} the arm would have to run back and forth on its path",
            waypoint=segment + 1,
            segment=segment,
            value=float(self.path.durations[segment]),
            remedies=[Remedy(f"/waypoints/{k + 1}/duration", None, "as fast as the limits allow") for k in given],
        )

    def _infeasible(self, needed: dict[int, Demand]) -> InfeasibleDuration:
        asked = self.path.durations
        worst = max(needed, key=lambda segment: needed[segment].factor)
        factor = needed[worst].factor * (1.0 + DURATION_TOLERANCE)
        given = [segment for segment in needed if not np.isnan(asked[segment])]
        given.sort(key=lambda segment: -needed[segment].factor)
        too_short = {segment: float(asked[segment] * factor) for segment in given}
        return infeasible_duration(float(asked[given[0]]), too_short, needed[worst].cause, needed[worst].joint)
