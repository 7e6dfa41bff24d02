"""Planes between two pieces at one joint position, and their bounds at others, see `planner.scene.continuous`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.scene.bodies import Placements
from planner.scene.point_cloud import Cluster
from planner.shapes import HalfSpace, Shape
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING
from tests.planner.scene.reference.bounds import Items, ReferenceChecker


def normals_at(checker: ReferenceChecker, placements: Placements, items: Items, normals: FloatArray) -> FloatArray:
    """Return the normals (n, 3) of planes between n pairs in both joints' frames: (n, 2, 3)."""
    joints = checker.joints_of(items.pairs)
    turned: FloatArray = (normals[:, None, None] @ placements.rotations[items.rows[:, None], joints])[:, :, 0]
    return turned


def plane_bounds(checker: ReferenceChecker, placements: Placements, items: Items, normals: FloatArray) -> FloatArray:
    """Bound the distances of pairs from below by planes from other joint positions."""
    joints = checker.joints_of(items.pairs)
    rotations = placements.rotations[items.rows[:, None], joints]
    in_base = (rotations @ normals[..., None])[..., 0]
    shapes = checker.numbers_of(items.pairs)
    count = len(items.rows)
    reach, scale = np.zeros((count, 2)), np.ones(count)
    for number in np.unique(shapes).tolist():
        side = np.argwhere(shapes == number)
        rows, ends = side[:, 0], side[:, 1]
        joint, rotation, translation, shape = checker.placed_shape(number)
        at_joint = placements.rotations[items.rows[rows], joint]
        turn = at_joint @ rotation
        origin = at_joint @ translation + placements.origins[items.rows[rows], joint]
        towards = in_base[rows] * np.where(ends == 0, 1.0, -1.0)[:, None, None]
        reach[rows] += _supports(shape, (towards @ turn).reshape(-1, 3)).reshape(-1, 2)
        reach[rows] += (towards @ origin[..., None])[..., 0]
        scale[rows] += np.abs(origin).max(axis=1)
    found = np.where((normals != 0.0).any(axis=2), -reach, -np.inf).max(axis=1)
    return np.asarray(found - 2.0 * ROUNDING * scale, dtype=np.float64)


class Changes(NamedTuple):
    """Changes of joints within N intervals of time."""

    velocities: FloatArray
    half_times: FloatArray
    reach: FloatArray
    remainders: FloatArray


def approaches(
    checker: ReferenceChecker, placements: Placements, items: Items, normals: FloatArray, changes: Changes
) -> FloatArray:
    """Bound the approach of pairs along planes within intervals of time, to second order."""
    rows, own, numbers = items.rows, items.pairs < checker.own_pairs, checker.numbers_of(items.pairs)
    movers = np.where(own, numbers[:, 1], numbers[:, 0])
    moved_by, standing = checker.bodies.is_moved, numbers[own, 0]
    joints, both_move = moved_by[movers], np.zeros(len(rows), dtype=bool)
    both_move[own] = (moved_by[standing] & ~joints[own]).any(axis=1)
    joints[own] &= ~moved_by[standing]
    half_space = numbers[:, 1] - len(checker.bodies.pieces) - len(checker.obstacles.pieces)
    on_plane = ~own & (half_space >= 0)
    d = np.where(own, -1.0, 1.0)[:, None] * normals
    d[on_plane] = -checker.obstacles.normals[half_space[on_plane]]
    axes = placements.rotations[rows, 1:, :, 2]
    origins = placements.origins[rows, 1:]
    is_angle = checker.bodies.is_angle
    rates = changes.velocities[rows] * joints
    turning, sliding = rates * is_angle, rates * ~is_angle
    angular = (turning[..., None] * axes).sum(axis=1)
    linear = (sliding[..., None] * axes - turning[..., None] * np.cross(axes, origins)).sum(axis=1)
    steps = changes.half_times[rows, None] * np.array([0.0, -1.0, 1.0])
    directions = d[:, None] + steps[..., None] * np.cross(d, angular)[:, None]
    supports = steps * (d * linear).sum(axis=1)[:, None]
    for number in np.unique(movers).tolist():
        mine = np.flatnonzero(movers == number)
        joint, rotation, translation, shape = checker.placed_shape(number)
        if isinstance(shape, Cluster):
            raise TypeError("balls stand still")
        turn = placements.rotations[rows[mine], joint]
        origin = (turn @ translation + placements.origins[rows[mine], joint])[..., None]
        local = directions[mine] @ (turn @ rotation)
        supports[mine] += shape.support(local.reshape(-1, 3)).reshape(-1, 3) + (directions[mine] @ origin)[..., 0]
    first_order = np.maximum(supports[:, 1], supports[:, 2]) - supports[:, 0]
    levers = placements.levers[rows, movers] * joints
    bounds = changes.reach[rows] * joints
    moved = levers * bounds  # no less than the chords
    beyond = moved[:, ::-1].cumsum(axis=1)[:, ::-1] - moved
    # The second derivative by joints j <= k is the distance from the axis of k at most, and 0 where j slides.
    later = bounds * (levers + beyond)
    after = later[:, ::-1].cumsum(axis=1)[:, ::-1] - later
    second_order = (bounds * is_angle * (later / 2.0 + after)).sum(axis=1)
    rounding = 4.0 * ROUNDING * (1.0 + np.abs(origins).max(axis=(1, 2)))
    nearer = first_order + second_order + (levers * changes.remainders[rows]).sum(axis=1) + rounding
    return np.where(both_move | ~d.any(axis=1), np.inf, nearer)


def _supports(shape: Shape | Cluster, directions: FloatArray) -> FloatArray:
    """Compute the supports of a shape; infinite for shapes that no plane from another joint position separates."""
    if isinstance(shape, Cluster | HalfSpace):
        return np.full(len(directions), np.inf)
    return shape.support(directions)
