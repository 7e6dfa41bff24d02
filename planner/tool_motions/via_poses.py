"""Poses of a polyline or spline of the tool: missing rotations filled in, repeated poses left out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from planner.kinematics.search import pose_errors
from planner.spatial import FloatArray, Pose
from planner.tolerances import POSITION_TOLERANCE
from planner.tool_motions.pose_paths import UNUSED_ORIENTATION, NoPath, Turn

LEAST_POSE_DISTANCE = 1e-6
"""Distance of two different poses, m, relative to the whole path.

Closer ones, with the tool turned, would make it turn on the spot.
"""


class ViaPoses(NamedTuple):
    """Two or more poses, no two neighbours of which are at one position.

    Attributes:
        positions: (N, 3), m.
        rotations: (N, 3, 3); None: any orientation will do.
        indices: (N,), of each among the poses of the motion; -1: the start; their number: the end.
    """

    positions: FloatArray
    rotations: FloatArray | None
    indices: np.ndarray

    @property
    def lengths(self) -> FloatArray:
        """The distances (N - 1,) from each to the next, m."""
        lengths: FloatArray = np.linalg.norm(np.diff(self.positions, axis=0), axis=1)
        return lengths


def via_poses(start: Pose, between: Sequence[Pose], end: Pose) -> ViaPoses:
    """List the poses of a motion.

    The rotation of a pose without one is interpolated on the shortest turn between the nearest poses with a rotation,
    by length of the path.

    Args:
        start: The pose of the waypoint before.
        between: The poses of the motion.
        end: The pose of the waypoint that it leads to. Without a rotation in both, any orientation will do.

    Raises:
        NoPath: A pose has a rotation but the end has none, the tool would turn on the spot, or the path has no length.
    """
    is_open = start.rotation is None or end.rotation is None
    for k, pose in enumerate(between):
        if is_open and pose.rotation is not None:
            raise NoPath(UNUSED_ORIENTATION, "poses", k)
    if is_open:
        start, end = Pose(start.position), Pose(end.position)
    kept, indices = [start], [-1]
    for k, pose in enumerate((*between, end)):
        distance, angle = pose_errors(pose, kept[-1])
        if max(distance, angle or 0.0) > POSITION_TOLERANCE:
            kept.append(pose)
            indices.append(k)
        elif kept[-1].rotation is None:
            kept[-1] = pose
    positions = np.array([pose.position for pose in kept])
    lengths = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    for k in np.flatnonzero(lengths <= LEAST_POSE_DISTANCE * lengths.sum()).tolist():
        message = "the tool would have to turn where it is: leave this pose out, or make it a waypoint"
        raise NoPath(message, "poses", min(indices[k + 1], len(between) - 1))
    if len(kept) < 2:
        raise NoPath("all poses are equal to the poses of the waypoints at its ends", "poses")
    rotations = None if is_open else _filled([pose.rotation for pose in kept], lengths)
    return ViaPoses(positions, rotations, np.array(indices))


def _filled(rotations: Sequence[FloatArray | None], lengths: FloatArray) -> FloatArray:
    """Interpolate missing rotations (N, 3, 3) between known ones; the first and the last are known."""
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    known = [k for k, rotation in enumerate(rotations) if rotation is not None]
    filled = [np.asarray(rotations[0])]
    for first, last in pairwise(known):
        turn = Turn.between(filled[-1], np.asarray(rotations[last]))
        shares = (at[first + 1 : last] - at[first]) / (at[last] - at[first])
        filled += [*map(turn.rotation, shares.tolist()), np.asarray(rotations[last])]
    return np.array(filled)
