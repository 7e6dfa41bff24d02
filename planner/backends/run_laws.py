"""Polynomial laws for what is passed without stopping: splines through the waypoints, or along the curve."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.backends.along_curve import (
    DURATION_TOLERANCE,
    NO_LENGTH,
    CurveLaw,
    ToolSpeeds,
    demands,
    follow_curve,
    stretched,
)
from planner.backends.assembly import TimedPieces
from planner.backends.demands import infeasible_duration, nothing_limits
from planner.backends.durations import LinearisedLimits, search_durations
from planner.backends.splines import (
    DurationsTooShort,
    NothingLimits,
    PositionOvershoot,
    interpolating_spline,
    timed_spline,
)
from planner.errors import InfeasibleDuration, Remedy
from planner.limits import passes_a_limit
from planner.polynomials import PiecewisePolynomial, differentiate, horner

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.backends.along_curve import Demand
    from planner.backends.interpolation import Degree
    from planner.kinematics.poses import FloatArray
    from planner.paths import JointPath, Run

SAMPLES = 24
"""Of a law on each of its intervals while its shape is sought; the shape that is found is then checked exactly."""

NEAR = 0.6
"""Of the worst factor: limits above are looked at in the search for a shape."""

NEARLY_STANDING = 0.3
"""Of the mean speed: slower places are looked at, lest the law runs backwards there."""

REACH, DIFFERENCE = 5, 1e-6
"""Intervals apart whose effects are measured at once, and the change of the logarithms of their durations."""

LEAST_FACTOR, ROUNDING = 1e-9, 1e-9
"""What has no logarithm counts this much; and a speed backwards, relative to the mean, that is rounding."""

MOST_LENGTHENINGS = 30
"""Times that segments without a duration are lengthened beside such with one."""

UNHURRIED = 1.0005
"""What they are lengthened by beyond their need."""


def time_run(path: JointPath, run: Run, degree: Degree, enforced: frozenset[str]) -> TimedPieces:
    """Between joint motions, the spline of each joint through the waypoints; else a law s(t) along the run's curve.

    Raises:
        InfeasibleDuration: An asked duration is shorter than its limits allow, or no law without a way back has it.
        JointPositionLimit: A spline leaves the position limits between waypoints.
        LimitsUnsatisfiable: Nothing limits the durations, or gravity exceeds a torque limit.
    """
    return (_SplineTiming if run.is_spline else _CurveTiming)(path, run, degree, enforced).time()


class _Timing(ABC):
    """A run whose intervals share the time somehow, and at last so that all limits are kept.

    Attributes:
        segments: (intervals,), index of the segment that each belongs to.
        asked: (intervals,), s, duration asked of that segment; NaN: as fast as the limits allow.
    """

    segments: np.ndarray

    def __init__(self, path: JointPath, run: Run, degree: Degree, enforced: frozenset[str]) -> None:
        self.path, self.run, self.degree, self.enforced = path, run, degree, enforced

    @property
    def asked(self) -> FloatArray:
        asked: FloatArray = self.path.durations[self.segments]
        return asked

    def time(self) -> TimedPieces:
        """The pieces that keep the limits."""
        durations, free = self.first_durations(), np.isnan(self.asked)
        for _ in range(MOST_LENGTHENINGS):
            pieces = self.pieces(durations)
            needed = demands(self.path, pieces, self.enforced)
            if free.all():
                factor = max(demand.factor for demand in needed.values())
                if factor <= 0.0:
                    raise nothing_limits(self.run.first)
                return stretched(pieces, factor)
            excess = np.array([needed[segment].factor for segment in self.segments])
            if (excess <= 1.0 + DURATION_TOLERANCE).all():
                return pieces
            if not (free & (excess > 1.0)).any():
                break
            durations = np.where(free, durations * np.maximum(excess, 1.0) * UNHURRIED, durations)
        raise self._infeasible(needed)

    @abstractmethod
    def first_durations(self) -> FloatArray:
        """(intervals,), s: those asked, and about the shortest for the others; all free: a multiple of the shortest."""

    @abstractmethod
    def pieces(self, durations: FloatArray) -> TimedPieces:
        """The motion with these durations (intervals,)."""

    def _infeasible(self, needed: dict[int, Demand]) -> InfeasibleDuration:
        worst = max(needed, key=lambda segment: needed[segment].factor)
        return self.too_short(needed[worst].factor, needed[worst].cause, needed[worst].joint, worst)

    def too_short(self, factor: float, cause: str, joint: str | None, segment: int) -> InfeasibleDuration:
        """The refusal where all asked durations would have to be longer by a factor."""
        asked = self.path.durations
        given = [k for k in self.run.segments.tolist() if not np.isnan(asked[k])]
        given.sort(key=lambda k: k != segment)
        longer = {k: float(asked[k] * factor * (1.0 + DURATION_TOLERANCE)) for k in given}
        return infeasible_duration(float(asked[given[0]]), longer, cause, joint)


class _SplineTiming(_Timing):
    """Joint motions through waypoints: what lies between the waypoints is the spline's."""

    def __init__(self, path: JointPath, run: Run, degree: Degree, enforced: frozenset[str]) -> None:
        super().__init__(path, run, degree, enforced)
        self.segments = run.segments
        self.positions = path.positions[run.first : run.first + len(run.segments) + 1]

    def first_durations(self) -> FloatArray:
        """By the search for the shortest spline."""
        limits = self.path.limits.of(self.segments)
        try:
            return timed_spline(self.positions, limits, self.asked, self.degree).durations
        except NothingLimits:
            raise nothing_limits(self.run.first) from None
        except DurationsTooShort as short:
            name = self.path.robot.joint_names[short.joint]
            segment = self.run.first + short.segment
            cause = f"the {short.quantity} limit of {name} asks"
            raise self.too_short(short.factor, cause, name, segment) from None
        except PositionOvershoot as overshoot:
            name = self.path.robot.joint_names[overshoot.joint]
            segment = self.run.first + overshoot.segment
            ends = [k for k in (segment, segment + 1) if self.run.first < k <= self.run.segments[-1]]
            raise passes_a_limit(ends, segment, name, overshoot.value, overshoot.limit) from None

    def pieces(self, durations: FloatArray) -> TimedPieces:
        """One polynomial a segment."""
        coefficients = interpolating_spline(self.positions, durations, self.degree)
        return TimedPieces(durations, coefficients, self.segments)


