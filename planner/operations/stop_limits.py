"""The limits of a stop on a path, and how the law of its time depends on what is sought; see `stopping_on_path`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.kinematics.forward import JointStates
from planner.tolerances import LIMIT_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.limits import SegmentLimits
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.trajectories.trajectory import Trajectory

INTERVALS = 20
"""Number of intervals of time on which the highest derivative is constant: on straight lines with jerk limits, which
have a stop in closed form (`stopping_on_line`), the stop would be slower than that by 1 to 8 %, soon after the start by
up to 16 % (0.110 s for 0.095 s)."""

PROBES = np.array([0.0, 0.5, 1.0])
"""Shares of each interval at which limits are held."""

FREE = 0.25
"""Share of the duration over which half of the margin grows from nothing where the trajectory uses all of a limit."""

GROWTH = np.minimum((np.arange(INTERVALS)[:, None] + PROBES).reshape(-1, 1) / INTERVALS / FREE, 1.0)
"""Share of that half which is left free at each probe (points, 1)."""


class Term(NamedTuple):
    """Values that are limited at the probes.

    Attributes:
        kind: `velocity`, `acceleration` or `jerk`: how they go with sigma and its derivatives.
        coefficients: Of sigma^k and so on, each (points, values).
        offset: What is there at rest, (points, values).
        limit: (points, values).
    """

    kind: str
    coefficients: tuple[FloatArray, ...]
    offset: FloatArray
    limit: FloatArray


@dataclass(frozen=True, eq=False)
class Law:
    """How s and its derivatives depend on the constants (INTERVALS,), in units of the duration.

    Attributes:
        order: The derivative of sigma that is constant on each interval.
        maps: (order + 2, points, INTERVALS): s, sigma and its derivatives at the probes, less what they are without.
    """

    order: int
    maps: FloatArray

    @classmethod
    def of_order(cls, order: int) -> Law:
        """Return the maps by integration from interval to interval."""
        h, count = 1.0 / INTERVALS, order + 2
        state = np.zeros((count, INTERVALS))  # from s on, at the start of an interval
        maps = np.zeros((count, INTERVALS, len(PROBES), INTERVALS))
        for k in range(INTERVALS):
            state[-1] = np.eye(INTERVALS)[k]
            for probe, share in enumerate(PROBES.tolist()):
                maps[:, k, probe] = _integrated(state, share * h)
            state = _integrated(state, h)
        return cls(order, maps.reshape(count, -1, INTERVALS))


def _integrated(state: FloatArray, time: float) -> FloatArray:
    """Return a state and its derivatives, the last of which is constant, after a time: Taylor's formula."""
    result = np.zeros_like(state)
    for k in range(len(state)):
        factor = 1.0
        for n in range(k, len(state)):
            result[k] += factor * state[n]
            factor *= time / (n - k + 1)
    return result


