"""Straight joint motions, in closed form unless torque or tool speed slow them; smoother curves through waypoints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from planner.errors import InfeasibleDuration, PlanningError
from planner.paths import JointPath, SegmentGroup, StraightMotions
from planner.time_scaling.refusals import infeasible_duration_error
from planner.time_scaling.sampled_limits import SampledLimits
from planner.tolerances import DURATION_TOLERANCE
from planner.tool_motions.position_limits import first_beyond
from planner.trajectories.polynomials import SegmentedPolynomial
from planner.trajectories.splines import natural_spline

NOTICED = 1.01
"""Factor on a duration that is worth another way."""


def time_lines(
    path: JointPath,
    motions: StraightMotions,
    closed_form: Callable[[StraightMotions], SegmentedPolynomial],
    time_group: Callable[[SegmentGroup], SegmentedPolynomial],
    noticed: float = NOTICED,
) -> list[SegmentedPolynomial]:
    """Time each straight line in its requested or its shortest duration.

    A time scaling in closed form, stretched until it keeps torque and tool speed, is slow everywhere. A time scaling
    along the line is slow only at the places that need it.

    Args:
        path: The path that the motions belong to.
        motions: Straight motions of this path.
        closed_form: The fastest time scaling by the joints' own limits.
        time_group: The fastest found along a curve by all limits.
        noticed: The factor on a duration above which that motion is computed.

    Raises:
        InfeasibleDuration: Requested durations are too short; the error has feasible ones.
        LimitsUnsatisfiable: Nothing limits a duration, or gravity exceeds a torque limit.
    """
    if not len(motions.segments):
        return []
    limits, sampled = motions.limits, SampledLimits(motions.dynamics, motions.limits)
    if not sampled.limited.any():
        return [closed_form(motions)]
    try:
        pieces = closed_form(
            replace(motions, limits=limits.without([constraint.name for constraint, _ in limits.constraints]))
        )
    except PlanningError:
        return [closed_form(motions)]  # the refusal is to know all limits
    pieces = pieces.of(pieces.lengths > 0.0)
    rows = np.searchsorted(motions.segments, pieces.segments)
    factors, binding = sampled.stretch(pieces, rows, rows, above=1.0)
    free = np.isnan(motions.durations)
    slowed = factors > np.where(free, noticed, 1.0 + DURATION_TOLERANCE)
    whole = pieces.stretched(np.where(free, np.maximum(factors, 1.0), 1.0)[rows])
    parts, too_short = [whole.of(~slowed[rows])], {}
    for group, row in zip(path.straight_groups(motions.segments[slowed]), np.flatnonzero(slowed), strict=True):
        own = whole.of(rows == row)
        try:
            along = time_group(group)
            parts.append(min(own, along, key=lambda part: float(part.lengths.sum())) if free[row] else along)
        except InfeasibleDuration as refusal:
            needed = float(motions.durations[row] * factors[row])
            too_short[group.first] = min(needed, refusal.limit or np.inf)
    if too_short:
        first = next(iter(too_short))
        at = int(np.searchsorted(motions.segments, first))
        raise infeasible_duration_error(float(motions.durations[at]), too_short, sampled.each[binding[at]])
    return parts


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