@dataclass(frozen=True, eq=False)
class _LawOnSamples:
    """A law along a curve, held against its limits at samples.

    Attributes:
        durations: (intervals,), s.
        factors: (intervals, samples), logarithms of the factors on their time that the limits ask.
        descents: (intervals, samples), positive where the law runs backwards.
        assess: Both for other durations.
    """

    durations: FloatArray
    factors: FloatArray
    descents: FloatArray
    assess: Callable[[FloatArray], tuple[FloatArray, FloatArray]]

    @property
    def ratios(self) -> FloatArray:
        """(intervals,)."""
        ratios: FloatArray = np.exp(self.factors.max(axis=1))
        return ratios

    @property
    def overshoot(self) -> float:
        """How fast the law runs backwards, relative to the mean speed."""
        descent = float(self.descents.max())
        return descent if descent > ROUNDING else 0.0

    def linearise(self) -> LinearisedLimits:
        """By differences: of intervals far apart at once, as a spline soon forgets what is done to it elsewhere."""
        count = len(self.durations)
        intervals, apart = np.arange(count), 2 * REACH + 1
        tight = self.factors > np.log(NEAR) + self.factors.max()
        slow = self.descents > -NEARLY_STANDING
        slopes = np.zeros((int(tight.sum() + slow.sum()), count))
        rows = np.concatenate([np.nonzero(tight)[0], np.nonzero(slow)[0]])
        for first in range(min(apart, count)):
            changed = intervals % apart == first
            factors, descents = self.assess(self.durations * np.exp(DIFFERENCE * changed))
            change = np.concatenate([(factors - self.factors)[tight], (descents - self.descents)[slow]]) / DIFFERENCE
            nearest = np.flatnonzero(changed)[np.abs(rows[:, None] - np.flatnonzero(changed)).argmin(axis=1)]
            slopes[np.arange(len(rows)), nearest] = change
        excess = np.concatenate([self.factors[tight], self.descents[slow]])
        return LinearisedLimits(excess, slopes, np.arange(len(rows)) < tight.sum())


