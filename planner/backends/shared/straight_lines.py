"""Straight joint motions from rest to rest, in closed form unless torque or tool speed slow them down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from planner.errors import InfeasibleDuration, PlanningError
from planner.paths import JointPath, SegmentGroup, StraightMotions
from planner.time_scaling.refusals import infeasible_duration_error
from planner.time_scaling.sampled_limits import SampledLimits
from planner.tolerances import DURATION_TOLERANCE
from planner.trajectories.polynomials import SegmentedPolynomial

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
    limits, sampled = motions.limits, SampledLimits(motions.dynamics, motions.limits)
    if not sampled.limited.any():
        return [closed_form(motions)] if len(motions.segments) else []
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
