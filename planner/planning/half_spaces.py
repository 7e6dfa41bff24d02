"""Half-spaces of joint positions between a motion that is free and one that is not: what keeps the next one clear."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.paths.half_spaces import HalfSpaces
from planner.scene import CollisionChecker
from planner.scene.continuous import near_pairs
from planner.spatial import FloatArray
from planner.trajectories.trajectory import Trajectory

HALF_SPACE_TIMES = 129
"""Number of shares of a segment's time at which there may be half-spaces."""

EXTRA_PAIR_DISTANCE = 0.05
"""Distance, m, beyond the required one, below which a pair that is too near elsewhere also gets half spaces.

Otherwise a motion would be too near just a little earlier or later.
"""

DISTANCE_BISECTIONS = 12
"""Number of halvings of the straight motion between two joint positions, in search of the allowed distance of a pair.
"""

DISTANCE_DIFFERENCE_STEP = 1e-4
"""Step of finite differences of distances, rad or m: distances are good to a millionth of it."""

LEAST_SLOPE = 1e-3
"""Change of a distance with the joints, m/rad or 1, below which no half-space stands for it."""

AT_ONCE = 2
"""The most half-spaces that are found at one share: several pairs may be too near."""


def half_spaces_between(
    checkers: Sequence[CollisionChecker], free: Trajectory, other: Trajectory, ahead: float
) -> HalfSpaces:
    """Return half spaces that contain a free motion and cut off the collisions of another motion.

    They linearise the distance of a pair at the joint position of the other motion. If the distance is too small there,
    they linearise it at the boundary on the straight motion from the free joint position of that time.

    Args:
        checkers: The robot and its obstacles on each segment.
        free: A motion that keeps all margins.
        other: A motion through the same waypoints.
        ahead: Distance that pairs keep in addition to their margins, m, or half of their reserve in the free motion.
    """
    shares = np.linspace(0.0, 1.0, HALF_SPACE_TIMES)
    found = [
        _cuts(checker, _at(free, segment, shares), _at(other, segment, shares), ahead)
        for segment, checker in enumerate(checkers)
    ]
    normals, offsets = (np.array(each) for each in zip(*found, strict=True))
    return HalfSpaces(normals, offsets)


def _at(motion: Trajectory, segment: int, shares: FloatArray) -> FloatArray:
    """Return the joint positions (N, joints) at fractions (N,) of a segment's time."""
    begin, end = motion.departures[segment], motion.arrivals[segment + 1]
    return motion.evaluate(begin + shares * (end - begin), [0])[0]


def _cuts(
    checker: CollisionChecker, free: FloatArray, other: FloatArray, ahead: float
) -> tuple[FloatArray, FloatArray]:
    """Return the normals (N, AT_ONCE, joints) and offsets (N, AT_ONCE) at both motions' joint positions (N, joints)."""
    normals, offsets = np.zeros((len(free), AT_ONCE, checker.dof)), np.full((len(free), AT_ONCE), -1.0)
    rows, pairs, bounds, far = near_pairs(checker, other, ahead + EXTRA_PAIR_DISTANCE)
    near = bounds < far - EXTRA_PAIR_DISTANCE
    too_near = _distances(checker, other[rows[near]], pairs[near]) < checker.margins_of(pairs[near]) + ahead
    held = np.isin(pairs, pairs[near][too_near])
    rows, pairs = rows[held], pairs[held]
    start, end, margins = free[rows], other[rows], checker.margins_of(pairs)
    room, seen = (_distances(checker, ends, pairs) for ends in (start, end))
    wanted = margins + np.clip((room - margins) / 2.0, 0.0, ahead)
    low, high = np.where(seen < wanted, 0.0, 1.0), np.ones(len(rows))
    for _ in range(DISTANCE_BISECTIONS):
        middle = (low + high) / 2.0
        keeps = _distances(checker, start + middle[:, None] * (end - start), pairs) >= wanted
        low, high = np.where(keeps, middle, low), np.where(keeps, high, middle)
    edge = start + low[:, None] * (end - start)
    steps = DISTANCE_DIFFERENCE_STEP * np.eye(checker.dof)
    rises = [_distances(checker, edge + step, pairs) - _distances(checker, edge - step, pairs) for step in steps]
    slopes = np.stack(rises, axis=1) / (2.0 * DISTANCE_DIFFERENCE_STEP)
    lengths = np.linalg.norm(slopes, axis=1)
    left_over = _distances(checker, edge, pairs) - wanted
    taken = np.zeros(len(free), dtype=int)
    for k in np.lexsort([left_over, low]).tolist():  # those first that are left first on the way
        row, column = rows[k], taken[rows[k]]
        if column == AT_ONCE or lengths[k] < LEAST_SLOPE:
            continue
        normal = slopes[k] / lengths[k]
        normals[row, column] = normal
        offsets[row, column] = min(normal @ edge[k] - left_over[k] / lengths[k], normal @ start[k])
        taken[row] += 1
    return normals, offsets


def _distances(checker: CollisionChecker, positions: FloatArray, pairs: np.ndarray) -> FloatArray:
    """Return the distances (n,), m, of pairs (n,), each at its joint position (n, joints); negative for overlaps."""
    placements = checker.bodies.at(positions)
    return np.array([checker.separate(placements, row, pair).proved for row, pair in enumerate(pairs.tolist())])
