"""Interpolating splines in time, at rest at both ends: C2 of degree 3, C4 of degree 5; and their sensitivities.

At a given velocity two splines meet. In degree 3 they have the velocity in common and are C1. In degree 5 they have no
acceleration there, as at the ends, and are C2.

On each segment the spline is the Hermite polynomial of the derivatives at its ends. The unknowns are the derivatives at
the inner waypoints: velocity for degree 3, velocity and acceleration for degree 5. The continuity of the next
derivatives gives a block-tridiagonal system for them, the same for all joints. See Biagiotti and Melchiorri, Trajectory
Planning for Automatic Machines and Robots (2008), ch. 4.4, for degree 3. See de Boor, A Practical Guide to Splines
(2001), ch. IV and IX, in general. The kernel scales each unknown and each equation by the shorter segment beside its
waypoint, so that durations of very different lengths do no harm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from planner.kernels import splines as kernels
from planner.spatial import FloatArray
from planner.trajectories.polynomials import PiecewisePolynomial, stretched

Degree = Literal[3, 5]


@dataclass(frozen=True, eq=False)
class InterpolatingSpline:
    """A spline, on unit time in each segment.

    Attributes:
        degree: The degree, 3 or 5.
        durations: Durations (segments,), s.
        unit: Coefficients (segments, joints, degree + 1), ascending powers of unit time.
        ends: Travel, then derivatives 1 to (degree - 1) / 2 at the start, then at the end, by unit time; (segments,
            joints, degree).
        given: Whether (segments - 1,) the velocity is given at each inner waypoint.
    """

    degree: Degree
    durations: FloatArray
    unit: FloatArray
    ends: FloatArray
    given: np.ndarray

    @property
    def curve(self) -> PiecewisePolynomial:
        """The spline in time, one piece a segment."""
        return PiecewisePolynomial(self.durations, stretched(self.unit, self.durations[:, None]))

    def sensitivities(self, segment: np.ndarray, joint: np.ndarray, order: np.ndarray, u: FloatArray) -> FloatArray:
        """Differentiate derivatives by time at fixed unit times by the logarithm of each duration.

        The solution x of the system A x = b changes by -A^-1 times the change of A x - b at fixed x.

        Args:
            segment: Index (points,) of the segment.
            joint: Index (points,) of the joint.
            order: Order (points,) of the derivative.
            u: Unit time (points,) on the segment.

        Returns:
            The slopes (points, segments).
        """
        return kernels.sensitivities(self.durations, self.given, self.ends, (segment, joint, order, u))


def interpolating_spline(positions: FloatArray, durations: FloatArray, degree: Degree) -> PiecewisePolynomial:
    """Interpolate `positions` by the spline of `degree`, at rest at both ends, one piece a segment: `interpolate`."""
    return interpolate(positions, durations, degree).curve


def interpolate(
    positions: FloatArray, durations: FloatArray, degree: Degree, velocities: FloatArray | None = None
) -> InterpolatingSpline:
    """Interpolate `positions` by the spline of `degree` that is at rest at both ends.

    Args:
        positions: Positions (segments + 1, joints), rad or m.
        durations: Durations (segments,), s, positive.
        degree: 3: velocity 0 at both ends, C2. 5: velocity and acceleration 0 at both ends, C4.
        velocities: Velocities (segments - 1, joints) at the inner waypoints, rad/s or m/s; NaN: that of a smooth
            spline. Where they are given, only the velocity is continuous in degree 3, and the acceleration, 0, as well
            in degree 5.
    """
    known = np.full_like(positions[1:-1], np.nan) if velocities is None else velocities
    given = np.isfinite(known[:, 0])
    unit, ends = kernels.interpolate(degree, positions, durations, known, given)
    return InterpolatingSpline(degree, durations, unit, ends, given)
