"""Paths of the tool as polynomials, part by part, for bounds on the deviation from them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planner.kernels.bounded_peaks import PATH_POWERS
from planner.spatial import FloatArray, rotation_vectors, rotations_from_vectors

Poses = Callable[[FloatArray], tuple[FloatArray, FloatArray | None]]
"""Positions (N, 3), m, and rotations (N, 3, 3) or None at parameters (N,) of a path."""

NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(PATH_POWERS + 1) / PATH_POWERS)
"""Fractions of a part at which its polynomials have the values of the path: Chebyshev's, with both ends."""

BETWEEN = 0.5 * (NODES[:-1] + NODES[1:])
"""Fractions at which the polynomials are compared with the path: there they are farthest off, or almost."""

BY_POWER = np.linalg.inv(NODES[1:, None] ** np.arange(1, PATH_POWERS + 1))
"""Matrix from values at the nodes after the first, less the first value, to the coefficients of u, u^2, ..."""

POWERS_BETWEEN = BETWEEN[:, None] ** np.arange(1, PATH_POWERS + 1)
"""The powers of these fractions."""

SLOPES = np.arange(1, PATH_POWERS + 1) * NODES[:, None] ** np.arange(PATH_POWERS)
"""The derivatives of the powers at the nodes."""

SHARPEST_PART = 0.5
"""Angle, rad, between a part's direction and its chord above which it is halved: then one of its points is nearest."""

SHORTEST_SLOPE = 1e-9
"""Length, m, of a part that may have any direction."""

PARTS_KNOWN_TO = 1e-9
"""Deviation of the polynomials from the path, m or rad, above which a part is halved."""

CAUTION_OF_PARTS = 2.0
"""Factor on the largest deviation of the polynomials at the compared fractions: they may be farther off elsewhere."""

MOST_HALVINGS_OF_PARTS = 14
"""The most times that a part is halved."""

OVERLAP = 0.1
"""Share of a part by which it reaches into its smooth neighbours, so that an interval of time needs one part only."""


NO_SPHERE = np.array([0.0, 0.0, 0.0, np.inf])
"""A sphere around everything."""

CAUTION_OF_SPHERES = 1.1
"""Factor on the radius of the sphere around the nodes of a part: the part is inside."""


class PathParts(NamedTuple):
    """The parts of a path.

    Attributes:
        numbers: (parts, ...), the first numbers of `ToolPaths`.
        has_rotations: Whether the path has rotations.
        error: Largest deviation of the parts from the path, m and rad.
    """

    numbers: FloatArray
    has_rotations: bool
    error: float


def polynomial_parts(poses: Poses, breakpoints: FloatArray) -> PathParts:
    """Cut a path into parts on which polynomials of degree `PATH_POWERS` follow its positions and its turns.

    Args:
        poses: The poses of the path, smooth between breakpoints.
        breakpoints: Parameters (pieces + 1,), ascending.
    """
    starts, ends = breakpoints[:-1], breakpoints[1:]
    lowest, highest = starts, ends
    kept: list[tuple[FloatArray, FloatArray]] = []
    largest, has_rotations = 0.0, False
    for halving in range(MOST_HALVINGS_OF_PARTS + 1):
        reach = OVERLAP * (ends - starts)
        first, last = np.maximum(starts - reach, lowest), np.minimum(ends + reach, highest)
        numbers, error, is_bent, has_rotations = _fit(poses, first, last)
        rough = ((error > PARTS_KNOWN_TO) | is_bent) & (halving < MOST_HALVINGS_OF_PARTS)
        kept.append((starts[~rough], numbers[~rough]))
        largest = max(largest, float(error[~rough].max(initial=0.0)))
        if not rough.any():
            break
        middles = 0.5 * (starts + ends)[rough]
        starts, ends = np.concatenate([starts[rough], middles]), np.concatenate([middles, ends[rough]])
        lowest, highest = np.tile(lowest[rough], 2), np.tile(highest[rough], 2)
    order = np.argsort(np.concatenate([start for start, _ in kept]))
    return PathParts(np.concatenate([own for _, own in kept])[order], has_rotations, CAUTION_OF_PARTS * largest)


