"""Straight joint motions from rest to rest under limits of velocity, acceleration and jerk, in closed form."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.backends.jerk_limited.rate_limits import RateLimits, with_ramps
from planner.backends.jerk_limited.s_curves import s_curves
from planner.backends.shared.rest_to_rest import time_straight_motions
from planner.guarantees import JOINT_DERIVATIVES

if TYPE_CHECKING:
    from planner.paths import StraightMotions
    from planner.trajectories.polynomials import SegmentedPolynomial


ROUNDED_UP = 1.0 + 1e-10
"""Factor on durations, for what rounding may add to an acceleration where phases of jerk are very short."""


def along_lines(motions: StraightMotions) -> SegmentedPolynomial:
    """Run straight lines from rest to rest: the path position goes from 0 to 1 like a joint with the tightest limits.

    A longer duration stretches the law evenly.
    """
    travels, limits = np.abs(motions.travels), motions.limits
    quantities, braking = JOINT_DERIVATIVES[1:], None
    with np.errstate(divide="ignore"):
        by_joint = [getattr(limits, quantity) / travels for quantity in quantities]
        if "acceleration" in limits.wider:
            lower, upper = limits.bounds("acceleration")
            back = motions.travels < 0.0
            by_joint[1] = np.where(back, -lower, upper) / travels
            braking = np.where(back, upper, -lower) / travels
    one = np.ones((len(travels), 1))
    line = with_ramps(one, RateLimits(*(limit.min(axis=1, keepdims=True) for limit in by_joint)), motions.durations)
    tightest = None if braking is None else braking.min(axis=1)
    shortest, laws, binds = s_curves(line.velocity[:, 0], line.acceleration[:, 0], line.jerk[:, 0], tightest)
    bounds = {
        quantity: np.where(bind[:, None] & (own <= limit), shortest[:, None] * ROUNDED_UP, 0.0)
        for quantity, own, limit, bind in zip(quantities, by_joint, line[:3], binds, strict=True)
    }
    return time_straight_motions(motions, bounds, lambda _durations: laws)
