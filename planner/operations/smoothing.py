"""A smooth curve near a dense list of joint positions, as stiff as its tolerance allows.

The curve is a cubic smoothing spline. It minimises the integral of the squared second derivative, plus weights times
the squared distances from the points. See Reinsch, Smoothing by spline functions, 1967; Green and Silverman,
Nonparametric Regression and Generalized Linear Models, 1994, ch. 2. Where the curve is too far from a point, the weight
of this point grows. The final curve has as few pieces as represent it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.spatial import FloatArray
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.trajectories.splines import cubics

MERGED = 0.05
"""Share of the allowed deviation up to which a point is one with the point before."""

OF_POINTS = 0.8
"""Share of the allowed deviation that the smoothing spline may use; the rest is for drawing it with fewer pieces."""

STIFFNESSES = 10.0 ** np.arange(3.0, -19.0, -1.0)
"""Stiffnesses that are tried in turn, the stiffest first, for a curve of length 1 and a mean weight of 1."""

REWEIGHTINGS = 8
"""Number of times that the weights of points too far away grow, for one stiffness."""

LARGEST_GROWTH = 4.0
"""Largest factor by which a distance is too large that a weight grows by the square of."""

PROBES = np.arange(1, 8) / 8.0
"""Fractions of an interval at which two curves are compared."""

MOST_INSERTIONS = 12
"""Number of times that points are inserted on the chords where the curve leaves them between the points."""

MOST_SMOOTHING_HALVINGS = 14
"""Number of times that pieces are halved where they do not show the smoothing spline."""


@dataclass(frozen=True, eq=False)
class SmoothCurve:
    """A smooth curve near some joint positions.

    Attributes:
        curve: Joint positions, C2, cubic pieces; the length is that of the chords, measured by the velocity limits.
        deviation: The largest distance of a joint from the points and the chords between them, rad or m.
    """

    curve: PiecewisePolynomial
    deviation: float


def smooth_curve_near(points: FloatArray, scales: FloatArray, most: float) -> SmoothCurve | None:
    """Draw a smooth curve from the first of some points to the last.

    Args:
        points: (N, joints), rad or m.
        scales: (joints,), what each joint is measured by along the curve: its velocity limit.
        most: Largest distance of a joint from the points and the chords between them, rad or m.

    Returns:
        The curve; None: all points are one.
    """
    kept = _distinct(points, MERGED * most)
    if len(kept) < 2:
        return None
    chords = np.linalg.norm(np.diff(points[kept], axis=0) / scales, axis=1)
    knots = np.concatenate([[0.0], np.cumsum(chords)])
    polyline = _Polyline(knots, points[kept])
    spline = _stiffest(polyline, OF_POINTS * most)
    curve = _with_few_pieces(spline, polyline, most)
    before = np.searchsorted(kept, np.arange(len(points)), side="right") - 1
    near = [np.abs(points - points[kept[np.minimum(before + k, len(kept) - 1)]]).max(axis=1) for k in (0, 1)]
    return SmoothCurve(curve, polyline.distance(curve) + float(np.minimum(*near).max()))


def _distinct(points: FloatArray, apart: float) -> np.ndarray:
    """Return the indices of points at a distance from the one before; keep the first and the last."""
    kept = [0]
    for k, point in enumerate(points):
        if np.abs(point - points[kept[-1]]).max() > apart:
            kept.append(k)
    last = len(points) - 1
    if kept[-1] != last and len(kept) > 1:
        kept[-1] = last
    elif kept[-1] != last and (points[last] != points[0]).any():
        kept.append(last)
    return np.array(kept)


@dataclass(frozen=True, eq=False)
class _Polyline:
    """Points and the chords between them, over a parameter.

    Attributes:
        knots: (N,), of the points, ascending.
        points: (N, joints).
    """

    knots: FloatArray
    points: FloatArray

    def at(self, u: FloatArray) -> FloatArray:
        """Return positions (M, joints) on the chords at parameters (M,)."""
        return np.stack([np.interp(u, self.knots, column) for column in self.points.T], axis=1)

    def probes(self) -> FloatArray:
        """Return parameters (N - 1, probes) between the points."""
        return self.knots[:-1, None] + np.diff(self.knots)[:, None] * PROBES

    def distances(self, curve: PiecewisePolynomial) -> FloatArray:
        """Return the largest distance (N - 1,) of a curve's joints from each chord, on its interval."""
        u = np.column_stack([self.knots[:-1], self.probes()])
        away = np.abs(curve.evaluate(u.ravel(), [0])[0] - self.at(u.ravel())).max(axis=1)
        largest: FloatArray = away.reshape(u.shape).max(axis=1)
        return largest

    def distance(self, curve: PiecewisePolynomial) -> float:
        """Return the largest distance of a joint of a curve from the points and chords."""
        return float(self.distances(curve).max())


