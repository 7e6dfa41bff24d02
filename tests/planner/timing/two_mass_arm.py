"""A two-mass arm: each motor follows its joint, and a spring with a damper moves a mass behind it."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from planner.spatial import FloatArray
from planner.trajectories.polynomials import PiecewisePolynomial

PERIODS_AFTER = 1.2
"""The time for which the masses are watched after the end of a motion, in periods of the undamped mode."""

WATCHED = np.linspace(0.0, 1.0, 300)
"""Shares of this time at which deflections are measured: a crest is missed by 8e-5 of its height at most."""


def vibration_after(motion: PiecewisePolynomial, frequency: float, damping: float) -> FloatArray:
    """Return the amplitudes (joints,) of the masses after a motion, rad or m, by integration from piece to piece.

    They are the largest deflections from the joints, divided by the decay since the end of the motion.
    """
    omega = 2.0 * np.pi * frequency
    state = np.concatenate([motion.coefficients[0, :, 0], np.zeros(motion.coefficients.shape[1])])
    for length, coefficients in zip(motion.lengths.tolist(), motion.coefficients, strict=True):
        state = _integrated(coefficients, np.array([0.0, length]), state, omega, damping)[:, -1]
    rest = motion.evaluate(motion.breakpoints[-1:], [0])[0].T
    times = WATCHED * PERIODS_AFTER / frequency
    deflections = _integrated(rest, times, state, omega, damping)[: len(rest)] - rest
    largest: FloatArray = np.abs(deflections * np.exp(damping * omega * times)).max(axis=1)
    return largest


def _integrated(
    coefficients: FloatArray, times: FloatArray, state: FloatArray, omega: float, damping: float
) -> FloatArray:
    """Return positions and velocities (2 x joints, times) of the masses while the joints are at polynomials of time."""
    joints, order = coefficients.shape
    powers = np.arange(order)
    slopes = (coefficients * powers)[:, 1:] if order > 1 else np.zeros((joints, 1))

    def rates(t: float, y: FloatArray) -> FloatArray:
        position, velocity = coefficients @ t**powers, slopes @ t ** np.arange(slopes.shape[1])
        forces = omega**2 * (position - y[:joints]) + 2.0 * damping * omega * (velocity - y[joints:])
        return np.concatenate([y[joints:], forces])

    found = solve_ivp(rates, times[[0, -1]], state, "DOP853", t_eval=times, rtol=1e-10, atol=1e-13)
    assert found.success
    positions: FloatArray = found.y
    return positions
