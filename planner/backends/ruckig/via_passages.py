"""Motions that pass waypoints in the least total time.

Between two waypoints each joint moves from state to state as fast as it can, and waits for the slowest. The states come
from the program of `via_program`, whose pieces of constant jerk have fixed ends. The exact motions can have two faults.
A joint may be unable to arrive at some times after its shortest one; then all joints wait longer. And a joint may leave
its position limits. Slower single joints at single waypoints remove both faults.
"""

from __future__ import annotations

import numpy as np

from planner.backends.ruckig.state_to_state import Passage, Passages, Rates, ShortestTimes
from planner.backends.ruckig.via_problem import LATE, OUTSIDE_WEIGHT, ViaMotion, ViaProblem
from planner.backends.ruckig.via_program import passing_states
from planner.kernels.passing import PhasedMotions, read_cubics
from planner.spatial import FloatArray
from planner.tolerances import LIMIT_TOLERANCE, ROUNDING
from planner.trajectories.polynomials import SegmentedPolynomial

VIA_STATE_FACTORS = (0.75, 0.5, 0.25, 0.0)
"""Factors on a joint's velocity and acceleration at a waypoint that are tried where a segment is to be mended."""

MOST_MENDINGS = 24
"""Number of times that a joint is slowed at a waypoint, or at two, at most."""


def pass_waypoints(problem: ViaProblem, *, stopping: bool) -> ViaMotion | None:
    """Find a fast motion that may miss requested durations and position limits; the caller checks both.

    Args:
        problem: The problem in SI units.
        stopping: Whether to come to rest at each inner waypoint.

    Returns:
        None: The motions at the ends are impossible.
    """
    cleaned = problem.without_rounding()
    length, time = cleaned.units()
    scaled = cleaned.in_units(length, time)
    if stopping or len(problem.requested) == 1:
        return MendedPassages(scaled, scaled.resting_rates).motion(problem, length, time)
    passages = MendedPassages(scaled, passing_states(scaled))
    passages.mend()
    return passages.motion(problem, length, time)


