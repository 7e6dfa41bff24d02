"""A smoother curve through waypoints than the one that never overshoots, and so a faster one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.paths import JointPath, SegmentGroup
from planner.tool_motions.position_limits import first_beyond
from planner.trajectories.polynomials import SegmentedPolynomial
from planner.trajectories.splines import natural_spline

SPLINE_SHARES = (1.0, 0.5, 0.25, 0.0)
"""Shares of the spline in a joint's curve; the first one is taken with which it keeps its position limits."""


def smoothed(path: JointPath, group: SegmentGroup) -> SegmentGroup:
    """Put a segment group on a smoother curve, if the path between its waypoints is free."""
    return replace(group, curve=smooth_curve(path, group)) if group.is_spline else group


def smooth_curve(path: JointPath, group: SegmentGroup) -> SegmentedPolynomial:
    """Return the natural cubic spline through the waypoints of a spline group, over the lengths of its own curve.

    These lengths are chords, measured by the joints' velocity limits. A joint that would overshoot its position limits
    is pulled towards the group's own curve, which keeps them.
    """
    positions = path.positions_of(group)
    spline = natural_spline(group.curve.lengths, positions)
    coefficients = np.zeros_like(group.curve.coefficients)
    coefficients[..., : spline.shape[2]] = spline
    attempt = np.zeros(positions.shape[1], dtype=int)
    while attempt.max() < len(SPLINE_SHARES):
        share = np.array(SPLINE_SHARES)[attempt][:, None]
        mixed = share * coefficients + (1.0 - share) * group.curve.coefficients
        curve = replace(group.curve, coefficients=mixed if attempt.any() else spline)
        beyond = first_beyond(path.robot, curve)
        if beyond is None:
            return curve
        attempt[beyond[2]] += 1
    return group.curve