def part_numbers(
    angle: float, degree: int, rotation: FloatArray | None, turns: FloatArray, origin: FloatArray, along: FloatArray
) -> FloatArray:
    """Return the first numbers of `ToolPaths` for a path of one part, which needs no sphere.

    Args:
        angle: rad, of a circle; 0: a polynomial.
        degree: Of the polynomials.
        rotation: (3, 3), at the start; None: any orientation will do.
        turns: (powers, 3), rad.
        origin: (3,), m.
        along: (powers, 3), m.
    """
    by_power = np.zeros((2, PATH_POWERS, 3))
    by_power[0, : len(turns)], by_power[1, : len(along)] = turns, along
    turned = np.eye(3) if rotation is None else rotation
    head = [angle, float(degree)]
    return np.concatenate([head, turned.ravel(), by_power[0].ravel(), origin, by_power[1].ravel(), NO_SPHERE])


def _fit(poses: Poses, first: FloatArray, last: FloatArray) -> tuple[FloatArray, FloatArray, np.ndarray, bool]:
    """Return parts from `first` (N,) to `last` (N,): numbers (N, ...), errors (N,), if bent (N,), if they turn."""
    count, fractions = len(first), np.concatenate([NODES, BETWEEN, [0.5]])
    u = first[:, None] + (last - first)[:, None] * fractions
    positions, rotations = poses(u.ravel())
    at = positions.reshape(count, len(fractions), 3)
    nodes, between = slice(1, len(NODES)), slice(len(NODES), -1)
    origin = at[:, 0]
    along = BY_POWER @ (at[:, nodes] - origin[:, None])
    error = np.linalg.norm(origin[:, None] + POWERS_BETWEEN @ along - at[:, between], axis=2).max(axis=1)
    slopes, chords = SLOPES @ along, along.sum(axis=1)[:, None]
    lengths = np.linalg.norm(slopes, axis=2) * np.linalg.norm(chords, axis=2)
    is_bent = ((slopes * chords).sum(axis=2) < np.cos(SHARPEST_PART) * lengths - SHORTEST_SLOPE**2).any(axis=1)
    radius = CAUTION_OF_SPHERES * np.linalg.norm(at - at[:, -1:], axis=2).max(axis=1)
    starts, turns = np.tile(np.eye(3), (count, 1, 1)), np.zeros_like(along)
    if rotations is not None:
        turned = rotations.reshape(count, len(fractions), 3, 3)
        starts = turned[:, 0]
        back = starts.transpose(0, 2, 1)[:, None]
        turns = BY_POWER @ _vectors(back @ turned[:, nodes])
        reached = _rotations(POWERS_BETWEEN @ turns).transpose(0, 1, 3, 2)
        error = np.maximum(error, np.linalg.norm(_vectors(reached @ back @ turned[:, between]), axis=2).max(axis=1))
    head = np.tile([0.0, float(PATH_POWERS)], (count, 1))
    parts = (head, starts, turns, origin, along, at[:, -1], radius)
    return np.hstack([part.reshape(count, -1) for part in parts]), error, is_bent, rotations is not None


def _vectors(rotations: FloatArray) -> FloatArray:
    """Return the rotation vectors (N, M, 3) of rotations (N, M, 3, 3)."""
    return rotation_vectors(rotations.reshape(-1, 3, 3)).reshape(*rotations.shape[:2], 3)


def _rotations(vectors: FloatArray) -> FloatArray:
    """Return the rotations (N, M, 3, 3) of rotation vectors (N, M, 3)."""
    return rotations_from_vectors(vectors.reshape(-1, 3)).reshape(*vectors.shape[:2], 3, 3)