class _CurveTiming(_Timing):
    """A law of the degree along the curve: the spline s(t) through the waypoints and the ends of blends.

    The intervals between them share the time so that each comes as near to its limits as it can. A single law over the
    whole run is such a spline, too: the search begins there.
    """

    def __init__(self, path: JointPath, run: Run, degree: Degree, enforced: frozenset[str]) -> None:
        super().__init__(path, run, degree, enforced)
        marks = np.union1d(run.stations, run.corners)
        self.places = run.curve.breakpoints[marks]
        self.segments = run.owners[marks[:-1]]
        self.speeds = ToolSpeeds(path, run)

    def first_durations(self) -> FloatArray:
        """Those of the best law found; the intervals of a segment share its asked duration in proportion."""
        shape = search_durations(self.assess, self._single_law(), np.ones(len(self.segments), dtype=bool)).durations
        free = np.isnan(self.asked)
        if free.all():
            return shape
        shares = shape / np.array([shape[self.segments == segment].sum() for segment in self.segments])
        durations = np.where(free, shape, shares * self.asked)
        return search_durations(self.assess, durations, free).durations if free.any() else durations

    def pieces(self, durations: FloatArray) -> TimedPieces:
        """Quintics along the curve."""
        if self.assess(durations).overshoot > 0.0:
            raise self._runs_backwards()
        return follow_curve(self.run, CurveLaw(self._law(durations), self.segments))

    def _single_law(self) -> FloatArray:
        """Durations of the intervals under one law from rest to rest over the whole run, in all 1 s."""
        rest_to_rest = interpolating_spline(np.array([[0.0], [1.0]]), np.ones(1), self.degree)[0, 0]
        times = np.linspace(0.0, 1.0, 2001)
        return np.diff(np.interp(self.places / self.places[-1], horner(rest_to_rest, times), times))

    def _law(self, durations: FloatArray) -> PiecewisePolynomial:
        return PiecewisePolynomial(durations, interpolating_spline(self.places[:, None], durations, self.degree))

    def assess(self, durations: FloatArray) -> _LawOnSamples:
        """The law with these durations (intervals,), against the limits."""
        return _LawOnSamples(durations, *self._excess(durations), self._excess)

    def _excess(self, durations: FloatArray) -> tuple[FloatArray, FloatArray]:
        """From samples: the logarithm of the factor on its time that each limit asks, and how much the law descends.

        (intervals, limits * SAMPLES) and (intervals, SAMPLES), relative to the mean speed of the run.
        """
        law, curve, limits = self._law(durations), self.run.curve, self.path.limits
        t = np.linspace(0.0, 1.0, SAMPLES) * durations[:, None]
        s, ds, dds, ddds = (horner(differentiate(law.coefficients, k), t)[..., None] for k in range(4))
        starts, ends = self.places[:-1, None], self.places[1:, None]
        margin = NO_LENGTH * (ends - starts)  # at its ends an interval's own derivatives count
        places = np.clip(s[..., 0], starts + margin, ends - margin).ravel()
        dq, ddq, dddq = (value.reshape(*t.shape, -1) for value in curve.evaluate(places, [1, 2, 3]))
        motion = {
            "velocity": dq * ds,
            "acceleration": ddq * ds**2 + dq * dds,
            "jerk": dddq * ds**3 + 3.0 * ddq * ds * dds + dq * ddds,
        }
        factors = [self.speeds.excess(places).reshape(t.shape) * np.abs(ds[..., 0])]
        for order, (quantity, values) in enumerate(motion.items(), 1):
            if quantity in self.enforced:
                ratios = np.abs(values) / getattr(limits, quantity)[self.segments][:, None]
                factors.append(ratios.max(axis=2) ** (1.0 / order))
        mean_speed = self.places[-1] / durations.sum()
        return np.log(np.maximum(np.hstack(factors), LEAST_FACTOR)), -ds[..., 0] / mean_speed

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
