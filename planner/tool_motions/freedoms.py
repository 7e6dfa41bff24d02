"""Motions of the tool whose poses are partly free: the offsets by which the joints get from one end to the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.kinematics.search import STEADY, Search
from planner.problems.regions import TURNS
from planner.robots.freedoms import with_freedoms
from planner.trajectories.polynomials import PiecewisePolynomial, quintic_hermite
from planner.trajectories.splines import slopes_between

if TYPE_CHECKING:
    from planner.kinematics.options import InverseKinematicsOptions
    from planner.problems.regions import Region
    from planner.robots import Robot
    from planner.spatial import FloatArray, Pose
    from planner.tool_motions.pose_paths import PosePath

NODES = 13
"""Number of points of the path at which offsets are sought, the ends among them."""

ROOM = 0.05
"""The share of its range by which a joint keeps off its limits at nodes: between nodes it is nearly where they have
it."""

RAMP = 0.2
"""The part of the way at either end, in u, on which that room grows from nothing: the ends may be at a limit."""

LOOKS = 201
"""Number of points of the path at which offsets are compared with their ranges."""

OFFSET_SCALE = 30.0
"""The offset, m or rad, that counts as much as the range of a joint: offsets are zero where the joints do not mind."""


@dataclass(frozen=True, eq=False)
class OffsetPath:
    """A path that differs from another path by offsets, which are zero at the ends.

    Attributes:
        path: The other path, with a rotation.
        region: What may be off.
        offsets: (pieces, coordinates, 6), over u from 0 to 1, m or rad.
    """

    path: PosePath
    region: Region
    offsets: PiecewisePolynomial

    @property
    def breakpoints(self) -> FloatArray:
        """The breakpoints of the other path and of the offsets."""
        return np.union1d(self.path.breakpoints, self.offsets.breakpoints[1:-1])

    def pose(self, u: float) -> Pose:
        """Return the pose at u."""
        return self.region.pose(self.path.pose(u), self.offsets.evaluate(np.array([u]), [0])[0][0])

    def twist(self, u: float) -> FloatArray:
        """Return the linear over the angular velocity (6,) by u, in the base's axes."""
        here, twist = self.path.pose(u), self.path.twist(u)
        values, rates = (rows[0] for rows in self.offsets.evaluate(np.array([u]), [0, 1]))
        assert here.rotation is not None  # noqa: S101 - there is no freedom without rotations
        shift, linear, angular, turned = np.zeros(3), np.zeros(3), np.zeros(3), np.eye(3)
        for name, value, rate in zip(self.region.ranges, values.tolist(), rates.tolist(), strict=True):
            axis = np.eye(3)["xyz".index(name[-1])]
            if name in TURNS:
                angular = angular + rate * turned @ axis
                turned = turned @ TURNS[name](value)
            else:
                shift, linear = shift + value * axis, linear + rate * axis
        moved = twist[:3] + np.cross(twist[3:], here.rotation @ shift) + here.rotation @ linear
        return np.concatenate([moved, twist[3:] + here.rotation @ angular])


def by_freedoms(
    robot: Robot,
    path: PosePath,
    region: Region,
    start: FloatArray,
    end: FloatArray,
    options: InverseKinematicsOptions,
) -> OffsetPath | None:
    """Return the path with the offsets that bring the joints nearest to the straight motion from start to end.

    The function solves some nodes one after the other, within the position limits. At each it takes the joint position
    nearest to the straight motion, by least squares relative to the joints' ranges.

    Args:
        robot: The robot, with its tool; together with the region's coordinates it is redundant.
        path: The path as it is written.
        region: The tolerance region of its poses.
        start: (joints,), at its start.
        end: (joints,), at its end.
        options: How poses are solved.

    Returns:
        None: no joint position was found at a node.
    """
    free = with_freedoms(robot, region.ranges)
    span = robot.limit("upper") - robot.limit("lower")
    span = np.where(np.isfinite(span), span, 0.0)
    at_ends = np.zeros(len(region.ranges))
    scales = np.append(np.where(span > 0.0, span, 2.0 * np.pi), np.full(len(at_ends), OFFSET_SCALE))
    offsets = np.zeros((NODES, len(at_ends)))
    posture = np.concatenate([start, at_ends])
    for node in range(1, NODES - 1):
        u = node / (NODES - 1)
        straight = start + u * (end - start)
        search = Search(free, path.pose(u), options)
        room = np.append(ROOM * min(1.0, u / RAMP, (1.0 - u) / RAMP) * span, at_ends)
        search.lower, search.upper = search.lower + room, search.upper - room
        guesses = np.concatenate([straight, offsets[node - 1][::-1]]), posture
        solved = next((q for guess in guesses if (q := search.solve(guess, STEADY)) is not None), None)
        if solved is None:
            return None
        posture = search.target.slide(solved, np.append(straight, at_ends), scales, search.box)
        offsets[node] = posture[robot.dof :][::-1]
    lower, upper = np.array(list(region.ranges.values())).T
    smooth = _smooth(offsets)
    (values,) = smooth.evaluate(np.linspace(0.0, 1.0, LOOKS), [0])
    is_in = ((values >= lower) & (values <= upper)).all()
    return OffsetPath(path, region, smooth if is_in else _without_overshoot(offsets))


def _smooth(offsets: FloatArray) -> PiecewisePolynomial:
    """Return quintics through offsets (nodes, coordinates) at even u, with derivatives by differences."""
    step = 1.0 / (len(offsets) - 1)
    slopes = np.gradient(offsets, step, axis=0, edge_order=2)
    bends = np.diff(offsets, 2, axis=0) / step**2
    bends = np.vstack([bends[:1], bends, bends[-1:]])
    lengths, values = np.full(len(offsets) - 1, step), (offsets, slopes, bends)
    starts, ends = tuple(rows[:-1] for rows in values), tuple(rows[1:] for rows in values)
    return PiecewisePolynomial(lengths, quintic_hermite(lengths, starts, ends))


def _without_overshoot(offsets: FloatArray) -> PiecewisePolynomial:
    """Return quintics through offsets (nodes, coordinates) at even u, without curvature at the nodes.

    Their slopes there are the harmonic means of those beside them (Fritsch and Butland 1984).
    """
    lengths = np.full(len(offsets) - 1, 1.0 / (len(offsets) - 1))
    means = np.diff(offsets, axis=0) / lengths[:, None]
    slopes = np.vstack([means[:1], slopes_between(means[:-1], means[1:]), means[-1:]])
    flat = np.zeros_like(offsets)
    starts, ends = (offsets[:-1], slopes[:-1], flat[:-1]), (offsets[1:], slopes[1:], flat[1:])
    return PiecewisePolynomial(lengths, quintic_hermite(lengths, starts, ends))
