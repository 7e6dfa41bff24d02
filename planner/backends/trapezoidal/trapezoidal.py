"""The back end that accelerates, cruises and brakes: trapezoids of the path velocity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from planner.backends.base import enforced
from planner.backends.shared.assembly import assemble
from planner.backends.shared.rest_to_rest import time_straight_motions, unit_scalings
from planner.backends.shared.straight_lines import time_lines
from planner.backends.trapezoidal.along_curve import time_group, time_group_with_ramps
from planner.guarantees import ALL_BUT_JERK, Capabilities, Guarantee
from planner.paths import JointPath, StraightMotions
from planner.spatial import FloatArray
from planner.time_scaling.refusals import RAMPS
from planner.tolerances import ROUNDING
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial
from planner.trajectories.trajectory import Trajectory


@dataclass(frozen=True)
class Trapezoidal:
    """The fastest time scaling from rest to rest without a jerk limit: accelerate, cruise, brake.

    See document 004, Section 7.

    Without times, each segment is as fast as the limits allow: triangular if it is too short to reach full speed. A
    longer duration stretches that profile evenly. Times t1 and t3 are the document's t1 and T - t2. With them the peak
    of s' is 1 / (T - t1 / 2 - t3 / 2). That is the document's profile for t1 = t3 and its correction (E33) otherwise.

    Attributes:
        acceleration_time: Time t1 of acceleration on every segment, s; None: like `deceleration_time`.
        deceleration_time: Time t3 of braking on every segment, s; None: like `acceleration_time`.
    """

    kind: ClassVar[str] = "trapezoidal"
    summary: ClassVar[str] = (
        "Accelerate, cruise, brake: the fastest time scaling from rest to rest without a jerk limit, C1."
    )
    guarantees: ClassVar[Mapping[str, Guarantee]] = ALL_BUT_JERK
    capabilities: ClassVar[Capabilities] = Capabilities()

    acceleration_time: float | None = field(
        default=None,
        metadata={"description": "Time of acceleration on every segment, s; omitted: as the limits ask.", "gt": 0.0},
    )
    deceleration_time: float | None = field(
        default=None,
        metadata={"description": "Time of braking on every segment, s; omitted: the same as accelerating.", "gt": 0.0},
    )

    def __post_init__(self) -> None:
        """Let given ramps stay as they are in more time."""
        if self._times() is not None:
            object.__setattr__(self, "capabilities", Capabilities(is_shaped_by_duration=True))

    def parametrize(self, path: JointPath) -> Trajectory:
        """Put the trapezoid on each segment, at the requested durations or the shortest."""
        times = self._times()
        kept = enforced(self)
        path = path.keeping(kept)
        if times is None:
            lines = time_lines(path, path.straight, fastest_trapezoids, lambda group: time_group(path, group, kept))
            return assemble(path, [*lines, *(time_group(path, group, kept) for group in path.groups)])
        t1, t3 = times
        groups = [
            time_group_with_ramps(path, group, lambda T: _scaling(t1, t3, T), t1 + t3, kept) for group in path.groups
        ]
        return assemble(path, [_with_times(path.straight, t1, t3), *groups])

    def _times(self) -> tuple[float, float] | None:
        """Return the times of acceleration and of braking, s; None: the limits set them."""
        t1, t3 = self.acceleration_time, self.deceleration_time
        if t1 is None:
            return None if t3 is None else (t3, t3)
        return t1, t1 if t3 is None else t3


def fastest_trapezoids(motions: StraightMotions) -> SegmentedPolynomial:
    """Run straight lines at path velocity V and path acceleration A: T = 1/V + V/A, or 2/sqrt(A) without a cruise.

    Each joint binds V by its velocity and A by its acceleration; the slowest of each counts. Where joints brake with
    another acceleration than they gain speed with, 1/A is the mean of both reciprocals.
    """
    inverse_v = np.abs(motions.travels) / motions.limits.velocity.upper
    gaining, braking = reciprocal_accelerations(motions)
    slowness = inverse_v.max(axis=1)
    by_ramp = gaining.max(axis=1), braking.max(axis=1)
    sluggishness = (by_ramp[0] + by_ramp[1]) / 2.0
    cruises = slowness**2 > sluggishness * (1.0 + ROUNDING)
    with np.errstate(divide="ignore", invalid="ignore"):
        shortest = np.where(cruises, slowness + sluggishness / slowness, 2.0 * np.sqrt(sluggishness))
        ramps = [np.where(cruises, (own / slowness) / shortest, own / (2.0 * sluggishness)) for own in by_ramp]
    # Without an acceleration limit the fastest time scaling is a jump; the document's thirds stand in for it.
    jump = sluggishness == 0.0
    t1, t3 = (np.where(jump, 1.0 / 3.0, ramp) for ramp in ramps)
    shortest = np.where(jump, slowness * 1.5, shortest)
    velocity_binds = (cruises | jump)[:, None] & (inverse_v == slowness[:, None])
    bounds = {
        "velocity": np.where(velocity_binds, shortest[:, None], 0.0),
        "acceleration": np.where(
            (gaining == by_ramp[0][:, None]) | (braking == by_ramp[1][:, None]), shortest[:, None], 0.0
        ),
    }
    scalings = _trapezoids(t1, t3)
    return time_straight_motions(motions, bounds, lambda _durations: scalings)


def reciprocal_accelerations(motions: StraightMotions) -> tuple[FloatArray, FloatArray]:
    """Return 1/A, each (rows, joints), s^2, that each joint would need by itself, gaining speed and braking."""
    travels, (braking, gaining) = np.abs(motions.travels), motions.limits.acceleration
    return travels / gaining, travels / -braking


def _with_times(motions: StraightMotions, t1: float, t3: float) -> SegmentedPolynomial:
    """Run straight lines with given ramps: cruise at 1 / (T - t1/2 - t3/2), reached in t1 and left in t3."""
    travels, ramps = np.abs(motions.travels), (t1 + t3) / 2.0
    gaining, braking = reciprocal_accelerations(motions)
    bounds = {
        "velocity": travels / motions.limits.velocity.upper + ramps,
        "acceleration": np.maximum(gaining / t1, braking / t3) + ramps,
        RAMPS: np.full_like(travels, t1 + t3),
    }
    return time_straight_motions(motions, bounds, lambda durations: _trapezoids(t1 / durations, t3 / durations))


def _scaling(t1: float, t3: float, duration: float) -> PiecewisePolynomial:
    """Return the time scaling s(t) from 0 to 1 in `duration`, which the ramps t1 and t3 fit into."""
    return _trapezoids(np.array([t1 / duration]), np.array([t3 / duration])).stretched(duration)


def _trapezoids(t1: FloatArray, t3: FloatArray) -> SegmentedPolynomial:
    """Return time scalings on unit time that accelerate for t1 (segments,), cruise, and brake for t3."""
    peak = 1.0 / (1.0 - t1 / 2.0 - t3 / 2.0)
    cruise = 1.0 - t1 - t3
    cruise = np.where(cruise > ROUNDING, cruise, 0.0)
    coefficients = np.zeros((len(t1), 3, 3))
    coefficients[:, 0, 2] = peak / t1 / 2.0
    coefficients[:, 1, 0] = peak * t1 / 2.0
    coefficients[:, 1:, 1] = peak[:, None]
    coefficients[:, 2, 0] = 1.0 - peak * t3 / 2.0
    coefficients[:, 2, 2] = -peak / t3 / 2.0
    return unit_scalings(np.column_stack([t1, cruise, t3]), coefficients)