class StopLimits:
    """The limits of a stop along a path.

    Attributes:
        length: The path position at which the path ends, s of the given trajectory.
        guess: A first guess of the duration, s.
        ends_at_rest: Whether the trajectory is at rest at its end.
    """

    def __init__(
        self, robot: Robot, path: Trajectory, limits: SegmentLimits, kept: frozenset[str], margin: float
    ) -> None:
        self.robot, self.path, self.kept = robot, path, kept
        self.margin = margin
        self.limits = limits
        self.length = path.duration
        (v0, v1) = path.evaluate(np.array([0.0, self.length]), [1])[0]
        self.ends_at_rest = bool(np.abs(v1).max() <= 1e-9 * max(np.abs(v0).max(), 1e-300))
        with np.errstate(divide="ignore", invalid="ignore"):
            acceleration, jerk = limits.acceleration.narrower[0], limits.jerk.narrower[0]
            times = np.abs(v0) / acceleration + acceleration / jerk
            times = np.where(np.isfinite(times), times, 0.0)
        self.guess = max(float(times.max()), 1e-3 * self.length)
        others = {constraint.name for constraint, _ in limits.constraints if constraint not in limits.further} - kept
        self.constraints = [own for own in limits.without(others).constraints if own[0].is_known(robot)]

    @property
    def are_none(self) -> bool:
        """Whether nothing is limited."""
        return not self._limited(np.zeros(1))

    def _terms(self, s: FloatArray) -> Iterator[Term]:
        """Yield what is limited: its kind, its coefficients, its offset and its bound, each (points, values)."""
        for kind, coefficients, offset, limit in self._limited(s):
            own = np.abs(coefficients[0] + offset) * (1.0 - 0.5 * self.margin * GROWTH)  # of the trajectory itself
            yield Term(kind, coefficients, offset, np.minimum(limit, np.maximum((1.0 - self.margin) * limit, own)))

    def _limited(self, s: FloatArray) -> list[Term]:
        """Return what is limited: its kind, its coefficients, its offset and its limit, each (points, values)."""
        q, first, second, third = self.path.evaluate(np.clip(s, 0.0, self.length), range(4))
        zero = np.zeros_like(first)
        terms: list[Term] = []
        for quantity, coefficients in (
            ("velocity", (first,)),
            ("acceleration", (second, first)),
            ("jerk", (third, second, first)),
        ):
            limit = self.limits.magnitudes(quantity)[0]
            if quantity in self.kept and np.isfinite(limit).any():
                terms.append(Term(quantity, coefficients, zero, np.tile(limit, (len(s), 1))))
        states = JointStates(self.robot, q, first, second)
        for constraint, bounds in self.constraints:
            if not (constraint.has_rows or constraint.follows_path_speed):
                continue
            if constraint.has_rows:
                by_u, by_x, rest = constraint.rows(states)
            else:
                by_x = constraint.values(states)
                by_u = rest = np.zeros_like(by_x)
            middle, half = (np.repeat(side[0], by_x.shape[1] // side.shape[1]) for side in bounds.centred)
            kind, coefficients = ("velocity", (by_x,)) if constraint.order == 1 else ("acceleration", (by_x, by_u))
            terms.append(Term(kind, coefficients, rest - middle, np.tile(half, (len(s), 1))))
        return terms

    def broken(self, s: FloatArray, states: FloatArray) -> float:
        """Find by how much of its limit the worst is exceeded, first probe aside; no more than 0: all are kept."""
        sigma, d1, d2 = (values[:, None] for values in states)
        worst = -np.inf
        if (s < -LIMIT_TOLERANCE).any() or (s > self.length * (1.0 + LIMIT_TOLERANCE)).any():
            return np.inf
        for kind, coefficients, offset, limit in self._terms(s):
            match kind:
                case "velocity":
                    value = coefficients[0] * sigma
                case "acceleration":
                    value = coefficients[0] * sigma**2 + coefficients[1] * d1
                case _:
                    value = coefficients[0] * sigma**3 + 3.0 * coefficients[1] * sigma * d1 + coefficients[2] * d2
            worst = max(worst, float((np.abs(value + offset) / limit)[1:].max()) - 1.0)
        return worst - LIMIT_TOLERANCE

    def linearised(self, law: Law, s: FloatArray, states: FloatArray, duration: float) -> tuple[FloatArray, FloatArray]:
        """All limits as rows A x <= b of the constants and the excess, about a law."""
        sigma, d1, _ = (values[:, None] for values in states)
        maps = [law.maps[1 + k] / duration**k if k <= law.order else np.zeros_like(law.maps[1]) for k in range(3)]
        rows, rhs = [], []
        for kind, coefficients, offset, limit in self._terms(s):
            match kind:
                case "velocity":
                    by, constant = [coefficients[0]], coefficients[0]
                case "acceleration":
                    by = [2.0 * coefficients[0] * sigma, coefficients[1]]
                    constant = coefficients[0] * (2.0 * sigma - sigma**2)
                case _:
                    q3, q2, q1 = coefficients
                    by = [3.0 * q3 * sigma**2 + 3.0 * q2 * d1, 3.0 * q2 * sigma, q1]
                    # sigma is 1 plus what the constants make of it
                    constant = q3 * (3.0 * sigma**2 - 2.0 * sigma**3) + 3.0 * q2 * (d1 - sigma * d1)
            there = np.isfinite(limit)
            there[0] = False  # that is given
            value = sum(c[:, :, None] * m[:, None, :] for c, m in zip(by, maps[: len(by)], strict=True))
            value = (value / limit[..., None])[there]
            given = ((constant + offset) / limit)[there]
            for sign in (1.0, -1.0):
                rows.append(np.hstack([sign * value, -np.ones((len(value), 1))]))
                rhs.append(1.0 - sign * given)
        return np.vstack(rows), np.concatenate(rhs)
