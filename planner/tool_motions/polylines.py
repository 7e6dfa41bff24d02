"""A path of the tool straight from pose to pose, its corners cut by curves that begin and end without curvature."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import pinocchio as pin

from planner.spatial import Pose, rotation_vector, rotation_vectors, rotations_from_vectors
from planner.tolerances import POSITION_TOLERANCE
from planner.tool_motions.pose_paths import NoPath
from planner.tool_motions.via_poses import via_poses

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.spatial import FloatArray
    from planner.tool_motions.via_poses import ViaPoses

Number = TypeVar("Number", float, "FloatArray")
"""A number, or an array of numbers."""

GAUSS = np.polynomial.legendre.leggauss(24)
"""Gauss's nodes on [-1, 1] and their weights: as many integrate a turn by half a circle to 1e-15."""

SHARPEST = 3.0
"""Angle, rad, of a corner from which on it is taken for one where the tool turns back: the curve that cuts it would be
as short as a twentieth of the blend, and the tool would all but stop."""


@dataclass(frozen=True, eq=False)
class _Straight:
    """A straight part of a polyline, over the way s, m.

    Attributes:
        length: m.
        origin: (3,), m, at s = 0.
        direction: (3,), unit.
        rotation: (3, 3), at s = 0; None: any orientation will do.
        rate: (3,), rad/m, by which the tool turns, in its own axes.
    """

    length: float
    origin: FloatArray
    direction: FloatArray
    rotation: FloatArray | None
    rate: FloatArray

    def positions(self, s: FloatArray) -> FloatArray:
        """Return the positions (N, 3), m, after s (N,)."""
        return self.origin + s[:, None] * self.direction

    def rotations(self, s: FloatArray) -> FloatArray:
        """Return the rotations (N, 3, 3) after s (N,)."""
        assert self.rotation is not None  # noqa: S101 - asked only where there are any
        vectors = s[:, None] * self.rate
        if len(s) == 1:  # ten times as fast
            return np.array([self.rotation @ pin.exp3(vectors[0])])
        rotations: FloatArray = self.rotation @ rotations_from_vectors(vectors)
        return rotations

    def direction_at(self, _s: float) -> FloatArray:
        """Return the direction (3,) after s, unit."""
        return self.direction

    def angular_velocity(self, _s: float) -> FloatArray:
        """Give the angular velocity (3,) after s, rad/m, in the base's axes: the axis of the turn stays where it is."""
        assert self.rotation is not None  # noqa: S101 - asked only where there are any
        velocity: FloatArray = self.rotation @ self.rate
        return velocity


@dataclass(frozen=True, eq=False)
class _Corner:
    """The curve that cuts a corner, over the way s, m: it turns by angle (3 x^2 - 2 x^3), x = s / length.

    So its curvature is nought at both ends, and the path C2. The tool turns from R1(s), which the straight line before
    would go on with, to R2(s), with which the line after begins: R = R1 exp(w log(R1^T R2)), w = 10 x^3 - 15 x^4 + 6
    x^5.

    Attributes:
        before: The line before, from its end at the corner on.
        after: The line after, from the corner on.
        reach: How far before the corner it begins, and after it ends, m.
        angle: By how much the line turns, rad.
        side: (3,), unit: at right angles to the line before, to the side where the line after goes; nought where that
            goes straight on.
        length: m.
    """

    before: _Straight
    after: _Straight
    reach: float
    angle: float
    side: FloatArray
    length: float

    @classmethod
    def between(cls, before: _Straight, after: _Straight, reach: float) -> _Corner:
        """Cut the corner between two lines."""
        cosine = float(before.direction @ after.direction)
        aside = after.direction - cosine * before.direction
        sine = float(np.linalg.norm(aside))
        angle = float(np.arctan2(sine, cosine))
        # The chord is the way there, 2 reach cos(angle / 2), and the mean of the cosines to it by the length.
        shares, weights = 0.5 * (GAUSS[0] + 1.0), 0.5 * GAUSS[1]
        mean = float(weights @ np.cos(angle * _eased(shares) - 0.5 * angle))
        length = 2.0 * reach * float(np.cos(0.5 * angle)) / mean
        return cls(before, after, reach, angle, aside / max(sine, np.finfo(float).tiny), length)

    def positions(self, s: FloatArray) -> FloatArray:
        """Return the positions (N, 3), m, after s (N,): the integral of the direction."""
        shares, weights = 0.5 * (GAUSS[0] + 1.0), 0.5 * GAUSS[1]
        angles = self.angle * _eased(s[:, None] / self.length * shares)
        ahead, aside = np.cos(angles) @ weights, np.sin(angles) @ weights
        start = self.before.origin - self.reach * self.before.direction
        return start + (s * ahead)[:, None] * self.before.direction + (s * aside)[:, None] * self.side

    def rotations(self, s: FloatArray) -> FloatArray:
        """Return the rotations (N, 3, 3) after s (N,)."""
        first, last = self.before.rotations(s - self.reach), self.after.rotations(s + self.reach - self.length)
        turns = rotation_vectors(first.transpose(0, 2, 1) @ last)
        rotations: FloatArray = first @ rotations_from_vectors(_blended(s / self.length)[0][:, None] * turns)
        return rotations

    def direction_at(self, s: float) -> FloatArray:
        """Return the direction (3,) after s, unit."""
        angle = self.angle * _eased(s / self.length)
        direction: FloatArray = np.cos(angle) * self.before.direction + np.sin(angle) * self.side
        return direction

    def angular_velocity(self, s: float) -> FloatArray:
        """Return the angular velocity (3,) after s, rad/m, in the base's axes."""
        (first,) = self.before.rotations(np.array([s - self.reach]))
        (last,) = self.after.rotations(np.array([s + self.reach - self.length]))
        between = first.T @ last
        turn = rotation_vector(between)
        rate = pin.Jlog3(between) @ (self.after.rate - between.T @ self.before.rate)
        weight, slope = _blended(s / self.length)
        turned = pin.exp3(weight * turn)
        own = pin.Jexp3(weight * turn) @ (slope / self.length * turn + weight * rate)
        velocity: FloatArray = first @ (self.before.rate + turned @ own)
        return velocity


