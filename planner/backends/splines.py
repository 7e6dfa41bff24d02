"""Splines in time through waypoints: C2 of degree 3 and C4 of degree 5, at given durations or the shortest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from planner.kinematics.poses import FloatArray

Degree = Literal[3, 5]


@dataclass(frozen=True, eq=False)
class SplineLimits:
    """Limits of a spline; infinite: none.

    Attributes:
        lower: (joints,).
        upper: (joints,).
        velocity: (segments, joints).
        acceleration: (segments, joints).
        jerk: (segments, joints); not looked at for degree 3, whose jerk jumps.
    """

    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


@dataclass(frozen=True, eq=False)
class Spline:
    """Pieces of polynomials in local time.

    Attributes:
        durations: (segments,), s.
        coefficients: (segments, joints, degree + 1), ascending powers of local time.
    """

    durations: FloatArray
    coefficients: FloatArray


class DurationsTooShort(Exception):
    """The asked durations cannot be kept; all durations times `factor` can.

    Attributes:
        segment: Where the worst excess is.
        joint: Index of its joint.
        quantity: `velocity`, `acceleration` or `jerk`.
        value: Its peak magnitude there.
        limit: Its limit there.
        factor: > 1, on all durations.
        durations: (segments,), s, that keep the limits: `factor` times the asked ones, and what goes with them.
    """


class PositionOvershoot(Exception):
    """The spline leaves the position limits between waypoints, at every ratio of the durations that was tried.

    Attributes:
        segment: Where the worst excess is.
        joint: Index of its joint.
        value: The position there.
        limit: The limit that it breaks.
    """


class NothingLimits(Exception):
    """A free duration has no limit that would set it."""


def interpolating_spline(positions: FloatArray, durations: FloatArray, degree: Degree) -> FloatArray:
    """Coefficients (segments, joints, degree + 1) of the spline at rest at both ends; ascending, local time.

    Args:
        positions: (segments + 1, joints).
        durations: (segments,), s, positive.
        degree: 3 (C2, velocity 0 at both ends) or 5 (C4, velocity and acceleration 0 at both ends).
    """
    raise NotImplementedError


def timed_spline(positions: FloatArray, limits: SplineLimits, asked: FloatArray, degree: Degree) -> Spline:
    """The spline at the asked durations (segments,), NaN where the shortest are wanted.

    Raises:
        DurationsTooShort: The asked durations break a limit.
        PositionOvershoot: Position limits are left between waypoints.
        NothingLimits: Nothing sets a free duration.
    """
    raise NotImplementedError