def _stiffest(polyline: _Polyline, most: float) -> PiecewisePolynomial:
    """Return the stiffest smoothing spline found that stays near the points and the chords."""
    line = polyline
    for _ in range(MOST_INSERTIONS):
        far = line.distances(_spline(line, np.ones(len(line.knots)), 0.0)) > most
        if not far.any():
            break
        near = far | np.append(far[1:], False) | np.append(False, far[:-1])
        middles = (line.knots[:-1] + np.diff(line.knots) / 2.0)[near]
        u = np.sort(np.concatenate([line.knots, middles]))
        line = _Polyline(u, line.at(u))
    length, count = float(line.knots[-1]), len(line.knots)
    for stiffness in STIFFNESSES:
        weights = np.ones(count)
        for _ in range(REWEIGHTINGS):
            try:
                spline = _spline(line, weights / weights.mean(), stiffness * length**3 / count)
            except np.linalg.LinAlgError:  # points so near to each other that it is stiffer than numbers can tell
                break
            of_chords = line.distances(spline)
            away = np.maximum(np.append(of_chords, 0.0), np.append(0.0, of_chords)) / most
            if away.max() <= 1.0:
                return spline
            if away.max() > LARGEST_GROWTH**2:
                break
            weights *= np.clip(away, 1.0, LARGEST_GROWTH) ** 2
    return _spline(line, np.ones(count), 0.0)


def _spline(line: _Polyline, weights: FloatArray, stiffness: float) -> PiecewisePolynomial:
    """Return the natural cubic smoothing spline, through the first point and the last.

    R and Q are the matrices of Green and Silverman. The second derivatives m at the inner points solve (R + stiffness
    Q^T W^-1 Q) m = Q^T y. The curve is at y - stiffness W^-1 Q m.
    """
    from scipy.linalg import solveh_banded  # loaded by the first curve: importing the library stays quick

    y, h = line.points, np.diff(line.knots)
    count = len(y)
    second = np.zeros_like(y)
    if count > 2:
        inverse = 1.0 / h
        q = np.stack([inverse[:-1], -inverse[:-1] - inverse[1:], inverse[1:]])  # Q by its three diagonals
        give = stiffness / weights
        give[0] = give[-1] = 0.0
        n = count - 2
        bands = np.zeros((3, n))
        bands[2] = (h[:-1] + h[1:]) / 3.0 + (q**2 * np.stack([give[:-2], give[1:-1], give[2:]])).sum(axis=0)
        bands[1, 1:] = h[1:-1] / 6.0 + q[1, :-1] * q[0, 1:] * give[1:-2] + q[2, :-1] * q[1, 1:] * give[2:-1]
        bands[0, 2:] = q[2, :-2] * q[0, 2:] * give[2:-2]
        right = q[0][:, None] * y[:-2] + q[1][:, None] * y[1:-1] + q[2][:, None] * y[2:]
        m = solveh_banded(bands, right, check_finite=False)
        second[1:-1] = m
        moved = np.zeros_like(y)
        moved[:-2] += q[0][:, None] * m
        moved[1:-1] += q[1][:, None] * m
        moved[2:] += q[2][:, None] * m
        y = y - give[:, None] * moved
    return PiecewisePolynomial(h, cubics(h, y, second))


def _with_few_pieces(spline: PiecewisePolynomial, polyline: _Polyline, most: float) -> PiecewisePolynomial:
    """Draw a spline with few pieces, halved only where they differ from it or leave the tolerance."""
    knots = np.array([0.0, float(spline.breakpoints[-1])])
    near = (1.0 - OF_POINTS) * most / 2.0
    for _ in range(MOST_SMOOTHING_HALVINGS):
        drawn = _spline(_Polyline(knots, spline.evaluate(knots, [0])[0]), np.ones(len(knots)), 0.0)
        u = (knots[:-1, None] + np.diff(knots)[:, None] * PROBES).ravel()
        away = np.abs(drawn.evaluate(u, [0])[0] - spline.evaluate(u, [0])[0]).max(axis=1)
        rough = away.reshape(-1, len(PROBES)).max(axis=1) > near
        if not rough.any() and polyline.distance(drawn) <= most:
            return drawn
        if not rough.any() or len(knots) > len(spline.lengths):
            break
        knots = np.sort(np.concatenate([knots, (knots[:-1] + np.diff(knots) / 2.0)[rough]]))
    return spline
