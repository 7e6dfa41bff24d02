"""Barriers: positions of the first joint at which the arm collides, whatever its other joints do.

The first joint takes every position between its start and its goal. If a link collides at one of them at all positions
of the second joint, and no other joint moves that link, no path exists.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.kinematics.turns import TURN
from planner.robots import Robot
from planner.scene import CONTACT_TOLERANCE, CollisionChecker
from planner.spatial import FloatArray

BARRIER_STEP = 0.01
"""Distance between checked positions of the first joint, rad or m."""

MOST_POSITIONS = 1000
"""Largest number of these positions on one side of the start; a longer rail is checked at larger steps."""

FINEST_INTERVAL = 0.01
"""Half of the smallest interval of the second joint in which a collision is looked for, rad or m."""

OVERLAP = 2.0 * CONTACT_TOLERANCE
"""Distance below its margin at which a pair collides beyond doubt, m."""


class Barrier(NamedTuple):
    """The reason why no path exists.

    Attributes:
        joint: Name of the first joint.
        objects: Names of the objects that it cannot pass, in alphabetical order.
    """

    joint: str
    objects: tuple[str, ...]


def find_barrier(
    robot: Robot, checker: CollisionChecker, start: FloatArray, goals: FloatArray, *, joints: int
) -> Barrier | None:
    """Find the objects that the first joint cannot pass on its way to any goal.

    Args:
        robot: The arm with its position limits.
        checker: The arm and its scene. Collisions of the arm with itself are ignored.
        start: Collision-free joint positions (joints,), rad or m.
        goals: Collision-free joint positions (goals, joints), rad or m.
        joints: Number of joints that move the checked links: 1 or 2.

    Returns:
        None: a path may exist.
    """
    first, ends = start[0], goals[:, 0]
    if robot.is_angle[0] and not np.isfinite(robot.limit("upper")[0] - robot.limit("lower")[0]):
        ahead = np.mod(ends - first, TURN)
        ends = first + np.concatenate([ahead, ahead - TURN])
    objects: set[str] = set()
    for side in (ends[ends < first], ends[ends >= first]):
        if len(side):
            nearest = float(side[np.abs(side - first).argmin()])
            blocking = _blocking_objects(robot, checker, start, nearest, min(joints, robot.dof))
            if not blocking:
                return None
            objects |= blocking
    return Barrier(robot.joint_names[0], tuple(sorted(objects)))


def _blocking_objects(robot: Robot, checker: CollisionChecker, start: FloatArray, end: float, joints: int) -> set[str]:
    """Return the names of the objects at a barrier between a start (joints,) and a position of the first joint."""
    count = min(int(np.ceil(abs(end - start[0]) / BARRIER_STEP)) + 1, MOST_POSITIONS)
    first = np.linspace(start[0], end, count)
    names: list[set[str]] = [set() for _ in first]
    middle, half = (0.0, 0.0) if joints == 1 else _second_range(robot)
    passable = np.full(count, not np.isfinite(half))
    rows, middles = np.arange(count), np.full(count, middle)
    while len(rows) and not passable.all():
        positions = np.tile(start, (len(rows), 1))
        positions[:, 0] = first[rows]
        if joints > 1:
            positions[:, 1] = middles
        overlaps, changes, found = _overlaps(checker, positions, half, joints)
        proved = overlaps > changes
        for k in np.flatnonzero(proved).tolist():
            names[rows[k]].add(found[k])
        passable[rows[~proved & ((overlaps <= 0.0) | (half < FINEST_INTERVAL))]] = True
        left = ~proved & ~passable[rows]
        half /= 2.0
        rows, middles = np.tile(rows[left], 2), np.concatenate([middles[left] - half, middles[left] + half])
    return next((found for found, free in zip(names, passable, strict=True) if not free), set())


def _second_range(robot: Robot) -> tuple[float, float]:
    """Return the middle of the second joint's range and half of its width; infinite where it slides without limits."""
    lower, upper = (float(robot.limit(side)[1]) for side in ("lower", "upper"))
    if robot.is_angle[1] and not upper - lower < TURN:
        return 0.0, np.pi
    return (lower + upper) / 2.0, (upper - lower) / 2.0


def _overlaps(
    checker: CollisionChecker, positions: FloatArray, half: float, joints: int
) -> tuple[FloatArray, FloatArray, list[str]]:
    """Find for each joint position (N, dof) the pair that collides in the widest interval of the second joint.

    Args:
        checker: The arm and its scene.
        positions: Joint positions (N, dof), rad or m.
        half: Half of the interval of the second joint around each of them, rad or m.
        joints: Number of joints that move the checked links.

    Returns:
        The overlap (N,) of the pair beyond its margin, m; the largest change (N,) of it in the interval, m; the names
        of the objects.
    """
    bodies, still = checker.bodies, np.zeros_like(positions)
    moved_by_others = bodies.is_moved[:, joints:].any(axis=1)
    margins = np.where(moved_by_others[:, None], -np.inf, checker.margins - OVERLAP)
    near = checker.near_items(positions, still, margins, -np.inf)
    rows, indices = np.unique(near.rows, return_inverse=True)
    placements, excursions = bodies.at(positions[rows]), still[rows]
    excursions[:, 1:joints] = half
    displacements = bodies.displacements(placements, excursions).sum(axis=-1)
    overlaps, changes, names = np.zeros(len(positions)), np.zeros(len(positions)), [""] * len(positions)
    least = checker.margins_of(near.pairs) - OVERLAP
    near_pairs = (near.rows.tolist(), indices.tolist(), near.pairs.tolist(), least.tolist())
    for row, index, pair, margin in zip(*near_pairs, strict=True):
        if overlaps[row] > changes[row]:
            continue
        overlap = margin - checker.separate(placements, index, pair).distance
        change = displacements[index, (pair - checker.own_pairs) // len(checker.obstacles.all)]
        if overlap > 0.0 and (not names[row] or overlap - change > overlaps[row] - changes[row]):
            overlaps[row], changes[row], names[row] = overlap, change, checker.names(pair)[1]
    return overlaps, changes, names
