"""A path of the tool straight from pose to pose, its corners cut by curves that begin and end without curvature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.spatial import FloatArray, Pose, right_jacobians, rotation_vectors, rotations_from_vectors
from planner.tolerances import POSITION_TOLERANCE
from planner.tool_motions.pose_paths import NoPath, PiecedPath, ViaPoses, via_poses

GAUSS = 0.5 * np.array(np.polynomial.legendre.leggauss(24)) + np.array([[0.5], [0.0]])
"""Gauss's nodes on [0, 1] and their weights, (2, nodes): as many integrate a turn by half a circle to 1e-15."""

SHARPEST = 3.0
"""Angle of a corner, rad, above which the tool counts as turning back.

The blend curve would be only a twentieth of the blend long, and the tool would nearly stop.
"""


class _Lines(NamedTuple):
    """The straight lines from pose to pose, over the way s, m.

    Attributes:
        lengths: (lines,), m.
        origins: (lines, 3), m, at s = 0.
        directions: (lines, 3), unit.
        rotations: (lines, 3, 3), at s = 0; None: any orientation will do.
        rates: (lines, 3), rad/m, by which the tool turns, in its own axes.
    """

    lengths: FloatArray
    origins: FloatArray
    directions: FloatArray
    rotations: FloatArray | None
    rates: FloatArray

    @classmethod
    def between(cls, poses: ViaPoses) -> _Lines:
        """Return the lines from pose to pose."""
        lengths, turned, rates = poses.lengths, None, np.zeros((len(poses.lengths), 3))
        if poses.rotations is not None:
            turned = poses.rotations[:-1]
            rates = rotation_vectors(turned.transpose(0, 2, 1) @ poses.rotations[1:]) / lengths[:, None]
        directions = np.diff(poses.positions, axis=0) / lengths[:, None]
        return cls(lengths, poses.positions[:-1], directions, turned, rates)

    def turned(self, which: np.ndarray, s: FloatArray) -> FloatArray:
        """Return the rotations (N, 3, 3) of lines (N,) after s (N,)."""
        assert self.rotations is not None  # noqa: S101 - called only where there are any
        rotations: FloatArray = self.rotations[which] @ rotations_from_vectors(s[:, None] * self.rates[which])
        return rotations


