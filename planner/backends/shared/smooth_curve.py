"""A smoother curve through waypoints than the one that never overshoots, and so a faster one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.tool_motions.position_limits import first_beyond
from planner.trajectories.splines import natural_spline

if TYPE_CHECKING:
    from planner.paths import JointPath, Run
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
