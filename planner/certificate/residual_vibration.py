"""The check of residual vibration: the amplitude that motions leave in a mode of the arm.

The deflection y of a mode behind joint position q obeys y'' + 2 d w y' + w^2 y = -q''. Its response to a piecewise
polynomial is integrated in closed form. The check knows nothing of impulses that shape a motion.
"""

from __future__ import annotations

from math import factorial
from typing import TYPE_CHECKING

import numpy as np

from planner.certificate.checks import Check
from planner.tolerances import POSITION_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from planner.problems.residual_vibration import ResidualVibration
    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import PiecewisePolynomial

RESIDUAL_VIBRATION = "residual_vibration"
"""The quantity of the check: an amplitude, rad or m."""

MOST_RESIDUAL = 0.05
"""The largest share of the amplitude of an unshaped motion that a shaped one may leave."""

SAME_RATIO = 1e-6
"""Relative difference up to which two ratios are the same: joints of one time scaling have one. The largest amplitude
of them is reported."""

MOST_MOMENTS = 500_000
"""Number of moments that are computed together, which take 8 MB."""

SERIES_UP_TO = 4.0
"""Magnitude of an exponent up to which moments come from a series."""

SERIES_TERMS = 32
"""Terms of this series: the next one is below 1e-16."""


def residual_amplitudes(
    motion: PiecewisePolynomial,
    frequencies: ArrayLike,
    damping: float = 0.0,
    around: tuple[FloatArray, FloatArray] | None = None,
) -> FloatArray:
    """Compute the amplitudes (frequencies, joints) of a mode that a motion excites from rest, at its end, rad or m.

    Args:
        motion: The joint positions by time.
        frequencies: Natural frequencies of the undamped mode (frequencies,), Hz.
        damping: Its damping ratio.
        around: Velocities (joints,) before the motion and after it, rad/s or m/s; None: rest.

    Examples:
        >>> import planner
        >>> robot = planner.load_robot("kuka_kr16_2")
        >>> home = planner.JointWaypoint([0.0, -1.5, 1.5, 0.0, 0.5, 0.0])
        >>> pick = planner.JointWaypoint([1.0, -1.2, 1.2, 0.0, 0.5, 0.5])
        >>> plan = planner.plan(planner.PlanningProblem(robot, [home, pick]), "trapezoidal")
        >>> print(planner.residual_amplitudes(plan.trajectory, [9.0], 0.02).round(6))
        [[0.005643 0.001693 0.001693 0.       0.       0.002822]]
    """
    rates = motion.derivative_coefficients(1)
    pieces, joints, order = rates.shape
    by_unit = rates * motion.lengths[:, None, None] ** np.arange(1, order + 1)
    by_unit = by_unit.transpose(0, 2, 1).reshape(pieces * order, joints)
    to_end = motion.breakpoints[-1] - motion.breakpoints
    before, after = around or (np.zeros(joints),) * 2
    damped = np.sqrt(1.0 - damping**2)
    omegas = 2.0 * np.pi * np.asarray(frequencies, dtype=np.float64)
    amplitudes = []
    for some in np.array_split(omegas, 1 + len(omegas) * len(by_unit) // MOST_MOMENTS):
        poles = some[:, None] * complex(-damping, damped)
        moments = _moments((poles * motion.lengths).ravel(), order).reshape(len(some), pieces, order)
        weights = (moments * np.exp(poles * to_end[1:])[:, :, None]).reshape(len(some), -1)
        # By parts, the integral of accelerations is one of velocities, with the jumps of the velocity in it.
        states = poles * (weights @ by_unit) + after - before * np.exp(poles * to_end[0])
        amplitudes.append(np.abs(states) / (some[:, None] * damped))
    return np.concatenate(amplitudes)


def certify_residual_vibration(
    mode: ResidualVibration,
    joint_names: Sequence[str],
    motions: Sequence[PiecewisePolynomial],
    ends: FloatArray,
    around: tuple[FloatArray, FloatArray],
    unshaped: Sequence[PiecewisePolynomial] | None = None,
) -> list[Check]:
    """Find the largest amplitude that a motion leaves in a mode of the requested band.

    Args:
        mode: The mode, with its band.
        joint_names: The names of the joints.
        motions: Motions from rest to rest. Each excites the mode from rest.
        ends: The times (motions,) of their ends, s.
        around: Velocities (joints,) before the first motion and after the last, rad/s or m/s.
        unshaped: The same motions before they were shaped, which set the limits; None: no limits.

    Returns:
        The check of the joint and the motion that are worst; none if there is no motion.
    """
    if not len(motions):
        return []
    still = np.zeros(len(joint_names))
    before, after = [around[0], *[still] * (len(motions) - 1)], [*[still] * (len(motions) - 1), around[1]]

    def largest(motions: Sequence[PiecewisePolynomial]) -> FloatArray:
        """Return the largest amplitudes (motions, joints) in the band."""
        each = zip(motions, zip(before, after, strict=True), strict=True)
        return np.array([residual_amplitudes(own, mode.band, mode.damping, ends).max(axis=0) for own, ends in each])

    peaks = largest(motions)
    limits = None if unshaped is None else np.maximum(MOST_RESIDUAL * largest(unshaped), POSITION_TOLERANCE)
    shares = peaks if limits is None else peaks / limits
    worst = np.where(shares >= (1.0 - SAME_RATIO) * shares.max(), peaks, -1.0)
    motion, joint = divmod(int(worst.argmax()), len(joint_names))
    peak, limit = float(peaks[motion, joint]), None if limits is None else float(limits[motion, joint])
    return [
        Check(
            quantity=RESIDUAL_VIBRATION,
            joint=joint_names[joint],
            peak=peak,
            limit=limit,
            ratio=None if limit is None else peak / limit,
            time=float(ends[motion]),
            method="sampled",
            enforced=limit is not None,
            bounded=True,
        )
    ]


def _moments(exponents: np.ndarray, count: int) -> np.ndarray:
    """Return integrals (N, count) over u from 0 to 1 of u^k exp(x (1 - u)) for exponents x (N,).

    The recursion m_k = (k m_(k-1) - 1) / x is stable upwards for large exponents, and downwards for small ones.
    """
    moments = np.empty((len(exponents), count), dtype=complex)
    small = np.abs(exponents) <= SERIES_UP_TO
    x, last = exponents[small], count - 1
    terms = [factorial(last) / factorial(last + n + 1) for n in range(SERIES_TERMS)]
    moments[small, last] = np.polynomial.polynomial.polyval(x, terms)
    for k in range(last, 0, -1):
        moments[small, k - 1] = (1.0 + x * moments[small, k]) / k
    x = exponents[~small]
    moments[~small, 0] = np.expm1(x) / x
    for k in range(1, count):
        moments[~small, k] = (k * moments[~small, k - 1] - 1.0) / x
    return moments