@dataclass(frozen=True, eq=False)
class Polyline(PiecedPath):
    """A path of straight lines from pose to pose, with blended corners, at one speed along u.

    The curve of a corner, over its length s, m, turns by angle (3 x^2 - 2 x^3), x = s / length. So its curvature is
    zero at both ends, and the path is C2. The tool turns from R1(s), the continuation of the line before, to R2(s), the
    continuation of the line after. The rotation is R = R1 exp(w log(R1^T R2)), w = 10 x^3 - 15 x^4 + 6 x^5.

    Attributes:
        lines: The straight lines from pose to pose.
        line: (pieces,), index of the line on which each piece begins; a corner ends on the next one.
        begins: (pieces,), m, the way on that line up to there.
        lengths: (pieces,), m.
        reaches: (pieces,), m: distance of the ends of a corner's curve from the corner; 0 for a straight piece.
        angles: (pieces,), rad, by which the direction turns.
        sides: (pieces, 3), unit: at right angles to the line, to the side where the next one goes; nought where it goes
            straight on.
    """

    lines: _Lines
    line: np.ndarray
    begins: FloatArray
    lengths: FloatArray
    reaches: FloatArray
    angles: FloatArray
    sides: FloatArray

    @classmethod
    def through(cls, start: Pose, between: Sequence[Pose], end: Pose, blend: float) -> Polyline:
        """Return the polyline from pose to pose.

        Args:
            start: Where it begins.
            between: Where its corners are.
            end: Where it ends. Without a rotation in both, any orientation will do.
            blend: Distance from a corner at which it leaves the straight line, m; at most half of the line.

        Raises:
            NoPath: It turns back at a pose, or see `via_poses`.
        """
        poses = via_poses(start, between, end)
        lines = _Lines.between(poses)
        before, after = lines.directions[:-1], lines.directions[1:]
        reaches = np.minimum(blend, np.minimum(lines.lengths[:-1], lines.lengths[1:]) / 2.0)
        cosines = (before * after).sum(axis=1)
        aside = after - cosines[:, None] * before
        sines = np.linalg.norm(aside, axis=1)
        angles = np.arctan2(sines, cosines)
        if len(sharp := np.flatnonzero(angles > SHARPEST)):
            message = "the polyline turns back here: let it end at a waypoint of its own"
            raise NoPath(message, "poses", int(poses.indices[sharp[0] + 1]))
        # The chord is the way there, 2 reach cos(angle / 2), and the mean of the cosines to it by the length.
        means = np.cos(angles[:, None] * (_eased(GAUSS[0]) - 0.5)) @ GAUSS[1]
        firsts, lasts = np.append(0.0, reaches), lines.lengths - np.append(reaches, 0.0)
        count, none = len(lines.lengths), np.zeros(len(lines.lengths))
        straight = (np.arange(count), firsts, lasts - firsts, none, none, np.zeros((count, 3)))
        corners = (
            np.arange(count - 1),
            lasts[:-1],
            2.0 * reaches * np.cos(0.5 * angles) / means,
            reaches,
            angles,
            aside / np.maximum(sines, np.finfo(float).tiny)[:, None],
        )
        # Straight pieces and corners by turns, without straight ones of no length.
        order = np.argsort(np.append(2 * straight[0], 2 * corners[0] + 1))
        order = order[(np.append(straight[2] / lines.lengths, np.ones(count - 1)) > POSITION_TOLERANCE)[order]]
        return cls(lines, *(np.concatenate(pair)[order] for pair in zip(straight, corners, strict=True)))

    @cached_property
    def _starts(self) -> FloatArray:
        """The ways (pieces + 1,), m, after which the pieces begin, and the whole."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @cached_property
    def breakpoints(self) -> FloatArray:
        """The parameters (pieces + 1,), from 0 to 1, at which the pieces begin and the last one ends."""
        breakpoints: FloatArray = self._starts / self._starts[-1]
        return breakpoints

    def poses(self, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return positions (N, 3), m, and rotations (N, 3, 3) at parameters (N,); None: none is given."""
        at, s = self._located(u)
        line, corner = self.line[at], np.flatnonzero(self.reaches[at] > 0.0)
        ahead, turning, x = s.copy(), at[corner], s[corner] / self.lengths[at[corner]]
        angles = self.angles[turning][:, None] * _eased(x[:, None] * GAUSS[0])
        ahead[corner] *= np.cos(angles) @ GAUSS[1]
        positions = self.lines.origins[line] + (self.begins[at] + ahead)[:, None] * self.lines.directions[line]
        positions[corner] += (s[corner] * (np.sin(angles) @ GAUSS[1]))[:, None] * self.sides[turning]
        if self.lines.rotations is None:
            return positions, None
        rotations = self.lines.turned(line, self.begins[at] + s)
        turns = rotation_vectors(rotations[corner].transpose(0, 2, 1) @ self._after(turning, s[corner]))
        rotations[corner] = rotations[corner] @ rotations_from_vectors(_blended(x)[0][:, None] * turns)
        return positions, rotations

    def twists(self, u: FloatArray) -> FloatArray:
        """Return the linear over the angular velocities (N, 6) by u at parameters (N,); (N, 3) without a rotation."""
        at, s = self._located(u)
        line, whole = self.line[at], float(self._starts[-1])
        x = s / self.lengths[at]
        angles = (self.angles[at] * _eased(x))[:, None]
        linear = whole * (np.cos(angles) * self.lines.directions[line] + np.sin(angles) * self.sides[at])
        if self.lines.rotations is None:
            return np.asarray(linear)
        rotations = self.lines.turned(line, self.begins[at] + s)
        rates = self.lines.rates[line].copy()
        corner = np.flatnonzero(self.reaches[at] > 0.0)
        if not len(corner):
            return np.hstack([linear, whole * _products(rotations, rates)])
        turning = at[corner]
        between = rotations[corner].transpose(0, 2, 1) @ self._after(turning, s[corner])
        turns = rotation_vectors(between)
        gains = self.lines.rates[line[corner] + 1] - _products(between.transpose(0, 2, 1), rates[corner])
        gains = _products(np.linalg.inv(right_jacobians(turns)), gains)
        weights, slopes = _blended(x[corner])
        slopes = slopes / self.lengths[turning]
        own = np.asarray(slopes[:, None] * turns + weights[:, None] * gains, dtype=np.float64)
        turned = weights[:, None] * turns
        rates[corner] += _products(rotations_from_vectors(turned) @ right_jacobians(turned), own)
        return np.hstack([linear, whole * _products(rotations, rates)])

    def _located(self, u: FloatArray) -> tuple[np.ndarray, FloatArray]:
        """Return the pieces (N,) of parameters (N,), and the ways (N,), m, since they began."""
        at = np.clip(np.searchsorted(self.breakpoints, u, side="right") - 1, 0, len(self.lengths) - 1)
        return at, u * self._starts[-1] - self._starts[at]

    def _after(self, corners: np.ndarray, s: FloatArray) -> FloatArray:
        """Return the rotations (N, 3, 3) of the lines after corners (N,), continued backwards, s (N,) on the curves."""
        return self.lines.turned(self.line[corners] + 1, s + self.reaches[corners] - self.lengths[corners])


def _eased(x: FloatArray) -> FloatArray:
    """Return the share 3 x^2 - 2 x^3 of a turn."""
    return x * x * (3.0 - 2.0 * x)


def _blended(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the share 10 x^3 - 15 x^4 + 6 x^5 and its derivative."""
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * (x * (1.0 - x)) ** 2


def _products(matrices: np.ndarray, vectors: np.ndarray) -> FloatArray:
    """Return the products (N, 3) of matrices (N, 3, 3) with vectors (N, 3)."""
    products: FloatArray = (matrices @ vectors[..., None])[..., 0]
    return products
