"""Poses whose turn about the tool's z axis is free: of all turns, that to the posture nearest to the one before."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.kinematics.configurations import in_configuration
from planner.kinematics.inverse import inverse_kinematics, solution_layers
from planner.kinematics.search import QUICK, Search
from planner.kinematics.turns import TURN
from planner.problem import JointWaypoint, PoseWaypoint, RelativeWaypoint
from planner.robots.tools import with_tools
from planner.spatial import Pose, rotation_z
from planner.waypoints.choice import MOTION_PENALTY, joint_times
from planner.waypoints.targets import wanted_poses

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.kinematics.options import InverseKinematicsOptions
    from planner.problem import AnyWaypoint
    from planner.robots import Robot
    from planner.spatial import FloatArray

SWEEP = 72
"""Number of turns that are tried at first: every five degrees, so that no branch of solutions is missed."""

REFINED = 3
"""Number of the best of them around which the turn is refined: the best branches, and neighbours on them."""

SECTIONS = 16
"""Golden sections of the five degrees to either side: to a ten-thousandth of a radian."""

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
"""The golden ratio, without unit, by which the part looked at shrinks with each section."""


def with_chosen_rotations(
    robot: Robot, waypoints: Sequence[AnyWaypoint], options: InverseKinematicsOptions
) -> tuple[AnyWaypoint, ...]:
    """Choose the free turns of waypoints, one after the other; the others stay as they are.

    The posture at a pose that is asked in full is taken to be the one nearest to the posture before. Where no turn of a
    free pose can be reached, its own orientation is what is asked.

    Args:
        robot: The robot, with the tool that it has until a waypoint changes it.
        waypoints: The waypoints as they are asked.
        options: How poses are solved; the way starts at their reference, or else in the middle of the limits.
    """
    chosen = list(waypoints)
    free = [k for k, waypoint in enumerate(chosen) if isinstance(waypoint, PoseWaypoint) and waypoint.free]
    robots = with_tools(robot, [waypoint.tool for waypoint in waypoints])
    near = robot.middle if options.reference is None else np.array(options.reference)
    origin = 0
    for k in range(free[-1] + 1 if free else 0):
        waypoint = chosen[k]
        if isinstance(waypoint, PoseWaypoint) and waypoint.free:
            chosen[k] = waypoint = replace(waypoint, pose=_chosen(robots[k], waypoint, near, options), free=None)
        if isinstance(waypoint, JointWaypoint):
            near = np.array(waypoint.position)
        elif k < free[-1]:
            origin = origin if isinstance(waypoint, RelativeWaypoint) else k
            pose = wanted_poses(robots[origin : k + 1], chosen[origin : k + 1])[-1]
            solved = None if pose is None else inverse_kinematics(robots[k], pose, options, near)
            near = near if solved is None or solved.status != "solved" else solved.position
        origin = k if isinstance(waypoint, JointWaypoint) else origin
    return tuple(chosen)


def _chosen(robot: Robot, waypoint: PoseWaypoint, near: FloatArray, options: InverseKinematicsOptions) -> Pose:
    """Return the pose of a waypoint, turned about its z axis to the posture nearest to another (joints,)."""

    def turned(angle: float) -> Pose:
        return Pose(waypoint.pose.position, waypoint.pose.rotation @ rotation_z(angle))  # type: ignore[operator]

    def search(angle: float) -> Search:
        pose = turned(angle)
        return Search(robot, pose if waypoint.frame is None else pose.from_frame(waypoint.frame), options)

    def solved(angle: float, start: FloatArray) -> tuple[float, FloatArray]:
        """Return the cost of the solution that a descent from `start` ends at, and the solution."""
        q = search(angle).solve(start, **QUICK)
        if q is None or not in_configuration(robot, [q], waypoint.configuration):
            return np.inf, start
        return _cost(robot, near, q), q

    angles = TURN * np.arange(SWEEP) / SWEEP
    layers = solution_layers(robot, [search(angle).pose for angle in angles.tolist()], options, near)
    found = [
        (_cost(robot, near, q), angle, q)
        for angle, layer in zip(angles.tolist(), layers, strict=True)
        for q in in_configuration(robot, layer, waypoint.configuration)
    ]
    if robot.dof > search(0.0).rows:  # what is known of a continuum is a spread: these are the solutions nearby
        start = np.clip(near, robot.limit("lower"), robot.limit("upper"))
        nearby = [(angle, *solved(angle, start)) for angle in angles.tolist()]
        found += [(cost, angle, q) for angle, cost, q in nearby if np.isfinite(cost)]
    if not found:
        return waypoint.pose
    found.sort(key=lambda entry: entry[0])
    best_cost, best, _ = found[0]
    for _, angle, q in found[:REFINED]:
        first, last = angle - TURN / SWEEP, angle + TURN / SWEEP
        for _ in range(SECTIONS):
            left, right = last - GOLDEN * (last - first), first + GOLDEN * (last - first)
            (at_left, q_left), (at_right, q_right) = solved(left, q), solved(right, q)
            first, last = (first, right) if at_left <= at_right else (left, last)
            cost, at, q = min((at_left, left, q_left), (at_right, right, q_right), key=lambda entry: entry[0])
            best_cost, best = (cost, at) if cost < best_cost else (best_cost, best)
    return turned(best)


def _cost(robot: Robot, start: FloatArray, end: FloatArray) -> float:
    """Return the cost of a motion, s: the time of its slowest joint, and a little of those of all."""
    times = joint_times(robot, start, end)
    return float(times.max() + MOTION_PENALTY * times.sum())
