"""Paths that leave the written path of the tool: through its tolerance region, or through a singular wrist."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.kinematics.configurations import WRIST, straight_wrist
from planner.kinematics.forward import jacobian, tool_pose
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import STEADY, Search
from planner.problems.regions import TURNS, Region
from planner.robots import Robot
from planner.robots.tools import with_region_joints
from planner.spatial import FloatArray, Pose, rotation_vector
from planner.tool_motions.follow import Lost
from planner.tool_motions.pose_paths import PosePath
from planner.trajectories.polynomials import PiecewisePolynomial, quintics_through
from planner.trajectories.splines import slopes_between

POSITION_WEIGHT = 1e4
"""Weight of a position, m, beside an orientation, rad, where the two cannot both be kept: the position is."""

MOST_WRIST_STEPS = 50
"""The most Gauss-Newton steps to the point where the wrist is nearest to singular."""

WRIST_FOUND = 1e-12
"""The step, rad or m and share of the path, at which that point is found."""

SMALLEST_SHARE = 1e-3
"""Smallest part of the path, on either side of the singularity, over which the tool leaves the orientation and returns.
"""

NODES = 13
"""Number of points of the path at which offsets are sought, the ends among them."""

OFFSET_ROOM = 0.05
"""The share of its range by which a joint keeps off its limits at nodes: between nodes it is nearly where they have
it."""

RAMP = 0.2
"""The part of the way at either end, in u, on which that room grows from nothing: the ends may be at a limit."""

OFFSET_LOOKS = 201
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
        breakpoints: (n,), the parameters from 0 to 1 between which it is followed.
    """

    path: PosePath
    region: Region
    offsets: PiecewisePolynomial
    breakpoints: FloatArray

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


def by_region_joints(
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
    free = with_region_joints(robot, region.ranges)
    span = robot.limit("upper") - robot.limit("lower")
    span = np.where(np.isfinite(span), span, 0.0)
    at_ends = np.zeros(len(region.ranges))
    scales = np.append(np.where(span > 0.0, span, 2.0 * np.pi), np.full(len(at_ends), OFFSET_SCALE))
    offsets = np.zeros((NODES, len(at_ends)))
    solution = np.concatenate([start, at_ends])
    for node in range(1, NODES - 1):
        u = node / (NODES - 1)
        straight = start + u * (end - start)
        search = Search(free, path.pose(u), options)
        room = np.append(OFFSET_ROOM * min(1.0, u / RAMP, (1.0 - u) / RAMP) * span, at_ends)
        search.lower, search.upper = search.lower + room, search.upper - room
        guesses = np.concatenate([straight, offsets[node - 1][::-1]]), solution
        solved = next((q for guess in guesses if (q := search.solve(guess, STEADY)) is not None), None)
        if solved is None:
            return None
        solution = search.target.slide(solved, np.append(straight, at_ends), scales, search.box)
        offsets[node] = solution[robot.dof :][::-1]
    lower, upper = np.array(list(region.ranges.values())).T
    smooth = _smooth(offsets)
    (values,) = smooth.evaluate(np.linspace(0.0, 1.0, OFFSET_LOOKS), [0])
    is_in = ((values >= lower) & (values <= upper)).all()
    breakpoints = np.union1d(path.breakpoints, smooth.breakpoints[1:-1])
    return OffsetPath(path, region, smooth if is_in else _without_overshoot(offsets), breakpoints)


def _smooth(offsets: FloatArray) -> PiecewisePolynomial:
    """Return quintics through offsets (nodes, coordinates) at even u, with derivatives by differences."""
    step = 1.0 / (len(offsets) - 1)
    slopes = np.gradient(offsets, step, axis=0, edge_order=2)
    bends = np.diff(offsets, 2, axis=0) / step**2
    bends = np.vstack([bends[:1], bends, bends[-1:]])
    return quintics_through(np.full(len(offsets) - 1, step), offsets, slopes, bends)


def _without_overshoot(offsets: FloatArray) -> PiecewisePolynomial:
    """Return quintics through offsets (nodes, coordinates) at even u, without curvature at the nodes.

    Their slopes there are the harmonic means of those beside them (Fritsch and Butland 1984).
    """
    lengths = np.full(len(offsets) - 1, 1.0 / (len(offsets) - 1))
    means = np.diff(offsets, axis=0) / lengths[:, None]
    slopes = np.vstack([means[:1], slopes_between(means[:-1], means[1:]), means[-1:]])
    return quintics_through(lengths, offsets, slopes, np.zeros_like(offsets))


def through_singular_wrist(robot: Robot, path: PosePath, lost: Lost) -> tuple[OffsetPath, float] | None:
    """Return the path through the wrist singularity near the point where another path got lost.

    At the singularity, axes 4 and 6 are parallel and the tool is on the path, turned by the least angle. Gauss-Newton
    finds it in the other joints and u, with the orientation in the sense of least squares.

    Returns:
        The path, whose offsets from the other one ascend from nought to that point and fall again; and the angle, rad,
        between the two there. None: the arm has no such wrist, the path no orientation, or it is not singular within
        the path.
    """
    straight = straight_wrist(robot)
    if straight is None or path.pose(lost.u).rotation is None:
        return None
    q, u = lost.position.copy(), lost.u
    q[WRIST] = straight + np.pi * np.round((q[WRIST] - straight) / np.pi)
    moving = np.arange(WRIST)  # beside the last joint, which turns about the same axis as the fourth
    weights = np.repeat([POSITION_WEIGHT, 1.0], 3)
    for _ in range(MOST_WRIST_STEPS):
        pose, here = path.pose(u), tool_pose(robot, q)
        turn = rotation_vector(pose.rotation @ np.asarray(here.rotation).T)
        missing = np.concatenate([pose.position - here.position, turn])
        columns = np.column_stack([jacobian(robot, q)[:, moving], -path.twist(u)])
        step = np.linalg.lstsq(columns * weights[:, None], missing * weights, rcond=None)[0]
        q[moving] += step[:-1]
        u += float(step[-1])
        if not SMALLEST_SHARE < u < 1.0 - SMALLEST_SHARE:
            return None
        if np.abs(step).max() < WRIST_FOUND:
            turns = Region(**dict.fromkeys(TURNS, (-np.pi, np.pi)))
            offsets = np.zeros((3, len(TURNS)))
            offsets[1] = list(turns.offsets(pose, here).values())
            quintics = quintics_through(np.array([u, 1.0 - u]), offsets, *np.zeros((2, *offsets.shape)))
            return OffsetPath(path, turns, quintics, path.breakpoints), float(np.linalg.norm(turn))
    return None