@dataclass(frozen=True, eq=False)
class Polyline:
    """A path straight from pose to pose, its corners cut, at one speed along u.

    Attributes:
        pieces: Straight parts and corners, in order.
    """

    pieces: tuple[_Straight | _Corner, ...]

    @classmethod
    def through(cls, start: Pose, between: Sequence[Pose], end: Pose, blend: float) -> Polyline:
        """Return the polyline from pose to pose.

        Args:
            start: Where it begins.
            between: Where its corners are.
            end: Where it ends. Without a rotation in both, any orientation will do.
            blend: How far from a corner it leaves the straight line, m; less where half of a line is shorter.

        Raises:
            NoPath: It turns back at a pose, or see `via_poses`.
        """
        poses = via_poses(start, between, end)
        lines = _lines(poses)
        reaches = np.minimum(blend, np.minimum(poses.lengths[:-1], poses.lengths[1:]) / 2.0)
        pieces: list[_Straight | _Corner] = []
        for k, line in enumerate(lines):
            if k > 0:
                corner = _Corner.between(_ended(lines[k - 1]), line, float(reaches[k - 1]))
                if corner.angle > SHARPEST:
                    message = "the polyline turns back here: let it end at a waypoint of its own"
                    raise NoPath(message, "poses", int(poses.indices[k]))
                pieces.append(corner)
            first = 0.0 if k == 0 else float(reaches[k - 1])
            last = line.length if k == len(lines) - 1 else line.length - float(reaches[k])
            if last - first > POSITION_TOLERANCE * line.length:
                pieces.append(_part(line, first, last))
        return cls(tuple(pieces))

    @cached_property
    def _starts(self) -> FloatArray:
        """The ways (pieces + 1,), m, after which the pieces begin, and the whole."""
        starts: FloatArray = np.concatenate([[0.0], np.cumsum([piece.length for piece in self.pieces])])
        return starts

    @cached_property
    def breakpoints(self) -> FloatArray:
        """The parameters (pieces + 1,), from 0 to 1, at which the pieces begin and the last one ends."""
        breakpoints: FloatArray = self._starts / self._starts[-1]
        return breakpoints

    def poses(self, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Positions (N, 3), m, and rotations (N, 3, 3) at parameters (N,); None: none is asked."""
        of_pieces = np.clip(np.searchsorted(self.breakpoints, u, side="right") - 1, 0, len(self.pieces) - 1)
        since = u * self._starts[-1] - self._starts[of_pieces]
        positions, rotations = np.empty((len(u), 3)), np.empty((len(u), 3, 3))
        for k in np.unique(of_pieces).tolist():
            own, piece = of_pieces == k, self.pieces[k]
            positions[own] = piece.positions(since[own])
            if self._turns:
                rotations[own] = piece.rotations(since[own])
        return positions, rotations if self._turns else None

    def pose(self, u: float) -> Pose:
        """Return the pose at u."""
        positions, rotations = self.poses(np.array([u]))
        return Pose(positions[0], None if rotations is None else rotations[0])

    def twist(self, u: float) -> FloatArray:
        """Return the linear over the angular velocity (6,) by u; (3,) without a rotation."""
        k = min(max(int(np.searchsorted(self.breakpoints, u, side="right")) - 1, 0), len(self.pieces) - 1)
        piece, whole = self.pieces[k], float(self._starts[-1])
        s = u * whole - float(self._starts[k])
        linear = whole * piece.direction_at(s)
        return np.concatenate([linear, whole * piece.angular_velocity(s)]) if self._turns else linear

    @cached_property
    def _turns(self) -> bool:
        first = self.pieces[0]
        return (first if isinstance(first, _Straight) else first.before).rotation is not None


def _eased(x: Number) -> Number:
    """Return the share 3 x^2 - 2 x^3 of a turn."""
    return x * x * (3.0 - 2.0 * x)


def _blended(x: Number) -> tuple[Number, Number]:
    """Return the share 10 x^3 - 15 x^4 + 6 x^5 and its derivative."""
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * (x * (1.0 - x)) ** 2


def _lines(poses: ViaPoses) -> list[_Straight]:
    """Return the straight lines from pose to pose."""
    lines = []
    for k, length in enumerate(poses.lengths.tolist()):
        direction = (poses.positions[k + 1] - poses.positions[k]) / length
        rotation, rate = None, np.zeros(3)
        if poses.rotations is not None:
            rotation = poses.rotations[k]
            rate = rotation_vector(rotation.T @ poses.rotations[k + 1]) / length
        lines.append(_Straight(length, poses.positions[k], direction, rotation, rate))
    return lines


def _part(line: _Straight, first: float, last: float) -> _Straight:
    """Return the part of a line from `first` to `last`, m."""
    rotation = None if line.rotation is None else line.rotations(np.array([first]))[0]
    return _Straight(last - first, line.origin + first * line.direction, line.direction, rotation, line.rate)


def _ended(line: _Straight) -> _Straight:
    """Return a line as it goes on from its end."""
    return _part(line, line.length, line.length)
