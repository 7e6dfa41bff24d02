"""Joint positions at one pose for which a positioner holds the workpiece as flat as it can."""

from __future__ import annotations

import numpy as np

from planner.kinematics.configurations import sides_of
from planner.kinematics.costs import PREFERENCE_WEIGHT, motion_costs, tilts
from planner.kinematics.options import InverseKinematicsOptions
from planner.kinematics.search import STEADY, Search
from planner.kinematics.turns import nearest_turn
from planner.problems.regions import Region
from planner.robots import Robot
from planner.spatial import FloatArray, Pose
from planner.tool_motions.redundancy.coordinates import OpenCoordinates
from planner.tool_motions.redundancy.way import FINE_DISTANCE, MOST_REFINEMENTS, first_values, may_choose, nearby_shares

STARTS = 2
"""Number of the first values of each configuration around which finer ones are tried: the best ones."""


def flattest_solutions(
    robot: Robot, pose: Pose, region: Region, options: InverseKinematicsOptions, near: FloatArray
) -> list[tuple[FloatArray, FloatArray]]:
    """Return joint positions (joints,) with the least tilts, and the offsets (ranges,) of their poses in the region.

    There are some of each configuration. Among equally flat ones, the nearest count.

    Args:
        robot: A robot with a positioner.
        pose: The pose as it is written.
        region: Its tolerance region; without ranges, the pose stays.
        options: How poses are solved.
        near: (joints,), rad or m, where the robot comes from.
    """
    coordinates = OpenCoordinates(robot, region)
    if pose.rotation is None or not may_choose(coordinates) or coordinates.form is None:
        return []
    first, spacing = first_values(coordinates)
    around, shrink = nearby_shares(len(spacing))
    _, positions, values, costs = _solved(coordinates, pose, first, near)
    keys = [tuple(row) for row in np.sign(np.nan_to_num(sides_of(robot, positions))).tolist()]
    best: dict[tuple[float, ...], list[int]] = {}
    for row in costs.argsort(kind="stable").tolist():
        rows = best.setdefault(keys[row], [])
        if len(rows) < STARTS:
            rows.append(row)
    rows = [row for kept in best.values() for row in kept]
    values, positions, costs = values[rows], positions[rows], costs[rows]
    for _ in range(MOST_REFINEMENTS):
        if not rows or spacing.max() <= FINE_DISTANCE * shrink:
            break
        finer = np.clip(values[:, None] + around * spacing, coordinates.first, coordinates.last)
        every = np.repeat(np.arange(len(rows)), len(around))
        kept, more, finer_values, more_costs = _solved(
            coordinates, pose, finer.reshape(len(every), -1), near, positions[every]
        )
        for k in more_costs.argsort(kind="stable")[::-1].tolist():  # the best one last
            start = every[kept[k]]
            if more_costs[k] < costs[start]:
                values[start], positions[start], costs[start] = finer_values[k], more[k], more_costs[k]
        spacing = spacing * shrink
    found = []
    for value, position in zip(values, positions, strict=True):
        offsets = value[coordinates.carried :]
        there = region.pose(pose, offsets) if region.ranges else pose
        solved = Search(robot, there, options).solve(position, STEADY)
        found += [] if solved is None else [(solved, offsets)]
    return found


def _solved(
    coordinates: OpenCoordinates, pose: Pose, values: FloatArray, near: FloatArray, like: FloatArray | None = None
) -> tuple[np.ndarray, FloatArray, FloatArray, FloatArray]:
    """Return the rows (M,) of values (N, coordinates) with joint positions that reach the pose, these and their costs.

    Returns:
        The rows, joint positions (M, joints), values (M, coordinates), and costs (M,), s.
    """
    count, robot = len(values), coordinates.robot
    assert pose.rotation is not None  # noqa: S101 - asked for before
    points, axes = np.tile(pose.position, (count, 1)), np.tile(pose.rotation, (count, 1, 1))
    states = coordinates.states(points, axes, values, like, np.zeros(count))
    positions = nearest_turn(robot, states.positions, near)
    inside = ((positions >= robot.limit("lower")) & (positions <= robot.limit("upper"))).all(axis=1)
    rows, positions = states.rows[inside], positions[inside]
    costs = motion_costs(robot, near, positions, "continuous") + PREFERENCE_WEIGHT * tilts(robot, positions)
    carried = coordinates.carried  # whose turns are the nearest ones
    return rows, positions, np.hstack([positions[:, :carried], values[rows, carried:]]), costs
