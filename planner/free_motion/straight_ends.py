"""Detours whose ends are straight lines of the tool: out of a narrow opening, and into one, along the tool's axis."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from planner.free_motion.edges import FreeEdges
from planner.free_motion.free_path import FreePath, find_free_path
from planner.kinematics.forward import tool_pose
from planner.kinematics.options import InverseKinematicsOptions
from planner.problems.problem import LinearMotion, PoseWaypoint
from planner.robots import Robot
from planner.scene import CollisionChecker
from planner.spatial import FloatArray, Pose
from planner.tool_motions.tool_motion import RefusedMotion, RequestedMotion, ToolMotion, follow_motion

RETRACT_LENGTHS = (0.3, 0.2, 0.1, 0.05)
"""Lengths of the lines along which the tool may retract, m; the longest free one is used."""

LEG = 0.02
"""Length of the straight joint motions that approximate such a line within 0.1 mm, m."""

MOST_RETRACTED_GOALS = 4
"""Largest number of goals from which the tool retracts."""

SHARE = 0.25
"""The share of a search's motions that each search between such lines may check."""


def find_path_with_straight_ends(
    robots: Sequence[Robot],
    checker: CollisionChecker,
    start: FloatArray,
    goals: Sequence[FloatArray] | FloatArray,
    options: InverseKinematicsOptions,
    most_checks: int,
) -> FreePath | None:
    """Find a free path that ends, and if necessary begins, with a straight line along the tool's z axis.

    Args:
        robots: The arm with its tool at the start, and with its tool at the goals.
        checker: The arm and its obstacles.
        start: (joints,), rad or m, within the limits.
        goals: (goals, joints), within the limits: alternatives.
        options: The tolerances of the lines, and the seed of the search.
        most_checks: Largest number of motions checked by a search without lines.

    Returns:
        The path; None: none was found.
    """
    edges = FreeEdges(checker, inf)
    out = _line_back(edges, robots[0], start, options)
    lines = [_line_back(edges, robots[1], goal, options) for goal in goals[:MOST_RETRACTED_GOALS]]
    for first in [start[None], out][: len(out)]:
        if len(first) == 1 and all(len(line) == 1 for line in lines):
            continue  # that is the search without lines
        ends = [line[-1] for line in lines]
        most = int(SHARE * most_checks)
        path = find_free_path(robots[0], checker, first[-1], ends, most_checks=most, seed=options.seed)
        if path.status == "found":
            positions = np.concatenate([first[:-1], path.positions, lines[path.goal][-2::-1]])
            return FreePath("found", positions, path.goal, 0.0, path.checks)
    return None


def _line_back(edges: FreeEdges, robot: Robot, position: FloatArray, options: InverseKinematicsOptions) -> FloatArray:
    """Return joint positions (positions, joints) back along the tool's axis; the first one alone where none is free."""
    here, reach = tool_pose(robot, position), inf
    followed: ToolMotion | RefusedMotion | None = None
    for length in RETRACT_LENGTHS:
        if not isinstance(followed, ToolMotion) and length <= reach:
            there = Pose(here.position - length * np.asarray(here.rotation)[:, 2], here.rotation)
            waypoint, longest = PoseWaypoint(there, motion=LinearMotion()), length
            followed = follow_motion(RequestedMotion(robot, options, 0, waypoint, here, there), position)
            reach = followed.point.fraction * length if isinstance(followed, RefusedMotion) else length
        if isinstance(followed, ToolMotion):  # a shorter line is a part of it
            u = np.linspace(0.0, length / longest * followed.curve.breakpoints[-1], round(length / LEG) + 1)
            line: FloatArray = followed.curve.evaluate(u, [0])[0]
            if edges.first_unproved(line) is None:
                return line
    return position[None]
