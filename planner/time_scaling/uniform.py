"""Motions scaled in time: the factor on the time of each segment with which it just keeps its limits."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from planner.constraints import measures
from planner.guarantees import JOINT_DERIVATIVES
from planner.paths import JointPath, SegmentGroup
from planner.time_scaling.refusals import BindingLimit, infeasible_duration_error, no_duration_error
from planner.time_scaling.sampled_limits import SampledLimits
from planner.tolerances import DURATION_TOLERANCE
from planner.trajectories.extrema import derivatives_on_unit_time, largest_magnitudes
from planner.trajectories.polynomials import SegmentedPolynomial
from planner.trajectories.sampled_peaks import DERIVATIVES


class TimeScaling(NamedTuple):
    """The factor on all times with which a segment just keeps its limits, and the limit that sets it.

    Attributes:
        factor: The factor, less than 1 where the segment could be faster.
        binding: The limit that sets the factor.
    """

    factor: float
    binding: BindingLimit


def slowest(needed: Iterable[TimeScaling]) -> TimeScaling:
    """Return the one with the largest factor."""
    return max(needed, key=lambda scaling: scaling.factor)


def time_scalings(path: JointPath, pieces: SegmentedPolynomial, guarantees: frozenset[str]) -> dict[int, TimeScaling]:
    """Find how each segment of some pieces has to be scaled in time, so that it just keeps its limits.

    Velocity goes with 1 / T, acceleration with 1 / T^2, jerk with 1 / T^3, so that the factors are exact.

    Raises:
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
    """
    segments, groups = np.unique(pieces.segments, return_inverse=True)
    worst = [TimeScaling(0.0, BindingLimit())] * len(segments)

    def note(group: int, factor: float, binding: BindingLimit) -> None:
        """Keep the largest factor of a group, and the limit that sets it."""
        if factor > worst[group].factor:
            worst[group] = TimeScaling(factor, binding)

    sampled = SampledLimits(path.dynamics, path.limits)
    has_sampled = bool(sampled.limited[segments].any())
    derivatives = derivatives_on_unit_time(pieces, DERIVATIVES if has_sampled else len(JOINT_DERIVATIVES))
    orders = [order for order, quantity in enumerate(JOINT_DERIVATIVES) if order and quantity in guarantees]
    if orders:
        limits = [path.limits.bounds(JOINT_DERIVATIVES[order]) for order in orders]
        limit, weights = measures([own.of(pieces.segments) for own in limits])
        of_pieces = np.add.outer(len(segments) * np.arange(len(orders)), groups)
        found = largest_magnitudes(derivatives[orders], limit, of_pieces, weights)
        ratios = np.abs(found.values) / limit.reshape(-1, limit.shape[2])[found.pieces, found.joints]
        if weights is not None:
            of_found = weights.reshape(2, -1, limit.shape[2])[:, found.pieces, found.joints]
            ratios *= np.where(found.values < 0.0, *of_found)
        for k, (ratio, joint) in enumerate(zip(ratios.tolist(), found.joints.tolist(), strict=True)):
            order, group = orders[k // len(segments)], k % len(segments)
            note(group, ratio ** (1.0 / order), BindingLimit(JOINT_DERIVATIVES[order], path.robot.joint_names[joint]))
    if has_sampled:
        known = np.array([scaling.factor for scaling in worst])
        stretches = sampled.stretch(pieces, pieces.segments, groups, known, derivatives)
        for group, (factor, limit) in enumerate(zip(*(values.tolist() for values in stretches), strict=True)):
            note(group, factor, sampled.each[limit])
    return dict(zip(segments.tolist(), worst, strict=True))


def scaled_to_duration(
    path: JointPath, group: SegmentGroup, requested: float, pieces: SegmentedPolynomial, enforced: frozenset[str]
) -> SegmentedPolynomial:
    """Stretch a segment group's motion uniformly to its requested duration, or to the shortest within the limits.

    Args:
        path: The path, with its limits.
        group: One of its groups.
        requested: The duration of the segment group, s; NaN: the shortest.
        pieces: The motion of the group, in any time.
        enforced: The quantities whose limits are kept.

    Raises:
        InfeasibleDuration: The requested duration is too short.
        LimitsUnsatisfiable: Nothing limits the duration, or gravity exceeds a torque limit.
    """
    own = float(pieces.lengths.sum())
    scaling = slowest(time_scalings(path, pieces, enforced).values())
    if not np.isnan(requested):
        if requested < scaling.factor * own * (1.0 - DURATION_TOLERANCE):
            raise infeasible_duration_error(requested, {group.first: scaling.factor * own}, scaling.binding)
        return pieces.stretched(requested / own)
    if scaling.factor <= 0.0:
        raise no_duration_error(group.first)
    return pieces.stretched(scaling.factor)
