"""Problems of splines, and checks of their samples."""

from __future__ import annotations

import numpy as np

from planner.limits import Bounds, SegmentLimits

INF = np.inf


def spline_limits(lower, upper, velocity, acceleration, jerk):
    """Return the limits of a spline; nothing else is limited."""
    rates = map(Bounds.of_magnitudes, (velocity, acceleration, jerk, np.full_like(velocity, INF)))
    return SegmentLimits(Bounds(lower, upper), *rates)


def samples(spline, order=0, count=201):
    """Sample the derivative of that order at unit times 0 to 1 of each segment; (segments, count, joints)."""
    coefficients = spline.coefficients
    for _ in range(order):
        coefficients = coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])
    tau = np.linspace(0.0, 1.0, count) * spline.lengths[:, None]
    return np.einsum("njk,nuk->nuj", coefficients, tau[:, :, None] ** np.arange(coefficients.shape[-1]))


def excess(spline, limits, degree):
    """Return the worst sampled |derivative| / limit, brought to first order, and the overshoot, by segment."""
    worst = np.zeros(len(spline.lengths))
    for order, quantity in enumerate(("velocity", "acceleration", "jerk")[: (degree + 1) // 2], start=1):
        values = np.abs(samples(spline, order)).max(axis=1)
        worst = np.maximum(worst, ((values / limits.magnitudes(quantity)) ** (1.0 / order)).max(axis=1))
    positions = samples(spline)
    return worst, max((positions - limits.position.upper).max(), (limits.position.lower - positions).max())


def random_problem(seed, segments, joints, room=INF):
    """Draw waypoints and limits; position limits lie `room` times the joint's range beyond the waypoints."""
    rng = np.random.default_rng(seed)
    positions = rng.uniform(-2.0, 2.0, (segments + 1, joints))
    room = np.ptp(positions, axis=0) * room
    scale = rng.uniform(0.5, 1.0, (segments, joints))
    limits = spline_limits(
        positions.min(axis=0) - room, positions.max(axis=0) + room, 2.0 * scale, 6.0 * scale, 60.0 * scale
    )
    return positions, limits


def free(segments):
    return np.full(segments, np.nan)
