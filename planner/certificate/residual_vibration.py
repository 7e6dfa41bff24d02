"""The check of residual vibration: the amplitude that motions leave in a mode of the arm.

The deflection y of a mode behind joint position q obeys y'' + 2 d w y' + w^2 y = -q''. Its response to a piecewise
polynomial is integrated in closed form. The check knows nothing of impulses that shape a motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial

import numpy as np
from numpy.typing import ArrayLike

from planner.certificate.checks import Check
from planner.problems.residual_vibration import ResidualVibration
from planner.spatial import FloatArray
from planner.tolerances import POSITION_TOLERANCE
from planner.trajectories.extrema import derivatives_on_unit_time
from planner.trajectories.polynomials import PiecewisePolynomial

RESIDUAL_VIBRATION = "residual_vibration"
"""The quantity of the check: an amplitude, rad or m."""

MOST_RESIDUAL = 0.05
"""The largest share of the amplitude of an unshaped motion that a shaped one may leave."""

SAME_RATIO = 1e-6
"""Relative difference up to which two ratios are the same: joints of one time scaling have one. The largest amplitude
of them is reported."""

AMPLITUDE_KNOWN_TO = 1e-2
"""Relative amount by which the bound on an amplitude may exceed a value that is reached."""

MOST_FREQUENCIES = 20_000
"""Number of frequencies at which the amplitudes of a motion are computed, at most; the bound holds with fewer, too."""

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
        """Return the largest amplitudes (motions, joints) at the frequencies of the band."""
        each = zip(motions, zip(before, after, strict=True), strict=True)
        return np.array([residual_amplitudes(own, mode.band, mode.damping, ends).max(axis=0) for own, ends in each])

    peaks = largest(motions)
    limits = None if unshaped is None else np.maximum(MOST_RESIDUAL * largest(unshaped), POSITION_TOLERANCE)
    measures = np.ones_like(peaks) if limits is None else limits
    most = bound = float((peaks / measures).max())
    for k, own in enumerate(motions):
        reached, at_most = _bounded_share(own, mode, measures[k], (before[k], after[k]), most)
        most, bound = max(most, float((reached / measures[k]).max())), max(bound, at_most)
        peaks[k] = np.maximum(peaks[k], reached)
    shares = peaks / measures
    worst = np.where(shares >= (1.0 - SAME_RATIO) * shares.max(), peaks, -1.0)
    motion, joint = divmod(int(worst.argmax()), len(joint_names))
    return [
        Check(
            quantity=RESIDUAL_VIBRATION,
            joint=joint_names[joint],
            peak=bound * float(measures[motion, joint]),
            limit=None if limits is None else float(limits[motion, joint]),
            ratio=None if limits is None else bound,
            time=float(ends[motion]),
            method="bounded",
            enforced=limits is not None,
            bounded=True,
            lower=float(peaks[motion, joint]),
        )
    ]


def _bounded_share(
    motion: PiecewisePolynomial,
    mode: ResidualVibration,
    measures: FloatArray,
    around: tuple[FloatArray, FloatArray],
    most: float,
) -> tuple[FloatArray, float]:
    """Bound the amplitudes at all frequencies of a band, as shares of measures (joints,).

    Let F be the state of the mode, turned by exp(-i w sqrt(1 - d^2) T / 2). Between two frequencies, h apart, it is off
    its chord by at most h^2 / 8 times the largest |F''|, see `_largest_bend`.

    Args:
        motion: A motion from rest to rest.
        mode: The mode, with its band.
        measures: Amplitudes (joints,).
        around: Velocities (joints,) before and after the motion.
        most: A share that another motion reaches.

    Returns:
        The largest amplitudes (joints,) that were found, and a share that no joint exceeds.
    """
    damped = np.sqrt(1.0 - mode.damping**2)
    bend = _largest_bend(motion, mode, around)
    omegas = 2.0 * np.pi * mode.band
    amplitudes = residual_amplitudes(motion, mode.band, mode.damping, around)
    while True:
        lower, upper = omegas[:-1], omegas[1:]
        chords = np.maximum(amplitudes[:-1], amplitudes[1:] * (upper / lower)[:, None])
        rest = np.outer((upper - lower) ** 2 / (8.0 * damped * lower), bend)
        bounds = ((chords + rest) / measures).max(axis=1, initial=0.0)
        reached = float((amplitudes / measures).max())
        enough = max(most, reached) * (1.0 + AMPLITUDE_KNOWN_TO)
        left = np.flatnonzero(bounds > enough)
        if not len(left) or len(omegas) > MOST_FREQUENCIES:
            return amplitudes.max(axis=0), max(reached, float(bounds.max(initial=0.0)))
        middles = (lower[left] + upper[left]) / 2.0
        more = residual_amplitudes(motion, middles / (2.0 * np.pi), mode.damping, around)
        omegas, amplitudes = np.insert(omegas, left + 1, middles), np.insert(amplitudes, left + 1, more, axis=0)


def _largest_bend(
    motion: PiecewisePolynomial, mode: ResidualVibration, around: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Bound the second derivative (joints,) of the state of a mode by its frequency, rad/s, in the band.

    By parts m times, the integral is one of the derivative m + 2 of q, divided by the power m of the exponent s. The
    jumps of lower derivatives are terms of their own. The least of these bounds counts.
    """
    slowest, order = 2.0 * np.pi * float(mode.band[0]), motion.coefficients.shape[2]
    of = derivatives_on_unit_time(motion, order + 1)
    left = motion.breakpoints[-1] - motion.breakpoints
    reach = np.hypot(mode.damping * left, np.sqrt(1.0 - mode.damping**2) * (left - 0.5 * left[0]))
    still = np.zeros_like(around[0])
    jumps, bend = still, np.full_like(still, np.inf)
    for m in range(order - 1):
        weights = (reach**2 + 2.0 * m * reach / slowest + m * (m + 1) / slowest**2) / slowest**m
        before, after = around if m == 0 else (still, still)
        steps = np.vstack([of.starts[m + 1], after]) - np.vstack([before, of.ends[m + 1]])
        jumps = jumps + weights @ np.abs(steps)
        sizes = np.abs(of.bernstein[m + 2]).mean(axis=2) * motion.lengths[:, None]
        bend = np.minimum(bend, jumps + np.maximum(weights[:-1], weights[1:]) @ sizes)
    return bend


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
