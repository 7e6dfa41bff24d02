"""Paths that leave the written path of the tool: through its tolerance region, or through a singular wrist."""

from __future__ import annotations

import numpy as np

from planner.kinematics.configurations import WRIST, straight_wrist
from planner.kinematics.forward import jacobian, tool_pose
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import STEADY, Search
from planner.problems.regions import TURNS, Region
from planner.robots import Robot
from planner.robots.tools import with_region_joints
from planner.spatial import FloatArray, rotation_vector
from planner.tool_motions.follow import Lost
from planner.tool_motions.pose_paths import PosePath
from planner.tool_motions.redundancy.offset_paths import OffsetPath
from planner.tool_motions.redundancy.smoothing import curve_through, room_off_limits
from planner.trajectories.polynomials import quintics_through

POSITION_WEIGHT = 1e4
"""Weight of a position, m, beside an orientation, rad, where the two cannot both be kept: the position is."""

GENTLE = 20.0
"""Travel of a joint, rad or m, for 1 m or rad of the tool above which the tool rather leaves its orientation.

At 3 rad/s the tool goes at 150 mm/s."""

SHARE_OF_DEVIATION = 0.9
"""The share of the tolerance of the orientation that a path through a singular wrist may use up."""

MOST_WRIST_STEPS = 50
"""The most Gauss-Newton steps to the point where the wrist is nearest to singular."""

WRIST_FOUND = 1e-12
"""The step, rad or m and share of the path, at which that point is found."""

SMALLEST_SHARE = 1e-3
"""Smallest part of the path, on either side of the singularity, over which the tool leaves the orientation and returns.
"""


NODES = 13
"""Number of points of the path at which offsets are sought, the ends among them."""

OFFSET_SCALE = 30.0
"""The offset, m or rad, that counts as much as the range of a joint: offsets are zero where the joints do not mind."""


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
        room = np.append(float(room_off_limits(np.array(u))) * span, at_ends)
        search.lower, search.upper = search.lower + room, search.upper - room
        guesses = np.concatenate([straight, offsets[node - 1][::-1]]), solution
        solved = next((q for guess in guesses if (q := search.solve(guess, STEADY)) is not None), None)
        if solved is None:
            return None
        solution = search.target.slide(solved, np.append(straight, at_ends), scales, search.box)
        offsets[node] = solution[robot.dof :][::-1]
    lower, upper = np.array(list(region.ranges.values())).T
    smooth = curve_through(offsets, lower, upper)
    return OffsetPath(path, region, smooth, np.union1d(path.breakpoints, smooth.breakpoints[1:-1]))


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
