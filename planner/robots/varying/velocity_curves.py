"""Velocity limits of a joint that depend on its position: parabolas and tables, and their values for whole arms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.spatial import FloatArray

LEAST_SPEED = 1e-9
"""rad/s or m/s: a curve allows no less anywhere, and slower motion counts as rest."""

LEAST_OF_TABLE = 1e-6
"""Least velocity in a table, rad/s or m/s, as in all limits of joints."""

MOST_POINTS_OF_TABLE = 64
"""Number of points that a table may have."""


@dataclass(frozen=True)
class VelocityParabola:
    """A limit of the speed |v| towards a position: (|v| + offset)^2 <= rate * distance to `end`.

    A joint that follows it decelerates by half the rate at most.

    Attributes:
        rate: Positive, rad/s^2 or m/s^2.
        end: The position that the joint moves towards, rad or m.
        offset: Not negative, rad/s or m/s.
    """

    rate: float
    end: float
    offset: float = 0.0


@dataclass(frozen=True)
class VelocityTable:
    """A limit of the speed |v| by position, linear between the points and constant beyond the first and last one.

    Attributes:
        positions: Ascending, rad or m.
        velocities: The limits there, positive, rad/s or m/s.

    Examples:
        >>> import planner
        >>> slow_at_the_end = planner.VelocityTable(positions=(1.0, 1.5), velocities=(2.0, 0.5))
        >>> curves = {"joint_a1": {"velocity_curves": planner.VelocityCurves(upper=(slow_at_the_end,))}}
        >>> planner.load_robot("kuka_kr16_2").derived(limits=curves).joints[0].velocity_curves.upper[0].velocities
        (2.0, 0.5)
    """

    positions: tuple[float, ...]
    velocities: tuple[float, ...]


VelocityCurve = VelocityParabola | VelocityTable


@dataclass(frozen=True)
class VelocityCurves:
    """The velocity limits of a joint by its position, beside its limit for all positions; every curve holds.

    Attributes:
        upper: The curves for motion towards larger positions.
        lower: The curves for motion towards smaller positions; their values are magnitudes, too.
    """

    upper: tuple[VelocityCurve, ...] = ()
    lower: tuple[VelocityCurve, ...] = ()

    def __bool__(self) -> bool:
        """Tell whether there is any curve."""
        return bool(self.upper or self.lower)

    def with_others(self, others: VelocityCurves) -> VelocityCurves:
        """Return the curves of both, each once."""
        sides = ((self.upper, others.upper), (self.lower, others.lower))
        upper, lower = (tuple(dict.fromkeys((*own, *more))) for own, more in sides)
        return VelocityCurves(upper, lower)


NO_CURVES = VelocityCurves()
"""The curves of a joint whose velocity limits are the same at all positions."""


@dataclass(frozen=True, eq=False)
class VelocityConditions:
    """The velocity curves of all joints: square w^2 + linear w <= constant + slope p for p in [low, high].

    Here p and w are position and velocity; in the second row of each array, of motion towards smaller positions, they
    are both negated. Each array is (2, joints, conditions); unused conditions have an empty range.
    """

    square: FloatArray
    linear: FloatArray
    constant: FloatArray
    slope: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, curves: Sequence[VelocityCurves]) -> VelocityConditions:
        """Return the conditions of the curves of joints."""
        upper = [list(_conditions(own.upper, 1.0)) for own in curves]
        lower = [list(_conditions(own.lower, -1.0)) for own in curves]
        most = max(map(len, (*upper, *lower)))
        unused = (0.0, 1.0, 0.0, 0.0, np.inf, -np.inf)
        padded = np.array([[own + [unused] * (most - len(own)) for own in side] for side in (upper, lower)])
        return cls(*np.moveaxis(padded.reshape(2, len(curves), most, 6), 3, 0))

    def within(self, errors: FloatArray) -> VelocityConditions:
        """Return conditions that hold at all positions up to errors (joints,) away, rad or m."""
        away = errors[:, None]
        room = self.constant - np.abs(self.slope) * away
        return replace(self, constant=room, low=self.low - away, high=self.high + away)

    @property
    def arrays(self) -> tuple[FloatArray, ...]:
        """All arrays, in the order of the attributes."""
        return self.square, self.linear, self.constant, self.slope, self.low, self.high

    def speeds(self, side: np.ndarray, joint: np.ndarray, p: FloatArray) -> FloatArray:
        """Return the largest speeds (...) at positions p (...), negated in the second row; infinite: none.

        Args:
            side: The rows (...): 0 or 1.
            joint: The joints (...).
            p: The positions (...).
        """
        result = np.full(p.shape, np.inf)
        for k in range(self.square.shape[2]):
            square, linear, constant, slope, low, high = (values[side, joint, k] for values in self.arrays)
            room = np.maximum(constant + slope * p, 0.0)
            speeds = 2.0 * room / np.maximum(linear + np.sqrt(linear**2 + 4.0 * square * room), LEAST_SPEED)
            holds = (low <= p) & (p <= high)
            result = np.where(holds, np.minimum(result, np.maximum(speeds, LEAST_SPEED)), result)
        return result

    def allowed(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the largest speeds towards larger and towards smaller positions, both of the shape (..., joints)."""
        joint, up = np.arange(positions.shape[-1]), np.zeros(positions.shape, dtype=int)
        joints = np.broadcast_to(joint, positions.shape)
        return self.speeds(up, joints, positions), self.speeds(up + 1, joints, -positions)

    def shares(self, positions: FloatArray, velocities: FloatArray) -> FloatArray:
        """Return the shares (..., joints) of the allowed speeds that velocities (..., joints) at positions use."""
        speeds, down = np.abs(velocities), velocities <= 0.0
        joints = np.broadcast_to(np.arange(positions.shape[-1]), positions.shape)
        allowed = self.speeds(down.astype(int), joints, np.where(down, -positions, positions))
        return np.where(speeds > LEAST_SPEED, speeds / allowed, 0.0)