class MendedPassages:
    """The synchronised motions between the waypoints, in units in which everything is about 1.

    Args:
        problem: The problem, in these units.
        rates: Velocities and accelerations (waypoints, joints) with which the waypoints are passed.
    """

    def __init__(self, problem: ViaProblem, rates: Rates) -> None:
        self.problem, self.rates, travels = problem, rates, problem.travels
        self._passages = Passages(travels, problem.limits, problem.requested, problem.synchronization)
        self._times = ShortestTimes(travels, problem.limits)
        lower, upper = problem.limits.position
        self._room = lower - problem.positions[:-1], upper - problem.positions[:-1]
        self.shortest = self._shortest()
        self.passages = self._passages.of(range(len(self.shortest)), *_ends(rates))

    @property
    def cost(self) -> float:
        """The total time, and the weighted violations of requested durations and of position limits."""
        return sum(self._cost(segment, passage) for segment, passage in enumerate(self.passages))

    def _passage(self, segment: int, rates: Rates) -> Passage | None:
        """Return the motion on a segment with rates (waypoints, joints); None: it is impossible."""
        (passage,) = self._passages.of([segment], *_ends(Rates(*(rate[segment : segment + 2] for rate in rates))))
        return passage

    def _cost(self, segment: int, passage: Passage | None) -> float:
        """Return the time of a motion on a segment, and its weighted violations; infinite: it is impossible."""
        if passage is None:
            return np.inf
        requested = self.problem.requested[segment]
        time = passage.duration if np.isnan(requested) else LATE * max(passage.duration - requested, 0.0)
        return float(time + OUTSIDE_WEIGHT * self._outside(segment, passage).sum())

    def _outside(self, segment: int, passage: Passage) -> FloatArray:
        """Return the excess (joints,) of each joint over its position limits, plus 1 if there is any."""
        below, above = self._room[0][segment] - passage.lowest, passage.highest - self._room[1][segment]
        outside: FloatArray = np.maximum(np.maximum(below, above), 0.0)
        return np.where(outside > LIMIT_TOLERANCE, 1.0 + outside, 0.0)

    def _faults(self, segment: int) -> tuple[float, np.ndarray]:
        """Return the possible gain from correcting a segment, and the indices of the joints to slow."""
        passage = self.passages[segment]
        everyone = np.arange(self.shortest.shape[1])
        if passage is None:
            return np.inf, everyone
        outside = self._outside(segment, passage)
        least = np.fmax(self.shortest[segment].max(), self.problem.requested[segment])
        late = passage.duration - least
        if late <= 1e-6 * least:
            late = 0.0
        return late + OUTSIDE_WEIGHT * outside.sum(), everyone if late > 0.0 else np.flatnonzero(outside)

    def mend(self) -> None:
        """Slow one joint at one waypoint or at two, the best choice each time, until nothing can be gained."""
        hopeless: set[int] = set()
        for _ in range(MOST_MENDINGS):
            faults = {s: self._faults(s) for s in range(len(self.passages)) if s not in hopeless}
            worst = max(faults, key=lambda s: faults[s][0], default=None)
            if worst is None or faults[worst][0] == 0.0:
                return
            if not self._mend(worst, faults[worst][1]):
                hopeless.add(worst)
            else:
                hopeless.clear()

    def _mend(self, segment: int, joints: np.ndarray) -> bool:
        """Slow a joint at one or both ends of a segment if that lowers the cost; return whether it does."""
        inner = [k for k in (segment, segment + 1) if 0 < k < len(self.passages)]
        choices = [[k] for k in inner] + ([inner] if len(inner) == 2 else [])
        near = range(max(segment - 1, 0), min(segment + 2, len(self.passages)))
        least = sum(self._cost(s, self.passages[s]) for s in near) * (1.0 - LIMIT_TOLERANCE)
        best = None
        for joint in joints:
            for waypoints in choices:
                if not any(rate[waypoints, joint].any() for rate in self.rates):
                    continue
                for factor in VIA_STATE_FACTORS:
                    rates = Rates(*(rate.copy() for rate in self.rates))
                    for rate in rates:
                        rate[waypoints, joint] *= factor
                    trial = {
                        s: self._passage(s, rates) if {s, s + 1} & set(waypoints) else self.passages[s] for s in near
                    }
                    cost = sum(self._cost(s, passage) for s, passage in trial.items())
                    if cost < least:
                        least, best = cost, (rates, trial)
        if best is None:
            return False
        self.rates = best[0]
        for s, passage in best[1].items():
            self.passages[s] = passage
        self.shortest = self._shortest()
        return True

    def _shortest(self) -> FloatArray:
        """Return the shortest times (segments, joints) of the single joints."""
        return self._times.between(*_ends(self.rates))

    def motion(self, problem: ViaProblem, length: FloatArray, time: float) -> ViaMotion | None:
        """Give the motion in SI units.

        Args:
            problem: The problem in SI units.
            length: The unit of length (joints,) of each joint, rad or m.
            time: The unit of time, s.

        Returns:
            None: One of the motions is impossible.
        """
        passages = [passage for passage in self.passages if passage is not None]
        if len(passages) < len(self.passages):
            return None
        phased = PhasedMotions(*map(np.stack, zip(*(passage.phases for passage in passages), strict=True)))
        _, ends = _ends(self.rates)
        of, lengths, coefficients = read_cubics(phased, problem.travels / length, *ends, ROUNDING)
        durations = np.array([passage.duration for passage in passages])
        kept = durations <= self.problem.requested * (1.0 + LIMIT_TOLERANCE)
        scaled = np.where(kept, problem.requested, durations * time)
        scale = scaled / np.bincount(of, lengths)
        pieces = SegmentedPolynomial(lengths, coefficients * length[:, None], of).stretched(scale[of])
        starts = problem.positions[:-1]
        pieces.coefficients[..., 0] += starts[of]
        return ViaMotion(
            scaled,
            pieces,
            starts + length * np.array([passage.lowest for passage in passages]),
            starts + length * np.array([passage.highest for passage in passages]),
            self.shortest.argmax(axis=1),
        )


def _ends(rates: Rates) -> tuple[Rates, Rates]:
    """Return the rates (segments, joints) at the start and end of each segment from the rates at waypoints."""
    return Rates(*(rate[:-1] for rate in rates)), Rates(*(rate[1:] for rate in rates))
