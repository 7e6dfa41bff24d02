"""A smoother curve through waypoints than the one that never overshoots, and so a faster one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.tool_motions.position_limits import first_beyond

if TYPE_CHECKING:
    from planner.paths import JointPath, Run
    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import SegmentedPolynomial

SHARES = (1.0, 0.5, 0.25, 0.0)
"""Shares of the spline in a joint's curve; the first one is taken with which it keeps its position limits."""


def smoothed(path: JointPath, run: Run) -> Run:
    """Put a run on a smoother curve, if the path between its waypoints is free."""
    return replace(run, curve=smooth_curve(path, run)) if run.is_spline else run


def smooth_curve(path: JointPath, run: Run) -> SegmentedPolynomial:
    """Return natural cubic spline through the waypoints of a run that is one, over the lengths of the run's own curve.

    Those are chords, measured by the joints' velocity limits. A joint that would overshoot its position limits is
    pulled towards the run's own curve, which keeps them.
    """
    positions = path.positions_of(run)
    spline = natural_spline(run.curve.lengths, positions)
    coefficients = np.zeros_like(run.curve.coefficients)
    coefficients[..., : spline.shape[2]] = spline
    attempt = np.zeros(positions.shape[1], dtype=int)
    while attempt.max() < len(SHARES):
        share = np.array(SHARES)[attempt][:, None]
        mixed = share * coefficients + (1.0 - share) * run.curve.coefficients
        curve = replace(run.curve, coefficients=mixed if attempt.any() else spline)
        beyond = first_beyond(path.robot, curve)
        if beyond is None:
            return curve
        attempt[beyond[2]] += 1
    return run.curve


def natural_spline(lengths: FloatArray, positions: FloatArray) -> FloatArray:
    """Coefficients (intervals, joints, 4) of the C2 cubic spline without curvature at both ends; ascending powers.

    The second derivatives m at the points solve a tridiagonal system: de Boor, A Practical Guide to Splines (2001),
    ch. IV.

    Args:
        lengths: Lengths (intervals,) in the path position.
        positions: Positions (intervals + 1, joints), rad or m.
    """
    h, slopes = lengths[:, None], np.diff(positions, axis=0) / lengths[:, None]
    count = len(positions)
    system = np.eye(count)
    inner = np.arange(1, count - 1)
    system[inner, inner - 1], system[inner, inner], system[inner, inner + 1] = (
        lengths[:-1],
        2.0 * (lengths[:-1] + lengths[1:]),
        lengths[1:],
    )
    right = np.zeros_like(positions)
    right[1:-1] = 6.0 * np.diff(slopes, axis=0)
    m = np.linalg.solve(system, right)
    terms = [positions[:-1], slopes - h * (2.0 * m[:-1] + m[1:]) / 6.0, m[:-1] / 2.0, np.diff(m, axis=0) / (6.0 * h)]
    return np.stack(terms, axis=-1)
