"""Straight joint motions from rest to rest under limits of velocity, acceleration and jerk, in closed form."""

from __future__ import annotations

import numpy as np

from planner.backends.jerk_limited.s_curves import s_curves, with_ramps
from planner.backends.shared.rest_to_rest import time_straight_motions
from planner.guarantees import JOINT_DERIVATIVES
from planner.paths import StraightMotions
from planner.trajectories.polynomials import SegmentedPolynomial

ROUNDED_UP = 1.0 + 1e-10
"""Factor on durations, for what rounding may add to an acceleration where phases of jerk are very short."""


def along_lines(motions: StraightMotions) -> SegmentedPolynomial:
    """Time straight lines from rest to rest: the path position moves like a joint with the tightest limits.

    A longer duration stretches the time scaling evenly.
    """
    travels, limits = np.abs(motions.travels), motions.limits
    with np.errstate(divide="ignore"):
        by_joint = [limits.bounds(quantity).upper / travels for quantity in JOINT_DERIVATIVES[1:]]
        braking = None if limits.acceleration.is_symmetric else (-limits.acceleration.lower / travels).min(axis=1)
    velocity, acceleration, jerk = (limit.min(axis=1, keepdims=True) for limit in by_joint)
    jerk = with_ramps(np.ones_like(jerk), velocity, acceleration, jerk, motions.durations)
    line = velocity[:, 0], acceleration[:, 0], jerk[:, 0]
    shortest, scalings, binds = s_curves(*line, braking)
    bounds = {
        quantity: np.where(bind[:, None] & (own <= limit[:, None]), shortest[:, None] * ROUNDED_UP, 0.0)
        for quantity, own, limit, bind in zip(JOINT_DERIVATIVES[1:], by_joint, line, binds, strict=True)
    }
    return time_straight_motions(motions, bounds, lambda _durations: scalings)
