"""A path of the tool on a smooth curve through poses: the natural cubic spline, at one speed along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.spatial import FloatArray, Pose, quaternion, rotations_from_quaternions
from planner.tool_motions.pose_paths import NoPath, PiecedPath, via_poses
from planner.trajectories.polynomials import PiecewisePolynomial, differentiate, horner
from planner.trajectories.splines import natural_spline

GAUSS = np.polynomial.legendre.leggauss(12)
"""Gauss's nodes on [-1, 1] and their weights, for the length of a part of the curve."""

CURVE_PARTS = 8
"""Number of parts of the curve from pose to pose whose lengths are found: in so many its speed by the chords' length
hardly changes."""

NEWTON_STEPS = 8
"""The most Newton steps from a length along the curve to its parameter: from a cubic guess two are enough."""

FOUND = 1e-13
"""The step, as a share of the whole curve, at which the parameter is found."""

LEAST_CURVE_SPEED = 0.05
"""Least speed of the curve over the chords' length, relative to its mean, below which it counts as turning back.

The tool would have to turn on the spot.
"""

SMALLEST_QUATERNION = 0.3
"""The least norm of the spline of quaternions: they are 0.7 in the middle of half a turn, and tell no rotation at 0."""


@dataclass(frozen=True, eq=False)
class PoseSpline(PiecedPath):
    """A path on a spline of positions, and of quaternions where there are any, at one speed along u.

    Attributes:
        curve: Positions (m), and quaternions x, y, z, w that are still to be normalised, over the length of the chords.
        lengths: (pieces, `CURVE_PARTS`), m, of the parts of the curve.
    """

    curve: PiecewisePolynomial
    lengths: FloatArray

    @classmethod
    def through(cls, start: Pose, between: Sequence[Pose], end: Pose) -> PoseSpline:
        """Return the spline from pose to pose, without curvature at its ends.

        Raises:
            NoPath: It turns back at a pose, or the tool turns too far from one to the next; or see `via_poses`.
        """
        poses = via_poses(start, between, end)
        values = poses.positions
        if poses.rotations is not None:
            quaternions = np.array([quaternion(rotation) for rotation in poses.rotations])
            agrees = (quaternions[1:] * quaternions[:-1]).sum(axis=1) >= 0.0
            quaternions[1:] *= np.cumprod(np.where(agrees, 1.0, -1.0))[:, None]
            values = np.hstack([values, quaternions])
        curve = PiecewisePolynomial(poses.lengths, natural_spline(poses.lengths, values))
        made = cls(curve, _lengths_of_parts(curve))
        slow, turns = made._ill_pieces()
        for ill, message in (
            (slow, "the spline turns back here: let it end at a waypoint of its own"),
            (turns, "the tool turns too far from the pose before: put poses in between"),
        ):
            if len(ill):
                raise NoPath(message, "poses", min(int(poses.indices[ill[0] + 1]), len(between) - 1))
        return made

    @cached_property
    def breakpoints(self) -> FloatArray:
        """The parameters (pieces + 1,), from 0 to 1, at which the poses are."""
        breakpoints: FloatArray = self._ends[::CURVE_PARTS] / self._ends[-1]
        return breakpoints

    def poses(self, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return positions (N, 3), m, and rotations (N, 3, 3) at parameters (N,); None: no orientation."""
        (values,) = self._evaluate(u, 1)
        return values[:, :3], rotations_from_quaternions(values[:, 3:]) if values.shape[1] > 3 else None

    def poses_on_curve(self, x: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return positions (N, 3), m, and rotations (N, 3, 3) after chord lengths (N,), m; None: no orientation."""
        (values,) = self.curve.evaluate(x, [0])
        return values[:, :3], rotations_from_quaternions(values[:, 3:]) if values.shape[1] > 3 else None

    def twists(self, u: FloatArray) -> FloatArray:
        """Return the linear over the angular velocities (N, 6) by u at parameters (N,); (N, 3) without a rotation."""
        values, slopes = self._evaluate(u, 2)
        linear, xyzw, rates = slopes[:, :3], values[:, 3:], slopes[:, 3:]
        twists = linear
        if xyzw.shape[1]:
            # w = 2 q' q* / |q|^2: what changes the norm of q is its real part.
            real = xyzw[:, 3:] * rates[:, :3] - rates[:, 3:] * xyzw[:, :3]
            angular = 2.0 * (real - np.cross(rates[:, :3], xyzw[:, :3])) / (xyzw * xyzw).sum(axis=1)[:, None]
            twists = np.hstack([linear, angular])
        return np.asarray(twists * (self._ends[-1] / np.linalg.norm(linear, axis=1))[:, None])

    @cached_property
    def _ends(self) -> FloatArray:
        """The lengths (pieces * parts + 1,) of the curve, m, up to the ends of its parts."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @cached_property
    def _derivatives(self) -> tuple[FloatArray, FloatArray]:
        """The coefficients (pieces, 3 or 7, ...) of the curve and of its derivative by the chords' length."""
        return self.curve.coefficients, differentiate(self.curve.coefficients)

    @cached_property
    def _speeds_at_ends(self) -> FloatArray:
        """The speeds (2, pieces * parts) at the beginnings and the ends of the parts, by the chords' length."""
        at = np.arange(CURVE_PARTS + 1) * self.curve.lengths[:, None] / CURVE_PARTS
        speeds = np.linalg.norm(horner(self._derivatives[1][:, None, :3], at[..., None]), axis=2)
        return np.array([speeds[:, :-1].ravel(), speeds[:, 1:].ravel()])

    def _evaluate(self, u: FloatArray, orders: int) -> list[FloatArray]:
        """Return curve and its derivatives by the chords' length, (N, 3 or 7) each, at parameters (N,) of the path."""
        along = u * self._ends[-1]
        rows = np.clip(np.searchsorted(self._ends, along, side="right") - 1, 0, self.lengths.size - 1)
        pieces, parts = np.divmod(rows, CURVE_PARTS)
        spans = self.curve.lengths[pieces] / CURVE_PARTS
        starts, wanted = parts * spans, along - self._ends[rows]
        whole, (before, behind) = self.lengths.ravel()[rows], self._speeds_at_ends[:, rows]
        share = wanted / whole
        # The cubic of the right slopes at both ends of the part.
        x = spans * share**2 * (3.0 - 2.0 * share)
        x += whole * share * (1.0 - share) * ((1.0 - share) / before - share / behind)
        speeds = self._derivatives[1][:, :3]
        for _ in range(NEWTON_STEPS):
            step = (wanted - _length(speeds, pieces, starts, x)) / _speed(speeds, pieces, starts + x)
            x = x + step
            if np.abs(step).max(initial=0.0) <= FOUND * self._ends[-1]:
                break
        at = (starts + x)[:, None]
        return [horner(coefficients[pieces], at) for coefficients in self._derivatives[:orders]]

    def _ill_pieces(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the pieces where the curve almost stops, and the pieces whose quaternions are too short."""
        shares = np.linspace(0.0, 1.0, 2 * CURVE_PARTS + 1)
        at = (self.curve.lengths[:, None] * shares)[..., None]
        speeds = np.linalg.norm(horner(self._derivatives[1][:, None, :3], at), axis=2)
        slow = np.flatnonzero(speeds.min(axis=1) < LEAST_CURVE_SPEED)
        if self.curve.coefficients.shape[1] == 3:
            return slow, slow[:0]
        norms = np.linalg.norm(horner(self.curve.coefficients[:, None, 3:], at), axis=2)
        return slow, np.flatnonzero(norms.min(axis=1) < SMALLEST_QUATERNION)


def _speeds(curve: PiecewisePolynomial) -> FloatArray:
    """Return the coefficients (pieces, 3, 3) of the velocity of the positions by the chords' length."""
    return differentiate(curve.coefficients[:, :3], 1)


def _speed(speeds: FloatArray, pieces: np.ndarray, at: FloatArray) -> FloatArray:
    """Return the speeds (N,) at points (N,) of pieces (N,)."""
    speed: FloatArray = np.linalg.norm(horner(speeds[pieces], at[:, None]), axis=1)
    return speed


def _length(speeds: FloatArray, pieces: np.ndarray, starts: FloatArray, spans: FloatArray) -> FloatArray:
    """Return the lengths (N,), m, of parts of pieces (N,), from points (N,) over spans (N,)."""
    at = starts[:, None] + spans[:, None] * 0.5 * (GAUSS[0] + 1.0)
    velocities = horner(speeds[pieces][:, None], at[..., None])
    lengths: FloatArray = np.linalg.norm(velocities, axis=2) @ (0.5 * GAUSS[1]) * spans
    return lengths


def _lengths_of_parts(curve: PiecewisePolynomial) -> FloatArray:
    """Return the lengths (pieces, `CURVE_PARTS`), m."""
    pieces, parts = np.divmod(np.arange(len(curve.lengths) * CURVE_PARTS), CURVE_PARTS)
    spans = curve.lengths[pieces] / CURVE_PARTS
    return _length(_speeds(curve), pieces, parts * spans, spans).reshape(-1, CURVE_PARTS)
