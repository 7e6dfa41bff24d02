"""The exact check of a trajectory against its limits. Shares no code with the back ends.

Positions, velocities, accelerations and jerks are polynomials, so their extrema are found, not sampled:
Bernstein coefficients bound each polynomial on each of a few subintervals, and only where that bound could
beat the best value seen are the roots of the derivative computed. Torque and tool speed are not polynomials:
they are sampled, and the check says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import comb, copysign, sqrt
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from planner.backends.base import QUANTITIES, Guarantee
from planner.dynamics import inverse_dynamics
from planner.kinematics.forward import tool_speeds
from planner.trajectory import differentiate, horner

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.kinematics.poses import FloatArray
    from planner.limits import SegmentLimits
    from planner.robots import Robot
    from planner.trajectory import Trajectory

LIMIT_TOLERANCE = 1e-9
"""Relative excess over a limit that is rounding, not violation."""

CONTINUITY_TOLERANCE = 1e-8
"""Jump of a derivative, relative to its largest value, that is rounding."""

MOST_CONTINUOUS = 4
"""Continuity is looked into up to this derivative."""

SUBINTERVALS = 8
"""Parts of [0, 1] on which a polynomial is bounded by its Bernstein coefficients."""

NEARLY_REAL = 1e-6
"""Imaginary part, on unit time, up to which a computed root is taken for a real one: a double root splits."""

SAMPLES_PER_RADIAN, FEWEST_SAMPLES, MOST_SAMPLES = 150, 65, 1001
"""Samples of torque and tool speed on one piece, by the travel of its busiest joint (rad, or m)."""

ORDER_OF = {"position": 0, "velocity": 1, "acceleration": 2, "jerk": 3}


@dataclass(frozen=True)
class Check:
    """The worst of one quantity over the trajectory.

    Attributes:
        quantity: One of `QUANTITIES`.
        joint: The worst joint; None for the tool's speeds.
        peak: Its most extreme value: signed for a position, a magnitude otherwise.
        limit: The limit there; None: there is none.
        ratio: How much of the limit is used: 1 is all of it. A position counts from the middle of its range.
            None: no limit, or no bound.
        time: When, s.
        method: `exact` (extrema of polynomials) or `sampled`.
        enforced: Whether the back end promises to keep the limit.
        bounded: False where the quantity below jumps, so that this one has an impulse there that no peak
            measures (the jerk of a cubic at its ends).
    """

    quantity: str
    joint: str | None
    peak: float
    limit: float | None
    ratio: float | None
    time: float
    method: Literal["exact", "sampled"]
    enforced: bool
    bounded: bool

    @property
    def satisfied(self) -> bool:
        """Whether the quantity has a bound and stays within its limit."""
        if self.limit is None:
            return True
        return self.bounded and self.ratio is not None and self.ratio <= 1.0 + LIMIT_TOLERANCE


@dataclass(frozen=True)
class Certificate:
    """What was checked.

    Attributes:
        satisfied: Every enforced limit is kept.
        waypoint_error: Largest distance of a joint from its waypoint at the waypoint's arrival, rad or m.
        continuity: `C0`, `C1`, ...: the derivatives that are continuous, counting rest before and after; `none`.
        checks: One a quantity, in the order of `QUANTITIES`.
    """

    satisfied: bool
    waypoint_error: float
    continuity: str
    checks: tuple[Check, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {**vars(self), "checks": [vars(check) for check in self.checks]}


def certify(
    trajectory: Trajectory,
    robot: Robot,
    limits: SegmentLimits,
    guarantees: Mapping[str, Guarantee],
    waypoint_positions: FloatArray,
) -> Certificate:
    """Check a trajectory against the limits in force on each of its segments.

    Args:
        trajectory: From any source.
        robot: With its tool and payload.
        limits: Of each segment.
        guarantees: Which quantities are enforced.
        waypoint_positions: (waypoints, joints), to be met at the trajectory's arrivals.
    """
    smooth = _continuity(trajectory)
    checks = []
    for quantity in QUANTITIES:
        enforced = guarantees[quantity] is Guarantee.HARD
        if quantity in ORDER_OF:
            checks.append(_polynomial_check(trajectory, robot, limits, quantity, enforced, smooth))
        else:
            checks.extend(_sampled_check(trajectory, robot, limits, quantity, enforced))
    met = trajectory.evaluate(trajectory.arrivals, [0])[0]
    return Certificate(
        satisfied=all(check.satisfied for check in checks if check.enforced),
        waypoint_error=float(np.abs(met - waypoint_positions).max()),
        continuity=f"C{smooth}" if smooth >= 0 else "none",
        checks=tuple(checks),
    )


def _continuity(trajectory: Trajectory) -> int:
    """The highest k such that derivatives 0 to k are continuous, rest counted before and after; -1: none."""
    coefficients, ends = trajectory.coefficients, trajectory.lengths[:, None]
    for k in range(MOST_CONTINUOUS + 1):
        left = horner(coefficients, ends)
        right = coefficients[..., 0]
        jumps = np.abs(right[1:] - left[:-1]).max(initial=0.0)
        if k > 0:
            jumps = max(jumps, np.abs(right[0]).max(), np.abs(left[-1]).max())
        # A bound on the derivative all over, since it may vanish at every breakpoint.
        scale = horner(np.abs(coefficients), ends).max()
        if jumps > CONTINUITY_TOLERANCE * scale:
            return k - 1
        coefficients = differentiate(coefficients)
    return MOST_CONTINUOUS


def _polynomial_check(
    trajectory: Trajectory, robot: Robot, limits: SegmentLimits, quantity: str, enforced: bool, smooth: int
) -> Check:
    order = ORDER_OF[quantity]
    coefficients = trajectory.derivative_coefficients(order)
    if quantity == "position":
        lower, upper = limits.lower, limits.upper
        limited = np.isfinite(lower) & np.isfinite(upper)
        middle = np.where(limited, (np.where(limited, lower, 0.0) + np.where(limited, upper, 0.0)) / 2.0, 0.0)
        half = np.where(limited, (np.where(limited, upper, 0.0) - np.where(limited, lower, 0.0)) / 2.0, np.inf)
        coefficients = coefficients.copy()
        coefficients[:, :, 0] -= middle
        limit = np.broadcast_to(half, coefficients.shape[:2])
    else:
        middle = np.zeros(robot.dof)
        limit = getattr(limits, quantity)[trajectory.segments]
    # Without any limit the largest value is still worth knowing: measure every joint by 1.
    unlimited = not np.isfinite(limit).any()
    measure = np.ones_like(limit) if unlimited else limit
    piece, joint, tau, value = largest_magnitude(coefficients, trajectory.lengths, measure)
    bound = float(limit[piece, joint])
    has_limit, bounded = bool(np.isfinite(bound)), smooth >= order - 1
    return Check(
        quantity=quantity,
        joint=robot.joint_names[joint],
        peak=float(value + middle[joint]) if quantity == "position" else abs(value),
        limit=(float(middle[joint] + np.copysign(bound, value)) if quantity == "position" else bound)
        if has_limit
        else None,
        ratio=abs(value) / bound if has_limit and bounded else None,
        time=float(trajectory.breakpoints[piece] + tau),
        method="exact",
        enforced=enforced,
        bounded=bounded,
    )


def largest_magnitude(
    coefficients: FloatArray, lengths: FloatArray, measure: FloatArray
) -> tuple[int, int, float, float]:
    """Where |p| / measure is largest over all polynomials, exactly.

    Args:
        coefficients: (pieces, joints, order), ascending, in local time.
        lengths: (pieces,), the ends of local time.
        measure: (pieces, joints), positive; infinite entries never win against finite ones.

    Returns:
        Piece, joint, local time and value of p there.
    """
    joints, order = coefficients.shape[1:]
    unit = (coefficients * lengths[:, None, None] ** np.arange(order)).reshape(-1, order)
    weight = measure.reshape(-1, 1)
    ratios = (np.abs(unit @ _bernstein_matrix(order)) / weight).reshape(len(unit), SUBINTERVALS, order)
    upper = ratios.max(axis=2)
    # The first and last Bernstein coefficient of a subinterval are values of the polynomial: the best so far.
    ends = ratios[:, :, [0, -1]]
    best, part, end = (int(index) for index in np.unravel_index(np.argmax(ends), ends.shape))
    u, ratio = (part + end) / SUBINTERVALS, float(ends[best, part, end])
    for candidate, part in np.argwhere(upper > ratio * (1.0 + 1e-12)).tolist():
        if upper[candidate, part] <= ratio * (1.0 + 1e-12):
            continue  # overtaken by a root found meanwhile
        polynomial = unit[candidate].tolist()
        for root in _roots_of_derivative(polynomial, part / SUBINTERVALS, (part + 1) / SUBINTERVALS):
            there = abs(_value(polynomial, root)) / float(weight[candidate, 0])
            if there > ratio:
                best, u, ratio = candidate, root, there
    piece, joint = divmod(best, joints)
    return piece, joint, u * float(lengths[piece]), _value(unit[best].tolist(), u)


def _value(polynomial: Sequence[float], u: float) -> float:
    value = 0.0
    for coefficient in reversed(polynomial):
        value = value * u + coefficient
    return value


def _roots_of_derivative(polynomial: Sequence[float], start: float, end: float) -> list[float]:
    """Real roots in [start, end] of the derivative of a polynomial; ascending powers."""
    slope = [k * coefficient for k, coefficient in enumerate(polynomial)][1:]
    while slope and slope[-1] == 0.0:
        slope.pop()
    if len(slope) < 2:
        return []
    if len(slope) == 2:
        roots = [-slope[0] / slope[1]]
    elif len(slope) == 3:
        roots = _quadratic_roots(*slope)
    else:
        complex_roots = np.polynomial.polynomial.polyroots(slope)
        roots = complex_roots.real[np.abs(complex_roots.imag) < NEARLY_REAL].tolist()
    return [root for root in roots if start <= root <= end]


def _quadratic_roots(c: float, b: float, a: float) -> list[float]:
    """Real roots of a x^2 + b x + c, without cancellation; a != 0."""
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return []
    q = -0.5 * (b + copysign(sqrt(discriminant), b))
    return [q / a, c / q] if q != 0.0 else [0.0]


@lru_cache(maxsize=16)
def _bernstein_matrix(order: int) -> FloatArray:
    """(order, SUBINTERVALS * order): power coefficients on [0, 1] to Bernstein coefficients on each subinterval."""
    blocks = []
    degree = order - 1
    to_bernstein = np.array(
        [[comb(i, k) / comb(degree, k) if k <= i else 0.0 for i in range(order)] for k in range(order)]
    )
    for part in range(SUBINTERVALS):
        start, width = part / SUBINTERVALS, 1.0 / SUBINTERVALS
        # p(start + width v) in powers of v
        shift = np.array(
            [[comb(k, m) * start ** (k - m) * width**m if m <= k else 0.0 for m in range(order)] for k in range(order)]
        )
        blocks.append(shift @ to_bernstein)
    return np.hstack(blocks)


def _sampled_check(
    trajectory: Trajectory, robot: Robot, limits: SegmentLimits, quantity: str, enforced: bool
) -> list[Check]:
    """The check of a quantity that is not polynomial; empty where it has no limit (or, torque, no meaning)."""
    limit = getattr(limits, quantity)
    if not np.isfinite(limit).any() or (quantity == "torque" and not robot.has_dynamics):
        return []
    pieces, tau = _dense_times(trajectory)
    coefficients = trajectory.coefficients[pieces]
    column = tau[:, None]
    positions, velocities, accelerations = (horner(differentiate(coefficients, k), column) for k in range(3))
    if quantity == "torque":
        values = np.abs(inverse_dynamics(robot, positions, velocities, accelerations))
    else:
        linear, angular = tool_speeds(robot, positions, velocities)
        values = (linear if quantity == "tcp_linear_velocity" else angular)[:, None]
        limit = limit[:, None]
    limit = limit[trajectory.segments[pieces]]
    ratios = values / limit
    row, joint = np.unravel_index(int(np.argmax(ratios)), ratios.shape)
    return [
        Check(
            quantity=quantity,
            joint=robot.joint_names[joint] if quantity == "torque" else None,
            peak=float(values[row, joint]),
            limit=float(limit[row, joint]),
            ratio=float(ratios[row, joint]),
            time=float(trajectory.breakpoints[pieces[row]] + tau[row]),
            method="sampled",
            enforced=enforced,
            bounded=True,
        )
    ]


def _dense_times(trajectory: Trajectory) -> tuple[np.ndarray, FloatArray]:
    """Piece (N,) and local time (N,) of samples that see both ends of every piece."""
    ends = horner(trajectory.coefficients, trajectory.lengths[:, None])
    travel = np.abs(ends - trajectory.coefficients[..., 0]).max(axis=1)
    counts = np.clip(SAMPLES_PER_RADIAN * travel, FEWEST_SAMPLES, MOST_SAMPLES).astype(int)
    pieces = np.repeat(np.arange(len(counts)), counts)
    tau = np.concatenate([np.linspace(0.0, h, n) for h, n in zip(trajectory.lengths, counts, strict=True)])
    return pieces, tau