def _conditions(curves: Sequence[VelocityCurve], sign: float) -> Iterator[tuple[float, ...]]:
    """Yield square, linear, constant, slope, low and high of each condition of curves."""
    for curve in curves:
        if isinstance(curve, VelocityParabola):
            constant = curve.rate * sign * curve.end - curve.offset**2
            yield 1.0, 2.0 * curve.offset, constant, -curve.rate, -np.inf, np.inf
            continue
        p, v = sign * np.array(curve.positions), np.array(curve.velocities)
        order = np.argsort(p)
        p, v = p[order], v[order]
        yield 0.0, 1.0, v[0], 0.0, -np.inf, p[0]
        for k, slope in enumerate(np.diff(v) / np.diff(p)):
            yield 0.0, 1.0, v[k] - slope * p[k], slope, p[k], p[k + 1]
        yield 0.0, 1.0, v[-1], 0.0, p[-1], np.inf


def curve_faults(curve: VelocityCurve) -> Iterator[str]:
    """Yield the faults of a curve."""
    if isinstance(curve, VelocityParabola):
        if not np.isfinite((curve.rate, curve.end, curve.offset)).all():
            yield "the numbers of a parabola must be finite"
        elif not curve.rate > 0.0 or curve.offset < 0.0:
            yield "the rate of a parabola must be positive, and its offset not negative"
        return
    if len(curve.positions) != len(curve.velocities) or not 2 <= len(curve.positions) <= MOST_POINTS_OF_TABLE:
        yield f"a table must have 2 to {MOST_POINTS_OF_TABLE} positions, and as many velocities"
    elif not np.isfinite((curve.positions, curve.velocities)).all():
        yield "the numbers of a table must be finite"
    elif not (np.diff(curve.positions) > 0.0).all():
        yield "the positions of a table must ascend"
    elif not min(curve.velocities) >= LEAST_OF_TABLE:
        yield f"the velocities of a table must be at least {LEAST_OF_TABLE:g}"
