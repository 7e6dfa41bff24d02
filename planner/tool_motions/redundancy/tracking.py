"""The solutions of an arm without a closed form along a path: by descents from the solutions at the pose before."""

from __future__ import annotations

import numpy as np

from planner.kernels.descent import Box
from planner.kinematics.descent import Target
from planner.kinematics.screws import screws_of
from planner.kinematics.search import STEADY
from planner.spatial import FloatArray
from planner.tool_motions.redundancy.coordinates import OpenCoordinates, States

TRACKED_ERROR = 1e-7
"""Largest error of a descent, m and rad, at which it has reached a pose."""

SAME_STATE = 1e-3
"""Largest distance of joints, rad or m, at which two descents to one pose have the same end."""


def tracked_states(
    coordinates: OpenCoordinates,
    nodes: np.ndarray,
    positions: FloatArray,
    rotations: FloatArray,
    values: FloatArray,
    guide: FloatArray,
    room: FloatArray,
) -> States:
    """Find joint positions that reach poses, from node to node.

    At each node descents start from the ends at the node before for the same values and those beside, and from a guide.

    Args:
        coordinates: The open coordinates.
        nodes: (N,), the node of each pose, ascending.
        positions: (N, 3), m: the poses as they are written.
        rotations: (N, 3, 3).
        values: (N, coordinates).
        guide: (nodes, joints), rad or m.
        room: (nodes,): the share of its range that each joint keeps off its limits.
    """
    arm, carried = coordinates.arm, coordinates.carried
    points, turned = coordinates.seen(positions, rotations, values)
    target = Target(screws_of(arm), points, turned, arm.tool_in_tip.translation)
    lower, upper = arm.limit("lower"), arm.limit("upper")
    span = np.where(np.isfinite(upper - lower), upper - lower, 0.0)
    every, own = [np.zeros(0, dtype=np.intp)], [np.zeros((0, arm.dof))]
    before = np.zeros((0, arm.dof))
    for node in np.unique(nodes).tolist():
        rows = np.flatnonzero(nodes == node)
        near = np.repeat(guide[node, None, carried:], len(rows), axis=0)
        before = before if len(before) == len(rows) else near
        starts = np.stack([before, np.roll(before, 1, axis=0), np.roll(before, -1, axis=0), near], axis=1)
        box = Box(lower + room[node] * span, upper - room[node] * span)
        tried = np.clip(starts, box.lower, box.upper).reshape(-1, arm.dof)
        errors, ends = target.of(rows).descend(tried, box, STEADY)
        errors, ends = errors.reshape(starts.shape[:2]), ends.reshape(starts.shape)
        kept: np.ndarray = np.asarray(errors <= TRACKED_ERROR)
        before = ends[np.arange(len(rows)), kept.argmax(axis=1)]
        is_reached: np.ndarray = np.asarray(kept.any(axis=1))
        before = np.where(is_reached[:, None], before, near)
        for k in range(1, starts.shape[1]):
            again = np.abs(ends[:, :k] - ends[:, k, None]).max(axis=2) <= SAME_STATE
            kept[:, k] &= ~(again & kept[:, :k]).any(axis=1)
        which, end = np.nonzero(kept)
        every.append(rows[which])
        own.append(ends[which, end])
    found = np.concatenate(every)
    return States(found, np.hstack([values[found, :carried], np.concatenate(own)]))
